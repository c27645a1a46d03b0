// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A layer for a printer: how much of each pixel a gear covers, beside the staircase of pixels whose centres it covers.
// Grey levels are the fractions of cut voxels, so their sum is the gear's volume up to the rounding to float. The
// picture has both (grey_slice.ppm). As files: voxelize gear.stl -t fraction -o slices/{z}.png
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

namespace {

constexpr float full_turn = 6.2831853f;

// A gear of straight teeth with a bore and six holes around it, closed: the outline, the bore and the holes as walls,
// each with the lids that it adds to or takes away from.
struct gear {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    double area = 0.0; // of a section

    gear(const glm::vec2& middle, float radius, float height) {
        constexpr unsigned teeth = 17, steps = 16;
        wall(middle, teeth * steps, height, 1.0f, [&](float a) {
            const float tooth = glm::clamp(2.6f * std::cos(a * static_cast<float>(teeth)), -1.0f, 1.0f);
            return radius * (1.0f + 0.12f * tooth);
        });
        wall(middle, 96, height, -1.0f, [&](float) { return 0.24f * radius; });
        for (int i = 0; i < 6; ++i) {
            const float a = full_turn * static_cast<float>(i) / 6.0f;
            wall(middle + 0.55f * radius * glm::vec2(std::cos(a), std::sin(a)), 48, height, -1.0f,
                 [&](float) { return 0.13f * radius; });
        }
    }

private:
    // A prism around the middle, star-shaped; sign -1: what it holds is taken away.
    template <class Radius>
    void wall(const glm::vec2& middle, unsigned n, float height, float sign, const Radius& radius) {
        const auto first = static_cast<unsigned>(positions.size());
        for (unsigned i = 0; i < n; ++i) {
            const float a = full_turn * static_cast<float>(i) / static_cast<float>(n), r = radius(a);
            for (const float z : {0.0f, height})
                positions.emplace_back(middle.x + r * std::cos(a), middle.y + r * std::sin(a), z);
        }
        for (const float z : {0.0f, height}) positions.emplace_back(middle, z);
        const unsigned low = first + 2 * n, high = low + 1;
        const auto add = [&](unsigned a, unsigned b, unsigned c) {
            triangles.emplace_back(a, sign > 0.0f ? b : c, sign > 0.0f ? c : b);
        };
        for (unsigned i = 0; i < n; ++i) {
            const unsigned a = first + 2 * i, b = first + 2 * ((i + 1) % n);
            add(a, b, b + 1);
            add(a, b + 1, a + 1);
            add(b, a, low);
            add(a + 1, b + 1, high);
            const glm::dvec3 p(positions[a]), q(positions[b]), m(middle, 0);
            area += 0.5 * static_cast<double>(sign) * ((p.x - m.x) * (q.y - m.y) - (q.x - m.x) * (p.y - m.y));
        }
    }
};

} // namespace

int main() {
    constexpr int pixels = 56;
    const gear wheel({27.7f, 28.2f}, 23.0f, 3.0f);
    vp::grid grid;
    grid.extent = {pixels, pixels, 3};

    // snippet: slices
    vp::cpu_backend backend;
    const vp::mesh mesh{backend, wheel.positions, wheel.triangles};
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> covered{backend, grid.extent};
    vp::voxelize_cells(backend, mesh, grid, vp::passthrough{}, vp::fraction{}, covered).or_throw();
    // end snippet
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> centres{backend, grid.extent};
    vp::voxelize_solid(backend, mesh, grid, vp::passthrough{}, vp::constant(true), centres).or_throw();
    const auto grey = vp::get<0>(covered).to_host_target(backend);
    const auto stairs = vp::get<0>(centres).to_host_target(backend);

    double by_fractions = 0.0, by_centres = 0.0, worst = 0.0; // areas of the layer; of a pixel that is off the most
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const double part = static_cast<double>(grey(x, y, 1)), whole = stairs(x, y, 1) ? 1.0 : 0.0;
            by_fractions += part;
            by_centres += whole;
            worst = std::max(worst, std::abs(whole - part));
        }

    picture::write_pixels("grey_slice.ppm", 2.0f, [&](float px, float py, const glm::vec2&) {
        const bool is_right = px >= 0.5f;
        const float u = 2.0f * px - (is_right ? 1.0f : 0.0f);
        const int x = std::min(static_cast<int>(u * static_cast<float>(pixels)), pixels - 1),
                  y = std::min(static_cast<int>(py * static_cast<float>(pixels)), pixels - 1);
        const float level = is_right ? grey(x, y, 1) : stairs(x, y, 1) ? 1.0f : 0.0f;
        if (std::abs(px - 0.5f) < 0.0015f) return glm::vec3(0.25f);
        return glm::vec3(level); // linear light, which is what a printer's lamp gives
    });

    const double error = 100.0 * (by_fractions / wheel.area - 1.0),
                 stair_error = 100.0 * (by_centres / wheel.area - 1.0);
    std::printf("area %.4f; by grey levels %.4f (%+.6f %%), by centres %.0f (%+.3f %%, a pixel up to %.2f off)\n",
                wheel.area, by_fractions, error, by_centres, stair_error, worst);
    return std::abs(error) < 1e-3 && std::abs(stair_error) > 10.0 * std::abs(error) && worst < 1.0 ? 0 : 1;
}
