// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Interleaved vertices with flat indices, grids by length and by voxel size, world coordinates, and results read back:
// occupied voxels, a region, the fragments of one voxel. Exits with 0 when all of them agree.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

namespace {

// snippet: interleaved
struct corner { // a vertex as other libraries store them
    glm::vec3 position;
    float weight;
};
// end snippet

} // namespace

int main() {
    vp::cpu_backend backend;
    // snippet: sources
    const std::vector<corner> corners{{{0, 0, 0}, 1}, {{2, 0, 0}, 2}, {{0, 1, 0}, 3}, {{2, 1, 1}, 4}};
    const std::vector<std::uint16_t> indices{0, 1, 2, 1, 3, 2}; // flat, of 8, 16 or 32 bits
    const vp::mesh mesh{backend, vp::member_of(corners, &corner::position), indices,
                        vp::member_of(corners, &corner::weight)};
    // end snippet

    // snippet: grids
    const vp::bounding_box box = vp::bounds(backend, mesh.view().positions); // also of positions on a GPU
    const vp::grid grid = vp::fit_longest(box, 64);      // 64 voxels along x, as many as it takes along y and z
    const vp::grid fine = vp::fit_voxel_size(box, 0.25); // voxels of a given size
    const glm::ivec3 voxel = grid.voxel_at({0.5, 0.25, 0.0});
    const glm::dvec3 center = grid.voxel_center(voxel);
    // end snippet
    bool good = grid.extent.x == 64 && fine.extent.x == 8 && grid.voxel_at(center) == voxel && grid.contains(voxel);

    using count = vp::target<std::uint32_t, vp::blend::count>;
    vp::framebuffer<vp::cpu_backend, count> counts{backend, grid.extent};
    const vp::status drawn = vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(1U), counts).or_throw();

    // snippet: read back
    std::uint64_t occupied = 0, fragments = 0;
    vp::for_each_occupied(vp::get<0>(counts).to_host_target(backend), [&](const glm::ivec3&, std::uint32_t n) {
        ++occupied;
        fragments += n;
    });
    const auto part = vp::get<0>(counts).to_host_region(backend, voxel, {1, 1, 1}); // copies little more than that
    // end snippet
    good = good && occupied == drawn.counts.voxels && fragments == drawn.counts.fragments;

    vp::abuffer<vp::cpu_backend> lists{backend};
    using draw = vp::draw<vp::mesh_view<float>, vp::passthrough, decltype(vp::constant(1U))>;
    const std::vector<draw> draws{{mesh, {}, vp::constant(1U)}, {mesh, {}, vp::constant(2U)}};
    vp::voxelize(backend, draws, grid, lists).or_throw();
    std::size_t of_second = 0;
    // snippet: find
    const auto host = lists.to_host(backend);
    const vp::primitive_map map{draws};
    for (const auto& [primitive, value] : host.find(voxel)) { // none if the voxel is empty
        const auto [number, triangle] = map(primitive);       // of the draw, and of the triangle in its mesh
        if (number == 1 && triangle < 2) ++of_second;
    }
    // end snippet
    good = good && part(voxel.x, voxel.y, voxel.z) != 0 && host.find(voxel).size() == 2 * of_second &&
           of_second == part(voxel.x, voxel.y, voxel.z);

    // snippet: nothing drawn
    const vp::status empty = vp::voxelize(backend, std::vector<draw>{}, grid, counts); // clears, as vp::clear does
    if (empty.nothing_drawn()) std::puts("an empty frame");
    // end snippet
    vp::for_each_occupied(vp::get<0>(counts).to_host_target(backend), [&](const auto&, auto) { good = false; });
    std::puts(good ? "all agree" : "they differ");
    return good && empty.nothing_drawn() ? 0 : 1;
}
