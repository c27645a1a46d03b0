// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior: what a flood from around the grid does not reach. The flood goes along x, y and z in turn, each
// line of voxels in both directions, until a round of the three changes nothing. The set does not depend on the order.

#include <voxelpipe/device/solid/bit_sweeps.cuh>

#include <cstdint>

namespace voxelpipe::device {

// The mask's bits with a ring of untouched voxels around.
template <class Word>
__global__ void place_walls_kernel(const Word* mask, const __grid_constant__ bit_box grid, int ring, Word* walls,
                                   const __grid_constant__ bit_box box) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word_at_box at(box, i);
        walls[i] = grid.bits_from(mask, static_cast<int>(at.word_x) * 32 - ring, at.y - ring, at.z - ring);
    });
}
// The faces of the box, which hold no walls, are reached.
template <class Word>
__global__ void start_flood_kernel(Word* reached, const __grid_constant__ bit_box box) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word_at_box at(box, i);
        const bool is_face = at.y == 0 || at.z == 0 || at.y == box.extent.y - 1 || at.z == box.extent.z - 1;
        word bits = is_face ? ~0u : at.word_x == 0 ? 1u : 0u;
        if (at.word_x + 1 == box.words_x()) bits |= 1u << (box.extent.x - 1) % 32;
        reached[i] = bits & box.valid_bits(at.word_x);
    });
}

// Spreads the reached bits of each row over its open bits. One thread a row.
template <class Word>
__global__ __launch_bounds__(threads_per_block) void flood_rows_kernel(const Word* walls, Word* reached,
                                                                       const __grid_constant__ bit_box box,
                                                                       unsigned* changed) {
    const std::uint64_t rows = static_cast<std::uint64_t>(box.extent.y) * static_cast<std::uint64_t>(box.extent.z);
    const std::uint32_t n = box.words_x();
    bool has_changed = false;
    for_each_number(rows, [&](std::uint64_t i) {
        const word* const wall = walls + i * n;
        word* const row = reached + i * n;
        const auto open_at = [&](std::uint32_t k) { return ~wall[k] & box.valid_bits(k); };
        // Upwards: the sum of the open bits and the seeds carries through each run from its lowest seed on; what
        // changes by it is reached, and what passes out of the word is the next one's seed.
        word carry = 0;
        for (std::uint32_t k = 0; k < n; ++k) {
            const word open = open_at(k), old = row[k], seeds = old | (carry & open), sum = open + seeds;
            const word now = seeds | (open & ~sum);
            carry = sum < open ? 1 : 0;
            if (now == old) continue;
            row[k] = now;
            has_changed = true;
        }
        word above = 0;
        for (std::uint32_t k = n; k-- > 0;) {
            const word open = open_at(k), old = row[k];
            word now = old | (above << 31 & open), run = open;
            for (int step = 1; step < 32; step *= 2) {
                now |= now >> step & run;
                run &= run >> step;
            }
            above = now & 1u;
            if (now == old) continue;
            row[k] = now;
            has_changed = true;
        }
    });
    if (__syncthreads_or(static_cast<int>(has_changed)) != 0 && threadIdx.x == 0) atomicOr(changed, 1u);
}
// The same along y or z, 32 lines at once.
template <class Word>
__global__ __launch_bounds__(threads_per_block) void flood_lines_kernel(const Word* walls, Word* reached,
                                                                        const __grid_constant__ bit_box box, int axis,
                                                                        unsigned* changed) {
    constexpr int batch = 8; // loads that go out together
    const word_lines lines(box, axis);
    bool has_changed = false;
    for_each_number(lines.count, [&](std::uint64_t l) {
        const std::uint64_t first = lines.first(l, box, axis);
        for (int direction = 0; direction < 2; ++direction) {
            word flow = 0;
            for (int start = 0; start < lines.length; start += batch) {
                word wall[batch], old[batch];
                const auto at = [&](int k) {
                    const int i = direction == 0 ? start + k : lines.length - 1 - start - k;
                    return first + static_cast<std::uint64_t>(i) * lines.stride;
                };
                for (int k = 0; k < batch; ++k) {
                    const bool valid = start + k < lines.length;
                    wall[k] = valid ? walls[at(k)] : ~0u;
                    old[k] = valid ? reached[at(k)] : 0u;
                }
                for (int k = 0; k < batch; ++k) {
                    flow = (flow | old[k]) & ~wall[k];
                    if (flow == old[k]) continue;
                    reached[at(k)] = flow;
                    has_changed = true;
                }
            }
        }
    });
    if (__syncthreads_or(static_cast<int>(has_changed)) != 0 && threadIdx.x == 0) atomicOr(changed, 1u);
}
// What is not reached, without the ring.
template <class Word>
__global__ void take_interior_kernel(const Word* reached, const __grid_constant__ bit_box box, int ring, Word* mask,
                                     const __grid_constant__ bit_box grid) {
    for_each_number(grid.num_words(), [&](std::uint64_t i) {
        const word_at_box at(grid, i);
        mask[i] = ~box.bits_from(reached, static_cast<int>(at.word_x) * 32 + ring, at.y + ring, at.z + ring) &
                  grid.valid_bits(at.word_x);
    });
}

struct exterior_memory {
    bit_box grid{}, box{}; // box: with the ring
    int closing = 0;
    word *walls = nullptr, *reached = nullptr;
    unsigned* changed = nullptr;

    [[nodiscard]] static exterior_memory take(arena& memory, const glm::ivec3& extent, int closing) {
        exterior_memory m;
        m.closing = closing;
        m.grid = {extent};
        m.box = {extent + 2 * (closing + 1)};
        m.walls = memory.take<word>(m.box.num_words());
        m.reached = memory.take<word>(m.box.num_words());
        m.changed = memory.take<unsigned>(1);
        return m;
    }
};

// The mask's touched voxels become the inside. Waits, as often as the flood turns.
template <int = 0>
void fill_to_exterior(const exterior_memory& m, word* mask, cudaStream_t stream) {
    const auto& [grid, box, closing, walls, reached, changed] = m;
    const int ring = closing + 1;
    const unsigned blocks = fill_device(box.num_words(), 16);
    place_walls_kernel<word><<<blocks, threads_per_block, 0, stream>>>(mask, grid, ring, walls, box);
    dilate(walls, reached, box, closing, stream);
    start_flood_kernel<word><<<blocks, threads_per_block, 0, stream>>>(reached, box);
    for (unsigned goes_on = 1; goes_on != 0;) {
        check(cudaMemsetAsync(changed, 0, sizeof(unsigned), stream), stage::fine_raster);
        flood_rows_kernel<word><<<blocks, threads_per_block, 0, stream>>>(walls, reached, box, changed);
        for (const int axis : {1, 2})
            flood_lines_kernel<word><<<blocks, threads_per_block, 0, stream>>>(walls, reached, box, axis, changed);
        check(cudaGetLastError(), stage::fine_raster);
        check(cudaMemcpyAsync(&goes_on, changed, sizeof(unsigned), cudaMemcpyDeviceToHost, stream), stage::fine_raster);
        check(cudaStreamSynchronize(stream), stage::fine_raster);
    }
    dilate(reached, walls, box, closing, stream);
    take_interior_kernel<word><<<blocks, threads_per_block, 0, stream>>>(reached, box, ring, mask, grid);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
