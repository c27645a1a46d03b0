// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// mesh_view::part: what a subset of a mesh's triangles draws is what these triangles draw in the whole.

#include "api_model.hpp"

#include <gtest/gtest.h>

namespace {

namespace vp = voxelpipe;
using backend_type = vp::cpu_backend;

const glm::ivec3 extent{40, 38, 36};

// Sees every number. The whole draws only what `keeps` says, a subset has nothing else.
struct numbers_of_some {
    std::uint32_t modulus, rest;
    auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(std::uint64_t{f.primitive} << 32 | f.triangle << 8 | f.draw << 4 | f.instance)
            .discard_if(f.triangle % modulus != rest);
    }
};

// Triangles whose number leaves `rest`, with their numbers.
struct some_triangles {
    std::vector<glm::uvec3> triangles;
    std::vector<std::uint32_t> numbers;
    some_triangles(const unit::small_mesh& m, std::uint32_t modulus, std::uint32_t rest) {
        for (std::uint32_t i = rest; i < m.triangles.size(); i += modulus) {
            triangles.push_back(m.triangles[i]);
            numbers.push_back(i);
        }
    }
    [[nodiscard]] vp::mesh_view<> view(const unit::small_mesh& m, std::uint64_t copies) const {
        vp::mesh_view<> v{m.positions, triangles};
        v.copies.count = copies;
        v.part = {vp::array_view<const std::uint32_t>(numbers), m.triangles.size()};
        return v;
    }
};

using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, numbers_of_some>;

class Subset : public ::testing::TestWithParam<vp::coverage> {
protected:
    // The first draw whole or as a subset, a second one of two instances, which is a subset or whole.
    void SetUp() override {
        for (std::uint32_t rest = 0; rest < 3; ++rest) parts.emplace_back(b, 3, rest);
    }
    unit::small_mesh a = unit::make_mesh(1, 30, extent), b = unit::make_mesh(2, 40, extent);
    std::vector<some_triangles> parts;
    backend_type backend = unit::make_backend();
    vp::grid grid = unit::unit_grid(extent);

    [[nodiscard]] std::vector<draw_type> whole(std::uint32_t rest) const {
        vp::mesh_view<> v = b.view();
        v.copies.count = 2;
        const numbers_of_some all{1, 0}, some{3, rest};
        return {{a.view(), {}, all}, {v, {}, some}, {a.view(), {}, all}};
    }
    [[nodiscard]] std::vector<draw_type> subset(std::uint32_t rest) const {
        const numbers_of_some all{1, 0};
        return {{a.view(), {}, all}, {parts[rest].view(b, 2), {}, all}, {a.view(), {}, all}};
    }
};
INSTANTIATE_TEST_SUITE_P(Coverages, Subset,
                         ::testing::Values(vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair));

TEST_P(Subset, ListsAndReplaceHaveTheNumbersOfTheWhole) {
    for (std::uint32_t rest = 0; rest < 3; ++rest) {
        vp::abuffer<backend_type, std::uint64_t> expected{backend}, lists{backend};
        vp::voxelize(backend, whole(rest), grid, expected, GetParam()).or_throw();
        vp::voxelize(backend, subset(rest), grid, lists, GetParam()).or_throw();
        const auto e = expected.to_host(backend), l = lists.to_host(backend);
        EXPECT_GT(l.primitives.size(), 500u);
        EXPECT_EQ(l.voxels, e.voxels);
        EXPECT_EQ(l.offsets, e.offsets);
        EXPECT_EQ(l.primitives, e.primitives);
        EXPECT_EQ(l.payloads, e.payloads);

        using last = vp::framebuffer<backend_type, vp::target<std::uint64_t, vp::blend::replace>>;
        last dense{backend, extent}, of_subset{backend, extent};
        vp::voxelize(backend, whole(rest), grid, dense, GetParam()).or_throw();
        vp::voxelize(backend, subset(rest), grid, of_subset, GetParam()).or_throw();
        EXPECT_EQ(vp::get<0>(of_subset).to_host(backend), vp::get<0>(dense).to_host(backend));
    }
}

TEST(SubsetChecks, NumbersThatCannotBeAreRefused) {
    const unit::small_mesh m = unit::make_mesh(3, 6, extent);
    backend_type backend = unit::make_backend();
    vp::abuffer<backend_type> lists{backend};
    const auto code = [&](std::vector<std::uint32_t> numbers, std::uint64_t whole) {
        vp::mesh_view<> v = m.view();
        v.part = {vp::array_view<const std::uint32_t>(numbers), whole};
        return vp::voxelize(backend, v, unit::unit_grid(extent), vp::passthrough{}, vp::constant(true), lists).code;
    };
    EXPECT_EQ(code({0, 1, 2, 3, 4, 9}, 10), vp::status_code::ok);
    EXPECT_EQ(code({0, 1, 2, 3, 4}, 10), vp::status_code::bad_subset);     // one is missing
    EXPECT_EQ(code({0, 1, 2, 3, 4, 10}, 10), vp::status_code::bad_subset); // beyond the whole
    EXPECT_EQ(code({0, 1, 3, 3, 4, 5}, 10), vp::status_code::bad_subset);  // twice
    EXPECT_EQ(code({0, 1, 4, 3, 5, 6}, 10), vp::status_code::bad_subset);  // not ascending
    EXPECT_EQ(code({0, 1, 2, 3, 4, 5}, 5), vp::status_code::bad_subset);   // more than the whole
    EXPECT_EQ(code({0, 1, 2, 3, 4, 5}, std::uint64_t{1} << 32), vp::status_code::too_many_triangles);
}

} // namespace
