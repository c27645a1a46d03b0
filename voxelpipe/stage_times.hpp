// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Durations of the stages of a call, which a backend adds to what its `times` points to. Stages that a backend does not
// run separately stay 0 (docs/pipeline.md, "Stage times").

#include <array>
#include <utility>

namespace voxelpipe {

// Milliseconds of each stage; 0 if the call has no such stage (docs/pipeline.md).
struct stage_times {
    double vertex_shade = 0, coarse_raster = 0, tile_sort = 0, tile_split = 0; // as far as lists of triangles
    double clear = 0, fine_raster = 0, tile_resolve = 0, abuffer_emit = 0;     // from those to values

    friend bool operator==(const stage_times&, const stage_times&) = default;
};

// Every stage with its name, in the order of the pipeline.
inline constexpr std::array<std::pair<const char*, double stage_times::*>, 8> stage_time_fields{{
    {"vertex_shade", &stage_times::vertex_shade},
    {"coarse_raster", &stage_times::coarse_raster},
    {"tile_sort", &stage_times::tile_sort},
    {"tile_split", &stage_times::tile_split},
    {"clear", &stage_times::clear},
    {"fine_raster", &stage_times::fine_raster},
    {"tile_resolve", &stage_times::tile_resolve},
    {"abuffer_emit", &stage_times::abuffer_emit},
}};

// All stages together, milliseconds.
[[nodiscard]] constexpr double sum_of(const stage_times& times) {
    double sum = 0;
    for (const auto& [name, field] : stage_time_fields) sum += times.*field;
    return sum;
}

} // namespace voxelpipe
