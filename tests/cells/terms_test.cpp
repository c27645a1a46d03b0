// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The terms of triangles against exact fractions: random, sliver, lattice-aligned and adversarial closed meshes with 1
// to 16 fraction bits, in the 64-bit and the 128-bit path. VOXELPIPE_TEST_SCALE above 1: as many times more meshes.
#include "cell_support.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <utility>

namespace {

using namespace cells;
using oracle::lattice_point;
using oracle::lattice_triangle;
using place = std::array<std::int64_t, 3>;
using all_terms = vp::core::terms_of_needs<vp::core::needs_centroid | vp::core::needs_area>;
using term_map = std::map<place, all_terms>;
constexpr vp::core::cell_areas cubes{{1.0, 1.0, 1.0}, 1.0};

vp::core::snapped_position to_position(const lattice_point& p) { return {p[0], p[1], p[2]}; }

// Adds a triangle's terms to those of its voxels. Voxels -1 and `extent` stand for all before and behind.
template <class Int>
void add_terms(const lattice_triangle& t, int fraction, std::int64_t extent, term_map& sums) {
    auto tri = vp::core::make_cell_triangle<Int>(to_position(t[0]), to_position(t[1]), to_position(t[2]), fraction);
    vp::core::lift(tri);
    const std::int64_t extents[3] = {extent, extent, extent};
    const vp::core::cell_box box = vp::core::make_cell_box(tri, extents);
    vp::core::for_each_cell<all_terms>(
        tri, box,
        [&](std::int64_t y, std::int64_t z, std::int64_t x, const all_terms& terms) {
            all_terms& sum = sums[{z - box.lo[2], y - box.lo[1], x - box.lo[0]}];
            sum.cover += terms.cover;
            sum.volume += terms.volume;
            sum.cover_y += terms.cover_y;
            sum.cover_z += terms.cover_z;
            sum.volume_x += terms.volume_x;
            sum.volume_y += terms.volume_y;
            sum.volume_z += terms.volume_z;
            sum.area += terms.area;
            sum.area_x += terms.area_x;
            sum.area_y += terms.area_y;
            sum.area_z += terms.area_z;
        },
        vp::core::ratio_of(tri, cubes));
}

// All numbers of terms: those that change sign with the triangle, then areas.
std::array<std::int64_t, 7> signed_terms(const all_terms& t) {
    return {t.cover, t.volume, t.cover_y, t.cover_z, t.volume_x, t.volume_y, t.volume_z};
}
std::array<std::int64_t, 4> unsigned_terms(const all_terms& t) { return {t.area, t.area_x, t.area_y, t.area_z}; }

std::vector<lattice_triangle> tetrahedron(const std::array<lattice_point, 4>& p) {
    return {{p[0], p[2], p[1]}, {p[0], p[1], p[3]}, {p[0], p[3], p[2]}, {p[1], p[2], p[3]}};
}
std::vector<lattice_triangle> box_between(const lattice_point& a, const lattice_point& b) {
    std::array<lattice_point, 8> v{};
    for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t k = 0; k < 3; ++k) v[i][k] = (i >> k & 1u) != 0 ? b[k] : a[k];
    std::vector<lattice_triangle> all;
    for (const std::array<std::size_t, 4>& f : {std::array<std::size_t, 4>{0, 2, 3, 1},
                                                {4, 5, 7, 6},
                                                {0, 1, 5, 4},
                                                {2, 6, 7, 3},
                                                {0, 4, 6, 2},
                                                {1, 3, 7, 5}}) {
        all.push_back({v[f[0]], v[f[1]], v[f[2]]});
        all.push_back({v[f[0]], v[f[2]], v[f[3]]});
    }
    return all;
}

// A closed mesh: a box, a tetrahedron, a sliver, two tetrahedra that share points. Coordinates lie on the lattice's
// planes, one unit beside them, or anywhere.
std::vector<lattice_triangle> closed_mesh(splitmix64& random, int kind, int fraction, std::int64_t extent) {
    const std::int64_t size = std::int64_t{1} << fraction;
    const auto pick = [&](std::int64_t lo, std::int64_t hi) {
        return lo + static_cast<std::int64_t>(random.next() % static_cast<std::uint64_t>(hi - lo + 1));
    };
    const auto number = [&] {
        const std::int64_t kind_of_number = pick(0, 19);
        if (kind_of_number < 5) return pick(-1, extent + 1) * size;
        if (kind_of_number < 8) return pick(-1, extent + 1) * size + 2 * pick(0, 1) - 1;
        return pick(-size, (extent + 1) * size);
    };
    const auto point = [&] { return lattice_point{number(), number(), number()}; };
    if (kind == 0) return box_between(point(), point());
    std::array<lattice_point, 4> p{point(), point(), point(), point()};
    if (kind == 1) return tetrahedron(p);
    if (kind == 2) {
        for (std::size_t a = 0; a < 3; ++a) p[2][a] = (p[0][a] + p[1][a]) / 2 + pick(-1, 1);
        return tetrahedron(p);
    }
    std::vector<lattice_triangle> all = tetrahedron(p);
    p[0] = point();
    const std::vector<lattice_triangle> more = tetrahedron(p);
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

// Errors of all voxels are within the bound; untouched ones are whole; rows close; both paths give the same.
void check_mesh(const std::vector<lattice_triangle>& mesh, int fraction, std::int64_t extent, std::size_t& untouched) {
    term_map wide, narrow;
    bool has_narrow = true;
    for (const lattice_triangle& t : mesh) {
        add_terms<vp::int128>(t, fraction, extent, wide);
        if (vp::core::is_narrow_cell(to_position(t[0]), to_position(t[1]), to_position(t[2]), fraction))
            add_terms<std::int64_t>(t, fraction, extent, narrow);
        else
            has_narrow = false;
    }
    if (has_narrow) {
        ASSERT_EQ(wide.size(), narrow.size());
        for (const auto& [at, terms] : wide) {
            ASSERT_EQ(signed_terms(narrow.at(at)), signed_terms(terms));
            ASSERT_EQ(unsigned_terms(narrow.at(at)), unsigned_terms(terms));
        }
    }
    for (std::int64_t z = 0; z < extent; ++z)
        for (std::int64_t y = 0; y < extent; ++y) {
            std::int64_t aperture = 0, row_y = 0, row_z = 0;
            for (std::int64_t x = -1; x <= extent; ++x) {
                const auto found = wide.find({z, y, x});
                const all_terms terms = found == wide.end() ? all_terms{} : found->second;
                if (x >= 0 && x < extent) {
                    long double exact = 0.0L, area = 0.0L, cover = 0.0L;
                    std::array<long double, 3> moment{}, area_moment{};
                    std::array<long double, 2> cover_moment{};
                    std::size_t touching = 0, at_face = 0;
                    for (const lattice_triangle& t : mesh) {
                        const oracle::cell_part part = oracle::cell_of(
                            t, fraction, {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)});
                        exact += part.fraction;
                        cover += part.cover;
                        touching += part.touches ? 1 : 0;
                        at_face += part.touches_face ? 1 : 0;
                        for (std::size_t i = 0; i < 2; ++i) cover_moment[i] += part.cover_moment[i];
                        area += part.area;
                        for (std::size_t i = 0; i < 3; ++i) {
                            moment[i] += part.moment[i];
                            area_moment[i] += part.area_moment[i];
                        }
                    }
                    const std::int64_t units = aperture + terms.volume;
                    const long double error = std::abs(static_cast<long double>(units) - std::ldexp(exact, 44));
                    ASSERT_LE(error, bound * static_cast<double>(touching) + slack) << x << ' ' << y << ' ' << z;
                    const std::array<std::int64_t, 3> found_moment{terms.volume_x, row_y + terms.volume_y,
                                                                   row_z + terms.volume_z},
                        found_area_moment{terms.area_x, terms.area_y, terms.area_z};
                    const auto off = [](std::int64_t is, long double should, int bits) {
                        return std::abs(static_cast<long double>(is) - std::ldexp(should, bits));
                    };
                    // The lower face: its aperture and moments.
                    const double of_face = face_bound * static_cast<double>(at_face) + slack;
                    ASSERT_LE(off(aperture, cover, 44), of_face) << x << ' ' << y << ' ' << z;
                    ASSERT_LE(off(row_y, cover_moment[0], 44), of_face) << x << ' ' << y << ' ' << z;
                    ASSERT_LE(off(row_z, cover_moment[1], 44), of_face) << x << ' ' << y << ' ' << z;
                    if (at_face == 0) {
                        ASSERT_EQ(aperture % whole_cell, 0);
                        ASSERT_TRUE(row_y == 0 && row_z == 0);
                    }
                    const double count = static_cast<double>(touching) + slack;
                    ASSERT_LE(off(terms.area, area, 40), 0.51 * count) << x << ' ' << y << ' ' << z;
                    for (std::size_t i = 0; i < 3; ++i) {
                        ASSERT_LE(off(found_moment[i], moment[i], 44), bound * count) << x << ' ' << y << ' ' << z;
                        ASSERT_LE(off(found_area_moment[i], area_moment[i], 40), 0.51 * count);
                    }
                    if (touching == 0) {
                        ++untouched;
                        ASSERT_EQ(found_moment, (std::array<std::int64_t, 3>{})) << x << ' ' << y << ' ' << z;
                        ASSERT_EQ(units, std::llrint(exact) * whole_cell) << x << ' ' << y << ' ' << z;
                        ASSERT_TRUE(found == wide.end());
                    }
                }
                aperture += terms.cover;
                row_y += terms.cover_y;
                row_z += terms.cover_z;
            }
            ASSERT_EQ(aperture, 0) << y << ' ' << z;
            ASSERT_EQ(row_y, 0) << y << ' ' << z;
            ASSERT_EQ(row_z, 0) << y << ' ' << z;
        }
}

TEST(CellTerms, AreWithinTheBoundAndUntouchedVoxelsAreWhole) {
    splitmix64 random(41);
    std::size_t untouched = 0;
    for (std::int64_t i = 0; i < ::unit::cases(160); ++i) {
        constexpr std::array<int, 6> fractions{1, 2, 4, 8, 14, 16};
        const int fraction = fractions[static_cast<std::size_t>(random.next() % 6)];
        const std::int64_t extent = 2 + static_cast<std::int64_t>(random.next() % 3);
        check_mesh(closed_mesh(random, static_cast<int>(i % 4), fraction, extent), fraction, extent, untouched);
        if (HasFatalFailure()) FAIL() << "mesh " << i << " with " << fraction << " fraction bits";
    }
    EXPECT_GT(untouched, 1000u);
}

// Edges whose directions do not cancel, with how often they are left.
std::map<std::pair<lattice_point, lattice_point>, int> boundary_of(const std::vector<lattice_triangle>& mesh) {
    std::map<std::pair<lattice_point, lattice_point>, int> edges;
    for (const lattice_triangle& t : mesh)
        for (std::size_t i = 0; i < 3; ++i) {
            const lattice_point &a = t[i], &b = t[(i + 1) % 3];
            if (a < b) ++edges[{a, b}];
            if (b < a) --edges[{b, a}];
        }
    return edges;
}
// True if an edge passes a closed pixel: neither an axis nor the edge's own line parts them.
bool passes(const lattice_point& a, const lattice_point& b, int fraction, std::int64_t y, std::int64_t z) {
    const std::int64_t size = std::int64_t{1} << fraction;
    const std::int64_t low[2] = {y * size, z * size};
    for (std::size_t i = 0; i < 2; ++i)
        if (std::max(a[i + 1], b[i + 1]) < low[i] || std::min(a[i + 1], b[i + 1]) > low[i] + size) return false;
    bool has_left = false, has_right = false;
    for (unsigned corner = 0; corner < 4; ++corner) {
        const std::int64_t u = low[0] + (corner % 2) * size - a[1], v = low[1] + (corner / 2) * size - a[2];
        const std::int64_t side = (b[1] - a[1]) * v - (b[2] - a[2]) * u;
        has_left = has_left || side >= 0;
        has_right = has_right || side <= 0;
    }
    return has_left && has_right;
}

// On open meshes each boundary edge of the row may be off by the rounding of its term, and nothing else is.
TEST(CellTerms, OfOpenMeshesAreOffByTheirBoundary) {
    splitmix64 random(53);
    std::size_t beyond_closed = 0, untouched = 0;
    for (std::int64_t round = 0; round < ::unit::cases(80); ++round) {
        constexpr std::array<int, 5> fractions{2, 6, 10, 14, 16};
        const int fraction = fractions[static_cast<std::size_t>(random.next() % 5)];
        const std::int64_t extent = 3;
        std::vector<lattice_triangle> mesh = closed_mesh(random, static_cast<int>(round % 4), fraction, extent);
        mesh.erase(mesh.begin() + static_cast<std::ptrdiff_t>(random.next() % mesh.size()));
        if (round % 2 == 0) mesh.resize(1 + random.next() % 2); // single triangles
        const auto boundary = boundary_of(mesh);
        term_map sums;
        for (const lattice_triangle& t : mesh) add_terms<vp::int128>(t, fraction, extent, sums);
        for (std::int64_t z = 0; z < extent; ++z)
            for (std::int64_t y = 0; y < extent; ++y) {
                double edges = 0;
                for (const auto& [edge, times] : boundary)
                    if (passes(edge.first, edge.second, fraction, y, z)) edges += std::abs(times);
                const auto terms_at = [&](std::int64_t x) {
                    const auto found = sums.find({z, y, x});
                    return found == sums.end() ? all_terms{} : found->second;
                };
                std::int64_t aperture = terms_at(-1).cover;
                for (std::int64_t x = 0; x < extent; ++x) {
                    long double exact = 0.0L, cover = 0.0L;
                    std::size_t touching = 0, at_face = 0;
                    for (const lattice_triangle& t : mesh) {
                        const oracle::cell_part part = oracle::cell_of(
                            t, fraction, {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)});
                        exact += part.fraction;
                        cover += part.cover;
                        touching += part.touches ? 1 : 0;
                        at_face += part.touches_face ? 1 : 0;
                    }
                    const double more = 0.5 * 1.125 * edges + slack;
                    const long double off =
                        std::abs(static_cast<long double>(aperture + terms_at(x).volume) - std::ldexp(exact, 44));
                    ASSERT_LE(off, bound * static_cast<double>(touching) + more) << round;
                    ASSERT_LE(std::abs(static_cast<long double>(aperture) - std::ldexp(cover, 44)),
                              face_bound * static_cast<double>(at_face) + more)
                        << round;
                    if (touching == 0) {
                        ++untouched;
                        beyond_closed += off > slack ? 1 : 0;
                    }
                    aperture += terms_at(x).cover;
                }
            }
    }
    EXPECT_GT(untouched, 500u);
    EXPECT_GT(beyond_closed, 20u); // the boundary's roundings are there
}

// Neither the first vertex nor the position by whole voxels shows; a triangle turned over has the opposite terms.
TEST(CellTerms, DoNotDependOnTheFirstVertexOrOnWholeVoxels) {
    splitmix64 random(5);
    constexpr int fraction = 12;
    constexpr std::int64_t size = 1 << fraction;
    for (int i = 0; i < 300; ++i) {
        lattice_triangle t{};
        for (auto& p : t)
            for (auto& c : p) c = static_cast<std::int64_t>(random.next() % (5 * size));
        term_map one, turned, over, moved;
        add_terms<std::int64_t>(t, fraction, 5, one);
        add_terms<std::int64_t>({t[1], t[2], t[0]}, fraction, 5, turned);
        add_terms<std::int64_t>({t[1], t[0], t[2]}, fraction, 5, over);
        lattice_triangle far = t;
        for (auto& p : far)
            for (auto& c : p) c += 3 * size;
        add_terms<std::int64_t>(far, fraction, 8, moved);
        ASSERT_EQ(one.size(), turned.size());
        ASSERT_EQ(one.size(), moved.size());
        for (const auto& [at, terms] : one) {
            const all_terms& there = moved.at({at[0] + 3, at[1] + 3, at[2] + 3});
            auto opposite = signed_terms(terms);
            for (std::int64_t& term : opposite) term = -term;
            EXPECT_EQ(signed_terms(turned.at(at)), signed_terms(terms));
            EXPECT_EQ(signed_terms(over.at(at)), opposite);
            EXPECT_EQ(signed_terms(there), signed_terms(terms));
            for (const all_terms& t2 : {turned.at(at), over.at(at), there})
                EXPECT_EQ(unsigned_terms(t2), unsigned_terms(terms));
        }
    }
}

// Vertices as far away as snapping allows: rows still close, and every voxel is that of the plane.
TEST(CellTerms, OfTheLargestTriangles) {
    constexpr int fraction = 4;
    constexpr std::int64_t far = std::int64_t{1} << 40, half = 1 << (fraction - 1);
    // A plane x = 1.5 that covers all pixels of the grid; the others of a tetrahedron pass it far away.
    const std::vector<lattice_triangle> mesh =
        tetrahedron({lattice_point{3 * half, -far, -far}, {3 * half, far, -far}, {3 * half, 0, far}, {far, 0, 0}});
    term_map sums;
    for (const lattice_triangle& t : mesh) add_terms<vp::int128>(t, fraction, 3, sums);
    for (std::int64_t z = 0; z < 3; ++z)
        for (std::int64_t y = 0; y < 3; ++y) {
            EXPECT_EQ(std::abs(sums.at({z, y, 1}).cover), whole_cell);
            EXPECT_EQ(std::abs(sums.at({z, y, 1}).volume), whole_cell / 2);
            EXPECT_EQ(sums.at({z, y, 1}).cover + sums.at({z, y, 3}).cover, 0);
        }
}

} // namespace
