// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A court of 12 x 7 metres with a gallery of two storeys around it: columns, arches, balustrades, curtains. Every part
// but the curtains is closed, so that its inside is filled.

#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gi {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double half_x = 6.0, half_z = 3.5; // of the court, to the middle of the columns
constexpr double depth = 2.7;                // of the gallery, from there
constexpr double storey = 3.9, slab = 0.42;
constexpr double wall = 0.5;
constexpr int spans_x = 5, spans_z = 3;

demo_model::texture paint_floor() {
    demo_model::texture t{"marble floor", 256, 256, {}};
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x) {
            const int tile_x = x / 128, tile_y = y / 128, in_x = x % 128, in_y = y % 128;
            const bool joint = std::min({in_x, in_y, 127 - in_x, 127 - in_y}) < 2;
            const double vein = std::abs(demo_model::rough_noise({x / 40.0, y / 40.0, 3.0 + tile_x + 2 * tile_y}));
            const bool dark = (tile_x + tile_y) % 2 == 1;
            const demo_model::rgba base =
                dark ? demo_model::rgba{104, 62, 52, 255} : demo_model::rgba{214, 203, 182, 255};
            const demo_model::rgba veins =
                dark ? demo_model::rgba{150, 106, 92, 255} : demo_model::rgba{168, 154, 134, 255};
            t.pixels.push_back(joint ? demo_model::rgba{92, 86, 78, 255}
                                     : demo_model::mix(base, veins, 0.8 - 6 * vein));
        }
    return t;
}
demo_model::texture paint_stone() { // courses of ashlar, two a metre
    demo_model::texture t{"sandstone", 256, 256, {}};
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x) {
            const int course = y / 64, along = (x + (course % 2) * 64) % 256, block = along / 128;
            const bool joint = y % 64 < 2 || along % 128 < 2;
            const double grain = demo_model::rough_noise({x / 22.0, y / 22.0, 7.7});
            const double tone = 0.5 + 0.45 * demo_model::noise({block * 3.7, course * 5.3, 1.9}) + 0.35 * grain;
            t.pixels.push_back(joint ? demo_model::rgba{158, 138, 108, 255}
                                     : demo_model::mix({196, 174, 138, 255}, {226, 208, 174, 255}, tone));
        }
    return t;
}

mesh make_column(double height, double radius) {
    using demo_model::vec2;
    const std::vector<vec2> profile{{0, 0},
                                    {radius * 1.5, 0},
                                    {radius * 1.5, 0.16},
                                    {radius * 1.28, 0.20},
                                    {radius * 1.3, 0.30},
                                    {radius, 0.36},
                                    {radius * 0.86, height - 0.42},
                                    {radius * 1.0, height - 0.36},
                                    {radius * 0.95, height - 0.3},
                                    {radius * 1.45, height - 0.12},
                                    {radius * 1.5, height},
                                    {0, height}};
    mesh m;
    m.add_lathe(profile, 28, 2, 0, height / 2);
    return m;
}

// A wall of `thickness` over an arch between x = 0 and `span`, from the spring line at `low` to `high`, along +x around
// z = 0.
mesh make_arch(double span, double low, double high, double thickness) {
    mesh m;
    constexpr int pieces = 14;
    const double edge = 0.3, radius = span / 2 - edge, rise = std::min(radius, high - low - 0.25), z = thickness / 2;
    const auto piece = [&](double x0, double y0, double x1, double y1) {
        add_hexahedron(m, {vec3{x0, y0, z}, vec3{x1, y1, z}, vec3{x1, y1, -z}, vec3{x0, y0, -z}, vec3{x0, high, z},
                           vec3{x1, high, z}, vec3{x1, high, -z}, vec3{x0, high, -z}});
    };
    piece(0, low, edge, low);
    for (int k = 0; k < pieces; ++k) {
        const double a = pi * k / pieces, c = pi * (k + 1) / pieces;
        piece(span / 2 - radius * std::cos(a), low + rise * std::sin(a), span / 2 - radius * std::cos(c),
              low + rise * std::sin(c));
    }
    piece(span - edge, low, span, low);
    // The texture runs along the wall; faces across it take what they get.
    for (std::size_t i = 0; i < m.uvs.size(); ++i) m.uvs[i] = {m.positions[i][0] / 2, (8.0f - m.positions[i][1]) / 2};
    return m;
}

// A curtain along +x, hanging from `high` to `low`, in folds.
mesh make_curtain(double width, double low, double high, double phase) {
    mesh m;
    m.add_patch(40, 12, [&](double u, double v) {
        const double fold = 0.10 * (0.45 + 0.55 * (1 - v)) * std::sin(2 * pi * 4 * u + phase);
        const double drawn = 0.5 + (u - 0.5) * (0.86 + 0.14 * v); // gathered at the foot
        return demo_model::vertex{
            {drawn * width, low + (high - low) * v, fold + 0.08 * std::sin(5 * u + phase) * (1 - v)}, {u, 1 - v}};
    });
    return m;
}

struct looks {
    material stone, plain, column, floor, bronze;
};

// Columns, arches, balustrade and curtains of one side: along +x from the corner of the court, then placed.
void add_side(scene_builder& b, const looks& look, int spans, double length, double degrees, vec3 corner, int side) {
    static const glm::vec3 cloth[] = {
        {0.62f, 0.035f, 0.03f}, {0.04f, 0.17f, 0.46f}, {0.05f, 0.33f, 0.11f}, {0.62f, 0.33f, 0.03f}};
    const double span = length / spans;
    const auto put = [&](mesh m, vec3 at, const material& how, part_kind kind = part_kind::closed) {
        b.add(placed(placed(std::move(m), 0, at), degrees, corner), how, kind);
    };
    for (int level = 0; level < 2; ++level) {
        const double floor = level * storey, column_height = level == 0 ? 2.35 : 2.3, top = floor + storey - slab;
        for (int k = 0; k < spans; ++k) {
            put(make_column(column_height, level == 0 ? 0.27 : 0.21), {k * span, floor, 0}, look.column);
            put(make_arch(span, floor + column_height, top, 0.5), {k * span, 0, 0}, look.stone);
            if (level == 1) {
                mesh rail;
                rail.add_box({0.2, floor + 0.82, -0.15}, {span - 0.2, floor + 0.98, 0.15}, 0.5);
                const int posts = static_cast<int>(span / 0.34);
                for (int p = 0; p < posts; ++p) {
                    const double x = 0.2 + (span - 0.4) * (p + 0.5) / posts;
                    rail.add_box({x - 0.075, floor, -0.075}, {x + 0.075, floor + 0.82, 0.075}, 0.5);
                }
                put(std::move(rail), {k * span, 0, 0}, look.plain);
            }
            const bool hung = level == 0 ? (k + side) % 2 == 0 : (k + side) % 3 == 1;
            if (!hung) continue;
            const material of_cloth{.color = cloth[(k + 2 * level + side) % 4]};
            put(make_curtain(span - 0.7, floor + (level == 0 ? 0.25 : 1.0), floor + column_height + 0.15,
                             k + 2.0 * side),
                {k * span + 0.35, 0, 0.05}, of_cloth, part_kind::sheet);
        }
    }
}

} // namespace

scene make_atrium() {
    scene_builder b;
    looks look;
    look.stone = {.color = glm::vec3(0.95f), .texture = b.add_texture(paint_stone())};
    look.floor = {.color = glm::vec3(0.95f), .roughness = 0.16f, .texture = b.add_texture(paint_floor())};
    look.plain = {.color = {0.74f, 0.66f, 0.52f}};
    look.column = {.color = {0.80f, 0.73f, 0.60f}, .roughness = 0.5f};
    look.bronze = {.color = {0.92f, 0.60f, 0.32f}, .roughness = 0.22f, .metallic = 1.0f};

    const double out_x = half_x + depth, out_z = half_z + depth;
    const auto box = [&](vec3 low, vec3 high, const material& m, double scale = 0.5) {
        mesh part;
        part.add_box(low, high, scale);
        b.add(std::move(part), m);
    };
    box({-out_x - wall, -0.6, -out_z - wall}, {out_x + wall, 0, out_z + wall}, look.floor, 0.4);
    // Outer walls, then the gallery's floor and the roof, each as a ring of four.
    const auto ring = [&](double in_x, double in_z, double low, double high, const material& m) {
        box({-out_x - wall, low, -out_z - wall}, {out_x + wall, high, -in_z}, m);
        box({-out_x - wall, low, in_z}, {out_x + wall, high, out_z + wall}, m);
        box({-out_x - wall, low, -in_z}, {-in_x, high, in_z}, m);
        box({in_x, low, -in_z}, {out_x + wall, high, in_z}, m);
    };
    ring(out_x, out_z, 0, 2 * storey, look.stone);
    ring(half_x - 0.3, half_z - 0.3, storey - slab, storey, look.plain);
    ring(half_x - 0.34, half_z - 0.34, 2 * storey - slab, 2 * storey + 0.25, look.plain);

    add_side(b, look, spans_x, 2 * half_x, 0, {-half_x, 0, half_z}, 0);
    add_side(b, look, spans_z, 2 * half_z, 90, {half_x, 0, half_z}, 1);
    add_side(b, look, spans_x, 2 * half_x, 180, {half_x, 0, -half_z}, 2);
    add_side(b, look, spans_z, 2 * half_z, 270, {-half_x, 0, -half_z}, 3);

    // A basin in the middle, with a bronze ball on its foot.
    mesh basin;
    basin.add_lathe(std::vector<demo_model::vec2>{{0, 0},
                                                  {1.25, 0},
                                                  {1.25, 0.16},
                                                  {0.45, 0.22},
                                                  {0.28, 0.42},
                                                  {0.3, 0.7},
                                                  {0.95, 0.95},
                                                  {1.0, 1.08},
                                                  {0.86, 1.08},
                                                  {0.3, 0.9},
                                                  {0, 0.88}},
                    40, 4, 0, 2);
    b.add(std::move(basin), look.column);
    b.add(placed(make_ball(0.46), 0, {0, 1.42, 0}), look.bronze);
    b.add(make_ball(0.24, 16), {.color = glm::vec3(0.0f), .emission = {34.0f, 17.0f, 5.0f}}, part_kind::moving);

    scene s = b.finish();
    set_sun(s, {0.3f, 1.15f, 0.5f}, 0.008f, {30.0f, 25.0f, 17.5f});
    s.sky_above = {0.72f, 1.30f, 2.45f};
    s.sky_level = {2.20f, 2.50f, 2.85f};
    s.exposure = 1.10f;
    s.wall = 1.25 * wall; // what passes through the outer walls is not seen here
    s.motion = [](double t) {
        const double a = 2 * pi * t + 3.7;
        return glm::dvec3(4.7 * std::sin(a), 1.75 + 0.35 * std::sin(3 * a), 4.3 * std::cos(a));
    };
    s.view = [](double t) {
        const double a = 2 * pi * t + 1.93;
        return camera{{5.9 * std::sin(a), 2.35 + 0.5 * std::sin(2 * a), 2.9 * std::cos(a)},
                      {-3.0 * std::sin(a), 2.75, -1.6 * std::cos(a)},
                      66};
    };
    return s;
}

} // namespace gi
