// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Levels of dense grids against those of an octree; levels of light against their definition; rays through bits against
// every voxel's box.

#include "levels_cases.hpp"

#include "api_model.hpp"

#include <voxelpipe/sparse/octree.hpp>

#include <gtest/gtest.h>

#include <cmath>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using vp::cpu_backend;

using weight = vp::target<glm::vec2, blend::add>;
using fragments = vp::target<std::uint32_t, blend::count>;
using number = vp::target<std::int16_t, blend::replace>;
using flag = vp::target<vp::bit, blend::bit_or>;
using dense = vp::framebuffer<cpu_backend, weight, fragments, number, flag>;
using sparse = vp::sparse_framebuffer<cpu_backend, weight, fragments, number, flag>;

struct shader {
    auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = unit::mark(f.primitive, f.voxel);
        return vp::outputs(glm::vec2(static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-30f, f.barycentric.x), 1u,
                           static_cast<std::int16_t>(m % 5 - 2), true);
    }
};

struct least_bits { // a reducer of the caller's
    std::int16_t operator()(std::span<const std::int16_t> children) const {
        std::int16_t all = -1;
        for (const std::int16_t c : children) all = static_cast<std::int16_t>(all & c);
        return all;
    }
};

template <std::size_t I, class Reducer>
void expect_levels_of_the_octree(cpu_backend& backend, const dense& fb, const vp::octree& tree, const auto& host,
                                 const Reducer& reducer) {
    const auto expected = vp::reduce_levels<I>(tree, host, reducer);
    const vp::target_voxels voxels{vp::get<I>(fb).view(), vp::get<3>(fb).view(), vp::get<1>(fb).view()};
    const auto made = vp::reduce_levels(backend, fb.extent(), voxels, reducer);
    ASSERT_EQ(made.num_levels(), tree.num_levels());
    for (int l = 1; l <= tree.num_levels(); ++l) {
        const glm::ivec3 e = vp::mip_extent(fb.extent(), l);
        const auto& values = made.values[static_cast<std::size_t>(l) - 1];
        const auto& exists = made.exists[static_cast<std::size_t>(l) - 1];
        std::size_t differing = 0, existing = 0;
        tree.for_each_node(l, [&](const glm::ivec3& place, std::uint64_t n) {
            const std::size_t i = vp::direction_mips_view::index(e, place);
            differing += exists.data()[i] != 1 ||
                                 std::memcmp(&values.data()[i], &expected.at(l)[n], sizeof(values.data()[i])) != 0
                             ? 1
                             : 0;
        });
        for (std::size_t i = 0; i < exists.size(); ++i) existing += exists.data()[i];
        EXPECT_EQ(differing, 0u) << "level " << l;
        EXPECT_EQ(existing, tree.num_nodes(l));
    }
}

TEST(DenseLevels, AreThoseOfTheOctree) {
    const glm::ivec3 extent{100, 70, 45};
    const unit::small_mesh mesh = unit::make_mesh(8, 40, extent);
    const vp::grid g = unit::unit_grid(extent);
    cpu_backend backend = unit::make_backend();
    dense d{backend, extent};
    sparse s{backend, extent};
    ASSERT_TRUE(vp::voxelize(backend, mesh.view(), g, vp::passthrough{}, shader{}, d));
    ASSERT_TRUE(vp::voxelize(backend, mesh.view(), g, vp::passthrough{}, shader{}, s));
    const auto host = s.to_host(backend);
    const vp::octree tree(host);
    namespace r = vp::reduce;
    expect_levels_of_the_octree<0>(backend, d, tree, host, r::sum{});
    expect_levels_of_the_octree<0>(backend, d, tree, host, r::mean<1>{});
    expect_levels_of_the_octree<0>(backend, d, tree, host, r::mean_of_voxels{});
    expect_levels_of_the_octree<0>(backend, d, tree, host, r::mean_of_volume{});
    expect_levels_of_the_octree<0>(backend, d, tree, host, r::min{});
    expect_levels_of_the_octree<0>(backend, d, tree, host, r::majority{});
    expect_levels_of_the_octree<2>(backend, d, tree, host, r::max{});
    expect_levels_of_the_octree<2>(backend, d, tree, host, r::mean_of_voxels{});
    expect_levels_of_the_octree<2>(backend, d, tree, host, r::majority{});
    expect_levels_of_the_octree<2>(backend, d, tree, host, least_bits{});
    expect_levels_of_the_octree<3>(backend, d, tree, host, r::bit_or{});
}

TEST(DenseLevels, DoNotDependOnTheNumberOfThreads) {
    cpu_backend one{1}, three{3};
    EXPECT_EQ(levels::all_reduced(one), levels::all_reduced(three));
    EXPECT_EQ(levels::all_light(one), levels::all_light(three));
}

// ---- light ----------------------------------------------------------------------------------------------------------

TEST(PackedLight, RoundsAsAHalfDoes) {
    for (std::uint64_t i = 0; i < 20000; ++i) {
        float v = vp::core::bit_cast<float>(0x38800000u + levels::hash(i) % 0x0effe000u);              // 2^-14 to 65504
        if (i % 3 == 0) v = vp::core::bit_cast<float>(vp::core::bit_cast<std::uint32_t>(v) & ~0xfffu); // with ties
        const vp::half expected(v);
        const vp::packed_light p = vp::pack_light({v, 0.0f, v, 1.0f});
        ASSERT_EQ(p.xy, expected.bits) << v;
        ASSERT_EQ(p.zw, expected.bits | 0x3c000000u) << v;
        EXPECT_EQ(vp::unpack_light(p),
                  glm::vec4(static_cast<float>(expected), 0.0f, static_cast<float>(expected), 1.0f));
    }
    const float least = 0x1p-14f, nan = std::nanf("");
    EXPECT_EQ(vp::unpack_light(vp::pack_light({least, 0.99f * least, 1e9f, nan})), glm::vec4(least, 0, 65504, 0));
}

TEST(DirectionMips, HaveTheirGoldenBytes) {
    cpu_backend backend{2};
    EXPECT_EQ(levels::digest(levels::all_light(backend)), levels::golden_light);
}

TEST(DirectionMips, KeepALayerOpaqueAndItsSidesApart) {
    cpu_backend backend{2};
    vp::direction_mips<cpu_backend> mips(backend, {32, 32, 32});
    const auto size = glm::ivec3(32);
    for (std::size_t i = 0; i < 32768; ++i) mips.finest()[i] = {};
    // A wall of three layers across x, red towards -x and blue towards +x.
    for (int z = 0; z < 32; ++z)
        for (int y = 0; y < 32; ++y)
            for (int x = 14; x <= 16; ++x)
                mips.finest()[vp::direction_mips_view::index(size, {x, y, z})] =
                    vp::pack_light(x == 14   ? glm::vec4(1, 0, 0, 1)
                                   : x == 15 ? glm::vec4(0, 0, 0, 1)
                                             : glm::vec4(0, 0, 1, 1));
    mips.build(backend);
    const vp::direction_mips_view& v = mips.view();
    ASSERT_EQ(v.last_level, 5);
    EXPECT_EQ(v.fetch(1, 0, {7, 4, 4}), glm::vec4(1, 0, 0, 1));       // voxels 14 and 15, seen towards +x
    EXPECT_EQ(v.fetch(1, 1, {7, 4, 4}), glm::vec4(0, 0, 0, 1));       // from behind: the middle
    EXPECT_EQ(v.fetch(1, 1, {8, 4, 4}), glm::vec4(0, 0, 1, 1));       // 16 and nothing
    EXPECT_EQ(v.fetch(1, 2, {8, 4, 4}), glm::vec4(0, 0, 0.5f, 0.5f)); // along y: half of the columns
    EXPECT_EQ(v.fetch(5, 0, {0, 0, 0}), glm::vec4(1, 0, 0, 1));       // the whole grid is opaque across the wall
    EXPECT_EQ(v.fetch(5, 1, {0, 0, 0}), glm::vec4(0, 0, 1, 1));
    EXPECT_LT(v.fetch(5, 4, {0, 0, 0}).w, 0.5f); // and not along it
    EXPECT_EQ(v.fetch(1, 0, {-1, 4, 4}), glm::vec4(0.0f));
}

TEST(DirectionMips, ShowLightOnTheSideThatAVoxelFaces) {
    EXPECT_EQ(vp::pack_facing({1, 0, -1}), 0x81007fu);
    EXPECT_EQ(vp::facing_part(0, {1, 0, 0}), 1.0f);
    EXPECT_EQ(vp::facing_part(vp::pack_facing({-1, 0, 0}), {1, 0, 0}), 1.0f);
    EXPECT_EQ(vp::facing_part(vp::pack_facing({-1, 0, 0}), {-1, 0, 0}), 0.0f);
    EXPECT_EQ(vp::facing_part(vp::pack_facing({-1, 0, 0}), {0, 0, 1}), 0.0f);
    cpu_backend backend{2};
    const glm::ivec3 size(8);
    vp::direction_mips<cpu_backend> mips(backend, size, true);
    for (std::size_t i = 0; i < 512; ++i) {
        mips.finest()[i] = {};
        mips.facings()[i] = 0;
    }
    // A layer that is lit on its upper side.
    for (int z = 0; z < 8; ++z)
        for (int x = 0; x < 8; ++x) {
            const std::size_t i = vp::direction_mips_view::index(size, {x, 3, z});
            mips.finest()[i] = vp::pack_light(glm::vec4(1.0f));
            mips.facings()[i] = vp::pack_facing({0, 1, 0});
        }
    mips.build(backend);
    const vp::direction_mips_view& v = mips.view();
    for (int level = 0; level <= v.last_level; ++level) {
        const glm::ivec3 at = level == 0 ? glm::ivec3(3) : glm::ivec3(3 >> level);
        EXPECT_EQ(v.fetch(level, 3, at), glm::vec4(1.0f)) << level;         // from above
        EXPECT_EQ(v.fetch(level, 2, at), glm::vec4(0, 0, 0, 1)) << level;   // from below it is as opaque, and dark
        EXPECT_EQ(glm::vec3(v.fetch(level, 0, at)), glm::vec3(0)) << level; // and from the side
    }
    EXPECT_EQ(v.sample(0, glm::vec3(3.5f), {0, -1, 0}), glm::vec4(1.0f));
    EXPECT_EQ(v.sample(0, glm::vec3(3.5f), {0, 1, 0}), glm::vec4(0, 0, 0, 1));
}

TEST(DirectionMips, AreSampledLinearlyBetweenCentresAndLevels) {
    cpu_backend backend{2};
    vp::direction_mips<cpu_backend> mips(backend, levels::extent);
    backend.for_each(mips.view().num_voxels(0), levels::set_light{mips.finest(), nullptr});
    mips.build(backend);
    const vp::direction_mips_view& v = mips.view();
    const glm::vec3 along(0.6f, -0.8f, 0.0f);
    for (int level = 0; level <= v.last_level; ++level) {
        const glm::ivec3 e = vp::mip_extent(levels::extent, level), at = e / 2;
        const auto mixed = [&](const glm::ivec3& voxel) {
            return level == 0 ? v.fetch(0, 0, voxel)
                              : 0.36f * v.fetch(level, 0, voxel) + 0.64f * v.fetch(level, 3, voxel);
        };
        const float side = std::ldexp(1.0f, level);
        const glm::vec3 centre = (glm::vec3(at) + 0.5f) * side;
        const auto near = [&](const glm::vec4& a, const glm::vec4& b) {
            EXPECT_LT(glm::length(a - b), 3e-4f) << level;
        };
        near(v.sample(level, centre, along), mixed(at));
        near(v.sample(level, centre + glm::vec3(0.25f * side, 0, 0), along),
             0.75f * mixed(at) + 0.25f * mixed(at + glm::ivec3(1, 0, 0)));
        if (level != 0)
            near(v.sample(static_cast<float>(level) - 0.25f, centre, along),
                 0.75f * v.sample(level, centre, along) + 0.25f * v.sample(level - 1, centre, along));
        EXPECT_EQ(v.sample(level, glm::vec3(-side), along), glm::vec4(0.0f));
        EXPECT_EQ(v.sample(level, glm::vec3(1e30f), along), glm::vec4(0.0f));
    }
    EXPECT_EQ(v.sample(-1.0f, glm::vec3(9.5f), along), v.sample(0, glm::vec3(9.5f), along));
    EXPECT_EQ(v.sample(99.0f, glm::vec3(9.5f), along), v.sample(v.last_level, glm::vec3(9.5f), along));
}

// ---- bits -----------------------------------------------------------------------------------------------------------

TEST(DenseBits, RaysMeetTheNearestBox) {
    cpu_backend backend{2};
    const std::vector<std::uint32_t> words = levels::some_bits();
    const vp::dense_bits bits(words.data(), levels::extent);
    const std::vector<levels::ray_result> results = levels::all_rays(backend);
    std::vector<glm::ivec3> set;
    for (int z = 0; z < levels::extent.z; ++z)
        for (int y = 0; y < levels::extent.y; ++y)
            for (int x = 0; x < levels::extent.x; ++x)
                if (bits({x, y, z})) set.emplace_back(x, y, z);
    ASSERT_GT(set.size(), 300u);
    EXPECT_FALSE(bits({-1, 0, 0}) || bits({0, levels::extent.y, 0}));
    int found = 0, disagreeing = 0;
    for (std::uint64_t i = 0; i < levels::num_rays; ++i) {
        const glm::dvec3 o = levels::cast_rays::origin_of(i), d = levels::cast_rays::direction_of(i);
        double nearest = 1e300;
        glm::ivec3 where(-1);
        for (const glm::ivec3& v : set) {
            double begin = 0, end = 100.0;
            for (int a = 0; a < 3; ++a) {
                if (d[a] == 0) {
                    if (o[a] < v[a] || o[a] >= v[a] + 1) end = -1;
                    continue;
                }
                const double t0 = (v[a] - o[a]) / d[a], t1 = (v[a] + 1 - o[a]) / d[a];
                begin = std::max(begin, std::min(t0, t1));
                end = std::min(end, std::max(t0, t1));
            }
            if (begin < end && begin < nearest) {
                nearest = begin;
                where = v;
            }
        }
        const levels::ray_result& r = results[i];
        ASSERT_EQ(r.face >= 0, where.x >= 0) << i;
        EXPECT_TRUE(r.blocked == 0 || r.blocked == 3) << i; // bits and bricks agree
        disagreeing += (r.blocked != 0) != (where.x >= 0) ? 1 : 0;
        if (where.x < 0) continue;
        ++found;
        ASSERT_EQ(r.voxel, where) << i;
        EXPECT_NEAR(r.distance, nearest, 1e-9);
        EXPECT_EQ(r.rank, vp::direction_mips_view::index(levels::extent, where));
        if (nearest > 0) {
            const int axis = r.face & 3;
            const double side = where[axis] + ((r.face & 8) != 0 ? 1 : 0);
            EXPECT_NEAR(o[axis] + r.distance * d[axis], side, 1e-9);
            EXPECT_EQ((r.face & 8) != 0, d[axis] < 0);
        }
    }
    EXPECT_GT(found, 250);
    EXPECT_LT(disagreeing, 3); // float meets another voxel only where a ray grazes one
}

// A ray passes empty bricks at once, and meets the cells that single steps lead to, at the same distances.
TEST(BrickBits, RaysMeetTheCellsThatStepsLeadTo) {
    cpu_backend backend{2};
    const glm::ivec3 size(61, 34, 50);
    std::vector<std::uint32_t> words(vp::core::storage_map<vp::bit, vp::layout::linear>::elements(size));
    const vp::dense_bits bits(words.data(), size);
    for (int i = 0; i < 300; ++i) {
        const std::uint32_t h = levels::hash(static_cast<std::uint64_t>(i));
        const glm::ivec3 v(h % 61, h / 61 % 34, h / 2074 % 50);
        words[vp::core::storage_map<vp::bit, vp::layout::linear>::cell(size, v.x, v.y, v.z)] |= 1u << (v.x & 31);
    }
    vp::brick_bits<cpu_backend> bricks(backend, size);
    bricks.build(backend, vp::bit_rows{bits});
    std::size_t met = 0;
    for (std::uint64_t i = 0; i < 12000; ++i) {
        glm::vec3 o(levels::cast_rays::origin_of(i)), d(levels::cast_rays::direction_of(i));
        if (i % 5 == 0) { // along diagonals, through corners of cells
            o = glm::floor(o);
            for (int a = 0; a < 3; ++a) d[a] = d[a] < 0 ? -1.0f : 1.0f;
        }
        std::vector<vp::walked_cell<float>> expected, found;
        vp::walk_cells(size, o, d, 90.0f, [&](const vp::walked_cell<float>& at) {
            if (bits(at.cell)) expected.push_back(at);
            return false;
        });
        EXPECT_FALSE(bricks.view().walk(o, d, 90.0f, [&](const vp::walked_cell<float>& at) {
            found.push_back(at);
            return false;
        }));
        ASSERT_EQ(found.size(), expected.size()) << i;
        for (std::size_t k = 0; k < found.size(); ++k) {
            ASSERT_EQ(found[k].cell, expected[k].cell) << i;
            EXPECT_EQ(found[k].enter, expected[k].enter);
            EXPECT_EQ(found[k].leave, expected[k].leave);
            EXPECT_EQ(found[k].axis, expected[k].axis);
            EXPECT_EQ(found[k].from_above, expected[k].from_above);
        }
        EXPECT_EQ(bricks.view().blocks(o, d, 90.0f), !expected.empty());
        met += found.size();
    }
    EXPECT_GT(met, 300u);
}

TEST(DenseBits, HaveTheEightBitsOfALargerVoxel) {
    cpu_backend backend{2};
    const std::vector<std::uint32_t> words = levels::some_bits();
    const vp::dense_bits bits(words.data(), levels::extent);
    int set = 0;
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 12; ++y)
            for (int x = 0; x < 20; ++x) {
                std::uint32_t expected = 0;
                for (int c = 0; c < 8; ++c)
                    if (bits({2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2)})) expected |= 1u << c;
                ASSERT_EQ(bits.children({x, y, z}), expected);
                set += static_cast<int>(expected);
            }
    EXPECT_GT(set, 0);
}

} // namespace
