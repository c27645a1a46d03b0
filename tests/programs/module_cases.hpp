// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distances and cut cells of programs, on either backend: those of the meshes that the programs make.

#include <voxelpipe/cells/cell_programs.hpp>
#include <voxelpipe/programs/distance_programs.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace programs {

namespace vp = voxelpipe;

struct weight {
    float value;
};
// A varying that tells the vertices apart.
struct weighted {
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        return vp::vertex_output{v.position, weight{static_cast<float>(v.index)}};
    }
};
struct given_weight {
    VOXELPIPE_HD auto operator()(const vp::vertex<float>& v) const {
        return vp::vertex_output{v.position, weight{vp::get<0>(v)}};
    }
};

// A triangle, and of every second one a turned copy that is moved.
struct doubled {
    glm::vec3 by;
    VOXELPIPE_HD auto operator()(const vp::triangle<weight>& t) const {
        vp::triangles<2, weight> out;
        out.add(t.vertices[0], t.vertices[1], t.vertices[2]);
        if (t.number % 2 == 0) {
            vp::vertex_output<weight> moved[3];
            for (int k = 0; k < 3; ++k)
                moved[k] = {t.vertices[k].position + by, weight{t.vertices[k].varyings.value + 0.5f}};
            out.add(moved[0], moved[2], moved[1]);
        }
        return out;
    }
};
// Divides edges beyond a plane by four and others not, so that the lattice of a triangle between leaves some out.
// Points stay in their triangles.
struct divided {
    static constexpr int max_level = 4;
    float x;
    VOXELPIPE_HD int edge_level(const vp::vertex_output<weight>& a, const vp::vertex_output<weight>& b) const {
        return a.position.x + b.position.x < 2.0f * x ? 1 : 4;
    }
    VOXELPIPE_HD vp::vertex_output<weight> operator()(const vp::patch_point<weight>& p) const {
        return {p.position(), p.varyings()};
    }
};

// Eight faces around a point, closed.
struct octahedra {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    void add(const glm::vec3& at, float r) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (int a = 0; a < 3; ++a)
            for (const float side : {-r, r}) {
                glm::vec3 p = at;
                p[a] += side;
                positions.push_back(p);
            }
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            const glm::uvec3 t(first + (corner & 1u), first + 2 + (corner >> 1 & 1u), first + 4 + (corner >> 2 & 1u));
            const bool is_outward = ((corner & 1u) + (corner >> 1 & 1u) + (corner >> 2 & 1u)) % 2 == 1;
            triangles.push_back(is_outward ? t : glm::uvec3(t.x, t.z, t.y));
        }
    }
};

// Distance, numbers of the nearest triangle as the draw has them, and the varying at the closest point.
struct numbers_of_distance {
    template <class Varyings>
    VOXELPIPE_HD auto operator()(const vp::distance_fragment<Varyings>& f) const {
        return vp::outputs(f.distance,
                           f.in_band ? glm::uvec4(f.triangle, f.primitive, f.draw, f.instance) : glm::uvec4(~0u),
                           f.in_band ? f.varyings.value : -1.0f);
    }
};
template <class Backend>
using distance_targets =
    vp::framebuffer<Backend, vp::target<float, vp::blend::replace>, vp::target<glm::uvec4, vp::blend::replace>,
                    vp::target<float, vp::blend::replace>>;

// What `doubled` makes of a mesh, and the triangle that each one came of.
struct made {
    std::vector<glm::vec3> positions;
    std::vector<float> weights;
    std::vector<glm::uvec3> triangles;
    std::vector<std::uint32_t> origins;
};
inline made made_of(const octahedra& m, const doubled& program) {
    made all;
    for (std::uint32_t i = 0; i < m.triangles.size(); ++i)
        for (int copy = 0; copy < (i % 2 == 0 ? 2 : 1); ++copy) {
            const auto first = static_cast<std::uint32_t>(all.positions.size());
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t v = m.triangles[i][copy == 0 ? k : (3 - k) % 3];
                all.positions.push_back(copy == 0 ? m.positions[v] : m.positions[v] + program.by);
                all.weights.push_back(static_cast<float>(v) + (copy == 0 ? 0.0f : 0.5f));
            }
            all.triangles.emplace_back(first, first + 1, first + 2);
            all.origins.push_back(i);
        }
    return all;
}

// A body, and what `doubled` makes of it.
template <class Backend>
struct doubled_body {
    doubled program{{1.5f, 0.25f, 7.0f}};
    octahedra m;
    made expected;
    vp::grid g;
    vp::mesh<Backend> in;
    vp::mesh<Backend, float> out;

    explicit doubled_body(Backend& backend)
        : m([] {
              octahedra one;
              one.add({9.25f, 8.5f, 8.0f}, 5.75f);
              return one;
          }()),
          expected(made_of(m, program)), in(backend, m.positions, m.triangles),
          out(backend, expected.positions, expected.triangles, expected.weights) {
        g.extent = {20, 17, 22};
    }
};

template <class Backend>
void expect_distances_of_programs(Backend& backend) {
    const doubled_body<Backend> body(backend);
    const vp::grid& g = body.g;
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes})
        for (const vp::band& band : {vp::band(2.5), vp::band(vp::band::whole)}) {
            const vp::distance_options how{.band = band, .repair = repair};
            distance_targets<Backend> a{backend, g.extent}, b{backend, g.extent};
            const vp::status expected =
                vp::voxelize_distance(backend, body.out, g, given_weight{}, numbers_of_distance{}, a, how);
            const vp::status found = vp::voxelize_distance(backend, body.in, g, weighted{}, vp::geometry{body.program},
                                                           numbers_of_distance{}, b, how);
            ASSERT_TRUE(expected.ok() && found.ok()) << expected.message() << found.message();
            EXPECT_EQ(found.counts, expected.counts);
            EXPECT_EQ(found.solid, expected.solid);
            EXPECT_EQ(found.distance, expected.distance);
            EXPECT_EQ(found.counts.triangles_in, 12u);
            EXPECT_EQ(vp::get<0>(b).to_host(backend), vp::get<0>(a).to_host(backend));
            EXPECT_EQ(vp::get<2>(b).to_host(backend), vp::get<2>(a).to_host(backend));
            auto numbers = vp::get<1>(a).to_host(backend);
            for (glm::uvec4& n : numbers)
                if (n.y != ~0u) n.x = body.expected.origins[n.y];
            EXPECT_EQ(vp::get<1>(b).to_host(backend), numbers);
        }
}

// Triangles that a lattice leaves out lie nowhere. Points of the lattice are exact here, so the surface stays as it is.
template <class Backend>
void expect_distances_without_what_is_left_out(Backend& backend) {
    octahedra m;
    m.add({26, 26, 27}, 4);
    vp::grid g;
    g.extent = {32, 30, 32};
    const vp::mesh<Backend> mesh(backend, m.positions, m.triangles);
    {
        const vp::distance_options how{.band = vp::band::whole};
        distance_targets<Backend> a{backend, g.extent}, b{backend, g.extent};
        const vp::status expected = vp::voxelize_distance(backend, mesh, g, weighted{}, numbers_of_distance{}, a, how);
        const vp::status found = vp::voxelize_distance(backend, mesh, g, weighted{}, vp::tessellate{divided{26}},
                                                       numbers_of_distance{}, b, how);
        ASSERT_TRUE(expected.ok() && found.ok()) << expected.message() << found.message();
        EXPECT_EQ(found.counts.triangles_nonfinite, 0u);
        EXPECT_EQ(found.counts.triangles_in, found.counts.triangles_drawn);
        EXPECT_GT(found.counts.triangles_drawn, expected.counts.triangles_drawn);
        EXPECT_EQ(vp::get<0>(b).to_host(backend), vp::get<0>(a).to_host(backend));
    }
}

template <class Backend>
void expect_cells_of_programs(Backend& backend) {
    const doubled_body<Backend> body(backend);
    const vp::grid& g = body.g;
    vp::framebuffer<Backend, vp::target<float, vp::blend::replace>> a{backend, g.extent}, b{backend, g.extent};
    const vp::cell_options how{.repair = vp::repair::close_holes};
    const vp::status expected = vp::voxelize_cells(backend, body.out, g, given_weight{}, vp::fraction{}, a, how);
    const vp::status found =
        vp::voxelize_cells(backend, body.in, g, weighted{}, vp::geometry{body.program}, vp::fraction{}, b, how);
    ASSERT_TRUE(expected.ok() && found.ok()) << expected.message() << found.message();
    EXPECT_EQ(found.counts, expected.counts);
    EXPECT_EQ(found.cells, expected.cells);
    EXPECT_GT(found.cells.cut_voxels, 0u);
    EXPECT_EQ(vp::get<0>(b).to_host(backend), vp::get<0>(a).to_host(backend));
    // Parts of triangles have the fractions of the whole ones.
    octahedra whole;
    whole.add({9, 8, 8}, 4);
    const vp::mesh<Backend> mesh(backend, whole.positions, whole.triangles);
    const vp::status one = vp::voxelize_cells(backend, mesh, g, weighted{}, vp::fraction{}, a);
    const vp::status many =
        vp::voxelize_cells(backend, mesh, g, weighted{}, vp::tessellate{divided{9}}, vp::fraction{}, b);
    ASSERT_TRUE(one.ok() && many.ok()) << many.message();
    EXPECT_EQ(many.counts.triangles_outside, 0u);
    EXPECT_EQ(many.counts.triangles_in, many.counts.triangles_drawn);
    EXPECT_GT(many.counts.triangles_drawn, one.counts.triangles_drawn);
    EXPECT_EQ(vp::get<0>(b).to_host(backend), vp::get<0>(a).to_host(backend));
}

} // namespace programs
