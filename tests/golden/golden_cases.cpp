// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Framebuffers and A-buffers of generated meshes: every kind of arithmetic that reaches an output is in one of them.

#include "golden.hpp"
#include "meshes.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <vector>

namespace vp = voxelpipe;

namespace {

vp::grid unit_grid(glm::ivec3 extent) {
    vp::grid g;
    g.extent = extent;
    return g;
}

// What a status counts is part of the contract too.
void add_counts(golden::digest& digest, const vp::status& s) {
    s.or_throw();
    const vp::counters& c = s.counts;
    digest.add(std::vector<std::uint64_t>{c.triangles_in, c.triangles_nonfinite, c.triangles_too_far,
                                          c.triangles_zero_area, c.triangles_outside, c.triangles_drawn, c.fragments,
                                          c.fragments_discarded, c.voxels});
}

template <class Framebuffer>
void add_targets(golden::digest& digest, vp::cpu_backend& backend, Framebuffer& fb) {
    vp::core::for_each_index<Framebuffer::view_type::num_targets>(
        [&]<std::size_t I>() { digest.add(vp::get<I>(fb).to_host(backend)); });
}

template <class... Targets, class... Attributes, class VertexShader, class FragmentShader>
void draw(golden::digest& digest, unsigned threads, const vp::mesh_view<Attributes...>& mesh, const vp::grid& grid,
          const VertexShader& vertex_shader, const FragmentShader& fragment_shader, vp::coverage rule) {
    vp::cpu_backend backend{threads};
    vp::framebuffer<vp::cpu_backend, Targets...> fb{backend, grid.extent};
    add_counts(digest, vp::voxelize(backend, mesh, grid, vertex_shader, fragment_shader, fb, rule));
    add_targets(digest, backend, fb);
}

// ---- coverage alone
// --------------------------------------------------------------------------------------------------

void occupancy(golden::digest& digest, unsigned threads, const golden::mesh_data& m, const vp::grid& grid,
               vp::coverage rule) {
    draw<vp::target<vp::bit, vp::blend::bit_or>>(digest, threads, vp::mesh_view<>{m.positions, m.triangles}, grid,
                                                 vp::passthrough{}, vp::constant(true), rule);
}

const golden::mesh_data& small_soup() {
    static const golden::mesh_data m = golden::soup(1, 4000, 12, -16, 112);
    return m;
}
const golden::mesh_data& large_soup() {
    static const golden::mesh_data m = golden::soup(2, 60, 300, -120, 120);
    return m;
}
const golden::mesh_data& box() {
    static const golden::mesh_data m = golden::bumpy_box(3, 48, 3);
    return m;
}

// Odd extents, a voxel size of its own along every axis, an origin off every power of two.
vp::grid odd_grid() {
    vp::grid g;
    g.extent = {97, 61, 83};
    g.origin = {-7.3, 1.0 / 3.0, -11.0 / 7.0};
    g.voxel_size = {1.1, 0.7, 1.0 / 0.9};
    return g;
}

// ---- all kinds of targets at once
// ------------------------------------------------------------------------------------

struct surface {
    glm::vec4 color;
    glm::vec2 uv;
    vp::flat<std::uint32_t> provoking;
};

struct shade_vertex {
    VOXELPIPE_HD vp::vertex_output<surface> operator()(const vp::vertex<glm::vec4, glm::vec2>& v) const {
        return {v.position, {vp::get<0>(v), vp::get<1>(v), {v.index * 7u + 1u}}};
    }
};

struct shade_everything {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface>& f) const {
        const float facing = vp::exact::dot(f.normal, glm::vec3(0.36f, 0.48f, 0.8f));
        const surface inside = f.clamped_varyings();
        return vp::outputs(f.front_facing, 1u, facing, f.varyings.color, f.varyings.provoking.value, f.normal,
                           vp::half(inside.uv.x), double{inside.uv.y})
            .discard_if(inside.color.x < 0.125f);
    }
};

void everything(golden::digest& digest, unsigned threads, const golden::mesh_data& m, const vp::grid& grid,
                vp::coverage rule) {
    vp::mesh_view<glm::vec4, glm::vec2> mesh{m.positions, m.triangles, {}};
    vp::get<0>(mesh.attributes) = m.colors;
    vp::get<1>(mesh.attributes) = m.texcoords;
    draw<vp::target<vp::bit, vp::blend::add>, vp::target<std::uint32_t, vp::blend::add>,
         vp::target<float, vp::blend::add>, vp::target<glm::vec4, vp::blend::add>,
         vp::target<std::uint32_t, vp::blend::replace>, vp::target<glm::vec3, vp::blend::min, vp::layout::planar>,
         vp::target<vp::half, vp::blend::add>, vp::target<double, vp::blend::add, vp::layout::tiled>>(
        digest, threads, mesh, grid, shade_vertex{}, shade_everything{}, rule);
}

// ---- A-buffer
// --------------------------------------------------------------------------------------------------------

struct depth_and_weights {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::vec4(f.barycentric, f.normal.z));
    }
};

void lists(golden::digest& digest, unsigned threads, const golden::mesh_data& m, const vp::grid& grid,
           vp::coverage rule) {
    vp::cpu_backend backend{threads};
    vp::abuffer<vp::cpu_backend, glm::vec4> lists{backend};
    add_counts(digest, vp::voxelize(backend, vp::mesh_view<>{m.positions, m.triangles}, grid, vp::passthrough{},
                                    depth_and_weights{}, lists, rule));
    const auto host = lists.to_host(backend);
    digest.add(host.voxels);
    digest.add(host.offsets);
    digest.add(host.primitives);
    digest.add(host.payloads);
}

constexpr vp::coverage conservative = vp::coverage::conservative;
constexpr vp::coverage thin = vp::coverage::thin;

} // namespace

GOLDEN_CASE("small_soup.occupancy.conservative") {
    occupancy(digest, threads, small_soup(), unit_grid({96, 96, 96}), conservative);
}
GOLDEN_CASE("small_soup.occupancy.thin") { occupancy(digest, threads, small_soup(), unit_grid({96, 96, 96}), thin); }
GOLDEN_CASE("large_soup.occupancy.conservative") {
    occupancy(digest, threads, large_soup(), unit_grid({80, 64, 70}), conservative);
}
GOLDEN_CASE("large_soup.occupancy.thin") { occupancy(digest, threads, large_soup(), unit_grid({80, 64, 70}), thin); }
GOLDEN_CASE("box.occupancy.conservative") { occupancy(digest, threads, box(), odd_grid(), conservative); }
GOLDEN_CASE("box.occupancy.thin") { occupancy(digest, threads, box(), odd_grid(), thin); }
GOLDEN_CASE("odd_shapes.occupancy.conservative") {
    occupancy(digest, threads, golden::odd_shapes(), unit_grid({16, 16, 16}), conservative);
}
GOLDEN_CASE("odd_shapes.occupancy.thin") {
    occupancy(digest, threads, golden::odd_shapes(), unit_grid({16, 16, 16}), thin);
}
GOLDEN_CASE("small_soup.everything.conservative") {
    everything(digest, threads, small_soup(), odd_grid(), conservative);
}
GOLDEN_CASE("small_soup.everything.thin") { everything(digest, threads, small_soup(), odd_grid(), thin); }
GOLDEN_CASE("large_soup.everything.conservative") {
    everything(digest, threads, large_soup(), odd_grid(), conservative);
}
GOLDEN_CASE("box.everything.thin") { everything(digest, threads, box(), odd_grid(), thin); }
GOLDEN_CASE("odd_shapes.everything.conservative") {
    everything(digest, threads, golden::odd_shapes(), unit_grid({16, 16, 16}), conservative);
}
GOLDEN_CASE("large_soup.crop.conservative") {
    everything(digest, threads, large_soup(), odd_grid().crop({11, 5, 40}, {50, 33, 17}), conservative);
}
GOLDEN_CASE("small_soup.lists.conservative") { lists(digest, threads, small_soup(), odd_grid(), conservative); }
GOLDEN_CASE("large_soup.lists.thin") { lists(digest, threads, large_soup(), unit_grid({80, 64, 70}), thin); }
GOLDEN_CASE("odd_shapes.lists.conservative") {
    lists(digest, threads, golden::odd_shapes(), unit_grid({16, 16, 16}), conservative);
}
