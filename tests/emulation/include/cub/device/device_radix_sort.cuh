// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Takes the place of CUB's header where device code is compiled for the CPU (tests/emulation/README.md): the sort of
// pairs by some bits of their keys, which is stable.

#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace cub {

template <class T>
struct DoubleBuffer {
    T* d_buffers[2] = {nullptr, nullptr};
    int selector = 0;

    DoubleBuffer() = default;
    DoubleBuffer(T* current, T* alternate) : d_buffers{current, alternate} {}
};

struct DeviceRadixSort {
    // Sorts by the bits from first_bit on and below end_bit. CUB leaves the result in either buffer: here in the other
    // one, so that who takes the first for granted is found out.
    template <class Key, class Value>
    static cudaError_t SortPairs(void* storage, std::size_t& bytes, DoubleBuffer<Key>& keys,
                                 DoubleBuffer<Value>& values, std::uint64_t num, int first_bit, int end_bit,
                                 cudaStream_t stream) {
        if (storage == nullptr) {
            bytes = num + 1;
            return cudaSuccess;
        }
        if (bytes < num + 1) return cudaErrorInvalidValue;
        const Key* from = keys.d_buffers[keys.selector];
        const Value* from_values = values.d_buffers[values.selector];
        keys.selector = 1 - keys.selector;
        values.selector = 1 - values.selector;
        Key* const to = keys.d_buffers[keys.selector];
        Value* const to_values = values.d_buffers[values.selector];
        return emulation::put(stream, [=] {
            const int width = end_bit - first_bit;
            const std::uint64_t mask = width < 64 ? (std::uint64_t{1} << width) - 1 : ~std::uint64_t{0};
            const auto digits = [&](std::uint64_t i) {
                return static_cast<std::uint64_t>(from[i]) >> first_bit & mask;
            };
            std::vector<std::uint64_t> order(num);
            std::iota(order.begin(), order.end(), std::uint64_t{0});
            std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return digits(a) < digits(b); });
            for (std::uint64_t i = 0; i < num; ++i) {
                to[i] = from[order[i]];
                to_values[i] = from_values[order[i]];
            }
        });
    }
};

} // namespace cub
