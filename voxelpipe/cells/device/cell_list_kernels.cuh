// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The terms of cut cells on a GPU: a thread takes one pixel of a triangle. Triangles differ in their pixels, and
// threads that went through all of them would wait for each other. Terms are stored in the order in which threads find
// them, because they are sorted afterwards and their sums do not depend on it.

#include <voxelpipe/cells/passes/cell_rows.hpp>
#include <voxelpipe/device/base/launch.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// What the passes over pixels count.
struct cell_list_state {
    unsigned long long num_terms;
    unsigned int has_wide; // triangles that take 128 bits
};

// Calls with(triangle, box) for a triangle that is drawn and may meet the grid, if it takes such integers.
VOXELPIPE_ANY_CALLABLE
template <class Terms, class Int, class With>
VOXELPIPE_HD core::triangle_class with_cell_triangle(const core::passes::cell_mesh& mesh, std::uint64_t i,
                                                     With&& with) {
    const core::snapped_position a = mesh.corner(i, 0), b = mesh.corner(i, 1), c = mesh.corner(i, 2);
    const core::triangle_class kind = core::classify_positions(a, b, c);
    if (kind != core::triangle_class::drawn) return kind;
    const std::int64_t extent[3] = {mesh.extent.x, mesh.extent.y, mesh.extent.z};
    const core::voxel_box all = core::bounds(a, b, c, mesh.fraction);
    for (int axis = 1; axis < 3; ++axis)
        if (all.hi[axis] < 0 || all.lo[axis] >= extent[axis]) return core::triangle_class::outside;
    if (core::is_narrow_cell(a, b, c, mesh.fraction) != std::is_same_v<Int, std::int64_t>) return kind;
    core::cell_triangle<Int> t = core::make_cell_triangle<Int>(a, b, c, mesh.fraction);
    if constexpr (core::has_areas<Terms>) core::lift(t);
    with(t, core::make_cell_box(t, extent));
    return kind;
}

// At most the pixels of each triangle; 0 behind the last one, for the sums.
template <class Terms>
struct count_cell_pixels {
    core::passes::cell_mesh mesh;
    std::uint32_t* num_pixels;
    std::uint64_t* counts;
    cell_list_state* state;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        num_pixels[i] = 0;
        if (i == mesh.num_triangles) return;
        const auto count = [&](const auto& t, const core::cell_box& box) {
            const core::cell_pixels all = core::pixels_of(t, box);
            if (all.z_first >= all.z_end || all.y_first >= all.y_end) return;
            const std::int64_t n = (all.z_end - all.z_first) * core::most_pixels_of_layer(t, all);
            num_pixels[i] = n < 0xffffffff ? static_cast<std::uint32_t>(n) : 0xffffffffu;
        };
        const core::triangle_class kind = with_cell_triangle<Terms, std::int64_t>(mesh, i, count);
        if (kind == core::triangle_class::drawn)
            with_cell_triangle<Terms, int128>(mesh, i, [&](const auto& t, const core::cell_box& box) {
                count(t, box);
                state->has_wide = 1;
            });
        core::passes::count_triangle(mesh, i, kind, counts);
    }
};

inline constexpr unsigned cell_list_threads = 128;

// Stores the terms of all pixels, as long as there is room, and counts all.
template <class Terms>
struct list_cell_pixels {
    core::passes::cell_mesh mesh;
    core::passes::cell_keys keys_of;
    const std::uint64_t* first_pixel; // of each triangle, and the end
    cell_list_state* state;
    std::uint64_t room;
    std::uint64_t* keys;
    std::uint32_t* order;
    Terms* terms;
};
// Those of one pixel of a triangle, by its number.
template <class Int, class Terms>
__device__ void list_cell_pixel(const list_cell_pixels<Terms>& pass, std::uint32_t i, std::int64_t number) {
    with_cell_triangle<Terms, Int>(pass.mesh, i, [&](const core::cell_triangle<Int>& t, const core::cell_box& box) {
        core::area_ratio areas{0, 0.0};
        if constexpr (core::has_areas<Terms>) areas = core::ratio_of(t, pass.mesh.areas);
        const std::uint64_t body = pass.keys_of.bodies == 1 ? 0 : pass.mesh.draw_of(i);
        const auto store = [&](std::int64_t y, std::int64_t z, std::int64_t x, const Terms& of_voxel) {
            const std::uint64_t to = atomicAdd(&pass.state->num_terms, 1ull);
            if (to >= pass.room) return;
            pass.keys[to] =
                pass.keys_of.key(static_cast<std::uint64_t>(y - box.lo[1]), static_cast<std::uint64_t>(z - box.lo[2]),
                                 body, static_cast<std::uint64_t>(x - box.lo[0] + 1));
            pass.order[to] = static_cast<std::uint32_t>(to);
            pass.terms[to] = of_voxel;
            if constexpr (core::has_sheets<Terms>) pass.terms[to].triangle = i;
        };
        if (core::is_in_one_cell(t)) {
            core::visit_only_cell<Terms>(t, box, areas, store);
            return;
        }
        const core::cell_pixels all = core::pixels_of(t, box);
        const std::int64_t width = core::most_pixels_of_layer(t, all), k = number / width;
        core::cutting_planes planes{};
        core::cut_corners<Int> corners;
        const core::cut_polygon whole = core::whole_triangle(t, corners);
        core::for_each_cell_of_layer<Terms>(t, whole, planes, corners, box, areas, all, all.z_first + k,
                                            number - k * width, store);
    });
}
// error: null, or a word that is not 0 where the call has failed; nothing is done then.
template <class Int, class Terms>
__global__
__launch_bounds__(cell_list_threads) void list_cell_pixels_kernel(const __grid_constant__ list_cell_pixels<Terms> pass,
                                                                  const unsigned* error) {
    __shared__ std::uint32_t owners[2]; // the triangles of the block's first and last pixel
    await_stream();
    if ((error != nullptr && *error != 0) || (std::is_same_v<Int, int128> && pass.state->has_wide == 0)) return;
    const std::uint64_t num_pixels = pass.first_pixel[pass.mesh.num_triangles];
    for (std::uint64_t first = std::uint64_t{blockIdx.x} * cell_list_threads; first < num_pixels;
         first += std::uint64_t{gridDim.x} * cell_list_threads) {
        if (threadIdx.x < 2) {
            const std::uint64_t last = first + cell_list_threads - 1, at = threadIdx.x == 0 ? first : last;
            owners[threadIdx.x] =
                core::find_owner(pass.first_pixel, pass.mesh.num_triangles, at < num_pixels ? at : num_pixels - 1);
        }
        __syncthreads();
        const std::uint64_t pixel = first + threadIdx.x;
        if (pixel < num_pixels) {
            const std::uint32_t i =
                owners[0] + core::find_owner(pass.first_pixel + owners[0], owners[1] - owners[0] + 1, pixel);
            list_cell_pixel<Int>(pass, i, static_cast<std::int64_t>(pixel - pass.first_pixel[i]));
        }
        __syncthreads(); // the owners are read
    }
}

} // namespace voxelpipe::device
