// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How a call runs on CPU threads: its options, times and progress.

#include <voxelpipe/stage_times.hpp>
#include <voxelpipe/status.hpp>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>

namespace voxelpipe::cpu {

// How the stages of a call run.
struct execution {
    unsigned threads = 1;
    stage_times* times = nullptr;
    const std::function<void(std::uint64_t done, std::uint64_t total)>* progress = nullptr;
    stage* at = nullptr; // if not null, notes the current stage for the status of a failed call

    void enter(stage s) const {
        if (at != nullptr) *at = s;
    }
};

// Adds the lifetime of this object to one of the stage times.
class stopwatch {
public:
    stopwatch(stage_times* times, double stage_times::*field) : times_(times), field_(field) {
        if (times_ != nullptr) start_ = std::chrono::steady_clock::now();
    }
    stopwatch(const stopwatch&) = delete; // measures one scope
    stopwatch& operator=(const stopwatch&) = delete;
    ~stopwatch() {
        if (times_ == nullptr) return;
        const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start_;
        times_->*field_ += ms.count();
    }

private:
    stage_times* times_;
    double stage_times::*field_;
    std::chrono::steady_clock::time_point start_{};
};

// Reports the number of finished tiles, at most a hundred times, one call at a time.
class progress_meter {
public:
    progress_meter(const execution& how, std::uint64_t total) : how_(how), total_(total) {}
    void advance() {
        if (how_.progress == nullptr || !*how_.progress) return;
        const std::uint64_t done = done_.fetch_add(1) + 1;
        if (done != total_ && done * 100 / total_ == (done - 1) * 100 / total_) return;
        const std::lock_guard lock(mutex_);
        if (done < reported_) return;
        reported_ = done;
        (*how_.progress)(done, total_);
    }

private:
    const execution& how_;
    std::uint64_t total_;
    std::atomic<std::uint64_t> done_{0};
    std::mutex mutex_;
    std::uint64_t reported_ = 0;
};

} // namespace voxelpipe::cpu
