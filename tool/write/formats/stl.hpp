// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Binary STL of any triangles. The format has neither colours nor shared vertices, and its coordinates are floats.

#include "output_file.hpp"
#include "progress.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

namespace voxelize {

// Corners in the file's units, counter-clockwise seen from outside.
using stl_triangle = std::array<std::array<double, 3>, 3>;

// Number of triangles that the header of a file can count.
inline constexpr std::uint64_t max_stl_triangles = std::numeric_limits<std::uint32_t>::max();

// Writes a whole file of `count` triangles, at most max_stl_triangles; the caller commits it. `triangle` gives the n-th
// and is called from several threads. Normals are the corners' own: of length 1, and 0 for a triangle without area. The
// meter advances by one a triangle. Throws write_error.
void write_stl_triangles(output_file& out, std::uint64_t count, int threads, progress_meter& meter,
                         const std::function<stl_triangle(std::size_t)>& triangle);

} // namespace voxelize
