// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A-buffers: with and without a payload, of one draw and of several, of parts of grids and of meshes.

#include "cases.hpp"

#include <glm/vec4.hpp>

namespace golden {

struct weights_and_depth {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::vec4(f.barycentric, f.normal.z)).discard_if(mixed(f.primitive, 3u) % 7u == 0);
    }
};
struct number_of_triangle {
    std::uint32_t salt;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::uvec4(f.draw, f.triangle, f.primitive, mixed(f.triangle, salt)));
    }
};

template <class Backend>
void add_lists(case_table<Backend>& cases) {
    for (const named_mesh& m : hashed_meshes())
        for (const named_coverage& c : coverages) {
            const std::string name = std::string(".") + c.name + '.' + m.name;
            cases.push_back({"list.numbers" + name, [mesh = &m.data, rule = c.rule](Backend& backend, digest& d) {
                                 vp::abuffer<Backend> lists{backend};
                                 const auto drawn = upload(backend, *mesh);
                                 add_counts(d, vp::voxelize(backend, drawn, odd_grid(), vp::passthrough{},
                                                            vp::constant(true), lists, rule));
                                 add_list(d, lists.to_host(backend));
                             }});
            if (c.rule != vp::coverage::conservative && c.rule != vp::coverage::thin) continue;
            cases.push_back({"list.payload" + name, [mesh = &m.data, rule = c.rule](Backend& backend, digest& d) {
                                 vp::abuffer<Backend, glm::vec4> lists{backend};
                                 const auto drawn = upload(backend, *mesh);
                                 add_counts(d, vp::voxelize(backend, drawn, crop_of_odd_grid(), vp::passthrough{},
                                                            weights_and_depth{}, lists, rule));
                                 add_list(d, lists.to_host(backend));
                             }});
        }
    cases.push_back({"list.draws", [](Backend& backend, digest& d) {
                         const auto a = upload(backend, hashed_mesh("torus")), b = upload(backend, hashed_mesh("soup"));
                         using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, number_of_triangle>;
                         const std::vector<draw_type> draws{{a.view(), {}, {7u}}, {b.view(), {}, {9u}}};
                         vp::abuffer<Backend, glm::uvec4> lists{backend};
                         add_counts(d, vp::voxelize(backend, draws, odd_grid(), lists));
                         add_list(d, lists.to_host(backend));
                     }});
    cases.push_back(
        {"list.subset", [](Backend& backend, digest& d) {
             const mesh_data& m = hashed_mesh("torus");
             mesh_data some = m;
             some.triangles.clear();
             std::vector<std::uint32_t> numbers;
             for (std::uint32_t t = 0; t < m.triangles.size(); ++t) {
                 if (mixed(t, 5u) % 3u == 0) continue;
                 some.triangles.push_back(m.triangles[t]);
                 numbers.push_back(t);
             }
             const auto drawn = upload(backend, some);
             const typename Backend::template buffer<std::uint32_t> there(
                 backend, vp::array_view<const std::uint32_t>(numbers.data(), numbers.size()));
             vp::mesh_view<> view = drawn.view();
             view.part = {there.view(), m.triangles.size(), 0};
             const std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, number_of_triangle>> draws{{view, {}, {7u}}};
             vp::abuffer<Backend, glm::uvec4> lists{backend};
             add_counts(d, vp::voxelize(backend, draws, odd_grid(), lists));
             add_list(d, lists.to_host(backend));
         }});
}

} // namespace golden
