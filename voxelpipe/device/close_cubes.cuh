// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bits of a batch of triangles that all lie within a few voxels, by their warp at once. Of the finest meshes 32
// neighbours touch two words or three, all over again, and warps that look at those one by one wait for one another.

#include <voxelpipe/device/direct_target.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Whether batches of a mesh are likely to lie within 4 x 4 x 4 voxels, as far as the host knows: otherwise to ask costs
// more than it gains. Of a surface as large as three of the grid's faces 32 triangles then cover five voxels or fewer.
[[nodiscard]] inline bool may_be_close(std::uint32_t num_triangles, const glm::ivec3& extent) {
    constexpr std::uint64_t least = 6; // triangles for each voxel of those faces
    const std::uint64_t x = static_cast<std::uint32_t>(extent.x), y = static_cast<std::uint32_t>(extent.y),
                        z = static_cast<std::uint32_t>(extent.z);
    return num_triangles >= least * (x * y + y * z + z * x);
}

// Sets the cubes of 2 x 2 x 2 voxels of a warp's lanes, where they lie within 4 x 4 x 4: two numbers hold all of them.
// Of each lane the voxels x + 2 y + 4 z from lo on, which is anything where there are none; none lies outside of the
// target. Returns whether they lie so; otherwise nothing is done. All lanes take part.
template <class Target>
[[nodiscard]] __device__ VOXELPIPE_INLINE bool set_close_cubes(const target_view<Target>& t,
                                                               const std::int32_t (&lo)[3], word voxels) {
    constexpr unsigned all = 0xffffffffu;
    constexpr int middle_lane = 16; // its cube is to be in the middle
    const auto lane = static_cast<int>(threadIdx.x) % 32;
    std::int32_t begin[3]; // maybe outside of the grid
    std::uint32_t from[3];
    for (int k = 0; k < 3; ++k) {
        const auto mine = static_cast<std::uint32_t>(lo[k]), first = __shfl_sync(all, mine, middle_lane) - 1;
        begin[k] = static_cast<std::int32_t>(first);
        from[k] = mine - first;
    }
    if (!__all_sync(all, voxels != 0 ? core::max3(from[0], from[1], from[2]) <= 2 : lane != middle_lane)) return false;
    const word by_z = (voxels & 0xfu) | (voxels & 0xf0u) << 12;
    const word by_y = ((by_z & 0x30003u) | (by_z << 2 & 0x300030u)) << ((from[0] + 4 * from[1]) & 31); // x + 4 y + 16 z
    const std::uint64_t mine = std::uint64_t{by_y} << (16 * from[2] & 63);
    const word low = __reduce_or_sync(all, static_cast<word>(mine)),
               high = __reduce_or_sync(all, static_cast<word>(mine >> 32));
    const word row = (lane < 8 ? low : high) >> (4 * lane & 31) & 15u;
    if (lane < 16 && row != 0) {
        const auto shift = static_cast<unsigned>(begin[0] & 31);
        const std::uint32_t number = word_of(t, begin[0], begin[1] + lane % 4, begin[2] + lane / 4);
        word missing = row << shift;
        if (missing != 0) missing &= ~__ldca(word_at(t, number)); // maybe an old word: what has changed stays so
        reduce_word<Target>(word_at(t, number), missing);
        if (shift > 28) reduce_word<Target>(word_at(t, number + 1), row >> (32 - shift));
    }
    return true;
}

} // namespace voxelpipe::device
