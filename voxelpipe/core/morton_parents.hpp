// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The parents of cells that are listed by Morton key, as a functor of Backend::for_each.

#include <voxelpipe/config.hpp>

#include <cstdint>

namespace voxelpipe::core {

// 1 for cells that are the first of their parent; the last count is 0.
struct count_parents {
    const std::uint64_t* keys;
    std::uint64_t count;
    std::uint32_t* is_first;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        is_first[i] = i < count && (i == 0 || keys[i] >> 3 != keys[i - 1] >> 3) ? 1 : 0;
    }
};

} // namespace voxelpipe::core
