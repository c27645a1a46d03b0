// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// stage_clock: CUDA events on a call's stream at the borders of its stages, and their distances as stage_times. Only a
// call that is asked for its times has one; it never waits before it is read.

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

    // What comes next is timed; what lies between the last border and here is not.
    void start() { mark(nullptr); }
    // Since the last border it was this stage.
    void end(field stage_field) { mark(stage_field); }

    // Adds up the times between the borders, after the stream has passed the last one: waits until it has.
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
        field stage_field; // what ends here; null where nothing that counts does
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

// A border where there is a clock.
inline void end_stage(stage_clock* clock, stage_clock::field stage_field) {
    if (clock != nullptr) clock->end(stage_field);
}

} // namespace voxelpipe::device
