// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The A-buffer on a backend, against the oracle's fragments: order, offsets, payloads, discard, crop, reuse.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <ranges>

namespace {

namespace vp = voxelpipe;
using unit::backend_type;
using unit::mark;

const glm::ivec3 extent{70, 35, 33};

struct payload {
    std::uint64_t value;
    std::uint32_t triangle, draw;
};
struct payload_shader {
    bool discards = false;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = mark(f.primitive, f.voxel);
        return vp::outputs(payload{m, f.triangle, f.draw}).discard_if(discards && m % 3 == 0);
    }
};

// The oracle's fragments in a part of the grid, in the order of an A-buffer.
std::vector<unit::model_fragment> expected_lists(const vp::grid& grid, vp::coverage rule,
                                                 const std::vector<unit::small_mesh>& draws, bool discards) {
    std::vector<unit::model_fragment> inside;
    for (auto f : unit::fragments_of(grid, rule, draws)) {
        if (discards && mark(f.primitive, f.voxel) % 3 == 0) continue;
        const glm::ivec3 local = f.voxel - grid.offset;
        bool in = true;
        for (int a = 0; a < 3; ++a) in = in && local[a] >= 0 && local[a] < grid.extent[a];
        if (in) inside.push_back(f);
    }
    std::stable_sort(inside.begin(), inside.end(), [](const auto& a, const auto& b) {
        if (a.voxel.z != b.voxel.z) return a.voxel.z < b.voxel.z;
        if (a.voxel.y != b.voxel.y) return a.voxel.y < b.voxel.y;
        return a.voxel.x < b.voxel.x;
    });
    return inside;
}

template <class Payload>
void expect_equal(const vp::host_abuffer<Payload>& got, const vp::grid& grid,
                  const std::vector<unit::model_fragment>& expected) {
    ASSERT_EQ(got.primitives.size(), expected.size());
    ASSERT_EQ(got.offsets.size(), got.voxels.empty() ? 0 : got.voxels.size() + 1);
    std::size_t i = 0;
    std::uint64_t before = 0;
    for (std::size_t v = 0; v < got.voxels.size(); ++v) {
        ASSERT_TRUE(v == 0 || got.voxels[v] > before) << "voxel ids ascend";
        before = got.voxels[v];
        ASSERT_EQ(got.offsets[v], i);
        const glm::ivec3 local = got.position(got.voxels[v]);
        ASSERT_GT(got.offsets[v + 1], got.offsets[v]);
        for (; i < got.offsets[v + 1]; ++i) {
            ASSERT_LT(i, expected.size());
            ASSERT_EQ(local + grid.offset, expected[i].voxel);
            ASSERT_EQ(got.primitives[i], expected[i].primitive);
            if constexpr (std::is_same_v<Payload, payload>) {
                ASSERT_EQ(got.payloads[i].value, mark(expected[i].primitive, expected[i].voxel));
                ASSERT_EQ(got.payloads[i].triangle, expected[i].triangle);
                ASSERT_EQ(got.payloads[i].draw, expected[i].draw);
            }
        }
    }
    ASSERT_EQ(i, expected.size());
}

class AbufferLists : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(AbufferLists, AreTheOraclesFragmentsByVoxelAndPrimitive) {
    const unit::small_mesh a = unit::make_mesh(1, 120, extent), b = unit::make_mesh(2, 60, extent);
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, payload_shader>;
    backend_type backend = unit::make_backend();
    const auto on_a = a.on(backend), on_b = b.on(backend);
    vp::abuffer<backend_type, payload> lists{backend};
    const vp::grid whole = unit::unit_grid(extent);
    for (const bool discards : {false, true})
        for (const vp::grid& grid : {whole, whole.crop({5, 6, 7}, {60, 20, 25}), whole.crop({0, 0, 32}, {70, 35, 1})}) {
            const draw draws[]{{on_a.view(), {}, {discards}}, {on_b.view(), {}, {discards}}};
            const vp::status s = vp::voxelize(backend, std::span<const draw>(draws), grid, lists, GetParam());
            ASSERT_TRUE(s.ok()) << s.message();
            const auto expected = expected_lists(grid, GetParam(), {a, b}, discards);
            expect_equal(lists.to_host(backend), grid, expected);
            EXPECT_EQ(s.counts.fragments, expected.size());
            EXPECT_EQ(s.counts.voxels, lists.num_voxels());
            EXPECT_EQ(lists.num_fragments(), expected.size());
            EXPECT_EQ(lists.extent, grid.extent);
            EXPECT_EQ(s.counts.fragments_discarded > 0, discards);
        }
}

TEST_P(AbufferLists, WithoutPayloadHoldOnlyPrimitiveNumbers) {
    const unit::small_mesh mesh = unit::make_mesh(3, 150, extent);
    backend_type backend = unit::make_backend();
    vp::abuffer<backend_type> lists{backend};
    const vp::grid grid = unit::unit_grid(extent);
    vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, vp::constant(), lists, GetParam()).or_throw();
    expect_equal(lists.to_host(backend), grid, expected_lists(grid, GetParam(), {mesh}, false));
    EXPECT_EQ(lists.payloads.size(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Both, AbufferLists, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& p) { return p.param == vp::coverage::thin ? "thin" : "conservative"; });

using sum_shader = unit::float_shader;

TEST(Abuffer, FoldedWithABlendIsTheFramebuffer) {
    const unit::small_mesh mesh = unit::make_mesh(4, 200, extent);
    backend_type backend = unit::make_backend();
    const vp::grid grid = unit::unit_grid(extent);
    vp::abuffer<backend_type, float> lists{backend};
    using target = vp::target<float, vp::blend::add>;
    vp::framebuffer<backend_type, target> fb{backend, extent};
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
        vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, sum_shader{}, lists, rule).or_throw();
        vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, sum_shader{}, fb, rule).or_throw();
        std::vector<float> folded(static_cast<std::size_t>(extent.x * extent.y * extent.z), 0.0f);
        for (const auto& [voxel, fragments] : lists.to_host(backend)) {
            auto sum = target::traits::begin(0.0f);
            std::uint32_t last = 0;
            for (const auto [triangle, value] : fragments) {
                ASSERT_TRUE(last <= triangle);
                last = triangle;
                target::traits::apply(sum, value);
            }
            folded[unit::linear(extent, voxel)] = target::traits::end(sum);
        }
        EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), folded));
    }
}

TEST(Abuffer, IsEmptyIfNothingIsCovered) {
    unit::small_mesh far;
    far.positions = {{1000, 0, 0}, {1001, 0, 0}, {1000, 1, 0}};
    far.triangles = {{0, 1, 2}};
    backend_type backend = unit::make_backend();
    vp::abuffer<backend_type, float> lists{backend};
    const vp::status s =
        vp::voxelize(backend, far.on(backend), unit::unit_grid(extent), vp::passthrough{}, sum_shader{}, lists);
    ASSERT_TRUE(s.ok());
    EXPECT_EQ(s.counts.triangles_outside, 1u);
    EXPECT_EQ(lists.num_voxels(), 0u);
    const auto host = lists.to_host(backend);
    EXPECT_TRUE(host.voxels.empty() && host.offsets.empty() && host.primitives.empty() && host.payloads.empty());
    int voxels = 0;
    for ([[maybe_unused]] const auto& entry : host) ++voxels;
    EXPECT_EQ(voxels, 0);
}

TEST(Abuffer, ACallThatFailsLeavesEarlierListsAsTheyWere) {
    const unit::small_mesh good = unit::make_mesh(5, 100, extent);
    unit::small_mesh bad = unit::make_mesh(6, 100, extent);
    bad.triangles[77].z = static_cast<std::uint32_t>(bad.positions.size());
    vp::grid wrong = unit::unit_grid(extent);
    wrong.voxel_size.y = 0;
    backend_type backend = unit::make_backend();
    vp::abuffer<backend_type, float> lists{backend};
    vp::voxelize(backend, good.on(backend), unit::unit_grid(extent), vp::passthrough{}, sum_shader{}, lists).or_throw();
    const auto before = lists.to_host(backend);
    ASSERT_GT(before.primitives.size(), 0u);
    // Another extent; computed and constant fragments; and a call that is refused before it starts.
    const vp::grid other = unit::unit_grid({60, 30, 31});
    EXPECT_EQ(vp::voxelize(backend, bad.on(backend), other, vp::passthrough{}, sum_shader{}, lists).code,
              vp::status_code::index_out_of_range);
    EXPECT_EQ(vp::voxelize(backend, bad.on(backend), other, vp::passthrough{}, vp::constant(1.0f), lists).code,
              vp::status_code::index_out_of_range);
    EXPECT_EQ(vp::voxelize(backend, good.on(backend), wrong, vp::passthrough{}, sum_shader{}, lists).code,
              vp::status_code::bad_voxel_size);
    const auto after = lists.to_host(backend);
    EXPECT_EQ(after.extent, extent);
    EXPECT_EQ(after.voxels, before.voxels);
    EXPECT_EQ(after.offsets, before.offsets);
    EXPECT_EQ(after.primitives, before.primitives);
    EXPECT_TRUE(unit::same_bytes(after.payloads, before.payloads));
}

// A million fragments in one voxel, so that its count exceeds 16 bits.
TEST(Abuffer, HoldsManyFragmentsOfOneVoxel) {
    unit::small_mesh m;
    m.positions = {{1.25f, 1.25f, 1.25f}, {1.75f, 1.25f, 1.25f}, {1.25f, 1.75f, 1.25f}};
    m.triangles.assign(static_cast<std::size_t>(unit::cases(1'000'000)), {0, 1, 2});
    backend_type backend = unit::make_backend();
    vp::abuffer<backend_type> lists{backend};
    vp::voxelize(backend, m.on(backend), unit::unit_grid(glm::ivec3(3)), vp::passthrough{}, vp::constant(), lists)
        .or_throw();
    const auto host = lists.to_host(backend);
    ASSERT_EQ(host.voxels, (std::vector<std::uint64_t>{13}));
    ASSERT_EQ(host.offsets, (std::vector<std::uint64_t>{0, m.triangles.size()}));
    for (std::uint32_t i = 0; i < host.primitives.size(); ++i) ASSERT_EQ(host.primitives[i], i);
}

// Lists copied to the host are a range of ranges that the standard's algorithms take; a voxel is found in it, and a
// primitive number leads back to its draw and triangle.
TEST(AbufferOnHost, IsARangeOfRangesInWhichVoxelsAreFound) {
    backend_type be = unit::make_backend();
    const unit::small_mesh a = unit::make_mesh(21, 40, extent), b = unit::make_mesh(22, 25, extent), none;
    const auto ma = a.on(be), mb = b.on(be), mn = none.on(be);
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, payload_shader>;
    const std::vector<draw> draws{{ma, {}, {}}, {mn, {}, {}}, {mb, {}, {}}, {ma, {}, {}}};
    vp::grid whole = unit::unit_grid(extent);
    const vp::grid g = whole.crop({3, 4, 5}, {60, 30, 20});
    vp::abuffer<backend_type, payload> lists{be};
    vp::voxelize(be, draws, g, lists).or_throw();
    const vp::host_abuffer<payload> host = lists.to_host(be);

    static_assert(std::ranges::random_access_range<const vp::host_abuffer<payload>>);
    static_assert(std::ranges::sized_range<const vp::host_abuffer<payload>>);
    static_assert(std::ranges::random_access_range<decltype(host[0].fragments)>);
    static_assert(std::ranges::sized_range<decltype(host[0].fragments)>);

    const vp::primitive_map where(draws);
    EXPECT_EQ(where.size(), 105u);
    std::size_t fragments = 0, i = 0;
    for (const auto& [voxel, list] : host) {
        EXPECT_EQ(host[i++].voxel, voxel);
        EXPECT_EQ(host.position(host.id(voxel)), voxel);
        const auto found = host.find(voxel);
        ASSERT_EQ(found.size(), list.size());
        EXPECT_TRUE(std::ranges::is_sorted(list, {}, [](const auto& f) { return f.primitive; }));
        for (std::size_t k = 0; k < list.size(); ++k) {
            EXPECT_EQ(found[k].primitive, list[k].primitive);
            const auto [d, t] = where(list[k].primitive);
            EXPECT_EQ(list[k].value.draw, d);
            EXPECT_EQ(list[k].value.triangle, t);
        }
        fragments += list.size();
    }
    EXPECT_EQ(i, host.size());
    EXPECT_EQ(fragments, lists.num_fragments());
    std::size_t found = 0; // every voxel of the part is found or not
    for (int z = -1; z <= g.extent.z; ++z)
        for (int y = -1; y <= g.extent.y; ++y)
            for (int x = -1; x <= g.extent.x; ++x) found += host.find({x, y, z}).empty() ? 0u : 1u;
    EXPECT_EQ(found, host.size());
    EXPECT_EQ(where(0), (vp::draw_triangle{0, 0}));
    EXPECT_EQ(where(39), (vp::draw_triangle{0, 39}));
    EXPECT_EQ(where(40), (vp::draw_triangle{2, 0}));
    EXPECT_EQ(where(104), (vp::draw_triangle{3, 39}));
}

} // namespace
