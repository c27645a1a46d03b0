// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Draws on a backend: transforms, attributes and varyings, order across draws, crops, counters, the inputs of a
// fragment shader.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;

const glm::ivec3 extent{41, 33, 36};

struct id_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::uvec4(f.draw, f.triangle, f.primitive, 1u));
    }
};
using id_target = vp::target<glm::uvec4, blend::replace>;

unit::small_mesh moved(const unit::small_mesh& m, const glm::mat4& matrix) {
    unit::small_mesh out = m;
    for (glm::vec3& p : out.positions) p = vp::transform_point(matrix, p);
    return out;
}

TEST(Draws, AreOrderedAndPlacedByTheirTransforms) {
    const unit::small_mesh a = unit::make_mesh(1, 50, extent), b = unit::make_mesh(2, 30, extent), empty{};
    glm::mat4 turn = glm::rotate(glm::translate(glm::mat4(1.0f), {3, 5, -2}), 0.4f, {1, 2, 3});
    const glm::mat4 identity(1.0f), scale = glm::scale(identity, {0.75f, 1.25f, 0.5f});
    using draw = vp::draw<vp::mesh_view<>, vp::transform, id_shader>;
    backend_type backend = unit::make_backend();
    const auto on_a = a.on(backend), on_b = b.on(backend), on_empty = empty.on(backend);
    const std::vector<draw> draws{{on_a.view(), {identity}, {}},
                                  {on_b.view(), {turn}, {}},
                                  {on_empty.view(), {identity}, {}},
                                  {on_a.view(), {scale}, {}}};
    const vp::grid grid = unit::unit_grid(extent);
    vp::framebuffer<backend_type, id_target> fb{backend, extent};
    const vp::status s = vp::voxelize(backend, std::span<const draw>(draws), grid, fb);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts.triangles_in, 130u);

    std::vector<glm::uvec4> expected(static_cast<std::size_t>(extent.x * extent.y * extent.z), glm::uvec4(0));
    for (const auto& f :
         unit::fragments_of(grid, vp::coverage::conservative, {a, moved(b, turn), empty, moved(a, scale)}))
        expected[unit::linear(extent, f.voxel)] = {f.draw, f.triangle, f.primitive, 1u};
    EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), expected));
}

// A coverage between angle brackets gives what the options give, and goes before theirs.
TEST(Draws, AKnownCoverageIsTheOneOfTheCall) {
    const unit::small_mesh m = unit::make_mesh(4, 60, extent);
    backend_type backend = unit::make_backend();
    const auto on_backend = m.on(backend);
    const vp::grid grid = unit::unit_grid(extent);
    const auto draw = [&](const auto& call) {
        vp::framebuffer<backend_type, id_target> fb{backend, extent};
        const vp::status s = call(fb);
        EXPECT_TRUE(s.ok()) << s.message();
        return vp::get<0>(fb).to_host(backend);
    };
    const auto asked = [&](vp::coverage rule) {
        return draw([&](auto& fb) {
            return vp::voxelize(backend, on_backend.view(), grid, vp::passthrough{}, id_shader{}, fb,
                                vp::voxelize_options{rule});
        });
    };
    const auto thin = asked(vp::coverage::thin), conservative = asked(vp::coverage::conservative);
    EXPECT_FALSE(unit::same_bytes(thin, conservative));
    EXPECT_TRUE(unit::same_bytes(draw([&](auto& fb) {
                                     return vp::voxelize<vp::coverage::thin>(backend, on_backend.view(), grid,
                                                                             vp::passthrough{}, id_shader{}, fb);
                                 }),
                                 thin));
    EXPECT_TRUE(unit::same_bytes(draw([&](auto& fb) {
                                     return vp::voxelize<vp::coverage::conservative>(
                                         backend, on_backend.view(), grid, vp::passthrough{}, id_shader{}, fb,
                                         vp::voxelize_options{vp::coverage::thin});
                                 }),
                                 conservative));
    // Lists take it too.
    const auto lists = [&](const auto& call) {
        vp::abuffer<backend_type, void> ab(backend);
        const vp::status s = call(ab);
        EXPECT_TRUE(s.ok()) << s.message();
        return ab.primitives.to_host(backend);
    };
    EXPECT_EQ(lists([&](auto& ab) {
                  return vp::voxelize<vp::coverage::thin>(backend, on_backend.view(), grid, vp::passthrough{},
                                                          vp::constant(true), ab);
              }),
              lists([&](auto& ab) {
                  return vp::voxelize(backend, on_backend.view(), grid, vp::passthrough{}, vp::constant(true), ab,
                                      vp::voxelize_options{vp::coverage::thin});
              }));
}

TEST(Draws, TransformPointIsThreeFusedSteps) {
    unit::splitmix64 random(3);
    for (int i = 0; i < 2000; ++i) {
        glm::mat4 m(1.0f);
        for (int c = 0; c < 4; ++c)
            for (int r = 0; r < 3; ++r) m[c][r] = static_cast<float>(random.uniform(-3, 3));
        const glm::vec3 p(static_cast<float>(random.uniform(-9, 9)), static_cast<float>(random.uniform(-9, 9)),
                          static_cast<float>(random.uniform(-9, 9)));
        for (int r = 0; r < 3; ++r)
            ASSERT_EQ(vp::transform_point(m, p)[r],
                      std::fma(m[2][r], p.z, std::fma(m[1][r], p.y, std::fma(m[0][r], p.x, m[3][r]))));
    }
}

struct crop_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(unit::mark(f.primitive, f.voxel), f.barycentric);
    }
};

// A part of the grid gives the crop of the whole, and counts its own voxels.
TEST(Crop, IsTheCropOfTheWhole) {
    const unit::small_mesh mesh = unit::make_mesh(4, 150, extent);
    vp::grid grid = unit::unit_grid(extent);
    grid.voxel_size = {1.0, 0.9, 1.3};
    using targets =
        vp::framebuffer<backend_type, vp::target<std::uint64_t, blend::add>, vp::target<glm::vec3, blend::max>>;
    backend_type backend = unit::make_backend();
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
        targets whole{backend, extent};
        vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, crop_shader{}, whole, rule).or_throw();
        const glm::ivec3 begin{7, 9, 3}, size{30, 11, 33};
        targets part{backend, size};
        const auto s = vp::voxelize(backend, mesh.on(backend), grid.crop(begin, size), vp::passthrough{}, crop_shader{},
                                    part, rule);
        ASSERT_TRUE(s.ok()) << s.message();
        std::uint64_t occupied = 0;
        const auto whole_sums = vp::get<0>(whole).to_host_target(backend);
        const auto whole_maxima = vp::get<1>(whole).to_host_target(backend);
        const auto part_sums = vp::get<0>(part).to_host_target(backend);
        const auto part_maxima = vp::get<1>(part).to_host_target(backend);
        unit::for_each_voxel(size, [&](int x, int y, int z) {
            const std::uint64_t a = whole_sums(x + begin.x, y + begin.y, z + begin.z);
            ASSERT_EQ(part_sums(x, y, z), a) << x << ' ' << y << ' ' << z;
            const glm::vec3 b = whole_maxima(x + begin.x, y + begin.y, z + begin.z);
            const glm::vec3 c = part_maxima(x, y, z);
            ASSERT_EQ(std::memcmp(&b, &c, sizeof b), 0);
            occupied += a != 0 ? 1 : 0;
        });
        EXPECT_EQ(s.counts.voxels, occupied);
    }
}

// The fragments and voxels of all slabs add up to those of the whole.
TEST(Crop, SlabsAddUp) {
    const unit::small_mesh mesh = unit::make_mesh(5, 100, extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<std::uint32_t, blend::add>> whole{backend, extent};
    const auto all = vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, vp::constant(1u), whole);
    std::uint64_t fragments = 0, voxels = 0;
    for (int first = 0; first < extent.z; first += 5) {
        const glm::ivec3 size{extent.x, extent.y, std::min(5, extent.z - first)};
        vp::framebuffer<backend_type, vp::target<std::uint32_t, blend::add>> slab{backend, size};
        const auto s = vp::voxelize(backend, mesh.on(backend), grid.crop({0, 0, first}, size), vp::passthrough{},
                                    vp::constant(1u), slab);
        ASSERT_TRUE(s.ok());
        fragments += s.counts.fragments;
        voxels += s.counts.voxels;
    }
    EXPECT_EQ(fragments, all.counts.fragments);
    EXPECT_EQ(voxels, all.counts.voxels);
}

TEST(Counters, SayWhatBecameOfEveryTriangle) {
    unit::small_mesh m;
    const float nan = std::nanf("");
    const auto add = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        const auto n = static_cast<std::uint32_t>(m.positions.size());
        m.positions.insert(m.positions.end(), {a, b, c});
        m.triangles.emplace_back(n, n + 1, n + 2);
    };
    add({1, 1, 1}, {5, 1, 1}, {1, 5, 1});         // drawn
    add({nan, 1, 1}, {5, 1, 1}, {1, 5, 1});       // NaN
    add({1, 1, 1}, {5, HUGE_VALF, 1}, {1, 5, 1}); // infinite
    add({1, 1, 1}, {5, 1, -1e30f}, {1, 5, 1});    // too far
    add({3e9f, nan, 1}, {5, 1, 1}, {1, 5, 1});    // both: NaN counts
    add({2, 2, 2}, {2, 2, 2}, {2, 2, 2});         // a point
    add({2, 2, 2}, {3, 3, 3}, {4, 4, 4});         // a segment
    add({-9, 2, 2}, {-8, 3, 3}, {-9, 4, 4});      // outside
    add({-9, 2, 2}, {-9, 2, 2}, {-9, 2, 2});      // outside and a point
    backend_type backend = unit::make_backend();
    const vp::grid grid = unit::unit_grid(extent);
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>> fb{backend, extent};
    const auto conservative =
        vp::voxelize(backend, m.on(backend), grid, vp::passthrough{}, vp::constant(true), fb).counts;
    EXPECT_EQ(conservative.triangles_in, 9u);
    EXPECT_EQ(conservative.triangles_nonfinite, 3u);
    EXPECT_EQ(conservative.triangles_too_far, 1u);
    EXPECT_EQ(conservative.triangles_dropped(), 4u);
    EXPECT_EQ(conservative.triangles_zero_area, 0u);
    EXPECT_EQ(conservative.triangles_outside, 2u);
    EXPECT_EQ(conservative.triangles_drawn, 3u);
    const auto thin =
        vp::voxelize(backend, m.on(backend), grid, vp::passthrough{}, vp::constant(true), fb, vp::coverage::thin)
            .counts;
    EXPECT_EQ(thin.triangles_nonfinite, 3u);
    EXPECT_EQ(thin.triangles_too_far, 1u);
    EXPECT_EQ(thin.triangles_drawn, 1u);
    EXPECT_EQ(thin.triangles_zero_area + thin.triangles_outside, 4u);
    EXPECT_GE(thin.triangles_zero_area, 2u);
}

// ---- inputs of shaders ----------------------------------------------------------------------------------------------

struct surface {
    glm::vec2 uv;
    vp::flat<std::uint32_t> id;
};
struct surface_vertex {
    float offset;
    VOXELPIPE_HD vp::vertex_output<surface> operator()(const vp::vertex<glm::vec2, std::uint32_t>& v) const {
        return {v.position + glm::vec3(offset), {vp::get<0>(v), {vp::get<1>(v) + 100u * v.draw + v.index}}};
    }
};
struct told {
    glm::vec3 barycentric, normal, clamped;
    glm::vec2 uv, clamped_uv;
    std::uint32_t id, front, axis;
};
struct surface_fragment {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface>& f) const {
        const surface c = f.clamped_varyings();
        return vp::outputs(told{f.barycentric, f.normal, f.clamped_barycentric(), f.varyings.uv, c.uv,
                                f.varyings.id.value, f.front_facing ? 1u : 0u, static_cast<std::uint32_t>(f.axis)});
    }
};

TEST(Fragment, KnowsItsPlaceOnTheTriangle) {
    // Two right triangles of a 20 x 10 rectangle at z = 4.5, seen from above; the second one is wound the other way.
    const std::vector<glm::vec3> positions{{2, 3, 4}, {22, 3, 4}, {2, 13, 4}, {22, 13, 4}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}, {1, 2, 3}};
    const std::vector<glm::vec2> uv{{0, 0}, {20, 0}, {0, 10}, {20, 10}};
    const std::vector<std::uint32_t> ids{5, 6, 7, 8};
    backend_type backend = unit::make_backend();
    const vp::mesh<backend_type, glm::vec2, std::uint32_t> mesh{backend, positions, triangles, uv, ids};
    vp::abuffer<backend_type, told> lists{backend};
    const vp::grid grid = unit::unit_grid(extent);
    vp::voxelize(backend, mesh, grid, surface_vertex{0.5f}, surface_fragment{}, lists, vp::coverage::thin).or_throw();
    const auto host = lists.to_host(backend);
    std::size_t fragments = 0;
    for (const auto& [voxel, list] : host)
        for (const auto [triangle, f] : list) {
            ++fragments;
            EXPECT_EQ(voxel.z, 4);
            EXPECT_EQ(f.axis, 2u);
            EXPECT_EQ(f.front, triangle == 0 ? 1u : 0u);
            EXPECT_EQ(f.normal, glm::vec3(0, 0, triangle == 0 ? 1.0f : -1.0f));
            EXPECT_EQ(f.id, triangle == 0 ? 5u : 7u); // the first vertex's attribute plus its index
            // At the column's centre the texture coordinate is its place in the rectangle.
            EXPECT_NEAR(f.uv.x, static_cast<float>(voxel.x) + 0.5f - 2.5f, 1e-5f);
            EXPECT_NEAR(f.uv.y, static_cast<float>(voxel.y) + 0.5f - 3.5f, 1e-5f);
            EXPECT_NEAR(f.barycentric.x + f.barycentric.y + f.barycentric.z, 1.0f, 1e-6f);
            for (int a = 0; a < 3; ++a) EXPECT_GE(f.clamped[a], 0.0f);
            EXPECT_GE(f.clamped_uv.x, -1e-5f);
            EXPECT_LE(f.clamped_uv.x, 20.0f + 1e-5f);
        }
    EXPECT_GT(fragments, 200u);
}

struct place_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::vec4(f.normal, f.front_facing ? 1.0f : 0.0f), f.barycentric, f.axis);
    }
};

TEST(Fragment, OfAZeroAreaTriangleHasDefinedValues) {
    unit::small_mesh m;
    m.positions = {{1.5f, 1.5f, 1.5f}, {5.5f, 2.5f, 3.5f}, {1.5f, 1.5f, 1.5f}};
    m.triangles = {{0, 1, 2}};
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<glm::vec4, blend::replace>, vp::target<glm::vec3, blend::replace>,
                    vp::target<int, blend::replace>>
        fb{backend, extent};
    vp::get<2>(fb).clear(-1);
    const auto s = vp::voxelize(backend, m.on(backend), unit::unit_grid(extent), vp::passthrough{}, place_shader{}, fb);
    EXPECT_GE(s.counts.voxels, 5u);
    EXPECT_EQ(vp::get<0>(fb).to_host_target(backend)(1, 1, 1), glm::vec4(0, 0, 0, 1));
    EXPECT_EQ(vp::get<1>(fb).to_host_target(backend)(1, 1, 1), glm::vec3(1.0f / 3.0f));
    EXPECT_EQ(vp::get<2>(fb).to_host_target(backend)(1, 1, 1), 0);
    EXPECT_EQ(vp::get<2>(fb).to_host_target(backend)(9, 9, 9), -1);
}

} // namespace
