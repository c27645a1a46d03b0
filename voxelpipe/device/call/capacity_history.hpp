// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Guesses the capacities of arrays whose lengths only the device finds out. Too little capacity costs a second run; too
// much costs time where a sort works on the whole capacity.

#include <voxelpipe/device/base/launch_size.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace voxelpipe::core {

// Key: what the host knows of a call, compared by ==. N arrays; elements of those with `is_numbered` are numbered with
// 32 bits.
template <class Key, std::size_t N>
class capacity_history {
public:
    using lengths = std::array<std::uint64_t, N>;

    explicit capacity_history(const std::array<bool, N>& is_numbered) : is_numbered_(is_numbered) {}

    // Capacities for a call. A call like the last one gets a little more than such calls have needed so far. Any other
    // gets `first`, or more if an earlier call did not fit.
    [[nodiscard]] lengths guess(const Key& key, const lengths& first) const {
        const bool known = last_ == key;
        lengths capacities{};
        for (std::size_t k = 0; k < N; ++k)
            capacities[k] = limited(k, known && needed_[k] != 0 ? needed_[k] + needed_[k] / 16 + 1024
                                                                : std::max(max_capacities_[k], first[k]));
        return capacities;
    }
    // Raises the capacities for the next try of a call that did not fit.
    void raise(lengths& capacities, const lengths& needed) {
        for (std::size_t k = 0; k < N; ++k) {
            if (needed[k] > capacities[k]) capacities[k] = limited(k, needed[k] + needed[k] / 16);
            max_capacities_[k] = std::max(max_capacities_[k], capacities[k]);
        }
    }
    // Records a call that fitted. The key does not distinguish all calls: equal keys share the largest need.
    void fitted(const Key& key, const lengths& needed) {
        for (std::size_t k = 0; k < N; ++k) needed_[k] = last_ == key ? std::max(needed_[k], needed[k]) : needed[k];
        last_ = key;
    }

    // The most elements of array k that calls with this key have needed; nullopt if the last call had another key.
    [[nodiscard]] std::optional<std::uint64_t> max_needed(const Key& key, std::size_t k) const {
        return last_ == key ? std::optional(needed_[k]) : std::nullopt;
    }

private:
    [[nodiscard]] std::uint64_t limited(std::size_t k, std::uint64_t length) const {
        return is_numbered_[k] ? std::min(length, max_numbered) : length;
    }
    std::array<bool, N> is_numbered_;
    lengths max_capacities_{}, needed_{};
    std::optional<Key> last_;
};

} // namespace voxelpipe::core
