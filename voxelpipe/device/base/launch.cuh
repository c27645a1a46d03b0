// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernel launches. On a stream, each kernel may be set up while the one before it ends (programmatic dependent launch,
// compute capability 9.0 and later). A kernel started by launch_behind calls await_stream before it touches memory that
// another kernel of the call writes. On older devices await_stream does nothing and the launch is an ordinary one.

#include <voxelpipe/config.hpp>
#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/base/launch_size.hpp>
#include <voxelpipe/device/base/memory.cuh>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace voxelpipe::device {

// Waits until all earlier work on the stream is finished and visible, then allows the next kernel to start. So at any
// time at most one earlier kernel is unfinished. All threads call it.
__device__ VOXELPIPE_INLINE void await_stream() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.wait;" ::: "memory");
    asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
#endif
}

// The architectures that a translation unit is compiled for. Functions that launch kernels have it as a template
// parameter, because units of one program, including the library's (base/kernel_library.cuh), may be compiled for
// different ones.
template <int...>
struct architectures {};
#if defined(__CUDA_ARCH_LIST__) && CUDART_VERSION >= 12030 // graphs capture early launches from 12.3 on
using compiled_for = architectures<__CUDA_ARCH_LIST__>;
#else
using compiled_for = architectures<>;
#endif

// True if the code that the current device runs waits in await_stream. Code compiled from older PTX does not, so only
// an exact match of device and compiled architecture counts.
template <int... Compiled>
[[nodiscard]] bool can_launch_early(architectures<Compiled...>) {
    if constexpr (sizeof...(Compiled) == 0) {
        return false;
    } else {
        int device = 0, major = 0, minor = 0;
        check(cudaGetDevice(&device));
        check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
        check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
        return major >= 9 && ((Compiled == 100 * major + 10 * minor) || ...);
    }
}

// Starts a kernel, early if the device can. shared_bytes: dynamic shared memory of a block.
template <class CompiledFor = compiled_for, class... Parameters, class... Arguments>
void launch_kernel(bool early, void (*kernel)(Parameters...), unsigned blocks, unsigned threads,
                   std::size_t shared_bytes, cudaStream_t stream, stage where, Arguments&&... arguments) {
    cudaLaunchAttribute attribute{};
    attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    attribute.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config{};
    config.gridDim = blocks;
    config.blockDim = threads;
    config.dynamicSmemBytes = shared_bytes;
    config.stream = stream;
    config.attrs = &attribute;
    config.numAttrs = early && can_launch_early(CompiledFor{}) ? 1 : 0;
    check(cudaLaunchKernelEx(&config, kernel, std::forward<Arguments>(arguments)...), where);
}
// Starts a kernel that begins with await_stream.
template <class CompiledFor = compiled_for, class... Parameters, class... Arguments>
void launch_behind(void (*kernel)(Parameters...), unsigned blocks, unsigned threads, std::size_t shared_bytes,
                   cudaStream_t stream, stage where, Arguments&&... arguments) {
    launch_kernel<CompiledFor>(true, kernel, blocks, threads, shared_bytes, stream, where,
                               std::forward<Arguments>(arguments)...);
}
template <class CompiledFor = compiled_for, class... Parameters, class... Arguments>
void launch_behind(void (*kernel)(Parameters...), unsigned blocks, unsigned threads, cudaStream_t stream, stage where,
                   Arguments&&... arguments) {
    launch_kernel<CompiledFor>(true, kernel, blocks, threads, 0, stream, where, std::forward<Arguments>(arguments)...);
}

// ---- sizes of launches ----------------------------------------------------------------------------------------------

inline constexpr int threads_per_block = 256; // of kernels that have no tuning of their own

// Blocks of a kernel with one thread per item.
[[nodiscard]] inline unsigned num_blocks(std::uint64_t items) {
    VOXELPIPE_ASSERT(items <= std::numeric_limits<std::uint32_t>::max()); // validated: see core::max_numbered
    return core::blocks_for_each(static_cast<std::uint32_t>(items), threads_per_block);
}

[[nodiscard]] inline int num_multiprocessors() {
    int device = 0, count = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&count, cudaDevAttrMultiProcessorCount, device));
    return count;
}

// The current device's compute capability: 90 for 9.0.
[[nodiscard]] inline int compute_capability() {
    int device = 0, major = 0, minor = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
    return 10 * major + minor;
}

// Blocks of a grid-stride or persistent kernel: enough to fill the device, but no more than there is work for.
[[nodiscard]] inline unsigned fill_device(std::uint64_t items, unsigned blocks_per_multiprocessor = 8) {
    return core::blocks_to_fill(items, threads_per_block, static_cast<std::uint32_t>(num_multiprocessors()),
                                blocks_per_multiprocessor);
}

// ---- kernels of every call
// -------------------------------------------------------------------------------------------

// Zeroes `bytes` of memory, a multiple of 16. A kernel instead of cudaMemsetAsync, because a kernel can start early
// only behind another kernel.
VOXELPIPE_DECLARES_KERNELS void zero_memory(void* memory, std::size_t bytes, cudaStream_t stream);

// Host values, passed to the device as kernel arguments: no host memory has to outlive the call, and a captured graph
// replays them.
template <class T, int N>
struct argument_chunk {
    T items[N];
};
template <class T, int N>
__global__ void write_chunk(T* to, const __grid_constant__ argument_chunk<T, N> chunk, int count) {
    const int i = static_cast<int>(threadIdx.x);
    if (i < count) to[i] = chunk.items[i];
}

template <class T, int N>
void write_arguments(T* to, const argument_chunk<T, N>& chunk, int count, cudaStream_t stream) {
    write_chunk<T, N><<<1, 256, 0, stream>>>(to, chunk, count);
    check(cudaGetLastError(), stage::vertex_shade);
}

template <class T, class Source>
void upload(T* to, std::size_t count, Source&& source, cudaStream_t stream) {
    constexpr int n = sizeof(T) > 1024 ? 1 : static_cast<int>(3072 / sizeof(T) < 256 ? 3072 / sizeof(T) : 256);
    static_assert(sizeof(T) <= 4000, "voxelpipe: a shader has too much data by value; let it hold a pointer");
    for (std::size_t first = 0; first < count; first += n) {
        argument_chunk<T, n> chunk{};
        const std::size_t part = count - first < n ? count - first : n;
        for (std::size_t i = 0; i < part; ++i) chunk.items[i] = source(first + i);
        write_arguments(to + first, chunk, static_cast<int>(part), stream);
    }
}

} // namespace voxelpipe::device
