// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Limits of GPU architectures, and which of the compiled architectures a device runs. Policies depend on that and are
// chosen on the host, whose code is compiled once for all architectures. Plain C++, numbers only.

#include <array>
#include <cstddef>

namespace voxelpipe::tuning {

// Limits of a compute capability, from the CUDA programming guide, in bytes and threads.
struct architecture {
    int capability;       // 90 for 9.0
    int shared_per_sm;    // shared memory of a multiprocessor; each block takes 1 KB more than it asks for
    int shared_per_block; // the most that one block can request
    int threads_per_sm;
};

inline constexpr std::array architectures{
    architecture{80, 164 * 1024, 163 * 1024, 2048},  architecture{86, 100 * 1024, 99 * 1024, 1536},
    architecture{89, 100 * 1024, 99 * 1024, 1536},   architecture{90, 228 * 1024, 227 * 1024, 2048},
    architecture{100, 228 * 1024, 227 * 1024, 2048}, architecture{120, 100 * 1024, 99 * 1024, 1536},
};

// Index of the last entry of an ascending list that is not above `capability`; 0 if all are above.
template <class List>
[[nodiscard]] constexpr std::size_t last_not_above(const List& list, int capability) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < list.size(); ++i)
        if (list[i].capability <= capability) found = i;
    return found;
}

[[nodiscard]] constexpr const architecture& architecture_of(int capability) {
    return architectures[last_not_above(architectures, capability)];
}

// The least maximum of shared memory per block over all architectures.
[[nodiscard]] constexpr int portable_shared_per_block() {
    int least = architectures[0].shared_per_block;
    for (const architecture& a : architectures) least = a.shared_per_block < least ? a.shared_per_block : least;
    return least;
}

struct compiled_architecture {
    int capability;
};

// The architectures that this translation unit is compiled for, ascending: nvcc passes 800,900 for sm_80 and sm_90. All
// units of a program must be compiled for the same list. Without nvcc: the oldest.
#if defined(__CUDA_ARCH_LIST__)
[[nodiscard]] constexpr auto compiled_architectures() {
    constexpr int list[] = {__CUDA_ARCH_LIST__};
    std::array<compiled_architecture, sizeof(list) / sizeof(list[0])> result{};
    for (std::size_t i = 0; i < result.size(); ++i) result[i].capability = list[i] / 10;
    return result;
}
#else
[[nodiscard]] constexpr auto compiled_architectures() {
    return std::array{compiled_architecture{architectures[0].capability}};
}
#endif

// The architecture whose code a device runs: machine code of its own architecture or an older one of the same
// generation, otherwise the newest PTX that it can translate. In each case the newest of the list that is not newer
// than the device.
[[nodiscard]] constexpr int compiled_for(int device_capability) {
    constexpr auto list = compiled_architectures();
    return list[last_not_above(list, device_capability)].capability;
}

} // namespace voxelpipe::tuning
