// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// --remesh on a backend: the mesh of a request. Instantiated for cpu_backend in remesher.cpp and for cuda_backend by
// cuda_pipeline.cuh.

#include "draw/solid_options.hpp"
#include "draw/surface.hpp"
#include "draw/uploaded_scene.hpp"
#include "draw/voxelizer.hpp"
#include "model/surface_mesh.hpp"

#include <voxelpipe/surfaces/remesh.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

// What --remesh makes of the model where its surface crosses an edge of the grid: the colour, filtered over a voxel as
// in the tool's voxels, and the normal.
struct remesh_shader {
    surface_fragment_shader surface;

    // Linear colour times its weight, and the weight; the normal, which looks outward. What a mask cuts off, or is
    // invisible, weighs next to nothing: a vertex at nothing else has its colour.
    VOXELPIPE_HD auto operator()(const vp::fragment<surface_varyings>& f) const {
        glm::vec4 color(1.0F);
        if (surface.wanted.linear_color) color = surface.shade(f, f.varyings);
        float weight = color.a;
        if (surface.alpha == alpha_mode::mask && surface.is_cut_off(f.varyings)) weight = 0.0F;
        weight = weight > surface_fragment_shader::least_weight ? weight : surface_fragment_shader::least_weight;
        for (int i = 0; i < 3; ++i) color[i] = vp::exact::mul(color[i], weight);
        color.a = weight;
        return vp::outputs(color, f.normal);
    }
};

// The colour of a vertex: a mean of shaded colours.
[[nodiscard]] inline glm::vec3 resolved_color(const glm::vec4& mean) {
    glm::vec3 color(0.0F);
    for (int i = 0; i < 3 && mean.a > 0.0F; ++i) color[i] = vp::exact::div(mean[i], mean.a);
    return color;
}

// The unit normal of a vertex from a mean of normals; 0 where they cancel each other.
[[nodiscard]] inline glm::vec3 resolved_normal(const glm::vec3& mean) {
    const double x = vp::exact::to_double(mean.x), y = vp::exact::to_double(mean.y), z = vp::exact::to_double(mean.z);
    const double square = vp::exact::fma(z, z, vp::exact::fma(y, y, vp::exact::mul(x, x)));
    if (!(square > 1e-12)) return glm::vec3(0.0F);
    const double length = vp::exact::sqrt(square);
    return {vp::exact::to_float(vp::exact::div(x, length)), vp::exact::to_float(vp::exact::div(y, length)),
            vp::exact::to_float(vp::exact::div(z, length))};
}

[[nodiscard]] inline vp::remesh_options remesh_options_of(const remesh_request& request) {
    const vp::solid_options solid = solid_options_of(request.sign);
    vp::remesh_options options;
    options.place = request.place;
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    options.level = request.level;
    options.quads = request.quads;
    options.embedded = request.embedded;
    return options;
}

// True if the model says anything about colours.
[[nodiscard]] inline bool has_colors(const scene& model) {
    const auto is_colored = [](const material& m) {
        return m.texture != material::no_texture || m.base_color != glm::vec4(1.0F);
    };
    return std::any_of(model.materials.begin(), model.materials.end(), is_colored) ||
           std::any_of(model.primitives.begin(), model.primitives.end(),
                       [](const primitive& p) { return !p.colors.empty(); });
}

// The normals of vertices whose crossings have opposite ones: of their faces.
inline void fill_normals(surface_mesh& mesh) {
    const auto is_missing = [&](std::uint32_t v) { return mesh.normals[v] == glm::vec3(0.0F); };
    using vector = vp::core::triple<double>;
    std::map<std::uint32_t, vector> sums;
    for (std::uint32_t v = 0; v < mesh.normals.size(); ++v)
        if (is_missing(v)) sums.emplace(v, vector{});
    if (sums.empty()) return;
    const auto edge = [&](std::uint32_t from, std::uint32_t to) {
        vector e{};
        for (int a = 0; a < 3; ++a) {
            const auto units = [&](std::uint32_t v) {
                return 65536.0 * mesh.vertices[v].cell[a] + mesh.vertices[v].q[a];
            };
            e[a] = vp::exact::mul(units(to) - units(from), mesh.voxel_size[static_cast<std::size_t>(a)]);
        }
        return e;
    };
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (!is_missing(a) && !is_missing(b) && !is_missing(c)) return;
        const vector normal = vp::core::cross_product(edge(a, b), edge(a, c));
        for (const std::uint32_t v : {a, b, c})
            if (const auto sum = sums.find(v); sum != sums.end())
                for (int k = 0; k < 3; ++k) sum->second[k] += normal[k];
    };
    for (const glm::uvec3& t : mesh.triangles) add(t.x, t.y, t.z);
    for (const glm::uvec4& q : mesh.quads) {
        add(q.x, q.y, q.z);
        add(q.x, q.z, q.w);
    }
    for (const auto& [v, sum] : sums) {
        const double length = std::max({std::abs(sum[0]), std::abs(sum[1]), std::abs(sum[2])});
        mesh.normals[v] = glm::vec3(0, 0, 1); // of a vertex whose faces cancel each other
        if (length > 0)
            mesh.normals[v] = resolved_normal({static_cast<float>(sum[0] / length), static_cast<float>(sum[1] / length),
                                               static_cast<float>(sum[2] / length)});
    }
}

// The mesh that the request asks for. Adds the counts and the time. Throws std::bad_alloc, and std::runtime_error for
// what the library refuses.
template <class Backend>
surface_mesh remesh_scene(Backend& on, scene& model, const voxelize_request& request, voxelize_stats& stats) {
    const auto start = std::chrono::steady_clock::now();
    wanted_targets wanted;
    wanted[static_cast<std::size_t>(target::color)] = request.wants(target::color) && has_colors(model);
    const bool is_colored = wanted.any();
    const uploaded_scene<Backend> uploaded(on, model, request, wanted, false);
    using draw = vp::draw<vp::mesh_view<>, surface_vertex_shader, remesh_shader>;
    std::vector<draw> draws;
    for (const auto& d : uploaded.draws()) draws.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
    vp::surface<Backend, glm::vec4, glm::vec3> made(on);
    const vp::status status = vp::remesh(on, draws, uploaded.relative_grid(), made, remesh_options_of(*request.remesh));
    if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
    status.or_throw();
    surface_mesh result;
    for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<glm::length_t>(a);
        result.extent[a] = request.grid.extent[axis];
        result.origin[a] = request.grid.part_origin()[axis];
        result.voxel_size[a] = request.grid.voxel_size[axis];
    }
    result.vertices = made.vertices.to_host(on);
    result.triangles = made.triangles.to_host(on);
    result.quads = made.quads.to_host(on);
    result.sources = made.sources.to_host(on);
    for (const glm::vec3& mean : vp::get<1>(made).to_host(on)) result.normals.push_back(resolved_normal(mean));
    if (is_colored)
        for (const glm::vec4& mean : vp::get<0>(made).to_host(on)) result.colors.push_back(resolved_color(mean));
    fill_normals(result);
    result.counts = status.surface;
    stats.triangles_dropped = status.counts.triangles_dropped();
    stats.triangles_drawn = status.counts.triangles_drawn;
    solid_counts& counts = stats.solid.emplace();
    counts.rows = static_cast<std::uint64_t>(request.grid.extent.y) * static_cast<std::uint64_t>(request.grid.extent.z);
    counts.open_rows = status.solid.open_rows;
    counts.crossings = status.solid.crossings;
    counts.max_winding = status.solid.max_winding;
    counts.hole_edges = status.solid.hole_edges;
    counts.holes = status.solid.holes;
    counts.closed_holes = status.solid.cones;
    if (std::string warning = open_warning(request.remesh->sign, counts); !warning.empty())
        stats.warnings.push_back("the sign of --remesh: " + warning);
    if (result.vertices.empty())
        stats.warnings.push_back("nothing lies inside of the model on this grid: the mesh is empty. Sheets and open "
                                 "meshes enclose nothing; --close-holes, --solid exterior and --iso D above 0 help");
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    stats.milliseconds.emplace_back("remesh", time.count());
    return result;
}

} // namespace voxelize
