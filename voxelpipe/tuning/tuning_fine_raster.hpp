// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile size and block size of the fine raster, from the bytes of shared memory that a voxel's targets need. Numbers
// only. Results do not depend on them; a backend may be given another selector.

#include <cstdint>

namespace voxelpipe::tuning {

struct fine_raster_policy {
    int threads_per_block; // a multiple of 32, at most 1024
    int log2_tile_size;    // 3, 4 or 5: a tile is a cube of 8, 16 or 32 voxels
    int min_blocks_per_sm; // what the registers have to leave room for
};

// Two blocks with tiles of 48 KB fit the shared memory of every architecture from sm_80 on (sm_86 and sm_89 have 100 KB
// a multiprocessor, sm_80 164, sm_90 228); bits take 32^3 voxels in 4 KB.
struct fine_raster_selector {
    static constexpr int tile_bytes = 49 * 1024;

    constexpr fine_raster_policy operator()(int bits_per_voxel) const {
        int log2_size = 5;
        while (log2_size > 3 && (std::int64_t{bits_per_voxel} << (3 * log2_size)) / 8 > tile_bytes) --log2_size;
        return {256, log2_size, 2};
    }
};

// Targets that need more than this together are drawn in several fine passes over the same tiles: 8^3 voxels of 190
// bytes are 95 KB, which a block can have on every architecture from sm_80 on.
inline constexpr int most_bits_per_voxel = 190 * 8;

} // namespace voxelpipe::tuning
