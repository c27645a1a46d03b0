// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The table of cells against a walk along directed segments, written from the definition alone; and every neighbourhood
// of two cells, of an edge and of a sample. VOXELPIPE_TEST_SCALE (environment variable) from 20 on takes all of these.
#include "surface_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace {

using namespace surface_tests;
using point = std::array<int, 3>; // of the cube [0, 2]^3: corners have even coordinates, edges' middles one odd one
using segment = std::pair<point, point>;

bool is_inside(int corners, const point& p) { return (corners >> (p[0] / 2 + p[1] + 2 * p[2]) & 1) != 0; }

// The directed segments of a face, inside on the left as seen from outside of the cell. `outside`: an ambiguous face's
// cut off its outside samples in place of its inside ones.
std::vector<segment> segments_of(int corners, int axis, int side, bool outside) {
    // Around the face, counter-clockwise seen from outside.
    const int b = (axis + 1) % 3, d = (axis + 2) % 3;
    std::array<point, 8> ring{};
    constexpr std::array<std::array<int, 2>, 8> turns{{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};
    for (std::size_t i = 0; i < 8; ++i) {
        const auto& t = turns[side == 1 ? i : (8 - i) % 8];
        ring[i][static_cast<std::size_t>(axis)] = 2 * side;
        ring[i][static_cast<std::size_t>(b)] = t[0];
        ring[i][static_cast<std::size_t>(d)] = t[1];
    }
    // Going round, the surface comes in where an inside sample follows an outside one. A segment begins where the
    // inside ends and ends where it begins, so that the inside before its begin lies on its left.
    std::vector<std::size_t> enters, leaves;
    for (std::size_t i = 0; i < 8; i += 2) {
        const bool here = is_inside(corners, ring[i]), there = is_inside(corners, ring[(i + 2) % 8]);
        if (!here && there) enters.push_back(i + 1);
        if (here && !there) leaves.push_back(i + 1);
    }
    std::vector<segment> found;
    for (const std::size_t from : leaves) {
        // The run of inside samples that ends here began at the nearest entry before; the run of outside samples that
        // begins here ends at the nearest entry after.
        std::size_t at = from;
        do at = outside ? (at + 1) % 8 : (at + 7) % 8;
        while (std::find(enters.begin(), enters.end(), at) == enters.end());
        found.emplace_back(ring[from], ring[at]);
    }
    return found;
}

// The sheets as closed walks; `flipped`: a face (2 axis + side) whose pairing is the other one, or -1.
std::vector<std::set<point>> walk(int corners, int flipped) {
    std::map<point, point> next;
    for (int f = 0; f < 6; ++f)
        for (const segment& s : segments_of(corners, f / 2, f % 2, f == flipped)) {
            EXPECT_EQ(next.count(s.first), 0u); // each crossed edge begins one segment
            next[s.first] = s.second;
        }
    std::vector<std::set<point>> sheets;
    while (!next.empty()) {
        std::set<point> sheet;
        point at = next.begin()->first;
        while (next.count(at) != 0) {
            sheet.insert(at);
            const point to = next[at];
            next.erase(at);
            at = to;
        }
        EXPECT_EQ(sheet.count(at), 1u); // closed
        sheets.push_back(sheet);
    }
    return sheets;
}
point middle_of(int edge) {
    const int axis = edge / 4, low = axis == 0 ? 1 : 0, high = axis == 2 ? 1 : 2;
    point p{};
    p[static_cast<std::size_t>(axis)] = 1;
    p[static_cast<std::size_t>(low)] = 2 * (edge & 1);
    p[static_cast<std::size_t>(high)] = 2 * (edge >> 1 & 1);
    return p;
}
// Faces with two segments, and those of them that lie in one sheet.
std::pair<int, std::vector<int>> ambiguous_faces(int corners) {
    const auto sheets = walk(corners, -1);
    int ambiguous = 0;
    std::vector<int> joined;
    for (int f = 0; f < 6; ++f) {
        const auto s = segments_of(corners, f / 2, f % 2, false);
        if (s.size() != 2) continue;
        ++ambiguous;
        for (const auto& sheet : sheets)
            if (sheet.count(s[0].first) != 0 && sheet.count(s[1].first) != 0) joined.push_back(f);
    }
    return {ambiguous, joined};
}

void expect_sheets(vp::core::cell_sheets entry, const std::vector<std::set<point>>& walked, int corners) {
    ASSERT_EQ(static_cast<std::size_t>(entry.count()), walked.size()) << corners;
    int before = -1;
    for (int s = 0; s < entry.count(); ++s) {
        std::set<point> edges;
        int lowest = -1;
        for (int e = 0; e < 12; ++e)
            if (entry.of_edge(e) == s) {
                if (lowest < 0) lowest = e;
                edges.insert(middle_of(e));
            }
        EXPECT_NE(std::find(walked.begin(), walked.end(), edges), walked.end()) << corners;
        EXPECT_GT(lowest, before) << corners; // numbered by their lowest edges
        before = lowest;
        EXPECT_GE(edges.size(), 3u) << corners;
        EXPECT_LE(edges.size(), 7u) << corners;
    }
}

TEST(SurfaceCells, TableIsTheWalkOfAll256Cells) {
    const auto table = vp::core::make_cell_table();
    int joined_cells = 0;
    for (int corners = 0; corners < 256; ++corners) {
        const auto& plain = table[static_cast<std::size_t>(corners)];
        expect_sheets(plain, walk(corners, -1), corners);
        const auto [ambiguous, joined] = ambiguous_faces(corners);
        ASSERT_EQ(plain.joined_face() != vp::core::cell_sheets::no_face, !joined.empty());
        if (joined.empty()) continue;
        ++joined_cells;
        EXPECT_EQ(ambiguous, 1) << corners; // so that flips do not meet
        ASSERT_EQ(joined.size(), 1u);
        EXPECT_EQ(plain.joined_face(), joined[0]);
        const auto& flipped = table[static_cast<std::size_t>(256 + corners)];
        expect_sheets(flipped, walk(corners, joined[0]), corners);
        EXPECT_EQ(flipped.count(), plain.count() + 1) << corners; // reconnected segments of one cycle split it
    }
    EXPECT_EQ(joined_cells, 36);
}

// Corners of the two cells of three layers of 2 x 2 samples along an axis.
std::pair<int, int> cells_of_pair(int layers, int axis) {
    std::pair<int, int> cells{0, 0};
    for (int c = 0; c < 8; ++c) {
        const int along = c >> axis & 1;
        const int across = axis == 0 ? c >> 1 : axis == 1 ? (c & 1) | (c >> 1 & 2) : c & 3;
        if ((layers >> (4 * along + across) & 1) != 0) cells.first |= 1 << c;
        if ((layers >> (4 * along + 4 + across) & 1) != 0) cells.second |= 1 << c;
    }
    return cells;
}

TEST(SurfaceCells, EighteenOfAllPairsOfNeighboursFlipAlongEachAxis) {
    const auto table = vp::core::make_cell_table();
    for (int axis = 0; axis < 3; ++axis) {
        int flips = 0;
        for (int layers = 0; layers < 4096; ++layers) {
            const auto [a, b] = cells_of_pair(layers, axis);
            flips += table[static_cast<std::size_t>(a)].joined_face() == 2 * axis + 1 &&
                     table[static_cast<std::size_t>(b)].joined_face() == 2 * axis;
        }
        EXPECT_EQ(flips, 18) << axis;
    }
}

TEST(SurfaceCells, AllPairsOfNeighboursAreClosedManifolds) {
    vp::cpu_backend backend{2};
    for (int axis = 0; axis < 3; ++axis) {
        // 16 x 16 x 16 pairs, two samples apart.
        bit_volume v(glm::ivec3(16 * 5));
        for (int layers = 0; layers < 4096; ++layers)
            for (int bit = 0; bit < 12; ++bit)
                if ((layers >> bit & 1) != 0) {
                    std::array<int, 3> p{5 * (layers & 15), 5 * (layers >> 4 & 15), 5 * (layers >> 8)};
                    p[static_cast<std::size_t>(axis)] += bit / 4;
                    p[axis == 0 ? 1 : 0] += bit & 1;
                    p[axis == 2 ? 1 : 2] += bit >> 1 & 1;
                    v.set(p[0], p[1], p[2]);
                }
        EXPECT_TRUE(extract_bits(backend, v).is_closed_manifold()) << axis;
        EXPECT_TRUE(extract_bits(backend, v, {.quads = true}).is_closed_manifold()) << axis;
    }
}

// Small patterns of 3 x 3 x 3 samples or fewer, two samples apart from each other, up to 16^3 or 32^3 at once.
class pattern_judge {
public:
    pattern_judge(vp::cpu_backend& backend, int side) : backend_(backend), side_(side), volume_(glm::ivec3(5 * side)) {}

    // Bit i: sample i % 3, i / 3 % 3, i / 9.
    void add(std::uint32_t pattern) {
        const int x = 5 * (count_ % side_), y = 5 * (count_ / side_ % side_), z = 5 * (count_ / (side_ * side_));
        for (int i = 0; i < 27; ++i)
            if ((pattern >> i & 1) != 0) volume_.set(x + i % 3, y + i / 3 % 3, z + i / 9);
        if (++count_ == side_ * side_ * side_) judge_all();
    }
    // To be called last.
    void judge_all() {
        EXPECT_TRUE(extract_bits(backend_, volume_, {.quads = true}).is_closed_manifold());
        judged += static_cast<std::uint64_t>(count_);
        volume_ = bit_volume(volume_.extent);
        count_ = 0;
    }

    std::uint64_t judged = 0;

private:
    vp::cpu_backend& backend_;
    int side_, count_ = 0;
    bit_volume volume_;
};

bool takes_all_patterns() { return tests::test_scale() >= 20; }

// Two layers of 3 x 3 samples along each axis, around the edge in their middle.
TEST(SurfaceCells, AllNeighbourhoodsOfAnEdgeAreClosedManifolds) {
    vp::cpu_backend backend{2};
    const bool is_whole = takes_all_patterns();
    const std::uint32_t step = is_whole ? 1 : tests::is_slow_build() ? 487 : 61;
    for (int axis = 0; axis < 3; ++axis) {
        pattern_judge patterns(backend, is_whole ? 32 : 16);
        for (std::uint32_t layers = 0; layers < 1u << 18; layers += step) {
            std::uint32_t pattern = 0;
            for (int bit = 0; bit < 18; ++bit) {
                std::array<int, 3> p{};
                p[static_cast<std::size_t>(axis)] = bit / 9;
                p[axis == 0 ? 1 : 0] = bit % 3;
                p[axis == 2 ? 1 : 2] = bit / 3 % 3;
                pattern |= (layers >> bit & 1) << (p[0] + 3 * p[1] + 9 * p[2]);
            }
            patterns.add(pattern);
        }
        patterns.judge_all();
        EXPECT_EQ(patterns.judged, ((1u << 18) + step - 1) / step);
    }
}

// All 2^27: of those that turns and mirrors of the cube make the same, the least one. Their number is that of
// Burnside's lemma.
TEST(SurfaceCells, NeighbourhoodsOfASampleAreClosedManifolds) {
    vp::cpu_backend backend{2};
    if (!takes_all_patterns()) {
        pattern_judge patterns(backend, 16);
        std::mt19937 random(27);
        for (int i = 0; i < 4000; ++i) patterns.add(random() & ((1u << 27) - 1));
        patterns.judge_all();
        return;
    }
    // Where each third of a pattern's bits goes.
    std::vector<std::array<std::array<std::uint32_t, 512>, 3>> turns;
    std::array<std::size_t, 3> axes{0, 1, 2};
    std::uint64_t fixed = 0;
    do
        for (int mirrors = 0; mirrors < 8; ++mirrors) {
            std::array<int, 27> to{};
            for (int i = 0; i < 27; ++i) {
                const std::array<int, 3> p{i % 3, i / 3 % 3, i / 9};
                std::array<int, 3> q{};
                for (std::size_t a = 0; a < 3; ++a) q[axes[a]] = (mirrors >> a & 1) != 0 ? 2 - p[a] : p[a];
                to[static_cast<std::size_t>(i)] = q[0] + 3 * q[1] + 9 * q[2];
            }
            auto& turn = turns.emplace_back();
            for (std::size_t third = 0; third < 3; ++third)
                for (std::uint32_t bits = 0; bits < 512; ++bits)
                    for (std::size_t b = 0; b < 9; ++b)
                        if ((bits >> b & 1) != 0) turn[third][bits] |= 1u << to[9 * third + b];
            std::array<bool, 27> seen{};
            int cycles = 0;
            for (std::size_t i = 0; i < 27; ++i) {
                if (seen[i]) continue;
                ++cycles;
                for (std::size_t k = i; !seen[k]; k = static_cast<std::size_t>(to[k])) seen[k] = true;
            }
            fixed += std::uint64_t{1} << cycles;
        }
    while (std::next_permutation(axes.begin(), axes.end()));
    ASSERT_EQ(turns.size(), 48u);
    pattern_judge patterns(backend, 32);
    for (std::uint32_t pattern = 0; pattern < 1u << 27; ++pattern) {
        const bool is_least = std::all_of(turns.begin(), turns.end(), [&](const auto& t) {
            return (t[0][pattern & 511] | t[1][pattern >> 9 & 511] | t[2][pattern >> 18]) >= pattern;
        });
        if (is_least) patterns.add(pattern);
    }
    patterns.judge_all();
    EXPECT_EQ(patterns.judged, fixed / 48);
}

// The judge itself: what it has to refuse.
TEST(SurfaceCells, JudgeSeesWhatIsNoManifold) {
    EXPECT_TRUE(judge<3>({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}, 4).is_closed_manifold());
    EXPECT_EQ(judge<3>({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}}, 4).boundary_edges, 3u);
    EXPECT_EQ(judge<3>({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 2, 3}}, 4).bad_edges, 3u); // turned round
    EXPECT_EQ(judge<3>({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}, 5).unused_vertices, 1u);
    EXPECT_EQ(judge<3>({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}, {0, 4, 5}, {0, 5, 6}, {0, 6, 4}, {4, 6, 5}}, 7)
                  .bad_vertices,
              1u); // two tetrahedra that share a vertex
    EXPECT_EQ(judge<3>({{0, 1, 1}}, 2).degenerate_faces, 1u);
    EXPECT_EQ(judge<3>({{0, 1, 2}}, 2).bad_indices, 1u);
}

// V - E + F of the quads is twice the Euler number of the voxels with 6 neighbours, and 2 more for each flip, and for
// each cell with just two opposite corners outside: its six others are a ring, and the sheets close the hole in it.
TEST(SurfaceCells, EulerNumberIsThatOfTheVoxels) {
    vp::cpu_backend backend{2};
    std::mt19937 random(5);
    std::int64_t all_flips = 0;
    std::array<int, 256> joined{}; // the face of a cell that may flip
    for (int c = 0; c < 256; ++c) {
        const auto faces = ambiguous_faces(c).second;
        joined[static_cast<std::size_t>(c)] = faces.empty() ? -1 : faces[0];
    }
    for (int k = 0; k < 40; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(9, 8, 10), 0.3 + 0.01 * k);
        const auto corners_of = [&](int x, int y, int z) {
            int c = 0;
            for (int i = 0; i < 8; ++i) c |= v.at(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)) ? 1 << i : 0;
            return c;
        };
        std::int64_t euler = 0, flips = 0, rings = 0;
        for (int z = -1; z < v.extent.z; ++z)
            for (int y = -1; y < v.extent.y; ++y)
                for (int x = -1; x < v.extent.x; ++x) {
                    const int c = corners_of(x, y, z);
                    euler += (c & 1) - ((c & 3) == 3) - ((c & 5) == 5) - ((c & 17) == 17) + ((c & 15) == 15) +
                             ((c & 51) == 51) + ((c & 85) == 85) - (c == 255);
                    rings += c == (255 ^ 129) || c == (255 ^ 66) || c == (255 ^ 36) || c == (255 ^ 24);
                    const std::array<int, 3> above{corners_of(x + 1, y, z), corners_of(x, y + 1, z),
                                                   corners_of(x, y, z + 1)};
                    for (int a = 0; a < 3; ++a) {
                        flips += joined[static_cast<std::size_t>(c)] == 2 * a + 1 &&
                                 joined[static_cast<std::size_t>(above[static_cast<std::size_t>(a)])] == 2 * a;
                    }
                }
        const host_surface s = extract_bits(backend, v, {.quads = true});
        EXPECT_EQ(s.judge_quads().euler, 2 * euler + 2 * flips + 2 * rings) << k;
        all_flips += flips;
    }
    EXPECT_GT(all_flips, 5);
}

} // namespace
