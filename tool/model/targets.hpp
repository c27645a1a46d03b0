// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values that can be computed for each voxel: the names of --target with the type and the meaning of the values.
// One table, which --help prints too.

#include "volume.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace voxelize {

enum class target : std::uint8_t {
    occupancy,
    count,
    color,
    color_max,
    color_replace,
    color_outer,
    normal,
    material,
    triangle,
    depth,
    distance,
    nearest,
    fraction, // those of cut cells follow
    area_vector,
    area,
    centroid,
    links, // those of links
    link_triangle,
    link_material,
    aperture_x,
    aperture_y,
    aperture_z
};

struct target_info {
    target id;
    std::string_view name; // of --target and of the volume's channel
    scalar type;
    int components;
    std::string_view description; // one line, with the value of an empty voxel where it is not 0
    std::uint32_t empty = 0;      // the bits of each component of an empty voxel
};

inline constexpr std::array all_targets{
    target_info{target::occupancy, "occupancy", scalar::bit, 1, "1 where a triangle touches the voxel"},
    target_info{target::count, "count", scalar::u32, 1, "number of triangles in the voxel"},
    target_info{target::color, "color", scalar::u8, 4,
                "sRGB and alpha: mean of the triangles in linear light, by alpha"},
    target_info{target::color_max, "color-max", scalar::u8, 4, "sRGB and alpha: greatest of each component"},
    target_info{target::color_replace, "color-replace", scalar::u8, 4, "sRGB and alpha: of the last triangle"},
    target_info{target::color_outer, "color-outer", scalar::u8, 4, "sRGB and alpha: of the triangle farthest outside"},
    target_info{target::normal, "normal", scalar::f32, 3,
                "mean of the unit normals, made unit again; 0 if they cancel"},
    target_info{target::material, "material", scalar::i32, 1, "material of the last triangle; empty: -1", UINT32_MAX},
    target_info{target::triangle, "triangle", scalar::i32, 1, "number of the last triangle; empty: -1", UINT32_MAX},
    target_info{target::depth, "depth", scalar::f32, 1, "least world position along --depth-axis; empty: NaN",
                0x7fc00000},
    target_info{target::distance, "distance", scalar::f32, 1, "what --distance gives, see DISTANCES"},
    target_info{target::nearest, "nearest", scalar::i64, 1,
                "with --distance: number of the nearest triangle; beyond the band: -1", UINT32_MAX},
    target_info{target::fraction, "fraction", scalar::f32, 1,
                "how much of the voxel is inside, 0 to 1 if no parts overlap; see FRACTIONS"},
    target_info{target::area_vector, "area_vector", scalar::f32, 3,
                "sum of the area vectors of the surface in the voxel, outward; see FRACTIONS"},
    target_info{target::area, "area", scalar::f32, 1, "area of the surface in the voxel; see FRACTIONS"},
    target_info{target::centroid, "centroid", scalar::f32, 3,
                "centroid of the part of the voxel that is inside, from its centre in voxels; see FRACTIONS"},
    target_info{target::links, "links", scalar::f32, 18,
                "part of the links to 18 neighbours before the surface; none: -1; see LINKS", 0xbf800000},
    target_info{target::link_triangle, "link_triangle", scalar::i32, 18,
                "beside links: number of the triangle that each crosses; none: -1", UINT32_MAX},
    target_info{target::link_material, "link_material", scalar::i32, 18, "beside links: its material; none: -1",
                UINT32_MAX},
    target_info{target::aperture_x, "aperture_x", scalar::f32, 1,
                "how much of each face across x is inside, one more along x; see FRACTIONS"},
    target_info{target::aperture_y, "aperture_y", scalar::f32, 1, "the same of faces across y"},
    target_info{target::aperture_z, "aperture_z", scalar::f32, 1, "the same of faces across z"},
};

inline constexpr std::size_t target_count = all_targets.size();
// Those of surfaces and solids, dense and sparse. Two others go with --distance; those of cut cells and of links are
// measured of whole triangles.
inline constexpr std::span target_table = std::span(all_targets).first<target_count - 12>();

[[nodiscard]] constexpr const target_info& info_of(target id) { return all_targets[static_cast<std::size_t>(id)]; }

// What is measured of the whole of each triangle: the values of cut cells, and those of links.
[[nodiscard]] constexpr bool is_of_cells(target id) { return id >= target::fraction; }
// What each link from a voxel to a neighbour has: a value for each of 18 neighbours, or of 26.
[[nodiscard]] constexpr bool is_of_links(target id) { return id >= target::links && id <= target::link_material; }
// What is measured of faces, of which a grid has one more along their axis than voxels: 0 to 2; -1 for other targets.
[[nodiscard]] constexpr int axis_of_faces(target id) {
    return id < target::aperture_x ? -1 : static_cast<int>(id) - static_cast<int>(target::aperture_x);
}

[[nodiscard]] constexpr bool is_color(target id) { return info_of(id).name.starts_with("color"); }

[[nodiscard]] constexpr std::optional<target> target_named(std::string_view name) {
    for (const target_info& entry : all_targets)
        if (entry.name == name) return entry.id;
    return std::nullopt;
}

} // namespace voxelize
