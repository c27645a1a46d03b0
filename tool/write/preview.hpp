// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Draws the occupied voxels of a volume: rays through the packed bits, sun with soft shadows, ambient occlusion, a
// shadow on the ground, colours from the "color" channel or of other values (preview_colors.hpp). Takes a volume and a
// camera, gives 8-bit sRGB pixels; the same pixels for any number of threads.

#include "model/volume.hpp"
#include "preview_scene.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace voxelize {

// The world axis that stands upright in pictures and in .vox. The other two keep the system right-handed.
enum class up_axis : std::uint8_t { y, z };

using rgb8 = std::array<std::uint8_t, 3>; // sRGB

// The look of voxels without a colour.
inline constexpr rgb8 clay{222, 214, 203};

struct background {
    rgb8 top{190, 208, 226};
    rgb8 bottom{240, 238, 233};
    bool transparent = false; // RGBA picture; the shadow on the ground stays, as black with alpha
};

// "#rrggbb"; nothing for anything else.
[[nodiscard]] std::optional<rgb8> parse_color(std::string_view text);

// "sky", "white", "dark", "transparent", "#rrggbb" or "#rrggbb,#rrggbb" (top, bottom); nothing for anything else.
[[nodiscard]] std::optional<background> parse_background(std::string_view text);

struct preview_options {
    int width = 1280; // pixels, 1..16384
    int height = 960;
    double azimuth = 35; // degrees about the up axis: 0 looks at the +z side (y up) or the -y side (z up) of the model,
                         // growing values walk to its right
    double elevation = 25;     // degrees above the horizon, -90..90
    double zoom = 1;           // 1 fits the occupied voxels into the picture, 2 shows them twice as large
    double field_of_view = 28; // degrees from top to bottom; 0 is an orthographic picture
    int samples = 2;           // rays a pixel along each axis, 1..8
    bool use_color = true;     // false: clay even where there are colours or other values
    bool edges = true;         // fine lines between voxels, where voxels are large enough to show them
    bool ground = true;        // shadow on a ground under the model, when seen from above
    background backdrop{};
    up_axis up = up_axis::y;
    int threads = 0; // 0: all cores
};

struct image {
    int width = 0;
    int height = 0;
    int components = 3;               // 3: RGB, 4: RGBA, alpha not premultiplied
    std::vector<std::uint8_t> pixels; // rows from the top
};

// The channel that gives voxels their colour: "color", or else the first that starts so (color_max, ...); u8 with three
// or four components. Null without such a channel.
[[nodiscard]] const channel* find_colors(const volume& v);
[[nodiscard]] const channel* find_colors(std::span<const channel> channels);
// The channel that a picture shows: that of find_colors(), or else the first with values but "distance", which is about
// the same at every voxel of a surface. Null without such a channel.
[[nodiscard]] const channel* find_shown(std::span<const channel> channels);

// Needs the occupancy channel. `progress` is called with 0..1, from the calling thread. Throws std::invalid_argument
// when an option lies outside its range.
[[nodiscard]] image render_preview(const volume& v, const preview_options& options,
                                   const std::function<void(double)>& progress = {});
// The same picture of the same voxels as bricks, without anything dense: of `v` extent and voxel size count alone, and
// `shown`, which may be null, has a value for each voxel of the bricks, in their order.
[[nodiscard]] image render_preview(const volume& v, const preview_bricks& bricks, const channel* shown,
                                   const preview_options& options, const std::function<void(double)>& progress = {});

} // namespace voxelize
