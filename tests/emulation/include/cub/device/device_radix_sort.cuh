// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cub/block/block_scan.cuh>

#include <algorithm>
#include <numeric>
#include <vector>

namespace cub {
template <class T>
struct DoubleBuffer {
    T* d_buffers[2] = {};
    int selector = 0;
    DoubleBuffer() = default;
    DoubleBuffer(T* current, T* alternate) : d_buffers{current, alternate} {}
    [[nodiscard]] T* Current() const { return d_buffers[selector]; }
    [[nodiscard]] T* Alternate() const { return d_buffers[selector ^ 1]; }
};
struct DeviceRadixSort {
    // Stable, by the bits from begin_bit to before end_bit.
    template <class Key, class Value, class N>
    static cudaError_t SortPairs(void* storage, ::std::size_t& bytes, DoubleBuffer<Key>& keys,
                                 DoubleBuffer<Value>& values, N num, int begin_bit, int end_bit,
                                 cudaStream_t stream = nullptr) {
        if (storage == nullptr) {
            bytes = 1;
            return cudaSuccess;
        }
        const Key* const k = keys.Current();
        const Value* const v = values.Current();
        Key* const sorted_keys = keys.Alternate();
        Value* const sorted_values = values.Alternate();
        keys.selector ^= 1;
        values.selector ^= 1;
        const Key mask = end_bit - begin_bit >= static_cast<int>(8 * sizeof(Key))
                             ? static_cast<Key>(~Key{0})
                             : static_cast<Key>((Key{1} << (end_bit - begin_bit)) - 1);
        return emulation::put(stream, [=] {
            ::std::vector<::std::size_t> order(static_cast<::std::size_t>(num));
            ::std::iota(order.begin(), order.end(), ::std::size_t{0});
            ::std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) {
                return static_cast<Key>(k[a] >> begin_bit & mask) < static_cast<Key>(k[b] >> begin_bit & mask);
            });
            for (::std::size_t i = 0; i < order.size(); ++i) {
                sorted_keys[i] = k[order[i]];
                sorted_values[i] = v[order[i]];
            }
        });
    }
};
} // namespace cub
