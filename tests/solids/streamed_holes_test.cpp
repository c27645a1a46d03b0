// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Holes of meshes that come triangle by triangle: the cones are those of the whole mesh, and slabs drawn with them are
// crops of one call.
#include "solid_support.hpp"

#include <voxelpipe/slabs/holes.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

namespace solids {
namespace {

namespace slabs = vp::slabs;

std::vector<vp::core::snapped_position> snapped(const mesh& m, const vp::grid& g) {
    const vp::core::snap_transform t = vp::core::make_snap_transform(g);
    std::vector<vp::core::snapped_position> at;
    for (const glm::vec3& p : m.positions) at.push_back(vp::core::snap(t, p.x, p.y, p.z));
    return at;
}

vp::core::hole_cones found_one_by_one(const std::vector<mesh>& body, const vp::grid& g, std::uint64_t budget,
                                      std::uint64_t max_hole_edges) {
    slabs::hole_finder finder(1000, budget, std::filesystem::temp_directory_path().string());
    for (const mesh& m : body) {
        const auto at = snapped(m, g);
        for (const glm::uvec3& t : m.triangles) finder.add(at[t.x], at[t.y], at[t.z]);
    }
    return finder.finish(max_hole_edges);
}

// Bodies that lost some triangles.
mesh open_bodies(splitmix64& random, int extent) {
    mesh m = random_bodies(random, extent, 5);
    for (int i = 0; i < 6; ++i)
        m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(random.below(m.triangles.size())));
    return m;
}

TEST(StreamedHoles, ConesAreThoseOfTheWholeMesh) {
    const vp::grid g = unit_grid(glm::ivec3(40));
    splitmix64 random(3);
    std::uint64_t holes = 0;
    for (int round = 0; round < 20; ++round) {
        mesh m = open_bodies(random, 40);
        m.positions.push_back({std::numeric_limits<float>::infinity(), 1, 2});
        m.triangles.emplace_back(0, 1, m.positions.size() - 1); // dropped
        m.triangles.emplace_back(0, 1, 1);                      // without area
        const auto at = snapped(m, g);
        const auto n = static_cast<std::uint32_t>(m.triangles.size());
        for (const std::uint64_t most : {std::uint64_t{3}, std::numeric_limits<std::uint64_t>::max()}) {
            const vp::core::hole_cones whole = vp::core::close_holes(
                {{at.data(), at.size(), {m.triangles.data(), n, static_cast<std::uint32_t>(at.size())}, n}}, most);
            holes += whole.holes;
            for (const std::uint64_t budget : {1u << 12, 1u << 20}) { // bytes; the first goes through files
                const vp::core::hole_cones found = found_one_by_one({m}, g, budget, most);
                EXPECT_EQ(found.edges, whole.edges);
                EXPECT_EQ(found.holes, whole.holes);
                EXPECT_EQ(found.cones, whole.cones);
                // Triangles by position, as a set: their order is that of the edges.
                const auto corners = [](const vp::core::hole_cones& cones) {
                    std::vector<std::vector<std::int64_t>> all;
                    for (const glm::uvec3& t : cones.triangles) {
                        auto& one = all.emplace_back();
                        for (int k = 0; k < 3; ++k) {
                            const vp::core::snapped_position& p = cones.positions[t[k]];
                            one.insert(one.end(), {p.x, p.y, p.z});
                        }
                    }
                    std::sort(all.begin(), all.end());
                    return all;
                };
                EXPECT_EQ(corners(found), corners(whole));
            }
        }
    }
    EXPECT_GT(holes, 100u);
}

TEST(StreamedHoles, SlabsAreCropsOfOneCall) {
    const glm::ivec3 e(40, 37, 43);
    const vp::grid g = unit_grid(e);
    splitmix64 random(8);
    const mesh dropped{{{std::numeric_limits<float>::quiet_NaN(), 0, 0}}, {{0, 0, 0}}};
    for (const auto bodies : {vp::bodies::call, vp::bodies::draw}) {
        for (int round = 0; round < 4; ++round) {
            const std::vector<mesh> draws{open_bodies(random, 40), open_bodies(random, 40),
                                          // A tube through all slabs, whose triangles miss the middle ones: its
                                          // holes' cones alone are there.
                                          mesh(box({3, 3, 1}, {9, 9, 2})).add(box({12, 3, 40}, {15, 9, 42}))};
            vp::solid_options how;
            how.repair = vp::repair::close_holes;
            how.bodies = bodies;
            how.extent = vp::solid_extent::outer;
            const solid whole = library_solid(draws, g, how);
            ASSERT_GT(whole.status.solid.holes, 0u);
            std::vector<vp::core::hole_cones> cones;
            if (bodies == vp::bodies::call)
                cones.push_back(found_one_by_one(draws, g, 1 << 14, how.max_hole_edges));
            else
                for (const mesh& m : draws) cones.push_back(found_one_by_one({m}, g, 1 << 14, how.max_hole_edges));
            how.cones = cones.data();
            std::uint64_t open_rows = 0;
            for (const auto& [begin, end] : {std::pair{0, 8}, {8, 21}, {21, 32}, {32, 43}}) {
                // What a slab's call has to draw is the triangles that reach it; none has to be there but one that is
                // dropped.
                std::vector<mesh> parts;
                for (const mesh& m : draws) {
                    mesh& part = parts.emplace_back(dropped);
                    for (const glm::uvec3& t : m.triangles) {
                        const float z[3] = {m.positions[t.x].z, m.positions[t.y].z, m.positions[t.z].z};
                        if (*std::max_element(z, z + 3) < static_cast<float>(begin) ||
                            *std::min_element(z, z + 3) > static_cast<float>(end))
                            continue;
                        mesh one{{m.positions[t.x], m.positions[t.y], m.positions[t.z]}, {{0, 1, 2}}};
                        part.add(one);
                    }
                }
                const vp::grid slab = g.crop({0, 0, begin}, {e.x, e.y, end - begin});
                const solid part = library_solid(parts, slab, how);
                const std::size_t layer = static_cast<std::size_t>(e.x) * static_cast<std::size_t>(e.y);
                EXPECT_TRUE(std::equal(part.voxels.begin(), part.voxels.end(),
                                       whole.voxels.begin() + static_cast<std::ptrdiff_t>(layer) * begin))
                    << begin;
                EXPECT_EQ(part.status.solid.hole_edges, whole.status.solid.hole_edges);
                EXPECT_EQ(part.status.solid.cones, whole.status.solid.cones);
                open_rows += part.status.solid.open_rows;
            }
            EXPECT_EQ(open_rows, whole.status.solid.open_rows);
        }
    }
}

} // namespace
} // namespace solids
