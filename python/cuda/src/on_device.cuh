// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels that copy results into the caller's arrays.

#include "device_calls.hpp"

#include <bindings/device_call.cuh>

#include <cuda_runtime.h>

namespace voxelpipe::python {

using namespace bindings; // what all bindings share

// A thread for each of `n` elements.
template <class F>
__global__ void each_kernel(std::size_t n, F f) {
    const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i < n) f(i);
}
template <class F>
void for_each(const device_stream& on, std::size_t n, const F& f) {
    if (n == 0) return;
    each_kernel<<<static_cast<unsigned>((n + 255) / 256), 256, 0, reinterpret_cast<cudaStream_t>(on.stream)>>>(n, f);
    check(cudaGetLastError());
}

inline void wait(const device_stream& on) { check(cudaStreamSynchronize(reinterpret_cast<cudaStream_t>(on.stream))); }

// Bytes (nz, ny, nx) that are 0 or not as words of 32 voxels along x, lowest bit first.
struct pack_bits {
    const std::uint8_t* values;
    std::uint32_t* words;
    std::size_t row, words_a_row;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const std::size_t first = i % words_a_row * 32, left = row - first;
        const std::uint8_t* const from = values + i / words_a_row * row + first;
        std::uint32_t word = 0;
        for (std::size_t b = 0; b < (left < 32 ? left : 32); ++b) word |= std::uint32_t{from[b] != 0} << b;
        words[i] = word;
    }
};
inline void pack_bits_of(const device_stream& on, const std::uint8_t* values, const glm::ivec3& extent,
                         std::uint32_t* words) {
    const auto row = static_cast<std::size_t>(extent.x);
    const std::size_t words_a_row = (row + 31) / 32;
    const std::size_t rows = static_cast<std::size_t>(extent.y) * static_cast<std::size_t>(extent.z);
    for_each(on, words_a_row * rows, pack_bits{values, words, row, words_a_row});
}

// Components of a value, a scalar's or a vector's.
template <class T>
[[nodiscard]] VOXELPIPE_HD T component_of(const T& value, int) {
    return value;
}
template <int N, class T>
[[nodiscard]] VOXELPIPE_HD T component_of(const glm::vec<N, T>& value, int c) {
    return value[c];
}

// Writes a pass's values into its columns: `fill` where there is no fragment, quotients of a mean, each rounded once.
template <class T, class Value>
struct finish {
    const Value* values;
    const std::uint32_t* counts;
    T* out; // begins at the pass's first column
    std::size_t columns;
    int count;
    bool is_mean;
    T fill;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        for (int c = 0; c < count; ++c) {
            T v = component_of(values[i], c);
            if (counts[i] == 0)
                v = fill;
            else if (is_mean && v == v) // a GPU's quotient of NaN has bits of its own
                v = v / static_cast<T>(counts[i]);
            out[i * columns + static_cast<std::size_t>(c)] = v;
        }
    }
};

// Calls f.template operator()<Blend>().
template <class F>
auto with_blend(combine how, F&& f) {
    switch (how) {
    case combine::mean:
    case combine::sum:
        return f.template operator()<blend::add>();
    case combine::min:
        return f.template operator()<blend::min>();
    case combine::max:
        return f.template operator()<blend::max>();
    case combine::last:
        break;
    }
    return f.template operator()<blend::replace>();
}

} // namespace voxelpipe::python
