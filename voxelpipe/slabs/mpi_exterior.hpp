// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior of a grid whose slabs along z lie on the ranks of an MPI communicator. Each rank has the walls of
// its slab and floods that; then neighbours send each other what they reach in the layers at their border, until no
// rank gets news. So a rank holds its own slab, and not the grid. A path that winds through the ranks takes a round for
// each border that it crosses.

#include <voxelpipe/slabs/exterior.hpp>
#include <voxelpipe/slabs/mpi_ranks.hpp>
#include <voxelpipe/slabs/plan.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe::slabs::detail {

// All members are for every rank, with the same arguments.
class rank_flood {
public:
    rank_flood(const ranks& all, glm::ivec3 extent, int closing)
        : all_(all), extent_(extent), closing_(closing), top_(extent.z + 2 * (closing + 1)),
          words_(slab_exterior::layer_words(extent, closing)) {}

    // parts: the slabs of the ranks, along z; those without a layer are the last ones. mine: that of this rank with its
    // walls, or null if it has no layer. Returns when all slabs are ready for inside(), or a rank has failed.
    void run(const plan& parts, slab_exterior* mine, shared_work& work) {
        using wall = slab_exterior::wall_brick;
        face from_below, from_above;
        work([&] {
            for (const layer_range& part : parts.slabs)
                layers_.push_back(slab_exterior::layers_of(extent_, closing_, part));
            if (mine == nullptr) return;
            from_below.resize(words_);
            from_above.resize(words_);
        });
        if (!work.all_ok()) return;
        if (closing_ > 0 && !exchange<wall>(
                                1, work,
                                [&](layer_range layers, std::vector<wall>& out) {
                                    mine->visit_walls(layers, [&](const wall& w) { out.push_back(w); });
                                },
                                [&](layer_range, std::span<const wall> in) { mine->take_walls(in); }))
            return;
        for (bool news = true; news;) {
            work([&] {
                if (mine != nullptr) mine->flood();
            });
            if (!work.all_ok()) return;
            if (mine != nullptr) exchange_faces(*mine, from_below, from_above);
            news = false;
            work([&] {
                if (mine == nullptr) return;
                if (!is_lowest()) news |= mine->take_reached(0, from_below);
                if (!is_highest()) news |= mine->take_reached(1, from_above);
            });
            news = all_.any(news);
        }
        if (closing_ == 0) return;
        (void)exchange<std::uint64_t>(
            words_, work,
            [&](layer_range layers, face& out) {
                mine->visit_outside(
                    layers, [&](int, const std::uint64_t* bits) { out.insert(out.end(), bits, bits + words_); });
            },
            [&](layer_range layers, std::span<const std::uint64_t> in) {
                for (int z = layers.begin; z < layers.end; ++z)
                    mine->take_outside(z, in.subspan(static_cast<std::size_t>(z - layers.begin) * words_, words_));
            });
    }

private:
    using face = std::vector<std::uint64_t>; // layers of bits

    // The layers of a rank that another one sees, which lie within `closing` of its own. None of itself.
    [[nodiscard]] layer_range seen(std::size_t by, std::size_t of) const {
        if (by == of || layers_[by].size() == 0 || layers_[of].size() == 0) return {};
        const layer_range r{std::max(layers_[of].begin, layers_[by].begin - closing_),
                            std::min(layers_[of].end, layers_[by].end + closing_)};
        return r.size() > 0 ? r : layer_range{};
    }

    // Sends each rank what it sees of this one's layers: give(layers, out) appends units of `unit` elements, and
    // take(layers, them) gets those of another rank. False if a rank has failed.
    template <class T, class Give, class Take>
    [[nodiscard]] bool exchange(std::size_t unit, shared_work& work, const Give& give, const Take& take) const {
        parcels<T> out, in;
        work([&] {
            for (std::size_t to = 0; to < all_.size(); ++to) {
                out.firsts.push_back(as_count(out.elements.size() / unit));
                if (const layer_range layers = seen(to, all_.index()); layers.size() != 0) give(layers, out.elements);
                out.counts.push_back(as_count(out.elements.size() / unit) - out.firsts.back());
            }
        });
        if (!all_to_all(all_, unit, out, in, work)) return false;
        work([&] {
            for (std::size_t from = 0; from < all_.size(); ++from)
                if (const layer_range layers = seen(all_.index(), from); layers.size() != 0)
                    take(layers, std::span<const T>(in.elements)
                                     .subspan(static_cast<std::size_t>(in.firsts[from]) * unit,
                                              static_cast<std::size_t>(in.counts[from]) * unit));
        });
        return work.all_ok();
    }

    [[nodiscard]] bool is_lowest() const { return all_.me() == 0; }
    [[nodiscard]] bool is_highest() const { return layers_[all_.index()].end == top_; }
    // Neighbours send each other what they reach at their border.
    void exchange_faces(const slab_exterior& mine, face& from_below, face& from_above) const {
        const int below = is_lowest() ? MPI_PROC_NULL : all_.me() - 1,
                  above = is_highest() ? MPI_PROC_NULL : all_.me() + 1;
        const auto send = [&](std::span<const std::uint64_t> words, int to, face& in, int from) {
            std::uint64_t* into = in.data();
            for_each_part(words, [&](const std::uint64_t* first, int count) {
                MPI_Sendrecv(first, count, MPI_UINT64_T, to, 0, into, count, MPI_UINT64_T, from, 0, all_.comm(),
                             MPI_STATUS_IGNORE);
                into += count;
            });
        };
        send(mine.reached_at(1), above, from_below, below);
        send(mine.reached_at(0), below, from_above, above);
    }

    const ranks& all_;
    glm::ivec3 extent_;
    int closing_, top_;               // top_: layers, with those around the grid
    std::size_t words_;               // of a layer
    std::vector<layer_range> layers_; // of each rank
};

} // namespace voxelpipe::slabs::detail
