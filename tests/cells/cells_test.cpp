// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_cells: closed formulas, the theorems of docs/design.md, crops, order, bodies, holes and bad input.
#include "cell_support.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <numeric>

namespace {

using namespace cells;

// The sum of the units is the status' volume.
std::int64_t volume_of(const cell_values& c) {
    const auto sum = std::accumulate(c.units.begin(), c.units.end(), std::int64_t{0});
    EXPECT_EQ(static_cast<std::int64_t>(c.status.cells.volume_low), sum);
    EXPECT_EQ(c.status.cells.volume_high, sum < 0 ? -1 : 0);
    return sum;
}

// Boxes whose faces lie anywhere: the product of the overlaps, which floats and fixed point hold exactly.
TEST(Cells, BoxesHaveTheProductOfTheirOverlaps) {
    splitmix64 random(3);
    for (int i = 0; i < 20; ++i) {
        glm::vec3 a, b;
        for (int axis = 0; axis < 3; ++axis) {
            const auto number = [&] { return static_cast<float>(random.next() % 97) / 16.0f; };
            a[axis] = number();
            b[axis] = a[axis] + number() + 0.0625f;
        }
        const glm::ivec3 extent{7, 6, 8};
        const auto c = library_cells(solids::box(a, b), solids::unit_grid(extent), {.axis = i % 3});
        EXPECT_EQ(c.status.cells.open_rows, 0u);
        EXPECT_EQ(c.status.cells.open_edges, 0u);
        EXPECT_EQ(c.status.cells.below_zero + c.status.cells.above_one, 0u);
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    const glm::ivec3 p{x, y, z};
                    double expected = 1.0;
                    for (int axis = 0; axis < 3; ++axis)
                        expected *=
                            std::max(0.0, std::min<double>(b[axis], p[axis] + 1) - std::max<double>(a[axis], p[axis]));
                    const std::size_t at = c.index(x, y, z);
                    // Two triangles a face, six faces.
                    EXPECT_NEAR(static_cast<double>(c.units[at]), expected * 0x1p44, 12 * bound);
                    EXPECT_NEAR(static_cast<double>(c.fractions[at]), expected, 0x1p-24);
                    if (expected == 1.0 || expected == 0.0) {
                        EXPECT_EQ(c.units[at] % whole_cell, 0) << i;
                    }
                }
    }
}

// A sphere's polyhedron has a volume of its own, which the sum gives to the last bits; it tends to the ball's.
TEST(Cells, SpheresHaveTheVolumeOfTheirPolyhedron) {
    const mesh m = solids::sphere({8.1f, 7.9f, 8.3f}, 6.2f, 3);
    const auto c = library_cells(m, solids::unit_grid(glm::ivec3(16)));
    long double exact = 0.0L; // sixths of determinants of multiples of 2^-16
    for (const auto& t : snapped(m, 16)) {
        const auto det = [&](std::size_t i, std::size_t j, std::size_t k) {
            return static_cast<vp::int128>(t[0][i]) * t[1][j] * t[2][k];
        };
        exact += static_cast<long double>(det(0, 1, 2) + det(1, 2, 0) + det(2, 0, 1) - det(0, 2, 1) - det(1, 0, 2) -
                                          det(2, 1, 0));
    }
    exact = std::ldexp(exact, -48) / 6.0L;
    const auto fragments = static_cast<double>(c.status.cells.cell_records);
    EXPECT_NEAR(static_cast<double>(std::ldexp(static_cast<long double>(volume_of(c)), -44) - exact), 0.0,
                2.5 * fragments * 0x1p-44);
    EXPECT_NEAR(static_cast<double>(exact), 4.0 / 3.0 * std::numbers::pi * 6.2 * 6.2 * 6.2, 30.0);
    EXPECT_EQ(c.status.cells.below_zero + c.status.cells.above_one, 0u);
}

// Theorem 1: what no triangle touches has its integer; where a solid's centre is inside, 1.
TEST(Cells, UntouchedVoxelsHaveTheirWinding) {
    splitmix64 random(19);
    for (int i = 0; i < 6; ++i) {
        const mesh m = solids::random_bodies(random, 14, 5);
        const glm::ivec3 extent(14);
        const vp::grid g = solids::unit_grid(extent);
        const auto c = library_cells(m, g);
        const auto inner = solids::library_solid(m, g, {.extent = vp::solid_extent::inner}).voxels;
        const auto outer = solids::library_solid(m, g, {.extent = vp::solid_extent::outer}).voxels;
        std::size_t whole = 0;
        for (std::size_t v = 0; v < inner.size(); ++v) {
            if (inner[v] != 0) {
                EXPECT_EQ(c.units[v] % whole_cell, 0);
                EXPECT_NE(c.units[v], 0);
                EXPECT_EQ(c.cut[v], 0u);
                ++whole;
            } else if (outer[v] == 0) {
                EXPECT_EQ(c.units[v], 0);
                EXPECT_EQ(c.cut[v], 0u);
            }
        }
        EXPECT_EQ(c.status.cells.open_edges, 0u);
        EXPECT_EQ(c.status.cells.open_rows, 0u);
        if (i == 0) {
            EXPECT_GT(whole, 20u);
        }
    }
}

// Theorem 2: the volume is the same to the last bit wherever the mesh lies, and for any order and first vertex.
TEST(Cells, TheVolumeIsTheSameUnderMovesAndOrders) {
    splitmix64 random(23);
    const mesh m = solids::random_cycle(random, 9, 1, 9, 64);
    const vp::grid g = solids::unit_grid(glm::ivec3(20, 18, 16));
    const std::int64_t volume = volume_of(library_cells(m, g));
    EXPECT_NE(volume, 0);
    EXPECT_EQ(volume_of(library_cells(m.moved({7, 3, 5}), g)), volume);
    EXPECT_EQ(volume_of(library_cells(m.inside_out(), g)), -volume);
    mesh shuffled = m;
    for (std::size_t i = shuffled.triangles.size(); i > 1; --i)
        std::swap(shuffled.triangles[i - 1], shuffled.triangles[random.next() % i]);
    for (glm::uvec3& t : shuffled.triangles)
        if (random.next() % 2 == 0) t = glm::uvec3(t.y, t.z, t.x);
    const auto a = library_cells(m, g), b = library_cells(shuffled, g, {}, 1);
    EXPECT_EQ(a.units, b.units);
    EXPECT_EQ(a.apertures, b.apertures);
    EXPECT_EQ(a.status.cells, b.status.cells);
}

// Theorem 3: a crop has the cells of the whole, slabs along the rows too.
TEST(Cells, CropsAreTheCropsOfTheWhole) {
    splitmix64 random(29);
    const mesh m = solids::random_cycle(random, 8, -2, 13, 32);
    const vp::grid g = solids::unit_grid(glm::ivec3(12, 11, 10));
    for (int axis = 0; axis < 3; ++axis) {
        const auto whole = library_cells(m, g, {.axis = axis});
        for (const auto& [begin, size] : {std::pair{glm::ivec3(4, 0, 0), glm::ivec3(5, 11, 10)},
                                          {glm::ivec3(0, 3, 0), glm::ivec3(12, 4, 10)},
                                          {glm::ivec3(2, 1, 6), glm::ivec3(3, 7, 2)},
                                          {glm::ivec3(11, 10, 9), glm::ivec3(1)}}) {
            const auto part = library_cells(m, g.crop(begin, size), {.axis = axis});
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y)
                    for (int x = 0; x < size.x; ++x) {
                        const std::size_t at = whole.index(begin.x + x, begin.y + y, begin.z + z),
                                          here = part.index(x, y, z);
                        EXPECT_EQ(part.units[here], whole.units[at]);
                        EXPECT_EQ(part.apertures[here], whole.apertures[at]);
                        EXPECT_EQ(part.next[here], whole.next[at]);
                        EXPECT_EQ(part.cut[here], whole.cut[at]);
                    }
        }
    }
}

// Theorem 4: each voxel's upper aperture is the lower one of the voxel behind, and apertures over a plane add up to its
// cross-section.
TEST(Cells, AperturesAreThoseOfTheNeighbours) {
    const mesh m = solids::box({1.25f, 2.5f, 0.75f}, {6.5f, 5.125f, 4.25f});
    const glm::ivec3 extent{8, 7, 6};
    for (int axis = 0; axis < 3; ++axis) {
        const auto c = library_cells(m, solids::unit_grid(extent), {.axis = axis});
        std::int64_t through_three = 0;
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    glm::ivec3 p{x, y, z};
                    if (p[axis] == 3) through_three += c.apertures[c.index(x, y, z)];
                    if (++p[axis] < extent[axis]) {
                        EXPECT_EQ(c.next[c.index(x, y, z)], c.apertures[c.index(p.x, p.y, p.z)]);
                    }
                }
        const double sizes[3] = {5.25, 2.625, 3.5};
        EXPECT_EQ(through_three, static_cast<std::int64_t>(sizes[(axis + 1) % 3] * sizes[(axis + 2) % 3] * 0x1p44));
    }
}

// By all axes a closed mesh has the same fractions within the bound, and the same ones where no triangle is.
TEST(Cells, RowsAlongAllAxesAgree) {
    splitmix64 random(31);
    mesh m = solids::random_cycle(random, 12, 0, 12, 16);
    m.add(solids::sphere({6, 6, 6}, 4.3f, 2));
    const vp::grid g = solids::unit_grid(glm::ivec3(12));
    const auto by_x = library_cells(m, g);
    for (const int axis : {1, 2}) {
        const auto other = library_cells(m, g, {.axis = axis});
        for (std::size_t v = 0; v < by_x.units.size(); ++v) {
            const double error = std::abs(static_cast<double>(by_x.units[v] - other.units[v]));
            EXPECT_LE(error, 2 * bound * static_cast<double>(m.triangles.size()));
            if (by_x.cut[v] == 0 && other.cut[v] == 0 && by_x.units[v] % whole_cell == 0) {
                EXPECT_EQ(error, 0.0);
            }
        }
    }
}

// Overlapping parts add up, and the status tells; inverted ones count negative.
TEST(Cells, OverlapsAddUp) {
    mesh m = solids::box({1, 1, 1}, {4, 4, 4});
    m.add(solids::box({2, 2, 2}, {5, 5, 5}));
    m.add(solids::box({6, 1, 1}, {7, 2, 2.5f}).inside_out());
    const auto c = library_cells(m, solids::unit_grid(glm::ivec3(8)));
    EXPECT_EQ(c.fractions[c.index(1, 1, 1)], 1.0f);
    EXPECT_EQ(c.fractions[c.index(2, 2, 2)], 2.0f);
    EXPECT_EQ(c.fractions[c.index(6, 1, 1)], -1.0f);
    EXPECT_EQ(c.fractions[c.index(6, 1, 2)], -0.5f);
    EXPECT_EQ(c.status.cells.above_one, 8u);
    EXPECT_EQ(c.status.cells.below_zero, 2u);
    EXPECT_EQ(c.status.cells.volume(), 54.0 - 1.5);
}

// With bodies::draw each draw has fragments of its own, blended by ascending draw.
TEST(Cells, BodiesByDraw) {
    const std::vector<mesh> draws{solids::box({1, 1, 1}, {4, 4, 4}), solids::box({3.5f, 1, 1}, {6, 4, 4})};
    const vp::grid g = solids::unit_grid(glm::ivec3(8));
    const auto call = library_cells(draws, g), each = library_cells(draws, g, {.bodies = vp::bodies::draw});
    EXPECT_EQ(call.fractions, each.fractions); // which add up
    EXPECT_EQ(each.units[each.index(3, 2, 2)], whole_cell / 2);
    EXPECT_EQ(call.units[each.index(3, 2, 2)], whole_cell * 3 / 2);
    EXPECT_EQ(each.status.counts.fragments, call.status.counts.fragments + 9);
    EXPECT_EQ(each.status.counts.voxels, call.status.counts.voxels);
    EXPECT_EQ(each.status.cells.volume(), call.status.cells.volume());
}

// The fraction by a shader that makes no promise.
struct fraction_of_place {
    VOXELPIPE_HD vp::output<float> operator()(const vp::cell_fragment& f) const { return vp::outputs(f.fraction); }
};

// Voxels between two that are cut are drawn as one where the shader ignores the place; not into targets that load.
TEST(Cells, RunsOfVoxelsHaveTheValuesOfVoxels) {
    const std::vector<mesh> meshes{solids::box({1.5f, 1, 2.25f}, {17.5f, 12, 13}), solids::sphere({9, 7, 8}, 5.2f, 2),
                                   solids::box({-3, 4, 4}, {30, 6.5f, 6}).inside_out()};
    const vp::grid g = solids::unit_grid({21, 15, 17});
    vp::cpu_backend backend(2);
    using summed = vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::add>>;
    const auto draw = [&]<class Shader>(const Shader& shader, summed& fb, const vp::cell_options& options) {
        std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> draws;
        for (const mesh& m : meshes) draws.push_back({m.view(), {}, shader});
        return vp::voxelize_cells(backend, draws, g, fb, options);
    };
    for (int axis = 0; axis < 3; ++axis)
        for (const vp::bodies each : {vp::bodies::call, vp::bodies::draw}) {
            const vp::cell_options how{.bodies = each, .axis = axis};
            summed a(backend, g.extent), b(backend, g.extent);
            vp::get<0>(a).clear(0.125f);
            vp::get<0>(b).clear(0.125f);
            for (int call = 0; call < 2; ++call) { // the second one loads what the first one drew
                const vp::status by_runs = draw(vp::fraction{}, a, how), by_voxels = draw(fraction_of_place{}, b, how);
                ASSERT_TRUE(by_runs.ok() && by_voxels.ok());
                EXPECT_EQ(by_runs.counts, by_voxels.counts);
                EXPECT_EQ(by_runs.cells, by_voxels.cells);
                const std::vector<float> found = vp::get<0>(a).to_host(backend);
                EXPECT_EQ(found, vp::get<0>(b).to_host(backend));
                EXPECT_GT(std::count(found.begin(), found.end(), call == 0 ? 1.125f : 2.125f), 500);
                vp::get<0>(a).load();
                vp::get<0>(b).load();
            }
        }
}

// A box without triangles whose normals look along an axis, to one side.
mesh box_without_side(const glm::vec3& low, const glm::vec3& high, int axis, bool upper) {
    mesh m = solids::box(low, high);
    std::erase_if(m.triangles, [&](const glm::uvec3& t) {
        const float at = upper ? high[axis] : low[axis];
        return m.positions[t.x][axis] == at && m.positions[t.y][axis] == at && m.positions[t.z][axis] == at;
    });
    EXPECT_EQ(m.triangles.size(), 10u);
    return m;
}

// The cone over a flat side is the side: the fractions are the closed box's, by all axes.
TEST(Cells, ClosedHolesHaveTheFractionsOfTheClosedMesh) {
    const glm::vec3 low(0.75F, 1.5F, 1.25F), high(5.25F, 4.0F, 5.75F);
    const vp::grid g = solids::unit_grid({7, 6, 8});
    for (int i = 0; i < 18; ++i) {
        const int side = i / 2 % 3, axis = i / 6;
        const mesh open = box_without_side(low, high, side, i % 2 != 0);
        const auto whole = library_cells(solids::box(low, high), g, {.axis = axis}),
                   closed = library_cells(open, g, {.axis = axis, .repair = vp::repair::close_holes});
        const vp::status& s = closed.status;
        EXPECT_EQ(s.cells.open_edges, 0u);
        EXPECT_EQ(s.cells.open_rows, 0u);
        EXPECT_EQ(s.cells.hole_edges, 4u);
        EXPECT_EQ(s.cells.holes, 1u);
        EXPECT_EQ(s.cells.cones, 1u);
        EXPECT_EQ(s.counts.triangles_in, 10u);
        EXPECT_EQ(s.counts.triangles_drawn, 10u);
        EXPECT_EQ(closed.cut, whole.cut);
        for (std::size_t v = 0; v < whole.units.size(); ++v) {
            EXPECT_NEAR(static_cast<double>(closed.units[v]), static_cast<double>(whole.units[v]), 16 * bound);
            if (whole.cut[v] == 0) {
                EXPECT_EQ(closed.units[v], whole.units[v]);
            }
        }
        // A larger hole than is asked for stays, and says so.
        const auto left =
                       library_cells(open, g, {.axis = axis, .repair = vp::repair::close_holes, .max_hole_edges = 3}),
                   none = library_cells(open, g, {.axis = axis});
        EXPECT_EQ(left.status.cells.open_edges, 4u);
        EXPECT_EQ(left.status.cells.holes, 1u);
        EXPECT_EQ(left.status.cells.cones, 0u);
        EXPECT_EQ(none.status.cells.open_edges, 4u);
        EXPECT_EQ(none.status.cells.holes, 0u);
        EXPECT_EQ(left.units, none.units);
        if (side == axis) {
            EXPECT_GT(none.status.cells.open_rows, 0u);
            EXPECT_NE(none.units, whole.units);
        }
    }
}

// Holes are those of a body, and a crop closes those of the whole mesh.
TEST(Cells, HolesAreThoseOfBodiesAndOfTheWholeGrid) {
    const glm::vec3 low(0.75F, 1.5F, 1.25F), middle(3.5F, 4.0F, 5.75F), high(6.25F, 4.0F, 5.75F);
    const vp::grid g = solids::unit_grid({8, 6, 7});
    // Two boxes that meet where they are open: as one body they are closed.
    const mesh left = box_without_side(low, middle, 0, true),
               right = box_without_side({middle.x, low.y, low.z}, high, 0, false);
    const vp::cell_options of_call{.repair = vp::repair::close_holes};
    const vp::cell_options of_draws{.bodies = vp::bodies::draw, .repair = vp::repair::close_holes};
    const auto one = library_cells(std::vector{left, right}, g, of_call),
               two = library_cells(std::vector{left, right}, g, of_draws);
    EXPECT_EQ(one.status.cells.holes, 0u);
    EXPECT_EQ(two.status.cells.cones, 2u);
    EXPECT_EQ(two.status.cells.open_edges, 0u);
    EXPECT_EQ(two.status.cells.open_rows, 0u);
    for (std::size_t v = 0; v < one.units.size(); ++v) EXPECT_NEAR(one.fractions[v], two.fractions[v], 0x1p-22F);
    // Each body by itself is the body that it would be alone; the last one's fragment is what a voxel keeps.
    const auto alone = library_cells(right, g, of_call);
    for (int z = 0; z < 7; ++z)
        for (int y = 0; y < 6; ++y)
            for (int x = 4; x < 8; ++x) EXPECT_EQ(two.units[two.index(x, y, z)], alone.units[alone.index(x, y, z)]);
    const glm::ivec3 begin(4, 1, 2), size(3, 4, 3); // without the hole at x = 3.5
    const auto part = library_cells(right, g.crop(begin, size), of_call);
    EXPECT_EQ(part.status.cells.cones, 1u);
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x)
                EXPECT_EQ(part.units[part.index(x, y, z)],
                          alone.units[alone.index(x + begin.x, y + begin.y, z + begin.z)]);
}

TEST(Cells, BadInput) {
    mesh m = solids::box({1, 1, 1}, {3, 3, 3});
    const vp::grid g = solids::unit_grid(glm::ivec3(5));
    m.positions.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
    m.positions.push_back({1e30f, 0, 0});
    m.triangles.push_back({0, 1, 8});
    m.triangles.push_back({0, 1, 9});
    const auto c = library_cells(m, g);
    EXPECT_EQ(c.status.counts.triangles_nonfinite, 1u);
    EXPECT_EQ(c.status.counts.triangles_too_far, 1u);
    EXPECT_EQ(c.status.cells.volume(), 8.0);
    EXPECT_EQ(c.status.cells.open_edges, 0u);

    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(backend, g.extent);
    const auto draw = [&](const mesh& of, const vp::cell_options& options) {
        return vp::voxelize_cells(backend, of.view(), g, vp::passthrough{}, vp::fraction{}, fb, options);
    };
    EXPECT_TRUE(draw(m, {}).ok());
    const std::vector<float> before = vp::get<0>(fb).to_host(backend);
    EXPECT_EQ(draw(m, {.axis = 3}).code, vp::status_code::bad_cell_options);
    EXPECT_EQ(draw(m, {.axis = -1}).code, vp::status_code::bad_cell_options);
    for (const vp::repair r : {vp::repair::vote, vp::repair::exterior, vp::repair::winding})
        EXPECT_EQ(draw(m, {.repair = r}).code, vp::status_code::bad_cell_options);
    m.triangles.push_back({0, 1, 99});
    const vp::status bad = draw(m, {});
    EXPECT_EQ(bad.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(bad.triangle, m.triangles.size() - 1);
    EXPECT_EQ(vp::get<0>(fb).to_host(backend), before); // nothing is written
    mesh no_vertices;
    no_vertices.triangles = {{0, 1, 2}};
    for (const vp::repair r : {vp::repair::none, vp::repair::close_holes})
        EXPECT_EQ(draw(no_vertices, {.repair = r}).code, vp::status_code::index_out_of_range);
    EXPECT_EQ(vp::get<0>(fb).to_host(backend), before);
    EXPECT_TRUE(draw({}, {}).ok());
    const std::vector<float> cleared = vp::get<0>(fb).to_host(backend);
    EXPECT_TRUE(std::all_of(cleared.begin(), cleared.end(), [](float f) { return f == 0.0f; }));
}

// 2^19 triangles of half a pixel could wrap the sums of their row; fewer cannot, and are not asked.
TEST(Cells, RowsWhoseSumsMightWrapAreRefused) {
    mesh m;
    m.positions = {{0.5f, 0, 0}, {0.5f, 1, 0}, {0.5f, 0, 1}};
    m.triangles.assign((std::size_t{1} << 19) + 1, glm::uvec3(0, 1, 2));
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(backend, glm::ivec3(1));
    const auto draw = [&] {
        return vp::voxelize_cells(backend, m.view(), solids::unit_grid(glm::ivec3(1)), vp::passthrough{},
                                  vp::fraction{}, fb, {.count_open_edges = false});
    };
    const auto value = [&] { return vp::get<0>(fb).to_host(backend)[0]; };
    vp::get<0>(fb).clear(0.375f);
    EXPECT_TRUE(vp::clear(backend, fb).ok());
    EXPECT_EQ(value(), 0.375f);
    vp::get<0>(fb).clear(0.625f);
    EXPECT_EQ(draw().code, vp::status_code::winding_too_large);
    EXPECT_EQ(value(), 0.375f); // neither drawn nor cleared
    vp::get<0>(fb).load();
    for (std::size_t i = 0; i < m.triangles.size(); i += 2) std::swap(m.triangles[i].x, m.triangles[i].y);
    EXPECT_EQ(draw().code, vp::status_code::winding_too_large); // though nearly all cancel, as a block of them does
    EXPECT_EQ(value(), 0.375f);
    for (glm::uvec3& t : m.triangles) t = glm::uvec3(0, 1, 2);
    m.triangles.resize(m.triangles.size() - 2);
    const vp::status fits = draw();
    EXPECT_TRUE(fits.ok());
    EXPECT_EQ(fits.cells.cell_records, m.triangles.size()); // blocks of them add up their terms first
    EXPECT_EQ(std::abs(fits.cells.volume()), static_cast<double>(m.triangles.size()) / 4);
}

} // namespace
