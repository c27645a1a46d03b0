// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Blends that a user defines: small order-free ones by compare-and-swap, all others folded in triangle order.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

// Keeps the value with the largest key; small enough for an atomic.
struct keyed {
    std::uint16_t key;
    std::uint16_t value;
};
struct largest_key {
    static constexpr bool order_free = true;
    VOXELPIPE_HD keyed identity() const { return {0, 0}; }
    VOXELPIPE_HD keyed combine(keyed a, keyed b) const {
        return b.key > a.key || (b.key == a.key && b.value > a.value) ? b : a;
    }
};
struct over {
    static constexpr bool order_free = false;
    VOXELPIPE_HD glm::vec3 identity() const { return glm::vec3(0.0f); }
    VOXELPIPE_HD glm::vec3 combine(const glm::vec3& a, const glm::vec3& b) const {
        return {vp::exact::lerp(a.x, b.x, 0.25f), vp::exact::lerp(a.y, b.y, 0.25f), vp::exact::lerp(a.z, b.z, 0.25f)};
    }
};

struct user_values {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = mix_bits(f.primitive + static_cast<std::uint32_t>(f.voxel.x + 64 * f.voxel.y));
        const keyed k{static_cast<std::uint16_t>(h % 50), static_cast<std::uint16_t>(h >> 16)};
        const auto p = static_cast<std::int32_t>(f.primitive);
        return vp::outputs(k, extent_of{{p, f.voxel.x, f.axis}, {p, f.voxel.y, f.axis}}, h, f.normal, h % 2 == 0, 1.0f)
            .discard_if(h % 7 == 0);
    }
};

TEST(Cells, UserBlendsAreTheCpus) {
    for (const vp::coverage rule : both_rules)
        for (const start how : {start::clear, start::load})
            expect_same<vp::target<keyed, largest_key>, vp::target<extent_of, join>, vp::target<std::uint32_t, chain>,
                        vp::target<glm::vec3, over, vp::layout::planar>, vp::target<vp::bit, blend::bit_xor>,
                        vp::target<float, blend::add>>(mixed_triangles(2000, 40.0f, 5), box_grid({40, 33, 47}),
                                                       vp::passthrough{}, user_values{}, rule, how);
}

struct user_struct_value {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto p = static_cast<std::int32_t>(f.primitive);
        return vp::outputs(extent_of{{p, p, p}, {f.voxel.x, f.voxel.y, f.voxel.z}});
    }
};
TEST(Cells, ReplacedUserStructsAreTheCpus) {
    for (const vp::coverage rule : both_rules)
        expect_same<vp::target<extent_of, blend::replace>>(mixed_triangles(2000, 40.0f, 6), box_grid({40, 33, 47}),
                                                           vp::passthrough{}, user_struct_value{}, rule);
}
TEST(Cells, OrderedTargetsAloneAreTheCpus) {
    for (const vp::coverage rule : both_rules)
        expect_same<vp::target<extent_of, join>>(mixed_triangles(2000, 40.0f, 7), box_grid({40, 33, 47}),
                                                 vp::passthrough{}, user_struct_value{}, rule);
}

} // namespace
