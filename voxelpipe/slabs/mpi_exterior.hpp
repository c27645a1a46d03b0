// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior of a grid whose slabs along z lie on the ranks of an MPI communicator. Each rank has the walls of
// its slab and floods that; then neighbours send each other what they reach in the layers at their border, until no
// rank gets news. So a rank holds its own slab, and not the grid. A path that winds through the ranks takes a round for
// each border that it crosses.

#include <voxelpipe/slabs/exterior.hpp>
#include <voxelpipe/slabs/plan.hpp>

#ifndef MPICH_SKIP_MPICXX
#define MPICH_SKIP_MPICXX 1
#endif
#ifndef OMPI_SKIP_MPICXX
#define OMPI_SKIP_MPICXX 1
#endif
#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <vector>

namespace voxelpipe::slabs::detail {

// All members are for every rank, with the same arguments.
class rank_flood {
public:
    // parts: the slabs of the ranks, along z; those without a layer are the last ones.
    rank_flood(MPI_Comm comm, glm::ivec3 extent, int closing, const plan& parts)
        : comm_(comm), closing_(closing), top_(extent.z + 2 * (closing + 1)),
          words_(slab_exterior::layer_words(extent, closing)) {
        MPI_Comm_rank(comm, &rank_);
        for (const layer_range& part : parts.slabs) layers_.push_back(slab_exterior::layers_of(extent, closing, part));
    }

    // mine: the slab of this rank with its walls, or null if it has no layer. attempt(work) calls work() unless this
    // rank has failed, and keeps what goes wrong; all_ok() is true if no rank has failed, and every rank calls it.
    // Returns when all slabs are ready for inside(), or a rank has failed.
    template <class Attempt, class AllOk>
    void run(slab_exterior* mine, const Attempt& attempt, const AllOk& all_ok) const {
        using wall = slab_exterior::wall_brick;
        if (closing_ > 0 && !exchange<wall>(
                                1, attempt, all_ok,
                                [&](layer_range layers, std::vector<wall>& out) {
                                    mine->visit_walls(layers, [&](const wall& w) { out.push_back(w); });
                                },
                                [&](layer_range, std::span<const wall> in) { mine->take_walls(in); }))
            return;
        std::vector<std::uint64_t> from_below, from_above;
        attempt([&] {
            if (mine == nullptr) return;
            from_below.resize(words_);
            from_above.resize(words_);
        });
        for (bool goes_on = true; goes_on;) {
            attempt([&] {
                if (mine != nullptr) mine->flood();
            });
            if (!all_ok()) return;
            int news = 0;
            if (mine != nullptr) exchange_faces(*mine, from_below, from_above);
            attempt([&] {
                if (mine == nullptr) return;
                if (!is_lowest() && mine->take_reached(0, from_below)) news = 1;
                if (!is_highest() && mine->take_reached(1, from_above)) news = 1;
            });
            MPI_Allreduce(MPI_IN_PLACE, &news, 1, MPI_INT, MPI_MAX, comm_);
            goes_on = news != 0;
        }
        if (closing_ == 0) return;
        (void)exchange<std::uint64_t>(
            words_, attempt, all_ok,
            [&](layer_range layers, std::vector<std::uint64_t>& out) {
                mine->visit_outside(
                    layers, [&](int, const std::uint64_t* bits) { out.insert(out.end(), bits, bits + words_); });
            },
            [&](layer_range layers, std::span<const std::uint64_t> in) {
                for (int z = layers.begin; z < layers.end; ++z)
                    mine->take_outside(z, in.subspan(static_cast<std::size_t>(z - layers.begin) * words_, words_));
            });
    }

private:
    // The layers of a rank that another one sees, which lie within `closing` of its own. None of itself.
    [[nodiscard]] layer_range seen(std::size_t by, std::size_t of) const {
        if (by == of || layers_[by].size() == 0 || layers_[of].size() == 0) return {};
        const layer_range r{std::max(layers_[of].begin, layers_[by].begin - closing_),
                            std::min(layers_[of].end, layers_[by].end + closing_)};
        return r.size() > 0 ? r : layer_range{};
    }

    // Sends each rank what it sees of this one's layers: give(layers, out) appends units of `unit` elements, and
    // take(layers, them) gets those of another rank. False if a rank has failed.
    template <class T, class Attempt, class AllOk, class Give, class Take>
    [[nodiscard]] bool exchange(std::size_t unit, const Attempt& attempt, const AllOk& all_ok, const Give& give,
                                const Take& take) const {
        const std::size_t n = layers_.size(), me = static_cast<std::size_t>(rank_);
        std::vector<T> out, in;
        std::vector<int> sent(n), coming(n), out_at(n), in_at(n);
        const auto as_count = [](std::size_t units) { // MPI counts by int
            if (units > static_cast<std::size_t>(std::numeric_limits<int>::max())) throw std::bad_alloc();
            return static_cast<int>(units);
        };
        attempt([&] {
            for (std::size_t to = 0; to < n; ++to) {
                out_at[to] = as_count(out.size() / unit);
                if (const layer_range layers = seen(to, me); layers.size() != 0) give(layers, out);
                sent[to] = as_count(out.size() / unit) - out_at[to];
            }
        });
        if (!all_ok()) return false;
        MPI_Alltoall(sent.data(), 1, MPI_INT, coming.data(), 1, MPI_INT, comm_);
        attempt([&] {
            std::size_t units = 0;
            for (std::size_t from = 0; from < n; ++from) {
                in_at[from] = as_count(units);
                units += static_cast<std::size_t>(coming[from]);
            }
            in.resize(static_cast<std::size_t>(as_count(units)) * unit);
        });
        if (!all_ok()) return false;
        MPI_Datatype type;
        MPI_Type_contiguous(static_cast<int>(sizeof(T) * unit), MPI_BYTE, &type);
        MPI_Type_commit(&type);
        MPI_Alltoallv(out.data(), sent.data(), out_at.data(), type, in.data(), coming.data(), in_at.data(), type,
                      comm_);
        MPI_Type_free(&type);
        attempt([&] {
            for (std::size_t from = 0; from < n; ++from)
                if (const layer_range layers = seen(me, from); layers.size() != 0)
                    take(layers, std::span<const T>(in).subspan(static_cast<std::size_t>(in_at[from]) * unit,
                                                                static_cast<std::size_t>(coming[from]) * unit));
        });
        return all_ok();
    }

    [[nodiscard]] bool is_lowest() const { return rank_ == 0; }
    [[nodiscard]] bool is_highest() const { return layers_[static_cast<std::size_t>(rank_)].end == top_; }
    // Neighbours send each other what they reach at their border.
    void exchange_faces(const slab_exterior& mine, std::span<std::uint64_t> from_below,
                        std::span<std::uint64_t> from_above) const {
        const int below = is_lowest() ? MPI_PROC_NULL : rank_ - 1, above = is_highest() ? MPI_PROC_NULL : rank_ + 1,
                  count = static_cast<int>(words_);
        MPI_Sendrecv(mine.reached_at(1).data(), count, MPI_UINT64_T, above, 0, from_below.data(), count, MPI_UINT64_T,
                     below, 0, comm_, MPI_STATUS_IGNORE);
        MPI_Sendrecv(mine.reached_at(0).data(), count, MPI_UINT64_T, below, 1, from_above.data(), count, MPI_UINT64_T,
                     above, 1, comm_, MPI_STATUS_IGNORE);
    }

    MPI_Comm comm_;
    int closing_, top_; // top_: layers, with those around the grid
    std::size_t words_; // of a layer
    int rank_ = 0;
    std::vector<layer_range> layers_; // of each rank
};

} // namespace voxelpipe::slabs::detail
