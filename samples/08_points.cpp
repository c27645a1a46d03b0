// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A scan: turning lasers on two tripods and a mast hit ground, a house and trees half a million times, more in a fine
// picture. The points become counts and mean colours of voxels, in one pass (scan.ppm).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct measured {
    glm::vec3 color;
};
struct scanner {
    VOXELPIPE_HD auto operator()(const vp::vertex<glm::vec3>& v) const {
        return vp::vertex_output{v.position, measured{vp::get<0>(v)}};
    }
};
struct collect {
    VOXELPIPE_HD auto operator()(const vp::fragment<measured>& f) const { return vp::outputs(1u, f.varyings.color); }
};

// The nearest hit of a ray with the scene, and its colour; false if it meets nothing.
bool hit(const glm::vec3& from, const glm::vec3& along, glm::vec3& at, glm::vec3& color) {
    float nearest = 150.0f;
    const auto take = [&](float t, const glm::vec3& c) {
        if (t > 0.5f && t < nearest) {
            nearest = t;
            color = c;
        }
    };
    take(-(from.y - 4.0f) / along.y, glm::vec3(0.42f, 0.55f, 0.30f)); // ground
    const glm::vec3 low(70, 4, 25), high(108, 34, 62);                // a house
    const glm::vec3 t0 = (low - from) / along, t1 = (high - from) / along;
    const glm::vec3 first = glm::min(t0, t1), last = glm::max(t0, t1);
    const float enter = std::max({first.x, first.y, first.z});
    if (enter < std::min({last.x, last.y, last.z})) {
        const glm::vec3 p = from + enter * along;
        const bool is_window = std::fmod(p.y, 14.0f) > 8.0f && std::fmod(p.x + p.z, 11.0f) > 6.0f;
        take(enter, is_window ? glm::vec3(0.30f, 0.36f, 0.48f) : glm::vec3(0.85f, 0.72f, 0.58f));
    }
    for (int i = 0; i < 7; ++i) { // trees
        const glm::vec3 center(18.0f + 15.0f * static_cast<float>(i % 3), 22.0f + 2.0f * static_cast<float>(i % 4),
                               20.0f + 14.0f * static_cast<float>(i));
        const glm::vec3 to = center - from;
        const float b = glm::dot(to, along), d = b * b - glm::dot(to, to) + 64.0f;
        if (d > 0.0f) take(b - std::sqrt(d), glm::vec3(0.20f, 0.42f, 0.18f));
        const glm::vec2 flat(along.x, along.z), trunk(to.x, to.z);
        const float along_flat = glm::dot(trunk, flat) / glm::dot(flat, flat);
        if (glm::length(trunk - along_flat * flat) < 1.6f && (from + along_flat * along).y < center.y)
            take(along_flat, glm::vec3(0.38f, 0.27f, 0.18f));
    }
    at = from + nearest * along;
    return nearest < 150.0f;
}

int main() {
    std::vector<glm::vec3> positions, colors;
    unsigned noise = 1;
    const int finer = picture::is_fine() ? 3 : 1, rows = 240 * finer, steps = 1000 * finer;
    for (const glm::vec3& laser : {glm::vec3(62, 14, 96), glm::vec3(52, 12, 40), glm::vec3(112, 60, 84)})
        for (int row = 0; row < rows; ++row)
            for (int step = 0; step < steps; ++step) {
                const float a = 6.28318531f * static_cast<float>(step) / static_cast<float>(steps),
                            e = -1.2f + 1.9f * static_cast<float>(row) / static_cast<float>(rows);
                const glm::vec3 along(std::cos(e) * std::cos(a), std::sin(e) + 1e-4f, std::cos(e) * std::sin(a));
                glm::vec3 at, color;
                if (!hit(laser, along, at, color)) continue;
                glm::vec3 error;
                for (int k = 0; k < 3; ++k)
                    error[k] = static_cast<float>((noise = noise * 1664525u + 1013904223u) >> 8) * 0x1p-24f - 0.5f;
                positions.push_back(at + 0.6f * error);
                colors.push_back(color);
            }

    vp::cpu_backend backend;
    // snippet: points
    const vp::points_view<glm::vec3> points{.positions = positions,
                                            .attributes = vp::core::make_pack(vp::array_view<const glm::vec3>(colors))};
    vp::grid grid;
    grid.extent = {128, 48, 128};
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, vp::blend::count>, vp::target<glm::vec3, vp::blend::add>>
        fb{backend, grid.extent};
    const vp::status s = vp::voxelize(backend, points, grid, scanner{}, collect{}, fb, vp::coverage::thin).or_throw();
    // end snippet
    const auto counts = vp::get<0>(fb).to_host_target(backend);
    const auto sums = vp::get<1>(fb).to_host_target(backend);
    picture::write("scan.ppm", grid.extent,
                   [&](int x, int y, int z) {
                       const std::uint32_t n = counts(x, y, z);
                       return n == 0 ? glm::vec3(-1.0f) : sums(x, y, z) / static_cast<float>(n);
                   },
                   {.along = {-0.55f, -0.62f, -1.0f}, .zoom = 1.55f});
    std::printf("%zu points, %llu of them in %llu voxels\n", positions.size(),
                static_cast<unsigned long long>(s.counts.fragments), static_cast<unsigned long long>(s.counts.voxels));
    return s.counts.triangles_in == positions.size() && s.counts.voxels > 10000 ? 0 : 1;
}
