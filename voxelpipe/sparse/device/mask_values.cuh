// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Values of voxels whose fragments all have one value: the same for every voxel, or a function of the number of a
// voxel's fragments. Only the device knows how many voxels there are.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/targets/fill_from_mask.cuh>
#include <voxelpipe/device/targets/repeated_fold.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// True if a target's value is known from the number of a voxel's fragments, all of one value.
template <class Target>
inline constexpr bool follows_from_count =
    is_blended_once<Target> || core::repeated_fold<typename Target::blend_type, typename Target::value_type>::available;

template <class Element>
__global__ void fill_values(Element* values, const unsigned long long* voxels, Element value) {
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < *voxels;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        values[i] = value;
}
// Fills a target of bits, a word a thread. Bits behind the last voxel are 0.
template <int = 0> // compiled where it is called
__global__ void fill_bits(word* values, const unsigned long long* voxels, word value) {
    for (std::uint64_t w = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; 32 * w < *voxels;
         w += std::uint64_t{gridDim.x} * blockDim.x) {
        const std::uint64_t left = *voxels - 32 * w;
        values[w] = left >= 32 ? value : value & ((1u << left) - 1);
    }
}
template <class Target>
__global__ void fold_counts(typename Target::value_type* values, const unsigned long long* voxels,
                            const std::uint32_t* counts,
                            core::repeated_fold<typename Target::blend_type, typename Target::value_type> fold) {
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < *voxels;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        values[i] = fold(counts[i]);
}
template <class Target>
__global__ void fold_bit_counts(word* values, const unsigned long long* voxels, const std::uint32_t* counts,
                                core::repeated_fold<typename Target::blend_type, typename Target::value_type> fold) {
    for (std::uint64_t w = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; 32 * w < *voxels;
         w += std::uint64_t{gridDim.x} * blockDim.x) {
        word bits = 0;
        for (unsigned k = 0; k < 32 && 32 * w + k < *voxels; ++k)
            bits |= static_cast<word>(static_cast<bool>(fold(counts[32 * w + k]))) << k;
        values[w] = bits;
    }
}

// Writes one value of a target for the voxels, at most `capacity`, as many as *voxels on the device.
template <class Target>
void fill_mask_values(typename core::rank_map<Target>::element* values, std::uint64_t capacity,
                      const unsigned long long* voxels, const typename Target::value_type& value, cudaStream_t stream) {
    using map = core::rank_map<Target>;
    const auto launch = [&](auto* kernel, const auto& written) {
        launch_kernel(false, kernel, fill_device(map::elements(capacity)), threads_per_block, 0, stream,
                      stage::tile_resolve, values, voxels, written);
    };
    if constexpr (map::is_bit)
        launch(fill_bits<0>, value ? ~word{0} : word{0});
    else
        launch(fill_values<typename Target::value_type>, value);
}
// Writes target I of the voxels, at most `capacity`, as many as *voxels on the device. start: what they begin with;
// is_off: and keep. counted(): the numbers of fragments by rank, if they are needed.
template <std::size_t I, class Target, class FragmentShader, class Counted>
void write_mask_values(typename core::rank_map<Target>::element* values, std::uint64_t capacity,
                       const unsigned long long* voxels, const FragmentShader& shader,
                       const typename Target::value_type& start, bool is_off, const Counted& counted,
                       cudaStream_t stream) {
    using map = core::rank_map<Target>;
    using value_type = typename Target::value_type;
    const auto launch = [&](auto* kernel, const auto&... arguments) {
        launch_kernel(false, kernel, fill_device(map::elements(capacity)), threads_per_block, 0, stream,
                      stage::tile_resolve, values, voxels, arguments...);
    };
    const auto fill = [&](const value_type& value) {
        fill_mask_values<Target>(values, capacity, voxels, value, stream);
    };
    value_type drawn{};
    if constexpr (!std::is_same_v<typename Target::blend_type, blend::count>) drawn = get<I>(shader.values);
    if (is_off) {
        fill(start);
    } else if constexpr (is_blended_once<Target>) {
        fill(blended_once<Target>(start, drawn));
    } else {
        const core::repeated_fold<typename Target::blend_type, value_type> fold(start, drawn);
        if constexpr (map::is_bit)
            launch(fold_bit_counts<Target>, counted(), fold);
        else
            launch(fold_counts<Target>, counted(), fold);
    }
}

} // namespace voxelpipe::device
