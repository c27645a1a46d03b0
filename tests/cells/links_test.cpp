// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_links: crossings, primitives and roundings against exact fractions, closed formulas, both ends of a link,
// solids, crops, draws, ties and bad input. VOXELPIPE_TEST_SCALE above 1: as many times more random meshes.
#include "../oracle/link_oracle.hpp"
#include "../test_scale.hpp"
#include "cell_support.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

namespace {

using namespace cells;

struct host_links {
    int neighbours;
    std::vector<glm::ivec3> voxels;
    std::vector<float> q;
    std::vector<std::uint32_t> primitives, draws;
    vp::status status;

    // The record of a voxel, or -1.
    [[nodiscard]] std::ptrdiff_t find(const glm::ivec3& p) const {
        const auto at = std::ranges::lower_bound(voxels, number(p), {}, number);
        return at != voxels.end() && *at == p ? at - voxels.begin() : -1;
    }
    [[nodiscard]] float part(const glm::ivec3& p, int link) const {
        const std::ptrdiff_t record = find(p);
        return record < 0 ? -1.0F : q[static_cast<std::size_t>(record * neighbours + link)];
    }
    static std::tuple<int, int, int> number(const glm::ivec3& p) { return {p.z, p.y, p.x}; }
};

host_links library_links(const std::vector<mesh>& meshes, const vp::grid& g, int neighbours = 26,
                         unsigned threads = 2) {
    vp::cpu_backend backend(threads);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, vp::none>> draws;
    for (const mesh& m : meshes) draws.push_back({m.view(), {}, {}});
    vp::link_list<vp::cpu_backend> list(backend);
    const vp::status s = vp::voxelize_links(backend, draws, g, list, {.neighbours = neighbours});
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(list.neighbours, neighbours);
    host_links found{neighbours,
                     list.voxels.to_host(backend),
                     list.q.to_host(backend),
                     list.primitives.to_host(backend),
                     list.draws.to_host(backend),
                     s};
    EXPECT_TRUE(std::ranges::is_sorted(found.voxels, std::ranges::less{}, host_links::number));
    EXPECT_EQ(s.counts.voxels, found.voxels.size());
    EXPECT_EQ(found.q.size(), found.voxels.size() * static_cast<std::size_t>(neighbours));
    EXPECT_EQ(s.counts.fragments,
              static_cast<std::uint64_t>(std::ranges::count_if(found.q, [](float q) { return q > 0; })));
    return found;
}
host_links library_links(const mesh& m, const vp::grid& g, int neighbours = 26) {
    return library_links(std::vector<mesh>{m}, g, neighbours);
}

// Every link of every voxel against the oracle. Returns how many are crossed.
std::size_t compare_to_oracle(const mesh& m, const vp::grid& g) {
    const host_links found = library_links(m, g);
    const std::vector<oracle::lattice_triangle> triangles = snapped(m, g.fraction());
    std::size_t crossed = 0, records = 0;
    for (int z = 0; z < g.extent.z; ++z)
        for (int y = 0; y < g.extent.y; ++y)
            for (int x = 0; x < g.extent.x; ++x) {
                const glm::ivec3 p(x, y, z), whole = p + g.offset;
                const std::ptrdiff_t record = found.find(p);
                bool has_any = false;
                for (int k = 0; k < 26; ++k) {
                    const glm::ivec3 d = vp::link_direction(k);
                    oracle::link_hit first{};
                    std::uint32_t primitive = vp::no_crossing;
                    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
                        const auto hit = oracle::cross_link(triangles[t], g.fraction(), {whole.x, whole.y, whole.z},
                                                            {d.x, d.y, d.z});
                        if (!hit.is_crossed) continue;
                        if (first.is_crossed && hit.numerator * first.denominator >= first.numerator * hit.denominator)
                            continue;
                        first = hit;
                        primitive = t;
                    }
                    float q = -1.0F;
                    if (first.is_crossed)
                        q = first.numerator.sign() == 0 ? 0x1p-126F
                                                        : unit::nearest_float({first.numerator, first.denominator});
                    crossed += first.is_crossed ? 1 : 0;
                    has_any = has_any || first.is_crossed;
                    const auto at = static_cast<std::size_t>(record * 26 + k);
                    const bool same = record < 0 ? !first.is_crossed
                                                 : found.q[at] == q && found.primitives[at] == primitive &&
                                                       found.draws[at] == (first.is_crossed ? 0 : vp::no_crossing);
                    EXPECT_TRUE(same) << "voxel " << x << ' ' << y << ' ' << z << " link " << k << ": " << q << " of "
                                      << primitive;
                    if (!same) return 0;
                }
                EXPECT_EQ(record >= 0, has_any);
                records += has_any ? 1 : 0;
            }
    EXPECT_EQ(records, found.voxels.size());
    return crossed;
}

// A float that a grid of the fraction snaps to itself.
float on_lattice(splitmix64& random, int low, int high, int fraction) {
    const int per_voxel = std::min(fraction, 12);
    return std::ldexp(
        static_cast<float>(random.between(std::int64_t{low} << per_voxel, std::int64_t{high} << per_voxel)),
        -per_voxel);
}

TEST(Links, AreThoseOfTheOracle) {
    splitmix64 random(31);
    std::size_t crossed = 0;
    const std::int64_t rounds = unit::cases(100) / 100;
    for (std::int64_t i = 0; i < rounds; ++i) {
        // Parts of larger grids have fewer fraction bits: 16, 12, 14.
        for (const int length : {6, 4000, 1000}) {
            if (length == 1000 && tests::is_slow_build()) break;
            const glm::ivec3 at(length / 2, 1, 0), extent(5, 4, 6);
            const vp::grid whole = solids::unit_grid({length + 1, 8, 8}),
                           g = whole.crop(length > 6 ? at : glm::ivec3(0), extent);
            const glm::vec3 corner(g.offset);
            mesh soup; // of triangles of all sizes, and slivers
            for (unsigned n = 0; n < 20; ++n) {
                std::array<glm::vec3, 3> t;
                for (glm::vec3& p : t)
                    for (int a = 0; a < 3; ++a) p[a] = on_lattice(random, -2, 8, g.fraction());
                if (n % 4 == 0) t[2] = t[1] + glm::vec3(0, 0x1p-12F, 0);
                if (n % 5 == 1) t[1] = t[0] + 0.25F * glm::vec3(random.between(-4, 4), random.between(-4, 4), 1);
                for (glm::vec3& p : t) soup.positions.push_back(p + corner);
                soup.triangles.emplace_back(3 * n, 3 * n + 1, 3 * n + 2);
            }
            crossed += compare_to_oracle(soup, g);
            // Corners at voxels' centres and corners, and at quarters: ties of all kinds.
            for (const int per_voxel : {1, 2, 4})
                crossed += compare_to_oracle(solids::random_cycle(random, 7, -1, 6, per_voxel).moved(corner), g);
        }
    }
    EXPECT_GT(crossed, tests::is_slow_build() ? 6000u : 10000u);
}

// Sides of up to a million voxels: the path of 128 bits, and quotients of many.
TEST(Links, OfLargeTrianglesAreThoseOfTheOracle) {
    splitmix64 random(37);
    std::size_t crossed = 0;
    const int meshes = tests::is_slow_build() ? 4 : 12;
    for (int i = 0; i < meshes; ++i) {
        mesh m;
        const float size = i % 2 == 0 ? 1000.0F : 1048576.0F;
        for (unsigned n = 0; n < 4; ++n) {
            // Around a point of the grid: the third corner lies beyond it.
            std::array<glm::vec3, 3> t;
            for (int a = 0; a < 3; ++a) {
                t[0][a] = size * (static_cast<float>(random.unit()) - 0.5F);
                t[1][a] = size * (static_cast<float>(random.unit()) - 0.5F);
                t[2][a] = 6.0F - t[0][a] - t[1][a] + static_cast<float>(random.unit());
            }
            for (const glm::vec3& p : t) m.positions.push_back(p);
            m.triangles.emplace_back(3 * n, 3 * n + 1, 3 * n + 2);
        }
        crossed += compare_to_oracle(m, solids::unit_grid({4, 5, 4}));
    }
    EXPECT_GT(crossed, 150u * static_cast<unsigned>(meshes));
}

// Boxes: the distance to a face is a float, and so is its half.
TEST(Links, OfBoxesAreTheirFacesDistances) {
    const host_links found =
        library_links(solids::box({1.25F, 1.5F, 2.0F}, {4.75F, 5.0F, 5.75F}), solids::unit_grid(glm::ivec3(7)));
    const int up = 0, down = 1; // along x
    EXPECT_EQ(found.part({0, 3, 3}, up), 0.75F);
    EXPECT_EQ(found.part({1, 3, 3}, down), 0.25F);
    EXPECT_EQ(found.part({4, 3, 3}, up), 0.25F);
    EXPECT_EQ(found.part({5, 3, 3}, down), 0.75F);
    EXPECT_EQ(found.part({2, 3, 3}, up), -1.0F);
    EXPECT_EQ(found.part({3, 3, 1}, 4), 0.5F); // z, at a voxel's face
    // The face at y = 1.5 holds centres, which the offset puts inside of it: the links from below end there.
    EXPECT_EQ(found.part({3, 0, 3}, 2), 1.0F);
    EXPECT_EQ(found.part({3, 1, 3}, 3), 0x1p-126F);
    EXPECT_EQ(found.part({3, 1, 3}, 2), -1.0F);
    // A link beyond the grid, out of a box that fills it.
    const host_links full =
        library_links(solids::box(glm::vec3(-0.25F), glm::vec3(3.25F)), solids::unit_grid(glm::ivec3(3)));
    EXPECT_EQ(full.part({0, 1, 1}, down), 0.75F);
    EXPECT_EQ(full.part({2, 1, 1}, up), 0.75F);
    EXPECT_EQ(full.find({1, 1, 1}), -1);
}

// Links of a fine sphere cross where those of the ball do, but for the height of its facets and the snapping.
TEST(Links, OfSpheresAreThoseOfTheBall) {
    const glm::dvec3 middle(8.1, 7.9, 8.3);
    const double radius = 6.2;
    const mesh ball = solids::sphere(glm::vec3(middle), static_cast<float>(radius), 6);
    double depth = 0; // of the facets below the ball
    for (const glm::uvec3& t : ball.triangles) {
        const glm::dvec3 sum(glm::dvec3(ball.positions[t.x]) + glm::dvec3(ball.positions[t.y]) +
                             glm::dvec3(ball.positions[t.z]));
        depth = std::max(depth, radius - glm::length(sum / 3.0 - middle));
    }
    EXPECT_LT(depth, 2e-3);
    const host_links found = library_links(ball, solids::unit_grid(glm::ivec3(16)));
    std::size_t compared = 0;
    for (std::size_t i = 0; i < found.voxels.size(); ++i)
        for (int k = 0; k < 26; ++k) {
            const glm::dvec3 c = glm::dvec3(found.voxels[i]) + 0.5 - middle, d(vp::link_direction(k));
            const double a = glm::dot(d, d), b = glm::dot(c, d), rest = glm::dot(c, c) - radius * radius;
            const double root = b * b - a * rest;
            const float q = found.q[i * 26 + static_cast<std::size_t>(k)];
            if (root <= 0) {
                EXPECT_LT(q, 0.0F);
                continue;
            }
            const double near = (-b - std::sqrt(root)) / a, far = (-b + std::sqrt(root)) / a;
            const double expected = near > 0 ? near : far;
            // Along a link the depth is 1 / cosine times as much. Vertices are rounded and snapped.
            const double slack = 1.1 * (depth + 0x1p-15) * radius / std::sqrt(root);
            if (std::abs(expected) < slack || std::abs(expected - 1) < slack || root < 0.02)
                continue; // either is right
            if (expected > 0 && expected < 1) {
                EXPECT_NEAR(static_cast<double>(q), expected, slack) << i << ' ' << k;
                ++compared;
            } else {
                EXPECT_EQ(q, -1.0F);
            }
        }
    EXPECT_GT(compared, 8000u);
}

// Both ends of a link see a single crossing: of a convex body where one end is inside.
TEST(Links, BothEndsSeeTheSameCrossing) {
    const glm::ivec3 extent(17);
    const vp::grid g = solids::unit_grid(extent);
    const mesh ball = solids::sphere({8.1F, 7.9F, 8.3F}, 6.2F, 3);
    const host_links found = library_links(ball, g);
    const auto inside = solids::library_solid(ball, g, {}).voxels;
    std::size_t single = 0;
    for (std::size_t i = 0; i < found.voxels.size(); ++i)
        for (int k = 0; k < 26; ++k) {
            const std::size_t at = i * 26 + static_cast<std::size_t>(k);
            const glm::ivec3 p = found.voxels[i], n = p + vp::link_direction(k);
            if (!g.contains(n)) continue;
            const std::ptrdiff_t other = found.find(n);
            const float q = found.q[at], back = found.part(n, k ^ 1);
            EXPECT_EQ(q < 0, back < 0);
            const bool differ =
                inside[solids::index(extent, p.x, p.y, p.z)] != inside[solids::index(extent, n.x, n.y, n.z)];
            if (!differ) continue;
            ASSERT_GT(q, 0.0F);
            EXPECT_NEAR(static_cast<double>(q) + static_cast<double>(back), 1.0, 0x1p-24);
            EXPECT_EQ(found.primitives[at], found.primitives[static_cast<std::size_t>(other * 26 + (k ^ 1))]);
            ++single;
        }
    EXPECT_GT(single, 5000u);
}

// Where the samples of a solid differ, the link between them is crossed, with ties of all kinds.
TEST(Links, CrossWhereSolidsChange) {
    splitmix64 random(41);
    const glm::ivec3 extent(12);
    std::size_t changes = 0;
    for (int i = 0; i < 6; ++i) {
        const mesh m = solids::random_bodies(random, 12, 4);
        const vp::grid g = solids::unit_grid(extent);
        const auto inside = solids::library_solid(m, g, {.rule = vp::fill_rule::even_odd}).voxels;
        const host_links found = library_links(m, g);
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x)
                    for (int k = 0; k < 26; ++k) {
                        const glm::ivec3 n = glm::ivec3(x, y, z) + vp::link_direction(k);
                        if (!g.contains(n)) continue;
                        if (inside[solids::index(extent, x, y, z)] == inside[solids::index(extent, n.x, n.y, n.z)])
                            continue;
                        EXPECT_GT(found.part({x, y, z}, k), 0.0F) << x << ' ' << y << ' ' << z << ' ' << k;
                        ++changes;
                    }
    }
    EXPECT_GT(changes, 5000u);
}

TEST(Links, OfCropsAndFewerNeighboursAreThoseOfTheWhole) {
    splitmix64 random(43);
    const mesh m = solids::random_cycle(random, 9, -2, 13, 32);
    const vp::grid g = solids::unit_grid({12, 11, 10});
    const host_links whole = library_links(m, g), few = library_links(m, g, 18);
    const glm::ivec3 begin(4, 2, 1), size(5, 7, 8);
    const host_links part = library_links(m, g.crop(begin, size));
    std::size_t records = 0;
    for (std::size_t i = 0; i < whole.voxels.size(); ++i) {
        const glm::ivec3 p = whole.voxels[i];
        const auto row = [](const auto& list, std::size_t record, std::size_t width, std::size_t n) {
            return std::vector(list.begin() + static_cast<std::ptrdiff_t>(record * width),
                               list.begin() + static_cast<std::ptrdiff_t>(record * width + n));
        };
        const std::ptrdiff_t of_few = few.find(p);
        const std::vector<float> first = row(whole.q, i, 26, 18);
        EXPECT_EQ(of_few < 0, std::ranges::all_of(
                                  first, [](float q) { return q < 0; }));
        if (of_few >= 0) {
            EXPECT_EQ(first, row(few.q, static_cast<std::size_t>(of_few), 18, 18));
        }
        const glm::ivec3 q = p - begin;
        if (!g.crop(begin, size).contains(q)) continue;
        ++records;
        const std::ptrdiff_t of_part = part.find(q);
        ASSERT_GE(of_part, 0);
        EXPECT_EQ(row(whole.q, i, 26, 26), row(part.q, static_cast<std::size_t>(of_part), 26, 26));
        EXPECT_EQ(row(whole.primitives, i, 26, 26), row(part.primitives, static_cast<std::size_t>(of_part), 26, 26));
    }
    EXPECT_EQ(records, part.voxels.size());
    EXPECT_LT(few.voxels.size(), whole.voxels.size());
    EXPECT_GT(records, 100u);
}

// Primitives count through all draws; of equal crossings the lowest counts, whatever the order of a draw's triangles.
TEST(Links, NameDrawsAndTheLowestPrimitive) {
    const vp::grid g = solids::unit_grid(glm::ivec3(9));
    const mesh ball = solids::sphere({4.4F, 4.6F, 4.5F}, 3.1F, 2),
               box = solids::box({-0.1F, -0.2F, -0.3F}, {9.1F, 9.2F, 9.3F});
    const auto n = static_cast<std::uint32_t>(ball.triangles.size());
    const host_links alone = library_links(ball, g), twice = library_links({ball, box, ball}, g);
    std::array<std::size_t, 3> of_draw{};
    for (std::size_t i = 0; i < twice.q.size(); ++i) {
        if (twice.q[i] < 0) {
            EXPECT_EQ(twice.primitives[i], vp::no_crossing);
            EXPECT_EQ(twice.draws[i], vp::no_crossing);
            continue;
        }
        ++of_draw.at(twice.draws[i]);
        EXPECT_EQ(twice.draws[i] == 0, twice.primitives[i] < n);
        EXPECT_LT(twice.primitives[i], n + 12);
    }
    EXPECT_EQ(of_draw[0], alone.status.counts.fragments);
    EXPECT_GT(of_draw[1], 100u);
    EXPECT_EQ(of_draw[2], 0u);
    mesh turned = ball;
    std::ranges::reverse(turned.triangles);
    const host_links reversed = library_links({turned}, g, 26, 1);
    EXPECT_EQ(reversed.voxels, alone.voxels);
    EXPECT_EQ(reversed.q, alone.q);
    mesh split = ball; // the same triangles once more, behind
    split.triangles.insert(split.triangles.end(), ball.triangles.begin(), ball.triangles.end());
    EXPECT_EQ(library_links({split}, g, 26, 1).primitives, alone.primitives);
}

// Positions that are the same float are still compared as fractions: plates that lean by 2^-29 of a voxel.
TEST(Links, ComparePositionsBeforeTheyAreRounded) {
    const auto plate = [](float lean) {
        return mesh{{{3.25F, -20.0F, -20.0F}, {3.25F, 200000.0F, -20.0F}, {3.25F + lean, -20.0F, 200000.0F}},
                    {{0, 1, 2}}};
    };
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    const mesh flat = plate(0), leaning = plate(0x1p-16F);
    for (const bool flat_first : {false, true}) {
        const std::vector<mesh> meshes = flat_first ? std::vector{flat, leaning} : std::vector{leaning, flat};
        const host_links found = library_links(meshes, g);
        const auto up = static_cast<std::size_t>(found.find({2, 3, 3}) * 26),
                   down = static_cast<std::size_t>(found.find({3, 3, 3}) * 26 + 1);
        EXPECT_EQ(found.q.at(up), 0.75F);
        EXPECT_EQ(found.q.at(down), 0.25F);
        EXPECT_EQ(found.primitives.at(up), flat_first ? 0u : 1u);   // the flat one is nearer
        EXPECT_EQ(found.primitives.at(down), flat_first ? 1u : 0u); // the leaning one is
    }
}

TEST(Links, BadInputWritesNothing) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    mesh m = solids::box(glm::vec3(1.2F), glm::vec3(4.1F));
    vp::link_list<vp::cpu_backend> list(backend);
    ASSERT_TRUE(vp::voxelize_links(backend, m.view(), g, vp::passthrough{}, list, {.neighbours = 26}).ok());
    const std::size_t records = list.size();
    EXPECT_GT(records, 50u);
    for (const int neighbours : {0, 6, 19, 27})
        EXPECT_EQ(vp::voxelize_links(backend, m.view(), g, vp::passthrough{}, list, {.neighbours = neighbours}).code,
                  vp::status_code::bad_cell_options);
    const mesh good = m;
    m.triangles.emplace_back(0, 1, 99);
    const vp::status bad = vp::voxelize_links(backend, m.view(), g, vp::passthrough{}, list, {});
    EXPECT_EQ(bad.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(bad.triangle, 12u);
    mesh no_vertices;
    no_vertices.triangles = {{0, 1, 2}};
    EXPECT_EQ(vp::voxelize_links(backend, no_vertices.view(), g, vp::passthrough{}, list, {}).code,
              vp::status_code::index_out_of_range);
    EXPECT_EQ(list.size(), records);
    EXPECT_EQ(list.neighbours, 26);
    // Dropped and outside.
    m = good;
    m.positions.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0, 0);
    m.positions.emplace_back(1e30F, 0, 0);
    for (const float x : {8.0F, 9.0F}) m.positions.emplace_back(x, 1, 1);
    m.triangles.emplace_back(0, 1, 8);
    m.triangles.emplace_back(0, 1, 9);
    m.triangles.emplace_back(10, 11, 10);
    const vp::status s = vp::voxelize_links(backend, m.view(), g, vp::passthrough{}, list, {.neighbours = 26});
    ASSERT_TRUE(s.ok());
    EXPECT_EQ(s.counts.triangles_in, 15u);
    EXPECT_EQ(s.counts.triangles_nonfinite, 1u);
    EXPECT_EQ(s.counts.triangles_too_far, 1u);
    EXPECT_EQ(s.counts.triangles_outside, 1u);
    EXPECT_EQ(s.counts.triangles_drawn, 12u);
    EXPECT_EQ(list.size(), records);
    ASSERT_TRUE(vp::voxelize_links(backend, vp::mesh_view<>{}, g, vp::passthrough{}, list).ok());
    EXPECT_EQ(list.size(), 0u);
    EXPECT_EQ(list.neighbours, 18);
}

// Links are kept as a list, so memory follows the crossings and not the grid. A link has a number of 63 bits: a grid
// with more links than that is refused.
TEST(Links, GridsMayBeFarLargerThanMemory) {
    const glm::ivec3 extent(1 << 20, 1 << 18, 1 << 18);
    const glm::vec3 at(1048000.0F, 200000.0F, 262000.0F);
    const mesh m = solids::box(at, at + glm::vec3(2.25F, 3.5F, 1.75F));
    const vp::grid g = solids::unit_grid(extent);
    const glm::ivec3 begin = glm::ivec3(at) - 2, size(8);
    const host_links all = library_links(m, g), part = library_links(m, g.crop(begin, size));
    EXPECT_GT(all.voxels.size(), 50u);
    ASSERT_EQ(all.voxels.size(), part.voxels.size());
    for (std::size_t i = 0; i < all.voxels.size(); ++i) EXPECT_EQ(all.voxels[i], part.voxels[i] + begin);
    EXPECT_EQ(all.q, part.q);
    vp::cpu_backend backend(1);
    vp::link_list<vp::cpu_backend> list(backend);
    EXPECT_EQ(
        vp::voxelize_links(backend, m.view(), solids::unit_grid(glm::ivec3(1 << 20)), vp::passthrough{}, list).code,
        vp::status_code::size_overflow);
}

// The 26 directions are all there are; opposite ones are next to each other.
TEST(Links, DirectionsAreAllNeighbours) {
    std::map<std::tuple<int, int, int>, int> seen;
    for (int k = 0; k < 26; ++k) {
        const glm::ivec3 d = vp::link_direction(k), back = vp::link_direction(k ^ 1);
        EXPECT_EQ(d, -back);
        const int steps = glm::abs(d.x) + glm::abs(d.y) + glm::abs(d.z);
        EXPECT_EQ(steps, k < 6 ? 1 : k < 18 ? 2 : 3);
        ++seen[{d.x, d.y, d.z}];
    }
    EXPECT_EQ(seen.size(), 26u);
}

} // namespace
