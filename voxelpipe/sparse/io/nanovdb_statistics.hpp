// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What nodes of a NanoVDB file say of the values below them.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/sparse/io/nanovdb_layout.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::io::nanovdb {

// ---- statistics
// -------------------------------------------------------------------------------------------------------

// Number, sum and sum of squares of what a node holds, and its extremes; in the order of the leaves, so the same bits
// everywhere.
template <class T>
struct statistics {
    using stored = typename value_type<T>::stored;
    std::uint64_t count = 0;
    double sum = 0, squares = 0, low = 0, high = 0;
    stored minimum{}, maximum{};
    box voxels{{INT32_MAX, INT32_MAX, INT32_MAX}, {INT32_MIN, INT32_MIN, INT32_MIN}};

    // A value as one number: itself, or a squared length.
    [[nodiscard]] static double size_of(const stored& v) {
        if constexpr (std::is_same_v<stored, rgba8>) {
            double squared = 0;
            for (int c = 0; c < 3; ++c) {
                const double level = (v.packed >> (8 * c) & 255u) / 255.0;
                squared = exact::fma(level, level, squared);
            }
            return squared;
        } else if constexpr (std::is_arithmetic_v<stored>) {
            return static_cast<double>(v);
        } else {
            double squared = 0;
            for (glm::length_t c = 0; c < stored::length(); ++c)
                squared = exact::fma(double{v[c]}, double{v[c]}, squared);
            return squared;
        }
    }
    void add(const stored& v) {
        if constexpr (value_type<T>::has_statistics) {
            const double size = size_of(v);
            if (count == 0 || size < low) {
                low = size;
                minimum = v;
            }
            if (count == 0 || size > high) {
                high = size;
                maximum = v;
            }
            sum += size;
            squares = exact::fma(size, size, squares);
        }
        ++count;
    }
    // A cube of `side` voxels a side from `origin` on, all of which have this value.
    void add_cube(const stored& v, const glm::ivec3& origin, int side) {
        statistics cube;
        cube.add(v);
        const double n = static_cast<double>(side) * side * side;
        cube.count =
            static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side);
        cube.sum *= n;
        cube.squares *= n;
        for (int a = 0; a < 3; ++a) {
            cube.voxels.low[a] = origin[a];
            cube.voxels.high[a] = origin[a] + side - 1;
        }
        add(cube);
    }
    void add(const statistics& other) {
        if (other.count == 0) return;
        if (count == 0 || other.low < low) {
            low = other.low;
            minimum = other.minimum;
        }
        if (count == 0 || other.high > high) {
            high = other.high;
            maximum = other.maximum;
        }
        sum += other.sum;
        squares += other.squares;
        count += other.count;
        for (int a = 0; a < 3; ++a) {
            voxels.low[a] = std::min(voxels.low[a], other.voxels.low[a]);
            voxels.high[a] = std::max(voxels.high[a], other.voxels.high[a]);
        }
    }
    template <class Node>
    void write_to(Node& node) const {
        if constexpr (value_type<T>::has_statistics) {
            if (count == 0) return;
            using statistic = typename value_type<T>::statistic;
            const double mean = sum / static_cast<double>(count);
            const double variance = exact::fma(-mean, mean, squares / static_cast<double>(count));
            node.minimum = minimum;
            node.maximum = maximum;
            node.average = static_cast<statistic>(mean);
            node.deviation = static_cast<statistic>(std::sqrt(std::max(variance, 0.0)));
        }
    }
};

} // namespace voxelpipe::io::nanovdb
