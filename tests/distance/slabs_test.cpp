// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// slabs::stream::draw_distance: the slabs of a mesh that comes in chunks are the parts of one call, with the whole's
// counts.
#include "distance_support.hpp"

#include <voxelpipe/slabs/stream.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace {

using namespace distances;
namespace slabs = vp::slabs;

using both_targets = vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>,
                                     vp::target<std::int64_t, vp::blend::replace>>;

struct streamed : field {
    std::size_t slabs = 0, triangles = 0; // of the slabs together
};

// The mesh in chunks of seven triangles.
streamed stream_field(const mesh& m, const vp::grid& g, const vp::distance_options& how,
                      const slabs::stream_options& options, int axis = 2) {
    vp::cpu_backend backend(2);
    slabs::stream stream(backend, g, vp::passthrough{}, options);
    if (axis != 2) stream.cut_into(slabs::equal_layers(g, axis, std::max(1, options.num_slabs)));
    for (std::size_t first = 0; first < m.triangles.size(); first += 7) {
        const std::size_t count = std::min<std::size_t>(7, m.triangles.size() - first);
        const vp::mesh_view<> chunk{m.positions, {m.triangles.data() + first, count}};
        EXPECT_TRUE(stream.add(chunk).ok());
    }
    streamed found;
    found.extent = g.extent;
    const std::size_t samples = solids::index(g.extent, 0, 0, g.extent.z);
    found.distances.resize(samples);
    found.nearest.resize(samples);
    found.status = stream.draw_distance(
        nearest_shader{},
        [&](glm::ivec3 extent) {
            return both_targets{backend, extent};
        },
        [&](const slabs::slab& part, const both_targets& out) {
            ++found.slabs;
            found.triangles += part.drawn.counts.triangles_in;
            const auto distance = vp::get<0>(out).to_host(backend);
            const auto nearest = vp::get<1>(out).to_host(backend);
            const glm::ivec3 e = part.where.extent, from = part.where.offset - g.offset;
            for (int z = 0; z < e.z; ++z)
                for (int y = 0; y < e.y; ++y)
                    for (int x = 0; x < e.x; ++x) {
                        const std::size_t to = found.index(from.x + x, from.y + y, from.z + z),
                                          at = solids::index(e, x, y, z);
                        found.distances[to] = distance[at];
                        found.nearest[to] = nearest[at];
                    }
        },
        how);
    return found;
}

streamed expect_whole(const mesh& m, const vp::grid& g, const vp::distance_options& how, slabs::stream_options options,
                      std::size_t least_slabs, int axis = 2) {
    options.band = how.band;
    options.repair = how.repair;
    const field whole = library_field(m, g, how);
    streamed found = stream_field(m, g, how, options, axis);
    EXPECT_TRUE(found.status.ok()) << found.status.message();
    EXPECT_GE(found.slabs, least_slabs);
    EXPECT_EQ(found.distances, whole.distances);
    EXPECT_EQ(found.nearest, whole.nearest);
    EXPECT_EQ(found.status.counts, whole.status.counts);
    EXPECT_EQ(found.status.distance, whole.status.distance);
    EXPECT_EQ(found.status.solid, whole.status.solid);
    return found;
}

TEST(DistanceSlabs, AreThePartsOfOneCall) {
    splitmix64 random(51);
    std::size_t inside = 0;
    for (int i = 0; i < 3; ++i) {
        mesh m = solids::random_bodies(random, 15, 5); // faces in planes between slabs, parts beyond the grid
        m.add(solids::sphere({-12, 6, 6}, 3.5f, 1)).add(solids::sphere({6, 7, 40}, 3, 1)); // beside it and above it
        const vp::grid g = solids::unit_grid({12, 13, 14});
        for (const int num_slabs : {1, 3, 14}) {
            const slabs::stream_options parts{.num_slabs = num_slabs};
            const auto n = static_cast<std::size_t>(num_slabs);
            const streamed found = expect_whole(m, g, {}, parts, n);
            inside += static_cast<std::size_t>(
                std::count_if(found.distances.begin(), found.distances.end(), [](float d) { return d < 0; }));
            expect_whole(m, g, {.band = 1.25, .rule = vp::fill_rule::even_odd}, parts, n);
            expect_whole(m, g, {.band = 4, .sign = vp::distance_sign::none}, parts, n);
            expect_whole(m, g, {.band = vp::band::whole}, parts, n);
        }
        expect_whole(m, g.crop({2, 3, 1}, {7, 8, 11}), {}, {.num_slabs = 3}, 3);
        expect_whole(m, g.crop({2, 3, 1}, {7, 8, 11}), {.band = 2}, {.num_slabs = 4}, 4, 1);
        vp::grid flat = g;
        flat.voxel_size = {1.0, 0.75, 1.5}; // the halo differs by axis
        expect_whole(m, flat, {.band = 2}, {.num_slabs = 5}, 5);
    }
    EXPECT_GT(inside, 500u);
}

// A slab has the triangles that its band or its rows need, and few others.
TEST(DistanceSlabs, HaveTheTrianglesOfTheirBands) {
    const mesh m = solids::sphere({20.2F, 19.7F, 20.5F}, 15.3F, 4);
    const vp::grid g = solids::unit_grid(glm::ivec3(40));
    const std::size_t narrow = expect_whole(m, g, {.band = 1}, {.num_slabs = 8}, 8).triangles,
                      wide = expect_whole(m, g, {.band = 5}, {.num_slabs = 8}, 8).triangles;
    EXPECT_GT(narrow, m.triangles.size());
    EXPECT_LT(narrow, 2 * m.triangles.size());
    EXPECT_GT(wide, 2 * m.triangles.size());
    EXPECT_LT(wide, 5 * m.triangles.size());
    // So little memory that slabs are cut again.
    expect_whole(m, g, {}, {.memory = 1 << 20, .num_slabs = 1}, 2);
}

// Each slab has the cones of the whole mesh, where no triangle of its own is, too.
TEST(DistanceSlabs, RepairTheWhole) {
    mesh m = solids::box({1.25F, 1.5F, 0.75F}, {8.5F, 9.25F, 18.5F});
    m.add(solids::sphere({5, 5, 5.5F}, 2.25F, 2).inside_out());
    std::erase_if(m.triangles, [&](const glm::uvec3& t) { // the box's upper side along z
        return m.positions[t.x].z == 18.5F && m.positions[t.y].z == 18.5F && m.positions[t.z].z == 18.5F;
    });
    m.triangles.erase(m.triangles.end() - 9);
    const vp::grid g = solids::unit_grid({10, 11, 20});
    for (const vp::repair repair : {vp::repair::close_holes, vp::repair::winding})
        for (const std::uint64_t edges : {std::uint64_t{4}, std::uint64_t{3}}) {
            const vp::distance_options how{.band = 1, .repair = repair, .max_hole_edges = edges};
            const streamed found = expect_whole(m, g, how, {.num_slabs = 10}, 10);
            EXPECT_GT(found.status.solid.cones, 0u);
            expect_whole(m, g.crop({3, 4, 9}, {3, 3, 9}), how, {.num_slabs = 3}, 3);
        }
}

// Sparse slabs, whose borders cut bricks, are merged to the bytes of one call.
TEST(DistanceSlabs, OfBricksAreMergedToTheWhole) {
    const vp::grid g = solids::unit_grid({36, 35, 37});
    const mesh m = solids::sphere({18, 17.5F, 18}, 13.25F, 3);
    using bricks = vp::sparse_framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>>;
    using host = vp::host_sparse<vp::target<float, vp::blend::replace>>;
    vp::cpu_backend backend(2);
    bricks whole(backend, g.extent);
    const vp::status expected =
        vp::voxelize_distance(backend, m.view(), g, vp::passthrough{}, vp::distance{}, whole, {.band = 2});
    ASSERT_TRUE(expected.ok()) << expected.message();
    slabs::stream stream(backend, g, vp::passthrough{}, {.num_slabs = 4, .band = vp::band(2)});
    ASSERT_TRUE(stream.add(m.view()).ok());
    std::vector<host> parts;
    const vp::status s = stream.draw_distance(
        vp::distance{},
        [&](glm::ivec3 extent) {
            return bricks{backend, extent};
        },
        [&](const slabs::slab&, const bricks& out) { parts.push_back(out.to_host(backend)); }, {.band = 2});
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(parts.size(), 4u);
    EXPECT_EQ(s.counts, expected.counts);
    EXPECT_EQ(s.distance, expected.distance);
    EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const host>(parts)), whole.to_host(backend)));
}

TEST(DistanceSlabs, RefuseWhatTheyCannot) {
    const mesh m = solids::box(glm::vec3(1.25F), glm::vec3(4.5F));
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    const auto code = [&](const vp::distance_options& how, const slabs::stream_options& options, int axis = 2) {
        return stream_field(m, g, how, options, axis).status.code;
    };
    const vp::core::hole_cones cones;
    const slabs::stream_options three{.band = vp::band(3)};
    constexpr auto bad = vp::status_code::bad_distance_options;
    EXPECT_EQ(code({}, three), vp::status_code::ok);
    EXPECT_EQ(code({}, {}), bad); // triangles of the band are missing
    EXPECT_EQ(code({}, {.is_solid = true}), bad);
    EXPECT_EQ(code({.band = 2}, three), bad);
    EXPECT_EQ(code({.sample = vp::sample::corner}, three), bad);
    EXPECT_EQ(code({}, three, 0), bad);
    for (const vp::repair r : {vp::repair::close_holes, vp::repair::vote, vp::repair::exterior, vp::repair::winding}) {
        EXPECT_EQ(code({.repair = r}, three), bad);
        EXPECT_EQ(code({}, {.repair = r, .band = vp::band(3)}), bad);
    }
    EXPECT_EQ(code({.repair = vp::repair::vote}, {.repair = vp::repair::vote, .band = vp::band(3)}), bad);
    EXPECT_EQ(code({.repair = vp::repair::close_holes, .cones = &cones},
                   {.repair = vp::repair::close_holes, .band = vp::band(3)}),
              bad);
    // Other calls are not for such a stream.
    vp::cpu_backend backend(1);
    const auto make = [&](glm::ivec3 extent) {
        return vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>>{backend, extent};
    };
    const auto sink = [](const slabs::slab&, const auto&) {};
    slabs::stream stream(backend, g, vp::passthrough{}, three);
    EXPECT_EQ(stream.draw(vp::constant(true), make, sink).code, bad);
    EXPECT_EQ(stream.draw_solid(vp::constant(true), make, sink).code, vp::status_code::bad_solid_options);
}

} // namespace
