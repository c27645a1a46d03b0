// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Points and segments: their voxels against an oracle in rationals and against degenerate triangles, 26-connected,
// cropped, in 64 and 128 bits; their fragments; topologies; order; errors.

#include "elements_cases.hpp"

#include "segment_oracle.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

namespace {

using namespace elements;
using unit::backend_type;

const glm::ivec3 extent{21, 18, 25};

oracle::grid oracle_grid(const vp::grid& g) {
    oracle::grid o{};
    for (int a = 0; a < 3; ++a) {
        o.origin[a] = g.origin[a];
        o.voxel_size[a] = g.voxel_size[a];
        o.extent[a] = g.whole_extent()[a];
    }
    return o;
}
// Dropped segments have no voxels.
std::optional<oracle::segment> snap(const oracle::grid& g, glm::vec3 a, glm::vec3 b) {
    const float p[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {b.x, b.y, b.z}};
    const oracle::snapped_triangle t = oracle::snap(g, p);
    if (t.dropped) return {};
    oracle::segment s{};
    for (int k = 0; k < 3; ++k) {
        s.a[k] = t.v[0][k];
        s.b[k] = t.v[1][k];
    }
    return s;
}
std::vector<oracle::voxel> voxels_of(const oracle::grid& g, const oracle::segment& s, vp::coverage rule) {
    return rule == vp::coverage::thin ? oracle::thin(g, s) : oracle::conservative(g, s);
}

struct weights {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.barycentric); }
};

TEST(Segments, CoverWhatTheOracleSays) {
    const vp::grid grid = unit::unit_grid(extent);
    const oracle::grid o = oracle_grid(grid);
    const std::vector<glm::vec3> vertices = make_vertices(1, 250, extent);
    backend_type backend = unit::make_backend();
    const vp::lines_view<> lines{vertices};
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
        vp::abuffer<backend_type, glm::vec3> lists(backend);
        const vp::status s = vp::voxelize(backend, lines, grid, vp::passthrough{}, weights{}, lists, rule);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts.triangles_in, 250u);
        EXPECT_GT(s.counts.triangles_nonfinite, 0u);
        EXPECT_GT(s.counts.triangles_too_far, 0u);
        EXPECT_EQ(s.counts.triangles_zero_area, 0u);
        std::map<std::uint32_t, std::vector<oracle::voxel>> found;
        std::map<std::uint32_t, std::map<oracle::voxel, glm::vec3>> weights_of;
        const auto host = lists.to_host(backend);
        for (const auto& [voxel, fragments] : host)
            for (const auto& [primitive, value] : fragments) {
                found[primitive].push_back({voxel.x, voxel.y, voxel.z});
                weights_of[primitive][{voxel.x, voxel.y, voxel.z}] = value;
            }
        std::uint64_t covered = 0;
        for (std::uint32_t i = 0; i < 250; ++i) {
            const auto snapped = snap(o, vertices[std::size_t{2} * i], vertices[std::size_t{2} * i + 1]);
            const std::vector<oracle::voxel> expected =
                snapped ? voxels_of(o, *snapped, rule) : std::vector<oracle::voxel>{};
            ASSERT_EQ(found[i], expected) << "segment " << i;
            covered += expected.size();
            for (const oracle::voxel& v : expected) {
                const glm::vec3 b = weights_of[i][v];
                const bool is_point = std::equal(std::begin(snapped->a), std::end(snapped->a), std::begin(snapped->b));
                if (is_point) {
                    EXPECT_EQ(b, glm::vec3(1, 0, 0));
                    continue;
                }
                // Rounded to double, then to float.
                const oracle::ratio t = oracle::parameter(o, *snapped, v);
                const oracle::ratio rest{t.denominator - t.numerator, t.denominator};
                const auto nearest = [](const oracle::ratio& r) {
                    return r.numerator.sign() == 0 ? 0.0f : static_cast<float>(oracle::nearest_double(r));
                };
                EXPECT_EQ(b, glm::vec3(nearest(rest), nearest(t), 0.0f));
            }
        }
        EXPECT_EQ(s.counts.fragments, covered);
        EXPECT_GT(covered, 500u);
    }
}

// The same voxels as the triangle a, b, b, in any grid, also where 64 bits do not suffice.
TEST(Segments, ConservativeIsTheDegenerateTriangle) {
    namespace core = vp::core;
    unit::splitmix64 random(7);
    const int cases = static_cast<int>(unit::cases(20000));
    std::uint64_t voxels = 0;
    for (int i = 0; i < cases; ++i) {
        const int fraction = static_cast<int>(random.between(1, 16));
        const std::int64_t size = std::int64_t{1} << random.between(0, i % 50 == 0 ? 40 : fraction + 5);
        const std::int64_t grain = i % 3 == 0 ? std::int64_t{1} << random.between(0, fraction) : 1;
        const auto coordinate = [&] { return random.between(-size, size) / grain * grain; };
        const core::snapped_position a{coordinate(), coordinate(), coordinate()};
        core::snapped_position b{coordinate(), coordinate(), coordinate()};
        if (i % 7 == 0) b.y = a.y;
        if (i % 11 == 0) b = {a.x + (b.x - a.x), a.y + (b.x - a.x), a.z};
        const core::voxel_box clip{{{-30, -31, -29}}, {{33, 30, 34}}};
        std::vector<std::array<std::int64_t, 3>> mine, expected;
        const auto run = [&](const auto& t) {
            core::for_each_segment_voxel<vp::coverage::conservative>(
                t, clip, [&](std::int64_t u, std::int64_t v, std::int64_t w) {
                    const auto p = core::to_xyz(t.axis, u, v, w);
                    mine.push_back({p[0], p[1], p[2]});
                });
        };
        if (core::is_narrow_segment(a, b) && i % 2 == 0)
            run(core::segment_setup<std::int64_t>(a, b, fraction));
        else
            run(core::segment_setup<vp::int128>(a, b, fraction));
        core::rasterize<core::span_rule::conservative>(
            a, b, b, fraction, clip,
            [&](const auto& t, std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
                for (std::int64_t w = w0; w <= w1; ++w) {
                    const auto p = core::to_xyz(t.axis, u, v, w);
                    expected.push_back({p[0], p[1], p[2]});
                }
            });
        voxels += mine.size();
        std::sort(mine.begin(), mine.end());
        std::sort(expected.begin(), expected.end());
        ASSERT_EQ(mine, expected) << "case " << i;
    }
    EXPECT_GT(voxels, static_cast<std::uint64_t>(cases));
}

// A voxel in every layer, each a 26-neighbour of the next: no gap that light passes through.
TEST(Segments, ThinIs26Connected) {
    namespace core = vp::core;
    unit::splitmix64 random(8);
    const int cases = static_cast<int>(unit::cases(20000));
    for (int i = 0; i < cases; ++i) {
        const int fraction = static_cast<int>(random.between(1, 16));
        const std::int64_t size = std::int64_t{1} << random.between(0, fraction + 7);
        const auto coordinate = [&] { return random.between(-size, size); };
        const core::snapped_position a{coordinate(), coordinate(), coordinate()};
        core::snapped_position b{coordinate(), coordinate(), coordinate()};
        if (i % 3 == 0) b = {a.x + (b.x - a.x), a.y - (b.x - a.x), a.z + (b.x - a.x)};
        const core::segment_setup<std::int64_t> t(a, b, fraction);
        const core::voxel_box all{{{-1000, -1000, -1000}}, {{1000, 1000, 1000}}};
        std::vector<std::array<std::int64_t, 3>> found;
        core::for_each_segment_voxel<vp::coverage::thin>(t, all, [&](std::int64_t u, std::int64_t v, std::int64_t w) {
            found.push_back({u, v, w});
        });
        ASSERT_EQ(found.size(), t.is_point ? 1u : static_cast<std::size_t>(t.last[2] + 1));
        for (std::size_t k = 1; k < found.size(); ++k)
            for (std::size_t axis = 0; axis < 3; ++axis)
                ASSERT_LE(std::abs(found[k][axis] - found[k - 1][axis]), 1) << "case " << i;
    }
}

TEST(Elements, CropsAndThreadsChangeNothing) {
    const std::vector<glm::vec3> vertices = make_vertices(3, 150, extent);
    const vp::grid whole = unit::unit_grid(extent), part = whole.crop({4, 3, 6}, {11, 10, 15});
    const vp::lines_view<> lines{.positions = vertices, .copies = {2}};
    const vp::points_view<> points{.positions = vertices, .copies = {2}};
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
        backend_type one = unit::make_backend(1), three = unit::make_backend(3);
        const results a = draw_all(one, lines, whole, rule), of_points = draw_all(one, points, whole, rule);
        expect_same(a, draw_all(three, lines, whole, rule));
        expect_same(of_points, draw_all(three, points, whole, rule));
        EXPECT_GT(of_points.counts.fragments, 100u);
        EXPECT_EQ(a.counts.triangles_in, 300u);
        EXPECT_EQ(of_points.counts.triangles_in, 600u);
        const results b = draw_all(three, lines, part, rule);
        const auto at = [](const results& r, const glm::ivec3& e, glm::ivec3 p) { return r.ids[unit::linear(e, p)]; };
        unit::for_each_voxel(part.extent, [&](int x, int y, int z) {
            EXPECT_EQ(at(b, part.extent, {x, y, z}), at(a, whole.extent, glm::ivec3(x, y, z) + part.offset));
        });
    }
}

// A voxel's number counts the elements of all instances, and draws.
// Parts of the grid, down to a single voxel, whose lists take few bytes at once.
TEST(Elements, BoundedListsChangeNothing) {
    const std::vector<glm::vec3> vertices = make_vertices(6, 60, extent);
    const vp::grid grid = unit::unit_grid(extent).crop({2, 3, 1}, {17, 12, 20});
    backend_type backend = unit::make_backend();
    const vp::lines_view<> lines{.positions = vertices, .copies = {2}};
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
        const results expected = draw_all(backend, lines, grid, rule);
        EXPECT_GT(expected.counts.fragments_discarded, 0u);
        for (const std::uint64_t bytes : {20'000u, 1'000u})
            expect_same(expected, draw_all(backend, lines, grid, {rule, 1 << 20, bytes}));
    }
    const std::vector<glm::vec3> same(40, glm::vec3(9.5f));
    const vp::points_view<> points{same};
    expect_same(draw_all(backend, points, grid, vp::coverage::thin),
                draw_all(backend, points, grid, {vp::coverage::thin, 1 << 20, 1}));
}

TEST(Elements, HaveFieldsAndOrder) {
    const std::vector<glm::vec3> vertices{{1.5f, 2.5f, 3.5f}, {9.5f, 2.5f, 3.5f}, {9.5f, 8.5f, 3.5f}};
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    using draw = vp::draw<vp::lines_view<>, place, payload_shader>;
    const vp::lines_view<> strip{.positions = vertices, .topology = vp::line_topology::strip},
        loop{.positions = vertices, .topology = vp::line_topology::loop, .copies = {2}};
    const std::vector<draw> draws{{strip, {}, {}}, {loop, {}, {}}};
    vp::abuffer<backend_type, payload> lists(backend);
    const vp::status s = vp::voxelize(backend, draws, grid, lists, vp::coverage::thin);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts.triangles_in, 8u);
    const auto host = lists.to_host(backend);
    // Segment 0 of the strip and of the loop's first copy in voxel (4, 2, 3), whose layer's centre is at 3 / 8.
    const auto fragments = host.find({4, 2, 3});
    ASSERT_EQ(fragments.size(), 4u); // and of the second copy, from 4 to 12, with its closing segment
    EXPECT_EQ(fragments[3].primitive, 7u);
    const std::uint32_t numbers[] = {0, 2, 5};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto [primitive, p] = fragments[i];
        EXPECT_EQ(primitive, numbers[i]);
        EXPECT_EQ(p.triangle, 0u);
        EXPECT_EQ(p.draw, i == 0 ? 0u : 1u);
        EXPECT_EQ(p.axis, 0u);
        EXPECT_EQ(p.front, 1u);
        EXPECT_EQ(p.normal, glm::vec3(0));
        EXPECT_EQ(p.barycentric, i < 2 ? glm::vec3(0.625f, 0.375f, 0) : glm::vec3(0.9375f, 0.0625f, 0));
        EXPECT_EQ(p.along, i < 2 ? 4.5f : 2.0f);
        EXPECT_EQ(p.clamped, p.along);
    }
    // The loop's last segment ends where the first began.
    const auto closing = host.find({1, 2, 3});
    ASSERT_EQ(closing.size(), 3u); // the strip's first, the loop's first and last
    EXPECT_EQ(closing[2].primitive, 4u);

    // Indices in place of order.
    const std::vector<std::uint32_t> indices{2, 0, 1, 2};
    const vp::lines_view<> list{.positions = vertices, .indices = indices};
    EXPECT_EQ(list.num_lines(), 2u);
    EXPECT_TRUE(vp::voxelize(backend, list, grid, place{}, payload_shader{}, lists, vp::coverage::thin).ok());
    EXPECT_EQ(lists.to_host(backend).find({9, 5, 3})[0].value.triangle, 1u);
}

// Blending onto loaded targets, off targets, and status of a call.
TEST(Elements, LoadAndCheck) {
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    const std::vector<glm::vec3> point{{3.25f, 4.5f, 5.75f}};
    vp::framebuffer<backend_type, vp::target<float, blend::add>, vp::target<std::uint32_t, blend::count>> fb{backend,
                                                                                                             extent};
    const auto run = [&](const auto& view) {
        return vp::voxelize(backend, view, grid, vp::passthrough{}, vp::constant(0.5f, 0u), fb, vp::coverage::thin);
    };
    EXPECT_EQ(run(vp::points_view<>{point}).counts.voxels, 1u);
    vp::get<0>(fb).load();
    vp::get<1>(fb).off();
    EXPECT_TRUE(run(vp::points_view<>{point}).ok());
    EXPECT_EQ(vp::get<0>(fb).to_host_target(backend)(3, 4, 5), 1.0f);
    EXPECT_EQ(vp::get<1>(fb).to_host_target(backend)(3, 4, 5), 1u);
    EXPECT_TRUE(run(vp::points_view<>{}).nothing_drawn());
    // Conservative: a point on a corner touches eight voxels.
    const std::vector<glm::vec3> corner{{3, 4, 5}};
    vp::abuffer<backend_type> lists(backend);
    EXPECT_TRUE(
        vp::voxelize(backend, vp::points_view<>{corner}, grid, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_EQ(lists.num_voxels(), 8u);
    const std::vector<std::uint32_t> bad{0, 1};
    EXPECT_EQ(run(vp::lines_view<>{point, bad}).code, vp::status_code::index_out_of_range);
    const vp::status many = run(vp::points_view<>{.positions = point, .copies = {5'000'000'000}});
    EXPECT_FALSE(many.ok());
}

} // namespace
