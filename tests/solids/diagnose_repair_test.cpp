// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// What repair::exterior did to meshes with holes, and that every repair that is named keeps the mesh's inside; what the
// repairs refuse.

#include "solid_support.hpp"

#include <voxelpipe/solid/diagnose_repair.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace solids {
namespace {

constexpr vp::fill_rule every_rule[] = {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive};

vp::solid_options flooding(int closing) { return {.repair = vp::repair::exterior, .closing = closing}; }

vp::status diagnose(const mesh& m, const vp::grid& g, const vp::solid_options& options = {}) {
    vp::cpu_backend be{2};
    return vp::diagnose_repair(be, m.view(), g, vp::passthrough{}, options);
}

// Without the faces that lie furthest in a direction.
mesh without_faces(const mesh& m, std::size_t count, glm::vec3 direction) {
    std::vector<std::pair<float, std::size_t>> order;
    for (std::size_t i = 0; i < m.triangles.size(); ++i) {
        const glm::uvec3 t = m.triangles[i];
        const glm::vec3 c = m.positions[t.x] + m.positions[t.y] + m.positions[t.z];
        order.emplace_back(-(c.x * direction.x + c.y * direction.y + c.z * direction.z), i);
    }
    std::sort(order.begin(), order.end());
    mesh open{m.positions, {}};
    for (std::size_t i = count; i < order.size(); ++i) open.triangles.push_back(m.triangles[order[i].second]);
    return open;
}
// A trough of so many voxels from side to side, open at z = 4 along its whole length.
mesh trough(float width) {
    mesh m = box({4, 14 - width / 2, 4}, {24, 14 + width / 2, 24});
    m.triangles.erase(m.triangles.begin(), m.triangles.begin() + 2);
    return m;
}

TEST(DiagnoseRepair, ASphereWithoutFortyFacesNamesItsHoleAndWhatKeepsItsInside) {
    for (const int n : {24, 48}) {
        const vp::grid g = unit_grid(glm::ivec3(n));
        const auto size = static_cast<float>(n);
        const mesh whole = sphere(glm::vec3(size / 2) + glm::vec3(0.1f, 0.2f, 0.3f), size * 0.45f, 4);
        const voxel_set inside = library_solid(whole, g, {.extent = vp::solid_extent::inner}).voxels;
        for (const glm::vec3& direction : {glm::vec3(1, 0, 0), glm::vec3(0.5f, 0.6f, 0.7f)})
            for (const std::size_t faces : {std::size_t{10}, std::size_t{40}, std::size_t{100}}) {
                if (n > 24 && (faces != 40 || direction.y == 0)) continue;
                SCOPED_TRACE(std::to_string(faces) + " faces at " + std::to_string(n));
                const mesh open = without_faces(whole, faces, direction);
                const vp::status s = diagnose(open, g);
                ASSERT_TRUE(s.ok()) << s.message();
                const vp::flood_counters& found = s.solid.flood;
                EXPECT_LT(count(inside) * 9 / 10, found.lost_voxels);
                EXPECT_EQ(found.enclosed_voxels,
                          count(library_solid(open, g, flooding(0)).voxels) - count(library_cover(open, g)));
                EXPECT_EQ(found.entered_holes, 1u);
                // A cap of the sphere with that share of its area, whose rim is a polygon of long edges.
                const float share = static_cast<float>(faces) / static_cast<float>(whole.triangles.size());
                const float across = 2 * size * 0.45f * std::sqrt(1 - (1 - 2 * share) * (1 - 2 * share));
                EXPECT_NEAR(static_cast<float>(found.hole_width), across, 2 + 0.4f * across);
                // What is named works: little of the inside is lost, all of it about the hole.
                ASSERT_GT(found.closing, 0);
                EXPECT_LE(found.closing, 2 + (static_cast<int>(found.hole_width) + 1) / 2);
                const voxel_set closed = library_solid(open, g, flooding(found.closing)).voxels;
                EXPECT_LT(count(without(inside, closed)) * 20, count(inside));
                EXPECT_EQ(diagnose(open, g, flooding(found.closing)).solid.flood.lost_voxels, 0u);
                EXPECT_EQ(found.close_holes, 1u);
                const voxel_set lids =
                    library_solid(open, g, {.extent = vp::solid_extent::outer, .repair = vp::repair::close_holes})
                        .voxels;
                EXPECT_LT(count(without(inside, lids)) * 20, count(inside));
            }
    }
}

TEST(DiagnoseRepair, TheLeastClosingOfATroughIsNamedAndOneLessLosesTheInside) {
    const vp::grid g = unit_grid(glm::ivec3(28));
    const std::size_t middle = index(g.extent, 14, 14, 14);
    for (const float width : {4.5f, 6.5f, 8.5f, 10.5f}) {
        SCOPED_TRACE(width);
        const mesh m = trough(width);
        const vp::flood_counters found = diagnose(m, g).solid.flood;
        EXPECT_GT(found.lost_voxels, 500u);
        EXPECT_EQ(found.entered_holes, 1u);
        EXPECT_EQ(found.hole_width, static_cast<unsigned>(std::ceil(width))) << "the narrow side";
        ASSERT_GT(found.closing, 0);
        EXPECT_EQ(library_solid(m, g, flooding(found.closing)).voxels[middle], 1);
        EXPECT_EQ(library_solid(m, g, flooding(found.closing - 1)).voxels[middle], 0);
    }
}

TEST(DiagnoseRepair, AClosingThatIsTooSmallIsToldWhichIsEnough) {
    const vp::grid g = unit_grid(glm::ivec3(28));
    const mesh m = trough(10.5f);
    const int enough = diagnose(m, g).solid.flood.closing;
    for (int closing = 1; closing < enough; ++closing) {
        const vp::flood_counters found = diagnose(m, g, flooding(closing)).solid.flood;
        EXPECT_GT(found.lost_voxels, 300u) << closing;
        EXPECT_EQ(found.closing, enough) << closing;
    }
    EXPECT_EQ(diagnose(m, g, flooding(enough)).solid.flood.lost_voxels, 0u);
}

TEST(DiagnoseRepair, ClosedMeshesLoseNothingAndHolesThatAreSealedDoNotCount) {
    const vp::grid g = unit_grid(glm::ivec3(28));
    const auto expect_kept = [&](const mesh& m, const char* what) {
        const vp::status s = diagnose(m, g);
        ASSERT_TRUE(s.ok()) << what << s.message();
        vp::flood_counters expected;
        expected.enclosed_voxels = count(library_solid(m, g, flooding(0)).voxels) - count(library_cover(m, g));
        EXPECT_EQ(s.solid.flood, expected) << what;
        EXPECT_GT(expected.enclosed_voxels, 0u);
    };
    expect_kept(sphere(glm::vec3(14), 12, 3), "sphere");
    expect_kept(without_faces(sphere(glm::vec3(14.1f), 11, 4), 1, {1, 0, 0}), "a hole of less than a voxel or two");
    mesh shell = box({2, 2, 2}, {26, 26, 26}); // a ball with a hole inside of a closed box
    shell.add(without_faces(sphere(glm::vec3(14), 8, 3), 40, {0, 0, 1}));
    expect_kept(shell, "the hole is not reached");
    splitmix64 random(7);
    for (int round = 0; round < 6; ++round) {
        mesh bodies = random_bodies(random, 12, 3).moved({8, 8, 8});
        bodies.add(box({2, 2, 2}, {7, 7, 7}));
        expect_kept(bodies, "random bodies");
    }
}

TEST(DiagnoseRepair, AGridWithinTheMeshIsRefused) {
    const auto code = [](const mesh& m, const vp::grid& g, int closing = 0) {
        return diagnose(m, g, flooding(closing)).code;
    };
    const vp::grid g = unit_grid(glm::ivec3(20));
    constexpr auto refused = vp::status_code::crop_without_whole, ok = vp::status_code::ok;
    const mesh around = sphere(glm::vec3(10), 30, 3);
    EXPECT_EQ(code(around, g), refused);
    EXPECT_EQ(code(around, g, 3), refused);
    EXPECT_EQ(code(around.inside_out(), g), refused);
    EXPECT_EQ(code(box({4, 4, 4}, {40, 16, 16}), unit_grid({44, 20, 20}).crop({0, 0, 0}, {20, 20, 20})), refused)
        << "as the call does";
    EXPECT_EQ(code(box({30, 30, 30}, {40, 40, 40}), g), ok) << "the grid lies outside";
    mesh shell = around; // the grid lies in the cavity of a shell
    shell.add(sphere(glm::vec3(10), 25, 3).inside_out());
    EXPECT_EQ(code(shell, g), ok);
}

TEST(DiagnoseRepair, WhatTheFloodTakesWhereTheMeshLeavesTheGridIsTheDifferenceToTheWhole) {
    const vp::grid g = unit_grid(glm::ivec3(20)), wide = unit_grid({60, 20, 20});
    const auto missing = [&](const mesh& m) { // of the crop of the whole
        const voxel_set part = library_solid(m, g, flooding(0)).voxels,
                        all = library_solid(m, wide, flooding(0)).voxels;
        std::size_t n = 0;
        for (int z = 0; z < 20; ++z)
            for (int y = 0; y < 20; ++y)
                for (int x = 0; x < 20; ++x)
                    n += all[index(wide.extent, x, y, z)] != part[index(g.extent, x, y, z)] ? 1 : 0;
        return n;
    };
    for (const mesh& m : {box({4, 4, 4}, {40, 16, 16}), sphere({18, 10, 10}, 8, 3)}) {
        const vp::status s = diagnose(m, g);
        ASSERT_TRUE(s.ok()) << s.message();
        vp::flood_counters expected;
        expected.lost_voxels = expected.face_voxels = missing(m);
        expected.close_holes = 1; // of a closed mesh rows alone say what is inside
        EXPECT_GT(expected.face_voxels, 200u);
        EXPECT_EQ(s.solid.flood, expected);
    }
    const mesh fits = box({0, 0, 0}, {20, 20, 20});
    EXPECT_EQ(diagnose(fits, g).solid.flood.lost_voxels, 0u);
    // A hole, and no grid around it: the closing is that of the hole, and what is lost at the faces stays so.
    const mesh both = without_faces(sphere({18, 10, 10}, 8, 4), 40, {-1, 0, 0});
    const vp::flood_counters found = diagnose(both, g).solid.flood;
    EXPECT_EQ(found.entered_holes, 1u);
    EXPECT_GT(found.face_voxels, 200u);
    EXPECT_EQ(diagnose(without_faces(sphere({10, 10, 10}, 8, 4), 40, {-1, 0, 0}), g).solid.flood.face_voxels, 0u);
}

TEST(DiagnoseRepair, BodiesAreFloodedEachByItself) {
    const vp::grid g = unit_grid({60, 28, 28});
    const std::vector<mesh> parts{trough(6.5f), trough(10.5f).moved({28, 0, 0})};
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    const std::vector<draw> draws{{parts[0].view(), {}, {{true}}}, {parts[1].view(), {}, {{true}}}};
    vp::cpu_backend be{2};
    for (const vp::bodies bodies : {vp::bodies::call, vp::bodies::draw}) {
        const vp::status s = vp::diagnose_repair(be, draws, g, {.bodies = bodies});
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.solid.flood.entered_holes, 2u);
        EXPECT_EQ(s.solid.flood.hole_width, 11u) << "of the widest";
        EXPECT_EQ(s.solid.flood.closing, diagnose(parts[1], g).solid.flood.closing);
        // A framebuffer of the caller's, with another target, gives the same.
        vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>,
                        vp::target<std::uint32_t, vp::blend::count>>
            fb{be, g.extent};
        using counted_draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool, std::uint32_t>>;
        std::vector<counted_draw> counted;
        for (const mesh& m : parts) counted.push_back({m.view(), {}, vp::constant(true, 1U)});
        const vp::status t = vp::diagnose_repair(be, std::span<const counted_draw>(counted), g, {.bodies = bodies}, fb);
        EXPECT_EQ(t.solid, s.solid);
    }
}

TEST(DiagnoseRepair, FailsAsTheCallDoes) {
    const vp::grid g = unit_grid(glm::ivec3(8));
    mesh m = box({1, 1, 1}, {6, 6, 6});
    EXPECT_EQ(diagnose(m, g, flooding(65)).code, vp::status_code::bad_solid_options);
    m.triangles[3].y = 99;
    EXPECT_EQ(diagnose(m, g).code, vp::status_code::index_out_of_range);
    EXPECT_EQ(diagnose(m, unit_grid(glm::ivec3(0))).code, vp::status_code::bad_extent);
    EXPECT_TRUE(diagnose(mesh{}, g).ok());
}

// ---- what the repairs refuse ----------------------------------------------------------------------------------------

TEST(Repairs, ExteriorAndVoteRefuseARuleAndAnExtentAndWriteNothing) {
    vp::cpu_backend be{2};
    const vp::grid g = unit_grid(glm::ivec3(8));
    const mesh m = box({1, 1, 1}, {6, 6, 6});
    using target = vp::target<vp::bit, vp::blend::bit_or>;
    vp::framebuffer<vp::cpu_backend, target> fb{be, g.extent};
    vp::sparse_framebuffer<vp::cpu_backend, target> sparse{be, g.extent};
    vp::abuffer<vp::cpu_backend, void> lists{be};
    const auto draw = [&](auto& out, const vp::solid_options& o) {
        return vp::voxelize_solid(be, m.view(), g, vp::passthrough{}, vp::constant(true), out, o).code;
    };
    const vp::solid_options plain;
    ASSERT_EQ(draw(fb, plain), vp::status_code::ok);
    ASSERT_EQ(draw(lists, plain), vp::status_code::ok);
    const auto before = vp::get<0>(fb).to_host(be);
    const std::size_t listed = lists.to_host(be).voxels.size();
    ASSERT_GT(listed, 0u);
    for (const vp::repair repair : {vp::repair::exterior, vp::repair::vote})
        for (const vp::fill_rule rule : every_rule)
            for (const vp::solid_extent extent :
                 {vp::solid_extent::centre, vp::solid_extent::outer, vp::solid_extent::inner}) {
                const vp::solid_options o{.rule = rule, .extent = extent, .repair = repair};
                if (rule == plain.rule && extent == plain.extent) continue;
                EXPECT_EQ(draw(fb, o), vp::status_code::bad_solid_options);
                EXPECT_EQ(draw(sparse, o), vp::status_code::bad_solid_options);
                EXPECT_EQ(draw(lists, o), vp::status_code::bad_solid_options);
            }
    EXPECT_EQ(vp::get<0>(fb).to_host(be), before);
    EXPECT_EQ(lists.to_host(be).voxels.size(), listed);
    for (const vp::repair repair : {vp::repair::exterior, vp::repair::vote})
        EXPECT_EQ(draw(fb, {.repair = repair}), vp::status_code::ok);
    // Lids go with all of them.
    for (const vp::fill_rule rule : every_rule)
        EXPECT_EQ(draw(fb, {.rule = rule, .extent = vp::solid_extent::inner, .repair = vp::repair::close_holes}),
                  vp::status_code::ok);
}

} // namespace
} // namespace solids
