// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "palette.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace voxelize {
namespace {

// Colours order_[begin, end) with what decides the next cut.
struct box {
    std::size_t begin = 0;
    std::size_t end = 0;
    std::size_t axis = 0;     // channel with the largest spread
    std::uint64_t spread = 0; // sum over its voxels of the squared distance from the mean, on that channel
};

using sums = std::array<std::uint64_t, 4>; // r, g, b weighted by count, and the weight

box measure(std::span<const counted_color> colors, std::span<const std::uint32_t> order, std::size_t begin,
            std::size_t end) {
    sums total{};
    for (std::size_t i = begin; i < end; ++i) {
        const counted_color& c = colors[order[i]];
        for (std::size_t a = 0; a < 3; ++a) total[a] += std::uint64_t{c.color[a]} * c.count;
        total[3] += c.count;
    }
    box result{begin, end};
    for (std::size_t a = 0; a < 3; ++a) {
        const auto mean = static_cast<std::int64_t>((total[a] + total[3] / 2) / total[3]);
        std::uint64_t spread = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const counted_color& c = colors[order[i]];
            const std::int64_t d = c.color[a] - mean;
            spread += static_cast<std::uint64_t>(d * d) * c.count;
        }
        if (spread > result.spread) {
            result.spread = spread;
            result.axis = a;
        }
    }
    return result;
}

// Sorts the box along its axis and returns where its second half starts: at the median voxel, never at an end.
std::size_t cut(std::span<const counted_color> colors, std::span<std::uint32_t> order, const box& b) {
    const auto first = order.begin() + static_cast<std::ptrdiff_t>(b.begin);
    const auto last = order.begin() + static_cast<std::ptrdiff_t>(b.end);
    std::sort(first, last, [&](std::uint32_t l, std::uint32_t r) {
        const auto left = colors[l].color[b.axis];
        const auto right = colors[r].color[b.axis];
        return left != right ? left < right : l < r;
    });
    std::uint64_t weight = 0;
    for (std::size_t i = b.begin; i < b.end; ++i) weight += colors[order[i]].count;
    std::uint64_t below = 0;
    for (std::size_t i = b.begin; i < b.end; ++i) {
        below += colors[order[i]].count;
        if (2 * below >= weight) return std::min(i + 1, b.end - 1);
    }
    return b.end - 1;
}

rgb8 mean_of(const sums& s) {
    rgb8 mean{};
    for (std::size_t a = 0; a < 3; ++a) mean[a] = static_cast<std::uint8_t>((s[a] + s[3] / 2) / s[3]);
    return mean;
}

int squared_distance(const rgb8& a, const rgb8& b) {
    int sum = 0;
    for (std::size_t i = 0; i < 3; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
}

void sort_unique(std::vector<rgb8>& entries) {
    std::sort(entries.begin(), entries.end());
    entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
}

// Index of the entry nearest to a colour, the lowest one of equals. Entries ascend in red, so the search runs outward
// from the colour's own red and stops where red alone is farther than the best.
std::size_t nearest(const std::vector<rgb8>& entries, const rgb8& color) {
    const auto start =
        static_cast<std::size_t>(std::lower_bound(entries.begin(), entries.end(), color) - entries.begin());
    std::size_t best = 0;
    int best_distance = std::numeric_limits<int>::max();
    const auto consider = [&](std::size_t i) {
        const int red = entries[i][0] - color[0];
        if (red * red > best_distance) return false;
        const int d = squared_distance(entries[i], color);
        if (d < best_distance || (d == best_distance && i < best)) {
            best = i;
            best_distance = d;
        }
        return true;
    };
    for (std::size_t i = start; i < entries.size() && consider(i); ++i) {
    }
    for (std::size_t i = start; i-- > 0 && consider(i);) {
    }
    return best;
}

} // namespace

palette make_palette(std::span<const counted_color> colors, std::size_t max_entries) {
    palette result;
    for (const counted_color& c : colors) {
        result.entries.push_back(c.color);
        if (result.entries.size() > max_entries) break;
    }
    if (colors.size() > max_entries) {
        std::vector<std::uint32_t> order(colors.size());
        std::iota(order.begin(), order.end(), 0u);
        std::vector<box> boxes{measure(colors, order, 0, order.size())};
        while (boxes.size() < max_entries) {
            const auto widest = std::max_element(boxes.begin(), boxes.end(),
                                                 [](const box& l, const box& r) { return l.spread < r.spread; });
            if (widest->spread == 0) break; // cannot happen while there are more colours than boxes
            const box parent = *widest;
            const std::size_t middle = cut(colors, order, parent);
            *widest = measure(colors, order, parent.begin, middle);
            boxes.push_back(measure(colors, order, middle, parent.end));
        }
        result.entries.clear();
        for (const box& b : boxes) {
            sums s{};
            for (std::size_t i = b.begin; i < b.end; ++i) {
                const counted_color& c = colors[order[i]];
                for (std::size_t a = 0; a < 3; ++a) s[a] += std::uint64_t{c.color[a]} * c.count;
                s[3] += c.count;
            }
            result.entries.push_back(mean_of(s));
        }
        sort_unique(result.entries);
        constexpr int rounds = 2;
        for (int round = 0; round < rounds; ++round) {
            std::vector<sums> gathered(result.entries.size());
            for (const counted_color& c : colors) {
                sums& s = gathered[nearest(result.entries, c.color)];
                for (std::size_t a = 0; a < 3; ++a) s[a] += std::uint64_t{c.color[a]} * c.count;
                s[3] += c.count;
            }
            for (std::size_t e = 0; e < gathered.size(); ++e)
                if (gathered[e][3] != 0) result.entries[e] = mean_of(gathered[e]);
            sort_unique(result.entries);
        }
    } else {
        sort_unique(result.entries);
    }
    result.entry_of.reserve(colors.size());
    for (const counted_color& c : colors)
        result.entry_of.push_back(static_cast<std::uint8_t>(nearest(result.entries, c.color)));
    return result;
}

} // namespace voxelize
