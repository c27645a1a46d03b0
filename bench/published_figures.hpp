// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Figures of other CPU voxelizers, to stand beside ours. They were measured once, on 2 cores of a machine of the same
// kind (2026-11-21, +-40 %), on an icosphere of 500k triangles, conservative surface, the grid a cube 1.0002 times the
// longest side; they are quoted, not measured by this program.

#include <array>
#include <string_view>

namespace bench {

struct published_figure {
    std::string_view program;
    std::array<std::string_view, 3> milliseconds; // at 128, 512 and 1024; "-" where there is none
    std::array<double, 3> best;                   // the shortest time that is claimed; 0 where there is none
};

inline constexpr std::array<int, 3> published_resolutions{128, 512, 1024};

inline constexpr std::array<published_figure, 4> published_figures{{
    {"cuda_voxelizer, OpenMP path", {"76–108", "163–256", "424"}, {76, 163, 424}},
    {"Open3D 0.20", {"128", "1121", "-"}, {128, 1121, 0}},
    {"trimesh 5.2, subdivide", {"1256", "26849", "-"}, {1256, 26849, 0}},
    {"OpenVDB 10, unsigned field", {"1679", "4011", "over 250000"}, {1679, 4011, 250000}},
}};

} // namespace bench
