// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Solids and collision: two gears as solids in one call, each with a bit of its own. Voxels with both bits are where
// they collide. Finds the closest distance of their axes at which no turn makes them collide, and shows them a little
// closer (gears.ppm).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

constexpr float full_turn = 6.2831853f;

// A wheel with teeth, closed: rows of eight vertices around its profile, a rim and a hub with a thinner disc between.
struct gear {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    int teeth;

    gear(int teeth_, float radius, float bore, float thickness) : teeth(teeth_) {
        const auto n = static_cast<unsigned>(24 * teeth);
        for (unsigned i = 0; i < n; ++i) {
            const float phase = static_cast<float>(i % 24) / 24.0f,
                        a = full_turn * static_cast<float>(i) / static_cast<float>(n);
            const float tooth = glm::clamp(3.2f * std::cos(full_turn * phase), -1.0f, 1.0f); // flat tips and roots
            const float r = radius + 4.0f * tooth;
            const float rim = radius - 9.0f, hub = bore + 5.0f, disc = 0.65f * thickness;
            for (const auto& [at, y] : {std::pair{r, 0.0f},
                                        {r, thickness},
                                        {rim, thickness},
                                        {rim, disc},
                                        {hub, disc},
                                        {hub, thickness},
                                        {bore, thickness},
                                        {bore, 0.0f}})
                positions.emplace_back(at * std::cos(a), y, at * std::sin(a));
            for (unsigned k = 0; k < 8; ++k) {
                const auto p = [&](unsigned j, unsigned m) { return j % n * 8 + m % 8; };
                triangles.emplace_back(p(i, k), p(i, k + 1), p(i + 1, k));
                triangles.emplace_back(p(i, k + 1), p(i + 1, k + 1), p(i + 1, k));
            }
        }
    }
    // The place of the gear, turned by `turned` teeth.
    [[nodiscard]] vp::transform at(float x, float z, float turned) const {
        const float a = full_turn * turned / static_cast<float>(teeth), c = std::cos(a), s = std::sin(a);
        return {glm::mat4(c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, x, 8, z, 1)};
    }
};

struct body {
    std::uint8_t bit;
    VOXELPIPE_HD auto operator()(const vp::solid_fragment&) const { return vp::outputs(bit); }
};

int main() {
    const gear large(24, 48, 16, 14), small(16, 32, 8, 14);
    vp::cpu_backend backend;
    const vp::mesh large_mesh{backend, large.positions, large.triangles},
        small_mesh{backend, small.positions, small.triangles};
    vp::grid grid;
    grid.extent = {196, 30, 112};
    using bodies = vp::target<std::uint8_t, vp::blend::bit_or>;
    vp::framebuffer<vp::cpu_backend, bodies> fb{backend, grid.extent};
    std::uint64_t open_rows = 0;

    // Voxels that both fill, with axes so far apart and the large one turned by a part of a tooth.
    const auto collide = [&](float distance, float turned) {
        // snippet: bodies
        const std::vector<vp::draw<vp::mesh_view<>, vp::transform, body>> draws{
            {large_mesh.view(), large.at(56, 56, turned), {1}},
            {small_mesh.view(), small.at(56 + distance, 56, 0.5f - turned), {2}}};
        const vp::status s = vp::voxelize_solid(backend, draws, grid, fb, {.bodies = vp::bodies::draw}).or_throw();
        std::uint64_t both = 0;
        vp::for_each_occupied(vp::get<0>(fb).to_host_target(backend),
                              [&](const glm::ivec3&, std::uint8_t bits) { both += bits == 3 ? 1 : 0; });
        // end snippet
        open_rows += s.solid.open_rows;
        return both;
    };
    float near = 78.0f, free = 90.0f; // they collide at one, and are apart at the other
    while (free - near > 0.25f) {
        const float middle = 0.5f * (near + free);
        std::uint64_t worst = 0;
        for (int i = 0; i < 4; ++i) worst = std::max(worst, collide(middle, 0.25f * static_cast<float>(i)));
        (worst == 0 ? free : near) = middle;
    }
    const std::uint64_t at_free = collide(free, 0.0f), closer = collide(free - 3.0f, 0.12f);

    if (picture::is_fine()) { // voxels of a quarter, and teeth far enough into each other to be seen
        grid.extent *= 4;
        grid.voxel_size = grid.voxel_size / 4.0;
        fb = vp::framebuffer<vp::cpu_backend, bodies>{backend, grid.extent};
        collide(free - 4.0f, 0.12f);
    }
    const auto host = vp::get<0>(fb).to_host_target(backend);
    const glm::vec3 colors[] = {glm::vec3(-1.0f), {0.86f, 0.64f, 0.26f}, {0.52f, 0.60f, 0.68f}, {0.92f, 0.13f, 0.10f}};
    picture::write("gears.ppm", grid.extent, [&](int x, int y, int z) { return colors[host(x, y, z)]; },
                   {.along = {-0.2f, -1.0f, -0.62f}, .zoom = 1.38f, .aspect = 1.6f, .smooth = 5});
    std::printf("free from %.2f voxels between the axes; 3 closer, %llu voxels collide; %llu open rows\n",
                static_cast<double>(free), static_cast<unsigned long long>(closer),
                static_cast<unsigned long long>(open_rows));
    return open_rows == 0 && at_free == 0 && closer > 0 && free > 78.5f && free < 89.5f ? 0 : 1;
}
