// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Repairs of meshes in slabs: a flood that goes from slab to slab against one of the whole grid, and calls of slabs
// against crops of one call.
#include "solid_support.hpp"

#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/exterior.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace solids {
namespace {

namespace slabs = vp::slabs;

std::string temporary() { return std::filesystem::temp_directory_path().string(); }

// A set of voxels as bricks.
struct bricks {
    std::vector<std::uint64_t> keys, offsets;
    std::vector<vp::brick_mask> masks;

    // Those of `set` whose layers are within [first, last).
    bricks(const voxel_set& set, glm::ivec3 extent, int first, int last) {
        std::map<std::uint64_t, vp::brick_mask> all;
        for (int z = first; z < last; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    if (set[index(extent, x, y, z)] == 0) continue;
                    const std::uint64_t key = vp::core::morton_key(x, y, z);
                    all[key / 512].words[key % 512 / 64] |= std::uint64_t{1} << (key % 64);
                }
        for (const auto& [key, mask] : all) {
            keys.push_back(key);
            masks.push_back(mask);
        }
    }
    [[nodiscard]] vp::brick_table table(glm::ivec3 extent) const {
        return {keys.data(), masks.data(), nullptr, keys.size(), extent};
    }
};

// The inside by plain steps over bytes, with a ring around the grid.
voxel_set plain_inside(const voxel_set& walls, glm::ivec3 extent, int closing) {
    const glm::ivec3 e = extent + 2 * (closing + 1);
    const auto grown = [&](const voxel_set& from) {
        voxel_set to(from.size());
        for (int z = 0; z < e.z; ++z)
            for (int y = 0; y < e.y; ++y)
                for (int x = 0; x < e.x; ++x) {
                    if (from[index(e, x, y, z)] == 0) continue;
                    for (int w = std::max(0, z - closing); w <= std::min(e.z - 1, z + closing); ++w)
                        for (int v = std::max(0, y - closing); v <= std::min(e.y - 1, y + closing); ++v)
                            for (int u = std::max(0, x - closing); u <= std::min(e.x - 1, x + closing); ++u)
                                to[index(e, u, v, w)] = 1;
                }
        return to;
    };
    voxel_set padded(static_cast<std::size_t>(e.x) * static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z)),
        outside(padded.size());
    const int ring = closing + 1;
    for (int z = 0; z < extent.z; ++z)
        for (int y = 0; y < extent.y; ++y)
            for (int x = 0; x < extent.x; ++x)
                padded[index(e, x + ring, y + ring, z + ring)] = walls[index(extent, x, y, z)];
    padded = grown(padded);
    std::vector<glm::ivec3> queue{{0, 0, 0}}; // the ring is of one piece
    outside[0] = 1;
    while (!queue.empty()) {
        const glm::ivec3 v = queue.back();
        queue.pop_back();
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                glm::ivec3 w = v;
                w[axis] += step;
                if (w[axis] < 0 || w[axis] >= e[axis]) continue;
                const std::size_t i = index(e, w.x, w.y, w.z);
                if (padded[i] != 0 || outside[i] != 0) continue;
                outside[i] = 1;
                queue.push_back(w);
            }
    }
    outside = grown(outside);
    voxel_set inside(walls.size());
    for (int z = 0; z < extent.z; ++z)
        for (int y = 0; y < extent.y; ++y)
            for (int x = 0; x < extent.x; ++x)
                inside[index(extent, x, y, z)] = outside[index(e, x + ring, y + ring, z + ring)] != 0 ? 0 : 1;
    return inside;
}

// A budget that gives slabs of about so many layers.
std::uint64_t budget_for(glm::ivec3 extent, int closing, int layers) {
    const int words = (extent.x + 2 * closing + 2 + 63) / 64, y = extent.y + 2 * closing + 2;
    const std::uint64_t row = std::uint64_t{8} * static_cast<unsigned>(words);
    const auto all = static_cast<std::uint64_t>(layers), grown = static_cast<std::uint64_t>(closing);
    return 2 * static_cast<std::uint64_t>(y) * (all * (4 * row + 8) + 2 * grown * row);
}

struct flood_result {
    std::size_t slabs = 0;
    std::uint64_t visits = 0;
};

// Walls come in two parts whose border cuts bricks; the inside is asked for in boxes of `step` layers.
flood_result expect_flood(const voxel_set& walls, glm::ivec3 extent, int closing, int layers, int step) {
    slabs::slab_exterior flood(extent, closing, budget_for(extent, closing, layers), temporary(), 2);
    const int cut = extent.z / 2;
    const bricks high(walls, extent, cut, extent.z), low(walls, extent, 0, cut);
    flood.add_walls(high.table(extent));
    flood.add_walls(low.table(extent));
    flood.flood();
    const voxel_set expected = plain_inside(walls, extent, closing);
    const glm::ivec3 corner = glm::ivec3(extent.x > 40 ? 35 : 1, 1, 0); // a crop, in x and y
    std::size_t wrong = 0;
    for (int z = 0; z < extent.z; z += step) {
        const glm::ivec3 size(extent.x - corner.x, extent.y - corner.y - 1, std::min(step, extent.z - z));
        const vp::core::bit_grid found = flood.inside({corner.x, corner.y, z}, size);
        for (int k = 0; k < size.z; ++k)
            for (int j = 0; j < size.y; ++j)
                for (int i = 0; i < size.x; ++i)
                    wrong += ((found.get_bits(i & ~31, j, k) >> (i & 31)) & 1) !=
                                     expected[index(extent, corner.x + i, corner.y + j, z + k)]
                                 ? 1
                                 : 0;
    }
    EXPECT_EQ(wrong, 0u) << extent.x << 'x' << extent.y << 'x' << extent.z << " closing " << closing << " layers "
                         << layers;
    return {flood.num_slabs(), flood.num_visits()};
}

TEST(SlabExterior, RandomWallsInAnyNumberOfSlabs) {
    splitmix64 random(5);
    const glm::ivec3 extents[] = {{33, 20, 56}, {64, 9, 31}, {70, 13, 64}, {5, 6, 7}};
    for (const glm::ivec3& extent : extents)
        for (const int closing : {0, 1, 3}) {
            voxel_set walls(static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) *
                            static_cast<std::size_t>(extent.z));
            // So dense that the flood has to wind; sparser where walls grow.
            const std::uint64_t share = closing == 0 ? 66 : closing == 1 ? 4 : 1;
            for (auto& w : walls) w = random.below(closing == 3 ? 300 : 100) < share ? 1 : 0;
            std::size_t most = 0;
            for (const int layers : {8, 16, 32, 1000})
                most = std::max(most, expect_flood(walls, extent, closing, layers, layers == 16 ? 11 : 32).slabs);
            EXPECT_EQ(most, static_cast<std::size_t>((extent.z + 7) / 8));
        }
}

// A channel that goes up and down through all slabs, once for every column, is open at one end alone.
TEST(SlabExterior, AChannelThatWindsThroughAllSlabs) {
    const glm::ivec3 extent(23, 3, 56);
    voxel_set walls(static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) *
                    static_cast<std::size_t>(extent.z));
    for (auto& w : walls) w = 1;
    for (int x = 1; x < extent.x - 1; x += 2)
        for (int z = 1; z < extent.z - 1; ++z) walls[index(extent, x, 1, z)] = 0;
    for (int x = 2; x < extent.x - 2; x += 2) walls[index(extent, x, 1, x % 4 == 2 ? extent.z - 2 : 1)] = 0;
    const flood_result closed = expect_flood(walls, extent, 0, 8, 16);
    EXPECT_EQ(closed.slabs, 7u);
    EXPECT_EQ(closed.visits, 7u) << "nothing comes in";
    walls[index(extent, 0, 1, 1)] = 0;
    EXPECT_GT(expect_flood(walls, extent, 0, 8, 16).visits, 60u);
}

// ---- calls of slabs -------------------------------------------------------------------------------------------------

mesh open_bodies(splitmix64& random, int extent) {
    mesh m = random_bodies(random, extent, 5);
    for (int i = 0; i < 6; ++i)
        m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(random.below(m.triangles.size())));
    m.positions.push_back({std::numeric_limits<float>::quiet_NaN(), 1, 2});
    m.triangles.emplace_back(0, 1, m.positions.size() - 1); // dropped
    return m.moved({-4, -4, -4});                           // leaves the grid
}
std::vector<vp::core::snapped_position> snapped(const mesh& m, const vp::grid& g) {
    const vp::core::snap_transform t = vp::core::make_snap_transform(g);
    std::vector<vp::core::snapped_position> at;
    for (const glm::vec3& p : m.positions) at.push_back(vp::core::snap(t, p.x, p.y, p.z));
    return at;
}
// The layers of a slab, as bytes.
voxel_set layers_of(const voxel_set& whole, glm::ivec3 extent, int begin, int end) {
    return {whole.begin() + static_cast<std::ptrdiff_t>(index(extent, 0, 0, begin)),
            whole.begin() + static_cast<std::ptrdiff_t>(index(extent, 0, 0, end))};
}
const std::vector<std::vector<slabs::layer_range>> cuts{
    {{0, 40}}, {{0, 21}, {21, 40}}, {{3, 10}, {17, 18}, {18, 33}}, {{0, 5}, {5, 6}, {6, 7}, {7, 16}, {16, 40}}};

// Plates across z, where rows along x and y are open, so that columns decide. One lies above the middle of its layer,
// so that its crossings belong to the layer behind it, which it does not reach, and with which a slab begins.
mesh plates() {
    mesh m;
    const auto add = [&](const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
        const auto first = static_cast<unsigned>(m.positions.size());
        m.positions.insert(m.positions.end(), {a, b, c, d});
        m.triangles.emplace_back(first, first + 1, first + 2);
        m.triangles.emplace_back(first, first + 2, first + 3);
    };
    for (const float z : {6.75f, 12.25f}) add({0, 0, z}, {37, 0, z}, {37, 35, z}, {0, 35, z});
    add({1, 0, 0}, {1, 35, 0}, {1, 35, 40}, {1, 0, 40});
    add({0, 1, 0}, {37, 1, 0}, {37, 1, 40}, {0, 1, 40});
    return m;
}

TEST(SlabVote, SlabsAreThoseOfOneCall) {
    const glm::ivec3 extent(37, 35, 40);
    const vp::grid g = unit_grid(extent);
    splitmix64 random(7);
    std::size_t voxels = 0;
    for (int round = 0; round < 12; ++round) {
        const mesh m = round == 0 ? plates() : open_bodies(random, 40);
        vp::solid_options options{.repair = vp::repair::vote};
        const solid whole = library_solid(m, g, options);
        const auto at = snapped(m, g);
        for (const auto& ranges : cuts) {
            slabs::column_parities columns(g, ranges);
            for (const glm::uvec3& t : m.triangles) columns.add(at[t.x], at[t.y], at[t.z]);
            for (std::size_t s = 0; s < ranges.size(); ++s) {
                // The triangles that reach its layers; those that cannot be drawn have no bounds.
                mesh part = m;
                std::erase_if(part.triangles, [&](const glm::uvec3& t) {
                    for (int k = 0; k < 3; ++k)
                        if (!vp::core::is_drawable(at[t[k]])) return true;
                    const vp::core::voxel_box box =
                        vp::core::bounds(at[t.x], at[t.y], at[t.z], vp::core::make_snap_transform(g).fraction);
                    return box.lo[2] >= ranges[s].end || box.hi[2] < ranges[s].begin;
                });
                if (part.triangles.empty()) continue;
                const vp::solid_slab bits = columns.of(s);
                options.slab = &bits;
                const vp::grid slab = g.crop({0, 0, ranges[s].begin}, {extent.x, extent.y, ranges[s].size()});
                const voxel_set expected = layers_of(whole.voxels, extent, ranges[s].begin, ranges[s].end);
                EXPECT_EQ(library_solid(part, slab, options).voxels, expected) << "slab " << s;
                voxels += count(expected);
            }
        }
    }
    EXPECT_GT(voxels, 10'000u);
}

TEST(SlabExterior, SlabsAreThoseOfOneCall) {
    const glm::ivec3 extent(37, 35, 40);
    const vp::grid g = unit_grid(extent);
    splitmix64 random(9);
    for (int round = 0; round < 6; ++round) {
        const mesh m = open_bodies(random, 40);
        const int closing = round % 3;
        vp::solid_options options{.repair = vp::repair::exterior, .closing = closing};
        const solid whole = library_solid(m, g, options);
        slabs::slab_exterior flood(extent, closing, 1, temporary(), 1);
        const bricks walls(library_cover(m, g), extent, 0, extent.z);
        flood.add_walls(walls.table(extent));
        flood.flood();
        for (const auto& ranges : cuts)
            for (const slabs::layer_range& r : ranges) {
                const glm::ivec3 begin(0, 0, r.begin), size(extent.x, extent.y, r.size());
                const vp::core::bit_grid inside = flood.inside(begin, size);
                vp::solid_slab bits;
                bits.inside = inside.data();
                options.slab = &bits;
                const solid slab = library_solid(m, g.crop(begin, size), options);
                EXPECT_EQ(slab.voxels, layers_of(whole.voxels, extent, r.begin, r.end));
                EXPECT_EQ(slab.status.counts.triangles_nonfinite, 1u);
            }
    }
}

TEST(SlabExterior, OptionsThatDoNotFit) {
    const vp::grid g = unit_grid(glm::ivec3(8));
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> bits(backend, g.extent);
    const mesh m = box({1, 1, 1}, {6, 6, 6});
    const auto code = [&](const vp::solid_options& options) {
        return vp::voxelize_solid(backend, m.view(), g, vp::passthrough{}, vp::constant(true), bits, options).code;
    };
    const std::uint64_t word = 0;
    vp::solid_slab none, inside;
    inside.inside = &word;
    EXPECT_EQ(code({.repair = vp::repair::vote, .slab = &none}), vp::status_code::bad_solid_options);
    EXPECT_EQ(code({.repair = vp::repair::vote, .slab = &inside}), vp::status_code::bad_solid_options);
    EXPECT_EQ(code({.repair = vp::repair::exterior, .slab = &none}), vp::status_code::bad_solid_options);
    EXPECT_EQ(code({.slab = &inside}), vp::status_code::bad_solid_options);
    EXPECT_EQ(code({.bodies = vp::bodies::draw, .repair = vp::repair::exterior, .slab = &inside}),
              vp::status_code::bad_solid_options);
    // Other backends take none.
    EXPECT_EQ(vp::core::validate({.repair = vp::repair::exterior, .slab = &inside}, g).code,
              vp::status_code::strategy_unavailable);
}

} // namespace
} // namespace solids
