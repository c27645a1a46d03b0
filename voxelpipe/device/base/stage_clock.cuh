// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// stage_clock: CUDA events at the stage boundaries of a call, read as stage_times. Only a timed call has one. Recording
// never waits.

#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/stage_times.hpp>

#include <cstddef>
#include <vector>

namespace voxelpipe::device {

class stage_clock {
public:
    using field = double stage_times::*;

    explicit stage_clock(cudaStream_t stream) : stream_(stream) {}
    stage_clock(const stage_clock&) = delete; // owns events
    stage_clock& operator=(const stage_clock&) = delete;
    ~stage_clock() {
        for (const border& b : borders_) cudaEventDestroy(b.event);
    }

    // Starts timing the next stage. Work since the last boundary is not counted.
    void start() { mark(nullptr); }
    // Ends this stage: the time since the last boundary is its.
    void end(field stage_field) { mark(stage_field); }

    // Waits for the last boundary, then adds the measured times.
    void read(stage_times& times) const {
        if (borders_.empty()) return;
        check(cudaEventSynchronize(borders_.back().event));
        for (std::size_t i = 1; i < borders_.size(); ++i) {
            if (borders_[i].stage_field == nullptr) continue;
            float milliseconds = 0;
            check(cudaEventElapsedTime(&milliseconds, borders_[i - 1].event, borders_[i].event));
            times.*borders_[i].stage_field += static_cast<double>(milliseconds);
        }
    }

private:
    struct border {
        cudaEvent_t event;
        field stage_field; // the stage that ends here; null if the time before it does not count
    };
    void mark(field stage_field) {
        cudaEvent_t event = nullptr;
        check(cudaEventCreate(&event));
        borders_.push_back({event, stage_field});
        check(cudaEventRecord(event, stream_));
    }
    cudaStream_t stream_;
    std::vector<border> borders_;
};

// Ends a stage if there is a clock.
inline void end_stage(stage_clock* clock, stage_clock::field stage_field) {
    if (clock != nullptr) clock->end(stage_field);
}

} // namespace voxelpipe::device
