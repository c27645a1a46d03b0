// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Loads and stores of words in global memory that blocks of a running kernel exchange: atomic, relaxed, for all blocks
// of the device. cuda::atomic_ref does the same, and its headers took a program 2 s to compile.

#include <voxelpipe/config.hpp>

#include <cstdint>

namespace voxelpipe::device {

[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t load_relaxed(const std::uint32_t& from) {
    std::uint32_t v;
    asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(v) : "l"(__cvta_generic_to_global(&from)) : "memory");
    return v;
}
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long load_relaxed(const unsigned long long& from) {
    unsigned long long v;
    asm volatile("ld.relaxed.gpu.global.u64 %0, [%1];" : "=l"(v) : "l"(__cvta_generic_to_global(&from)) : "memory");
    return v;
}
__device__ VOXELPIPE_INLINE void store_relaxed(std::uint32_t& to, std::uint32_t v) {
    asm volatile("st.relaxed.gpu.global.u32 [%0], %1;" ::"l"(__cvta_generic_to_global(&to)), "r"(v) : "memory");
}
__device__ VOXELPIPE_INLINE void store_relaxed(unsigned long long& to, unsigned long long v) {
    asm volatile("st.relaxed.gpu.global.u64 [%0], %1;" ::"l"(__cvta_generic_to_global(&to)), "l"(v) : "memory");
}

} // namespace voxelpipe::device
