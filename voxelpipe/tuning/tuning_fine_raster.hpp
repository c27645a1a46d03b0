// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile size and block size of the fine raster, chosen by the bits of shared memory that a voxel's targets need and by
// the architecture. Results do not depend on them. A backend may be given another selector: a constexpr functor (bits
// of a voxel, compute capability) -> policy, or (bits of a voxel) -> policy for all architectures.
//
// A policy, except blocks_per_sm, is part of a kernel's type. So it is chosen at compile time for each architecture of
// the program, and at run time among those by the device (with_policy). Architectures with equal policies share one
// kernel.

#include <voxelpipe/tuning/architecture.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::tuning {

struct fine_raster_policy {
    int threads_per_block; // a multiple of 32, at most 1024
    int log2_tile_size;    // 3, 4 or 5: a tile is a cube of 8, 16 or 32 voxels
    int min_blocks_per_sm; // bounds the registers
    int blocks_per_sm = 0; // persistent blocks that the host starts on a multiprocessor; 0: as many as fit

    friend constexpr bool operator==(const fine_raster_policy&, const fine_raster_policy&) = default;
};

// Choice for voxels of a number of bits, including one that says whether the voxel is touched.
struct fine_raster_numbers_of_bits {
    int threads_per_block;
    int min_blocks_per_sm;
    int tile_bytes; // the tile is the largest that needs no more than this
};
// One row per architecture; the comment beside it says what was measured.
struct fine_raster_numbers {
    int capability;
    fine_raster_numbers_of_bits one_bit, more; // a target of bits alone; any others
    int blocks_per_sm;
};

// Measured by bench_gpu_tune on conference, dragon and hairball at 128^3, 512^3 and 1024^3, both rules: distance to the
// best policy of each cell, geometric mean and at worst, of eleven policies for one bit and of seven for sums of floats
// (97 bits). NVIDIA H200, driver 580.159.04, CUDA 13.0, commit df1a416, records/h200/tune.csv. One bit:
// 256 threads, 4 blocks, 16^3 1.184 x and 1.62 x; 128, 4, 32^3 1.210 and 2.14; 256, 2, 32^3 1.216 and 3.03; 128, 4,
// 16^3 1.222 and 1.57. Sums: 256, 2, 16^3 1.077 and 1.48; 512, 2, 16^3 1.094 and 1.30; 128, 4, 16^3 1.151 and 1.84.
inline constexpr fine_raster_numbers_of_bits h200_one_bit{256, 4, 2 * 1024}, h200_more{256, 2, 49 * 1024};
inline constexpr std::array fine_raster_table{
    fine_raster_numbers{80, h200_one_bit, h200_more, 0},  // not measured
    fine_raster_numbers{86, h200_one_bit, h200_more, 0},  // not measured
    fine_raster_numbers{89, h200_one_bit, h200_more, 0},  // not measured
    fine_raster_numbers{90, h200_one_bit, h200_more, 0},  // NVIDIA H200: above
    fine_raster_numbers{100, h200_one_bit, h200_more, 0}, // not measured
    fine_raster_numbers{120, h200_one_bit, h200_more, 0}, // not measured
};

[[nodiscard]] constexpr const fine_raster_numbers& fine_raster_numbers_of(int capability) {
    return fine_raster_table[last_not_above(fine_raster_table, capability)];
}

// Targets that together need more than this are drawn in several fine passes over the same tiles: 8^3 voxels of 130
// bytes are 65 KB, which a block can have on every architecture in addition to a batch of triangles.
inline constexpr int max_bits_per_voxel = 130 * 8;
inline constexpr int batch_bytes = 34 * 1024; // of shared memory, at 256 threads a block
static_assert(max_bits_per_voxel / 8 * 512 <= portable_shared_per_block() - batch_bytes);

struct fine_raster_selector {
    constexpr fine_raster_policy operator()(int bits_per_voxel, int capability = architectures[0].capability) const {
        const fine_raster_numbers& row = fine_raster_numbers_of(capability);
        const fine_raster_numbers_of_bits& numbers = bits_per_voxel <= 2 ? row.one_bit : row.more;
        int log2_size = 5;
        while (log2_size > 3 && (std::int64_t{bits_per_voxel} << (3 * log2_size)) / 8 > numbers.tile_bytes) --log2_size;
        return {numbers.threads_per_block, log2_size, numbers.min_blocks_per_sm, row.blocks_per_sm};
    }
};

// Calls a selector with the arguments that it takes.
template <class Selector>
[[nodiscard]] constexpr fine_raster_policy select_policy(int bits_per_voxel, int capability) {
    if constexpr (std::is_invocable_v<const Selector&, int, int>)
        return Selector{}(bits_per_voxel, capability);
    else
        return Selector{}(bits_per_voxel);
}

// Calls f.template operator()<Policy>() with the policy of the code that a device of this compute capability runs. On
// the host. I: index of the list's entry to test; entries above it have been tested.
template <class Selector, int BitsPerVoxel, std::size_t I = compiled_architectures().size() - 1, class F>
auto with_policy(int device_capability, const F& f) {
    constexpr int capability = compiled_architectures()[I].capability;
    constexpr fine_raster_policy policy = select_policy<Selector>(BitsPerVoxel, capability);
    if constexpr (I == 0) {
        return f.template operator()<policy>();
    } else {
        if (device_capability >= capability) return f.template operator()<policy>();
        return with_policy<Selector, BitsPerVoxel, I - 1>(device_capability, f);
    }
}

} // namespace voxelpipe::tuning
