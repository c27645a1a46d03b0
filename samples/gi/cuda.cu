// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The frames of frame.hpp on an NVIDIA GPU.

#include "draw/cuda_device.hpp"
#include "frame.hpp"

#include <cuda_runtime.h>

#include <stdexcept>

namespace gi {

namespace {

void check_cuda(cudaError_t error) {
    if (error != cudaSuccess) throw std::runtime_error(std::string("CUDA says: ") + cudaGetErrorString(error));
}

} // namespace

// By events on the stream, so that no stage waits for another's end on the host.
template <>
class stopwatch<vp::cuda_backend> {
public:
    explicit stopwatch(const vp::cuda_backend& backend) : stream_(backend.stream) {}
    stopwatch(const stopwatch&) = delete;
    stopwatch& operator=(const stopwatch&) = delete;
    ~stopwatch() {
        for (const cudaEvent_t e : events_) (void)cudaEventDestroy(e);
    }

    void start() {
        stages_.clear();
        record();
    }
    void end(const char* stage) {
        stages_.push_back(stage);
        record();
    }
    [[nodiscard]] stage_list times() {
        stage_list list;
        check_cuda(cudaEventSynchronize(events_[stages_.size()]));
        for (std::size_t i = 0; i < stages_.size(); ++i) {
            float milliseconds = 0;
            check_cuda(cudaEventElapsedTime(&milliseconds, events_[i], events_[i + 1]));
            add_time(list, stages_[i], static_cast<double>(milliseconds));
        }
        return list;
    }

private:
    void record() {
        if (events_.size() == stages_.size()) {
            cudaEvent_t made = nullptr;
            check_cuda(cudaEventCreate(&made));
            events_.push_back(made);
        }
        check_cuda(cudaEventRecord(events_[stages_.size()], stream_));
    }

    cudaStream_t stream_;
    std::vector<cudaEvent_t> events_; // one more than stages, kept for all frames
    std::vector<const char*> stages_;
};

// Functors with long loops of dependent loads, which many threads hide: the bound leaves each 80 registers.
template <class F>
__global__ __launch_bounds__(128, 6) void trace_kernel(const __grid_constant__ F f, std::uint64_t count) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i < count) f(i);
}
template <>
struct tracer<vp::cuda_backend> {
    template <class F>
    static void run(vp::cuda_backend& backend, std::uint64_t count, const F& f) {
        if (count == 0) return;
        trace_kernel<<<static_cast<unsigned>((count + 127) / 128), 128, 0, backend.stream>>>(f, count);
        check_cuda(cudaGetLastError());
    }
};

template <>
std::string frame_renderer<vp::cuda_backend>::device() const {
    cudaDeviceProp properties{};
    check_cuda(cudaGetDeviceProperties(&properties, 0));
    return properties.name;
}

std::string why_no_cuda() { return voxelize::why_not(voxelize::look_for_cuda()); }

std::unique_ptr<renderer> make_cuda_renderer(scene s, const settings& how) {
    return std::make_unique<frame_renderer<vp::cuda_backend>>(vp::cuda_backend{}, std::move(s), how);
}

} // namespace gi
