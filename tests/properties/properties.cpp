// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Library calls that several files share. Each is a whole pipeline, so each is compiled once.

#include "properties.hpp"

namespace properties {
namespace {

struct shade {
    vp::output<bool, std::uint32_t, glm::vec3, glm::ivec3> operator()(const vp::fragment<>& f) const {
        return vp::outputs(true, f.primitive, f.barycentric, f.voxel);
    }
};

} // namespace

std::vector<voxels> library_sets(const grid& g, const std::vector<world_triangle>& triangles, vp::coverage rule,
                                 unsigned threads) {
    const oracle::soup mesh(triangles);
    vp::cpu_backend be(threads);
    vp::abuffer<vp::cpu_backend> lists{be};
    vp::voxelize(be, mesh.view(), oracle::as_library(g), vp::passthrough{}, vp::constant(true), lists, rule).or_throw();
    return oracle::voxels_by_triangle(lists.to_host(be), triangles.size(), oracle::whole_of(g));
}

image library_image(const vp::grid& g, const std::vector<world_triangle>& triangles, vp::coverage rule) {
    const oracle::soup mesh(triangles);
    vp::cpu_backend be(2);
    vp::framebuffer<vp::cpu_backend, occupancy_target, last_target, sum_target, place_target> fb{be, g.extent};
    vp::get<1>(fb).clear(0xffffffffu);
    vp::get<3>(fb).clear(glm::ivec3(-1));
    const vp::status s = vp::voxelize(be, mesh.view(), g, vp::passthrough{}, shade{}, fb, rule).or_throw();
    return {vp::get<0>(fb).to_host_target(be), vp::get<1>(fb).to_host_target(be), vp::get<2>(fb).to_host_target(be),
            vp::get<3>(fb).to_host_target(be), s.counts};
}

std::vector<world_triangle> all_kinds(splitmix64& random, const test_grid& where, int of_each) {
    std::vector<world_triangle> list;
    for (const triangle_class kind : oracle::all_triangle_classes) {
        if (oracle::covers_much(kind) && !where.dense) continue;
        const int count = oracle::covers_much(kind) ? (of_each + 7) / 8 : of_each;
        for (int n = 0; n < count; ++n) list.push_back(oracle::make_triangle(random, where, kind));
    }
    return list;
}

} // namespace properties
