// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding: the winding number of every voxel, of the mesh with its cones, and what the cones' solid angles make
// of it, brick by brick (solid/device/winding_bricks.cuh).

#include <voxelpipe/solid/device/bit_sweeps.cuh>
#include <voxelpipe/solid/device/emit_crossings.cuh>
#include <voxelpipe/solid/device/solid_cones.cuh>
#include <voxelpipe/solid/device/sweep_rows.cuh>
#include <voxelpipe/solid/device/winding_bricks.cuh>

#include <algorithm>
#include <cstdint>
#include <span>

namespace voxelpipe::device {

// Winding numbers of all bodies, a place a voxel and one behind each row, where the row is marked; and bits and marks
// of one body.
struct winding_memory {
    std::int32_t* windings = nullptr;
    std::int32_t* of_cones = nullptr; // null if no hole has lids but its cone
    std::uint8_t* marked = nullptr;   // rows that are crossed
    word* inside = nullptr;
    word* on_cones = nullptr;       // voxels whose samples lie on a cone
    std::uint32_t* marks = nullptr; // core::winding_mark, of each brick
    winding_work work;

    [[nodiscard]] static std::uint64_t of_body(const row_grid& grid) {
        return grid.num_rows() * (static_cast<std::uint64_t>(grid.extent.x) + 1);
    }
    [[nodiscard]] static std::uint64_t num_bricks(const row_grid& grid) {
        return winding_boxes{grid.extent, winding_brick}.count();
    }
    // cones: of the bodies.
    [[nodiscard]] static winding_memory take(arena& memory, const row_grid& grid, std::uint32_t bodies,
                                             std::span<const cone_part> cones) {
        winding_memory m;
        m.windings = memory.take<std::int32_t>(of_body(grid) * bodies);
        if (std::any_of(cones.begin(), cones.end(), [](const cone_part& c) { return c.tree.num_nodes != 0; }))
            m.of_cones = memory.take<std::int32_t>(of_body(grid) * bodies);
        m.marked = memory.take<std::uint8_t>(grid.num_rows() * bodies);
        m.inside = memory.take<word>(bit_box{grid.extent}.num_words());
        m.on_cones = memory.take<word>(bit_box{grid.extent}.num_words());
        m.marks = memory.take<std::uint32_t>(num_bricks(grid));
        m.work = winding_work::take(memory, grid.extent);
        return m;
    }
    [[nodiscard]] winding_adder adder(const row_grid& grid, bool is_split, std::uint32_t num_draws) const {
        return {windings, of_cones, marked, of_body(grid), is_split, num_draws};
    }
    void clear(const row_grid& grid, std::uint32_t bodies, cudaStream_t stream) const {
        const std::size_t bytes = of_body(grid) * bodies * sizeof(std::int32_t);
        check(cudaMemsetAsync(windings, 0, bytes, stream), stage::fine_raster);
        if (of_cones != nullptr) check(cudaMemsetAsync(of_cones, 0, bytes, stream), stage::fine_raster);
        check(cudaMemsetAsync(marked, 0, grid.num_rows() * bodies, stream), stage::fine_raster);
    }
    void clear_body(const row_grid& grid, cudaStream_t stream) const {
        check(cudaMemsetAsync(on_cones, 0, bit_box{grid.extent}.num_words() * sizeof(word), stream),
              stage::fine_raster);
        check(cudaMemsetAsync(marks, 0, num_bricks(grid) * sizeof(std::uint32_t), stream), stage::fine_raster);
    }
    // What is known of a body whose numbers have been summed up.
    [[nodiscard]] winding_input input(const row_grid& grid, std::uint32_t body, fill_rule rule) const {
        const std::uint64_t first = body * of_body(grid);
        return {windings + first, of_cones == nullptr ? nullptr : of_cones + first, on_cones, marks, grid, rule};
    }
};

// Primitives of a body: those of its draws, and of its cones.
struct winding_triangles {
    std::uint32_t first, last, first_cone, last_cone;
};

// Marks the bricks that triangles of a body meet, and samples on its cones. A warp a triangle.
template <class State>
__global__ __launch_bounds__(threads_per_block) void mark_bricks_kernel(const __grid_constant__ geometry geo,
                                                                        const __grid_constant__ row_grid grid,
                                                                        winding_triangles of_body, word* on_cones,
                                                                        std::uint32_t* marks, const State* state) {
    if (state->index_error != 0) return;
    const core::triple<std::int64_t> extent{{grid.extent.x, grid.extent.y, grid.extent.z}};
    const core::triple<std::int64_t> bricks = core::bricks_of(extent);
    const bit_box box{grid.extent};
    const std::int64_t lane = threadIdx.x % 32;
    const std::uint32_t drawn = of_body.last - of_body.first, all = drawn + of_body.last_cone - of_body.first_cone;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(); i < all;
         i += std::uint64_t{gridDim.x} * (threads_per_block / 32)) {
        const bool is_cone = i >= drawn;
        const auto n = static_cast<std::uint32_t>(i);
        const loaded_triangle t = geo.load(is_cone ? of_body.first_cone + n - drawn : of_body.first + n);
        if (!t.index_ok || core::classify_positions(t.a, t.b, t.c) != core::triangle_class::drawn) continue;
        const auto mark = [&](std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t bit) {
            std::uint32_t* const at = marks + (z * bricks[1] + y) * bricks[0] + x;
            if ((*at & bit) == 0) atomicOr(at, bit);
        };
        core::visit_bricks(t.a, t.b, t.c, extent, grid.fraction, lane, 32,
                           [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                               mark(x, y, z, is_cone ? core::meets_cones : core::meets_mesh);
                           });
        if (is_cone)
            core::visit_samples_on(
                t.a, t.b, t.c, extent, grid.fraction, lane, 32, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                    atomicOr(on_cones + box.first_word(static_cast<int>(y), static_cast<int>(z)) + x / 32,
                             word{1} << x % 32);
                    mark(x / winding_brick, y / winding_brick, z / winding_brick, core::has_samples_on_cones);
                });
    }
}

// Steps at crossings become winding numbers, and bits of those that the rule calls inside. A warp a row. of_cones: or
// null. marked: rows that are not 0 throughout.
template <class State>
__global__ __launch_bounds__(threads_per_block) void sum_windings_kernel(std::int32_t* windings, std::int32_t* of_cones,
                                                                         const std::uint8_t* marked,
                                                                         const __grid_constant__ row_grid grid,
                                                                         fill_rule rule, word* inside, State* state) {
    const unsigned lane = threadIdx.x % 32;
    const auto nx = static_cast<std::uint32_t>(grid.extent.x);
    const bit_box box{grid.extent};
    unsigned long long open = 0;
    std::uint32_t most = 0;
    for (std::uint64_t row = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block();
         row < grid.num_rows(); row += std::uint64_t{gridDim.x} * (threads_per_block / 32)) {
        if (marked[row] == 0) {
            for (std::uint32_t i = lane; i < box.words_x(); i += 32) inside[row * box.words_x() + i] = 0;
            continue;
        }
        std::int32_t* const of_row = windings + row * (std::uint64_t{nx} + 1);
        std::int32_t before = 0;
        for (std::uint32_t x0 = 0; x0 < nx; x0 += 32) {
            const std::uint32_t x = x0 + lane;
            const std::int32_t step = x < nx ? of_row[x] : 0, winding = before + sum_up_to_lane(step);
            before = __shfl_sync(0xffffffffu, winding, 31);
            if (x < nx) {
                if (winding != step) of_row[x] = winding; // rows are mostly 0
                const auto size = static_cast<std::uint32_t>(winding < 0 ? -winding : winding);
                most = size > most ? size : most;
            }
            const word bits =
                __ballot_sync(0xffffffffu, static_cast<int>(x < nx && core::is_inside(rule, std::int64_t{winding})));
            if (lane == 0) inside[row * box.words_x() + x0 / 32] = bits;
        }
        if (lane == 0 && before + of_row[nx] != 0) ++open;
        if (of_cones == nullptr) continue;
        std::int32_t* const cones = of_cones + row * (std::uint64_t{nx} + 1);
        before = 0;
        for (std::uint32_t x0 = 0; x0 < nx; x0 += 32) {
            const std::uint32_t x = x0 + lane;
            const std::int32_t step = x < nx ? cones[x] : 0, winding = before + sum_up_to_lane(step);
            before = __shfl_sync(0xffffffffu, winding, 31);
            if (x < nx && winding != step) cones[x] = winding;
        }
    }
    const unsigned long long sum = block_sum(open);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->solid.open_rows, sum);
    most = __reduce_max_sync(0xffffffffu, most);
    if (lane == 0 && most != 0) atomicMax(&state->solid.max_winding, static_cast<unsigned long long>(most));
}

// What an extent makes of the inside and of the cover in `mask`.
template <class State>
__global__ void join_cover_kernel(const word* inside, std::uint64_t num_words, solid_extent extent, word* mask,
                                  State*) {
    for_each_number(num_words, [&](std::uint64_t i) {
        mask[i] = extent == solid_extent::centre  ? inside[i]
                  : extent == solid_extent::outer ? inside[i] | mask[i]
                                                  : inside[i] & ~mask[i];
    });
}

// Makes the mask of a body from the crossings of all bodies and, unless the extent is `centre`, from its cover.
template <int = 0>
void add_windings(const winding_memory& m, const core::winding_view& tree, const geometry& geo,
                  const winding_triangles& triangles, const row_grid& grid, fill_rule rule, solid_extent extent,
                  std::uint32_t body, word* mask, pipeline_state* state, cudaStream_t stream) {
    const winding_input in = m.input(grid, body, rule);
    const bit_box box{grid.extent};
    const unsigned blocks = fill_device(grid.num_rows() * 32, 16);
    sum_windings_kernel<pipeline_state><<<blocks, threads_per_block, 0, stream>>>(
        m.windings + body * winding_memory::of_body(grid),
        m.of_cones == nullptr || tree.num_triangles == 0 ? nullptr : m.of_cones + body * winding_memory::of_body(grid),
        m.marked + body * grid.num_rows(), grid, rule, m.inside, state);
    check(cudaGetLastError(), stage::fine_raster);
    if (tree.num_triangles != 0) {
        m.clear_body(grid, stream);
        const std::uint64_t all =
            std::uint64_t{triangles.last} - triangles.first + triangles.last_cone - triangles.first_cone;
        mark_bricks_kernel<pipeline_state><<<fill_device(all * 32, 16), threads_per_block, 0, stream>>>(
            geo, grid, triangles, m.on_cones, m.marks, state);
        check(cudaGetLastError(), stage::fine_raster);
        decide_windings(tree, in, m.work, m.inside, state, stream);
    }
    join_cover_kernel<pipeline_state><<<fill_device(box.num_words(), 16), threads_per_block, 0, stream>>>(
        m.inside, box.num_words(), extent, mask, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
