// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The memory layout of NanoVDB 32.4, which is also that of its files: a grid of 64-bit offsets from each node to its
// children, nodes of 32^3 and 16^3 children over leaves of 8^3 voxels, everything aligned to 32 bytes. z runs fastest.
// Readers of later versions accept it; files of later versions are refused by readers of 32.4.

#include <voxelpipe/config.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::io::nanovdb {

inline constexpr std::uint64_t magic = 0x304244566f6e614e; // "NanoVDB0"
inline constexpr std::uint32_t version = 32u << 21 | 4u << 10 | 2u;

enum class grid_type : std::uint32_t {
    real32 = 1,
    real64 = 2,
    int16 = 3,
    int32 = 4,
    int64 = 5,
    vec3f = 6,
    vec3d = 7,
    mask = 8,
    uint32 = 10,
    boolean = 11,
    rgba8 = 12,
    vec4f = 17,
    vec4d = 18,
};
enum class grid_class : std::uint32_t { unknown = 0, level_set = 1, fog_volume = 2, topology = 6, voxel_volume = 7 };
enum grid_flag : std::uint32_t {
    has_bounding_box = 1u << 1,
    has_extrema = 1u << 2,
    has_average = 1u << 3,
    has_deviation = 1u << 4,
    is_breadth_first = 1u << 5,
};

// A voxel that exists, without a value.
struct mask_value {};
struct rgba8 {
    std::uint32_t packed; // red in the lowest byte
};

// A type of values: its number, its form in nodes, and its statistics' type.
template <class T>
struct value_type;
template <class T, grid_type Type, grid_class Class, class Statistic = float>
struct plain_value {
    using stored = T;
    using statistic = Statistic;
    static constexpr grid_type type = Type;
    static constexpr grid_class meaning = Class;
    static constexpr bool has_statistics = true;
};
template <>
struct value_type<float> : plain_value<float, grid_type::real32, grid_class::voxel_volume> {};
template <>
struct value_type<double> : plain_value<double, grid_type::real64, grid_class::voxel_volume, double> {};
template <>
struct value_type<std::int16_t> : plain_value<std::int16_t, grid_type::int16, grid_class::unknown> {};
template <>
struct value_type<std::int32_t> : plain_value<std::int32_t, grid_type::int32, grid_class::unknown> {};
template <>
struct value_type<std::int64_t> : plain_value<std::int64_t, grid_type::int64, grid_class::unknown, double> {};
template <>
struct value_type<std::uint32_t> : plain_value<std::uint32_t, grid_type::uint32, grid_class::voxel_volume> {};
template <>
struct value_type<glm::vec3> : plain_value<glm::vec3, grid_type::vec3f, grid_class::voxel_volume> {};
template <>
struct value_type<glm::dvec3> : plain_value<glm::dvec3, grid_type::vec3d, grid_class::voxel_volume, double> {};
template <>
struct value_type<glm::vec4> : plain_value<glm::vec4, grid_type::vec4f, grid_class::unknown> {};
template <>
struct value_type<glm::dvec4> : plain_value<glm::dvec4, grid_type::vec4d, grid_class::unknown, double> {};
template <>
struct value_type<rgba8> : plain_value<rgba8, grid_type::rgba8, grid_class::voxel_volume> {};
template <>
struct value_type<bool> {
    using stored = bool;
    using statistic = bool;
    static constexpr grid_type type = grid_type::boolean;
    static constexpr grid_class meaning = grid_class::unknown;
    static constexpr bool has_statistics = false;
};
template <>
struct value_type<mask_value> {
    using stored = bool;
    using statistic = bool;
    static constexpr grid_type type = grid_type::mask;
    static constexpr grid_class meaning = grid_class::topology;
    static constexpr bool has_statistics = false;
};

struct box {
    std::int32_t low[3], high[3]; // both within
};
struct world_box {
    double low[3], high[3];
};

// ---- the file
// ---------------------------------------------------------------------------------------------------------

struct file_header {
    std::uint64_t magic;
    std::uint32_t version;
    std::uint16_t num_grids;
    std::uint16_t codec; // 0: none
};
static_assert(sizeof(file_header) == 16);

// One a grid, after the header; its name follows, with a zero at its end.
struct file_entry {
    std::uint64_t grid_size, file_size, name_hash, num_voxels;
    grid_type type;
    grid_class meaning;
    world_box world;
    box voxels;
    double voxel_size[3];
    std::uint32_t name_size;     // with the zero
    std::uint32_t node_count[4]; // from the leaves up to the root
    std::uint32_t tile_count[3];
    std::uint16_t codec;
    std::uint16_t padding;
    std::uint32_t version;
};
static_assert(sizeof(file_entry) == 176);

// ---- a grid
// -----------------------------------------------------------------------------------------------------------

struct affine_map {
    float matrix_f[9], inverse_f[9], translation_f[3], taper_f;
    double matrix[9], inverse[9], translation[3], taper;
};
static_assert(sizeof(affine_map) == 264);

struct alignas(32) grid_data {
    std::uint64_t magic, checksum;
    std::uint32_t version, flags, grid_index, grid_count;
    std::uint64_t grid_size;
    char name[256];
    affine_map map;
    world_box world;
    double voxel_size[3];
    grid_class meaning;
    grid_type type;
    std::int64_t blind_offset;
    std::uint32_t blind_count, data0;
    std::uint64_t data1, data2;
};
static_assert(sizeof(grid_data) == 672 && offsetof(grid_data, map) == 296 && offsetof(grid_data, meaning) == 632);

struct alignas(32) tree_data {
    std::uint64_t node_offset[4]; // from here to the first leaf, lower node, upper node, and the root
    std::uint32_t node_count[3];
    std::uint32_t tile_count[3];
    std::uint64_t num_voxels;
};
static_assert(sizeof(tree_data) == 64);

template <class T>
struct alignas(32) root_data {
    using stored = typename value_type<T>::stored;
    using statistic = typename value_type<T>::statistic;
    box voxels;
    std::uint32_t table_size;
    stored background, minimum, maximum;
    statistic average, deviation;

    struct alignas(32) tile {
        std::uint64_t key;  // the upper node's position: x in the highest bits, then y, then z
        std::int64_t child; // from the root
        std::uint32_t state;
        stored value;
    };
};

// Log2Size: 5 for upper nodes, of 32^3 lower ones, and 4 for those, of 16^3 leaves.
template <class T, int Log2Size>
struct alignas(32) internal_node {
    using stored = typename value_type<T>::stored;
    using statistic = typename value_type<T>::statistic;
    static constexpr std::size_t num_children = std::size_t{1} << (3 * Log2Size);
    box voxels;
    std::uint64_t flags;
    std::uint64_t value_mask[num_children / 64], child_mask[num_children / 64];
    stored minimum, maximum;
    statistic average, deviation;
    union entry {
        stored value;
        std::int64_t child; // from this node
    };
    alignas(32) entry table[num_children];
};

struct leaf_head {
    std::int32_t low[3];
    std::uint8_t size[3]; // high - low
    std::uint8_t flags;
    std::uint64_t mask[8];
};
static_assert(sizeof(leaf_head) == 80);

template <class T>
struct alignas(32) leaf_node {
    leaf_head head;
    T minimum, maximum;
    typename value_type<T>::statistic average, deviation;
    alignas(32) T values[512];
};
template <>
struct alignas(32) leaf_node<bool> {
    leaf_head head;
    std::uint64_t values[8];
    std::uint64_t padding[2];
};
template <>
struct alignas(32) leaf_node<mask_value> {
    leaf_head head;
    std::uint64_t padding[2];
};
static_assert(sizeof(leaf_node<float>) == 2144 && sizeof(leaf_node<glm::vec3>) == 6272);
static_assert(sizeof(leaf_node<bool>) == 160 && sizeof(leaf_node<mask_value>) == 96);

} // namespace voxelpipe::io::nanovdb
