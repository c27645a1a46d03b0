// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A model's file as a scene. Parts of it that are closed are filled, the others are sheets.

#include "closed_parts.hpp"
#include "parts.hpp"

#include "read/model_file.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gi {
namespace {

void append_instance(scene& s, const voxelize::primitive& p, const voxelize::affine& to_world) {
    const auto first = static_cast<std::uint32_t>(s.positions.size());
    for (std::size_t i = 0; i < p.positions.size(); ++i) {
        s.positions.emplace_back(to_world(glm::dvec3(p.positions[i])));
        s.texcoords.push_back(p.texcoords.empty() ? glm::vec2(0.0f) : p.texcoords[i]);
        s.colors.push_back(p.colors.empty() ? glm::vec3(1.0f) : glm::vec3(p.colors[i]));
    }
    // Vertices are split in a file where its normals are, so means by area are smooth where the model is.
    std::vector<glm::dvec3> sums(p.positions.size(), glm::dvec3(0.0));
    const bool mirrors = to_world.mirrors();
    for (glm::uvec3 t : p.triangles) {
        if (mirrors) std::swap(t.y, t.z);
        const auto at = [&](std::uint32_t i) { return glm::dvec3(s.positions[first + i]); };
        const glm::dvec3 area = glm::cross(at(t.y) - at(t.x), at(t.z) - at(t.x));
        if (!(glm::length(area) > 0)) continue; // also what is not finite
        for (int c = 0; c < 3; ++c) sums[t[c]] += area;
        s.triangles.push_back(t + first);
        s.triangle_materials.push_back(p.material);
    }
    for (const glm::dvec3& sum : sums)
        s.normals.push_back(glm::length(sum) > 0 ? glm::vec3(glm::normalize(sum)) : glm::vec3(0, 1, 0));
}

} // namespace

scene load_scene(const std::filesystem::path& file) {
    voxelize::load_options options;
    options.gltf.shading = true;
    voxelize::scene model = voxelize::load_model(file, options);
    scene loaded;
    for (const voxelize::instance& shown : model.instances)
        append_instance(loaded, model.primitives[shown.primitive], shown.to_world);
    if (loaded.triangles.empty()) throw voxelize::model_error("there are no triangles with an area");
    glm::dvec3 low(1e300), high(-1e300);
    for (const glm::uvec3& t : loaded.triangles)
        for (int c = 0; c < 3; ++c) {
            low = glm::min(low, glm::dvec3(loaded.positions[t[c]]));
            high = glm::max(high, glm::dvec3(loaded.positions[t[c]]));
        }
    const glm::dvec3 size = high - low, centre = 0.5 * (low + high);
    const double across = std::max(size.x, size.z), round = std::max({size.x, size.y, size.z});
    double widest = 0; // distance of a vertex from the vertical line through the middle
    for (const glm::uvec3& t : loaded.triangles)
        for (int c = 0; c < 3; ++c) {
            const glm::vec3& p = loaded.positions[t[c]];
            widest =
                std::max(widest, std::hypot(static_cast<double>(p.x) - centre.x, static_cast<double>(p.z) - centre.z));
        }
    if (!(round > 0) || !std::isfinite(round)) throw voxelize::model_error("the model has no extent");

    // The stage first: closed parts, of a size that suits the model; then the model's triangles behind them.
    scene_builder b;
    mesh ground;
    const double reach = std::max(0.5 * across, widest) + 0.35 * round;
    ground.add_lathe(std::vector<demo_model::vec2>{{0, -0.08}, {1, -0.08}, {1, 0}, {0, 0}}, 64);
    const auto scaled = [](mesh m, double by, const glm::dvec3& to) {
        for (auto& p : m.positions)
            for (int a = 0; a < 3; ++a)
                p[static_cast<std::size_t>(a)] =
                    static_cast<float>(static_cast<double>(p[static_cast<std::size_t>(a)]) * by + to[a]);
        return m;
    };
    b.add(scaled(ground, reach, {centre.x, low.y, centre.z}), {.color = glm::vec3(0.62f), .roughness = 0.4f});
    // Unit size, so that the lattice of shapes is fine enough; around the origin, where `motion` puts it.
    b.add(scaled(make_ball(1.0, 16), 0.04 * round, {}), {.color = glm::vec3(0.0f), .emission = {36.0f, 17.0f, 5.0f}},
          part_kind::moving);
    scene s = b.finish();

    const auto vertices = static_cast<std::uint32_t>(s.positions.size());
    const auto looks = static_cast<std::uint32_t>(s.materials.size());
    s.positions.insert(s.positions.end(), loaded.positions.begin(), loaded.positions.end());
    s.normals.insert(s.normals.end(), loaded.normals.begin(), loaded.normals.end());
    s.colors.insert(s.colors.end(), loaded.colors.begin(), loaded.colors.end());
    s.texcoords.insert(s.texcoords.end(), loaded.texcoords.begin(), loaded.texcoords.end());
    const std::vector<bool> closed = find_closed(loaded.positions, loaded.triangles);
    for (const bool wanted : {true, false}) { // closed parts follow those of the stage
        for (std::size_t i = 0; i < loaded.triangles.size(); ++i) {
            if (closed[i] != wanted) continue;
            s.triangles.push_back(loaded.triangles[i] + vertices);
            s.triangle_materials.push_back(looks + 2 * loaded.triangle_materials[i] + (wanted ? 0 : 1));
        }
        if (wanted) s.num_closed = s.triangles.size();
    }
    for (const voxelize::material& m : model.materials) {
        const material look{.color = glm::vec3(m.base_color),
                            .emission = m.emission,
                            .roughness = m.roughness,
                            .metallic = m.metallic,
                            .texture = m.texture,
                            .roughness_texture = m.roughness_texture,
                            .emission_texture = m.emission_texture,
                            .cutoff = m.alpha == voxelize::alpha_mode::mask ? m.alpha_cutoff : -1.0f};
        s.materials.push_back(look); // for closed parts, then for sheets
        s.materials.push_back(look);
        s.materials.back().density = 2.0f;
    }
    s.textures = std::move(model.textures);
    s.pictures = std::move(model.images);
    s.warnings = std::move(model.warnings);

    const double above = 0.12 * round;
    s.low = {centre.x - reach, low.y - 0.08 * reach, centre.z - reach};
    s.high = {centre.x + reach, high.y + above, centre.z + reach};
    set_sun(s, {0.55f, 1.0f, 0.65f}, 0.03f, {5.6f, 5.1f, 4.4f});
    s.sky_above = {0.55f, 0.75f, 1.1f};
    s.sky_level = {0.80f, 0.92f, 1.10f};
    s.exposure = 0.85f;
    s.motion = [=](double t) {
        // The ball stays outside of the model: its radius is 0.04 of the model's size.
        const double a = 2 * std::numbers::pi * t + 1.5, r = widest + 0.1 * round;
        return glm::dvec3(centre.x + r * std::sin(a), low.y + (0.3 + 0.2 * std::sin(2 * a)) * size.y + 0.05 * round,
                          centre.z + r * std::cos(a));
    };
    s.view = [=](double t) {
        const double a = 2 * std::numbers::pi * t + 0.5, r = 1.9 * round;
        return camera{centre + glm::dvec3(r * std::sin(a), 0.42 * round, r * std::cos(a)),
                      centre - glm::dvec3(0, 0.04 * round, 0), 42};
    };
    return s;
}

} // namespace gi
