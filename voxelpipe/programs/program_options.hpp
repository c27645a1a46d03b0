// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Options of calls with programs, points and lines.

#include <voxelpipe/voxelize.hpp>

#include <cstdint>

namespace voxelpipe {

// Options of calls with programs, and of points and lines.
struct program_options : voxelize_options {
    // Most triangles of the programs that are in memory at once, at least 1 and at most 2^30. They take some 30 bytes
    // each, and what the vertices' varyings take. Results do not depend on it.
    std::uint64_t chunk_triangles = std::uint64_t{1} << 24;
    // Bytes, about, that the fragments of a call in more than one chunk, or of points and lines, may take at once while
    // they are listed and sorted; 0: what there is. If there are more, the grid is drawn in parts, and the programs run
    // again for each. Targets are blended part by part. The lists of an A-buffer are the result, and those that become
    // a sparse framebuffer are kept until all are there: both are joined at the end and do not count. Results do not
    // depend on it.
    std::uint64_t list_bytes = 0;

    program_options() = default;
    // A coverage alone, or options of a call without programs, may be given in their place.
    program_options(const voxelize_options& o) : voxelize_options(o) {} // NOLINT(*-explicit-*)
    program_options(coverage rule_) : voxelize_options{rule_, true} {}  // NOLINT(*-explicit-*)
    program_options(coverage rule_, std::uint64_t chunk_triangles_, std::uint64_t list_bytes_ = 0)
        : voxelize_options{rule_, true}, chunk_triangles(chunk_triangles_), list_bytes(list_bytes_) {}
};

} // namespace voxelpipe
