// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The floats that a fragment shader reads, to the last bit: normal and barycentrics of triangles that show every
// rounding (tests/golden/hard_triangles.hpp), and varyings and clamped values by the steps that docs/design.md writes
// out.

#include "api_model.hpp"
#include "hard_triangles.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>

namespace {

namespace vp = voxelpipe;
using golden::hard_triangles;
using unit::backend_type;

const glm::ivec3 extent{16}; // 2^16 units a voxel

struct surface {
    float heat;
    glm::vec2 uv;
    vp::flat<std::uint32_t> id;
};
struct surface_vertex {
    VOXELPIPE_HD vp::vertex_output<surface> operator()(const vp::vertex<glm::vec3, std::uint32_t>& v) const {
        const glm::vec3 a = vp::get<0>(v);
        return {v.position, {a.x, {a.y, a.z}, {vp::get<1>(v)}}};
    }
};
struct told {
    glm::vec3 normal, barycentric, clamped;
    surface varyings, clamped_varyings;
};
struct tells {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface>& f) const {
        return vp::outputs(told{f.normal, f.barycentric, f.clamped_barycentric(), f.varyings, f.clamped_varyings()});
    }
};

struct scene {
    std::vector<glm::vec3> positions, attributes;
    std::vector<glm::uvec3> triangles;
    std::vector<std::uint32_t> ids;

    scene() {
        unit::splitmix64 random(11);
        for (const golden::hard_triangle& t : hard_triangles) {
            const auto n = static_cast<std::uint32_t>(positions.size());
            triangles.emplace_back(n, n + 1, n + 2);
            for (const auto& v : t.vertices) {
                glm::vec3 p, a;
                for (int k = 0; k < 3; ++k) {
                    p[k] = std::ldexp(static_cast<float>(v[k]), -16);
                    a[k] = static_cast<float>(unit::spread_double(random, -4, 4));
                }
                positions.push_back(p);
                attributes.push_back(a);
                ids.push_back(static_cast<std::uint32_t>(random.next()));
            }
        }
    }
};

const scene& shared_scene() {
    static const scene s;
    return s;
}

struct fragment {
    glm::ivec3 voxel;
    std::uint32_t triangle;
    told told_values;
};

std::vector<fragment> fragments_of(vp::coverage rule) {
    const scene& s = shared_scene();
    backend_type backend = unit::make_backend();
    const vp::mesh<backend_type, glm::vec3, std::uint32_t> mesh{backend, s.positions, s.triangles, s.attributes, s.ids};
    vp::abuffer<backend_type, told> lists{backend};
    vp::voxelize(backend, mesh, unit::unit_grid(extent), surface_vertex{}, tells{}, lists, rule).or_throw();
    std::vector<fragment> out;
    const auto host = lists.to_host(backend);
    for (const auto& [voxel, list] : host)
        for (const auto [triangle, values] : list) out.push_back({voxel, triangle, values});
    return out;
}

std::array<std::uint32_t, 3> bits_of(const glm::vec3& v) {
    return {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y), std::bit_cast<std::uint32_t>(v.z)};
}

class FragmentFloats : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(FragmentFloats, NormalIsTheExactOneRoundedStepByStep) {
    std::array<int, hard_triangles.size()> seen{};
    for (const fragment& f : fragments_of(GetParam())) {
        const golden::hard_triangle& t = hard_triangles[f.triangle];
        ++seen[f.triangle];
        ASSERT_EQ(bits_of(f.told_values.normal), std::to_array(t.normal)) << t.name << ", triangle " << f.triangle;
    }
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_GT(seen[i], 0) << "triangle " << i;
}

TEST_P(FragmentFloats, BarycentricIsTheExactRatioRoundedToDoubleThenFloat) {
    std::size_t seen = 0, known = 0;
    for (const golden::hard_triangle& t : hard_triangles) known += t.voxel[0] >= 0 ? 1 : 0;
    for (const fragment& f : fragments_of(GetParam())) {
        const golden::hard_triangle& t = hard_triangles[f.triangle];
        if (f.voxel != glm::ivec3(t.voxel[0], t.voxel[1], t.voxel[2])) continue;
        ++seen;
        ASSERT_EQ(bits_of(f.told_values.barycentric), std::to_array(t.barycentric))
            << t.name << ", triangle " << f.triangle;
    }
    EXPECT_EQ(seen, known);
}

float mixed(float a, float b, float c, const glm::vec3& weights) {
    const float ab = b - a, ac = c - a;
    return std::fma(weights.z, ac, std::fma(weights.y, ab, a));
}

surface expected_varyings(std::uint32_t triangle, const glm::vec3& weights) {
    const std::size_t first = std::size_t{3} * triangle;
    const auto& s = shared_scene();
    const glm::vec3 &a = s.attributes[first], &b = s.attributes[first + 1], &c = s.attributes[first + 2];
    return {
        mixed(a.x, b.x, c.x, weights), {mixed(a.y, b.y, c.y, weights), mixed(a.z, b.z, c.z, weights)}, {s.ids[first]}};
}

bool same(const surface& a, const surface& b) {
    return bits_of({a.heat, a.uv}) == bits_of({b.heat, b.uv}) && a.id.value == b.id.value;
}

// a + y (b - a) + z (c - a): two differences, then a fused step for b and one for c.
TEST_P(FragmentFloats, VaryingsAreTwoFusedStepsFromTheFirstVertex) {
    for (const fragment& f : fragments_of(GetParam())) {
        const told& t = f.told_values;
        ASSERT_TRUE(same(t.varyings, expected_varyings(f.triangle, t.barycentric))) << "triangle " << f.triangle;
        ASSERT_TRUE(same(t.clamped_varyings, expected_varyings(f.triangle, t.clamped))) << "triangle " << f.triangle;
    }
}

// Negative weights become 0; the rest is divided by (x + y) + z.
TEST_P(FragmentFloats, ClampedWeightsAreDividedByTheirSum) {
    int negative = 0;
    for (const fragment& f : fragments_of(GetParam())) {
        const glm::vec3& b = f.told_values.barycentric;
        const float x = b.x > 0 ? b.x : 0.0f, y = b.y > 0 ? b.y : 0.0f, z = b.z > 0 ? b.z : 0.0f;
        const float xy = x + y, sum = xy + z;
        ASSERT_EQ(bits_of(f.told_values.clamped), bits_of({x / sum, y / sum, z / sum})) << "triangle " << f.triangle;
        negative += b.x < 0 || b.y < 0 || b.z < 0 ? 1 : 0;
    }
    EXPECT_GT(negative, 10);
}

INSTANTIATE_TEST_SUITE_P(Both, FragmentFloats, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& p) { return p.param == vp::coverage::thin ? "thin" : "conservative"; });

} // namespace
