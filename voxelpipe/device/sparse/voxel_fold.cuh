// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Values of the voxels of a sparse framebuffer: a thread a voxel folds its fragments in the order of their primitives,
// which is the meaning of every blend. The fragments' outputs come from an A-buffer whose payload is all of them.

#include <voxelpipe/all_outputs.hpp>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/sparse/brick_build.cuh>
#include <voxelpipe/sparse.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

using core::outputs_payload;
using core::payload_shader;

// One target of a call, in device memory.
template <class Target>
struct fold_target {
    using map = core::rank_map<Target>;
    typename Target::value_type background; // where a voxel starts that did not exist
    load_operation load;
    bool keeps_sums;
    const typename map::element* before; // values by earlier rank
    typename map::element* values;
    core::kept_sum<Target>* sums;
};

// num_voxels, on the device: how many there are. existing: null if no voxel existed.
template <std::size_t I, class Target, class Payload>
__global__ void fold_voxels(const fold_target<Target> t, const std::uint64_t* num_voxels, const std::uint32_t* listed,
                            const std::uint32_t* existing, const std::uint64_t* first, const Payload* payloads) {
    using map = core::rank_map<Target>;
    using traits = typename Target::traits;
    const std::uint64_t rank = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const bool in = rank < *num_voxels;
    typename Target::value_type value{};
    if (in) {
        const std::uint32_t from = listed[rank], old = existing == nullptr ? no_source : existing[rank];
        const bool loaded = old != no_source && t.load != load_operation::clear;
        if (loaded)
            value = map::load(t.before, old);
        else
            value = t.background;
        // Sums that are kept begin without the clear value, which is added at the end.
        if (t.load != load_operation::off || t.keeps_sums) {
            auto sum = traits::begin(t.keeps_sums && !loaded ? traits::identity() : value);
            if (t.load != load_operation::off && from != no_source)
                for (std::uint64_t f = first[from]; f < first[from + 1]; ++f) traits::apply(sum, get<I>(payloads[f]));
            if constexpr (core::has_wide_sums<Target>) {
                if (t.keeps_sums) {
                    t.sums[rank] = sum;
                    if (!loaded) core::add_sums(sum, traits::begin(t.background));
                }
            }
            if (t.keeps_sums || from != no_source) value = traits::end(sum);
        }
    }
    if constexpr (map::is_bit) { // a word has the bits of a warp
        const unsigned word = __ballot_sync(0xffffffffu, in && value);
        if (in && rank % 32 == 0) t.values[rank / 32] = word;
    } else {
        if (in) map::store(t.values, rank, value);
    }
}

} // namespace voxelpipe::device
