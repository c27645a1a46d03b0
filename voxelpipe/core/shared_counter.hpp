// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Words that many threads change, on the host or on the device.

#include <voxelpipe/config.hpp>
#include <voxelpipe/core/bisect.hpp>

#include <atomic>
#include <cstdint>

namespace voxelpipe::core {

VOXELPIPE_HD inline void add_shared(std::uint64_t& to, std::uint64_t n) {
#if defined(__CUDA_ARCH__)
    atomicAdd(reinterpret_cast<unsigned long long*>(&to), static_cast<unsigned long long>(n));
#else
    std::atomic_ref(to).fetch_add(n, std::memory_order_relaxed);
#endif
}

// The same; returns what it was before, so that each caller gets places of its own.
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t fetch_add_shared(std::uint64_t& to, std::uint64_t n) {
#if defined(__CUDA_ARCH__)
    return atomicAdd(reinterpret_cast<unsigned long long*>(&to), static_cast<unsigned long long>(n));
#else
    return std::atomic_ref(to).fetch_add(n, std::memory_order_relaxed);
#endif
}
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t exchange_shared(std::uint32_t& to, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
    return atomicExch(&to, value);
#else
    return std::atomic_ref(to).exchange(value, std::memory_order_relaxed);
#endif
}

[[nodiscard]] VOXELPIPE_HD inline std::uint32_t load_shared(const std::uint32_t& from) {
#if defined(__CUDA_ARCH__)
    return *reinterpret_cast<const volatile std::uint32_t*>(&from);
#else
    return std::atomic_ref(const_cast<std::uint32_t&>(from)).load(std::memory_order_relaxed);
#endif
}

// Sets or clears the bits of `mask`.
VOXELPIPE_HD inline void store_shared(std::uint32_t& to, std::uint32_t mask, bool value) {
#if defined(__CUDA_ARCH__)
    value ? atomicOr(&to, mask) : atomicAnd(&to, ~mask);
#else
    if (value)
        std::atomic_ref(to).fetch_or(mask, std::memory_order_relaxed);
    else
        std::atomic_ref(to).fetch_and(~mask, std::memory_order_relaxed);
#endif
}

// The last i of 0 .. count - 1 with first[i] <= number; first[0] is 0.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t find_owner(const std::uint64_t* first, std::uint32_t count,
                                                           std::uint64_t number) {
    return bisect_last(0u, count, [=](std::uint32_t i) { return first[i] <= number; });
}

} // namespace voxelpipe::core
