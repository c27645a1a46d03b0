// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What devices.cuh is asked for beside mesh and grid.

#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace voxelpipe::slabs {

// How a grid is cut for several GPUs.
struct device_options {
    voxelize_options voxelize = {}; // of each slab's call
    // Bytes of the targets for each voxel, which are cleared or filled by a call. 0 balances the triangles alone.
    double voxel_bytes = 0;
    // What a triangle costs, in bytes of memory that its GPU could fill in the same time.
    double triangle_bytes = 512;
    // Slabs begin at multiples of this: 8 for targets in bricks that are gathered, and for sparse framebuffers, whose
    // bricks a border would cut.
    int align = 1;
    bool may_turn = true; // false: slabs along z, which A-buffers and gather() need
    // For draw_solid and draw_cells: triangles beside the grid along x count too, and slabs are along y or z.
    bool is_solid = false;
    // For draw_solid, draw_cells or draw_distance with this repair, which decides what triangles a slab needs; is_solid
    // then, and slabs of vote and exterior are along z.
    voxelpipe::repair repair = voxelpipe::repair::none;
    // For draw_distance with this band, which decides what triangles a slab needs; slabs are along y or z.
    std::optional<voxelpipe::band> band = std::nullopt;
    // exterior: the host floods in any case, not only if the first GPU has no room for it.
    bool floods_on_host = false;
    // Bytes of host memory for that, about; beyond them it takes temporary files of this folder.
    std::uint64_t memory = std::uint64_t{1} << 30;
    std::string folder = "/tmp"; // of POSIX files

    // As a triangle of a grid is binned.
    [[nodiscard]] slabs::binning binning(const grid& g) const {
        return {voxelize.rule, is_solid, repair, band ? core::band_halo(*band, g) : glm::ivec3(-1)};
    }
};

} // namespace voxelpipe::slabs
