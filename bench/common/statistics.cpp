// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace bench {

sample summarize(std::vector<double> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto at = [&](double fraction) {
        const double rank = fraction * static_cast<double>(values.size() - 1);
        const auto below = static_cast<std::size_t>(rank);
        const std::size_t above = std::min(below + 1, values.size() - 1);
        return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
    };
    return {at(0.5), at(0.25), at(0.75), values.front(), values.back(), static_cast<int>(values.size())};
}

double geometric_mean(const std::vector<double>& values) {
    double logarithms = 0;
    int count = 0;
    for (const double v : values) {
        if (!(v > 0)) continue;
        logarithms += std::log(v);
        ++count;
    }
    return count == 0 ? 0 : std::exp(logarithms / count);
}

} // namespace bench
