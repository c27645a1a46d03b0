// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// A shader that computes: the cosine of the light, added up in floats.
#include <voxelpipe/voxelpipe.hpp>

namespace vp = voxelpipe;

struct cosine {
    glm::vec3 light;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(vp::exact::dot(f.normal, light)); }
};

vp::status draw_computed_sum(vp::cuda_backend& backend, const vp::mesh_view<>& mesh, const vp::grid& grid,
                             const vp::framebuffer_view<vp::target<float, vp::blend::add>>& out) {
    return vp::voxelize(backend, mesh, grid, vp::passthrough{}, cosine{{0, 0, 1}}, out);
}
