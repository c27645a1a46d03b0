// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Leaves and nodes of a NanoVDB file, made from bricks and tiles: a leaf is a brick, with z fastest instead of Morton
// order; a tile becomes active values of the node that its size asks for.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>
#include <voxelpipe/sparse/io/nanovdb_statistics.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

namespace voxelpipe::io::nanovdb {

static_assert(std::endian::native == std::endian::little,
              "voxelpipe: files of NanoVDB are written on such machines only");

// ---- leaves
// -----------------------------------------------------------------------------------------------------------

// The place in a leaf, (x * 8 + y) * 8 + z, of each voxel of a brick in Morton order.
inline constexpr auto leaf_places = [] {
    std::array<std::uint16_t, 512> p{};
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            for (int z = 0; z < 8; ++z) p[core::morton_key(x, y, z)] = static_cast<std::uint16_t>((x * 8 + y) * 8 + z);
    return p;
}();

// The box of a brick's voxels, in the whole grid.
[[nodiscard]] inline box box_of(const brick_mask& mask, const glm::ivec3& origin) {
    box b{{7, 7, 7}, {0, 0, 0}};
    for (unsigned w = 0; w < 8; ++w) {
        for (std::uint64_t word = mask.words[w]; word != 0; word &= word - 1) {
            const glm::ivec3 p = core::morton_position(64 * w + static_cast<unsigned>(std::countr_zero(word)));
            for (int a = 0; a < 3; ++a) {
                b.low[a] = std::min(b.low[a], p[a]);
                b.high[a] = std::max(b.high[a], p[a]);
            }
        }
    }
    for (int a = 0; a < 3; ++a) {
        b.low[a] += origin[a];
        b.high[a] += origin[a];
    }
    return b;
}

template <class T>
using stored_value = typename value_type<T>::stored;

// A grid to write. value(rank) is asked for voxels that exist; a mask has no values.
template <class T>
struct source {
    std::string name;                                         // at most 255 bytes
    brick_table table;                                        // bricks; its arrays stay the caller's until write()
    grid where;                                               // the map from indices to the world
    stored_value<T> background{};                             // what absent voxels read as
    std::function<stored_value<T>(std::uint64_t rank)> value; // of a voxel that exists
    grid_class meaning = value_type<T>::meaning;              // the class that the file states
    // A level set: `meaning` says so, and `inside` has a mask for each brick, of voxels that read as -background unless
    // they exist; a brick of the table may be empty then. The table's tiles are cubes of such voxels, which are not
    // active: `value` is not asked for them. Numbers alone; not owned, has to stay until write().
    const brick_mask* inside = nullptr;
};

// Tiles are active but in level sets.
template <class T>
[[nodiscard]] bool has_active_tiles(const source<T>& from) {
    return from.inside == nullptr;
}
// The active voxels of a grid.
template <class T>
[[nodiscard]] std::uint64_t num_active(const source<T>& from) {
    return has_active_tiles(from) ? from.table.num_voxels() : from.table.num_in_bricks();
}
// What a voxel inside a level set reads as, beyond its band.
template <class T>
[[nodiscard]] stored_value<T> inside_value(const source<T>& from) {
    if constexpr (std::is_floating_point_v<stored_value<T>>)
        return -from.background;
    else
        return from.background;
}

template <class T>
[[nodiscard]] statistics<T> leaf_statistics(const source<T>& from, std::uint64_t brick) {
    statistics<T> s;
    if constexpr (value_type<T>::has_statistics) {
        for (std::uint64_t r = from.table.offsets[brick]; r < from.table.offsets[brick + 1]; ++r) s.add(from.value(r));
    } else {
        s.count = from.table.offsets[brick + 1] - from.table.offsets[brick];
    }
    if (s.count == 0) return s; // in a level set
    s.voxels = box_of(from.table.masks[brick], core::morton_position(from.table.keys[brick]) * core::sparse_brick_size);
    return s;
}

template <class T>
void fill_leaf(const source<T>& from, std::uint64_t brick, leaf_node<T>& leaf) {
    std::memset(static_cast<void*>(&leaf), 0, sizeof(leaf));
    const statistics<T> s = leaf_statistics(from, brick);
    const glm::ivec3 origin = core::morton_position(from.table.keys[brick]) * core::sparse_brick_size;
    for (int a = 0; a < 3; ++a) {
        // The origin is found by rounding down to multiples of eight.
        leaf.head.low[a] = s.count == 0 ? origin[a] : s.voxels.low[a];
        if (s.count != 0) leaf.head.size[a] = static_cast<std::uint8_t>(s.voxels.high[a] - s.voxels.low[a]);
        VOXELPIPE_ASSERT((leaf.head.low[a] & ~7) == origin[a]);
    }
    leaf.head.flags = s.count == 0 ? 0 : 2; // has a box
    const brick_mask& mask = from.table.masks[brick];
    std::uint64_t rank = from.table.offsets[brick];
    if constexpr (!std::is_same_v<T, bool> && !std::is_same_v<T, mask_value>) {
        s.write_to(leaf);
        std::fill(std::begin(leaf.values), std::end(leaf.values), from.background);
        if (from.inside != nullptr)
            for (unsigned bit = 0; bit < 512; ++bit)
                if (from.inside[brick].has(bit)) leaf.values[leaf_places[bit]] = inside_value(from);
    }
    for (unsigned w = 0; w < 8; ++w) {
        for (std::uint64_t word = mask.words[w]; word != 0; word &= word - 1, ++rank) {
            const unsigned place = leaf_places[64 * w + static_cast<unsigned>(std::countr_zero(word))];
            leaf.head.mask[place / 64] |= std::uint64_t{1} << (place % 64);
            if constexpr (std::is_same_v<T, bool>)
                leaf.values[place / 64] |= std::uint64_t{from.value(rank)} << (place % 64);
            else if constexpr (!std::is_same_v<T, mask_value>)
                leaf.values[place] = from.value(rank);
        }
    }
}

// ---- the nodes above
// --------------------------------------------------------------------------------------------------

// Levels of tiles that are values of lower nodes, of upper ones and of the root.
inline constexpr int lower_tiles = 0, upper_tiles = 4, root_tiles = 9;

// The value of a tile; true where the grid has no values.
template <class T>
[[nodiscard]] stored_value<T> tile_value(const source<T>& from, std::uint64_t tile) {
    if (!has_active_tiles(from)) return inside_value(from);
    if constexpr (std::is_same_v<T, mask_value>)
        return true;
    else
        return from.value(from.table.num_in_bricks() + tile);
}

// Nodes of one level: their Morton keys, the first child of each among the level below, and one more, and the numbers
// of the tiles that are their values, with the first of each node among those, and one more.
struct level {
    std::vector<std::uint64_t> keys, first, tiles, first_tile;
};
// Parents of nodes with these keys, and of the tiles of levels [low, high). A tile's key in this level is that of its
// first brick without the lowest `tile_shift` bits.
[[nodiscard]] inline level parents_of(const std::uint64_t* keys, std::uint64_t count, int shift,
                                      const brick_table& table, int low, int high, int tile_shift) {
    level l;
    std::uint64_t t = 0, i = 0;
    const auto next_tile = [&] {
        while (t < table.num_tiles && (table.tiles[t].level() < low || table.tiles[t].level() >= high)) ++t;
        return t < table.num_tiles ? table.tiles[t].first() >> tile_shift : ~std::uint64_t{0};
    };
    while (true) {
        const std::uint64_t of_tile = next_tile(), of_node = i < count ? keys[i] >> shift : ~std::uint64_t{0};
        const std::uint64_t key = std::min(of_tile, of_node);
        l.first.push_back(i);
        l.first_tile.push_back(l.tiles.size());
        if (key == ~std::uint64_t{0}) return l;
        l.keys.push_back(key);
        while (i < count && keys[i] >> shift == key) ++i;
        while (next_tile() == key) l.tiles.push_back(t++);
    }
}

// Offsets of the parts of a grid, in bytes from its start.
template <class T>
struct grid_plan {
    using lower_node = internal_node<T, 4>;
    using upper_node = internal_node<T, 5>;
    level lower, upper;
    // Children of the root by their keys there: upper nodes, or tiles, whole or in part.
    struct root_child {
        std::uint64_t key, number;
        bool is_tile;
    };
    std::vector<root_child> root_children;
    std::uint64_t num_tiles[3]{}; // values of lower nodes, of upper ones and of the root
    std::uint64_t root, first_upper, first_lower, first_leaf, size;

    explicit grid_plan(const brick_table& table)
        : lower(parents_of(table.keys, table.count, 12, table, lower_tiles, upper_tiles, 12)),
          upper(parents_of(lower.keys.data(), lower.keys.size(), 15, table, upper_tiles, root_tiles, 27)) {
        for (std::uint64_t i = 0; i < upper.keys.size(); ++i)
            root_children.push_back({root_key(upper.keys[i]), i, false});
        for (std::uint64_t t = 0; t < table.num_tiles; ++t) {
            const int level = table.tiles[t].level();
            const int base = level < upper_tiles ? lower_tiles : level < root_tiles ? upper_tiles : root_tiles;
            const std::uint64_t cells = std::uint64_t{1} << (3 * (level - base));
            num_tiles[base == lower_tiles ? 0 : base == upper_tiles ? 1 : 2] += cells;
            if (base != root_tiles) continue;
            for (std::uint64_t n = 0; n < cells; ++n)
                root_children.push_back({root_key((table.tiles[t].first() >> 27) + n), t, true});
        }
        std::sort(root_children.begin(), root_children.end(),
                  [](const root_child& a, const root_child& b) { return a.key < b.key; });
        root = sizeof(grid_data) + sizeof(tree_data);
        first_upper = root + sizeof(root_data<T>) + root_children.size() * sizeof(typename root_data<T>::tile);
        first_lower = first_upper + upper.keys.size() * sizeof(upper_node);
        first_leaf = first_lower + lower.keys.size() * sizeof(lower_node);
        size = first_leaf + table.count * sizeof(leaf_node<T>);
    }
    // The key in the root of the upper node with this Morton key.
    [[nodiscard]] static std::uint64_t root_key(std::uint64_t key) {
        const glm::ivec3 p = core::morton_position(key);
        return static_cast<std::uint64_t>(p.x) << 42 | static_cast<std::uint64_t>(p.y) << 21 |
               static_cast<std::uint64_t>(p.z);
    }
};

// The place in a node's table of the child with this Morton key.
template <int Log2Size>
[[nodiscard]] std::size_t place_in_node(std::uint64_t key) {
    const glm::ivec3 p = core::morton_position(key & ((std::uint64_t{1} << (3 * Log2Size)) - 1));
    return static_cast<std::size_t>((p.x << (2 * Log2Size)) | (p.y << Log2Size) | p.z);
}

// Node `number` of a level, whose children have `keys`, child i at `child(i)` bytes from the node. Tiles of log2_bricks
// are one value of the node.
template <int Log2Size, class T, class Child>
void fill_internal(const statistics<T>& s, const source<T>& from, const level& nodes, std::uint64_t number,
                   const std::uint64_t* keys, int log2_bricks, const Child& child, internal_node<T, Log2Size>& node) {
    std::memset(static_cast<void*>(&node), 0, sizeof(node));
    node.voxels = s.voxels;
    node.flags = s.count == 0 ? 0 : 2; // has voxels
    s.write_to(node);
    for (auto& e : node.table) e.value = from.background;
    for (std::uint64_t i = nodes.first[number]; i < nodes.first[number + 1]; ++i) {
        const std::size_t n = place_in_node<Log2Size>(keys[i]);
        node.child_mask[n / 64] |= std::uint64_t{1} << (n % 64);
        node.table[n].child = child(i);
    }
    for (std::uint64_t i = nodes.first_tile[number]; i < nodes.first_tile[number + 1]; ++i) {
        const brick_tile tile = from.table.tiles[nodes.tiles[i]];
        const stored_value<T> value = tile_value(from, nodes.tiles[i]);
        for (std::uint64_t key = tile.first() >> (3 * log2_bricks); key < tile.end() >> (3 * log2_bricks); ++key) {
            const std::size_t n = place_in_node<Log2Size>(key);
            if (has_active_tiles(from)) node.value_mask[n / 64] |= std::uint64_t{1} << (n % 64);
            node.table[n].value = value;
        }
    }
}

[[nodiscard]] inline std::uint32_t crc32(const void* bytes, std::size_t count) {
    static constexpr auto table = [] {
        std::array<std::uint32_t, 256> t{};
        for (std::uint32_t n = 0; n < 256; ++n) {
            std::uint32_t c = n;
            for (int i = 0; i < 8; ++i) c = (c >> 1) ^ ((c & 1u) != 0 ? 0xedb88320u : 0);
            t[n] = c;
        }
        return t;
    }();
    std::uint32_t c = ~0u;
    for (std::size_t i = 0; i < count; ++i)
        c = table[(c ^ static_cast<const unsigned char*>(bytes)[i]) & 255u] ^ (c >> 8);
    return ~c;
}

[[nodiscard]] inline std::uint64_t hash_of(const std::string& name) {
    std::uint64_t hash = 0;
    for (const char c : name) {
        const std::uint64_t overflow = hash >> 56;
        hash = hash * 67 + static_cast<unsigned char>(c) + overflow;
    }
    return hash;
}

[[nodiscard]] inline affine_map map_of(const grid& g) {
    affine_map m{};
    for (int a = 0; a < 3; ++a) {
        const std::size_t diagonal = 4 * static_cast<std::size_t>(a);
        m.matrix[diagonal] = g.voxel_size[a];
        m.inverse[diagonal] = 1.0 / g.voxel_size[a];
        m.translation[a] = exact::fma(0.5, g.voxel_size[a], g.origin[a]);
        m.matrix_f[diagonal] = static_cast<float>(m.matrix[diagonal]);
        m.inverse_f[diagonal] = static_cast<float>(m.inverse[diagonal]);
        m.translation_f[a] = static_cast<float>(m.translation[a]);
    }
    m.taper = 1.0;
    m.taper_f = 1.0f;
    return m;
}

// From the mapped index of the lowest voxel to that past the highest, as NanoVDB's own tools write it.
[[nodiscard]] inline world_box world_box_of(const affine_map& m, const box& voxels, bool empty) {
    world_box b{};
    for (int a = 0; a < 3; ++a) {
        const double scale = m.matrix[4 * static_cast<std::size_t>(a)];
        b.low[a] =
            empty ? std::numeric_limits<double>::max() : exact::fma(double(voxels.low[a]), scale, m.translation[a]);
        b.high[a] = empty ? std::numeric_limits<double>::lowest()
                          : exact::fma(double(voxels.high[a]) + 1.0, scale, m.translation[a]);
    }
    return b;
}

} // namespace voxelpipe::io::nanovdb
