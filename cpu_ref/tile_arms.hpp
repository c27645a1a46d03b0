// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crosshair and diagonal coverage of one triangle in one tile. Which coverage a call has is known when it runs: it
// takes the code of conservative coverage, whose voxels include these, and these columns instead of that code's. So
// programs compile nothing twice.

#include <cpu_ref/pipeline.hpp>
#include <cpu_ref/tile_columns.hpp>
#include <voxelpipe/core/arms.hpp>

#include <array>
#include <cstdint>
#include <span>

namespace voxelpipe::cpu {

// Columns along the triangle's dominant axis, relative to the tile's lowest corner; bits along w are an interval. A
// column may stand here twice.
struct tile_columns {
    struct column {
        std::uint8_t u, v;
        std::uint32_t bits;
    };
    std::array<column, std::size_t{2} * tile_size * tile_size> all;
    std::size_t count = 0;
    int axis = 0;

    [[nodiscard]] const column* begin() const { return all.data(); }
    [[nodiscard]] const column* end() const { return all.data() + count; }
};

// Not inlined, and no template: it is the same for all targets and shaders.
[[gnu::noinline]] inline void find_arm_columns(const core::snapped_position& a, const core::snapped_position& b,
                                               const core::snapped_position& c, int fraction, core::arm_set arms,
                                               const core::voxel_box& tile, tile_columns& out) {
    out.count = 0;
    const auto run = [&](const auto& t) {
        out.axis = t.axis;
        const auto lo = core::to_uvw(t.axis, tile.lo[0], tile.lo[1], tile.lo[2]);
        core::for_each_arm_span(t, tile, [&](std::int64_t u, std::int64_t v, std::int64_t first, std::int64_t last) {
            out.all[out.count++] = {static_cast<std::uint8_t>(u - lo[0]), static_cast<std::uint8_t>(v - lo[1]),
                                    core::low_bits(static_cast<int>(last - lo[2]) + 1) &
                                        ~core::low_bits(static_cast<int>(first - lo[2]))};
        });
    };
    if (core::fits_narrow(a, b, c, fraction))
        run(core::setup_arms<std::int64_t>(a, b, c, fraction, arms));
    else
        run(core::setup_arms<int128>(a, b, c, fraction, arms));
}

} // namespace voxelpipe::cpu
