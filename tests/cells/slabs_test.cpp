// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// slabs::stream::draw_cells: the slabs of a mesh that comes in chunks are the parts of one call, with the whole's
// counts.
#include "cell_support.hpp"

#include <voxelpipe/slabs/stream.hpp>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace {

using namespace cells;
namespace slabs = vp::slabs;

using all_target = vp::target<std::int64_t, vp::blend::replace>;
template <class Backend>
using all_targets = vp::framebuffer<Backend, vp::target<float, vp::blend::add>, all_target, all_target, all_target,
                                    vp::target<std::uint32_t, vp::blend::max>>;

struct streamed {
    std::vector<std::int64_t> units, apertures;
    std::vector<std::uint32_t> cut;
    std::size_t slabs = 0;
    vp::status status;
};

// The mesh in chunks of seven triangles.
streamed stream_cells(const mesh& m, const vp::grid& g, const vp::cell_options& how,
                      const slabs::stream_options& options) {
    vp::cpu_backend backend(2);
    slabs::stream stream(backend, g, vp::passthrough{}, options);
    for (std::size_t first = 0; first < m.triangles.size(); first += 7) {
        const std::size_t count = std::min<std::size_t>(7, m.triangles.size() - first);
        const vp::mesh_view<> chunk{m.positions, {m.triangles.data() + first, count}};
        EXPECT_TRUE(stream.add(chunk).ok());
    }
    streamed found;
    const std::size_t voxels = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y) *
                               static_cast<std::size_t>(g.extent.z);
    found.units.resize(voxels);
    found.apertures.resize(voxels);
    found.cut.resize(voxels);
    found.status = stream.draw_cells(
        all_shader{},
        [&](glm::ivec3 extent) {
            return all_targets<vp::cpu_backend>{backend, extent};
        },
        [&](const slabs::slab& part, const all_targets<vp::cpu_backend>& out) {
            ++found.slabs;
            const auto units = vp::get<1>(out).to_host(backend), apertures = vp::get<2>(out).to_host(backend);
            const auto cut = vp::get<4>(out).to_host(backend);
            const glm::ivec3 e = part.where.extent, from = part.where.offset - g.offset;
            for (int z = 0; z < e.z; ++z)
                for (int y = 0; y < e.y; ++y)
                    for (int x = 0; x < e.x; ++x) {
                        const std::size_t to = solids::index(g.extent, from.x + x, from.y + y, from.z + z),
                                          at = solids::index(e, x, y, z);
                        found.units[to] = units[at];
                        found.apertures[to] = apertures[at];
                        found.cut[to] = cut[at];
                    }
        },
        how);
    return found;
}

void expect_whole(const mesh& m, const vp::grid& g, const vp::cell_options& how, const slabs::stream_options& options,
                  std::size_t least_slabs) {
    cell_values whole = library_cells(m, g, how);
    const streamed found = stream_cells(m, g, how, options);
    ASSERT_TRUE(found.status.ok()) << found.status.message();
    EXPECT_GE(found.slabs, least_slabs);
    EXPECT_EQ(found.units, whole.units);
    EXPECT_EQ(found.apertures, whole.apertures);
    EXPECT_EQ(found.cut, whole.cut);
    EXPECT_EQ(found.status.counts, whole.status.counts);
    whole.status.cells.open_edges = 0; // no slab has all edges
    EXPECT_EQ(found.status.cells, whole.status.cells);
    EXPECT_EQ(found.status.solid, vp::solid_counters{});
    EXPECT_GT(whole.status.cells.cut_voxels, 20u);
}

TEST(CellSlabs, AreThePartsOfOneCall) {
    splitmix64 random(47);
    for (int i = 0; i < 4; ++i) {
        const mesh m = solids::random_bodies(random, 14, 5); // faces in planes between slabs, parts beyond the grid
        const vp::grid g = solids::unit_grid({12, 13, 14});
        for (const int num_slabs : {1, 3, 14}) {
            expect_whole(m, g, {}, {.num_slabs = num_slabs, .is_solid = true}, static_cast<std::size_t>(num_slabs));
            expect_whole(m, g.crop({2, 3, 1}, {7, 8, 11}), {}, {.num_slabs = 3, .is_solid = true}, 3);
        }
    }
    // So little memory that slabs are cut again.
    expect_whole(solids::sphere({20.2F, 19.7F, 20.5F}, 15.3F, 3), solids::unit_grid(glm::ivec3(40)), {},
                 {.memory = 1 << 20, .num_slabs = 1, .is_solid = true}, 2);
}

// Each slab has the cones of the whole mesh, where no triangle of its own is, too.
TEST(CellSlabs, CloseTheHolesOfTheWhole) {
    mesh m = solids::box({1.25F, 1.5F, 0.75F}, {8.5F, 9.25F, 11.5F});
    m.add(solids::sphere({5, 5, 5.5F}, 2.25F, 2).inside_out());
    std::erase_if(m.triangles, [&](const glm::uvec3& t) { // the box's upper side along z
        return m.positions[t.x].z == 11.5F && m.positions[t.y].z == 11.5F && m.positions[t.z].z == 11.5F;
    });
    const vp::grid g = solids::unit_grid({10, 11, 12});
    for (const std::uint64_t edges : {std::uint64_t{4}, std::uint64_t{3}}) {
        const vp::cell_options how{.repair = vp::repair::close_holes, .max_hole_edges = edges};
        expect_whole(m, g, how, {.num_slabs = 6, .repair = vp::repair::close_holes}, 6);
        expect_whole(m, g.crop({1, 2, 9}, {8, 7, 3}), how, {.num_slabs = 3, .repair = vp::repair::close_holes}, 3);
    }
}

// Sparse slabs, whose borders cut bricks, are merged to the bytes of one call.
TEST(CellSlabs, OfBricksAreMergedToTheWhole) {
    const vp::grid g = solids::unit_grid({36, 35, 37});
    mesh m = solids::sphere({18, 17.5F, 18}, 15.25F, 3);
    m.triangles.erase(m.triangles.begin() + 4);
    using bricks = vp::sparse_framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>>;
    using host = vp::host_sparse<vp::target<float, vp::blend::replace>>;
    const vp::cell_options how{.count_open_edges = false, .repair = vp::repair::close_holes};
    vp::cpu_backend backend(2);
    bricks whole(backend, g.extent);
    const vp::status expected = vp::voxelize_cells(backend, m.view(), g, vp::passthrough{}, vp::fraction{}, whole, how);
    ASSERT_TRUE(expected.ok()) << expected.message();
    EXPECT_GT(whole.num_tiles(), 0u);
    slabs::stream stream(backend, g, vp::passthrough{}, {.num_slabs = 4, .repair = vp::repair::close_holes});
    ASSERT_TRUE(stream.add(m.view()).ok());
    std::vector<host> parts;
    const vp::status s = stream.draw_cells(
        vp::fraction{},
        [&](glm::ivec3 extent) {
            return bricks{backend, extent};
        },
        [&](const slabs::slab&, const bricks& out) { parts.push_back(out.to_host(backend)); }, how);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_GE(parts.size(), 4u);
    EXPECT_EQ(s.counts, expected.counts);
    EXPECT_EQ(s.cells, expected.cells);
    EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const host>(parts)), whole.to_host(backend)));
}

// A-buffers of slabs follow each other as the lists of one call.
TEST(CellSlabs, OfListsAreTheListsOfOneCall) {
    const vp::grid g = solids::unit_grid({15, 14, 16}).crop({1, 0, 2}, {13, 14, 13});
    mesh m = solids::sphere({7.2F, 7.5F, 8.1F}, 6.25F, 2);
    m.triangles.erase(m.triangles.begin() + 4);
    const vp::cell_options how{.count_open_edges = false, .repair = vp::repair::close_holes};
    vp::cpu_backend backend(2);
    vp::abuffer<vp::cpu_backend, float> lists(backend);
    const vp::status expected = vp::voxelize_cells(backend, m.view(), g, vp::passthrough{}, vp::fraction{}, lists, how);
    ASSERT_TRUE(expected.ok()) << expected.message();
    slabs::stream stream(backend, g, vp::passthrough{}, {.num_slabs = 5, .repair = vp::repair::close_holes});
    ASSERT_TRUE(stream.add(m.view()).ok());
    vp::host_abuffer<float> all;
    std::size_t num_slabs = 0;
    const vp::status s = stream.draw_cells(
        vp::fraction{}, [&](glm::ivec3) { return vp::abuffer<vp::cpu_backend, float>{backend}; },
        [&](const slabs::slab& part, const vp::abuffer<vp::cpu_backend, float>& out) {
            EXPECT_EQ(part.voxels_before, all.voxels.size());
            slabs::append(all, g, part, out.to_host(backend));
            ++num_slabs;
        },
        how);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_GE(num_slabs, 5u);
    EXPECT_EQ(s.counts, expected.counts);
    EXPECT_EQ(s.cells, expected.cells);
    const auto whole = lists.to_host(backend);
    EXPECT_GT(whole.voxels.size(), 500u);
    EXPECT_EQ(all.voxels, whole.voxels);
    EXPECT_EQ(all.offsets, whole.offsets);
    EXPECT_EQ(all.primitives, whole.primitives);
    EXPECT_EQ(all.payloads, whole.payloads);
}

// Links, whose triangles may lie half a voxel beyond a slab: the records of one call, layer by layer.
TEST(CellSlabs, OfLinksAreTheRecordsOfOneCall) {
    splitmix64 random(59);
    for (int round = 0; round < 6; ++round) {
        const mesh m = solids::random_bodies(random, 12, 5); // faces in the planes of voxels' centres and between slabs
        const vp::grid whole = solids::unit_grid({11, 12, 13}),
                       g = round % 2 == 0 ? whole : whole.crop({1, 2, 1}, {7, 6, 11});
        const vp::link_options how{.neighbours = round % 3 == 0 ? 26 : 18};
        vp::cpu_backend backend(2);
        vp::link_list<vp::cpu_backend> links(backend);
        const vp::status expected = vp::voxelize_links(backend, m.view(), g, vp::passthrough{}, links, how);
        ASSERT_TRUE(expected.ok()) << expected.message();
        EXPECT_GT(expected.counts.voxels, 50u);
        for (const int num_slabs : {1, 4, 11}) {
            slabs::stream stream(backend, g, vp::passthrough{}, {.num_slabs = num_slabs, .is_links = true});
            for (std::size_t first = 0; first < m.triangles.size(); first += 7) {
                const std::size_t count = std::min<std::size_t>(7, m.triangles.size() - first);
                ASSERT_TRUE(stream.add(vp::mesh_view<>{m.positions, {m.triangles.data() + first, count}}).ok());
            }
            std::vector<glm::ivec3> voxels;
            std::vector<float> q;
            std::vector<std::uint32_t> primitives, draws;
            const auto append = [&](auto& to, const auto& from) {
                const auto values = from.to_host(backend);
                to.insert(to.end(), values.begin(), values.end());
            };
            const vp::status s = stream.draw_links(
                [&](const slabs::slab& part, const vp::link_list<vp::cpu_backend>& of_slab) {
                    EXPECT_EQ(part.voxels_before, voxels.size());
                    for (const glm::ivec3& p : of_slab.voxels.to_host(backend))
                        voxels.push_back(p + part.where.offset - g.offset);
                    append(q, of_slab.q);
                    append(primitives, of_slab.primitives);
                    append(draws, of_slab.draws);
                },
                how);
            ASSERT_TRUE(s.ok()) << s.message();
            EXPECT_EQ(s.counts, expected.counts);
            EXPECT_EQ(voxels, links.voxels.to_host(backend));
            EXPECT_EQ(q, links.q.to_host(backend));
            EXPECT_EQ(primitives, links.primitives.to_host(backend));
            EXPECT_EQ(draws, links.draws.to_host(backend));
        }
    }
    const mesh m = solids::box(glm::vec3(1.25F), glm::vec3(4.5F));
    vp::cpu_backend backend(1);
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    const auto ignore = [](const slabs::slab&, const vp::link_list<vp::cpu_backend>&) {};
    const auto code = [&](const slabs::stream_options& options, int neighbours) {
        slabs::stream stream(backend, g, vp::passthrough{}, options);
        EXPECT_TRUE(stream.add(m.view()).ok());
        return stream.draw_links(ignore, {.neighbours = neighbours}).code;
    };
    EXPECT_EQ(code({.is_links = true}, 18), vp::status_code::ok);
    EXPECT_EQ(code({.is_links = true}, 19), vp::status_code::bad_cell_options);
    EXPECT_EQ(code({}, 18), vp::status_code::bad_cell_options);
    EXPECT_EQ(code({.is_solid = true, .is_links = true}, 18), vp::status_code::bad_cell_options);
    EXPECT_EQ(stream_cells(m, g, {}, {.is_solid = true, .is_links = true}).status.code,
              vp::status_code::bad_cell_options);
}

TEST(CellSlabs, RefuseWhatTheyCannot) {
    const mesh m = solids::box(glm::vec3(1.25F), glm::vec3(4.5F));
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    const auto code = [&](const vp::cell_options& how, const slabs::stream_options& options) {
        return stream_cells(m, g, how, options).status.code;
    };
    const vp::core::hole_cones cones;
    EXPECT_EQ(code({}, {.is_solid = true}), vp::status_code::ok);
    EXPECT_EQ(code({}, {}), vp::status_code::bad_cell_options); // triangles beside the grid along x are missing
    EXPECT_EQ(code({.axis = 1}, {.is_solid = true}), vp::status_code::bad_cell_options);
    EXPECT_EQ(code({.repair = vp::repair::close_holes}, {.is_solid = true}), vp::status_code::bad_cell_options);
    EXPECT_EQ(code({}, {.repair = vp::repair::close_holes}), vp::status_code::bad_cell_options);
    EXPECT_EQ(code({.repair = vp::repair::close_holes, .cones = &cones}, {.repair = vp::repair::close_holes}),
              vp::status_code::bad_cell_options);
}

} // namespace
