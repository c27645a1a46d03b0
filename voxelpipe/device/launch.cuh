// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels one behind the other on a stream, the next of which is set up while the one before it ends (programmatic
// dependent launch, from compute capability 9.0 on). A kernel that launch_behind starts calls await_stream before it
// touches what a kernel of the same call writes; everywhere else, both are an ordinary launch and nothing.

#include <voxelpipe/config.hpp>
#include <voxelpipe/device/memory.cuh>

#include <cstddef>
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

// Whether the code that the current device runs waits in await_stream. Not so where it is made from PTX of before: only
// an exact match of a compiled architecture with the device tells.
[[nodiscard]] inline bool can_launch_early() {
#if defined(__CUDA_ARCH_LIST__) && CUDART_VERSION >= 12030 // from here on graphs capture it
    constexpr int compiled_for[] = {__CUDA_ARCH_LIST__};
    int device = 0, major = 0, minor = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
    for (const int architecture : compiled_for)
        if (major >= 9 && architecture == 100 * major + 10 * minor) return true;
#endif
    return false;
}

// Starts a kernel, early where the device can. shared_bytes: of dynamic shared memory.
template <class... Parameters, class... Arguments>
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
    config.numAttrs = early && can_launch_early() ? 1 : 0;
    check(cudaLaunchKernelEx(&config, kernel, std::forward<Arguments>(arguments)...), where);
}
// Starts a kernel that begins with await_stream.
template <class... Parameters, class... Arguments>
void launch_behind(void (*kernel)(Parameters...), unsigned blocks, unsigned threads, std::size_t shared_bytes,
                   cudaStream_t stream, stage where, Arguments&&... arguments) {
    launch_kernel(true, kernel, blocks, threads, shared_bytes, stream, where, std::forward<Arguments>(arguments)...);
}
template <class... Parameters, class... Arguments>
void launch_behind(void (*kernel)(Parameters...), unsigned blocks, unsigned threads, cudaStream_t stream, stage where,
                   Arguments&&... arguments) {
    launch_kernel(true, kernel, blocks, threads, 0, stream, where, std::forward<Arguments>(arguments)...);
}

} // namespace voxelpipe::device
