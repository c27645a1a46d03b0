// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior: what a flood from around the grid does not reach, with walls that are grown by `closing`.

#include <voxelpipe/solid/device/flood_tiles.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Walls that are grown by `closing` need a ring that wide around the grid. All beyond it is reached.
struct exterior_memory {
    bit_box grid{};
    int closing = 0;
    word *walls = nullptr, *spare = nullptr; // of the grid with its ring, if there is one
    flood_tiles tiles{};

    [[nodiscard]] static exterior_memory take(arena& memory, const glm::ivec3& extent, int closing) {
        exterior_memory m;
        m.closing = closing;
        m.grid = {extent};
        const bit_box box{extent + 2 * closing};
        if (closing != 0) {
            m.walls = memory.take<word>(box.num_words());
            m.spare = memory.take<word>(box.num_words());
        }
        m.tiles = flood_tiles::take(memory, box);
        return m;
    }
};

// Launches rounds of the flood until one changes nothing. The host looks once in flood_launches.
template <int = 0>
void flood_from_outside(const flood_tiles& tiles, const word* walls, cudaStream_t stream) {
    const unsigned blocks = fill_device(tiles.size() * 32, tuning::flood_blocks);
    start_flood_kernel<word><<<fill_device(tiles.size() * 32), threads_per_block, 0, stream>>>(walls, tiles);
    check(cudaGetLastError(), stage::fine_raster);
    for (unsigned goes_on = 1; goes_on != 0;) {
        check(cudaMemsetAsync(tiles.changed, 0, tuning::flood_launches * sizeof(unsigned), stream), stage::fine_raster);
        for (int launch = 0; launch < tuning::flood_launches; ++launch)
            launch_behind(flood_tiles_kernel<unsigned>, blocks, threads_per_block, stream, stage::fine_raster, tiles,
                          launch, tiles.changed);
        check(cudaMemcpyAsync(&goes_on, tiles.changed + tuning::flood_launches - 1, sizeof(unsigned),
                              cudaMemcpyDeviceToHost, stream),
              stage::fine_raster);
        check(cudaStreamSynchronize(stream), stage::fine_raster);
    }
}

// The mask's touched voxels become the inside. Waits for the flood.
template <int = 0>
void fill_to_exterior(const exterior_memory& m, word* mask, cudaStream_t stream) {
    const bit_box& box = m.tiles.box;
    const unsigned blocks = fill_device(box.num_words(), 16);
    if (m.closing == 0) {
        flood_from_outside(m.tiles, mask, stream);
        take_reached_kernel<word><<<blocks, threads_per_block, 0, stream>>>(m.tiles, true, mask);
    } else {
        place_walls_kernel<word><<<blocks, threads_per_block, 0, stream>>>(mask, m.grid, m.closing, m.walls, box);
        dilate(m.walls, m.spare, box, m.closing, stream);
        flood_from_outside(m.tiles, m.walls, stream);
        take_reached_kernel<word><<<blocks, threads_per_block, 0, stream>>>(m.tiles, false, m.walls);
        dilate(m.walls, m.spare, box, m.closing, stream);
        take_interior_kernel<word><<<blocks, threads_per_block, 0, stream>>>(m.walls, box, m.closing, mask, m.grid);
    }
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
