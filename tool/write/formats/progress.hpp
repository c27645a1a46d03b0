// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Turns the number of bytes done into the fraction that write_options::progress wants, at most 200 calls a file.

#include <algorithm>
#include <cstdint>
#include <functional>

namespace voxelize {

class progress_meter {
public:
    progress_meter(const std::function<void(double)>& report, std::uint64_t total) : report_(report), total_(total) {}

    void advance(std::uint64_t amount) {
        done_ += amount;
        if (!report_ || total_ == 0) return;
        const double fraction = std::min(1.0, static_cast<double>(done_) / static_cast<double>(total_));
        if (fraction < next_ && fraction < 1.0) return;
        next_ = fraction + 0.005;
        report_(fraction);
    }

private:
    const std::function<void(double)>& report_;
    std::uint64_t total_;
    std::uint64_t done_ = 0;
    double next_ = 0;
};

} // namespace voxelize
