// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of all languages: the targets of distance fields.

#include <voxelpipe/distance/distance.hpp>

#include <cstdint>

namespace voxelpipe::bindings {

// The distance, and the number of the nearest triangle among all parts; -1 beyond the band.
struct distance_and_nearest {
    VOXELPIPE_HD output<float, std::int64_t> operator()(const distance_fragment<>& f) const {
        return outputs(f.distance, f.in_band ? static_cast<std::int64_t>(f.primitive) : std::int64_t{-1});
    }
};

using distances = target<float, blend::replace>;
using numbers = target<std::int64_t, blend::replace>;

} // namespace voxelpipe::bindings
