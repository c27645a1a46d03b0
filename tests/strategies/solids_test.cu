// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// voxelize_solid gives cpu_backend's bytes and counters: rules, bodies and extents, every kind of target, layout, blend
// and load, crops, A-buffers, ties, large triangles and many draws.
#include "solid_drawings.hpp"

using namespace device_test;

TEST(Solids, EveryRuleBodyAndExtentIntoEveryKindOfTarget) {
    const drawing_of_everything drawing{three_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    int i = 0;
    for_all_options([&](const vp::solid_options& options) {
        drawing.expect_same(box_grid({37, 26, 25}), options,
                            std::array{loading::clear, loading::load, loading::some_off}[i++ % 3]);
    });
}

TEST(Solids, EveryRuleBodyAndExtentIntoBits) {
    const drawing_of_bits drawing{three_meshes(), {{}}, {{true}}}, one{{tied_bodies(24.0f, 12, 5)}, {{}}, {{true}}};
    for_all_options([&](const vp::solid_options& options) {
        drawing.expect_same(box_grid({70, 26, 25}), options, loading::load);
        one.expect_same(box_grid({64, 26, 25}), options);
    });
}

// Rows from less than a word to more than a warp takes at once.
TEST(Solids, RowsOfEveryLength) {
    for (const int nx : {1, 31, 32, 33, 64, 96, 200, 512, 1030, 2100}) {
        SCOPED_TRACE(nx);
        mesh_data m = tied_bodies(20.0f, 9, 7);
        for (glm::vec3& p : m.positions) p.x *= static_cast<float>(nx) / 20.0f;
        const drawing_of_bits drawing{{m}, {{}}, {{true}}};
        drawing.expect_same(box_grid({nx, 9, 14}), {.rule = vp::fill_rule::even_odd});
        drawing.expect_same(box_grid({nx, 9, 14}), {.rule = vp::fill_rule::nonzero});
        drawing.expect_same(box_grid({nx, 9, 14}), {.rule = vp::fill_rule::even_odd, .extent = vp::solid_extent::outer},
                            loading::load);
    }
}

// ---- lists ----------------------------------------------------------------------------------------------------------

TEST(Solids, EveryRuleBodyAndExtentIntoLists) {
    for_all_options([&](const vp::solid_options& options) {
        expect_same_lists<std::uint32_t>(three_meshes(), id_of_fragment{5}, box_grid({37, 21, 23}), options);
    });
}

// Rows of more entries than a warp sorts, and shorter ones beside them.
TEST(Solids, RowsOfManyCrossings) {
    mesh_data m;
    for (int i = 0; i < 90; ++i)
        add_box(m, {12.5f * static_cast<float>(i), 0.5f, 0.25f * static_cast<float>(i % 7)},
                {12.5f * static_cast<float>(i) + 14.0f, 2.5f, 3.0f}, i % 5 == 4);
    const drawing_of_bits one{{m}, {{}}, {{true}}}, two{{m, tied_bodies(9.0f, 4, 2)}, {{}}, {{true}}};
    for (const auto rule : all_rules) {
        one.expect_same(box_grid({1130, 4, 5}), {.rule = rule}, loading::load);
        two.expect_same(box_grid({1130, 4, 5}), {.rule = rule, .bodies = vp::bodies::draw});
        expect_same_lists<std::uint32_t>({m}, id_of_fragment{2}, box_grid({1130, 4, 5}), {.rule = rule});
    }
}

// ---- grids ----------------------------------------------------------------------------------------------------------

// Parts of a grid, and voxels that are no cubes.
TEST(Solids, Crops) {
    vp::grid g = box_grid({40, 30, 28});
    g.voxel_size = {0.5, 1.0, 0.75};
    const drawing_of_everything everything_drawn{three_meshes(), {{0.0f}}, {{1, 0.5f}}};
    const drawing_of_bits bits{three_meshes(), {{}}, {{true}}};
    for (const auto& [begin, size] :
         {std::pair{glm::ivec3(0, 0, 0), glm::ivec3(9, 30, 28)}, std::pair{glm::ivec3(9, 4, 7), glm::ivec3(31, 17, 13)},
          std::pair{glm::ivec3(5, 11, 12), glm::ivec3(1, 1, 1)}}) {
        SCOPED_TRACE(begin.x);
        for (const auto extent : all_extents)
            for (const auto rule : all_rules) {
                everything_drawn.expect_same(g.crop(begin, size), {.rule = rule, .extent = extent});
                bits.expect_same(g.crop(begin, size), {.rule = rule, .extent = extent});
            }
    }
}

// Extents that the 32-bit raster of the cover does not serve.
TEST(Solids, LongGrids) {
    mesh_data m = tied_bodies(12.0f, 9, 3);
    for (glm::vec3& p : m.positions) p.x *= 700.0f;
    add_box(m, {-2e6f, 1.5f, 2.5f}, {4000.5f, 5.5f, 7.5f}); // in 128 bits
    const drawing_of_bits drawing{{m, tied_bodies(9.0f, 3, 8)}, {{}}, {{true}}};
    for (const auto extent : all_extents)
        for (const auto of : all_bodies) drawing.expect_same(box_grid({9000, 9, 11}), {.bodies = of, .extent = extent});
}

// More rows than 32 bits number, in lists.
TEST(Solids, MoreRowsThan32BitsNumber) {
    mesh_data m = tied_bodies(5.0f, 5, 3);
    append(m, translated(tied_bodies(5.0f, 5, 4), {0.0f, 65990.0f, 65990.0f}));
    expect_same_lists<std::uint32_t>({m, m}, id_of_fragment{1}, box_grid({6, 66000, 66000}),
                                     {.rule = vp::fill_rule::even_odd, .bodies = vp::bodies::draw});
}

// ---- triangles ------------------------------------------------------------------------------------------------------

// Triangles that are cut into work items, along both axes; some in 128 bits, and so many crossings that the call runs
// again.
TEST(Solids, LargeTriangles) {
    mesh_data m;
    add_octahedron(m, {150.0f, 170.5f, 20.0f}, 130.0f);
    add_octahedron(m, {-9000.0f, 20.0f, 10.0f}, 9500.0f, true);
    add_box(m, {10.5f, 3.0f, -1e6f}, {60.0f, 290.5f, 35.5f});
    append(m, long_triangles({90, 300, 70}, 40, 3));
    const drawing_of_bits drawing{{m}, {{}}, {{true}}};
    const vp::grid g = box_grid({90, 300, 70});
    drawing.expect_same(g, {.rule = vp::fill_rule::even_odd});
    drawing.expect_same(g, {.rule = vp::fill_rule::nonzero, .extent = vp::solid_extent::outer});
    const drawing_of_bits two{{m, tied_bodies(90.0f, 3, 3)}, {{}}, {{true}}};
    two.expect_same(g, {.rule = vp::fill_rule::positive, .bodies = vp::bodies::draw});
    two.expect_same(g, {.rule = vp::fill_rule::even_odd});
}

TEST(Solids, ManyDraws) {
    std::vector<mesh_data> meshes;
    for (std::uint32_t i = 0; i < 45; ++i)
        meshes.push_back(i == 7 ? mesh_data{} : tied_bodies(20.0f, 1 + static_cast<int>(i % 2), i));
    const drawing_of_everything drawing{meshes, {{0.0f}, {0.5f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}, {4, 1e6f}}};
    for (const auto of : all_bodies)
        for (const auto extent : all_extents)
            drawing.expect_same(box_grid({33, 18, 19}),
                                {.rule = vp::fill_rule::even_odd, .bodies = of, .extent = extent});
    expect_same_lists<std::uint32_t>(meshes, id_of_fragment{9}, box_grid({33, 18, 19}), vp::each_draw);
}
