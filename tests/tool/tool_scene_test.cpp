// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Scenes through the tool's pipeline. Lines and points: their voxels are those of the library, beside triangles, after
// them in order and number. Instances, which share a draw where they follow each other: nothing shows it.
#include "tool_test.hpp"

#include <cpu_ref/backend.hpp>
#include <draw/surface.hpp>
#include <draw/voxelizer.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <span>

using namespace tool_test;
using voxelize::target;
namespace vp = voxelpipe;

namespace {

voxelize::primitive lines_of(std::vector<glm::vec3> positions, std::vector<glm::uvec2> lines,
                             std::vector<glm::vec4> colors = {}) {
    voxelize::primitive part;
    part.positions = std::move(positions);
    part.lines = std::move(lines);
    part.colors = std::move(colors);
    return part;
}

voxelize::voxelize_request request_of(const glm::ivec3& extent, std::vector<target> targets) {
    voxelize::voxelize_request request;
    request.grid.extent = extent;
    request.targets = std::move(targets);
    request.backend = voxelize::backend_choice::cpu;
    request.threads = 2;
    return request;
}

template <class T>
std::vector<T> values(const voxelize::volume& v, std::string_view name) {
    const voxelize::channel& c = *v.find(name);
    std::vector<T> list(c.data.size() / sizeof(T));
    std::memcpy(list.data(), c.data.data(), c.data.size());
    return list;
}

TEST(ToolLines, VoxelsAreTheLibrarys) {
    voxelize::scene scene;
    scene.materials.resize(1);
    scene.primitives.push_back(lines_of({{1, 2, 3}, {14.3F, 9.1F, 5.7F}, {2.5F, 2.5F, 2.5F}, {8, 8, 8}},
                                        {{0, 1}, {1, 2}, {2, 2}, {3, 3}, {0, 3}}));
    voxelize::affine moved;
    moved.m[0][3] = 0.75;
    scene.instances = {{0, {}}, {0, moved}};
    for (const vp::coverage coverage : {vp::coverage::conservative, vp::coverage::thin}) {
        voxelize::voxelize_request request = request_of({17, 16, 15}, {target::occupancy, target::count});
        request.coverage = coverage;
        voxelize::voxelize_stats stats;
        voxelize::scene copy = scene;
        const voxelize::volume found = voxelize::run_voxelizer(std::move(copy), request, stats);
        EXPECT_EQ(10U, stats.lines);
        EXPECT_EQ(0U, stats.triangles);

        std::vector<glm::vec3> positions = scene.primitives[0].positions;
        std::vector<std::uint32_t> indices{0, 1, 1, 2, 2, 2, 3, 3, 0, 3};
        for (std::size_t i = 0; i < 4; ++i) positions.push_back(positions[i] + glm::vec3(0.75F, 0, 0));
        for (std::size_t i = 0; i < 10; ++i) indices.push_back(indices[i] + 4);
        vp::cpu_backend backend(1);
        vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, vp::blend::count>> fb{backend, request.grid.extent};
        const vp::lines_view<> lines{.positions = positions, .indices = indices};
        const vp::status s = vp::voxelize(backend, lines, request.grid, voxelize::placed_vertex_shader{},
                                          vp::constant(1U), fb, coverage);
        ASSERT_TRUE(s.ok());
        const std::vector<std::uint32_t> expected = vp::get<0>(fb).to_host(backend);
        EXPECT_EQ(expected, values<std::uint32_t>(found, "count"));
        EXPECT_EQ(s.counts.voxels, stats.voxels);
        EXPECT_EQ(s.counts.fragments, stats.fragments);
        EXPECT_EQ(s.counts.voxels, static_cast<std::uint64_t>(found.popcount(*found.find("occupancy"))));
    }
}

// Two cubes' worth of voxels along x: a plane of two triangles at z = 2.5, and a line in it and beyond it.
voxelize::scene plane_and_line() {
    voxelize::scene scene;
    scene.materials.resize(2);
    scene.materials[0].base_color = {1, 0, 0, 1};
    scene.materials[1].base_color = {0, 0, 1, 1};
    voxelize::primitive plane;
    plane.positions = {{0.5F, 0.5F, 2.5F}, {3.5F, 0.5F, 2.5F}, {3.5F, 3.5F, 2.5F}, {0.5F, 3.5F, 2.5F}};
    plane.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.primitives.push_back(lines_of({{2.25F, 2.25F, 2.5F}, {7.25F, 2.25F, 2.5F}}, {{0, 1}, {1, 1}}));
    scene.primitives[0].material = 1;
    scene.primitives.push_back(std::move(plane));
    scene.instances = {{0, {}}, {1, {}}};
    return scene;
}

TEST(ToolLines, ComeAfterTrianglesInNumberAndOrder) {
    const voxelize::voxelize_request request =
        request_of({8, 4, 4}, {target::count, target::triangle, target::material, target::color_replace,
                               target::color_outer, target::normal});
    voxelize::voxelize_stats stats;
    const voxelize::volume v = voxelize::run_voxelizer(plane_and_line(), request, stats);
    const auto numbers = values<std::int32_t>(v, "triangle"), materials = values<std::int32_t>(v, "material");
    const auto last = values<glm::u8vec4>(v, "color-replace"), outer = values<glm::u8vec4>(v, "color-outer");
    const auto normals = values<glm::vec3>(v, "normal");
    const auto at = [&](int x, int y) { return static_cast<std::size_t>(v.index(x, y, 2)); };
    const glm::u8vec4 red(255, 0, 0, 255), blue(0, 0, 255, 255);
    EXPECT_EQ(2U, stats.triangles);
    EXPECT_EQ(2U, stats.lines);
    EXPECT_EQ(16U + 4U, stats.voxels); // the plane's, and the line's beyond it
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 4; ++y) {
            const bool in_plane = x < 4, on_line = y == 2 && x >= 2;
            const std::size_t i = at(x, y);
            EXPECT_EQ(on_line ? x == 7 ? 3 : 2 : in_plane ? std::min(numbers[i], 1) : -1, numbers[i]) << x << ' ' << y;
            EXPECT_EQ(on_line ? 1 : in_plane ? 0 : -1, materials[i]);
            EXPECT_EQ(on_line ? blue : in_plane ? red : glm::u8vec4(0), last[i]);
            // A triangle, which has a side, is seen before a line.
            EXPECT_EQ(in_plane ? red : on_line ? blue : glm::u8vec4(0), outer[i]);
            EXPECT_EQ(in_plane ? glm::vec3(0, 0, 1) : glm::vec3(0), normals[i]);
        }
    EXPECT_EQ(4U, stats.normals_cancelled);
}

TEST(ToolLines, SlabsDoNotShow) {
    const scratch_folder folder;
    gltf_test::lined_world().write_glb(folder / "m.glb");
    const char* all = "occupancy,count,color,color-max,color-replace,color-outer,normal,material,triangle,depth";
    const char* size = gltf_test::is_slow_build() ? "70" : "100"; // --work-memory 1 parts both
    for (const char* coverage : {"conservative", "thin"}) {
        const auto voxelize = [&](const char* out, const char* memory, const char* threads) {
            const outcome result = run(folder, {folder / "m.glb", "-q", "-o", folder / out, "-r", size, "--coverage",
                                                coverage, "--work-memory", memory, "-j", threads, "-t", all});
            ASSERT_EQ(0, result.code) << result.err;
        };
        voxelize("whole.npz", "1000", "1");
        voxelize("slabs.npz", "1", "2");
        EXPECT_TRUE(read_file(folder / "whole.npz") == read_file(folder / "slabs.npz"));
    }
}

// A layer's centre may lie beyond the end of a line that reaches into it: the end's colour is taken there.
TEST(ToolLines, ColoursDoNotRunPastTheEnds) {
    voxelize::scene scene;
    scene.materials.resize(1);
    scene.primitives.push_back(
        lines_of({{0.9F, 0.5F, 0.5F}, {5.1F, 0.5F, 0.5F}}, {{0, 1}}, {glm::vec4(1, 0, 0, 1), glm::vec4(0, 0, 1, 1)}));
    scene.instances = {{0, {}}};
    voxelize::voxelize_request request = request_of({6, 1, 1}, {target::color, target::depth});
    request.coverage = vp::coverage::thin;
    request.depth_axis = 0;
    voxelize::voxelize_stats stats;
    const voxelize::volume v = voxelize::run_voxelizer(std::move(scene), request, stats);
    const auto colors = values<glm::u8vec4>(v, "color");
    const auto depths = values<float>(v, "depth");
    EXPECT_EQ(glm::u8vec4(255, 0, 0, 255), colors.front());
    EXPECT_EQ(glm::u8vec4(0, 0, 255, 255), colors.back());
    EXPECT_EQ(0.9F, depths.front());
    EXPECT_EQ(5.1F, depths.back());
    for (std::size_t x = 1; x < 6; ++x) {
        EXPECT_LT(colors[x].r, colors[x - 1].r);
        EXPECT_GT(colors[x].b, colors[x - 1].b);
    }
    for (std::size_t x = 1; x < 5; ++x) EXPECT_NEAR(static_cast<float>(x) + 0.5F, depths[x], 1e-5F);
}

TEST(ToolLines, MasksCutThem) {
    voxelize::scene scene;
    scene.materials.resize(1);
    scene.materials[0].alpha = voxelize::alpha_mode::mask;
    scene.primitives.push_back(
        lines_of({{0.5F, 0.5F, 0.5F}, {7.5F, 0.5F, 0.5F}}, {{0, 1}}, {glm::vec4(1, 1, 1, 1), glm::vec4(1, 1, 1, 0)}));
    scene.instances = {{0, {}}};
    voxelize::voxelize_stats stats;
    (void)voxelize::run_voxelizer(std::move(scene), request_of({8, 1, 1}, {target::occupancy}), stats);
    EXPECT_EQ(4U, stats.voxels); // alpha 1, 6/7, 5/7, 4/7
    EXPECT_EQ(4U, stats.fragments_discarded);
}

TEST(ToolLines, EncloseNothing) {
    const scratch_folder folder;
    gltf_test::lined_world().write_glb(folder / "m.glb");
    const outcome both = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "20", "--solid", "nonzero"});
    EXPECT_EQ(0, both.code);
    EXPECT_NE(std::string::npos, both.err.find("12 line(s) and point(s) enclose nothing: --solid leaves them out"))
        << both.err;
    builder lines;
    gltf_test::add_vertices(lines, 1, {0, 0, 0, 1, 1, 1}, {1, 1, 1, 1, 1, 1});
    lines.write_glb(folder / "l.glb");
    const outcome alone = run(folder, {folder / "l.glb", "-o", folder / "o.npy", "--solid", "nonzero"});
    EXPECT_EQ(2, alone.code);
    EXPECT_NE(std::string::npos, alone.err.find("only lines and points, which enclose nothing")) << alone.err;
}

// A position that is not a number, or cannot be snapped, drops its lines alone.
TEST(ToolLines, ThatCannotBeDrawnAreCounted) {
    voxelize::scene scene;
    scene.materials.resize(1);
    scene.primitives.push_back(lines_of({{0.5F, 0.5F, 0.5F}, {3.5F, 0.5F, 0.5F}, {std::nanf(""), 0, 0}, {1e30F, 0, 0}},
                                        {{0, 1}, {0, 2}, {3, 3}}));
    scene.instances = {{0, {}}};
    voxelize::voxelize_stats stats;
    (void)voxelize::run_voxelizer(std::move(scene), request_of({4, 1, 1}, {target::occupancy}), stats);
    EXPECT_EQ(4U, stats.voxels);
    EXPECT_EQ(2U, stats.lines_dropped);
    EXPECT_EQ(0U, stats.triangles_dropped);
}

// Five copies of a primitive, one of them mirrored, around one of another; then lines, twice.
voxelize::scene copies() {
    voxelize::scene scene;
    scene.materials.resize(2);
    scene.materials[1].base_color = {0, 0.5F, 1, 1};
    voxelize::primitive corner, plate;
    corner.positions = {{0.1F, 0.2F, 0.3F}, {4.7F, 0.4F, 0.9F}, {0.6F, 5.2F, 1.1F}, {0.8F, 0.7F, 4.9F}};
    corner.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    corner.colors = {glm::vec4(1, 0, 0, 1), glm::vec4(0, 1, 0, 1), glm::vec4(0, 0, 1, 1), glm::vec4(1)};
    plate.positions = {{2, 2, 2.5F}, {9, 2, 2.5F}, {9, 9, 3.5F}};
    plate.triangles = {{0, 1, 2}};
    plate.material = 1;
    scene.primitives = {std::move(corner), std::move(plate),
                        lines_of({{0, 0, 0}, {7, 7, 7}, {3, 3, 3}}, {{0, 1}, {2, 2}})};
    const auto at = [](double x, double y, double z, double turn = 1) {
        voxelize::affine a;
        a.m = {{{turn, 0.1, 0, x}, {0, 1, 0.2, y}, {0.05, 0, 1, z}}};
        return a;
    };
    scene.instances = {{0, at(0, 0, 0)}, {0, at(3.2, 1, 0.5)}, {2, at(0, 1, 0)}, {0, at(9, 2, 1, -1)},
                       {1, at(0, 0, 0)}, {0, at(5, 5, 5)},     {2, at(2, 0, 4)}, {0, at(6.5, 4, 3)}};
    return scene;
}

TEST(ToolInstances, AreDrawnAsPrimitivesOfTheirOwnWouldBe) {
    voxelize::scene apart = copies(); // whose every instance has a primitive of its own
    apart.primitives.clear();
    for (voxelize::instance& shown : apart.instances) {
        apart.primitives.push_back(copies().primitives[shown.primitive]);
        shown.primitive = static_cast<std::uint32_t>(apart.primitives.size() - 1);
    }
    const std::vector<target> all{target::occupancy,     target::count,       target::color,  target::color_max,
                                  target::color_replace, target::color_outer, target::normal, target::material,
                                  target::triangle,      target::depth};
    for (const bool solid : {false, true})
        for (const vp::coverage coverage : {vp::coverage::conservative, vp::coverage::thin}) {
            voxelize::voxelize_request request = request_of({16, 14, 12}, all);
            request.coverage = coverage;
            if (solid) request.solid.emplace().rule = voxelize::solid_rule::each_draw;
            voxelize::voxelize_stats stats, stats_apart;
            const voxelize::volume v = voxelize::run_voxelizer(copies(), request, stats);
            voxelize::scene copy = apart;
            const voxelize::volume w = voxelize::run_voxelizer(std::move(copy), request, stats_apart);
            EXPECT_EQ(stats_apart.fragments, stats.fragments);
            EXPECT_EQ(stats_apart.voxels, stats.voxels);
            EXPECT_LT(100U, stats.voxels);
            ASSERT_EQ(w.channels.size(), v.channels.size());
            for (std::size_t i = 0; i < v.channels.size(); ++i)
                EXPECT_TRUE(w.channels[i].data == v.channels[i].data) << v.channels[i].name;
        }
}

} // namespace
