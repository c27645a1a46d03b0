// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Whole fields, every sample against exact fractions, and what holds between fields.

#include "distance_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace distances {
namespace {

vp::grid grid_of(glm::ivec3 extent, glm::dvec3 voxel_size) {
    vp::grid g;
    g.extent = extent;
    g.voxel_size = voxel_size;
    return g;
}
// A mesh in voxel coordinates into the world of a grid at the origin.
mesh scaled(mesh m, const vp::grid& g) {
    for (glm::vec3& p : m.positions)
        for (int k = 0; k < 3; ++k) p[k] = static_cast<float>(static_cast<double>(p[k]) * g.voxel_size[k]);
    return m;
}

// Meshes that are closed or not: solids, slivers, points, segments, coincident and opposite faces, and triangles far
// larger than the grid.
mesh adversarial(splitmix64& random, int extent) {
    mesh m;
    const auto coordinate = [&] { return static_cast<float>(random.between(-16, 16 * extent + 16)) / 16.0f; };
    const auto point = [&] { return glm::vec3(coordinate(), coordinate(), coordinate()); };
    const auto triangle = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        const auto n = static_cast<unsigned>(m.positions.size());
        m.positions.insert(m.positions.end(), {a, b, c});
        m.triangles.push_back({n, n + 1, n + 2});
    };
    const auto count = random.between(1, 6);
    for (std::int64_t i = 0; i < count; ++i) {
        const glm::vec3 a = point(), b = point(), c = point();
        switch (random.below(8)) {
        case 0:
            triangle(a, a, a);
            break;
        case 1:
            triangle(a, b, a);
            break;
        case 2:
            triangle(a, b, a + (b - a) * 0.5f + glm::vec3(0.0f, 0x1p-12f, 0.0f));
            break;
        case 3: // a face through centres, twice, once the other way round
            triangle({a.x, a.y, 1.5f}, {b.x, b.y, 1.5f}, {c.x, c.y, 1.5f});
            triangle({a.x, a.y, 1.5f}, {c.x, c.y, 1.5f}, {b.x, b.y, 1.5f});
            break;
        case 4:
            triangle(a * 1000.0f, b * -1000.0f, c);
            break;
        case 5:
            triangle(a * 1e5f, b * 3e5f, c * -2e5f);
            break;
        default:
            triangle(a, b, c);
        }
    }
    return m;
}

std::vector<oracle::lattice_triangle> lattice(const mesh& m, const vp::grid& g) {
    const vp::core::snap_transform t = vp::core::make_snap_transform(g);
    std::vector<oracle::lattice_triangle> all;
    for (const glm::uvec3& i : m.triangles) {
        oracle::lattice_triangle out{};
        for (int v = 0; v < 3; ++v) {
            const glm::vec3 p = m.positions[i[v]];
            const vp::core::snapped_position s = vp::core::snap(t, p.x, p.y, p.z);
            out[static_cast<std::size_t>(v)] = {s.x, s.y, s.z};
        }
        all.push_back(out);
    }
    return all;
}

// Every sample of a whole field against brute force over all triangles: the nearest float, and a triangle that is
// nearest.
void check_field(const mesh& m, const vp::grid& g, vp::sample where) {
    const vp::grid samples = vp::core::sample_grid(g, where);
    const field f = library_field(m, g, {.band = vp::band::whole, .sample = where, .sign = vp::distance_sign::none});
    ASSERT_TRUE(f.status.ok()) << f.status.message();
    const std::vector<oracle::lattice_triangle> triangles = lattice(m, samples);
    const int fraction = samples.fraction();
    const oracle::distance_oracle exact({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z}, fraction);
    const vp::core::distance_scale scale = vp::core::make_distance_scale(g.voxel_size, fraction);
    for (int z = 0; z < f.extent.z; ++z)
        for (int y = 0; y < f.extent.y; ++y)
            for (int x = 0; x < f.extent.x; ++x) {
                const auto at = [&](int i) { return (2 * std::int64_t{i} + 1) << (fraction - 1); };
                const oracle::lattice_point p{at(x), at(y), at(z)};
                oracle::exact_square least = exact.square(triangles[0], p);
                double square = std::numeric_limits<double>::infinity();
                std::int64_t nearest = -1;
                for (std::size_t i = 0; i < triangles.size(); ++i) {
                    const oracle::exact_square s = exact.square(triangles[i], p);
                    if (oracle::is_less(s, least)) least = s;
                    // The lowest of those with the least double: the formula, which another test proves.
                    const auto snapped = [&](std::size_t v) {
                        return vp::core::snapped_position{triangles[i][v][0], triangles[i][v][1], triangles[i][v][2]};
                    };
                    const double one =
                        vp::core::find_distance(
                            vp::core::see_wide(snapped(0), snapped(1), snapped(2), {p[0], p[1], p[2]}), scale)
                            .square;
                    if (one < square) {
                        square = one;
                        nearest = static_cast<std::int64_t>(i);
                    }
                }
                ASSERT_TRUE(exact.is_nearest_float(least, f.distances[f.index(x, y, z)]))
                    << x << " " << y << " " << z << ": " << f.distances[f.index(x, y, z)];
                ASSERT_EQ(f.nearest[f.index(x, y, z)], nearest) << x << " " << y << " " << z;
            }
}

TEST(DistanceField, EverySampleIsTheNearestFloat) {
    splitmix64 random(1);
    const std::int64_t n = unit::cases(100);
    for (std::int64_t i = 0; i < n; ++i) {
        SCOPED_TRACE(i);
        const glm::ivec3 extent(static_cast<int>(random.between(1, 9)), static_cast<int>(random.between(1, 5)),
                                static_cast<int>(random.between(1, 5)));
        const std::array<glm::dvec3, 4> sizes{glm::dvec3(1.0), glm::dvec3(0.1), glm::dvec3(0.1, 0.3, 0.5),
                                              glm::dvec3(2.0, 0.01, 1.0)};
        const vp::grid g = grid_of(extent, sizes[random.below(4)]);
        check_field(scaled(adversarial(random, 5), g), g, random.one_in(3) ? vp::sample::corner : vp::sample::centre);
        if (HasFatalFailure()) return;
    }
}

// Bands, threads and crops against the whole field; meshes with more triangles than a run of the tree.
TEST(DistanceField, BandsAndCropsAndThreadsAreTheWholeField) {
    splitmix64 random(2);
    for (int i = 0; i < 4; ++i) {
        SCOPED_TRACE(i);
        const vp::grid g = grid_of({41, 19, 23}, i % 3 == 0 ? glm::dvec3(0.1, 0.25, 0.2) : glm::dvec3(0.1));
        mesh m = solids::random_bodies(random, 18, 6);
        if (i % 2 == 0) m.add(solids::sphere({20.0f, 9.0f, 11.0f}, 8.3f, 3));
        m = scaled(m, g);
        const vp::sample where = i % 4 == 1 ? vp::sample::corner : vp::sample::centre;
        const field whole = library_field(m, g, {.band = vp::band::whole, .sample = where});
        ASSERT_TRUE(whole.status.ok());
        EXPECT_EQ(whole.status.distance.band_samples, whole.distances.size());
        const auto same = [](const field& a, const field& b) {
            return a.distances == b.distances && a.nearest == b.nearest;
        };
        EXPECT_TRUE(same(whole, library_field(m, g, {.band = vp::band::whole, .sample = where}, 1)));
        for (const double width : {0.5, 1.0, 3.0, 7.25}) {
            const field band = library_field(m, g, {.band = width, .sample = where}, 3);
            ASSERT_TRUE(band.status.ok());
            const float b = vp::core::band_distance(width, g);
            std::uint64_t held = 0;
            for (std::size_t s = 0; s < band.distances.size(); ++s) {
                const float d = whole.distances[s];
                const bool in = std::abs(d) <= b;
                held += static_cast<std::uint64_t>(in);
                ASSERT_EQ(band.distances[s], in ? d : std::copysign(b, d)) << s;
                ASSERT_EQ(band.nearest[s], in ? whole.nearest[s] : -1) << s;
            }
            EXPECT_EQ(band.status.distance.band_samples, held);
        }
        const glm::ivec3 begin(7, 3, 5), size(22, 11, 9);
        for (const vp::band width : {vp::band(3.0), vp::band::whole}) {
            const field all = library_field(m, g, {.band = width, .sample = where});
            const field part = library_field(m, g.crop(begin, size), {.band = width, .sample = where});
            ASSERT_TRUE(part.status.ok());
            for (int z = 0; z < part.extent.z; ++z)
                for (int y = 0; y < part.extent.y; ++y)
                    for (int x = 0; x < part.extent.x; ++x) {
                        const std::size_t from = all.index(begin.x + x, begin.y + y, begin.z + z);
                        ASSERT_EQ(part.distances[part.index(x, y, z)], all.distances[from]);
                        ASSERT_EQ(part.nearest[part.index(x, y, z)], all.nearest[from]);
                    }
        }
    }
}

TEST(DistanceField, PermutedAxesPermuteTheBits) {
    splitmix64 random(3);
    for (int i = 0; i < 6; ++i) {
        const vp::grid g = grid_of({17, 12, 9}, {0.1, 0.23, 0.3});
        mesh m = scaled(solids::random_bodies(random, 9, 5), g);
        const field f = library_field(m, g, {.band = vp::band::whole});
        for (const std::array<int, 3>& to : {std::array<int, 3>{1, 2, 0}, {2, 0, 1}, {1, 0, 2}}) {
            vp::grid h = g;
            mesh n = m;
            for (int k = 0; k < 3; ++k) {
                h.extent[k] = g.extent[to[static_cast<std::size_t>(k)]];
                h.voxel_size[k] = g.voxel_size[to[static_cast<std::size_t>(k)]];
                for (std::size_t p = 0; p < m.positions.size(); ++p)
                    n.positions[p][k] = m.positions[p][to[static_cast<std::size_t>(k)]];
            }
            if (to[0] == 1 && to[1] == 0) n = n.inside_out();
            const field turned = library_field(n, h, {.band = vp::band::whole, .sign = vp::distance_sign::none});
            for (int z = 0; z < h.extent.z; ++z)
                for (int y = 0; y < h.extent.y; ++y)
                    for (int x = 0; x < h.extent.x; ++x) {
                        glm::ivec3 p{};
                        p[to[0]] = x;
                        p[to[1]] = y;
                        p[to[2]] = z;
                        ASSERT_EQ(turned.distances[turned.index(x, y, z)],
                                  std::abs(f.distances[f.index(p.x, p.y, p.z)]));
                    }
        }
    }
}

// A box whose faces lie on the lattice has a closed formula; distances are rounded once.
TEST(DistanceField, BoxesFollowTheirFormula) {
    const glm::vec3 low(5.25f, 6.5f, 4.0f), high(14.0f, 11.75f, 13.5f);
    const field f =
        library_field(solids::box(low, high), grid_of({21, 18, 19}, glm::dvec3(1.0)), {.band = vp::band::whole});
    for (int z = 0; z < f.extent.z; ++z)
        for (int y = 0; y < f.extent.y; ++y)
            for (int x = 0; x < f.extent.x; ++x) {
                double outside = 0.0, inside = -1e9;
                for (int k = 0; k < 3; ++k) {
                    const double p = (k == 0 ? x : k == 1 ? y : z) + 0.5;
                    const double d = std::max(double{low[k]} - p, p - double{high[k]});
                    outside += std::max(d, 0.0) * std::max(d, 0.0);
                    inside = std::max(inside, d);
                }
                const double expected = inside <= 0.0 ? inside : std::sqrt(outside);
                ASSERT_EQ(f.distances[f.index(x, y, z)], static_cast<float>(expected)) << x << " " << y << " " << z;
            }
}

// The facets of a torus lie within its sagitta: half the square of an edge over the least radius of curvature.
TEST(DistanceField, ToriFollowTheirFormula) {
    const double major = 8.5, minor = 3.25;
    const glm::dvec3 centre(13.2, 12.6, 6.4);
    const int around = 256, across = 96;
    mesh m;
    for (int i = 0; i < around; ++i)
        for (int k = 0; k < across; ++k) {
            constexpr double turn = 6.283185307179586;
            const double u = turn * i / around, v = turn * k / across, r = major + minor * std::cos(v);
            m.positions.push_back(
                glm::vec3(centre + glm::dvec3(r * std::cos(u), r * std::sin(u), minor * std::sin(v))));
            const auto at = [&](int a, int b) {
                return static_cast<std::uint32_t>((i + a) % around * across + (k + b) % across);
            };
            m.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
            m.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
        }
    double longest = 0.0;
    for (const glm::uvec3& t : m.triangles)
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 e(m.positions[t[k]] - m.positions[t[(k + 1) % 3]]);
            longest = std::max(longest, e.x * e.x + e.y * e.y + e.z * e.z);
        }
    const double sagitta = longest / (2 * minor);
    ASSERT_LT(sagitta, 0.02);
    for (const vp::sample where : {vp::sample::centre, vp::sample::corner}) {
        const field f =
            library_field(m, grid_of({27, 26, 13}, glm::dvec3(1.0)), {.band = vp::band::whole, .sample = where});
        const double half = where == vp::sample::corner ? 0.0 : 0.5;
        std::size_t inside = 0;
        for (int z = 0; z < f.extent.z; ++z)
            for (int y = 0; y < f.extent.y; ++y)
                for (int x = 0; x < f.extent.x; ++x) {
                    const glm::dvec3 p = glm::dvec3(x + half, y + half, z + half) - centre;
                    const double ring = std::sqrt(p.x * p.x + p.y * p.y) - major;
                    const double expected = std::sqrt(ring * ring + p.z * p.z) - minor;
                    const double d = f.distances[f.index(x, y, z)];
                    ASSERT_NEAR(d, expected, sagitta) << x << " " << y << " " << z;
                    inside += d < 0.0 ? 1 : 0;
                }
        EXPECT_GT(inside, 1000u);
    }
}

// The chords of a sphere lie between its radius and the distance of their planes from the centre.
TEST(DistanceField, SpheresFollowTheirFormula) {
    const float radius = 9.0f;
    const glm::vec3 centre(13.0f, 12.5f, 11.75f);
    const mesh m = solids::sphere(centre, radius, 4);
    double least = radius;
    for (const glm::uvec3& t : m.triangles) {
        const glm::dvec3 a(m.positions[t.x] - centre), b(m.positions[t.y] - centre), c(m.positions[t.z] - centre);
        const glm::dvec3 e = b - a, f = c - a, n(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
        least =
            std::min(least, std::abs(n.x * a.x + n.y * a.y + n.z * a.z) / std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z));
    }
    ASSERT_GT(least, 8.9);
    const field f = library_field(m, grid_of({26, 25, 24}, glm::dvec3(1.0)), {.band = vp::band::whole});
    for (int z = 0; z < f.extent.z; ++z)
        for (int y = 0; y < f.extent.y; ++y)
            for (int x = 0; x < f.extent.x; ++x) {
                const glm::dvec3 p = glm::dvec3(x + 0.5, y + 0.5, z + 0.5) - glm::dvec3(centre);
                const double length = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
                const double d = f.distances[f.index(x, y, z)];
                ASSERT_GE(d, length - double{radius} - 1e-3);
                ASSERT_LE(d, length - least + 1e-3);
            }
}

} // namespace
} // namespace distances
