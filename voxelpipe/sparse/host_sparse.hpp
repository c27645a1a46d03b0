// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A sparse framebuffer's contents in host memory: found by voxel, walked brick by brick or voxel by voxel, made dense
// as a whole or in part.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/index_iterator.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/host_target.hpp>

#include <glm/common.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace core {

// True if a target's blend sums in a wider format than it stores.
template <class Target>
inline constexpr bool has_wide_sums =
    !std::is_same_v<typename Target::traits::accumulator, typename Target::value_type>;

struct no_sum {};
template <class Target>
using kept_sum = std::conditional_t<has_wide_sums<Target>, typename Target::traits::accumulator, no_sum>;

// The elements of a target whose every voxel is `value`; padding is as a dense call clears it.
template <class Target>
[[nodiscard]] std::vector<typename Target::element_type> filled_elements(const glm::ivec3& extent,
                                                                         const typename Target::value_type& value) {
    using map = typename Target::map;
    using element = typename Target::element_type;
    if (!fits_memory<Target>(extent))
        throw std::length_error("voxelpipe: a dense target of this extent has more bytes than can be addressed");
    std::vector<element> elements;
    if constexpr (map::is_bit) {
        elements.resize(map::elements(extent));
        if (value)
            for (int z = 0; z < extent.z; ++z)
                for (int y = 0; y < extent.y; ++y)
                    for (int x = 0; x < extent.x; ++x) map::store(elements.data(), extent, x, y, z, true);
    } else if constexpr (map::planes) {
        for (int c = 0; c < map::components; ++c) elements.insert(elements.end(), map::cells(extent), value[c]);
    } else {
        elements.assign(map::elements(extent), value);
    }
    return elements;
}

} // namespace core

// Calls f(glm::ivec3 voxel, std::uint64_t rank) for the voxels of a tile of a host table, in Morton order: one rank for
// all. Voxels are numbered from the corner of the part.
template <class F>
void for_each_voxel_in_tile(const brick_table& table, std::uint64_t tile, F&& f) {
    const brick_tile t = table.tiles[tile];
    const glm::ivec3 origin = t.origin() - table.offset;
    const std::uint64_t rank = table.num_in_bricks() + tile;
    for (std::uint64_t i = 0; i < t.num_voxels(); ++i) f(origin + core::morton_position(i), rank);
}

// Calls f(glm::ivec3 voxel, std::uint64_t rank) for each voxel that exists in a brick of a host table, in Morton order.
// Voxels are numbered from the corner of the part.
template <class F>
void for_each_voxel_in(const brick_table& table, std::uint64_t brick, F&& f) {
    const glm::ivec3 origin = table.brick_origin(brick);
    std::uint64_t rank = table.offsets[brick];
    for (unsigned w = 0; w < 8; ++w)
        for (std::uint64_t word = table.masks[brick].words[w]; word != 0; word &= word - 1)
            f(origin + core::morton_position(64 * w + static_cast<unsigned>(std::countr_zero(word))), rank++);
}

// Calls brick(number) and tile(number) for those of a host table, in the Morton order of their voxels.
template <class Brick, class Tile>
void for_each_brick_and_tile(const brick_table& table, Brick&& brick, Tile&& tile) {
    std::uint64_t t = 0;
    for (std::uint64_t b = 0; b < table.count; ++b) {
        for (; t < table.num_tiles && table.tiles[t].first() < table.keys[b]; ++t) tile(t);
        brick(b);
    }
    for (; t < table.num_tiles; ++t) tile(t);
}

// A copy of a sparse framebuffer in host memory; to be had from sparse_framebuffer::to_host.
template <class... Targets>
class host_sparse {
public:
    static constexpr std::size_t num_targets = sizeof...(Targets); // render targets
    template <std::size_t I>
    using target_type = typename core::pack_element<I, Targets...>::type; // the type of target I

    std::vector<std::uint64_t> keys;    // the arrays of brick_table
    std::vector<brick_mask> masks;      // voxels that exist, per brick
    std::vector<std::uint64_t> offsets; // rank of each brick's first voxel, and the number of all
    std::vector<brick_tile> tiles;      // cubes of bricks of one value, whose ranks follow
    core::pack<std::vector<typename core::rank_map<Targets>::element>...> values; // by rank; none of a disabled target
    core::pack<std::vector<core::kept_sum<Targets>>...> sums;                     // by rank, where they were kept
    core::pack<typename Targets::value_type...> clear_values{};                   // what absent voxels read as
    grid where;                                                                   // of the last call
    bool is_tiled = false; // every full brick is in a tile, as a solid of one constant leaves them

    // Refers to the arrays.
    [[nodiscard]] brick_table table() const {
        return {keys.data(),  masks.data(), offsets.data(), keys.size(),
                where.extent, where.offset, tiles.data(),   tiles.size()};
    }
    [[nodiscard]] std::uint64_t num_bricks() const { return keys.size(); } // Bricks with a voxel.
    [[nodiscard]] std::uint64_t num_tiles() const { return tiles.size(); } // Cubes of full bricks, of solids.
    // Voxels that exist, those of tiles among them.
    [[nodiscard]] std::uint64_t num_voxels() const { return table().num_voxels(); }
    // Values of a target: one for each voxel that exists in a brick, and one for each tile.
    [[nodiscard]] std::uint64_t num_values() const { return (offsets.empty() ? 0 : offsets.back()) + tiles.size(); }
    // True if a voxel exists, numbered from the corner of the part; false outside.
    [[nodiscard]] bool contains(const glm::ivec3& voxel) const { return table().find(voxel) != brick_table::none; }

    // One brick: where it lies, and which voxels of it exist.
    struct brick_entry {
        glm::ivec3 origin;      // its first voxel, from the corner of the part; negative where a crop cuts the brick
        const brick_mask& mask; // which of its 512 voxels exist
        std::uint64_t first;    // rank of the first of them
    };
    // Brick i in Morton order, 0 <= i < num_bricks().
    [[nodiscard]] brick_entry brick(std::uint64_t i) const {
        VOXELPIPE_EXPECTS(i < num_bricks());
        return {table().brick_origin(i), masks[i], offsets[i]};
    }
    // A random-access range of brick_entry, in Morton order. Refers to the arrays.
    class brick_range {
    public:
        // Refers to the host_sparse.
        explicit brick_range(const host_sparse& owner) : owner_(&owner) {}
        [[nodiscard]] auto begin() const { return core::index_iterator(brick_at{owner_}, 0); }
        [[nodiscard]] auto end() const { return core::index_iterator(brick_at{owner_}, owner_->keys.size()); }
        [[nodiscard]] std::size_t size() const { return owner_->keys.size(); }
        [[nodiscard]] brick_entry operator[](std::size_t i) const { return owner_->brick(i); }

    private:
        struct brick_at {
            const host_sparse* owner = nullptr;
            brick_entry operator()(std::size_t i) const { return owner->brick(i); }
        };
        const host_sparse* owner_;
    };
    [[nodiscard]] brick_range bricks() const { return brick_range(*this); } // All bricks.

    // One tile: where it lies, its voxels a side, and the rank of its value.
    struct tile_entry {
        glm::ivec3 origin;  // its first voxel, from the corner of the part
        int side;           // voxels
        std::uint64_t rank; // of its value, in the values of each target
    };
    // Tile i in Morton order, 0 <= i < num_tiles().
    [[nodiscard]] tile_entry tile(std::uint64_t i) const {
        VOXELPIPE_EXPECTS(i < num_tiles());
        return {tiles[i].origin() - where.offset, tiles[i].side(), (offsets.empty() ? 0 : offsets.back()) + i};
    }

    // Calls f(glm::ivec3 voxel, std::uint64_t rank) for every voxel that exists, in Morton order. Those of a tile have
    // the tile's rank.
    template <class F>
    void for_each_voxel(F&& f) const {
        const brick_table t = table();
        for_each_brick_and_tile(
            t, [&](std::uint64_t b) { for_each_voxel_in(t, b, f); },
            [&](std::uint64_t i) { for_each_voxel_in_tile(t, i, f); });
    }

    // One target: vp::get<I>(host). Refers to the host_sparse.
    template <std::size_t I>
    class target_reference {
    public:
        using target = typename core::pack_element<I, Targets...>::type; // the target's type
        using value_type = typename target::value_type;
        // Refers to the host_sparse.
        explicit target_reference(const host_sparse& owner) : owner_(owner) {}

        // The value of a voxel that exists. The target is not disabled.
        [[nodiscard]] value_type operator[](std::uint64_t rank) const {
            VOXELPIPE_EXPECTS(rank < owner_.num_values());
            return core::rank_map<target>::load(get<I>(owner_.values).data(), rank);
        }
        // The value of any voxel of the part: the clear value, where it does not exist.
        [[nodiscard]] value_type operator()(int x, int y, int z) const {
            const std::uint64_t rank = owner_.table().find({x, y, z});
            return rank == brick_table::none ? get<I>(owner_.clear_values) : (*this)[rank];
        }
        // False if the framebuffer was made without the target.
        [[nodiscard]] bool enabled() const { return owner_.num_values() == 0 || !get<I>(owner_.values).empty(); }

        // The dense target: the same elements as a dense framebuffer's. Throws std::length_error where it cannot be
        // addressed.
        [[nodiscard]] host_target<target> to_dense() const {
            const glm::ivec3 extent = owner_.where.extent;
            host_target<target> dense{core::filled_elements<target>(extent, get<I>(owner_.clear_values)), extent};
            if (!enabled()) return {{}, extent};
            owner_.for_each_voxel([&](const glm::ivec3& v, std::uint64_t rank) {
                target::map::store(dense.elements.data(), extent, v.x, v.y, v.z, (*this)[rank]);
            });
            return dense;
        }
        // The part [begin, begin + size), addressed by the voxels of the whole. Throws std::out_of_range if it is not
        // within the extent.
        [[nodiscard]] host_region<target> to_dense_region(glm::ivec3 begin, glm::ivec3 size) const {
            const glm::ivec3 extent = owner_.where.extent;
            for (int a = 0; a < 3; ++a)
                if (begin[a] < 0 || size[a] < 0 || size[a] > extent[a] - begin[a])
                    throw std::out_of_range("voxelpipe: a region to read that is not within the framebuffer");
            if (!enabled() || size.x == 0 || size.y == 0 || size.z == 0) return {};
            host_region<target> region(extent, begin, size);
            const glm::ivec3 end = begin + size;
            for (int z = begin.z; z < end.z; ++z)
                for (int y = begin.y; y < end.y; ++y)
                    for (int x = begin.x; x < end.x; ++x) region.store(x, y, z, get<I>(owner_.clear_values));
            const brick_table t = owner_.table();
            for (std::uint64_t i = 0; i < t.num_tiles; ++i) {
                const tile_entry tile = owner_.tile(i);
                const glm::ivec3 low = glm::max(tile.origin, begin), high = glm::min(tile.origin + tile.side, end);
                for (int z = low.z; z < high.z; ++z)
                    for (int y = low.y; y < high.y; ++y)
                        for (int x = low.x; x < high.x; ++x) region.store(x, y, z, (*this)[tile.rank]);
            }
            const auto visit = [&](std::uint64_t b) {
                for_each_voxel_in(t, b, [&](const glm::ivec3& v, std::uint64_t rank) {
                    if (v.x >= begin.x && v.y >= begin.y && v.z >= begin.z && v.x < end.x && v.y < end.y && v.z < end.z)
                        region.store(v.x, v.y, v.z, (*this)[rank]);
                });
            };
            // Bricks are looked up where the box has fewer than the table.
            const glm::ivec3 first = (begin + t.offset) >> core::log2_sparse_brick,
                             last = (end - 1 + t.offset) >> core::log2_sparse_brick, n = last - first + 1;
            if (static_cast<double>(n.x) * n.y * n.z > static_cast<double>(t.count)) {
                for (std::uint64_t b = 0; b < t.count; ++b) visit(b);
                return region;
            }
            for (int z = first.z; z <= last.z; ++z)
                for (int y = first.y; y <= last.y; ++y)
                    for (int x = first.x; x <= last.x; ++x)
                        if (const std::uint64_t b = t.find_brick(core::morton_key(x, y, z)); b != brick_table::none)
                            visit(b);
            return region;
        }

    private:
        const host_sparse& owner_;
    };
};

template <std::size_t I, class... Targets>
[[nodiscard]] auto get(const host_sparse<Targets...>& h) {
    return typename host_sparse<Targets...>::template target_reference<I>(h);
}

// True if two hold the same bits: bricks, tiles, voxels and the values of all targets. Where they lie in space and what
// absent voxels read as is not compared. Values that are structs need an operator==.
template <class... Targets>
[[nodiscard]] bool same_contents(const host_sparse<Targets...>& a, const host_sparse<Targets...>& b) {
    bool same = a.keys == b.keys && a.masks == b.masks && a.offsets == b.offsets && a.tiles == b.tiles;
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto &x = get<I>(a.values), &y = get<I>(b.values);
        same = same && x.size() == y.size();
        for (std::size_t i = 0; same && i < x.size(); ++i) same = core::is_same_value(x[i], y[i]);
    });
    return same;
}

} // namespace voxelpipe
