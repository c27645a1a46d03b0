// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The calls of the module for GPUs, without CUDA or Python: what nvcc compiles on one side and the bindings on the
// other. All arrays are in the device's memory, and the caller's. Every call waits for its stream at its end.

#include "../../src/cell_shaders.hpp"

#include <bindings/device_stream.hpp>
#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace voxelpipe::python {

using bindings::device_stream;

// The fold of a voxel's fragments. A mean is a sum that is divided.
enum class combine : std::uint8_t { mean, sum, min, max, last };

// Columns [first, first + count) of rows with `columns` values, one row for each vertex or for each triangle.
template <class T>
struct device_values {
    const T* values = nullptr;
    std::size_t columns = 1, first = 0;
    int count = 1; // at most 3 floats, or one integer
    bool per_triangle = false;
    combine how = combine::last;
};

// bool (nz, ny, nx), a byte each.
[[nodiscard]] status draw_mask(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                               std::uint8_t* out);
// 32 voxels a word, (nz, ny, ceil(nx / 32)).
[[nodiscard]] status draw_bits(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                               std::uint32_t* out);
// One body for each part of the triangles: part i begins with triangle first_triangles[i].
[[nodiscard]] status draw_solid(const device_stream& on, const mesh_view<>& mesh,
                                const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                const solid_options& options, std::uint8_t* out);
// vp::diagnose_repair of the same bodies.
[[nodiscard]] status examine_solid(const device_stream& on, const mesh_view<>& mesh,
                                   const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                   const solid_options& options);

// vp::voxelize_distance of the same bodies: (nz, ny, nx), with sample::corner one more along each axis. nearest: null,
// or the numbers of the nearest triangles among all parts, -1 beyond the band.
[[nodiscard]] status draw_distance(const device_stream& on, const mesh_view<>& mesh,
                                   const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                   const distance_options& options, float* out, std::int64_t* nearest);
// vp::distance_at of the same bodies; `out` has one element a point.
[[nodiscard]] status measure_points(const device_stream& on, const mesh_view<>& mesh,
                                    const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                    array_view<const glm::vec3> points, const distance_options& options,
                                    const distance_arrays& out);

// vp::voxelize_cells of all triangles as one body: fractions (nz, ny, nx), and what else is asked for.
[[nodiscard]] status draw_fractions(const device_stream& on, const mesh_view<>& mesh, const grid& g,
                                    const cell_options& options, float* out, const face_arrays& faces,
                                    const inner_arrays& inner);

// Writes columns [first, first + count) of `out`, (nz, ny, nx, columns); `fill` where there is no fragment.
[[nodiscard]] status bake(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                          const device_values<float>& values, float fill, float* out);
[[nodiscard]] status bake(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                          const device_values<std::int64_t>& values, std::int64_t fill, std::int64_t* out);

// The voxels that have a fragment, in Morton order, and the values folded in them. The result is kept on the
// device until the arrays are there that it goes into.
template <class T>
struct sparse_result {
    status result;
    std::size_t num_voxels = 0;
    // Writes (num_voxels, 3) indices x, y, z. Throws std::runtime_error.
    std::function<void(std::int32_t* coordinates)> copy_voxels;
    // Writes columns [first, first + count) of (num_voxels, columns). Throws std::runtime_error.
    std::function<void(T* out)> copy_values;
};
[[nodiscard]] sparse_result<float> bake_sparse(const device_stream& on, const mesh_view<>& mesh, const grid& g,
                                               coverage rule, const device_values<float>& values);
[[nodiscard]] sparse_result<std::int64_t> bake_sparse(const device_stream& on, const mesh_view<>& mesh, const grid& g,
                                                      coverage rule, const device_values<std::int64_t>& values);
// The voxels alone.
[[nodiscard]] sparse_result<float> list_voxels(const device_stream& on, const mesh_view<>& mesh, const grid& g,
                                               coverage rule);

// All triangles of every voxel, kept on the device until the arrays are there that they go into.
struct fragment_lists {
    status result;
    std::size_t num_voxels = 0, num_fragments = 0;
    // (num_voxels, 3) indices x, y, z; num_voxels + 1 offsets; num_fragments triangles; (num_fragments, 3) weights of
    // the triangle's vertices. Throws std::runtime_error.
    std::function<void(std::int32_t* coordinates, std::int64_t* offsets, std::uint32_t* triangles, float* weights)>
        copy;
};
[[nodiscard]] fragment_lists list_fragments(const device_stream& on, const mesh_view<>& mesh, const grid& g,
                                            coverage rule);

} // namespace voxelpipe::python
