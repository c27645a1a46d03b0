// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Clears render targets, including padding (padding bits become 0). Writes nothing if the call has failed.

#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/tuning/tuning_raster.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace voxelpipe::device {

template <class Element>
struct fill_pattern {
    Element value;
};

// Elements of 1, 2, 4, 8 or 16 bytes are stored 16 bytes at a time.
template <bool Streams, class Element>
__global__ void fill_kernel(Element* to, std::uint64_t count, const __grid_constant__ fill_pattern<Element> pattern,
                            const pipeline_state* state, capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    if constexpr (sizeof(Element) <= 16 && (sizeof(Element) & (sizeof(Element) - 1)) == 0) {
        constexpr unsigned per_store = 16 / sizeof(Element);
        if (reinterpret_cast<std::uintptr_t>(to) % 16 == 0) {
            Element lanes[per_store];
            for (unsigned i = 0; i < per_store; ++i) lanes[i] = pattern.value;
            uint4 wide;
            memcpy(&wide, lanes, 16);
            const std::uint64_t stores = count / per_store, per_block = std::uint64_t{tuning::fill_stores} * blockDim.x;
            for (std::uint64_t first = blockIdx.x * per_block; first < stores; first += gridDim.x * per_block)
                for (unsigned k = 0; k < tuning::fill_stores; ++k) {
                    const std::uint64_t i = first + k * blockDim.x + threadIdx.x;
                    if (i >= stores) continue;
                    if constexpr (Streams)
                        __stcs(reinterpret_cast<uint4*>(to) + i, wide);
                    else
                        reinterpret_cast<uint4*>(to)[i] = wide;
                }
            if (blockIdx.x == 0)
                for (std::uint64_t i = stores * per_store + threadIdx.x; i < count; i += blockDim.x)
                    to[i] = pattern.value;
            return;
        }
    }
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += threads)
        to[i] = pattern.value;
}

// Sets all bits of a target to 1. Rows end within a word, and bricks may too.
template <class Target>
__global__ void fill_bits_kernel(const __grid_constant__ target_view<Target> t, const pipeline_state* state,
                                 capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto words_x = static_cast<std::uint64_t>((t.extent.x + 31) / 32);
    const std::uint64_t count =
        words_x * static_cast<std::uint64_t>(t.extent.y) * static_cast<std::uint64_t>(t.extent.z);
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        const int x = static_cast<int>(i % words_x) * 32, y = static_cast<int>(i / words_x % t.extent.y),
                  z = static_cast<int>(i / words_x / t.extent.y);
        const int left = t.extent.x - x;
        t.elements[Target::map::cell(t.extent, x, y, z)] = left >= 32 ? ~0u : (1u << left) - 1;
    }
}

// Fills `count` elements. Streams: stores bypass the cache.
template <bool Streams, class Element>
void fill_elements(Element* to, std::uint64_t count, const fill_pattern<Element>& pattern, const pipeline_state* state,
                   const capacities& limits, cudaStream_t stream) {
    constexpr std::uint64_t bytes_per_block = std::uint64_t{16} * tuning::fill_stores * threads_per_block;
    const std::uint64_t blocks = count * sizeof(Element) / bytes_per_block + 1;
    launch_behind(fill_kernel<Streams, Element>, static_cast<unsigned>(std::min(blocks, core::max_blocks)),
                  threads_per_block, stream, stage::fine_raster, to, count, pattern, state, limits);
}

template <class Target>
void clear_target(const target_view<Target>& t, const pipeline_state* state, const capacities& limits,
                  cudaStream_t stream) {
    using map = typename Target::map;
    using element = typename Target::element_type;
    const auto fill = [&](element* to, std::uint64_t count, const element& value) {
        if constexpr (map::is_bit)
            if (const std::uint64_t bytes = count * sizeof(element);
                bytes >= tuning::min_streamed && bytes <= tuning::max_streamed) {
                fill_elements<true>(to, count, fill_pattern<element>{value}, state, limits, stream);
                return;
            }
        fill_elements<false>(to, count, fill_pattern<element>{value}, state, limits, stream);
    };
    if constexpr (map::is_bit) {
        fill(t.elements, map::elements(t.extent), 0u);
        if (t.clear_value) {
            launch_behind(fill_bits_kernel<Target>, fill_device(map::elements(t.extent), 16), threads_per_block, stream,
                          stage::fine_raster, t, state, limits);
        }
    } else if constexpr (map::planes) {
        const std::size_t plane = map::cells(t.extent);
        for (int c = 0; c < map::components; ++c)
            fill(t.elements + static_cast<std::size_t>(c) * plane, plane, t.clear_value[c]);
    } else {
        fill(t.elements, map::elements(t.extent), t.clear_value);
    }
}

// Clears the targets whose load operation is clear, without a call that draws; `state` is zero. Resets the log of
// changes, which may know another value.
template <class... Targets>
void clear_framebuffer(const framebuffer_view<Targets...>& fb, const pipeline_state* state, cudaStream_t stream) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        const auto& t = voxelpipe::get<K>(fb.targets);
        if (t.load == load_operation::clear) clear_target(t, state, {}, stream);
    });
    if (fb.changes != nullptr)
        check(cudaMemsetAsync(fb.changes, 0, core::change_log::header_words * sizeof(std::uint32_t), stream),
              stage::fine_raster);
}

} // namespace voxelpipe::device
