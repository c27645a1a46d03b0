// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Times of a frame's stages. A backend whose work runs behind the host's has its own (cuda.cu).

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace gi {

// Milliseconds of each stage, in the order of their first end.
using stage_list = std::vector<std::pair<std::string, double>>;

// Adds to a stage that is there already: one may run several times.
inline void add_time(stage_list& to, const char* stage, double milliseconds) {
    const auto found = std::find_if(to.begin(), to.end(), [&](const auto& s) { return s.first == stage; });
    if (found != to.end())
        found->second += milliseconds;
    else
        to.emplace_back(stage, milliseconds);
}

template <class Backend>
class stopwatch {
public:
    explicit stopwatch(const Backend&) {}

    // A frame begins.
    void start() {
        times_.clear();
        last_ = std::chrono::steady_clock::now();
    }
    // A stage ends: what was done since the last end is its.
    void end(const char* stage) {
        const auto now = std::chrono::steady_clock::now();
        add_time(times_, stage, std::chrono::duration<double, std::milli>(now - last_).count());
        last_ = now;
    }
    // After the last stage.
    [[nodiscard]] stage_list times() { return times_; }

private:
    std::chrono::steady_clock::time_point last_;
    stage_list times_;
};

} // namespace gi
