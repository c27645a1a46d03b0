// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Arrays in device memory that outlive a call: device_buffer is cuda_backend::buffer.

#include <voxelpipe/core/layout.hpp>
#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/host_target.hpp>
#include <voxelpipe/mesh.hpp>

#include <cuda_runtime.h>

#include <cstddef>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace device {

template <class Payload>
struct list_arrays;

// Runs f. A CUDA error leaves as std::runtime_error, with CUDA's text.
template <class F>
void with_runtime_errors(F&& f) {
    try {
        f();
    } catch (const cuda_failure& e) {
        throw std::runtime_error(std::string("voxelpipe: ") + cudaGetErrorString(e.error));
    }
}

} // namespace device

// An array of `count` elements, uninitialised unless copied from elsewhere. Owns its memory, which is taken and freed
// in the order of the backend's stream: the stream must outlive the buffer. Members that allocate or copy throw
// std::bad_alloc, or std::runtime_error with CUDA's text.
template <class T>
class device_buffer {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    device_buffer(const stream_memory& from, std::size_t count) : count_(count) {
        if (count > std::numeric_limits<std::size_t>::max() / sizeof(T)) throw std::bad_alloc();
        device::with_runtime_errors([&] { block_ = device_block(count * sizeof(T), from.resource, from.stream); });
    }
    // Copies from host or device memory; the source may go when the constructor returns. So it waits for the copy,
    // unless the source is pageable memory: CUDA has staged that by then.
    device_buffer(const stream_memory& from, array_view<const T> source) : device_buffer(from, source.size()) {
        if (count_ == 0) return;
        device::with_runtime_errors([&] {
            device::check(
                cudaMemcpyAsync(block_.data(), source.data(), count_ * sizeof(T), cudaMemcpyDefault, from.stream));
            cudaPointerAttributes memory{};
            device::check(cudaPointerGetAttributes(&memory, source.data()));
            if (memory.type != cudaMemoryTypeUnregistered) device::check(cudaStreamSynchronize(from.stream));
        });
    }

    // Written out to be host functions: implicit ones would be both __host__ and __device__.
    device_buffer(device_buffer&& other) noexcept
        : block_(std::move(other.block_)), count_(std::exchange(other.count_, 0)) {}
    device_buffer& operator=(device_buffer&& other) noexcept {
        block_ = std::move(other.block_);
        count_ = std::exchange(other.count_, 0);
        return *this;
    }
    ~device_buffer() {} // NOLINT(*-equals-default)

    [[nodiscard]] T* data() { return static_cast<T*>(block_.data()); }
    [[nodiscard]] const T* data() const { return static_cast<const T*>(block_.data()); }
    [[nodiscard]] std::size_t size() const { return count_; }
    [[nodiscard]] backend_view<const T> view() const { return {data(), count_}; } // Refers to the buffer.

    // Copies to the host, on the backend's stream, and waits.
    [[nodiscard]] std::vector<T> to_host(const stream_memory& backend) const {
        std::vector<T> host(count_);
        if (count_ != 0)
            device::with_runtime_errors([&] {
                device::check(
                    cudaMemcpyAsync(host.data(), data(), count_ * sizeof(T), cudaMemcpyDeviceToHost, backend.stream));
                device::check(cudaStreamSynchronize(backend.stream));
            });
        return host;
    }
    // Copies a box of the elements to `to`, which has room for box.count() of them, and waits.
    void read_box(const stream_memory& backend, const core::element_box& box, T* to) const {
        device::with_runtime_errors([&] {
            for (std::size_t z = 0; z < box.slices; ++z)
                device::check(cudaMemcpy2DAsync(to + z * box.row * box.rows, box.row * sizeof(T),
                                                data() + box.first + z * box.slice_pitch, box.row_pitch * sizeof(T),
                                                box.row * sizeof(T), box.rows, cudaMemcpyDeviceToHost, backend.stream));
            device::check(cudaStreamSynchronize(backend.stream));
        });
    }

private:
    template <class Payload>
    friend struct device::list_arrays;
    // Within a call. A failure is a cuda_failure at stage `where`, for the call's status.
    device_buffer(const stream_memory& from, std::size_t count, stage where) : count_(count) {
        try {
            block_ = device_block(count * sizeof(T), from.resource, from.stream);
        } catch (const device::cuda_failure& e) {
            throw device::cuda_failure{e.error, where};
        } catch (const std::bad_alloc&) {
            throw device::cuda_failure{cudaErrorMemoryAllocation, where};
        }
    }
    // Keeps the first elements. The memory stays as large.
    void shorten(std::size_t count) { count_ = count; }

    device_block block_;
    std::size_t count_;
};

} // namespace voxelpipe
