// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The colour of each voxel in a picture, from the values that it has, as the page for the browser shows them
// (page.html). Internal to the preview.

#include "model/volume.hpp"
#include "preview.hpp"

#include <array>
#include <cstdint>

namespace voxelize {

// From dark violet over blue-green to yellow, about even in lightness. The ends of the colour map and the colours
// between them in even steps.
inline constexpr std::array<rgb8, 6> color_ramp{rgb8{58, 20, 92},   rgb8{62, 74, 137},  rgb8{38, 130, 142},
                                                rgb8{83, 184, 112}, rgb8{190, 214, 60}, rgb8{253, 231, 76}};

class voxel_colors {
public:
    // `shown` must outlive this; null: all voxels have the colour of clay. Colours (u8 with three or four components)
    // stay as they are, three floats are a direction, numbers of materials and triangles get colours that neighbours
    // do not share. Other numbers are mapped by color_ramp, from the 1st to the 99th percentile of the occupied
    // voxels, found from 2^18 of them at most. `dense`: the volume whose occupancy says which voxels count; null: the
    // channel has values of occupied voxels alone.
    voxel_colors(const channel* shown, const volume* dense);

    // Colour of the voxel whose value is the channel's number-th.
    [[nodiscard]] rgb8 of(std::int64_t number) const;
    // The values at the ends of the colour map; both 0 where there is none.
    [[nodiscard]] double low() const { return low_; }
    [[nodiscard]] double high() const { return high_; }

private:
    enum class kind : std::uint8_t { clay, color, direction, number, scalar };
    void find_range(const volume* dense);

    const channel* shown_ = nullptr;
    kind kind_ = kind::clay;
    double low_ = 0, high_ = 0;
};

} // namespace voxelize
