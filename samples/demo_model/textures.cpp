// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "textures.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace demo_model {
namespace {

constexpr rgba clear{0, 0, 0, 0};

// Paints every pixel by its centre, u and v from 0 to 1, v downwards.
texture paint(const char* name, int width, int height, const std::function<rgba(double u, double v)>& f) {
    texture t{name, width, height, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) t.pixels.push_back(f((x + 0.5) / width, (y + 0.5) / height));
    return t;
}

// Brighter (> 1) or darker, alpha kept.
rgba scaled(rgba c, double by) {
    for (std::size_t a = 0; a < 3; ++a) c[a] = static_cast<std::uint8_t>(std::clamp(std::lround(c[a] * by), 0l, 255l));
    return c;
}

// Noise that repeats when u or v passes 1: taken around two circles would cost a dimension, so blend the two ends
// instead.
double tiling_noise(double u, double v, double frequency, double seed) {
    const auto at = [&](double x, double y) { return rough_noise({x * frequency, y * frequency, seed}); };
    const double top = at(u, v) * (1 - u) + at(u - 1, v) * u;
    const double bottom = at(u, v - 1) * (1 - u) + at(u - 1, v - 1) * u;
    return top * (1 - v) + bottom * v;
}

// Place inside a row of cells: the cell's number and the position in it, 0 to 1.
struct in_cell {
    double number, inside;
};
in_cell cell(double at, double count) {
    const double scaled_at = at * count;
    const double number = std::floor(scaled_at);
    return {number, scaled_at - number};
}

} // namespace

texture paint_tower() {
    return paint("tower", 256, 256, [](double u, double v) {
        const double grain = tiling_noise(u, v, 24, 1);
        const in_cell band = cell(v, 6);
        const bool red = static_cast<int>(band.number) % 2 == 0;
        rgba c = red ? rgba{190, 42, 38, 255} : rgba{240, 236, 226, 255};
        // Rain has washed streaks down from each band's upper edge.
        const double streak = std::max(0.0, tiling_noise(u, 0.5, 60, 2)) * (1 - band.inside);
        c = scaled(c, 1 + 0.10 * grain - 0.22 * streak);
        const in_cell course = cell(v, 48);
        if (course.inside < 0.10) c = scaled(c, 0.93); // joints of the masonry
        return c;
    });
}

texture paint_rock() {
    return paint("rock", 256, 256, [](double u, double v) {
        const double coarse = tiling_noise(u, v, 6, 3), fine = tiling_noise(u, v, 40, 4);
        const double crack = std::abs(tiling_noise(u, v, 9, 5));
        double light = 0.84 + 0.20 * coarse + 0.14 * fine;
        if (crack < 0.02) light *= 0.72;
        return scaled({226, 222, 214, 255}, light);
    });
}

texture paint_water() {
    return paint("water", 256, 256, [](double u, double v) {
        const double ripple = std::sin(2 * std::numbers::pi * (3 * v + 0.35 * tiling_noise(u, v, 5, 6)));
        return scaled({232, 238, 242, 255}, 0.94 + 0.05 * ripple + 0.05 * tiling_noise(u, v, 20, 7));
    });
}

texture paint_wood() {
    return paint("wood", 256, 256, [](double u, double v) {
        const in_cell plank = cell(v, 4);
        const double grain = rough_noise({u * 6, v * 70, plank.number * 9});
        rgba c = scaled({158, 118, 78, 255}, 1 + 0.22 * grain + 0.06 * std::sin(plank.number * 2.4));
        if (plank.inside < 0.07) c = scaled(c, 0.5);
        return c;
    });
}

texture paint_roof() {
    return paint("roof", 256, 256, [](double u, double v) {
        const in_cell row = cell(v, 8);
        const in_cell tile = cell(u + (static_cast<int>(row.number) % 2 == 0 ? 0.0 : 1.0 / 16), 8);
        const double shade = noise({tile.number * 3.7 + 0.5, row.number * 5.1 + 0.5, 8});
        rgba c = scaled({172, 70, 48, 255}, 0.96 + 0.16 * shade - 0.25 * row.inside + 0.12);
        if (row.inside > 0.88 || tile.inside < 0.05) c = scaled(c, 0.62);
        return c;
    });
}

texture paint_wall() {
    return paint("wall", 256, 256, [](double u, double v) {
        const rgba plaster = scaled({238, 230, 212, 255}, 1 + 0.06 * rough_noise({u * 30, v * 30, 9}));
        const double du = std::abs(u - 0.5), dv = std::abs(v - 0.45);
        if (du < 0.17 && dv < 0.21) {
            const bool bar = du < 0.018 || dv < 0.018;
            if (du > 0.14 || dv > 0.18 || bar) return rgba{250, 248, 240, 255}; // frame
            return mix({92, 138, 168, 255}, {36, 62, 90, 255}, (v - 0.24) / 0.42 + 0.15 * (u - 0.5));
        }
        if (du >= 0.17 && du < 0.25 && dv < 0.20) { // shutters
            const in_cell slat = cell(v, 40);
            return scaled({52, 92, 122, 255}, slat.inside < 0.3 ? 0.75 : 1.0);
        }
        if (v > 0.90) return scaled({150, 142, 132, 255}, 1 + 0.3 * rough_noise({u * 40, v * 40, 10})); // plinth
        return plaster;
    });
}

texture paint_door() {
    return paint("door", 128, 256, [](double u, double v) {
        const in_cell plank = cell(u, 5);
        rgba c = scaled({46, 98, 92, 255}, 1 + 0.2 * rough_noise({u * 60, v * 8, plank.number}));
        if (plank.inside < 0.08) c = scaled(c, 0.6);
        if (std::abs(v - 0.22) < 0.03 || std::abs(v - 0.78) < 0.03) c = {58, 54, 52, 255};
        const double du = u - 0.82, dv = (v - 0.52) * 2;
        if (du * du + dv * dv < 0.003) c = {222, 184, 84, 255};
        return c;
    });
}

texture paint_railing() {
    return paint("railing", 64, 128, [](double u, double v) {
        const bool rail = v < 0.16 || v > 0.88 || std::abs(v - 0.52) < 0.05;
        const bool post = u < 0.22;
        return rail || post ? scaled({44, 48, 56, 255}, rail ? 1.25 : 1.0) : clear;
    });
}

texture paint_lantern() {
    return paint("lantern", 64, 128, [](double u, double v) {
        const bool frame = v < 0.07 || v > 0.93 || std::abs(v - 0.5) < 0.03 || u < 0.12;
        return frame ? rgba{56, 60, 68, 255} : clear;
    });
}

} // namespace demo_model
