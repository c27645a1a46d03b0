// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The calls that make surfaces and components, as device_calls.hpp has the others: results whose sizes are known after
// the call alone. They are kept on the device until the arrays are there that they go into.

#include "../../src/surface_values.hpp"
#include "device_calls.hpp"

#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace voxelpipe::python {

// Values of a mesh that its surface gets: at most most_floats columns of floats, and most_integers of integers.
inline constexpr std::size_t most_floats = 16, most_integers = 4;
struct surface_columns {
    value_columns<float> floats;
    value_columns<std::int64_t> integers;
};

// Where a surface of n vertices and m faces goes.
struct surface_arrays {
    double* vertices = nullptr;                   // (n, 3), in world units
    std::uint32_t* faces = nullptr;               // (m, 3) or (m, 4); null where wide_faces are wanted
    std::int64_t* wide_faces = nullptr;           // the same in 64 bits
    std::int32_t* cells = nullptr;                // (n, 3), x, y, z
    std::uint8_t* sheets = nullptr;               // (n)
    std::int64_t* sources = nullptr;              // (n), -1 for none
    float* floats = nullptr;                      // (n, columns), null without
    std::int64_t* integers = nullptr;             // (n, columns), null without
    std::size_t num_floats = 0, num_integers = 0; // columns
};
struct surface_result {
    status result;
    std::size_t num_vertices = 0, num_faces = 0, num_corners = 3; // corners of a face
    std::function<void(const surface_arrays&)> copy;              // Throws std::runtime_error.
};

// vp::remesh of one body for each part of the triangles, as draw_solid has them; vertices are placed in `world`, the
// grid of the samples.
[[nodiscard]] surface_result make_surface(const device_stream& on, const mesh_view<>& mesh,
                                          const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                          const remesh_options& options, const grid& world);
// The same with values: of up to 4 floats and no integers, or of all columns.
[[nodiscard]] surface_result make_surface_of_floats(const device_stream& on, const mesh_view<>& mesh,
                                                    const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                                    const remesh_options& options, const grid& world,
                                                    const surface_columns& values);
[[nodiscard]] surface_result make_surface_of_columns(const device_stream& on, const mesh_view<>& mesh,
                                                     const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                                     const remesh_options& options, const grid& world,
                                                     const surface_columns& values);

// vp::extract of bytes that are 0 or not, and of a field; both (nz, ny, nx), of the grid's shape.
[[nodiscard]] surface_result extract_mask(const device_stream& on, const std::uint8_t* values, const grid& g,
                                          const extract_options& options);
[[nodiscard]] surface_result extract_field(const device_stream& on, const float* values, const grid& g,
                                           const extract_options& options);

// vp::label of bytes (nz, ny, nx) that are 0 or not. One of the two is null; the other has the labels' shape.
struct label_arrays {
    std::int32_t* labels = nullptr;
    std::int64_t* wide_labels = nullptr;
};
struct label_result {
    status result;
    // Writes names, numbers of voxels, lowest and highest voxels (n, 3); does nothing where no list was asked for.
    // Throws std::runtime_error.
    std::function<void(std::int64_t* names, std::int64_t* voxels, std::int32_t* lowest, std::int32_t* highest)> copy;
};
[[nodiscard]] label_result label_mask(const device_stream& on, const std::uint8_t* values, const glm::ivec3& extent,
                                      int connectivity, bool wants_list, const label_arrays& out);

} // namespace voxelpipe::python
