// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How a stream works.

#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace voxelpipe::slabs {

// Options of slabs::stream and slabs::mpi_stream.
struct stream_options {
    voxelize_options voxelize = {}; // of each slab's call
    // Bytes for binned triangles, a slab's mesh and its targets, and what a repair finds of all slabs, together. Lists
    // and sparse results, whose size only the call finds out, come on top, and so does what source and sink hold, and
    // for a repair what record_stream::draw_solid names.
    std::uint64_t memory = std::uint64_t{1} << 30;
    std::string folder = "/tmp"; // for what does not fit; about 40 bytes a triangle and slab that it reaches
    int num_slabs = 0;           // to begin with, of equal thickness; 0: as many as the targets need
    int align = 1;               // slabs begin at multiples of this: chunks of a file, or 8 for whole bricks
    // Bytes that the backend takes for a triangle beside its record, and for a voxel; 0: an estimate. The estimate of a
    // voxel is what the targets take, and a byte more for vote and exterior.
    double triangle_bytes = 0, voxel_bytes = 0;
    bool is_solid = false; // for draw_solid and draw_cells: triangles beside the grid along x count too
    // For draw_solid, draw_cells or draw_distance with this repair, whose search begins while triangles come; is_solid
    // then.
    voxelpipe::repair repair = voxelpipe::repair::none;
    // For draw_distance with this band, which decides what triangles a slab needs; that or the options above.
    std::optional<voxelpipe::band> band = std::nullopt;
    bool is_links = false; // for draw_links: triangles up to half a voxel beside the grid count too; that alone
    unsigned threads = 0;  // of the host, that shade, bin and read; 0: all cores. Results do not depend on it

    // As a triangle of a grid is binned.
    [[nodiscard]] slabs::binning binning(const grid& g) const {
        return {voxelize.rule, is_solid || repair != voxelpipe::repair::none, repair,
                band ? core::band_halo(*band, g) : glm::ivec3(-1), is_links};
    }
};

} // namespace voxelpipe::slabs
