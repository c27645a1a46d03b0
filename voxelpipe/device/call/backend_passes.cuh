// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a CUDA backend offers to passes that run on every backend (programs, octrees, merges): memory, copies, loops,
// sums and sorts on its stream, and a status for what they throw.

#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/check_indices.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/voxelize.hpp>

#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::device {

// Has, from stream_memory, a `stream`, which it does not own, and the `resource` that all memory comes from.
class backend_passes : public stream_memory {
public:
    // Device memory of the backend; see device_buffer.
    template <class T>
    using buffer = device_buffer<T>;

    backend_passes() = default;
    backend_passes(cudaStream_t stream_, memory_resource resource_) : stream_memory{stream_, resource_} {}

    // Copies an array of device memory, then waits. Throws like buffer.
    template <class T>
    [[nodiscard]] std::vector<std::remove_const_t<T>> read(backend_view<T> from) {
        std::vector<std::remove_const_t<T>> host(from.size());
        if (from.size() != 0)
            device::with_runtime_errors([&] {
                device::check(
                    cudaMemcpyAsync(host.data(), from.data(), from.size() * sizeof(T), cudaMemcpyDeviceToHost, stream));
                device::check(cudaStreamSynchronize(stream));
            });
        return host;
    }

    // The largest vertex index, for check_indices. Waits. A template, so that its kernel is compiled only if called.
    template <int = 0>
    [[nodiscard]] std::uint32_t max_index(array_view<const glm::uvec3> triangles) {
        buffer<std::uint32_t> max(*this, std::size_t{1});
        device::with_runtime_errors([&] {
            device::check(cudaMemsetAsync(max.data(), 0, sizeof(std::uint32_t), stream));
            device::find_max_index(triangles, max.data(), stream);
        });
        return max.to_host(*this)[0];
    }

    // Calls f(i) for i below `count`, in any order, on the stream.
    template <class F>
    void for_each(std::uint64_t count, const F& f) const {
        device::with_runtime_errors([&] { device::for_each(count, f, stage::vertex_shade, stream); });
    }
    // offsets[i] becomes the sum of the counts before i. The last count must be 0; returns the total. Waits.
    template <int = 0>
    std::uint64_t sum(const buffer<std::uint32_t>& counts, buffer<std::uint64_t>& offsets) {
        const auto n = static_cast<std::uint32_t>(counts.size());
        device::with_runtime_errors([&] {
            const std::size_t bytes = device::cell_scan_bytes(n);
            buffer<std::uint8_t> storage(*this, bytes);
            device::sum_counts(counts.data(), reinterpret_cast<unsigned long long*>(offsets.data()), n, storage.data(),
                               bytes, stage::vertex_shade, stream);
        });
        return read(backend_view<const std::uint64_t>{offsets.data() + n - 1, 1})[0];
    }
    // Sorts pairs by the lowest `bits` bits of the key, stably.
    template <int = 0>
    void sort_by_key(buffer<std::uint64_t>& keys, buffer<std::uint32_t>& values, int bits) {
        sort_by_key(keys, values, bits, keys.size());
    }
    // Sorts the first n pairs, which alone are kept.
    template <int = 0>
    void sort_by_key(buffer<std::uint64_t>& keys, buffer<std::uint32_t>& values, int bits, std::size_t n) {
        if (n < 2) return;
        buffer<std::uint64_t> other_keys(*this, n);
        buffer<std::uint32_t> other_values(*this, n);
        int result = 0;
        device::with_runtime_errors([&] {
            const std::size_t bytes = device::sort_bytes<std::uint64_t>(n, bits);
            buffer<std::uint8_t> storage(*this, bytes);
            std::uint64_t* const k[2] = {keys.data(), other_keys.data()};
            std::uint32_t* const v[2] = {values.data(), other_values.data()};
            result =
                device::sort_by_cell<std::uint64_t>(k, v, n, bits, storage.data(), bytes, stage::tile_sort, stream);
        });
        if (result == 0) return;
        std::swap(keys, other_keys);
        std::swap(values, other_values);
    }
    // Runs work(), which returns a status. Failed allocations and CUDA errors become one.
    template <class Work>
    [[nodiscard]] status guard(const Work& work) {
        try {
            return work();
        } catch (const std::bad_alloc&) {
            return core::failure(status_code::out_of_memory, stage::vertex_shade);
        } catch (const std::length_error&) { // fragments that cannot be numbered
            return core::failure(status_code::out_of_memory, stage::abuffer_emit);
        } catch (const std::runtime_error&) { // of a buffer, or of a hook above
            status s = core::failure(status_code::device_error, stage::vertex_shade);
            s.device_error = static_cast<int>(cudaGetLastError());
            return s;
        }
    }
};

} // namespace voxelpipe::device
