// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Device memory of the CUDA backend: where it comes from (memory_resource), who owns it (device_block), and how one
// block is divided into arrays (arena). CUDA errors are exceptions inside the backend and a status at its surface.

#include <voxelpipe/status.hpp>

#include <cuda_runtime.h>

#include <cstddef>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace voxelpipe {

namespace device {

// A CUDA error and the stage in which it occurred, on its way to the status of the call.
struct cuda_failure {
    cudaError_t error;
    stage where;
};

inline void check(cudaError_t error, stage where = stage::validate) {
    if (error == cudaSuccess) return;
    cudaGetLastError(); // a failed launch leaves its error behind: it is reported here, once
    throw cuda_failure{error, where};
}

[[nodiscard]] inline status to_status(const cuda_failure& f) {
    status s;
    s.where = f.where;
    s.device_error = static_cast<int>(f.error);
    switch (f.error) {
    case cudaErrorMemoryAllocation:
        s.code = status_code::out_of_memory;
        break;
    case cudaErrorNoDevice:
    case cudaErrorInsufficientDriver:
    case cudaErrorInitializationError:
    case cudaErrorNoKernelImageForDevice:
        s.code = status_code::no_device;
        break;
    default:
        s.code = status_code::device_error;
    }
    return s;
}
// The status of work(), which returns one; a CUDA error in it becomes one.
template <class Work>
[[nodiscard]] status with_cuda_status(const Work& work) {
    try {
        return work();
    } catch (const cuda_failure& e) {
        return to_status(e);
    }
}
// The bytes that work() returns; 0 if it meets a CUDA error.
template <class Work>
[[nodiscard]] std::size_t bytes_or_none(const Work& work) {
    try {
        return work();
    } catch (const cuda_failure&) {
        return 0;
    }
}

} // namespace device

// The source of a cuda_backend's memory, in stream order. The default is the current device's cudaMallocAsync pool.
// Refers to a resource, which must outlive it. A resource is any object with
//   void* allocate_async(bytes, alignment, stream)      and deallocate_async(pointer, bytes, alignment, stream), or
//   void* allocate(stream, bytes, alignment)            and deallocate(stream, pointer, bytes, alignment),
// whose stream can be made from a cudaStream_t: cuda::mr resources of CCCL 2 and 3, and wrappers of other allocators.
class memory_resource {
public:
    static constexpr std::size_t alignment = 256; // bytes, of every block

    // The current device's pool, or an object as above, which must outlive this.
    memory_resource() = default;
    template <class Resource>
    requires(!std::is_same_v<std::remove_cvref_t<Resource>, memory_resource>)
        memory_resource(Resource& resource) // NOLINT(*-explicit-*): a resource is what a backend is made of
        : object_(&resource), allocate_([](void* object, std::size_t bytes, cudaStream_t stream) -> void* {
              auto& r = *static_cast<Resource*>(object);
              if constexpr (requires { r.allocate_async(bytes, alignment, stream); })
                  return r.allocate_async(bytes, alignment, stream);
              else
                  return r.allocate(stream, bytes, alignment);
          }),
          deallocate_([](void* object, void* pointer, std::size_t bytes, cudaStream_t stream) {
              auto& r = *static_cast<Resource*>(object);
              if constexpr (requires { r.deallocate_async(pointer, bytes, alignment, stream); })
                  r.deallocate_async(pointer, bytes, alignment, stream);
              else
                  r.deallocate(stream, pointer, bytes, alignment);
          }) {}

    // Throws std::bad_alloc, or what the resource throws; device::cuda_failure for any other CUDA error.
    [[nodiscard]] void* allocate(std::size_t bytes, cudaStream_t stream) const {
        if (bytes == 0) return nullptr;
        if (allocate_ != nullptr) return allocate_(object_, bytes, stream);
        void* pointer = nullptr;
        const cudaError_t error = cudaMallocAsync(&pointer, bytes, stream);
        if (error == cudaErrorMemoryAllocation) {
            cudaGetLastError();
            throw std::bad_alloc();
        }
        device::check(error);
        return pointer;
    }
    // In the order of the stream. A null pointer is nothing to do.
    void deallocate(void* pointer, std::size_t bytes, cudaStream_t stream) const noexcept {
        if (pointer == nullptr) return;
        if (deallocate_ != nullptr)
            deallocate_(object_, pointer, bytes, stream);
        else
            cudaFreeAsync(pointer, stream); // fails only if the context is gone, and the memory with it
    }

private:
    void* object_ = nullptr;
    void* (*allocate_)(void*, std::size_t, cudaStream_t) = nullptr;
    void (*deallocate_)(void*, void*, std::size_t, cudaStream_t) = nullptr;
};

// A stream and the resource for memory in its order. cuda_backend derives from it.
struct stream_memory {
    cudaStream_t stream = nullptr; // not owned
    memory_resource resource;      // where all memory comes from
};

// Owns one block of device memory, freed in the order of its stream. Movable, not copyable.
class device_block {
public:
    // Allocates; throws as memory_resource::allocate.
    device_block() = default;
    device_block(std::size_t bytes, const memory_resource& resource, cudaStream_t stream)
        : pointer_(resource.allocate(bytes, stream)), bytes_(bytes), resource_(resource), stream_(stream) {}
    device_block(device_block&& other) noexcept { swap(other); }
    device_block& operator=(device_block&& other) noexcept {
        device_block(std::move(other)).swap(*this);
        return *this;
    }
    ~device_block() { resource_.deallocate(pointer_, bytes_, stream_); }

    [[nodiscard]] void* data() const { return pointer_; }
    [[nodiscard]] std::size_t size() const { return bytes_; }

private:
    void swap(device_block& other) noexcept {
        std::swap(pointer_, other.pointer_);
        std::swap(bytes_, other.bytes_);
        std::swap(resource_, other.resource_);
        std::swap(stream_, other.stream_);
    }
    void* pointer_ = nullptr;
    std::size_t bytes_ = 0;
    memory_resource resource_;
    cudaStream_t stream_ = nullptr;
};

namespace device {

// Divides one block of memory into consecutive arrays, each aligned to 256 bytes. With a null base it only adds up the
// bytes, so the same code computes the size and carves the arrays.
class arena {
public:
    explicit arena(void* base = nullptr) : base_(static_cast<std::byte*>(base)) {}

    template <class T>
    [[nodiscard]] T* take(std::size_t count) {
        const std::size_t at = used_;
        used_ += (count * sizeof(T) + memory_resource::alignment - 1) / memory_resource::alignment *
                 memory_resource::alignment;
        return base_ == nullptr ? nullptr : reinterpret_cast<T*>(base_ + at);
    }
    [[nodiscard]] std::size_t used() const { return used_; }

private:
    std::byte* base_;
    std::size_t used_ = 0;
};

} // namespace device
} // namespace voxelpipe
