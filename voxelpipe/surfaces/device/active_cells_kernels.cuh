// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The cells that a surface passes, on a GPU: a warp goes along a row with a word a lane, where
// passes::count_active_cells and list_active_cells go word by word. Neighbouring lanes read neighbouring words. The
// results are the same.

#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/surfaces/passes/cells.hpp>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr unsigned active_cells_warps = 4; // of a block

// Templates, so that they are compiled only if called.
template <int = 0>
__global__ __launch_bounds__(32 * active_cells_warps) void count_active_cells_kernel(
    const __grid_constant__ core::passes::count_active_cells pass, std::uint64_t num_rows) {
    await_stream();
    const std::uint64_t row = std::uint64_t{blockIdx.x} * active_cells_warps + warp_in_block();
    if (row >= num_rows) return;
    unsigned n = 0;
    if (row < pass.cells.rows()) {
        const int y = pass.cells.y(row), z = pass.cells.z(row), words = pass.cells.row_words();
        for (int w = static_cast<int>(threadIdx.x % 32); w < words; w += 32)
            n += static_cast<unsigned>(__popc(core::passes::cell_rows(pass.cells.samples, w, y, z).active()));
    }
    n = __reduce_add_sync(0xffffffffu, n);
    if (threadIdx.x % 32 == 0) pass.counts[row] = n;
}

// any: null, or a number that is 0 where nothing is to be done.
template <int = 0>
__global__ __launch_bounds__(32 * active_cells_warps) void list_active_cells_kernel(
    const __grid_constant__ core::passes::list_active_cells pass, std::uint64_t num_rows, const std::uint64_t* any) {
    await_stream();
    const std::uint64_t row = std::uint64_t{blockIdx.x} * active_cells_warps + warp_in_block();
    if (row >= num_rows || (any != nullptr && *any == 0)) return;
    const int y = pass.cells.y(row), z = pass.cells.z(row), words = pass.cells.row_words(),
              lane = static_cast<int>(threadIdx.x % 32);
    std::uint64_t first = pass.first_of_row[row];
    for (int begin = 0; begin < words; begin += 32) {
        const int w = begin + lane;
        const core::passes::cell_rows samples(pass.cells.samples, w, y, z); // empty beyond the row
        std::uint32_t left = w < words ? samples.active() : 0;
        const auto n = static_cast<unsigned>(__popc(left));
        unsigned behind = n; // cells up to the end of the word
        for (int step = 1; step < 32; step *= 2) {
            const unsigned other = __shfl_up_sync(0xffffffffu, behind, step);
            if (lane >= step) behind += other;
        }
        std::uint64_t at = first + behind - n;
        if (w < words)
            pass.first_of_word[row * static_cast<std::uint64_t>(words) + static_cast<std::uint64_t>(w)] =
                static_cast<std::uint32_t>(at);
        for (; left != 0; left &= left - 1) {
            const int bit = exact::lowest_one(left);
            pass.keys[at] = core::passes::cell_key::of(32 * w + bit, y, z).key;
            pass.states[at++] = static_cast<std::uint16_t>(samples.corners(bit));
        }
        first += __shfl_sync(0xffffffffu, behind, 31);
    }
}

[[nodiscard]] inline unsigned active_cells_blocks(std::uint64_t num_rows) {
    return static_cast<unsigned>((num_rows - 1) / active_cells_warps + 1);
}
template <int = 0>
void count_active_cells(const core::passes::count_active_cells& pass, std::uint64_t num_rows, cudaStream_t stream) {
    launch_behind(count_active_cells_kernel<>, active_cells_blocks(num_rows), 32 * active_cells_warps, stream,
                  stage::coarse_raster, pass, num_rows);
}
template <int = 0>
void list_active_cells(const core::passes::list_active_cells& pass, std::uint64_t num_rows, const std::uint64_t* any,
                       cudaStream_t stream) {
    launch_behind(list_active_cells_kernel<>, active_cells_blocks(num_rows), 32 * active_cells_warps, stream,
                  stage::coarse_raster, pass, num_rows, any);
}

} // namespace voxelpipe::device
