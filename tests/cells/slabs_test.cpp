// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// slabs::stream::draw_cells: the slabs of a mesh that comes in chunks are the parts of one call, with the whole's
// counts.
#include "cell_support.hpp"

#include <voxelpipe/slabs/stream.hpp>

#include <algorithm>
#include <utility>

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
