// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// The five programs in one, linked with voxelpipe::cuda_kernels. Needs no device: each call is refused for its grid.
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;
using bits = vp::framebuffer_view<vp::target<vp::bit, vp::blend::bit_or>>;
using sums = vp::framebuffer_view<vp::target<float, vp::blend::add>>;
using maxima = vp::framebuffer_view<vp::target<float, vp::blend::max>>;
using lists = vp::abuffer<vp::cuda_backend, void>;

vp::status draw_constant_bit(vp::cuda_backend&, const vp::mesh_view<>&, const vp::grid&, const bits&);
vp::status draw_constant_sum(vp::cuda_backend&, const vp::mesh_view<>&, const vp::grid&, const sums&);
vp::status draw_constant_max(vp::cuda_backend&, const vp::mesh_view<>&, const vp::grid&, const maxima&);
vp::status draw_computed_sum(vp::cuda_backend&, const vp::mesh_view<>&, const vp::grid&, const sums&);
vp::status draw_primitive_lists(vp::cuda_backend&, const vp::mesh_view<>&, const vp::grid&, lists&);

int main() {
    vp::cuda_backend backend;
    vp::grid grid;
    grid.extent = {0, 0, 0};
    const vp::mesh_view<> mesh;
    lists no_lists(backend);
    const vp::status results[] = {
        draw_constant_bit(backend, mesh, grid, bits{}), draw_constant_sum(backend, mesh, grid, sums{}),
        draw_constant_max(backend, mesh, grid, maxima{}), draw_computed_sum(backend, mesh, grid, sums{}),
        draw_primitive_lists(backend, mesh, grid, no_lists)};
    int wrong = 0;
    for (const vp::status& s : results) wrong += s.code == vp::status_code::bad_extent ? 0 : 1;
    if (wrong != 0) std::printf("%d of 5 calls did not refuse the extent\n", wrong);
    return wrong;
}
