// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// A sum whose shader the library cannot see through, drawn in tiles: what tests of policies, streams and workspaces
// compare with.

#include "cells.hpp"

namespace device_test {

// Constant, but the library cannot know it.
struct computed {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment&) const {
        return vp::outputs(0.3f);
    }
};

template <class Selector>
std::vector<float> run_policy(const mesh_data& m, const vp::grid& g, vp::coverage rule, vp::counters& counts) {
    vp::cuda_backend be;
    be.strategy = vp::strategy::tiled;
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, vp::target<float, voxelpipe::blend::add>> fb{be, g.extent};
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, computed>;
    const draw_type d{mesh.view(), {}, computed{}};
    const vp::status s = be.run<Selector>(std::span<const draw_type>(&d, 1), g, fb.view(), vp::voxelize_options{rule},
                                          m.triangles.size());
    EXPECT_TRUE(s.ok()) << s.message();
    counts = s.counts;
    return vp::get<0>(fb).to_host(be);
}

} // namespace device_test
