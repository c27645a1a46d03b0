// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Eight targets in one pass: every kind of arithmetic that reaches a voxel.

#include "case_support.hpp"

namespace {

using namespace golden;

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

void everything(digest& digest, unsigned threads, const mesh_data& m, const vp::grid& grid, vp::coverage rule) {
    vp::mesh_view<glm::vec4, glm::vec2> mesh{m.positions, m.triangles, {}};
    vp::get<0>(mesh.attributes) = m.colors;
    vp::get<1>(mesh.attributes) = m.texcoords;
    draw<vp::target<vp::bit, vp::blend::add>, vp::target<std::uint32_t, vp::blend::add>,
         vp::target<float, vp::blend::add>, vp::target<glm::vec4, vp::blend::add>,
         vp::target<std::uint32_t, vp::blend::replace>, vp::target<glm::vec3, vp::blend::min, vp::layout::planar>,
         vp::target<vp::half, vp::blend::add>, vp::target<double, vp::blend::add, vp::layout::tiled>>(
        digest, threads, mesh, grid, shade_vertex{}, shade_everything{}, rule);
}

} // namespace

GOLDEN_CASE("small_soup.everything.conservative") {
    everything(digest, threads, small_soup(), odd_grid(), conservative);
}
GOLDEN_CASE("small_soup.everything.thin") { everything(digest, threads, small_soup(), odd_grid(), thin); }
GOLDEN_CASE("large_soup.everything.conservative") {
    everything(digest, threads, large_soup(), odd_grid(), conservative);
}
GOLDEN_CASE("box.everything.thin") { everything(digest, threads, box(), odd_grid(), thin); }
GOLDEN_CASE("odd_shapes.everything.conservative") {
    everything(digest, threads, odd_shapes(), unit_grid({16, 16, 16}), conservative);
}
GOLDEN_CASE("large_soup.crop.conservative") {
    everything(digest, threads, large_soup(), odd_grid().crop({11, 5, 40}, {50, 33, 17}), conservative);
}
