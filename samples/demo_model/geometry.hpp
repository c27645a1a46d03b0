// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangle meshes out of a few shapes: patches over a function of two parameters, surfaces of revolution, boxes.
// Positions are metres, y up. Everything is rounded to a fine lattice on the way in, so that the last bit of a sine
// does not reach the file and every machine writes the same bytes.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace demo_model {

struct vec2 {
    double x = 0, y = 0;
};
struct vec3 {
    double x = 0, y = 0, z = 0;
};
[[nodiscard]] constexpr vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
[[nodiscard]] constexpr vec3 operator-(vec3 a, vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
[[nodiscard]] constexpr vec3 operator*(vec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }

using rgba = std::array<std::uint8_t, 4>;
inline constexpr rgba white{255, 255, 255, 255};

// a + (b - a) t on each channel, t in 0..1.
[[nodiscard]] rgba mix(rgba a, rgba b, double t);

struct vertex {
    vec3 position;
    vec2 uv;
    rgba color = white; // linear, multiplies the material's colour
};

struct mesh {
    std::vector<std::array<float, 3>> positions;
    std::vector<std::array<float, 3>> normals; // unit length
    std::vector<std::array<float, 2>> uvs;
    std::vector<rgba> colors;
    std::vector<std::uint32_t> indices; // three a triangle, counter-clockwise from outside

    // A grid of nu x nv quads over f(u, v), u and v from 0 to 1. The outside is where the derivative by u turns
    // counter-clockwise into the derivative by v. Normals are smooth inside the patch; quads that shrink to a point or
    // a line lose the triangles without area.
    void add_patch(int nu, int nv, const std::function<vertex(double u, double v)>& f);

    // Turns the profile (radius, height), from the bottom up, about the y axis, one patch for each of its pieces, so
    // that its corners stay sharp. u runs `u_repeat` times around; v takes from `v_low` to `v_high` along the profile.
    void add_lathe(std::span<const vec2> profile, int segments, double u_repeat = 1, double v_low = 0,
                   double v_high = 1, rgba color = white);

    // An axis-aligned box; every face shows the texture `scale` times a metre.
    void add_box(vec3 low, vec3 high, double scale = 1, rgba color = white);

    // Four corners counter-clockwise from outside; the texture fills it once, its top along c and d.
    void add_quad(vec3 a, vec3 b, vec3 c, vec3 d, rgba color = white);

    [[nodiscard]] std::size_t num_triangles() const { return indices.size() / 3; }
};

// Smooth noise in [-1, 1] around zero, from a hash of the lattice points; period of a metre at frequency 1.
[[nodiscard]] double noise(vec3 p);
// Four octaves of it, each of half the size and height.
[[nodiscard]] double rough_noise(vec3 p);

} // namespace demo_model
