// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Values of a surface's vertices: constants stay, linear functions are those of the crossings' positions, materials are
// the majority's, and what has no crossing of the mesh takes the nearest triangle's.
#include "value_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace {

using namespace surface_tests;

vp::grid value_grid(int n) { return vp::fit(vp::bounding_box{glm::dvec3(0.0), glm::dvec3(1.0)}, glm::ivec3(n)); }

double length_between(const glm::dvec3& a, const glm::dvec3& b) {
    const double x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
    return std::sqrt(x * x + y * y + z * z);
}
// The distance of a point from a triangle, by its sides and its plane.
double distance_from(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const auto minus = [](const glm::dvec3& u, const glm::dvec3& v) {
        return glm::dvec3(u.x - v.x, u.y - v.y, u.z - v.z);
    };
    const auto dot = [](const glm::dvec3& u, const glm::dvec3& v) { return u.x * v.x + u.y * v.y + u.z * v.z; };
    const auto cross = [](const glm::dvec3& u, const glm::dvec3& v) {
        return glm::dvec3(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
    };
    double best = std::numeric_limits<double>::infinity();
    const glm::dvec3 corners[3] = {a, b, c};
    const glm::dvec3 n = cross(minus(b, a), minus(c, a));
    bool inside = true;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 q = corners[i], e = minus(corners[(i + 1) % 3], q), w = minus(p, q);
        const double t = std::clamp(dot(w, e) / std::max(dot(e, e), 1e-300), 0.0, 1.0);
        best = std::min(best, length_between(p, {q.x + t * e.x, q.y + t * e.y, q.z + t * e.z}));
        inside = inside && dot(cross(e, w), n) >= 0.0;
    }
    if (inside && dot(n, n) > 0.0) best = std::min(best, std::abs(dot(minus(p, a), n)) / std::sqrt(dot(n, n)));
    return best;
}
double distance_from(const glm::dvec3& p, const host_mesh& m) {
    double best = std::numeric_limits<double>::infinity();
    for (const glm::uvec3& t : m.triangles)
        best = std::min(best, distance_from(p, m.positions[t.x], m.positions[t.y], m.positions[t.z]));
    return best;
}

TEST(SurfaceValues, ConstantsStayConstant) {
    vp::cpu_backend backend{2};
    std::uint64_t nearest = 0;
    for (std::uint32_t seed = 0; seed < 6; ++seed) {
        const host_mesh bad = bad_model(seed);
        const vp::mesh<vp::cpu_backend> m{backend, bad.positions, bad.triangles};
        for (int how = 0; how < 5; ++how) {
            vp::remesh_options o;
            if (how == 1) o.repair = vp::repair::close_holes;
            if (how == 2) o.repair = vp::repair::exterior;
            if (how == 3) o.repair = vp::repair::vote;
            if (how == 4) o.level = 0.04;
            vp::surface<vp::cpu_backend, float, glm::vec4, std::int8_t, bool> s(backend);
            const vp::status status =
                vp::remesh(backend, m, value_grid(20), vp::passthrough{},
                           vp::constant(0.1f, glm::vec4(1e-20f, 3e30f, -0.7f, 0.0f), std::int8_t{-3}, true), s, o);
            ASSERT_TRUE(status.ok()) << status.message();
            nearest += status.surface.nearest_values;
            const auto values = vp::get<0>(s).to_host(backend);
            ASSERT_EQ(values.size(), s.vertices.size());
            EXPECT_TRUE(std::all_of(values.begin(), values.end(), [](float v) { return v == 0.1f; })) << how;
            for (const glm::vec4& v : vp::get<1>(s).to_host(backend))
                ASSERT_EQ(v, glm::vec4(1e-20f, 3e30f, -0.7f, 0.0f));
            for (const std::int8_t v : vp::get<2>(s).to_host(backend)) ASSERT_EQ(v, -3);
            for (const bool v : vp::get<3>(s).to_host(backend)) ASSERT_TRUE(v);
        }
    }
    EXPECT_GT(nearest, 100u);
}

// With place::mean a vertex is the mean of its crossings, so a linear function there is the mean of its values at them:
// but for 2^-17 of a voxel of the vertex's rounding, 2^-17 of the snapped vertices', and floats of positions below 1.
TEST(SurfaceValues, LinearFunctionsAreThoseOfThePosition) {
    vp::cpu_backend backend{2};
    for (int k = 0; k < 6; ++k) {
        const float size = 0.2f + 0.03f * static_cast<float>(k);
        const glm::vec3 c(0.5f, 0.47f, 0.52f);
        host_mesh m = k % 3 == 0 ? ball(c, size, 3) : octahedron(c, size);
        if (k % 3 == 2) m.add(box(glm::vec3(0.2f, 0.3f, 0.4f), glm::vec3(0.8f, 0.6f, 0.7f)));
        const int n = 16 + k;
        const host_values s = remesh_with_values(backend, m, value_grid(n), {.place = vp::place::mean});
        ASSERT_TRUE(s.mesh.status.ok());
        EXPECT_EQ(s.mesh.status.surface.nearest_values, 0u);
        ASSERT_GT(s.at.size(), 150u);
        const double tolerance = 2.0 / 65536 / n + 3e-7;
        double worst = 0.0;
        for (std::size_t v = 0; v < s.at.size(); ++v) worst = std::max(worst, length_between(s.at[v], s.position(v)));
        EXPECT_LT(worst, 1.8 * tolerance) << "mesh " << k; // of three coordinates
        EXPECT_GT(worst, 0.0);
    }
}

// Shares of materials are means, so that the largest share tells the majority.
TEST(SurfaceValues, MaterialsAreTheMajoritys) {
    vp::cpu_backend backend{2};
    const host_values s = remesh_with_values(backend, ball(glm::vec3(0.5f), 0.37f, 2), value_grid(19));
    ASSERT_TRUE(s.mesh.status.ok());
    int mixed = 0, ties = 0;
    for (std::size_t v = 0; v < s.material.size(); ++v) {
        const glm::vec3& f = s.shares[v];
        const float most = std::max({f.x, f.y, f.z});
        const std::uint32_t expected = f.x == most ? 0 : f.y == most ? 1 : 2;
        ASSERT_EQ(s.material[v], expected) << f.x << " " << f.y << " " << f.z;
        mixed += most < 1.0f ? 1 : 0;
        ties += (f.x == most) + (f.y == most) + (f.z == most) > 1 ? 1 : 0;
        ASSERT_NEAR(f.x + f.y + f.z, 1.0f, 1e-6f);
        ASSERT_LE(s.mesh.sources[v], s.primitive[v]); // the lowest one, and one that the most crossings have
    }
    EXPECT_GT(mixed, 50);
    EXPECT_GT(ties, 5);
}

// A level, and walls that exterior makes: the value is that of the closest point of all triangles.
TEST(SurfaceValues, WithoutCrossingsAreTheNearestTriangles) {
    vp::cpu_backend backend{2};
    host_mesh m = box(glm::vec3(0.3f, 0.3f, 0.3f), glm::vec3(0.62f, 0.7f, 0.66f));
    m.triangles.resize(m.triangles.size() - 3); // open
    for (int how = 0; how < 2; ++how) {
        vp::remesh_options o;
        if (how == 0) o.level = 0.07;
        if (how == 1) o.repair = vp::repair::exterior;
        const host_values s = remesh_with_values(backend, m, value_grid(18), o);
        ASSERT_TRUE(s.mesh.status.ok());
        const std::uint64_t nearest = s.mesh.status.surface.nearest_values;
        EXPECT_GT(nearest, 20u);
        EXPECT_EQ(nearest == s.at.size(), how == 0);
        std::uint64_t checked = 0;
        for (std::size_t v = 0; v < s.at.size(); ++v) {
            if (how == 1 && s.mesh.sources[v] != std::numeric_limits<std::uint32_t>::max()) continue;
            ++checked;
            ASSERT_NEAR(length_between(s.at[v], s.position(v)), distance_from(s.position(v), m), 4e-6) << how;
            ASSERT_LT(s.primitive[v], m.triangles.size());
            const glm::uvec3 t = m.triangles[s.primitive[v]];
            ASSERT_LT(distance_from(s.at[v], m.positions[t.x], m.positions[t.y], m.positions[t.z]), 4e-6);
        }
        EXPECT_EQ(checked, nearest);
    }
}

// Draws with shaders of their own, the second one a part of a larger mesh and drawn twice; the fragment's numbers.
TEST(SurfaceValues, FragmentsNameDrawInstanceAndTriangle) {
    struct numbers {
        VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
            const auto shift = static_cast<float>(v.draw) * 6.0f + static_cast<float>(v.instance) * 5.0f;
            return {v.position.x + shift, v.position.y, v.position.z};
        }
    };
    struct names {
        std::uint32_t mark;
        VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
            return vp::outputs(mark, f.draw, f.instance, f.triangle, f.primitive, f.normal);
        }
    };
    vp::cpu_backend backend{2};
    const host_mesh b = box(glm::vec3(1.2f, 1.3f, 1.4f), glm::vec3(4.7f, 4.6f, 4.5f));
    const vp::mesh<vp::cpu_backend> m{backend, b.positions, b.triangles};
    std::vector<std::uint32_t> in_whole;
    for (std::uint32_t i = 0; i < 12; ++i) in_whole.push_back(3 * i + 2);
    auto part = m.view(vp::instances{2});
    part.part.numbers = vp::array_view<const std::uint32_t>(in_whole);
    part.part.whole = 40;
    const std::vector<vp::draw<vp::mesh_view<>, numbers, names>> draws{{m.view(), {}, {77}}, {part, {}, {88}}};
    const vp::grid g = grid_of(glm::ivec3(18, 6, 6));
    vp::surface<vp::cpu_backend, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, glm::vec3>
        s(backend);
    for (const double level : {0.0, 0.4}) {
        const vp::status status = vp::remesh(backend, draws, g, s, {.level = level});
        ASSERT_TRUE(status.ok()) << status.message();
        const auto vertices = s.vertices.to_host(backend);
        const auto mark = vp::get<0>(s).to_host(backend), draw = vp::get<1>(s).to_host(backend),
                   instance = vp::get<2>(s).to_host(backend), triangle = vp::get<3>(s).to_host(backend),
                   primitive = vp::get<4>(s).to_host(backend), sources = s.sources.to_host(backend);
        const auto normal = vp::get<5>(s).to_host(backend);
        int faces = 0;
        for (std::size_t v = 0; v < vertices.size(); ++v) {
            const int cell = vertices[v].cell.x; // boxes: voxels 1 to 4, 7 to 10, 12 to 15
            const std::uint32_t d = cell < 5 ? 0 : 1, i = cell < 11 ? 0 : 1;
            EXPECT_EQ(draw[v], d);
            EXPECT_EQ(mark[v], d == 0 ? 77u : 88u);
            EXPECT_EQ(instance[v], i);
            EXPECT_LT(triangle[v], d == 0 ? 12u : 36u);
            EXPECT_TRUE(d == 0 || triangle[v] % 3 == 2);
            EXPECT_EQ(primitive[v], d == 0 ? triangle[v] : 12 + 40 * i + triangle[v]);
            EXPECT_TRUE(level != 0.0 || sources[v] <= primitive[v]);
            if (std::abs(normal[v].z) == 1.0f) ++faces;
        }
        EXPECT_GT(faces, 40);
    }
}

// Whichever way triangles face.
TEST(SurfaceValues, NormalsLookOutward) {
    struct normals {
        VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.normal); }
    };
    vp::cpu_backend backend{2};
    host_mesh b = ball(glm::vec3(0.5f), 0.31f, 3);
    for (std::size_t i = 0; i < b.triangles.size(); i += 2) {
        glm::uvec3& t = b.triangles[i];
        t = glm::uvec3(t.x, t.z, t.y);
    }
    const vp::mesh<vp::cpu_backend> m{backend, b.positions, b.triangles};
    for (const double level : {0.0, 0.06, -0.06}) {
        vp::surface<vp::cpu_backend, glm::vec3> s(backend);
        const vp::remesh_options o{.rule = vp::fill_rule::even_odd, .level = level};
        ASSERT_TRUE(vp::remesh(backend, m, value_grid(20), vp::passthrough{}, normals{}, s, o).ok());
        const auto vertices = s.vertices.to_host(backend);
        const auto n = vp::get<0>(s).to_host(backend);
        ASSERT_GT(n.size(), 200u);
        for (std::size_t v = 0; v < n.size(); ++v) {
            const glm::dvec3 p = vp::position(s.samples, vertices[v]);
            const double along = (p.x - 0.5) * n[v].x + (p.y - 0.5) * n[v].y + (p.z - 0.5) * n[v].z;
            ASSERT_GT(along, 0.95 * (0.31 + level) * 0.97) << level;
        }
    }
}

// Closed meshes that reach the grid's faces, in grids of every size.
TEST(SurfaceValues, ClosedMeshesHaveTheirOwnCrossingsInGridsOfAnySize) {
    vp::cpu_backend backend{2};
    const host_mesh m = ball(glm::vec3(0.0f), 1.0f, 3);
    const glm::dvec3 one(1.0);
    for (int n = 2; n <= 66; ++n) {
        const vp::grid g = vp::fit(vp::bounding_box{-one, one}, glm::ivec3(n));
        const host_values s = remesh_with_values(backend, m, g, {.place = vp::place::mean});
        ASSERT_EQ(s.mesh.status.surface.made_crossings, 0u) << n;
        ASSERT_EQ(s.mesh.status.surface.nearest_values, 0u) << n;
    }
}

// What a shader discards counts as no crossing.
TEST(SurfaceValues, DiscardedCrossingsDoNotCount) {
    vp::cpu_backend backend{2};
    const host_mesh m = ball(glm::vec3(0.5f), 0.37f, 2);
    const host_values all = remesh_with_values(backend, m, value_grid(19));
    const host_values some = remesh_with_values(backend, m, value_grid(19), {}, {1});
    ASSERT_TRUE(some.mesh.status.ok());
    EXPECT_EQ(all.mesh.vertices, some.mesh.vertices);
    EXPECT_EQ(all.mesh.triangles, some.mesh.triangles);
    std::uint64_t zeros = 0, nearest = 0;
    for (std::size_t v = 0; v < some.material.size(); ++v) {
        EXPECT_NE(some.material[v], 1u);
        const bool has_none = all.shares[v].y == 1.0f;
        nearest += has_none ? 1 : 0;
        EXPECT_TRUE(has_none || std::abs(some.shares[v].x * (1 - all.shares[v].y) - all.shares[v].x) < 1e-6f);
        if (some.shares[v] == glm::vec3(0.0f)) ++zeros; // the nearest triangle is discarded, too
    }
    EXPECT_EQ(some.mesh.status.surface.nearest_values, nearest);
    EXPECT_GT(zeros, 0u);
    EXPECT_LE(zeros, nearest);
}

TEST(SurfaceValues, AreTheSameForAnyNumberOfThreads) {
    for (int how = 0; how < 3; ++how) {
        vp::remesh_options o;
        if (how == 1) o.repair = vp::repair::exterior;
        if (how == 2) o.level = 0.05;
        vp::cpu_backend one{1};
        const host_values expected = remesh_with_values(one, bad_model(5), value_grid(24), o);
        ASSERT_TRUE(expected.mesh.status.ok());
        ASSERT_GT(expected.at.size(), 100u);
        for (unsigned threads = 2; threads <= 8; ++threads) {
            vp::cpu_backend backend{threads};
            EXPECT_TRUE(remesh_with_values(backend, bad_model(5), value_grid(24), o).has_same_arrays(expected))
                << threads;
        }
    }
}

// The mesh is that of a call without values, also where parts are left out of it.
TEST(SurfaceValues, LeaveTheMeshAsItIs) {
    vp::cpu_backend backend{2};
    host_mesh m = ball(glm::vec3(0.3f), 0.2f, 2);
    m.add(octahedron(glm::vec3(0.8f), 0.06f));
    const vp::remesh_options o{.place = vp::place::mean, .border = vp::border::open, .min_component = 40};
    const vp::grid whole = value_grid(30);
    const vp::grid g = whole.crop({4, 0, 0}, {26, 30, 30});
    const host_values s = remesh_with_values(backend, m, g, o);
    EXPECT_TRUE(s.mesh.has_same_arrays(remesh(backend, m, g, o)));
    EXPECT_EQ(s.mesh.status.surface.components_left_out, 1u);
    for (std::size_t v = 0; v < s.at.size(); ++v) ASSERT_LT(length_between(s.at[v], s.position(v)), 2e-6);
}

TEST(SurfaceValues, OfNothingAreEmpty) {
    vp::cpu_backend backend{1};
    const host_values s = remesh_with_values(backend, host_mesh{}, value_grid(8));
    EXPECT_TRUE(s.mesh.status.ok());
    EXPECT_TRUE(s.at.empty());
    const host_values level = remesh_with_values(backend, host_mesh{}, value_grid(8), {.level = 0.1});
    EXPECT_TRUE(level.mesh.status.ok());
    EXPECT_TRUE(level.at.empty());
}

} // namespace
