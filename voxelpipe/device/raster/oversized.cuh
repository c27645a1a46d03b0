// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangles that the first pass splits (raster/raster.cuh): which they are, and how blocks that keep no list of them
// find them again.

#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/raster/split_setup.cuh>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr int oversized_side = 64; // stands for triangles to split: larger than max_group_side

// The longest side of the bounding box of a triangle that is to be drawn, oversized_side, or 0 if nothing of it lies in
// the grid. inside: of int32_triangle.
template <coverage Rule, class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE int side_to_draw(const raster_input<Source>& in, const int32_triangle& r,
                                                           int inside) {
    const int side = r.longest_side();
    if (!r.fits_int32 || side > max_group_side(in.fraction)) return oversized_side;
    return inside < 0 && r.template is_outside<Rule>(in.extent) ? 0 : side;
}
// True if blocks read their triangles again at the end to find the oversized ones, instead of keeping their numbers.
template <class Output>
inline constexpr bool finds_oversized_again = requires {
    requires Output::finds_oversized_again;
};

// Splits the block's oversized triangles, which it reads again. All threads call it.
template <class Call>
__device__ __noinline__ void split_oversized_again(const Call& call, unsigned* dropped,
                                                   typename Call::sink::memory& memory) {
    typename Call::sink sink(call, dropped, memory);
    const std::uint32_t step = gridDim.x * tuning::raster_threads;
    for (std::uint32_t first = blockIdx.x * tuning::raster_threads; first < call.in.num_triangles; first += step) {
        const std::uint32_t i = first + threadIdx.x;
        const glm::uvec3 index = load_index(call.in, i);
        unsigned long long items = 0;
        if (i < call.in.num_triangles && sink.check(index)) {
            const int32_triangle r = load_int32(call.in, index);
            if (side_to_draw<Call::rule>(call.in, r, r.inside(call.in.extent)) == oversized_side) {
                const core::triangle_class kind = count_work_items(call, i, items);
                if (kind != core::triangle_class::drawn) sink.drop(kind);
            }
        }
        __syncwarp();
        call.lists.push_split(i, items);
    }
}

} // namespace voxelpipe::device
