// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Layers of paint that are thinner than a voxel: rings of two pigments in turn, ten to a voxel. A voxel that shows one
// of them, the last one drawn, makes a pattern that is not there; the mean by the area that each ring has within the
// voxel is the mixture that people see from afar. The picture has both (thin_colors.ppm).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

namespace {

// snippet: paint
// Sums over the layers within a voxel: area times colour, and area. Divided, they are the mean colour.
struct paint {
    using fragment = vp::measured_cell<vp::cell_value::area>;
    glm::vec3 color; // in linear light
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        const float area = static_cast<float>(f.area);
        return vp::outputs(area * color.x, area * color.y, area * color.z, area);
    }
};
using sum = vp::target<float, vp::blend::add>;
// end snippet

struct number_of_draw {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.draw + 1); }
};

// An open tube along z: without lids, with all of its area in its wall.
struct tube {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    tube(const glm::vec2& middle, float radius) {
        constexpr unsigned sides = 120;
        for (unsigned i = 0; i < sides; ++i) {
            const float a = 6.2831853f * static_cast<float>(i) / static_cast<float>(sides);
            for (const float z : {-1.0f, 2.0f})
                positions.emplace_back(middle.x + radius * std::cos(a), middle.y + radius * std::sin(a), z);
            const unsigned low = 2 * i, next = 2 * ((i + 1) % sides);
            triangles.emplace_back(low, next, next + 1);
            triangles.emplace_back(low, next + 1, low + 1);
        }
    }
};

} // namespace

int main() {
    constexpr int pixels = 44, rings = 160;
    constexpr float first = 4.0f, step = 0.1f, last = first + step * (rings - 1);
    const glm::vec2 middle(22.13f, 21.87f);
    const glm::vec3 chalk(0.90f, 0.86f, 0.76f);
    // The other pigment, which turns from blue to red outwards.
    const auto pigment = [](float radius) {
        const float t = (radius - first) / (last - first);
        return glm::mix(glm::vec3(0.01f, 0.10f, 0.38f), glm::vec3(0.62f, 0.04f, 0.02f), glm::clamp(t, 0.0f, 1.0f));
    };
    std::vector<tube> tubes;
    std::vector<glm::vec3> colors;
    for (int i = 0; i < rings; ++i) {
        const float radius = first + step * static_cast<float>(i);
        tubes.emplace_back(middle, radius);
        colors.push_back(i % 2 == 0 ? chalk : pigment(radius));
    }
    vp::grid grid;
    grid.extent = {pixels, pixels, 1};
    vp::cpu_backend backend;

    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, number_of_draw>> layers;
    layers.reserve(tubes.size());
    for (const tube& t : tubes) layers.push_back({{t.positions, t.triangles}, {}, {}});
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, vp::blend::replace>> numbers{backend, grid.extent};
    vp::voxelize(backend, layers, grid, numbers).or_throw();

    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, paint>> paints;
    paints.reserve(tubes.size());
    for (std::size_t i = 0; i < tubes.size(); ++i)
        paints.push_back({{tubes[i].positions, tubes[i].triangles}, {}, {colors[i]}});
    vp::framebuffer<vp::cpu_backend, sum, sum, sum, sum> sums{backend, grid.extent};
    vp::voxelize_cells(backend, paints, grid, sums, {.bodies = vp::bodies::draw}).or_throw();
    const auto drawn = vp::get<0>(numbers).to_host_target(backend);
    const auto red = vp::get<0>(sums).to_host_target(backend), green = vp::get<1>(sums).to_host_target(backend),
               blue = vp::get<2>(sums).to_host_target(backend), area = vp::get<3>(sums).to_host_target(backend);
    const glm::vec3 nothing(0.035f, 0.04f, 0.05f);
    const auto last_drawn = [&](int x, int y) {
        const std::uint32_t number = drawn(x, y, 0);
        return number == 0 ? nothing : colors[number - 1];
    };
    const auto mean = [&](int x, int y) {
        const float sum_of_areas = area(x, y, 0);
        if (sum_of_areas == 0.0f) return nothing;
        return glm::vec3(red(x, y, 0), green(x, y, 0), blue(x, y, 0)) / sum_of_areas;
    };

    // How far both are off the mixture of the pigments, root mean square, where voxels are full of rings.
    double last_error = 0.0, mean_error = 0.0;
    int count = 0;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const float radius = glm::length(glm::vec2(x, y) + 0.5f - middle);
            if (radius < first + 1.0f || radius > last - 1.0f) continue;
            const glm::vec3 mixture = 0.5f * (chalk + pigment(radius));
            const auto squared = [&](const glm::vec3& c) {
                return static_cast<double>(glm::dot(c - mixture, c - mixture));
            };
            last_error += squared(last_drawn(x, y));
            mean_error += squared(mean(x, y));
            ++count;
        }
    last_error = std::sqrt(last_error / count);
    mean_error = std::sqrt(mean_error / count);

    picture::write_pixels("thin_colors.ppm", 2.0f, [&](float px, float py, const glm::vec2&) {
        const bool is_right = px >= 0.5f;
        const float u = 2.0f * px - (is_right ? 1.0f : 0.0f);
        const int x = std::min(static_cast<int>(u * static_cast<float>(pixels)), pixels - 1),
                  y = std::min(static_cast<int>(py * static_cast<float>(pixels)), pixels - 1);
        return is_right ? mean(x, y) : last_drawn(x, y);
    });
    std::printf("%d voxels full of rings: off the mixture by %.4f as the last one drawn, by %.4f as the mean by area\n",
                count, last_error, mean_error);
    return count > 500 && mean_error < 0.02 && last_error > 20.0 * mean_error ? 0 : 1;
}
