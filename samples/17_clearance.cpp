// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Thickness and clearance of a part: a pin in a bushing whose bore is off its middle. Each gets a signed distance
// field; the largest ball in the wall and the least gap follow from the samples. The picture is a slice
// (clearance.ppm): the wall by its depth, the gap by its width, a line every unit.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct part {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    // A prism over a ring of n corners whose bore, if there is one, lies `off` to the right of its middle.
    part(unsigned n, const glm::vec2& middle, float outside, float bore, float off, float height) {
        for (unsigned i = 0; i < n; ++i)
            for (const auto& [r, y] : {std::pair{outside, 0.0f}, {outside, height}, {bore, height}, {bore, 0.0f}}) {
                const float a = 6.2831853f * static_cast<float>(i) / static_cast<float>(n);
                positions.emplace_back(middle.x + r * std::cos(a) + (r == bore ? off : 0.0f), y,
                                       middle.y + r * std::sin(a));
            }
        for (unsigned i = 0; i < n; ++i)
            for (unsigned k = 0; k < 4; ++k) { // around the profile: outside, top, bore, bottom
                const auto at = [&](unsigned j, unsigned m) { return j % n * 4 + m % 4; };
                triangles.emplace_back(at(i, k), at(i, k + 1), at(i + 1, k));
                triangles.emplace_back(at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
            }
    }
};

int main() {
    // The bushing: 40 outside, a bore of 26 that is 5 to the right. The pin: 22, half a unit below the bore's middle.
    const part bushing(256, {50, 50}, 40, 26, 5, 60), pin(256, {55, 50.5f}, 22, 0, 0, 60);
    const double gap = 26 - 22 - 0.5, wall = 40 + 5 - 26; // the least; the thickest, left of the bore

    // snippet: fields
    vp::cpu_backend backend;
    vp::grid grid;
    grid.origin = {0, 28, 0};
    grid.voxel_size = glm::dvec3(0.5);
    grid.extent = {200, 4, 200}; // some layers half way up
    using field = vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>>;
    const auto measure = [&](const part& p) {
        const vp::mesh mesh{backend, p.positions, p.triangles};
        field distances{backend, grid.extent};
        vp::voxelize_distance(backend, mesh, grid, vp::passthrough{}, vp::distance{}, distances, {.band = 24})
            .or_throw();
        return vp::get<0>(distances).to_host_target(backend);
    };
    const auto of_bushing = measure(bushing), of_pin = measure(pin);
    // end snippet

    float deepest = 0.0f, least = 1e30f;
    for (int z = 0; z < grid.extent.z; ++z)
        for (int y = 0; y < grid.extent.y; ++y)
            for (int x = 0; x < grid.extent.x; ++x) {
                const float a = of_bushing(x, y, z), b = of_pin(x, y, z);
                deepest = std::max(deepest, -a);
                if (a >= 0.0f && b >= 0.0f) least = std::min(least, a + b); // the segment between the two through it
            }

    const int slice = grid.extent.y / 2;
    const auto look = [&](float px, float py, const glm::vec2&) {
        const glm::vec2 p = glm::clamp(glm::vec2(px, py) * 200.0f - 0.5f, 0.0f, 198.99f), low = glm::floor(p);
        const auto at = [&](const auto& f) { // between the four samples around
            const int x = static_cast<int>(low.x), z = static_cast<int>(low.y);
            return glm::mix(glm::mix(f(x, slice, z), f(x + 1, slice, z), p.x - low.x),
                            glm::mix(f(x, slice, z + 1), f(x + 1, slice, z + 1), p.x - low.x), p.y - low.y);
        };
        const float a = at(of_bushing), b = at(of_pin), in = -std::min(a, b);
        const glm::vec3 cold(0.07f, 0.16f, 0.36f), warm(0.95f, 0.55f, 0.16f), air(0.86f, 0.88f, 0.90f);
        glm::vec3 c = air;
        if (a < 0.0f) c = glm::mix(cold, warm, glm::clamp(in / 9.5f, 0.0f, 1.0f)); // the wall, by its depth
        if (b < 0.0f) c = glm::vec3(0.42f, 0.45f, 0.48f);
        const bool is_gap = a >= 0.0f && b >= 0.0f && a + b < 10.0f;
        if (is_gap) c = glm::mix(glm::vec3(0.80f, 0.10f, 0.10f), glm::vec3(0.55f, 0.80f, 0.45f), (a + b - 3.0f) / 2.0f);
        const float away = std::abs(a), line = std::abs(away - std::round(away));
        if (b >= 0.0f && !is_gap && away < 11.5f && line < 0.12f) c *= 0.72f;
        if (away < 0.35f || std::abs(b) < 0.35f) c = glm::vec3(0.02f);
        return c;
    };
    picture::write_pixels("clearance.ppm", 1.0f, look);

    std::printf("least gap %.3f, exact %.3f; thickest wall %.3f, exact %.3f\n", static_cast<double>(least), gap,
                2.0 * static_cast<double>(deepest), wall);
    return std::abs(static_cast<double>(least) - gap) < 0.05 &&
                   std::abs(2.0 * static_cast<double>(deepest) - wall) < 0.5
               ? 0
               : 1;
}
