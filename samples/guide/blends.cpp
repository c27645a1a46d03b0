// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Blends of one's own: an order-free one that keeps the nearest of two surfaces with its material, and an ordered one
// that composites layers. Exits with 0 when both give what a fold by hand gives.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

// snippet: order-free
struct surface { // a target's value: any trivially copyable struct
    float distance;
    std::uint32_t material;
    bool operator==(const surface&) const = default; // for_each_occupied compares it with the empty one
};

struct nearest {
    static constexpr bool order_free = true;                        // combine is associative and commutative
    VOXELPIPE_HD surface identity() const { return {INFINITY, 0}; } // combine(identity(), v) is v
    VOXELPIPE_HD surface combine(surface a, surface b) const {
        if (a.distance != b.distance) return a.distance < b.distance ? a : b;
        return a.material < b.material ? a : b; // ties must not depend on the order either
    }
};
// end snippet

// snippet: ordered
struct over {                                 // the later primitive covers the earlier one, as far as it is opaque
    static constexpr bool order_free = false; // folded in primitive order
    VOXELPIPE_HD glm::vec2 identity() const { return {0, 0}; } // colour times opacity, opacity
    VOXELPIPE_HD glm::vec2 combine(glm::vec2 below, glm::vec2 above) const {
        const float rest = 1 - above.y;
        return {vp::exact::fma(rest, below.x, above.x), vp::exact::fma(rest, below.y, above.y)};
    }
};
// end snippet

struct layer { // its draw's number is its material
    float opacity = 0.5f;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const auto number = static_cast<float>(f.draw + 1);
        return vp::outputs(surface{number, f.draw}, glm::vec2(number * opacity, opacity));
    }
};

int main() {
    const std::vector<glm::vec3> positions{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}};
    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
    const vp::grid grid{{0, 0, -0.5}, {1, 1, 1}, {4, 4, 1}};
    vp::framebuffer<vp::cpu_backend, vp::target<surface, nearest>, vp::target<glm::vec2, over>> picture{backend,
                                                                                                        grid.extent};

    // snippet: draws
    // Several meshes in one call share the types of their shaders; draw i's triangles come before those of draw i + 1.
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, layer>;
    const std::vector<draw> draws{{mesh, {}, {0.5f}}, {mesh, {}, {0.25f}}};
    vp::voxelize(backend, draws, grid, picture).or_throw();
    // end snippet

    const surface near = vp::get<0>(picture).to_host_target(backend)(1, 1, 0);
    int occupied = 0;
    vp::for_each_occupied(vp::get<0>(picture).to_host_target(backend),
                          [&](const glm::ivec3&, const surface&) { ++occupied; });
    const glm::vec2 mixed = vp::get<1>(picture).to_host_target(backend)(1, 1, 0);
    const bool good = occupied != 0 && near.distance == 1 && near.material == 0 && mixed.x == 0.75f * 0.5f + 0.5f &&
                      mixed.y == 0.625f;
    std::printf("nearest %u, composited %g with opacity %g\n", near.material, static_cast<double>(mixed.x),
                static_cast<double>(mixed.y));
    return good ? 0 : 1;
}
