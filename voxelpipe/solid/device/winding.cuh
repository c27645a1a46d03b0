// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding: the winding number of every voxel, of the mesh with its cones, and bricks of 8^3 voxels where the
// cones' solid angles may change the verdict (solid/core/winding_tree.hpp).

#include <voxelpipe/solid/core/winding_tree.hpp>
#include <voxelpipe/solid/device/bit_sweeps.cuh>
#include <voxelpipe/solid/device/emit_crossings.cuh>
#include <voxelpipe/solid/device/sweep_rows.cuh>

#include <cmath>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr int winding_brick = 8;

// Winding numbers of all bodies, a place a voxel and one behind each row; and bits of one body.
struct winding_memory {
    std::int32_t* windings = nullptr;
    word* inside = nullptr;

    [[nodiscard]] static std::uint64_t of_body(const row_grid& grid) {
        return grid.num_rows() * (static_cast<std::uint64_t>(grid.extent.x) + 1);
    }
    [[nodiscard]] static winding_memory take(arena& memory, const row_grid& grid, std::uint32_t bodies) {
        winding_memory m;
        m.windings = memory.take<std::int32_t>(of_body(grid) * bodies);
        m.inside = memory.take<word>(bit_box{grid.extent}.num_words());
        return m;
    }
    void clear(const row_grid& grid, std::uint32_t bodies, cudaStream_t stream) const {
        check(cudaMemsetAsync(windings, 0, of_body(grid) * bodies * sizeof(std::int32_t), stream), stage::fine_raster);
    }
};

// Steps at crossings become winding numbers, and bits of those that the rule calls inside. A warp a row.
template <class State>
__global__ __launch_bounds__(threads_per_block) void sum_windings_kernel(std::int32_t* windings,
                                                                         const __grid_constant__ row_grid grid,
                                                                         fill_rule rule, word* inside, State* state) {
    const unsigned lane = threadIdx.x % 32;
    const auto nx = static_cast<std::uint32_t>(grid.extent.x);
    const bit_box box{grid.extent};
    unsigned long long open = 0;
    std::uint32_t most = 0;
    for (std::uint64_t row = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block();
         row < grid.num_rows(); row += std::uint64_t{gridDim.x} * (threads_per_block / 32)) {
        std::int32_t* const of_row = windings + row * (std::uint64_t{nx} + 1);
        std::int32_t before = 0;
        for (std::uint32_t x0 = 0; x0 < nx; x0 += 32) {
            const std::uint32_t x = x0 + lane;
            const std::int32_t winding = before + sum_up_to_lane(x < nx ? of_row[x] : 0);
            before = __shfl_sync(0xffffffffu, winding, 31);
            if (x < nx) {
                of_row[x] = winding;
                const auto size = static_cast<std::uint32_t>(winding < 0 ? -winding : winding);
                most = size > most ? size : most;
            }
            const word bits =
                __ballot_sync(0xffffffffu, static_cast<int>(x < nx && core::is_inside(rule, std::int64_t{winding})));
            if (lane == 0) inside[row * box.words_x() + x0 / 32] = bits;
        }
        if (lane == 0 && before + of_row[nx] != 0) ++open;
    }
    const unsigned long long sum = block_sum(open);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->solid.open_rows, sum);
    most = __reduce_max_sync(0xffffffffu, most);
    if (lane == 0 && most != 0) atomicMax(&state->solid.max_winding, static_cast<unsigned long long>(most));
}

// Decides the samples of bricks by their generalized winding numbers, where these may differ from the others'. A warp
// takes a brick, whose rows are bytes of the bits. corner: from a brick's first sample to its middle, world units.
template <class State>
__global__ __launch_bounds__(threads_per_block) void decide_bricks_kernel(
    const std::int32_t* windings, const __grid_constant__ row_grid grid,
    const __grid_constant__ core::winding_view tree, fill_rule rule, const __grid_constant__ core::world_point corner,
    double reach, std::uint8_t* inside, const State* state) {
    if (state->index_error != 0) return;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const auto bricks_of = [](int n) { return static_cast<std::uint64_t>(n + winding_brick - 1) / winding_brick; };
    const std::uint64_t bx = bricks_of(grid.extent.x), by = bricks_of(grid.extent.y), bz = bricks_of(grid.extent.z);
    const bit_box box{grid.extent};
    const auto at = [&](int i) { return (2 * std::int64_t{i} + 1) << (grid.fraction - 1); };
    for (std::uint64_t brick = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block();
         brick < bx * by * bz; brick += std::uint64_t{gridDim.x} * (threads_per_block / 32)) {
        const int x0 = static_cast<int>(brick % bx) * winding_brick,
                  y0 = static_cast<int>(brick / bx % by) * winding_brick,
                  z0 = static_cast<int>(brick / (bx * by)) * winding_brick;
        core::world_point middle = core::to_world(tree, {at(x0), at(y0), at(z0)});
        for (int k = 0; k < 3; ++k) middle.x[k] += corner.x[k];
        std::int64_t whole = 0; // for all lanes alike
        const bool is_decided = core::find_whole(tree, middle, reach, core::coarse_bound, whole);
        if (is_decided && whole == 0) continue; // the bits are those of the winding numbers
        for (int step = 0; step < 2 * winding_brick; ++step) {
            const int x = x0 + lane % 8, y = y0 + lane / 8 + 4 * (step % 2), z = z0 + step / 2;
            const bool exists = x < grid.extent.x && y < grid.extent.y && z < grid.extent.z;
            bool is_in = false;
            if (exists) {
                const std::uint64_t place =
                    grid.row(y, z) * (static_cast<std::uint64_t>(grid.extent.x) + 1) + static_cast<std::uint64_t>(x);
                is_in = is_decided ? core::is_inside_beyond(rule, windings[place], whole)
                                   : core::is_inside_by_winding(tree, {at(x), at(y), at(z)}, windings[place], rule);
            }
            const word bits = __ballot_sync(0xffffffffu, static_cast<int>(is_in));
            if (exists && lane % 8 == 0)
                inside[box.first_word(y, z) * sizeof(word) + static_cast<std::uint64_t>(x0 / 8)] =
                    static_cast<std::uint8_t>(bits >> (lane / 8 * 8));
        }
    }
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
void add_windings(const winding_memory& m, const core::winding_view& tree, const row_grid& grid, fill_rule rule,
                  solid_extent extent, std::uint32_t body, const glm::dvec3& voxel_size, word* mask,
                  pipeline_state* state, cudaStream_t stream) {
    std::int32_t* const windings = m.windings + body * winding_memory::of_body(grid);
    const bit_box box{grid.extent};
    const unsigned blocks = fill_device(grid.num_rows() * 32, 16);
    sum_windings_kernel<pipeline_state>
        <<<blocks, threads_per_block, 0, stream>>>(windings, grid, rule, m.inside, state);
    check(cudaGetLastError(), stage::fine_raster);
    if (tree.num_triangles != 0) {
        const double half = 0.5 * (winding_brick - 1);
        const core::world_point corner{{half * voxel_size.x, half * voxel_size.y, half * voxel_size.z}};
        const double reach = std::hypot(corner.x[0], corner.x[1], corner.x[2]) * (1.0 + 0x1p-20);
        decide_bricks_kernel<pipeline_state><<<blocks, threads_per_block, 0, stream>>>(
            windings, grid, tree, rule, corner, reach, reinterpret_cast<std::uint8_t*>(m.inside), state);
        check(cudaGetLastError(), stage::fine_raster);
    }
    join_cover_kernel<pipeline_state><<<fill_device(box.num_words(), 16), threads_per_block, 0, stream>>>(
        m.inside, box.num_words(), extent, mask, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
