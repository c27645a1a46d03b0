// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The stable order of many items by keys of up to 64 bits, on the host: a radix sort of their numbers that looks at the
// digits in which keys differ, and at no other.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace voxelpipe::core {

class radix_order {
public:
    // Items 0 to count - 1, in this order. count is below 2^32. Throws std::bad_alloc.
    explicit radix_order(std::size_t count) : order_(count), other_(count), keys_(count) {
        std::iota(order_.begin(), order_.end(), std::uint32_t{0});
    }

    // Sorts by key(item), an integer. Items with equal keys stay in the order in which they are: by the last of several
    // keys first.
    template <class Key>
    void sort(const Key& key) {
        if (order_.empty()) return;
        std::uint64_t least = ~std::uint64_t{0}, most = 0;
        for (std::size_t i = 0; i < keys_.size(); ++i) {
            keys_[i] = to_unsigned(key(static_cast<std::uint32_t>(i)));
            least = std::min(least, keys_[i]);
            most = std::max(most, keys_[i]);
        }
        for (int shift = 0; shift < 64 && (most - least) >> shift != 0; shift += digit_bits) {
            std::array<std::uint32_t, std::size_t{1} << digit_bits> next{};
            const auto digit = [&](std::uint32_t item) {
                return static_cast<std::size_t>((keys_[item] - least) >> shift) & (next.size() - 1);
            };
            for (const std::uint32_t i : order_) ++next[digit(i)];
            std::uint32_t sum = 0;
            for (std::uint32_t& n : next) sum += std::exchange(n, sum);
            for (const std::uint32_t i : order_) other_[next[digit(i)]++] = i;
            order_.swap(other_);
        }
    }

    [[nodiscard]] const std::vector<std::uint32_t>& items() const { return order_; }

private:
    static constexpr int digit_bits = 11;

    [[nodiscard]] static std::uint64_t to_unsigned(std::uint64_t key) { return key; }
    [[nodiscard]] static std::uint64_t to_unsigned(std::int64_t key) {
        return static_cast<std::uint64_t>(key) ^ std::uint64_t{1} << 63;
    }

    std::vector<std::uint32_t> order_, other_;
    std::vector<std::uint64_t> keys_;
};

} // namespace voxelpipe::core
