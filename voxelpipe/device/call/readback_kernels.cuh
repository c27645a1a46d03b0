// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernel and launch of call/readback.cuh.

#include <voxelpipe/device/call/readback.cuh>

#include <cstdint>

namespace voxelpipe::device {

// One warp runs it.
template <class State>
__global__ void send_state_kernel(State* state, sent_state<State>* to) {
    await_stream();
    using sent = sent_state<State>;
    std::uint32_t words[(sent::count + 31) / 32];
    const auto each = [&](auto&& f) VOXELPIPE_INLINE_LAMBDA {
#pragma unroll
        for (unsigned k = 0; k < (sent::count + 31) / 32; ++k)
            if (const unsigned i = 32 * k + threadIdx.x; i < sent::count) f(words[k], i);
    };
    each([&](std::uint32_t& word, unsigned i) { word = reinterpret_cast<const std::uint32_t*>(state)[i]; });
    __threadfence_system();
    each([&](std::uint32_t& word, unsigned i) {
        *static_cast<volatile std::uint64_t*>(&to->words[i]) = sent::arrived | word;
    });
    each([&](std::uint32_t&, unsigned i) { reinterpret_cast<std::uint32_t*>(state)[i] = 0; });
}

VOXELPIPE_DEFINES_KERNELS void send_state(pipeline_state* state, sent_state<pipeline_state>* to, cudaStream_t stream) {
    launch_behind(send_state_kernel<pipeline_state>, 1, 32, stream, stage::validate, state, to);
}

} // namespace voxelpipe::device
