// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Solids: the inside of parts that overlap, a material for each draw, and a mesh with a hole. Exits with 0 when the
// counts are those of the boxes.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/slabs/stream_surface.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

struct solid_box {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    solid_box(glm::vec3 low, glm::vec3 high) {
        for (int i = 0; i < 8; ++i)
            positions.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                                   (i & 4) != 0 ? high.z : low.z);
    }
};

// snippet: shader
struct material {
    std::uint32_t id;
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
        return vp::outputs(id, f.winding > 0); // also f.voxel and f.draw
    }
};
// end snippet

int main() {
    const solid_box plate({1, 1, 1}, {15, 15, 5}), post({6, 6, 3}, {10, 10, 15}); // they overlap by two layers
    vp::cpu_backend backend;
    vp::grid grid;
    grid.extent = {16, 16, 16};
    bool good = true;

    // snippet: bodies
    using material_target = vp::target<std::uint32_t, vp::blend::min>; // the least id wins where parts overlap
    using parts_target = vp::target<vp::bit, vp::blend::add>;          // whether the number of parts is odd
    vp::framebuffer<vp::cpu_backend, material_target, parts_target> parts{backend, grid.extent};
    const std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, material>> draws{
        {{plate.positions, plate.triangles}, {}, {7}}, {{post.positions, post.triangles}, {}, {3}}};
    const vp::status s = vp::voxelize_solid(backend, draws, grid, parts, {.bodies = vp::bodies::draw});
    if (s.ok() && s.solid.open_rows == 0) // else some mesh has a hole, and voxels behind it may be wrong
        std::printf("%llu voxels, %llu parts of voxels\n", static_cast<unsigned long long>(s.counts.voxels),
                    static_cast<unsigned long long>(s.counts.fragments));
    // end snippet
    const auto ids = vp::get<0>(parts).to_host_target(backend);
    good = good && s.counts.voxels == 14U * 14U * 4U + 4U * 4U * 10U &&
           s.counts.fragments == 14U * 14U * 4U + 4U * 4U * 12U && ids(8, 8, 4) == 3 && ids(2, 2, 4) == 7;

    // snippet: holes
    std::vector<glm::uvec3> with_a_hole(post.triangles.begin(), post.triangles.end() - 2);
    const vp::mesh_view<> open{post.positions, with_a_hole};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> inside{backend, grid.extent};
    const vp::status closed = vp::voxelize_solid(backend, open, grid, vp::passthrough{}, vp::constant(true), inside,
                                                 {.repair = vp::repair::close_holes});
    // closed.solid.holes is 1, and closed.solid.open_rows is 0 behind it
    // end snippet
    good = good && closed.counts.voxels == std::uint64_t{4} * 4 * 12 && closed.solid.holes == 1 &&
           closed.solid.open_rows == 0;

    {
        // snippet: labels
        vp::framebuffer<vp::cpu_backend, vp::target<std::int32_t, vp::blend::replace>> labels{backend, grid.extent};
        vp::cpu_backend::buffer<vp::voxel_component> components{backend, 0};
        const vp::status s =
            vp::label(backend, vp::get<0>(inside).view(), vp::get<0>(labels).view(), components, {.connectivity = 26});
        s.or_throw();
        for (const vp::voxel_component& c : components.to_host(backend))
            std::printf("%lld: %llu voxels\n", static_cast<long long>(c.name),
                        static_cast<unsigned long long>(c.voxels));
        // end snippet
        good = good && s.label.components == 1 && components.to_host(backend)[0].voxels == closed.counts.voxels;
    }
    {
        const vp::mesh_view<> mesh{post.positions, post.triangles};
        // snippet: fractions
        using field = vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>>;
        field fractions{backend, grid.extent};
        const vp::status s = vp::voxelize_cells(backend, mesh, grid, vp::passthrough{}, vp::fraction{}, fractions);
        s.or_throw();
        const double volume_in_voxels = s.cells.volume();
        // end snippet
        good = good && volume_in_voxels == 4.0 * 4 * 12;
    }

    // snippet: stream
    namespace slabs = vp::slabs;
    using bits = vp::sparse_framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>>;
    std::uint64_t filled = 0;
    slabs::stream stream(backend, grid, vp::passthrough{}, {.num_slabs = 4, .repair = vp::repair::close_holes});
    stream.add(open).or_throw(); // as often as there are chunks
    const vp::status streamed = stream.draw_solid(
        vp::constant(true),
        [&](glm::ivec3 extent) {
            return bits{backend, extent};
        },
        [&](const slabs::slab&, const bits& voxels) { filled += voxels.num_voxels(); },
        {.repair = vp::repair::close_holes});
    // as `closed`, voxels and all counts, of slabs that never were in memory together
    // end snippet
    good = good && streamed.counts == closed.counts && streamed.solid == closed.solid && filled == closed.counts.voxels;

    // snippet: surface
    std::uint64_t vertices = 0;
    slabs::stream again(backend, grid, vp::passthrough{}, {.num_slabs = 4, .repair = vp::repair::close_holes});
    again.add(open).or_throw();
    const vp::status meshed = slabs::extract_solid(
        again, // `piece` goes to a file, and its memory to the next one
        [&](const vp::surface_slab&, const vp::surface<vp::cpu_backend>& piece) { vertices += piece.vertices.size(); },
        {}, {.repair = vp::repair::close_holes});
    // end snippet
    vp::surface<vp::cpu_backend> at_once{backend};
    vp::extract(backend, inside, grid, at_once).or_throw();
    good = good && meshed.ok() && vertices == at_once.vertices.size() && meshed.surface.vertices == vertices;
    return good ? 0 : 1;
}
