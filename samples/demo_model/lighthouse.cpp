// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "lighthouse.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace demo_model {
namespace {

constexpr double pi = std::numbers::pi;

// Metres. The sea's calm level is y = 0.
constexpr double sea_radius = 11;
constexpr double sea_floor = -1.8;
constexpr double plateau = 3.4; // height of the rock's flat top
constexpr vec3 tower_at{-1.3, plateau - 0.15, -0.9};
constexpr double tower_height = 12.4;

struct palette_of_materials {
    std::size_t tower, rock, water, wood, roof, wall, door, railing, lantern, iron, lamp, red, plaster, foliage, dark;
};

palette_of_materials add_materials(scene& s) {
    const auto textured = [&](texture t, bool repeat = true, bool cut_out = false) {
        s.textures.push_back(std::move(t));
        const std::string name = s.textures.back().name;
        s.materials.push_back({name, {1, 1, 1, 1}, s.textures.size() - 1, repeat, cut_out});
        return s.materials.size() - 1;
    };
    const auto plain = [&](const char* name, std::array<double, 4> color) {
        s.materials.push_back({name, color, {}, true, false});
        return s.materials.size() - 1;
    };
    palette_of_materials m{};
    m.tower = textured(paint_tower());
    m.rock = textured(paint_rock());
    m.water = textured(paint_water());
    m.wood = textured(paint_wood());
    m.roof = textured(paint_roof());
    m.wall = textured(paint_wall());
    m.door = textured(paint_door(), false);
    m.railing = textured(paint_railing(), true, true);
    m.lantern = textured(paint_lantern(), true, true);
    m.iron = plain("iron", {0.05, 0.055, 0.07, 1});
    m.lamp = plain("lamp", {1.0, 0.72, 0.16, 1});
    m.red = plain("red paint", {0.50, 0.035, 0.03, 1});
    m.plaster = plain("plaster", {0.84, 0.80, 0.72, 1});
    m.foliage = plain("foliage", {1, 1, 1, 1});
    m.dark = plain("window", {0.03, 0.06, 0.11, 1});
    return m;
}

// Radius of the rock where it meets the sea, by direction.
double shore(double angle) {
    const vec3 p{std::sin(angle) * 1.3, 4.2, std::cos(angle) * 1.3};
    return 7.0 + 1.3 * rough_noise(p) + 0.6 * std::sin(angle * 2 + 0.6);
}

// Height of the rock's top before its roughness; the cliff falls from the edge of the plateau to below the sea.
mesh make_rock() {
    mesh m;
    constexpr rgba grass{96, 132, 52, 255}, dry_grass{146, 146, 70, 255}, sand{190, 166, 122, 255};
    constexpr rgba stone{138, 128, 118, 255}, pale_stone{176, 164, 148, 255}, wet{62, 60, 56, 255};
    m.add_patch(128, 44, [&](double u, double v) {
        const double angle = 2 * pi * u;
        // From the shore's foot (v = 0) up the cliff to the middle of the top (v = 1).
        constexpr double cliff = 0.55;
        const double outer = shore(angle);
        const double up = std::min(v / cliff, 1.0);
        const double edge = outer - 1.5; // radius of the plateau's edge
        double r = v < cliff ? outer + 0.9 * (1 - up) * (1 - up) - (outer - edge) * up : edge * (1 - v) / (1 - cliff);
        double y = v < cliff ? -1.5 + (plateau + 1.5) * up : plateau;
        // The cliff stands in uneven layers.
        const double rough = rough_noise({r * std::sin(angle) * 0.9, y * 0.9, r * std::cos(angle) * 0.9});
        if (v < cliff) {
            const double layer = y * 1.7 + 1.2 * rough;
            const double step = layer - std::floor(layer);
            r += 0.55 * rough + 0.30 * (step - 0.5);
        } else {
            const double inside = 1 - r / edge; // 0 at the edge
            y += 0.35 * rough * std::min(1.0, inside * 4) + 0.25 * std::sin(std::min(inside, 0.5) * pi);
        }
        const vec3 p{r * std::sin(angle), y, r * std::cos(angle)};
        rgba c = mix(stone, pale_stone, 0.5 + 0.9 * rough);
        if (y < 0.9) c = mix(wet, c, (y - 0.1) / 0.8);
        if (v > cliff - 0.05) {
            const rgba meadow = mix(grass, dry_grass, 0.4 + 1.3 * noise({p.x * 0.8, 3, p.z * 0.8}));
            c = mix(c, meadow, (v - cliff + 0.05) / 0.06 + 0.8 * rough);
            // A sandy path from the tower's door past the house to the jetty.
            const double path = std::abs(p.x - (-1.3 + 1.9 * std::sin(p.z * 0.42)));
            if (p.z > 0.6) c = mix(sand, c, (path - 0.45) / 0.25);
        }
        return vertex{p, {p.x * 0.22 + p.z * 0.05, (p.z - p.y) * 0.22}, c};
    });
    return m;
}

double wave_height(double x, double z) {
    return 0.10 * std::sin(x * 1.15 + 0.6 * z) + 0.08 * std::sin(z * 1.7 - 0.5 * x + 1) +
           0.10 * rough_noise({x * 0.8, 9, z * 0.8});
}

mesh make_sea() {
    mesh m;
    constexpr rgba deep{18, 66, 104, 255}, shallow{52, 150, 164, 255}, foam{242, 250, 250, 255};
    constexpr rgba floor_color{12, 42, 72, 255};
    constexpr int around = 128;
    m.add_patch(around, 40, [&](double u, double v) {
        const double angle = 2 * pi * u;
        const double r = sea_radius * (1 - v) + 4.5 * v; // ends inside the rock
        const double x = r * std::sin(angle), z = r * std::cos(angle);
        const double from_shore = r - shore(angle);
        const double y = wave_height(x, z);
        rgba c = mix(shallow, deep, from_shore / 2.6);
        const double surf = from_shore - 0.75 - 0.45 * noise({x * 1.6, 1, z * 1.6});
        if (surf < 0) c = mix(c, foam, 0.5 - 2 * surf);
        if (std::abs(from_shore - 1.75 - 0.5 * noise({x * 1.1, 2, z * 1.1})) < 0.10) c = mix(c, foam, 0.75);
        c = mix(c, foam, (y - 0.16) * 5);
        return vertex{{x, y, z}, {x * 0.25, z * 0.25}, c};
    });
    m.add_patch(around, 4, [&](double u, double v) { // the side, as if cut out of the sea
        const double angle = 2 * pi * u;
        const double x = sea_radius * std::sin(angle), z = sea_radius * std::cos(angle);
        const double top = wave_height(x, z);
        return vertex{{x, sea_floor + (top - sea_floor) * v, z}, {u * 16, 1 - v}, mix(floor_color, deep, v)};
    });
    m.add_patch(around, 1, [&](double u, double v) {
        const double angle = 2 * pi * u;
        return vertex{
            {v * sea_radius * std::sin(angle), sea_floor, v * sea_radius * std::cos(angle)}, {u, v}, floor_color};
    });
    return m;
}

// A point on a circle about the y axis; angle 0 looks along +z.
vec3 around(double radius, double angle, double y) { return {radius * std::sin(angle), y, radius * std::cos(angle)}; }

double tower_radius(double y) { // slender upwards, with a flared foot
    const double t = y / tower_height;
    return 2.25 - 0.85 * t + 0.55 * std::pow(std::max(0.0, 1 - y / 2.2), 2);
}

std::vector<part> make_tower(const palette_of_materials& m) {
    part shaft{{}, m.tower}, windows{{}, m.dark}, frames{{}, m.plaster}, door{{}, m.door}, steps{{}, m.rock};
    shaft.triangles.add_patch(72, 32, [](double u, double v) {
        const double y = v * tower_height;
        return vertex{around(tower_radius(y), 2 * pi * u, y), {u, 1 - v}, white};
    });
    // Windows wind up the shaft; frame and pane stand a little out of the wall.
    for (int n = 0; n < 5; ++n) {
        const double angle = 0.5 + 1.15 * n, y = 3.6 + 1.75 * n;
        const double r = tower_radius(y);
        const auto pane = [&](mesh& to, double width, double height, double out) {
            const double half = width / r;
            const vec3 a = around(r + out, angle - half, y - height), b = around(r + out, angle + half, y - height);
            const vec3 c = around(r + out - 0.06, angle + half, y + height);
            const vec3 d = around(r + out - 0.06, angle - half, y + height);
            to.add_quad(a, b, c, d);
            const auto inwards = [&](vec3 p) { return p * 0.8 + vec3{0, p.y * 0.2, 0}; };
            to.add_quad(b, inwards(b), inwards(c), c);
            to.add_quad(inwards(a), a, d, inwards(d));
            to.add_quad(d, c, inwards(c), inwards(d));
            to.add_quad(inwards(a), inwards(b), b, a);
        };
        pane(frames.triangles, 0.40, 0.62, 0.09);
        pane(windows.triangles, 0.27, 0.47, 0.14);
    }
    // The door looks along +z, in a porch of plaster with steps before it.
    frames.triangles.add_box({-0.85, 0, 1.6}, {0.85, 2.35, 2.95}, 1);
    frames.triangles.add_box({-1.0, 2.35, 1.5}, {1.0, 2.55, 3.25}, 1);
    door.triangles.add_box({-0.55, 0.15, 2.9}, {0.55, 2.1, 3.05});
    door.triangles.add_quad({-0.55, 0.15, 3.06}, {0.55, 0.15, 3.06}, {0.55, 2.1, 3.06}, {-0.55, 2.1, 3.06});
    for (int n = 0; n < 3; ++n)
        steps.triangles.add_box({-0.95 - 0.1 * n, -0.4, 2.9}, {0.95 + 0.1 * n, 0.16 - 0.14 * n, 3.3 + 0.3 * n}, 0.4,
                                {206, 198, 186, 255});
    return {shaft, frames, windows, door, steps};
}

std::vector<part> make_gallery(const palette_of_materials& m) {
    part deck{{}, m.plaster}, railing{{}, m.railing}, corbels{{}, m.plaster};
    const std::array<vec2, 5> profile{{{1.40, -0.75}, {1.62, -0.35}, {2.20, -0.10}, {2.20, 0.14}, {0.9, 0.14}}};
    deck.triangles.add_lathe(profile, 72);
    for (int n = 0; n < 12; ++n) { // brackets under the deck
        const double angle = 2 * pi * n / 12;
        const auto side = [&](double turn) {
            return std::array<vec3, 3>{around(1.35, angle + turn, -1.0), around(2.0, angle + turn * 0.7, -0.12),
                                       around(1.35, angle + turn, -0.12)};
        };
        const auto left = side(-0.07), right = side(0.07);
        corbels.triangles.add_quad(left[0], right[0], right[1], left[1]);
        corbels.triangles.add_quad(right[0], right[2], right[1], right[1]);
        corbels.triangles.add_quad(left[0], left[1], left[2], left[2]);
    }
    railing.triangles.add_patch(96, 1, [](double u, double v) {
        return vertex{around(2.10, 2 * pi * u, 0.12 + 0.95 * v), {u * 22, 1 - v}, white};
    });
    return {deck, corbels, railing};
}

std::vector<part> make_lantern(const palette_of_materials& m) {
    part base{{}, m.plaster}, frame{{}, m.lantern}, lamp{{}, m.lamp}, roof{{}, m.red}, iron{{}, m.iron};
    const std::array<vec2, 4> drum{{{1.16, 0.0}, {1.16, 0.55}, {1.22, 0.60}, {0.0, 0.62}}};
    base.triangles.add_lathe(drum, 48);
    frame.triangles.add_patch(48, 1, [](double u, double v) {
        return vertex{around(1.10, 2 * pi * u, 0.6 + 1.7 * v), {u * 6, 1 - v}, white};
    });
    // The lens: a stack of rings, as Fresnel built them.
    lamp.triangles.add_patch(40, 24, [](double u, double v) {
        const double bulge = 0.46 + 0.34 * std::sin(pi * v) + 0.05 * std::cos(v * 14 * pi);
        const double r = v <= 0 || v >= 1 ? 0.0 : bulge;
        return vertex{around(r, 2 * pi * u, 0.75 + 1.35 * v), {u, v}, white};
    });
    roof.triangles.add_patch(64, 16, [](double u, double v) { // a dome with a wide brim
        const double r = v < 0.08 ? 1.42 - v / 0.08 * 0.06 : 1.36 * std::cos((v - 0.08) / 0.92 * pi / 2);
        const double y = v < 0.08 ? 2.24 + v / 0.08 * 0.14 : 2.38 + 1.05 * std::sin((v - 0.08) / 0.92 * pi / 2);
        return vertex{around(std::max(r, 0.0), 2 * pi * u, y), {u, v}, white};
    });
    const std::array<vec2, 2> under{{{0.0, 2.26}, {1.42, 2.24}}};
    roof.triangles.add_lathe(under, 64);
    iron.triangles.add_patch(24, 14, [](double u, double v) { // ball and lightning rod
        const double r = v < 0.7 ? 0.24 * std::sin(v / 0.7 * pi * 0.92) : 0.06 * (1 - (v - 0.7) / 0.3);
        const double y = v < 0.7 ? 3.60 - 0.24 * std::cos(v / 0.7 * pi * 0.92) : 3.84 + (v - 0.7) / 0.3 * 1.1;
        return vertex{around(r, 2 * pi * u, y), {u, v}, white};
    });
    return {base, frame, lamp, roof, iron};
}

std::vector<part> make_house(const palette_of_materials& m) {
    part walls{{}, m.wall}, gables{{}, m.plaster}, roof{{}, m.roof}, door{{}, m.door}, chimney{{}, m.rock};
    constexpr double w = 1.9, d = 1.35, h = 1.75, ridge = 3.05; // half width, half depth, wall, ridge
    const auto wall = [&](vec3 from, vec3 to, double windows) {
        walls.triangles.add_patch(8, 4, [&](double u, double v) {
            const vec3 p = from * (1 - u) + to * u;
            return vertex{{p.x, h * v, p.z}, {u * windows, 1 - v}, white};
        });
    };
    wall({-w, 0, d}, {w, 0, d}, 3);
    wall({w, 0, -d}, {-w, 0, -d}, 3);
    wall({w, 0, d}, {w, 0, -d}, 2);
    wall({-w, 0, -d}, {-w, 0, d}, 2);
    for (const double side : {-1.0, 1.0}) {
        const vec3 a{side * w, h, side * d}, b{side * w, h, -side * d}, top{side * w, ridge, 0};
        gables.triangles.add_quad(a, b, top, top);
    }
    const auto slope = [&](double side) { // two sheets, so that the eaves have some thickness
        constexpr double out = 0.28;
        const double low = h - out * (ridge - h) / d;
        const vec3 a{-side * (w + out), low, side * (d + out)}, b{side * (w + out), low, side * (d + out)};
        const vec3 c{side * (w + out), ridge, 0}, e{-side * (w + out), ridge, 0};
        const vec3 up{0, 0.16, 0};
        const auto sheet = [&](vec3 p, vec3 q, vec3 r, vec3 s) {
            roof.triangles.add_patch(8, 8, [&](double u, double v) {
                return vertex{(p * (1 - u) + q * u) * (1 - v) + (s * (1 - u) + r * u) * v, {u * 4, (1 - v) * 2}, white};
            });
        };
        sheet(a + up, b + up, c + up, e + up);
        roof.triangles.add_quad(b, a, e, c);
        roof.triangles.add_quad(a, b, b + up, a + up);
        roof.triangles.add_quad(b, c, c + up, b + up);
        roof.triangles.add_quad(e, a, a + up, e + up);
    };
    slope(1);
    slope(-1);
    door.triangles.add_box({-0.34, 0, d - 0.1}, {0.34, 0, d + 0.05});
    door.triangles.add_quad({-0.36, 0.02, d + 0.06}, {0.36, 0.02, d + 0.06}, {0.36, 1.4, d + 0.06},
                            {-0.36, 1.4, d + 0.06});
    gables.triangles.add_box({-0.46, 0, d - 0.1}, {-0.36, 1.5, d + 0.08});
    gables.triangles.add_box({0.36, 0, d - 0.1}, {0.46, 1.5, d + 0.08});
    gables.triangles.add_box({-0.46, 1.4, d - 0.1}, {0.46, 1.5, d + 0.1});
    chimney.triangles.add_box({0.85, 2.0, -0.75}, {1.35, 3.75, -0.25}, 0.6, {198, 120, 96, 255});
    chimney.triangles.add_box({0.78, 3.65, -0.82}, {1.42, 3.85, -0.18}, 0.6, {150, 90, 74, 255});
    return {walls, gables, roof, door, chimney};
}

std::vector<part> make_pine(const palette_of_materials& m) {
    part tree{{}, m.foliage};
    constexpr rgba bark{74, 48, 30, 255}, dark{24, 58, 30, 255}, light{62, 112, 44, 255};
    const std::array<vec2, 2> trunk{{{0.13, -0.3}, {0.09, 0.9}}};
    tree.triangles.add_lathe(trunk, 12, 1, 0, 1, bark);
    for (int tier = 0; tier < 4; ++tier) {
        const double low = 0.45 + 0.52 * tier, radius = 0.86 - 0.18 * tier;
        tree.triangles.add_patch(24, 5, [&](double u, double v) {
            const double jag = 1 + 0.14 * std::sin(2 * pi * u * 9 + tier) * (1 - v); // drooping branches
            const double r = radius * std::pow(1 - v, 0.8) * jag;
            const double y = low + 0.95 * v - 0.10 * (jag - 1) / 0.14 * (1 - v);
            return vertex{around(r, 2 * pi * u, y), {u, v}, mix(dark, light, 0.25 + 0.5 * v + 2 * (jag - 1))};
        });
        const std::array<vec2, 2> under{{{0.0, low + 0.15}, {radius * 0.95, low}}};
        tree.triangles.add_lathe(under, 24, 1, 0, 1, dark);
    }
    return {tree};
}

std::vector<part> make_jetty(const palette_of_materials& m) {
    part planks{{}, m.wood};
    constexpr rgba aged{226, 216, 204, 255};
    for (int n = 0; n < 13; ++n) // boards lie across, with gaps
        planks.triangles.add_box({-0.75, 0.66, 0.36 * n}, {0.75, 0.78, 0.36 * n + 0.29}, 0.7, aged);
    for (const double x : {-0.62, 0.62}) {
        planks.triangles.add_box({x - 0.07, 0.50, 0}, {x + 0.07, 0.66, 4.6}, 0.5, aged);
        for (int n = 0; n < 4; ++n) {
            const std::array<vec2, 3> post{{{0.12, -1.75}, {0.12, 1.05}, {0.0, 1.10}}};
            mesh pole;
            pole.add_lathe(post, 12, 1, 0, 3, {178, 160, 140, 255});
            for (auto& p : pole.positions) {
                p[0] += static_cast<float>(x);
                p[2] += static_cast<float>(0.25 + 1.375 * n);
            }
            const auto base = static_cast<std::uint32_t>(planks.triangles.positions.size());
            mesh& to = planks.triangles;
            to.positions.insert(to.positions.end(), pole.positions.begin(), pole.positions.end());
            to.normals.insert(to.normals.end(), pole.normals.begin(), pole.normals.end());
            to.uvs.insert(to.uvs.end(), pole.uvs.begin(), pole.uvs.end());
            to.colors.insert(to.colors.end(), pole.colors.begin(), pole.colors.end());
            for (const std::uint32_t i : pole.indices) to.indices.push_back(base + i);
        }
    }
    return {planks};
}

std::vector<part> make_boat(const palette_of_materials& m) {
    part hull{{}, m.wood}, rim{{}, m.red};
    // A hull of ribs: at u along the boat, v from one gunwale under the keel to the other.
    const auto rib = [](double u, double v, double inset) {
        const double along = 2 * u - 1;
        const double half = (0.62 - inset) * std::sqrt(std::max(0.0, 1 - along * along * along * along));
        const double angle = pi * (v - 0.5);
        const double rise = 0.22 * along * along; // bow and stern stand higher
        return vec3{half * std::sin(angle), 0.42 + rise - (0.55 - inset) * std::cos(angle), 1.55 * along};
    };
    hull.triangles.add_patch(28, 16, [&](double u, double v) {
        return vertex{rib(u, 1 - v, 0), {u * 2, v * 2}, {236, 240, 244, 255}};
    });
    hull.triangles.add_patch(28, 16, [&](double u, double v) {
        return vertex{rib(u, v, 0.07), {u * 2, v * 2}, white};
    });
    for (const double side : {0.0, 1.0})
        rim.triangles.add_patch(28, 1, [&](double u, double v) {
            const double inset = side == 0 ? 0.10 * v - 0.03 : 0.10 * (1 - v) - 0.03;
            const vec3 p = rib(u, side, inset);
            return vertex{{p.x, p.y + 0.03, p.z}, {u, v}, white};
        });
    for (const double z : {-0.6, 0.35}) hull.triangles.add_box({-0.5, 0.30, z}, {0.5, 0.36, z + 0.25}, 1);
    return {hull, rim};
}

std::vector<part> make_gull(const palette_of_materials& m) {
    part bird{{}, m.foliage};
    constexpr rgba feather{246, 246, 244, 255}, tip{58, 62, 70, 255}, bill{238, 170, 52, 255};
    bird.triangles.add_patch(16, 12, [&](double u, double v) { // body along +z
        const double r = 0.13 * std::sin(pi * v) * (1.15 - 0.4 * v);
        const vec3 ring = around(r, 2 * pi * u, 0);
        return vertex{{ring.x, ring.z, 0.55 * v - 0.3}, {u, v}, v > 0.93 ? bill : feather};
    });
    for (const double side : {-1.0, 1.0})
        for (const double face : {-1.0, 1.0})
            bird.triangles.add_patch(12, 2, [&](double u, double v) {
                const double span = 0.95 * u, chord = 0.24 * (1 - 0.75 * u * u);
                const double lift = 0.22 * std::sin(u * 2.2) + face * 0.02 * (1 - u);
                const double across = (side * face > 0 ? v : 1 - v) - 0.5;
                return vertex{
                    {side * span, lift, across * chord - 0.12 * u * u}, {u, v}, mix(feather, tip, (u - 0.72) * 5)};
            });
    return {bird};
}

std::vector<part> make_boulder(const palette_of_materials& m) {
    part rock{{}, m.rock};
    rock.triangles.add_patch(24, 14, [](double u, double v) {
        const double polar = pi * (v - 0.5);
        const vec3 unit{std::cos(polar) * std::sin(2 * pi * u), std::sin(polar),
                        std::cos(polar) * std::cos(2 * pi * u)};
        const vec3 p = unit * (1 + 0.5 * rough_noise(unit * 1.4));
        return vertex{{p.x, p.y * 0.75, p.z},
                      {p.x * 0.3 + p.y * 0.1, p.z * 0.3},
                      mix({66, 62, 58, 255}, {150, 140, 128, 255}, p.y + 0.5)};
    });
    return {rock};
}

} // namespace

scene make_lighthouse() {
    scene s;
    const palette_of_materials m = add_materials(s);
    const auto add_mesh = [&](const char* name, std::vector<part> parts) {
        s.meshes.push_back({name, std::move(parts)});
        return s.meshes.size() - 1;
    };
    s.nodes.push_back({"lighthouse", {}, 0, 1, {}, {}});
    const auto place = [&](std::size_t parent, const char* name, std::size_t mesh, vec3 at, double turn = 0,
                           double scale = 1) {
        s.nodes.push_back({name, at, turn, scale, mesh, {}});
        s.nodes[parent].children.push_back(s.nodes.size() - 1);
        return s.nodes.size() - 1;
    };
    place(0, "sea", add_mesh("sea", {{make_sea(), m.water}}), {});
    place(0, "rock", add_mesh("rock", {{make_rock(), m.rock}}), {});
    const std::size_t tower = place(0, "tower", add_mesh("tower", make_tower(m)), tower_at, 18);
    const std::size_t gallery =
        place(tower, "gallery", add_mesh("gallery", make_gallery(m)), {0, tower_height + 0.1, 0});
    place(gallery, "lantern room", add_mesh("lantern room", make_lantern(m)), {0, 0.14, 0});
    place(0, "house", add_mesh("house", make_house(m)), {2.6, plateau - 0.05, 0.4}, -24);
    place(0, "jetty", add_mesh("jetty", make_jetty(m)), {-2.6, 0, 5.4}, -8);
    place(0, "boat", add_mesh("boat", make_boat(m)), {0.6, 0.12, 8.6}, 62);

    const std::size_t pine = add_mesh("pine", make_pine(m));
    constexpr std::array<std::array<double, 4>, 7> pines{{{4.3, -1.9, 1.15, 20},
                                                          {3.0, -3.3, 1.35, 75},
                                                          {1.3, -4.0, 1.0, 130},
                                                          {4.6, 2.1, 0.85, 210},
                                                          {-3.9, -2.9, 0.95, 250},
                                                          {-4.4, 0.6, 0.75, 300},
                                                          {2.1, -2.2, 0.8, 340}}};
    for (const auto& [x, z, scale, turn] : pines) place(0, "pine", pine, {x, plateau + 0.15, z}, turn, scale);

    const std::size_t boulder = add_mesh("boulder", make_boulder(m));
    constexpr std::array<std::array<double, 5>, 7> boulders{{{8.4, 0.05, 3.2, 0.85, 30},
                                                             {7.2, 0.0, 5.6, 0.55, 100},
                                                             {-8.6, 0.0, -2.6, 0.75, 160},
                                                             {-7.8, 0.0, 3.9, 0.45, 220},
                                                             {3.6, 0.0, 8.0, 0.6, 280},
                                                             {9.3, -0.1, -0.4, 0.4, 320},
                                                             {-0.8, plateau + 0.3, 3.0, 0.3, 10}}};
    for (const auto& [x, y, z, scale, turn] : boulders) place(0, "boulder", boulder, {x, y, z}, turn, scale);

    const std::size_t gull = add_mesh("gull", make_gull(m));
    constexpr std::array<std::array<double, 5>, 4> gulls{{{6.6, 12.2, 0.8, 1.3, 40},
                                                          {-5.6, 14.2, 2.4, 1.15, 100},
                                                          {3.4, 16.4, -2.6, 1.0, 200},
                                                          {6.6, 8.6, -2.2, 1.1, 320}}};
    for (const auto& [x, y, z, scale, turn] : gulls) place(0, "gull", gull, {x, y, z}, turn, scale);
    return s;
}

} // namespace demo_model
