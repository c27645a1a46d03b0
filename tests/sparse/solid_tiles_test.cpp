// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Tiles of solids in sparse framebuffers: the largest cubes of one value, read in every way, in octrees, merged from
// slabs, and drawn into by later calls.

#include "api_model.hpp"
#include "box_mesh.hpp"
#include "merge_cases.hpp"
#include "triangles.hpp"

#include <voxelpipe/sparse/backend_octree_dag.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using backend_type = vp::cpu_backend;
using unit::small_mesh;

using mask_target = vp::target<vp::bit, blend::bit_or>;
using label_target = vp::target<std::uint32_t, blend::replace>;
using tiled = vp::sparse_framebuffer<backend_type, mask_target, label_target>;

// A box of whole numbers.
small_mesh box_mesh(const glm::ivec3& low, const glm::ivec3& high) {
    small_mesh m;
    unit::add_box(m, glm::vec3(low), glm::vec3(high));
    return m;
}
template <class Framebuffer>
vp::status draw_box(backend_type& backend, const small_mesh& m, const vp::grid& g, Framebuffer& fb,
                    std::uint32_t label) {
    auto shader = vp::constant(true, label);
    const vp::draw<vp::mesh_view<>, vp::passthrough, decltype(shader)> one[]{{m.view(), {}, shader}};
    return vp::voxelize_solid(backend, one, g, fb, {});
}
// Checks each voxel, read in every way; `label` of a voxel that exists, 0 of another.
template <class Label>
void expect_voxels(const vp::host_sparse<mask_target, label_target>& h, const glm::ivec3& extent, const Label& label) {
    std::uint64_t expected = 0, visited = 0, last_key = 0;
    int wrong = 0; // counted, since an assertion a voxel takes long
    const auto dense = vp::get<1>(h).to_dense();
    const glm::ivec3 begin = extent / 3, end = begin + extent / 2;
    const auto middle = vp::get<1>(h).to_dense_region(begin, end - begin);
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        const std::uint32_t is = label(glm::ivec3(x, y, z));
        expected += is != 0 ? 1 : 0;
        wrong += h.contains({x, y, z}) == (is != 0) && vp::get<0>(h)(x, y, z) == (is != 0) ? 0 : 1;
        wrong += vp::get<1>(h)(x, y, z) == is && dense(x, y, z) == is ? 0 : 1;
        if (x >= begin.x && y >= begin.y && z >= begin.z && x < end.x && y < end.y && z < end.z)
            wrong += middle(x, y, z) == is ? 0 : 1;
    });
    h.for_each_voxel([&](const glm::ivec3& v, std::uint64_t rank) {
        const std::uint64_t key = vp::core::morton_key(v + h.where.offset);
        wrong += (visited++ == 0 || last_key < key) && vp::get<1>(h)[rank] == label(v) ? 0 : 1;
        last_key = key;
    });
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(visited, expected);
    EXPECT_EQ(h.num_voxels(), expected);
    EXPECT_EQ(vp::get<1>(h.values).size(), h.num_values());
    // Tiles are the largest cubes: no eight of a level, with one value, have a parent.
    for (const vp::brick_tile& t : h.tiles) {
        const std::uint64_t parent = t.first() >> (3 * t.level() + 3) << (3 * t.level() + 3);
        int siblings = 0;
        for (std::uint64_t c = 0; c < 8; ++c) {
            const auto sibling = vp::brick_tile::of(parent + (c << (3 * t.level())), t.level());
            const auto at = std::find(h.tiles.begin(), h.tiles.end(), sibling);
            const auto n = static_cast<std::uint64_t>(at - h.tiles.begin());
            const auto me = static_cast<std::uint64_t>(&t - h.tiles.data());
            const std::uint64_t first = h.num_values() - h.num_tiles();
            if (at != h.tiles.end() && vp::get<1>(h)[first + n] == vp::get<1>(h)[first + me]) ++siblings;
        }
        EXPECT_LT(siblings, 8);
    }
}

} // namespace

// A grid that is wholly inside is one tile; a box has the largest cubes, and bricks where it ends within one.
TEST(SparseSolids, InsidesAreTiles) {
    backend_type backend = unit::make_backend(2);
    {
        const glm::ivec3 extent(64);
        tiled fb{backend, extent};
        ASSERT_TRUE(draw_box(backend, box_mesh(glm::ivec3(-3), glm::ivec3(70)), unit::unit_grid(extent), fb, 9));
        EXPECT_EQ(fb.num_tiles(), 1u);
        EXPECT_EQ(fb.num_bricks(), 0u);
        EXPECT_EQ(fb.num_voxels(), 64u * 64 * 64);
        EXPECT_EQ(fb.num_values(), 1u);
        expect_voxels(fb.to_host(backend), extent, [](const glm::ivec3&) { return 9u; });
    }
    const glm::ivec3 extent(93, 81, 72), low(5, 8, 3), high(77, 70, 72);
    const vp::grid whole = unit::unit_grid(extent);
    const small_mesh box = box_mesh(low, high);
    const auto inside = [&](const glm::ivec3& v) {
        return v.x >= low.x && v.y >= low.y && v.z >= low.z && v.x < high.x && v.y < high.y && v.z < high.z;
    };
    tiled fb{backend, extent};
    ASSERT_TRUE(draw_box(backend, box, whole, fb, 7));
    const auto h = fb.to_host(backend);
    expect_voxels(h, extent, [&](const glm::ivec3& v) { return inside(v) ? 7u : 0u; });
    std::uint64_t full = 0; // bricks
    for (const vp::brick_tile& t : h.tiles) full += t.num_voxels() / 512;
    EXPECT_EQ(full, 8u * 7 * 8); // bricks 1 to 8, 1 to 7 and 1 to 8
    for (const vp::brick_mask& m : h.masks) EXPECT_LT(m.count(), 512u);
    // A crop has bricks where it cuts them, and the tiles of the rest.
    const vp::grid part = whole.crop({11, 9, 20}, {66, 50, 48});
    tiled cut{backend, part.extent};
    ASSERT_TRUE(draw_box(backend, box, part, cut, 7));
    EXPECT_GT(cut.num_tiles(), 0u);
    expect_voxels(cut.to_host(backend), part.extent,
                  [&](const glm::ivec3& v) { return inside(v + part.offset) ? 7u : 0u; });
    // Slabs joined have the same voxels.
    const vp::grid below = whole.crop({0, 0, 0}, {93, 81, 35}), above = whole.crop({0, 0, 35}, {93, 81, 37});
    tiled a{backend, below.extent}, b{backend, above.extent};
    ASSERT_TRUE(draw_box(backend, box, below, a, 7));
    ASSERT_TRUE(draw_box(backend, box, above, b, 7));
    const auto joined = vp::merge(b.to_host(backend), a.to_host(backend));
    EXPECT_TRUE(vp::same_contents(joined, h));
    expect_voxels(joined, extent, [&](const glm::ivec3& v) { return inside(v) ? 7u : 0u; });
    // By hash.
    const vp::brick_slots slots(backend, fb);
    const vp::sparse_view view = fb.view();
    int wrong = 0;
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        wrong += slots.lookup().find(view.table, {x, y, z}) == view.table.find({x, y, z}) ? 0 : 1;
        wrong += view.read<1>({x, y, z}) == (inside({x, y, z}) ? 7u : 0u) ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0);
    // Capacity.
    tiled small{backend, extent};
    small.limit({fb.num_bricks() + fb.num_tiles() - 1, fb.num_values()});
    const vp::status s = draw_box(backend, box, whole, small, 7);
    EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(s.required.bricks, fb.num_bricks() + fb.num_tiles());
    EXPECT_EQ(s.required.voxels, fb.num_values());
    EXPECT_EQ(small.num_voxels(), 0u);
}

TEST(SparseSolids, MergedSlabsHaveTheTilesOfTheWhole) {
    backend_type backend = unit::make_backend(2);
    merge_cases::slabs_are_the_whole(backend, oracle::test_scale() < 1 ? 5 : 1);
    merge_cases::other_tiles_stay(backend);
}

// An octree has a tile as one node: the same voxels, values and rays as those of the bricks that it stands for.
TEST(SparseSolids, OctreesHaveTiles) {
    backend_type backend = unit::make_backend(2);
    using counted = vp::target<std::uint32_t, blend::add>;
    using image_type = vp::sparse_framebuffer<backend_type, counted, vp::target<float, blend::add>>;
    const glm::ivec3 extent(70, 60, 64);
    const vp::grid grid = unit::unit_grid(extent);
    const small_mesh box = box_mesh({3, 2, 0}, {70, 59, 62});
    auto shader = vp::constant(3u, 0.1f);
    const vp::draw<vp::mesh_view<>, vp::passthrough, decltype(shader)> draws[]{{box.view(), {}, shader}};
    // The second body is elsewhere: blends that count bodies have no tiles.
    const small_mesh nothing = box_mesh(glm::ivec3(-9), glm::ivec3(-5));
    const vp::draw<vp::mesh_view<>, vp::passthrough, decltype(shader)> two[]{{box.view(), {}, shader},
                                                                             {nothing.view(), {}, shader}};
    image_type with{backend, extent}, without{backend, extent};
    ASSERT_TRUE(vp::voxelize_solid(backend, draws, grid, with, {}));
    ASSERT_TRUE(vp::voxelize_solid(backend, two, grid, without, vp::each_draw));
    ASSERT_GT(with.num_tiles(), 0u);
    ASSERT_EQ(without.num_tiles(), 0u);
    ASSERT_EQ(with.num_voxels(), without.num_voxels());
    const auto a = with.to_host(backend), b = without.to_host(backend);
    const vp::octree tiled_tree(a), full_tree(b);
    EXPECT_LT(tiled_tree.num_bytes() * 2, full_tree.num_bytes());
    ASSERT_EQ(tiled_tree.num_levels(), full_tree.num_levels());
    const vp::backend_octree of_backend(backend, with);
    EXPECT_TRUE(of_backend.to_host(backend) == tiled_tree);

    // Every node of the one that exists in the other has its value.
    const auto compare = [&](const auto& x, const auto& y) {
        int wrong = 0;
        for (int level = 1; level <= tiled_tree.num_levels(); ++level) {
            std::vector<std::pair<std::uint64_t, std::uint64_t>> nodes; // key, number
            full_tree.for_each_node(
                level, [&](const glm::ivec3& p, std::uint64_t n) { nodes.emplace_back(vp::core::morton_key(p), n); });
            tiled_tree.for_each_node(level, [&](const glm::ivec3& p, std::uint64_t n) {
                const auto at = std::lower_bound(nodes.begin(), nodes.end(),
                                                 std::pair<std::uint64_t, std::uint64_t>(vp::core::morton_key(p), 0));
                const bool is_there = at != nodes.end() && at->first == vp::core::morton_key(p);
                wrong += is_there && x.at(level)[n] == y.at(level)[at->second] ? 0 : 1;
            });
        }
        EXPECT_EQ(wrong, 0);
    };
    const auto both = [&](const auto& reducer) {
        compare(vp::reduce_levels<0>(tiled_tree, a, reducer), vp::reduce_levels<0>(full_tree, b, reducer));
        compare(vp::reduce_levels<1>(tiled_tree, a, reducer), vp::reduce_levels<1>(full_tree, b, reducer));
    };
    both(vp::reduce::sum{});
    both(vp::reduce::mean<0>{});
    both(vp::reduce::mean_of_volume{});
    both(vp::reduce::max{});
    both(vp::reduce::majority{});

    oracle::splitmix64 random(5);
    int hits = 0, wrong = 0;
    for (int i = 0; i < 2000; ++i) {
        glm::dvec3 from, towards;
        for (int k = 0; k < 3; ++k) {
            from[k] = static_cast<double>(random.between(-1000, 8000)) / 64;
            towards[k] = static_cast<double>(random.between(0, 4000)) / 64 - from[k];
        }
        const vp::voxel_hit x = tiled_tree.first_hit(from, towards), y = full_tree.first_hit(from, towards);
        hits += y.found ? 1 : 0;
        wrong += x.found == y.found && x.voxel == y.voxel && x.distance == y.distance && x.axis == y.axis ? 0 : 1;
        if (x.found) wrong += x.rank == a.table().find(x.voxel) ? 0 : 1;
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(hits, 500);

    const vp::octree_dag dag(tiled_tree);
    EXPECT_TRUE(vp::backend_octree_dag(backend, of_backend).to_host(backend) == dag);
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        wrong += dag.contains({x, y, z}) == a.contains({x, y, z}) ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0);
}

// Tiles become bricks where a later call draws into them; the rest stays the largest cubes, with the values that it
// had.
TEST(SparseSolids, TilesAreLoaded) {
    backend_type backend = unit::make_backend(2);
    const glm::ivec3 extent(80, 72, 96), low(0, 3, 8), high(80, 67, 90);
    const vp::grid whole = unit::unit_grid(extent);
    const auto is_in = [](const glm::ivec3& v, const glm::ivec3& from, const glm::ivec3& to) {
        return v.x >= from.x && v.y >= from.y && v.z >= from.z && v.x < to.x && v.y < to.y && v.z < to.z;
    };
    tiled fb{backend, extent};
    ASSERT_TRUE(draw_box(backend, box_mesh(low, high), whole, fb, 7));
    const std::uint64_t tiles = fb.num_tiles();
    ASSERT_GT(tiles, 0u);
    vp::get<0>(fb).load();
    vp::get<1>(fb).load();
    const glm::ivec3 from(13, 21, 40), to(21, 30, 49);
    ASSERT_TRUE(draw_box(backend, box_mesh(from, to), whole, fb, 5));
    const auto label = [&](const glm::ivec3& v) { return is_in(v, from, to) ? 5u : is_in(v, low, high) ? 7u : 0u; };
    expect_voxels(fb.to_host(backend), extent, label);
    EXPECT_GT(fb.num_tiles(), tiles);
    // A clear that keeps the other target; tiles stay, with the clear value.
    vp::get<1>(fb).clear(3);
    ASSERT_TRUE(vp::clear(backend, fb));
    const auto cleared = fb.to_host(backend);
    EXPECT_GT(cleared.num_tiles(), 0u);
    int wrong = 0;
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        wrong += vp::get<0>(cleared)(x, y, z) == (label({x, y, z}) != 0) && vp::get<1>(cleared)(x, y, z) == 3 ? 0 : 1;
    });
    // A surface over all.
    vp::get<1>(fb).load();
    const small_mesh skin = box_mesh(low + 5, high - 9);
    ASSERT_TRUE(vp::voxelize(backend, skin.view(), whole, vp::passthrough{}, vp::constant(true, 8u), fb));
    vp::framebuffer<backend_type, label_target> dense{backend, extent};
    ASSERT_TRUE(vp::voxelize(backend, skin.view(), whole, vp::passthrough{}, vp::constant(8u), dense));
    const auto surface = vp::get<0>(dense).to_host_target(backend);
    const auto drawn = fb.to_host(backend);
    EXPECT_GT(drawn.num_tiles(), 0u);
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        const bool is_drawn = surface(x, y, z) == 8;
        wrong += vp::get<1>(drawn)(x, y, z) == (is_drawn ? 8u : 3u) ? 0 : 1;
        wrong += vp::get<0>(drawn)(x, y, z) == (is_drawn || label({x, y, z}) != 0) ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0);
}
