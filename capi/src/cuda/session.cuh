// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The calls on a GPU.

#include "../calls.hpp"

#include <bindings/device_call.cuh>

namespace voxelpipe::capi {

// A stream of one call.
class call_stream {
public:
    call_stream() { bindings::check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
    ~call_stream() { (void)cudaStreamDestroy(stream_); }
    call_stream(const call_stream&) = delete;
    call_stream& operator=(const call_stream&) = delete;
    [[nodiscard]] bindings::device_stream on(int device) const {
        return {device, reinterpret_cast<std::uintptr_t>(stream_)};
    }

private:
    cudaStream_t stream_ = nullptr;
};

// Each call has a backend and a stream of its own, so that threads may share a context. All copies wait: nothing runs
// on after a call.
struct cuda_session {
    using backend_type = cuda_backend;
    static constexpr int device = 0;

    template <class F>
    status run(const F& f) const {
        try {
            const bindings::current_device current({device, 0});
            const call_stream stream;
            bindings::call_backend own(stream.on(device));
            return f(own.backend);
        } catch (const std::runtime_error& e) { // CUDA's text
            throw failure{VP_ERROR_DEVICE, e.what()};
        }
    }
    template <class T>
    static void copy(const cuda_backend& backend, const device_buffer<T>& from, T* to) {
        if (from.size() == 0) return;
        bindings::check(
            cudaMemcpyAsync(to, from.data(), from.size() * sizeof(T), cudaMemcpyDeviceToHost, backend.stream));
        bindings::check(cudaStreamSynchronize(backend.stream));
    }
};

} // namespace voxelpipe::capi
