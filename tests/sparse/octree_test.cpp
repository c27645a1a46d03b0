// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The octree over a sparse framebuffer: its nodes, the values of its levels, rays through it and its graph of equal
// subtrees, against plain loops over the voxels.

#include "api_model.hpp"
#include "octree_cases.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using backend_type = vp::cpu_backend;
using vp::core::morton_key;

using weight = vp::target<float, blend::add>;
using fragments = vp::target<std::uint32_t, blend::count>;
using color = vp::target<glm::u8vec4, blend::max>;
using number = vp::target<std::int16_t, blend::replace>;
using precise = vp::target<glm::dvec2, blend::add>;
using flag = vp::target<vp::bit, blend::bit_xor>;
using framebuffer = vp::sparse_framebuffer<backend_type, weight, fragments, color, number, precise, flag>;
using host = decltype(std::declval<const framebuffer&>().to_host(std::declval<backend_type&>()));

struct shader {
    auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = unit::mark(f.primitive, f.voxel);
        return vp::outputs(static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-37f, 1u,
                           glm::u8vec4(m, m >> 8, m >> 16, m >> 24), static_cast<std::int16_t>(m % 3 - 1),
                           glm::dvec2(static_cast<double>(static_cast<std::int64_t>(m)) * 0x1p-70, f.barycentric.x),
                           (m & 1u) != 0);
    }
};

const glm::ivec3 whole{100, 150, 70};

host drawn(bool keeps_sums) {
    backend_type backend = unit::make_backend();
    const vp::grid part = unit::unit_grid(whole).crop({5, 3, 11}, {90, 140, 50});
    const unit::small_mesh mesh = unit::make_mesh(21, 60, whole);
    framebuffer fb{backend, part.extent};
    if (keeps_sums) {
        fb.keep_sums<0>();
        fb.keep_sums<4>();
    }
    EXPECT_TRUE(vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, fb));
    EXPECT_GT(fb.num_voxels(), 3000u);
    return fb.to_host(backend);
}

// The ranks below each node of a level, by the node's Morton key.
std::map<std::uint64_t, std::vector<std::uint64_t>> nodes_of(const host& h, int level) {
    std::map<std::uint64_t, std::vector<std::uint64_t>> nodes;
    h.for_each_voxel([&](const glm::ivec3& v, std::uint64_t rank) {
        nodes[morton_key(v + h.where.offset) >> (3 * level)].push_back(rank);
    });
    return nodes;
}

TEST(Octree, HasTheNodesThatHoldAVoxelInMortonOrder) {
    const host h = drawn(false);
    const vp::octree tree(h);
    ASSERT_EQ(tree.num_levels(), 8); // 256 holds 150
    EXPECT_EQ(tree.num_nodes(8), 1u);
    EXPECT_EQ(tree.num_nodes(3), h.num_bricks());
    for (int level = 0; level <= 8; ++level) {
        const auto expected = nodes_of(h, level);
        ASSERT_EQ(tree.num_nodes(level), expected.size());
        auto at = expected.begin();
        std::uint64_t next = 0;
        tree.for_each_node(level, [&](const glm::ivec3& place, std::uint64_t n) {
            EXPECT_EQ(n, next++);
            EXPECT_EQ(morton_key(place), at->first);
            ++at;
        });
        EXPECT_EQ(next, expected.size());
    }
    // A byte a node, and 16 for 64 of them; each level ends with up to 7 bytes and up to 63 nodes' share of a block.
    std::uint64_t nodes = 0;
    for (int level = 1; level <= 8; ++level) nodes += tree.num_nodes(level);
    EXPECT_GE(tree.num_bytes(), nodes + nodes / 4);
    EXPECT_LE(tree.num_bytes(), nodes + nodes / 4 + 8 * (7 + 16));
    const host none{};
    EXPECT_EQ(vp::octree(none).num_levels(), 0);
    EXPECT_FALSE(vp::octree(none).first_hit({0.5, 0.5, -1}, {0, 0, 1}).found);
}

// Exact sums in 2^-64, of the fragments' terms as blend::add rounds them.
TEST(Octree, SumsAndMeansAreThoseOfAllTermsRoundedOnce) {
    const host kept = drawn(true);
    const vp::octree tree(kept);
    const auto sum = vp::reduce_levels<0>(tree, kept, vp::reduce::sum{});
    const auto mean = vp::reduce_levels<0>(tree, kept, vp::reduce::mean<1>{});
    const auto of_voxels = vp::reduce_levels<0>(tree, kept, vp::reduce::mean_of_voxels{});
    const auto of_volume = vp::reduce_levels<0>(tree, kept, vp::reduce::mean_of_volume{});
    const auto doubles = vp::reduce_levels<4>(tree, kept, vp::reduce::sum{});
    const auto counts = vp::reduce_levels<1>(tree, kept, vp::reduce::sum{});
    const auto signed_mean = vp::reduce_levels<3>(tree, kept, vp::reduce::mean_of_voxels{});
    const auto covered = vp::reduce_levels<5>(tree, kept, vp::reduce::sum{});
    std::uint64_t rounded_differs = 0;
    for (int level = 1; level <= tree.num_levels(); ++level) {
        std::size_t n = 0;
        for (const auto& [key, ranks] : nodes_of(kept, level)) {
            vp::int128 units = 0, double_units = 0;
            std::uint64_t fragment_count = 0, bits = 0;
            std::int64_t integers = 0;
            float of_rounded = 0;
            for (const std::uint64_t r : ranks) {
                const auto& s = vp::get<0>(kept.sums)[r];
                units += static_cast<vp::int128>(s.top) * (static_cast<vp::int128>(1) << 64) + s.limb[0];
                const auto& d = vp::get<4>(kept.sums)[r].c[0];
                ASSERT_EQ(d.top, d.limb[1] >> 63 != 0 ? -1 : 0);
                double_units += static_cast<vp::int128>(static_cast<vp::uint128>(d.limb[1]) << 64 | d.limb[0]);
                fragment_count += vp::get<1>(kept)[r];
                integers += vp::get<3>(kept)[r];
                bits += vp::get<5>(kept)[r] ? 1 : 0;
                of_rounded += vp::get<0>(kept)[r];
            }
            const auto as_float = [&](std::uint64_t divisor, std::uint64_t scale) {
                // Nearest by comparing the two floats around an estimate, in integers.
                const double estimate =
                    static_cast<double>(units) * 0x1p-32 / static_cast<double>(divisor) / static_cast<double>(scale);
                float best = static_cast<float>(estimate);
                for (const float f : {std::nextafter(best, -HUGE_VALF), std::nextafter(best, HUGE_VALF)}) {
                    const auto off = [&](float x) {
                        return std::abs(static_cast<long double>(x) * 0x1p32L * static_cast<long double>(divisor) *
                                            static_cast<long double>(scale) -
                                        static_cast<long double>(units));
                    };
                    if (off(f) < off(best)) best = f;
                }
                return best;
            };
            ASSERT_EQ(sum.at(level)[n], as_float(1, 1)) << level << ' ' << n;
            ASSERT_EQ(mean.at(level)[n], as_float(fragment_count, 1));
            ASSERT_EQ(of_voxels.at(level)[n], as_float(ranks.size(), 1));
            ASSERT_EQ(of_volume.at(level)[n], as_float(1, std::uint64_t{1} << (3 * level)));
            ASSERT_EQ(doubles.at(level)[n].x, static_cast<double>(static_cast<long double>(double_units)) * 0x1p-64);
            ASSERT_EQ(counts.at(level)[n], fragment_count);
            ASSERT_EQ(signed_mean.at(level)[n], static_cast<double>(integers) / static_cast<double>(ranks.size()));
            ASSERT_EQ(covered.at(level)[n], bits);
            rounded_differs += sum.at(level)[n] != of_rounded ? 1 : 0;
            ++n;
        }
        ASSERT_EQ(sum.at(level).size(), n);
    }
    EXPECT_GT(rounded_differs, 100u); // a sum of rounded children is something else
    // Without kept sums: of the voxels' values.
    const host plain = drawn(false);
    const auto of_values = vp::reduce_levels<0>(tree, plain, vp::reduce::sum{});
    EXPECT_EQ(of_values.at(1).size(), sum.at(1).size());
    EXPECT_NEAR(of_values.at(tree.num_levels())[0], sum.at(tree.num_levels())[0], 0.1);
}

struct middle { // of the children in Morton order
    std::int16_t operator()(std::span<const std::int16_t> children) const { return children[children.size() / 2]; }
};

TEST(Octree, FoldsGoLevelByLevelInMortonOrder) {
    const host h = drawn(false);
    const vp::octree tree(h);
    const auto least = vp::reduce_levels<0>(tree, h, vp::reduce::min{});
    const auto greatest = vp::reduce_levels<2>(tree, h, vp::reduce::max{});
    const auto any = vp::reduce_levels<5>(tree, h, vp::reduce::bit_or{});
    const auto common = vp::reduce_levels<3>(tree, h, vp::reduce::majority{});
    const auto own = vp::reduce_levels<3>(tree, h, middle{});
    for (int level = 1; level <= tree.num_levels(); ++level) {
        std::size_t n = 0;
        for (const auto& [key, ranks] : nodes_of(h, level)) {
            float low = HUGE_VALF;
            glm::u8vec4 high(0);
            bool bit = false;
            for (const std::uint64_t r : ranks) {
                low = std::min(low, vp::get<0>(h)[r]);
                for (int c = 0; c < 4; ++c) high[c] = std::max(high[c], vp::get<2>(h)[r][c]);
                bit = bit || vp::get<5>(h)[r];
            }
            ASSERT_EQ(least.at(level)[n], low);
            ASSERT_EQ(greatest.at(level)[n], high);
            ASSERT_EQ(any.at(level)[n] != 0, bit);
            // The node's children, from the level below.
            std::vector<std::int16_t> children, mine;
            const auto first = tree.level(level).first_child(n);
            for (int c = 0; c < std::popcount(tree.level(level).mask(n)); ++c) {
                const std::uint64_t child = first + static_cast<unsigned>(c);
                children.push_back(level == 1 ? vp::get<3>(h)[child] : common.at(level - 1)[child]);
                mine.push_back(level == 1 ? vp::get<3>(h)[child] : own.at(level - 1)[child]);
            }
            ASSERT_EQ(own.at(level)[n], mine[mine.size() / 2]);
            std::map<std::int16_t, int> votes;
            for (const std::int16_t v : children) ++votes[v];
            auto best = votes.begin();
            for (auto it = votes.begin(); it != votes.end(); ++it)
                if (it->second > best->second) best = it; // the least of several comes first
            ASSERT_EQ(common.at(level)[n], best->first);
            ++n;
        }
    }
    EXPECT_THROW((void)vp::reduce_levels<0>(vp::octree(), h, vp::reduce::min{}), std::invalid_argument);
}

// Against a walk through every voxel of the grid.
TEST(Octree, RaysMeetTheFirstVoxel) {
    const host h = drawn(false);
    const vp::octree tree(h);
    unit::splitmix64 random(3);
    int hits = 0;
    for (int i = 0; i < 1200; ++i) {
        glm::dvec3 from, to;
        for (int a = 0; a < 3; ++a) {
            from[a] = random.uniform(-20.0, whole[a] + 20.0);
            to[a] = random.uniform(0.0, whole[a]);
        }
        glm::dvec3 direction = to - from;
        if (i % 5 == 0) direction = {0, 0, i % 2 == 0 ? 1.0 : -2.0}; // along an axis
        if (i % 7 == 0) direction[static_cast<int>(random.between(0, 3)) % 3] = 0;
        if (direction == glm::dvec3(0)) continue;
        const vp::voxel_hit hit = tree.first_hit(from, direction);
        // The least entry among all voxels' boxes.
        double least = 1e300;
        glm::ivec3 nearest(-1);
        h.for_each_voxel([&](const glm::ivec3& v, std::uint64_t) {
            const glm::dvec3 low = glm::dvec3(v + h.where.offset);
            double enter = 0, leave = 1e300;
            for (int a = 0; a < 3; ++a) {
                if (direction[a] == 0) {
                    if (from[a] < low[a] || from[a] >= low[a] + 1) leave = -1;
                    continue;
                }
                const double t0 = (low[a] - from[a]) / direction[a], t1 = (low[a] + 1 - from[a]) / direction[a];
                enter = std::max(enter, std::min(t0, t1));
                leave = std::min(leave, std::max(t0, t1));
            }
            if (enter < leave && enter < least) {
                least = enter;
                nearest = v + h.where.offset;
            }
        });
        ASSERT_EQ(hit.found, least != 1e300) << i;
        if (!hit.found) continue;
        ++hits;
        ASSERT_NEAR(hit.distance, least, 1e-9) << i;
        ASSERT_EQ(hit.voxel, nearest) << i;
        ASSERT_EQ(hit.rank, h.table().find(hit.voxel - h.where.offset));
        ASSERT_FALSE(tree.first_hit(from, direction, least * 0.999 - 1e-9).found) << i;
    }
    EXPECT_GT(hits, 100);
}

// The passes that a GPU runs too.
TEST(Octree, OfABackendIsTheHosts) {
    backend_type backend = unit::make_backend();
    const vp::grid part = unit::unit_grid(whole).crop({5, 3, 11}, {90, 140, 50});
    const unit::small_mesh mesh = unit::make_mesh(21, 60, whole);
    framebuffer fb{backend, part.extent};
    static_cast<void>(octree_cases::compare_nodes(backend, fb, fb.to_host(backend))); // nothing drawn
    fb.keep_sums<0>();
    ASSERT_TRUE(vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, fb));
    const host h = fb.to_host(backend);
    const auto tree = octree_cases::compare_nodes(backend, fb, h);
    const auto compare = [&]<std::size_t I, class Reducer>(const Reducer& reducer, const char* what) {
        octree_cases::compare_levels<I>(backend, tree, fb, h, reducer, what);
    };
    compare.template operator()<0>(vp::reduce::mean<1>{}, "mean");
    compare.template operator()<4>(vp::reduce::mean_of_volume{}, "mean of volume");
    compare.template operator()<5>(vp::reduce::sum{}, "sum");
    compare.template operator()<2>(vp::reduce::max{}, "max");
    compare.template operator()<3>(vp::reduce::majority{}, "majority");
    compare.template operator()<3>(octree_cases::middle{}, "the caller's");
    framebuffer without{backend, part.extent, 0b111110};
    ASSERT_TRUE(vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, without));
    EXPECT_THROW((void)vp::reduce_levels<0>(backend, tree, without, vp::reduce::min{}), std::invalid_argument);
}

// Every child that exists, of every node, against a count from the first node on.
TEST(Octree, ChildrenFollowEachOther) {
    const vp::octree tree(drawn(false));
    ASSERT_GT(tree.num_nodes(1), 1000u);
    for (int level = 1; level <= tree.num_levels(); ++level) {
        const vp::octree_level_view nodes = tree.level(level);
        std::uint64_t next = 0;
        for (std::uint64_t n = 0; n < tree.num_nodes(level); ++n) {
            ASSERT_NE(nodes.mask(n), 0u);
            ASSERT_EQ(nodes.first_child(n), next);
            for (unsigned c = 0; c < 8; ++c) {
                if ((nodes.mask(n) >> c & 1u) == 0) continue;
                ASSERT_EQ(nodes.child(n, c), next++) << level << ' ' << n;
            }
        }
        EXPECT_EQ(next, tree.num_nodes(level - 1));
    }
}

TEST(OctreeDag, HoldsTheSameVoxelsInFewerNodes) {
    // A wall with the same pattern again and again.
    backend_type backend = unit::make_backend();
    const glm::ivec3 extent{256, 256, 256};
    unit::small_mesh wall;
    wall.positions = {{0, 0, 13.5f}, {256, 0, 13.5f}, {0, 256, 13.5f}, {256, 256, 13.5f}};
    wall.triangles = {{0, 1, 2}, {2, 1, 3}};
    vp::sparse_framebuffer<backend_type, flag> fb{backend, extent};
    ASSERT_TRUE(vp::voxelize(backend, wall.view(), unit::unit_grid(extent), vp::passthrough{}, vp::constant(true), fb));
    const auto flat = fb.to_host(backend);
    const vp::octree flat_tree(flat);
    const vp::octree_dag flat_dag(flat_tree);
    EXPECT_EQ(flat_tree.num_nodes(3), 1024u);
    EXPECT_EQ(flat_dag.num_nodes(3), 1u);
    EXPECT_EQ(flat_dag.num_nodes(8), 1u);
    EXPECT_LT(flat_dag.num_bytes() * 150, flat_tree.num_bytes());

    const host h = drawn(false);
    const vp::octree tree(h);
    const vp::octree_dag dag(tree);
    for (int l = 1; l <= dag.num_levels(); ++l) EXPECT_LE(dag.num_nodes(l), tree.num_nodes(l));
    EXPECT_LE(dag.num_nodes(1), 255u);
    unit::for_each_voxel(whole, [&](int x, int y, int z) {
        ASSERT_EQ(dag.contains({x, y, z}), h.contains(glm::ivec3(x, y, z) - h.where.offset));
    });
    EXPECT_FALSE(dag.contains({-1, 0, 0}));
    EXPECT_FALSE(dag.contains({0, 256, 0}));
    EXPECT_FALSE(vp::octree_dag().contains({0, 0, 0}));
}

} // namespace
