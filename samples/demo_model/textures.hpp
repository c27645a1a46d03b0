// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The pictures of the demo model, painted by small functions: no file is read.

#include "geometry.hpp"

#include <string>
#include <vector>

namespace demo_model {

struct texture {
    std::string name;
    int width = 0;
    int height = 0;
    std::vector<rgba> pixels; // sRGB, rows from the top; alpha 0 or 255
};

[[nodiscard]] texture paint_tower();   // red and white bands over rough plaster; meant to wrap around once
[[nodiscard]] texture paint_rock();    // grey grain, multiplied by vertex colours; tiles
[[nodiscard]] texture paint_water();   // ripples, multiplied by vertex colours; tiles
[[nodiscard]] texture paint_wood();    // planks; tiles
[[nodiscard]] texture paint_roof();    // rows of shingles; tiles
[[nodiscard]] texture paint_wall();    // a house wall with a window; tiles along u
[[nodiscard]] texture paint_door();    // planks with iron bands and a handle
[[nodiscard]] texture paint_railing(); // one field of the railing; everything between the bars is cut out by alpha
[[nodiscard]] texture paint_lantern(); // frame of the lantern room; the panes are cut out by alpha

} // namespace demo_model
