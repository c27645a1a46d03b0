// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A-buffers with a payload.

#include "case_support.hpp"

namespace {

using namespace golden;

struct depth_and_weights {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::vec4(f.barycentric, f.normal.z));
    }
};

void lists(digest& digest, unsigned threads, const mesh_data& m, const vp::grid& grid, vp::coverage rule) {
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

} // namespace

GOLDEN_CASE("small_soup.lists.conservative") { lists(digest, threads, small_soup(), odd_grid(), conservative); }
GOLDEN_CASE("large_soup.lists.thin") { lists(digest, threads, large_soup(), unit_grid({80, 64, 70}), thin); }
GOLDEN_CASE("odd_shapes.lists.conservative") {
    lists(digest, threads, odd_shapes(), unit_grid({16, 16, 16}), conservative);
}
