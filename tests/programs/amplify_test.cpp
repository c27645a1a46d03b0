// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Tessellation and geometry programs: what the same triangles give as a mesh, in every kind of output, for any chunk
// capacity and number of threads; levels (1, 1, 1) are the mesh itself; numbers; errors.

#include "amplify_cases.hpp"

#include <gtest/gtest.h>

namespace {

using namespace programs;
using unit::backend_type;

const glm::ivec3 extent{43, 35, 39};

template <class Amplify>
void expect_same_for_all_chunks(const unit::small_mesh& m, const Amplify& amplify, std::uint64_t min_fragments) {
    const vp::grid whole = unit::unit_grid(extent), part = whole.crop({5, 0, 9}, {30, 25, 20});
    for (const vp::grid& grid : {whole, part})
        for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
            results first;
            bool is_first = true;
            for (const unsigned threads : {1u, 8u})
                for (const vp::program_options& capacities : // the last: in parts of the grid
                     {vp::program_options(rule, 1 << 24), vp::program_options(rule, 1 << 10),
                      vp::program_options(rule, 77), vp::program_options(rule, 1 << 10, 500'000)}) {
                    backend_type backend = unit::make_backend(threads);
                    const results r = draw_all(backend, m, grid, amplify, capacities);
                    if (is_first) {
                        first = r;
                        EXPECT_GT(r.counts.fragments, min_fragments);
                    } else {
                        expect_same(first, r);
                    }
                    is_first = false;
                }
        }
}

TEST(Tessellation, DoesNotDependOnChunksOrThreads) {
    expect_same_for_all_chunks(unit::make_mesh(1, 30, extent), vp::tessellate{waves{1.7f, 1.5f}}, 1000);
}
TEST(GeometryProgram, DoesNotDependOnChunksOrThreads) {
    expect_same_for_all_chunks(unit::make_mesh(2, 150, extent), vp::geometry{prism{0.8f}}, 500);
}
TEST(GeometryProgram, FollowsATessellation) {
    expect_same_for_all_chunks(unit::make_mesh(3, 12, extent),
                               vp::tessellate{waves{4.1f, 1.0f}} | vp::geometry{prism{0.8f}}, 40);
}

// Down to parts of one voxel.
TEST(Tessellation, DoesNotDependOnTheMemoryOfLists) {
    const unit::small_mesh m = unit::make_mesh(8, 4, {6, 5, 7});
    const vp::grid grid = unit::unit_grid({6, 5, 7}).crop({1, 0, 2}, {4, 4, 3});
    backend_type backend = unit::make_backend();
    const vp::tessellate<waves> amplify{{1.3f, 0.5f}};
    const vp::coverage rule = vp::coverage::conservative;
    const results expected = draw_all(backend, m, grid, amplify, {rule});
    EXPECT_GT(expected.counts.fragments, 40u);
    for (const std::uint64_t bytes : {1u, 1'000u, 4'000u})
        expect_same(expected, draw_all(backend, m, grid, amplify, {rule, 16, bytes}));
}

// A mesh with the program's levels 1 is drawn as without a program, byte for byte.
struct plain_levels {
    static constexpr int max_level = 1;
    VOXELPIPE_HD int edge_level(const vertex&, const vertex&) const { return 1; }
    VOXELPIPE_HD vertex operator()(const vp::patch_point<surface>& p) const { return {p.position(), p.varyings()}; }
};
struct keep_triangle {
    VOXELPIPE_HD auto operator()(const vp::triangle<surface>& t) const {
        vp::triangles<1, surface> out;
        out.add(t.vertices[0], t.vertices[1], t.vertices[2]);
        return out;
    }
};
TEST(Programs, WithoutEffectGiveTheMesh) {
    const unit::small_mesh m = unit::make_mesh(4, 80, extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
        const results plain = draw_plain(backend, m, grid, rule);
        for (const std::uint64_t chunk : {std::uint64_t{1} << 24, std::uint64_t{50}}) {
            expect_same(plain, draw_all(backend, m, grid, vp::tessellate{plain_levels{}}, {rule, chunk}));
            expect_same(plain, draw_all(backend, m, grid, vp::geometry{keep_triangle{}}, {rule, chunk}));
            expect_same(plain, draw_all(backend, m, grid,
                                        vp::tessellate{plain_levels{}} | vp::geometry{keep_triangle{}}, {rule, chunk}));
        }
    }
}

struct fixed {
    static constexpr int max_level = 4;
    VOXELPIPE_HD int edge_level(const vertex& a, const vertex& b) const { return a.position.x == b.position.x ? 1 : 4; }
    VOXELPIPE_HD vertex operator()(const vp::patch_point<surface>& p) const { return {p.position(), p.varyings()}; }
};
// Fragments know the input triangle, its instance and draw; primitives count every lattice number.
TEST(Tessellation, NumbersItsTriangles) {
    unit::small_mesh m;
    m.positions = {{1, 1, 1}, {30, 2, 1.5f}, {30, 30, 2}, {1, 25, 7}};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    backend_type backend = unit::make_backend();
    const auto mesh = m.on(backend);
    using draw = vp::draw<vp::mesh_view<>, add_surface, ids_shader, vp::tessellate<fixed>>;
    const std::vector<draw> draws{{mesh.view(), {}, {fixed{}}, {}}, {mesh.view(vp::instances{2}), {}, {fixed{}}, {}}};
    vp::abuffer<backend_type, glm::uvec4> lists(backend);
    for (const std::uint64_t chunk : {std::uint64_t{1} << 24, std::uint64_t{5}}) {
        const vp::status s = vp::voxelize(backend, draws, unit::unit_grid(extent), lists,
                                          vp::program_options(vp::coverage::thin, chunk));
        ASSERT_TRUE(s.ok()) << s.message();
        // Three copies of two patches of 16, each with an edge of level 1, which leaves out 3.
        EXPECT_EQ(s.counts.triangles_in, 3 * (32 - 6));
        EXPECT_EQ(s.counts.triangles_outside, 0u);
        const auto host = lists.to_host(backend);
        std::vector<bool> seen(96);
        for (std::size_t i = 0; i < host.primitives.size(); ++i) {
            const std::uint32_t p = host.primitives[i];
            ASSERT_LT(p, 96u);
            seen[p] = true;
            const std::uint32_t patch = p / 16; // of 6
            EXPECT_EQ(host.payloads[i], glm::uvec4(patch / 2 >= 1 ? 1 : 0, patch % 2, p, patch / 2 == 2 ? 1 : 0));
        }
        // Numbers whose triangles are left out have no fragments.
        EXPECT_EQ(static_cast<std::uint64_t>(std::count(seen.begin(), seen.end(), true)), 78u);
    }
}

struct too_fine : plain_levels {
    VOXELPIPE_HD int edge_level(const vertex& a, const vertex&) const { return a.position.x < 5.0f ? 2 : 1; }
};
struct too_many {
    VOXELPIPE_HD auto operator()(const vp::triangle<surface>& t) const {
        vp::triangles<1, surface> out;
        out.add(t.vertices[0], t.vertices[1], t.vertices[2]);
        if (t.number == 7) out.add(t.vertices[0], t.vertices[1], t.vertices[2]);
        return out;
    }
};
struct finest {
    static constexpr int max_level = 1024;
    VOXELPIPE_HD int edge_level(const vertex&, const vertex&) const { return 1024; }
    VOXELPIPE_HD vertex operator()(const vp::patch_point<surface>& p) const { return {p.position(), {}}; }
};
TEST(Programs, ReportErrorsAndWriteNothing) {
    unit::small_mesh m = unit::make_mesh(5, 40, extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    const auto run = [&](const auto& amplify, std::uint64_t copies) {
        const auto mesh = m.on(backend);
        framebuffer_of<backend_type> fb{backend, extent};
        EXPECT_TRUE(vp::clear(backend, fb).ok());
        const auto before = vp::get<1>(fb).to_host(backend);
        const vp::status s =
            vp::voxelize(backend, mesh.view(vp::instances{copies}), grid, add_surface{}, amplify, shader{}, fb);
        EXPECT_TRUE(unit::same_bytes(before, vp::get<1>(fb).to_host(backend)));
        return s;
    };
    EXPECT_EQ(run(vp::tessellate{too_fine{}}, 1).code, vp::status_code::bad_level);
    EXPECT_EQ(run(vp::geometry{too_many{}}, 1).code, vp::status_code::bad_count);
    const vp::status s = run(vp::tessellate{finest{}}, 200);
    EXPECT_EQ(s.code, vp::status_code::too_many_triangles);
    EXPECT_EQ(s.counts.triangles_in, std::uint64_t{8000} << 20);
    m.triangles[4].y = 999;
    const vp::status bad = run(vp::geometry{keep_triangle{}}, 1);
    EXPECT_EQ(bad.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(bad.triangle, 4u);
    EXPECT_EQ(run(vp::tessellate{plain_levels{}}, 1).code, vp::status_code::index_out_of_range);
}

} // namespace
