// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Targets that no atomic can serve (order-dependent blends of the user's, large order-free ones): their fragments are
// listed with all shader outputs, ordered by (voxel, primitive), and each voxel is folded in triangle order, as
// core/blend defines every blend. One thread a voxel.

#include <voxelpipe/device/abuffer_emit.cuh>
#include <voxelpipe/device/tile_image.cuh>

namespace voxelpipe::device {

template <class Key, class Values, class Framebuffer, std::size_t... I>
__global__ void fold_kernel(fragment_lists<Key, Values> lists, const __grid_constant__ Framebuffer fb,
                            pipeline_state* state, capacities limits, bool count_voxels) {
    if (has_failed(*state, limits)) return;
    const std::uint64_t num_voxels = state->list_voxels, num_fragments = state->list_fragments;
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (thread == 0) {
        state->fragments = num_fragments;
        if (count_voxels) state->voxels = num_voxels;
    }
    const auto nx = static_cast<std::uint64_t>(fb.extent.x), ny = static_cast<std::uint64_t>(fb.extent.y);
    for (std::uint64_t v = thread; v < num_voxels; v += std::uint64_t{gridDim.x} * blockDim.x) {
        const std::uint64_t first = lists.first_of_voxel[v];
        const std::uint64_t last = v + 1 < num_voxels ? lists.first_of_voxel[v + 1] : num_fragments;
        const std::uint64_t id = lists.keys[first];
        const auto x = static_cast<int>(id % nx), y = static_cast<int>(id / nx % ny),
                   z = static_cast<int>(id / nx / ny);
        const auto fold = [&]<std::size_t K>() {
            using t = typename targets_of<Framebuffer>::template at<K>;
            const auto& view = voxelpipe::get<K>(fb.targets);
            if (view.load == load_operation::off) return;
            auto a = t::traits::begin(view(x, y, z));
            for (std::uint64_t i = first; i < last; ++i) t::traits::apply(a, voxelpipe::get<K>(lists.payload_of(i)));
            if constexpr (t::map::is_bit)
                store_bit(view, x, y, z, t::traits::end(a));
            else
                view.store(x, y, z, t::traits::end(a));
        };
        (fold.template operator()<I>(), ...);
    }
}

} // namespace voxelpipe::device
