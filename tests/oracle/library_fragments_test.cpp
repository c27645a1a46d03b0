// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The inputs of the library's fragment shader against the oracle's exact rationals: barycentrics, dominant axis,
// facing, normal, voxel and triangle, interpolated varyings, in whole grids and in crops.

#include "library.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace oracle {
namespace {

struct varyings {
    float ramp;
    glm::vec3 position;
    float constant;
    vp::flat<std::uint32_t> vertex;
};

// One attribute: the number of the vertex, from which the test can compute the varyings below.
struct name_vertices {
    vp::vertex_output<varyings> operator()(const vp::vertex<std::uint32_t>& v) const {
        const std::uint32_t n = vp::get<0>(v);
        return {v.position, {static_cast<float>(n % 7) - 3.0f, v.position, 0.1f, {n}}};
    }
};

struct seen {
    std::uint32_t triangle, draw, primitive;
    int axis;
    bool front;
    glm::ivec3 voxel;
    glm::vec3 barycentric, clamped, normal;
    varyings mixed, clamped_mixed;
};

struct record {
    vp::output<seen> operator()(const vp::fragment<varyings>& f) const {
        return vp::outputs(seen{f.triangle, f.draw, f.primitive, f.axis, f.front_facing, f.voxel, f.barycentric,
                                f.clamped_barycentric(), f.normal, f.varyings, f.clamped_varyings()});
    }
};

// Direction of the world normal: grid-space components times the other two voxel sizes.
std::array<long double, 3> world_normal(const grid& g, const snapped_triangle& t) {
    std::array<long double, 3> n{};
    long double length = 0;
    const auto exact = normal(t);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        n[axis] = static_cast<long double>(exact[axis].to_int128()) * g.voxel_size[(axis + 1) % 3] *
                  g.voxel_size[(axis + 2) % 3];
        length += n[axis] * n[axis];
    }
    for (long double& x : n) x /= std::sqrt(length);
    return n;
}

class LibraryFragments : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(LibraryFragments, AreTheOraclesExactValues) {
    splitmix64 random(seed(31));
    const int triangles_of_mesh = std::clamp(static_cast<int>(25 * test_scale()), 2, 25);
    std::uint64_t checked = 0, quotients = 0, correctly_rounded = 0;
    for (const triangle_class kind : all_triangle_classes) {
        for (const test_grid& grid_of_list : test_grids()) {
            test_grid where = grid_of_list;
            part p = random.one_in(2) ? random_part(random, where.g, 24) : whole_of(where.g);
            if (covers_much(kind)) {
                p = random_part(random, where.g, 12);
                where = focused(where, p.as_region());
            }
            const grid& g = where.g;
            std::vector<world_triangle> triangles;
            for (int n = 0; n < triangles_of_mesh; ++n) triangles.push_back(make_triangle(random, where, kind));
            const soup mesh(triangles);
            std::vector<std::uint32_t> numbers(mesh.positions.size());
            for (std::size_t n = 0; n < numbers.size(); ++n) numbers[n] = static_cast<std::uint32_t>(n);
            const vp::mesh_view<std::uint32_t> view{mesh.positions, mesh.triangles,
                                                    vp::core::make_pack(vp::array_view<const std::uint32_t>(numbers))};
            vp::cpu_backend be(2);
            vp::abuffer<vp::cpu_backend, seen> lists{be};
            const vp::status s = vp::voxelize(be, view, as_library(g, p), name_vertices{}, record{}, lists, GetParam());
            ASSERT_TRUE(s.ok()) << s.message();
            for (const auto& [at, fragments] : lists.to_host(be)) {
                for (const auto& [id, f] : fragments) {
                    const auto context = [&, number = id] {
                        return std::string(name(kind)) + " " + describe(g, triangles[number]);
                    };
                    const voxel v{at.x + p.begin[0], at.y + p.begin[1], at.z + p.begin[2]};
                    ASSERT_EQ(f.triangle, id);
                    ASSERT_EQ(f.primitive, id);
                    ASSERT_EQ(f.draw, 0u);
                    ASSERT_TRUE((voxel{f.voxel.x, f.voxel.y, f.voxel.z} == v)); // of the whole grid, in a crop too
                    const snapped_triangle t = snap(g, triangles[id].v);
                    const int axis = dominant_axis(t);
                    std::array<double, 3> weights = {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0};
                    if (axis < 0) {
                        ASSERT_EQ(f.barycentric, glm::vec3(1.0f / 3.0f)) << context();
                        ASSERT_EQ(f.normal, glm::vec3(0.0f)) << context();
                        ASSERT_EQ(f.axis, 0) << context();
                        ASSERT_TRUE(f.front) << context();
                    } else {
                        ASSERT_EQ(f.axis, axis) << context();
                        const auto exact_normal = normal(t);
                        ASSERT_EQ(f.front, exact_normal[static_cast<std::size_t>(axis)].sign() > 0) << context();
                        const auto exact = barycentrics(g, t, v);
                        for (int n = 0; n < 3; ++n) {
                            const ratio& b = exact[static_cast<std::size_t>(n)];
                            // The promise: a quotient of the exact integers as doubles, rounded to float.
                            const double quotient =
                                nearest_double({b.numerator, wide(1)}) / nearest_double({b.denominator, wide(1)});
                            ASSERT_EQ(f.barycentric[n], static_cast<float>(quotient)) << context();
                            ++quotients;
                            correctly_rounded += f.barycentric[n] == nearest_float(b);
                            weights[static_cast<std::size_t>(n)] = nearest_double(b);
                        }
                        const auto direction = world_normal(g, t);
                        for (int n = 0; n < 3; ++n) {
                            const long double x = direction[static_cast<std::size_t>(n)];
                            ASSERT_LE(std::fabs(static_cast<long double>(f.normal[n]) - x),
                                      std::fabs(x) * 0x1.0001p-24L)
                                << context();
                        }
                    }

                    // Clamped: on the triangle.
                    float sum = 0;
                    for (int n = 0; n < 3; ++n) {
                        ASSERT_GE(f.clamped[n], 0.0f) << context();
                        sum += f.clamped[n];
                        if (f.barycentric[n] <= 0.0f) {
                            ASSERT_EQ(f.clamped[n], 0.0f) << context();
                        }
                    }
                    ASSERT_NEAR(sum, 1.0f, 3e-7f) << context();

                    // Varyings: linear in the weights, to float accuracy of the terms; constant and flat ones exactly.
                    ASSERT_EQ(f.mixed.constant, 0.1f) << context();
                    ASSERT_EQ(f.clamped_mixed.constant, 0.1f) << context();
                    ASSERT_EQ(f.mixed.vertex.value, 3 * id) << context();
                    double expected = 0, size = 0;
                    for (std::uint32_t n = 0; n < 3; ++n) {
                        const double value = (3 * id + n) % 7 - 3.0;
                        expected += weights[n] * value;
                        size += (1.0 + std::fabs(weights[n])) * 8.0;
                    }
                    ASSERT_NEAR(f.mixed.ramp, expected, size * 2e-7) << context();
                    ASSERT_LE(std::fabs(f.clamped_mixed.ramp), 3.0f + 2e-6f) << context();
                    ++checked;
                }
            }
        }
    }
    const std::uint64_t at_least = GetParam() == vp::coverage::thin ? 800 : 1600; // for each triangle of a mesh
    EXPECT_GT(checked, at_least * static_cast<std::uint64_t>(triangles_of_mesh));
    // Two roundings differ from one only where the double falls on a tie of floats.
    EXPECT_GE(static_cast<double>(correctly_rounded), 0.9999 * static_cast<double>(quotients));
    RecordProperty("not_correctly_rounded", std::to_string(quotients - correctly_rounded));
    RecordProperty("fragments", std::to_string(checked));
}

INSTANTIATE_TEST_SUITE_P(BothRules, LibraryFragments, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& info) {
                             return std::string(info.param == vp::coverage::thin ? "thin" : "conservative");
                         });

} // namespace
} // namespace oracle
