// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A Cornell box of 2 x 2 x 2 metres, open to the front. The walls are thick, so that their insides are filled.

#include "parts.hpp"

#include <cmath>
#include <numbers>

namespace gi {

scene make_cornell() {
    constexpr double wall = 0.14, pi = std::numbers::pi;
    scene_builder b;
    const auto box = [&](vec3 low, vec3 high, const material& m) {
        mesh part;
        part.add_box(low, high);
        b.add(std::move(part), m);
    };
    const material white{.color = {0.73f, 0.71f, 0.68f}};
    box({-1 - wall, -wall, -1 - wall}, {1 + wall, 0, 1}, {.color = {0.73f, 0.71f, 0.68f}, .roughness = 0.35f});
    box({-1 - wall, 2, -1 - wall}, {1 + wall, 2 + wall, 1}, white);
    box({-1 - wall, 0, -1 - wall}, {1 + wall, 2, -1}, white);
    box({-1 - wall, 0, -1}, {-1, 2, 1}, {.color = {0.66f, 0.06f, 0.05f}});
    box({1, 0, -1}, {1 + wall, 2, 1}, {.color = {0.13f, 0.47f, 0.10f}});

    const glm::vec3 lamp_color(14.0f, 11.2f, 7.6f);
    // As flat as the vertices' lattice allows: walls get no light from above the lamp's face.
    box({-0.32, 1.99, -0.32}, {0.32, 2, 0.28}, {.color = glm::vec3(0.0f), .emission = lamp_color, .is_light = true});

    mesh tall, low;
    tall.add_box({-0.29, 0, -0.29}, {0.29, 1.22, 0.29});
    low.add_box({-0.29, 0, -0.29}, {0.29, 0.56, 0.29});
    b.add(placed(tall, 18, {-0.36, 0, -0.38}), white);
    b.add(placed(low, -17, {0.38, 0, 0.24}), white);
    b.add(placed(make_ball(0.24), 0, {0.38, 0.8, 0.24}),
          {.color = {1.0f, 0.72f, 0.29f}, .roughness = 0.18f, .metallic = 1.0f});
    b.add(make_ball(0.13, 16), {.color = glm::vec3(0.0f), .emission = {1.3f, 4.8f, 11.5f}}, part_kind::moving);

    scene s = b.finish();
    s.low = {-1 - wall, -wall, -1 - wall};
    s.high = {1 + wall, 2 + wall, 1};
    s.light.position = {0, 1.985f, -0.02f, 1};
    s.light.side_u = {0.32f, 0, 0};
    s.light.side_v = {0, 0, 0.30f};
    s.light.color = lamp_color;
    // A dim room around the box, for the front ends of its walls, which neither the lamp nor the ball reaches.
    s.sky_above = s.sky_level = glm::vec3(0.07f);
    s.exposure = 1.9f;
    s.motion = [](double t) {
        // Over both blocks and around the gold ball, with room between them at every time.
        const double a = 2 * pi * t + 0.9;
        return glm::dvec3(0.8 * std::sin(a), 1.36 - 0.42 * std::sin(a), 0.72 * std::cos(a) + 0.1);
    };
    s.view = [](double t) {
        const double a = 0.42 * std::sin(2 * pi * t);
        return camera{{3.35 * std::sin(a), 1.42 + 0.1 * std::sin(4 * pi * t), 3.35 * std::cos(a)}, {0, 0.97, -0.1}, 41};
    };
    return s;
}

} // namespace gi
