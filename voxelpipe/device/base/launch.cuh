// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels one behind the other on a stream, the next of which is set up while the one before it ends (programmatic
// dependent launch, from compute capability 9.0 on). A kernel that launch_behind starts calls await_stream before it
// touches what a kernel of the same call writes; everywhere else, both are an ordinary launch and nothing.

#include <voxelpipe/config.hpp>
#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/base/launch_size.hpp>
#include <voxelpipe/device/base/memory.cuh>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace voxelpipe::device {

// All threads come here: what the stream had before is done, and can be seen, and the next kernel may be set up. Since
// that is said only now, a kernel that runs early finds all done but the work of the one kernel before it.
__device__ VOXELPIPE_INLINE void await_stream() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.wait;" ::: "memory");
    asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
#endif
}

// The architectures that a unit is compiled for. A type, and a parameter of what launches: units of one program may be
// compiled for others, the library's (base/kernel_library.cuh) among them, and each asks for its own.
template <int...>
struct architectures {};
#if defined(__CUDA_ARCH_LIST__) && CUDART_VERSION >= 12030 // from here on graphs capture early launches
using compiled_for = architectures<__CUDA_ARCH_LIST__>;
#else
using compiled_for = architectures<>;
#endif

// Whether the code that the current device runs waits in await_stream. Not so where it is made from PTX of before: only
// an exact match of a compiled architecture with the device tells.
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

// Starts a kernel, early where the device can. shared_bytes: of dynamic shared memory.
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

// Of a kernel with a thread an item.
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

// Of the current device: 90 for 9.0.
[[nodiscard]] inline int compute_capability() {
    int device = 0, major = 0, minor = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
    return 10 * major + minor;
}

// Blocks of a grid-stride or persistent kernel: enough to fill the device, no more than there is work.
[[nodiscard]] inline unsigned fill_device(std::uint64_t items, unsigned blocks_per_multiprocessor = 8) {
    return core::blocks_to_fill(items, threads_per_block, static_cast<std::uint32_t>(num_multiprocessors()),
                                blocks_per_multiprocessor);
}

// ---- kernels of any call
// -----------------------------------------------------------------------------------------------

// Where a call starts that leaves no zeros for the next: the start of its memory, whole uint4s. By a kernel, for the
// next one can begin early behind a kernel, and not behind cudaMemsetAsync.
VOXELPIPE_DECLARES_KERNELS void zero_memory(void* memory, std::size_t bytes, cudaStream_t stream);

// Copies a few host values to the device as kernel arguments: no host memory has to outlive the call, and a captured
// graph replays it.
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
