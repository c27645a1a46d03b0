// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"
#include "framebuffer_cell.cuh"

namespace bench::gpu {

namespace {

struct height {
    float value;
};

// Interpolates one of the coordinates: every fragment needs barycentrics and three vertices' values, and no two
// fragments give the same.
struct pass_height {
    template <class Vertex>
    VOXELPIPE_HD vp::vertex_output<height> operator()(const Vertex& v) const {
        return {v.position, {v.position.z}};
    }
};
struct give_height {
    VOXELPIPE_HD vp::output<float> operator()(const vp::fragment<height>& f) const {
        return vp::outputs(f.varyings.value);
    }
};

} // namespace

cell_pointer make_float_add_varying(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                                    bool tracks) {
    using cell = framebuffer_cell<vp::target<float, vp::blend::add>, pass_height, give_height>;
    return std::make_unique<cell>(s, mesh, grid, rule, give_height{}, std::nullopt, false, tracks);
}

} // namespace bench::gpu
