// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Walls of a lattice Boltzmann solver: where the links between the nodes of a D3Q19 lattice cross a sphere. Prints how
// far the crossings are from the ball's, beside walls half-way between nodes, and draws a layer of the lattice with
// both (links.ppm): half-way on the left, the links' own crossings on the right.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdio>
#include <map>
#include <tuple>
#include <vector>

namespace vp = voxelpipe;

namespace {

constexpr int side = 20; // nodes
constexpr int layer = 9; // of the picture: its nodes lie in the plane through the ball's middle
const glm::dvec3 middle(10.2, 9.9, layer + 0.5);
constexpr double radius = 6.6;

// The ball as rings of triangles whose vertices lie on it.
struct ball {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    ball(unsigned rings, unsigned around) {
        for (unsigned i = 0; i <= rings; ++i)
            for (unsigned j = 0; j < around; ++j) {
                const double p = 3.14159265358979 * i / rings, a = 6.28318530717959 * j / around;
                const glm::dvec3 out(std::sin(p) * std::cos(a), std::sin(p) * std::sin(a), std::cos(p));
                positions.emplace_back(middle +
                                       radius * (i == 0 || i == rings ? glm::dvec3(0, 0, i == 0 ? 1 : -1) : out));
            }
        for (unsigned i = 0; i < rings; ++i)
            for (unsigned j = 0; j < around; ++j) {
                const unsigned a = i * around + j, b = i * around + (j + 1) % around;
                triangles.emplace_back(a, a + around, b);
                triangles.emplace_back(b, a + around, b + around);
            }
    }
};

// Where the link from a node outside enters the ball, 0 to 1; -1 where it does not.
double enters(const glm::dvec3& node, const glm::dvec3& link) {
    const glm::dvec3 c = node - middle;
    const double a = glm::dot(link, link), b = glm::dot(c, link), rest = glm::dot(c, c) - radius * radius;
    const double root = b * b - a * rest;
    return root < 0 ? -1.0 : (-b - std::sqrt(root)) / a;
}

// Distance of a point from a segment.
float distance(const glm::vec2& p, const glm::vec2& from, const glm::vec2& to) {
    const glm::vec2 d = to - from;
    return glm::length(p - from - glm::clamp(glm::dot(p - from, d) / glm::dot(d, d), 0.0f, 1.0f) * d);
}

} // namespace

int main() {
    const ball body(160, 320);
    vp::grid grid; // a node in the middle of each voxel
    grid.extent = glm::ivec3(side);

    // snippet: links
    vp::cpu_backend backend;
    const vp::mesh mesh{backend, body.positions, body.triangles};
    vp::link_list<vp::cpu_backend> links{backend};
    vp::link_options options;
    options.neighbours = 18; // D3Q19
    vp::voxelize_links(backend, mesh, grid, vp::passthrough{}, links, options).or_throw();
    const std::vector<glm::ivec3> nodes = links.voxels.to_host(backend);
    const std::vector<float> q = links.q.to_host(backend); // nodes.size() times options.neighbours
    // end snippet
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> walls{backend, grid.extent};
    vp::voxelize_solid(backend, mesh, grid, vp::passthrough{}, vp::constant(true), walls).or_throw();
    const auto is_wall = vp::get<0>(walls).to_host_target(backend);

    std::size_t crossed = 0;
    double worst = 0, half_way = 0; // off the ball, in links: the greatest of the crossings, the mean of half-way walls
    std::map<std::tuple<int, int>, std::vector<std::pair<glm::vec2, float>>> drawn; // of the layer's nodes in the fluid
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const glm::ivec3 p = nodes[i];
        if (is_wall(p.x, p.y, p.z)) continue; // the other end of a link that a node in the fluid has, too
        for (int k = 0; k < options.neighbours; ++k) {
            const glm::ivec3 d = vp::link_direction(k), n = p + d;
            const float part = q[i * static_cast<std::size_t>(options.neighbours) + static_cast<std::size_t>(k)];
            if (part < 0 || !is_wall(n.x, n.y, n.z)) continue;
            const double expected = enters(glm::dvec3(p) + 0.5, glm::dvec3(d));
            ++crossed;
            worst = std::max(worst, std::abs(static_cast<double>(part) - expected));
            half_way += std::abs(0.5 - expected);
            if (p.z == layer && d.z == 0) drawn[{p.x, p.y}].emplace_back(glm::vec2(d), part);
        }
    }
    half_way /= static_cast<double>(crossed);

    picture::write_pixels("links.ppm", 2.0f, [&](float px, float py, const glm::vec2&) {
        const bool is_right = px >= 0.5f;
        if (std::abs(px - 0.5f) < 0.0015f) return glm::vec3(1.0f);
        // The ball's part of the layer, in voxels, y upwards.
        const float width = 16.4f;
        const glm::vec2 at =
            glm::vec2(middle) + width * (glm::vec2(2.0f * px - (is_right ? 1.0f : 0.0f), 1.0f - py) - 0.5f);
        const glm::ivec2 cell(glm::floor(at));
        const float from_middle = glm::length(at - glm::vec2(middle));
        glm::vec3 color = from_middle < static_cast<float>(radius) ? glm::vec3(0.62f, 0.64f, 0.68f) : glm::vec3(0.95f);
        if (std::abs(from_middle - static_cast<float>(radius)) < 0.035f) color = glm::vec3(0.22f, 0.24f, 0.28f);
        bool has_dot = false;
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
                const auto found = drawn.find({cell.x + dx, cell.y + dy});
                if (found == drawn.end()) continue;
                const glm::vec2 node = glm::vec2(cell.x + dx, cell.y + dy) + 0.5f;
                for (const auto& [link, part] : found->second) {
                    const glm::vec2 end = node + (is_right ? part : 0.5f) * link;
                    has_dot = has_dot || glm::length(at - end) < 0.11f;
                    if (distance(at, node, end) < 0.035f) color = glm::vec3(0.10f, 0.33f, 0.62f);
                }
            }
        const float from_node = glm::length(at - glm::vec2(cell) - 0.5f);
        if (from_node < 0.13f && cell.x >= 0 && cell.y >= 0 && cell.x < side && cell.y < side)
            color = is_wall(cell.x, cell.y, layer) ? glm::vec3(0.30f, 0.31f, 0.34f) : glm::vec3(0.10f, 0.33f, 0.62f);
        return has_dot ? glm::vec3(0.80f, 0.20f, 0.05f) : color;
    });

    std::printf("%zu nodes, %zu links into the wall: at most %.5f of a link off the ball, half-way %.2f on average\n",
                nodes.size(), crossed, worst, half_way);
    return crossed > 3000 && worst < 0.02 && half_way > 0.2 ? 0 : 1;
}
