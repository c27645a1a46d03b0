// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Textured colour: two textures on a sphere. The vertex shader lifts the land by the height, which gives mountains; the
// fragment shader reads the colour, and voxels keep the mean of their fragments (globe.ppm).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct on_map { // where the fragment lies on the textures; flat maps would have a seam, so it is a direction
    glm::vec3 direction;
};

VOXELPIPE_HD inline glm::vec2 map_of(const glm::vec3& d) { // longitude and latitude, 0 to 1
    return {0.5f + std::atan2(d.z, d.x) / 6.2831853f, 0.5f + std::asin(glm::clamp(d.y, -1.0f, 1.0f)) / 3.1415927f};
}

struct lift {
    vp::field2d<float> height;
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        const float land = glm::max(0.0f, height(map_of(v.position)) - 0.5f);
        return vp::vertex_output{(76.0f + 34.0f * land) * v.position + 96.0f, on_map{v.position}};
    }
};
struct paint {
    vp::field2d<glm::vec3> color;
    VOXELPIPE_HD auto operator()(const vp::fragment<on_map>& f) const {
        return vp::outputs(color(map_of(glm::normalize(f.clamped_varyings().direction))), 1u);
    }
};

// Hills of many sizes: values at lattice points, mixed, in six octaves. On the sphere, so that the map has no seam.
float noise(glm::vec3 p) {
    float sum = 0.0f, weight = 0.5f;
    for (int octave = 0; octave < 6; ++octave, p = 2.03f * p + 7.1f, weight *= 0.5f) {
        const glm::vec3 base = glm::floor(p), f = p - base, t = f * f * (3.0f - 2.0f * f);
        for (int c = 0; c < 8; ++c) {
            const glm::ivec3 corner(c & 1, c >> 1 & 1, c >> 2);
            const glm::ivec3 q = glm::ivec3(base) + corner;
            std::uint32_t h = static_cast<std::uint32_t>(q.x) * 73856093u ^
                              static_cast<std::uint32_t>(q.y) * 19349663u ^ static_cast<std::uint32_t>(q.z) * 83492791u;
            h = (h ^ h >> 15) * 0x85ebca6bu;
            const glm::vec3 w = glm::mix(1.0f - t, t, glm::vec3(corner));
            sum += weight * w.x * w.y * w.z * static_cast<float>((h ^ h >> 13) >> 8) * 0x1p-24f;
        }
    }
    return sum;
}

int main() {
    const int finer = picture::is_fine() ? 2 : 1, width = 1024 * finer - 512, height = width / 2;
    std::vector<float> heights;
    std::vector<glm::vec3> colors;
    for (int i = 0; i < width * height; ++i) {
        const int column = i % width, row = i / width;
        const float a = 6.2831853f * ((static_cast<float>(column) + 0.5f) / static_cast<float>(width) - 0.5f),
                    e = 3.1415927f * ((static_cast<float>(row) + 0.5f) / static_cast<float>(height) - 0.5f);
        const glm::vec3 d(std::cos(e) * std::cos(a), std::sin(e), std::cos(e) * std::sin(a));
        const float h = noise(2.9f * d + 3.0f), ice = glm::smoothstep(0.82f, 0.9f, std::abs(d.y) + 0.3f * (h - 0.5f)),
                    dry = glm::smoothstep(0.35f, 0.6f, noise(3.0f * d + 40.0f) - 0.25f * std::abs(d.y));
        const glm::vec3 sea =
            glm::mix(glm::vec3(0.08f, 0.22f, 0.42f), glm::vec3(0.20f, 0.52f, 0.62f), glm::smoothstep(0.38f, 0.5f, h));
        const glm::vec3 plain = glm::mix(glm::vec3(0.25f, 0.47f, 0.19f), glm::vec3(0.80f, 0.67f, 0.42f), dry);
        const glm::vec3 hill = glm::mix(plain, glm::vec3(0.45f, 0.37f, 0.30f), glm::smoothstep(0.58f, 0.66f, h));
        const glm::vec3 land = glm::mix(hill, glm::vec3(0.86f), glm::smoothstep(0.69f, 0.73f, h));
        heights.push_back(h);
        colors.push_back(glm::mix(h < 0.5f ? sea : land, glm::vec3(0.82f, 0.85f, 0.88f), ice));
    }
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    constexpr unsigned rows = 150, columns = 300;
    for (unsigned i = 0; i <= rows; ++i)
        for (unsigned k = 0; k < columns; ++k) {
            const float a = 6.2831853f * static_cast<float>(k) / columns,
                        e = 3.1415927f * (static_cast<float>(i) / rows - 0.5f);
            positions.emplace_back(std::cos(e) * std::cos(a), std::sin(e), std::cos(e) * std::sin(a));
            const unsigned p = i * columns + k, q = i * columns + (k + 1) % columns;
            if (i == rows) continue;
            triangles.emplace_back(p, p + columns, q);
            triangles.emplace_back(q, p + columns, q + columns);
        }

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
    vp::grid grid;
    grid.extent = glm::ivec3(192 * finer);
    grid.voxel_size = glm::dvec3(1.0 / finer);
    vp::framebuffer<vp::cpu_backend, vp::target<glm::vec3, vp::blend::add>, vp::target<std::uint32_t, vp::blend::count>>
        fb{backend, grid.extent};
    const auto nearest = vp::filter_mode::nearest;
    const vp::status s = vp::voxelize(backend, mesh, grid, lift{{heights.data(), width, height}},
                                      paint{{colors.data(), width, height, 1, nearest}}, fb)
                             .or_throw();
    const auto sums = vp::get<0>(fb).to_host_target(backend);
    const auto counts = vp::get<1>(fb).to_host_target(backend);
    const auto mean = [&](int x, int y, int z) {
        const std::uint32_t n = counts(x, y, z);
        return n == 0 ? glm::vec3(-1.0f) : sums(x, y, z) / static_cast<float>(n);
    };
    picture::write("globe.ppm", grid.extent, mean, {.along = {-0.5f, -0.35f, -1.0f}, .zoom = 1.45f, .smooth = 4});
    std::printf("%zu triangles, %llu voxels\n", triangles.size(), static_cast<unsigned long long>(s.counts.voxels));
    const int middle = 96 * finer;
    return s.counts.voxels > 60000 && counts(middle, middle, middle) == 0 && mean(middle, middle, middle).x < 0.0f ? 0
                                                                                                                   : 1;
}
