// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior of a grid whose bits do not fit into memory. The walls are kept as bricks, on disk beyond a budget;
// the flood goes slab by slab, up and down, and passes from one to the next through their faces, until none gets news.
// What it reaches is a set, so the order does not show: the bits are those of a flood of the whole grid. A path that
// winds up and down takes as many sweeps as it has turns. Several machines may have a part of the grid each, and tell
// each other of their borders (mpi_exterior.hpp). Needs POSIX files.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid/core/bit_grid.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// One body. Members throw std::bad_alloc, and std::system_error of files.
class slab_exterior {
public:
    // extent: of the whole grid, in voxels. closing: as solid_options has it. budget: bytes that may be held, about;
    // four layers of bits for each of its slabs, which begin at multiples of 8 layers, come on top. folder: for a
    // temporary file. threads: at least 1.
    slab_exterior(glm::ivec3 extent, int closing, std::uint64_t budget, std::string folder, unsigned threads)
        : slab_exterior(extent, closing, budget, std::move(folder), threads, {0, extent.z}) {}
    // Floods for a part of the grid, not empty: its layers [begin, end) along z.
    slab_exterior(glm::ivec3 extent, int closing, std::uint64_t budget, std::string folder, unsigned threads,
                  layer_range part)
        : extent_(extent), padded_(extent + 2 * (closing + 1)), closing_(closing), threads_(threads),
          part_(layers_of(extent, closing, part)), depth_(depth_for(budget / 2)), first_slab_(part.begin / depth_),
          slabs_(static_cast<std::size_t>((part.end + depth_ - 1) / depth_ - first_slab_)), bins_(slabs_.size()),
          walls_(budget / 2, bins_.size(), std::move(folder)) {}
    // Bytes that are held for a budget, at least.
    [[nodiscard]] static double least_bytes(glm::ivec3 extent, int closing) {
        const int layers = 5 * brick + 2 * closing + 4 * ((extent.z + brick - 1) / brick);
        return layer_bytes(extent + 2 * (closing + 1)) * layers;
    }
    // Slabs of its own, by the budget.
    [[nodiscard]] std::size_t num_slabs() const { return slabs_.size(); }
    // Slabs that have been flooded, those counted again that were more than once.
    [[nodiscard]] std::uint64_t num_visits() const { return visits_; }

    // Voxels of the conservative cover, without tiles: of the whole grid or a crop of it. In any order; bricks may come
    // in parts.
    void add_walls(const brick_table& cover) {
        for (std::uint64_t b = 0; b < cover.count; ++b) add({cover.keys[b], cover.masks[b]});
    }

    // Finds what is outside, in a part from what is known of the others. All walls are there.
    void flood() {
        for (bool any = true; any;) {
            any = false;
            for (std::size_t s = 0; s < slabs_.size(); ++s) any |= visit_if_needed(s);
            for (std::size_t s = slabs_.size(); s-- > 0;) any |= visit_if_needed(s);
        }
    }

    // The voxels of a box of the grid that are inside, after flood(). Cheapest by ascending z.
    [[nodiscard]] core::bit_grid inside(const glm::ivec3& begin, const glm::ivec3& size) {
        const int ring = closing_ + 1, low = begin.z + ring, high = low + size.z; // padded layers
        const int first = std::max(0, low - closing_), last = std::min(padded_.z, high + closing_);
        core::bit_grid outside({padded_.x, padded_.y, last - first});
        visit_outside({first, last}, [&](int z, const std::uint64_t* bits) {
            std::copy_n(bits, layer_words(extent_, closing_), outside.row(0, z - first));
        });
        for (const auto& [z, bits] : beyond_)
            if (z >= first && z < last)
                std::copy_n(bits.data(), layer_words(extent_, closing_), outside.row(0, z - first));
        core::dilate(outside, closing_, threads_);
        core::bit_grid result(size);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; x += 32) {
                    std::uint32_t bits = ~outside.get_bits(begin.x + x + ring, begin.y + y + ring, low + z - first);
                    if (size.x - x < 32) bits &= (1u << (size.x - x)) - 1;
                    result.set_bits(x, y, z, bits);
                }
        return result;
    }

    // ---- for several machines, each of which has a part of the grid ----
    //
    // Layers count from the lowest one around the grid. Each part takes the walls within `closing` layers around it,
    // then what its neighbours reach beside it, until none gets news, and before inside() what is outside within
    // `closing` layers around it.

    // Walls in a brick of 8^3 voxels.
    struct wall_brick {
        std::uint64_t key; // as in brick_table
        brick_mask mask;   // the voxels, in Morton order
    };
    // The layers of a part, with those around the grid at its ends; none of an empty one.
    [[nodiscard]] static layer_range layers_of(glm::ivec3 extent, int closing, layer_range part) {
        if (part.size() == 0) return {};
        const int ring = closing + 1;
        return {part.begin == 0 ? 0 : part.begin + ring, part.end == extent.z ? part.end + 2 * ring : part.end + ring};
    }
    // Words of a layer of bits, in rows along x.
    [[nodiscard]] static std::size_t layer_words(glm::ivec3 extent, int closing) {
        const glm::ivec3 padded = extent + 2 * (closing + 1);
        return (static_cast<std::size_t>(padded.x) + 63) / 64 * static_cast<std::size_t>(padded.y);
    }
    // Calls visit(wall_brick) for the bricks that have come and meet some layers, before others' are taken.
    template <class Visit>
    void visit_walls(layer_range layers, const Visit& visit) const {
        for (const bin<wall_brick>& b : bins_)
            b.for_each_block([&](std::span<const wall_brick> bricks) {
                for (const wall_brick& wall : bricks) {
                    const int first = core::morton_position(wall.key).z * brick + closing_ + 1;
                    if (first < layers.end && first + brick > layers.begin) visit(wall);
                }
            });
    }
    // Walls of another part.
    void take_walls(std::span<const wall_brick> bricks) {
        for (const wall_brick& wall : bricks) add(wall);
    }
    // After flood(): what is reached in the lowest layer of the part (end 0) or in its highest one (end 1).
    [[nodiscard]] std::span<const std::uint64_t> reached_at(int end) const {
        return end == 0 ? slabs_.front().reached[0] : slabs_.back().reached[1];
    }
    // What another part reaches in the layer below this one (end 0) or above it (end 1). True if flood() has more to
    // do.
    [[nodiscard]] bool take_reached(int end, std::span<const std::uint64_t> reached) {
        beside_[end].assign(reached.begin(), reached.end());
        return has_news(end == 0 ? 0 : slabs_.size() - 1);
    }
    // After all floods: calls visit(z, words) for the outside in those of some layers that are this part's, upwards.
    template <class Visit>
    void visit_outside(layer_range layers, const Visit& visit) {
        for (std::size_t s = 0; s < slabs_.size(); ++s) {
            const int from = std::max(layers.begin, first_layer(s)), to = std::min(layers.end, last_layer(s));
            if (from >= to) continue;
            const core::bit_grid& reached = reached_in(s);
            for (int z = from; z < to; ++z) visit(z, reached.row(0, z - first_layer(s)));
        }
    }
    // The outside in a layer of another part.
    void take_outside(int z, std::span<const std::uint64_t> bits) { beyond_[z].assign(bits.begin(), bits.end()); }

private:
    static constexpr int brick = core::sparse_brick_size;
    using face = std::vector<std::uint64_t>; // a layer of bits
    // The lowest and the highest layer of a slab: what has been reached, and what is open and has not.
    struct slab_faces {
        face reached[2], left[2];
        bool is_known = false;
    };

    // Bytes of a layer of bits.
    [[nodiscard]] static double layer_bytes(glm::ivec3 extent) {
        const int words = (extent.x + 63) / 64;
        return 8.0 * words * extent.y;
    }
    // Layers of a slab: walls, what is reached in it and in two more, rows that wait, and a window that is larger by
    // `closing` on either side.
    [[nodiscard]] int depth_for(std::uint64_t bytes) const {
        const double layer = layer_bytes(padded_), waiting = 8 * static_cast<double>(padded_.y);
        const double layers = (static_cast<double>(bytes) - 2 * closing_ * layer) / (4 * layer + waiting);
        const int most = 1 + extent_.z / brick;
        return static_cast<int>(std::clamp<double>(layers / brick, 1, most)) * brick;
    }
    // Layers count from the lowest one around the grid; the slabs at the ends have those around it.
    [[nodiscard]] int first_layer(std::size_t s) const {
        return s == 0 ? part_.begin : (first_slab_ + static_cast<int>(s)) * depth_ + closing_ + 1;
    }
    [[nodiscard]] int last_layer(std::size_t s) const {
        return s + 1 == slabs_.size() ? part_.end : first_layer(s + 1);
    }
    // Walls beyond a part lie with those of its end.
    void add(const wall_brick& wall) {
        const int s = core::morton_position(wall.key).z * brick / depth_ - first_slab_;
        walls_.push(bins_, static_cast<std::size_t>(std::clamp(s, 0, static_cast<int>(bins_.size()) - 1)), wall);
    }

    // The walls of a slab, grown by `closing`.
    [[nodiscard]] core::bit_grid walls_of(std::size_t slab) const {
        const int first = std::max(0, first_layer(slab) - closing_),
                  last = std::min(padded_.z, last_layer(slab) + closing_), ring = closing_ + 1;
        core::bit_grid walls({padded_.x, padded_.y, last - first});
        for (std::size_t s = 0; s < slabs_.size(); ++s) {
            if (last_layer(s) <= first || first_layer(s) >= last) continue;
            bins_[s].for_each_block([&](std::span<const wall_brick> bricks) {
                for (const wall_brick& b : bricks) {
                    const glm::ivec3 at = core::morton_position(b.key) * brick + ring;
                    for (int row = 0; row < brick * brick; ++row) {
                        const int y = at.y + row % brick, z = at.z + row / brick - first;
                        const std::uint32_t bits = row_of(b.mask, row % brick, row / brick);
                        if (bits != 0 && z >= 0 && z < last - first) walls.set_bits(at.x, y, z, bits);
                    }
                }
            });
        }
        core::dilate(walls, closing_, threads_);
        walls.keep_layers(first_layer(slab) - first, last_layer(slab) - first_layer(slab));
        return walls;
    }
    // Eight voxels of a brick along x.
    [[nodiscard]] static std::uint32_t row_of(const brick_mask& mask, int y, int z) {
        const auto at = static_cast<unsigned>(core::morton_key(0, y, z));
        const auto two = [](std::uint64_t n) { return (n & 3) | (n >> 6 & 12); };
        // x 0 and 1 are neighbours, 2 and 3 eight bits, 4 to 7 a word further on.
        return static_cast<std::uint32_t>(two(mask.words[at / 64] >> at % 64) | two(mask.words[at / 64 + 1] >> at % 64)
                                                                                    << 4);
    }

    // What is reached in a slab from around the grid and from its neighbours, as far as these are known.
    [[nodiscard]] core::bit_grid flooded(std::size_t s, const core::bit_grid& walls) const {
        core::bit_grid reached(walls.extent());
        core::set_faces(reached, first_layer(s) == 0, last_layer(s) == padded_.z);
        enter(reached_beside(s, 0), walls, reached, 0);
        enter(reached_beside(s, 1), walls, reached, walls.extent().z - 1);
        core::spread(walls, reached);
        return reached;
    }
    // What is reached in the layer below a slab (end 0) or above it (end 1); empty if nothing is there or known.
    [[nodiscard]] const face& reached_beside(std::size_t s, int end) const {
        if (end == 0) return s == 0 ? beside_[0] : slabs_[s - 1].reached[1];
        return s + 1 == slabs_.size() ? beside_[1] : slabs_[s + 1].reached[0];
    }
    static void enter(const face& from, const core::bit_grid& walls, core::bit_grid& reached, int z) {
        const std::uint64_t* const w = walls.row(0, z);
        std::uint64_t* const r = reached.row(0, z);
        for (std::size_t i = 0; i < from.size(); ++i) r[i] |= from[i] & ~w[i];
    }

    // True if a neighbour reaches what the slab has not.
    [[nodiscard]] bool has_news(std::size_t s) const {
        if (!slabs_[s].is_known) return true;
        const auto meets = [](const face& reached, const face& left) {
            for (std::size_t i = 0; i < reached.size(); ++i)
                if ((reached[i] & left[i]) != 0) return true;
            return false;
        };
        return meets(reached_beside(s, 0), slabs_[s].left[0]) || meets(reached_beside(s, 1), slabs_[s].left[1]);
    }
    bool visit_if_needed(std::size_t s) {
        if (!has_news(s)) return false;
        ++visits_;
        const core::bit_grid walls = walls_of(s), reached = flooded(s, walls);
        const std::size_t words = layer_words(extent_, closing_);
        for (const int end : {0, 1}) {
            const int z = end == 0 ? 0 : walls.extent().z - 1;
            const std::uint64_t *const w = walls.row(0, z), *const r = reached.row(0, z);
            slabs_[s].reached[end].assign(r, r + words);
            face& left = slabs_[s].left[end];
            left.resize(words);
            for (std::size_t i = 0; i < words; ++i) left[i] = ~(w[i] | r[i]);
        }
        slabs_[s].is_known = true;
        return true;
    }

    // All that is reached in a slab, after the flood; two are kept.
    [[nodiscard]] const core::bit_grid& reached_in(std::size_t s) {
        if (const auto found = kept_.find(s); found != kept_.end()) return found->second;
        if (kept_.size() > 1) kept_.erase(kept_.begin());
        return kept_.emplace(s, flooded(s, walls_of(s))).first->second;
    }

    glm::ivec3 extent_, padded_; // the grid, and that with what lies around it
    int closing_;
    unsigned threads_;
    layer_range part_; // with what lies around the grid
    int depth_;        // layers of the grid a slab, a multiple of a brick's
    int first_slab_;   // number in the whole grid
    std::vector<slab_faces> slabs_;
    face beside_[2];             // what other parts reach below and above
    std::map<int, face> beyond_; // layers of other parts
    std::vector<bin<wall_brick>> bins_;
    bin_memory<wall_brick> walls_;
    std::uint64_t visits_ = 0;
    std::map<std::size_t, core::bit_grid> kept_;
};

} // namespace voxelpipe::slabs
