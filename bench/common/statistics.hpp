// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Summaries of repeated timings, and means of ratios.

#include <vector>

namespace bench {

// Milliseconds, or whatever the numbers were. Quartiles by linear interpolation between the sorted numbers.
struct sample {
    double median = 0, low_quartile = 0, high_quartile = 0, least = 0, most = 0;
    int runs = 0; // 0: nothing was measured
};

[[nodiscard]] sample summarize(std::vector<double> values);

// Counts the numbers above 0 only; 0 if there are none.
[[nodiscard]] double geometric_mean(const std::vector<double>& values);

} // namespace bench
