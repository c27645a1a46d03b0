// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Calls that draw nothing are successes that clear: without draws, without triangles, with triangles outside or of NaN
// only. vp::clear does what such a call does. What a call takes: options by name, a coverage, draws in a vector.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;

const glm::ivec3 extent{13, 7, 5};
using framebuffer = vp::framebuffer<backend_type, vp::target<float, blend::add>, vp::target<vp::bit, blend::bit_or>,
                                    vp::target<std::uint32_t, blend::count, vp::layout::tiled>>;
const auto shader = vp::constant(1.0f, true, 1u);

unit::small_mesh one_triangle(glm::vec3 at) {
    unit::small_mesh m;
    m.positions = {at, at + glm::vec3(3, 0, 1), at + glm::vec3(0, 3, 1)};
    m.triangles = {{0, 1, 2}};
    return m;
}

void draw(backend_type& backend, framebuffer& fb) {
    const vp::mesh mesh = one_triangle({1, 1, 1}).on(backend);
    vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::passthrough{}, shader, fb).or_throw();
}

void expect_cleared(backend_type& backend, const framebuffer& fb, float value) {
    for (const float v : vp::get<0>(fb).to_host(backend)) ASSERT_EQ(v, value);
    for (const std::uint32_t v : vp::get<1>(fb).to_host(backend)) ASSERT_EQ(v, 0u);
    for (const std::uint32_t v : vp::get<2>(fb).to_host(backend)) ASSERT_EQ(v, 0u);
}

TEST(NothingDrawn, IsASuccessThatClears) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    unit::small_mesh none, vertices_only, outside = one_triangle({100, 0, 0}), nans = one_triangle({nan, nan, nan});
    vertices_only.positions = {{1, 1, 1}};
    float value = 2.0f;
    for (const unit::small_mesh& m : {none, vertices_only, outside, nans}) {
        backend_type backend = unit::make_backend();
        framebuffer fb{backend, extent};
        draw(backend, fb);
        vp::get<0>(fb).clear(++value);
        const vp::mesh mesh = m.on(backend);
        const vp::status s = vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::passthrough{}, shader, fb);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_TRUE(s.nothing_drawn());
        EXPECT_EQ(s.counts.triangles_in, m.triangles.size());
        EXPECT_EQ(s.counts.voxels, 0u);
        expect_cleared(backend, fb, value);

        vp::abuffer<backend_type> lists{backend};
        const vp::mesh full = one_triangle({1, 1, 1}).on(backend);
        const vp::status drawn =
            vp::voxelize(backend, full, unit::unit_grid(extent), vp::passthrough{}, vp::constant(), lists);
        EXPECT_TRUE(drawn.ok());
        EXPECT_FALSE(drawn.nothing_drawn());
        EXPECT_GT(lists.num_voxels(), 0u);
        EXPECT_TRUE(vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::passthrough{}, vp::constant(), lists)
                        .nothing_drawn());
        EXPECT_EQ(lists.num_voxels(), 0u);
        EXPECT_EQ(lists.num_fragments(), 0u);
        EXPECT_EQ(lists.to_host(backend).extent, extent);
    }
}

TEST(NothingDrawn, LeavesWhatIsLoadedAndWhatIsOff) {
    backend_type backend = unit::make_backend();
    framebuffer fb{backend, extent};
    draw(backend, fb);
    const auto sums = vp::get<0>(fb).to_host(backend);
    const auto counts = vp::get<2>(fb).to_host(backend);
    vp::get<0>(fb).load();
    vp::get<2>(fb).off();
    const vp::mesh none = unit::small_mesh{}.on(backend);
    ASSERT_TRUE(vp::voxelize(backend, none, unit::unit_grid(extent), vp::passthrough{}, shader, fb).ok());
    EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), sums));
    EXPECT_TRUE(unit::same_bytes(vp::get<2>(fb).to_host(backend), counts));
    const auto bits = vp::get<1>(fb).to_host(backend);
    EXPECT_TRUE(std::all_of(bits.begin(), bits.end(), [](std::uint32_t w) { return w == 0; }));
}

TEST(Clear, WritesTheClearValuesWithoutADraw) {
    backend_type backend = unit::make_backend();
    framebuffer fb{backend, extent};
    vp::get<0>(fb).clear(-7.0f);
    vp::get<2>(fb).off();
    EXPECT_TRUE(vp::clear(backend, fb).ok()); // of memory that nothing was written to
    vp::get<2>(fb).clear(0);
    EXPECT_TRUE(vp::clear(backend, fb).ok());
    expect_cleared(backend, fb, -7.0f);
    draw(backend, fb);
    EXPECT_TRUE(vp::clear(backend, fb.view()).ok());
    expect_cleared(backend, fb, -7.0f);
    vp::get<1>(fb).clear(true);
    EXPECT_TRUE(vp::clear(backend, fb).ok());
    const auto bits = vp::get<1>(fb).to_host_target(backend);
    for (int x = 0; x < extent.x; ++x) EXPECT_TRUE(bits(x, 6, 4));
    EXPECT_EQ(bits.elements.front(), 0x1fffu); // bits past the extent stay 0
}

TEST(Clear, RefusesWhatCallsRefuse) {
    backend_type backend = unit::make_backend();
    framebuffer none{backend, {0, 4, 4}};
    EXPECT_EQ(vp::clear(backend, none).code, vp::status_code::bad_extent);
    framebuffer fb{backend, extent};
    auto view = fb.view();
    vp::get<0>(view.targets).elements = nullptr;
    EXPECT_EQ(vp::clear(backend, view).code, vp::status_code::null_view);
    view = fb.view();
    view.extent.x += 1;
    EXPECT_EQ(vp::clear(backend, view).code, vp::status_code::extent_mismatch);
}

TEST(Arguments, OptionsByNameACoverageAndDrawsInAnyContainer) {
    backend_type backend = unit::make_backend();
    const vp::grid grid = unit::unit_grid(extent);
    const unit::small_mesh shape = one_triangle({1, 1, 1});
    const vp::mesh mesh = shape.on(backend);
    framebuffer fb{backend, extent};
    const auto voxels = [&](const vp::status& s) { return s.or_throw().counts.voxels; };
    const auto fragments = [&](const vp::status& s) { return s.or_throw().counts.fragments; };
    const auto thin = fragments(vp::voxelize(backend, mesh, grid, vp::passthrough{}, shader, fb, vp::coverage::thin));
    const auto all = fragments(vp::voxelize(backend, mesh, grid, vp::passthrough{}, shader, fb));
    EXPECT_LT(thin, all);
    const vp::status s = vp::voxelize(backend, mesh, grid, vp::passthrough{}, shader, fb,
                                      {.rule = vp::coverage::thin, .count_voxels = false});
    EXPECT_EQ(fragments(s), thin);
    EXPECT_EQ(voxels(s), 0u);
    EXPECT_EQ(fragments(vp::voxelize(backend, mesh, grid, vp::passthrough{}, shader, fb, {})), all);

    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<float, bool, std::uint32_t>>;
    const std::vector<draw_type> draws(3, draw_type{mesh, {}, shader});
    const std::array<draw_type, 2> two{draws[0], draws[1]};
    EXPECT_EQ(fragments(vp::voxelize(backend, draws, grid, fb)), 3 * all);
    EXPECT_EQ(fragments(vp::voxelize(backend, two, grid, fb, vp::coverage::thin)), 2 * thin);
    EXPECT_EQ(fragments(vp::voxelize(backend, std::span<const draw_type>(draws), grid, fb.view(), vp::coverage::thin)),
              3 * thin);
    using id_draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<>>;
    const std::vector<id_draw> ids(2, id_draw{mesh, {}, {}});
    vp::abuffer<backend_type> lists{backend};
    EXPECT_EQ(fragments(vp::voxelize(backend, ids, grid, lists, {.rule = vp::coverage::thin})), 2 * thin);
}

TEST(Arguments, ATransformThatIsNotAffineIsRefused) {
    backend_type backend = unit::make_backend();
    const vp::mesh mesh = one_triangle({1, 1, 1}).on(backend);
    framebuffer fb{backend, extent};
    for (int column = 0; column < 4; ++column) {
        glm::mat4 m(1.0f);
        m[column][3] += 0.5f;
        EXPECT_EQ(vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::transform{m}, shader, fb).code,
                  vp::status_code::not_affine);
    }
    EXPECT_TRUE(vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::transform{}, shader, fb).ok());
}

} // namespace
