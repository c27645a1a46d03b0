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

#include <voxelpipe/surfaces/remesh_slab.hpp>
#include <voxelpipe/surfaces/remesh_sparse.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <new>
#include <optional>
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
                const vp::surface_vertex at = mesh.vertices[v];
                return 65536.0 * at.cell[a] + at.q[a];
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
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const glm::uvec3 t = mesh.triangles[i];
        add(t.x, t.y, t.z);
    }
    for (std::size_t i = 0; i < mesh.quads.size(); ++i) {
        const glm::uvec4 q = mesh.quads[i];
        add(q.x, q.y, q.z);
        add(q.x, q.z, q.w);
    }
    for (const auto& [v, sum] : sums) {
        const double length = std::max({std::abs(sum[0]), std::abs(sum[1]), std::abs(sum[2])});
        glm::vec3 normal(0, 0, 1); // of a vertex whose faces cancel each other
        if (length > 0)
            normal = resolved_normal({static_cast<float>(sum[0] / length), static_cast<float>(sum[1] / length),
                                      static_cast<float>(sum[2] / length)});
        mesh.normals.set(v, normal);
    }
}

// A mesh's components: vertices that faces join. Holds four bytes a vertex.
[[nodiscard]] inline std::uint64_t count_components(const surface_mesh& mesh) {
    std::vector<std::uint32_t> above(mesh.vertices.size());
    for (std::size_t v = 0; v < above.size(); ++v) above[v] = static_cast<std::uint32_t>(v);
    std::uint64_t components = above.size();
    const auto top = [&above](std::uint32_t v) {
        for (; above[v] != v; v = above[v]) above[v] = above[above[v]];
        return v;
    };
    const surface_shape shape(mesh);
    for (std::size_t f = 0; f < shape.faces(); ++f) {
        const surface_shape::index_list face = shape.face(f);
        for (std::size_t k = 1; k < shape.corners(); ++k) {
            const std::uint32_t a = top(face[0]), b = top(face[k]);
            if (a == b) continue;
            above[b] = a;
            --components;
        }
    }
    return components;
}

// Makes the mesh that a request asks for. Refers to the model and the request. Throws std::bad_alloc, and
// std::runtime_error for what the library refuses.
template <class Backend>
class scene_remesher {
public:
    scene_remesher(Backend& on, scene& model, const voxelize_request& request)
        : on_{on}, request_{request}, options_{remesh_options_of(*request.remesh)},
          start_{std::chrono::steady_clock::now()} {
        wanted_targets wanted;
        wanted[static_cast<std::size_t>(target::color)] = request.wants(target::color) && has_colors(model);
        is_colored_ = wanted.any();
        uploaded_.emplace(on, model, request, wanted, false);
        for (const auto& d : uploaded_->draws()) draws_.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
    }

    // At once. in_bricks: its samples lie in bricks, which changes nothing of it. Adds the counts and the time.
    [[nodiscard]] surface_mesh whole(bool in_bricks, voxelize_stats& stats) {
        made_type made(on_);
        const vp::status status = in_bricks ? vp::remesh_sparse(on_, draws_, uploaded_->relative_grid(), made, options_)
                                            : vp::remesh(on_, draws_, uploaded_->relative_grid(), made, options_);
        if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
        status.or_throw();
        surface_mesh result = empty_mesh();
        append(made, result);
        result.counts = status.surface;
        stats.triangles_drawn = status.counts.triangles_drawn;
        finish(result, status.counts, status.solid, stats);
        return result;
    }

    // A slab of the grid after the other, of `layers` or, where memory does not do, fewer, with the arrays in temporary
    // files in `folder`: the same mesh, and the same counts.
    [[nodiscard]] surface_mesh in_slabs(int layers, const std::filesystem::path& folder, voxelize_stats& stats) {
        surface_mesh result = empty_mesh();
        result.vertices = surface_list<vp::surface_vertex>(folder);
        result.triangles = surface_list<glm::uvec3>(folder);
        result.quads = surface_list<glm::uvec4>(folder);
        result.sources = surface_list<std::uint32_t>(folder);
        result.normals = surface_list<glm::vec3>(folder);
        if (is_colored_) result.colors = surface_list<glm::vec3>(folder);
        vp::counters counts;
        vp::solid_counters solid;
        vp::surface_slab slab;
        stats.slabs = 0;
        for (const int end = request_.grid.extent.z; slab.first < end;) {
            slab.layers = std::min(layers, end - slab.first);
            made_type made(on_);
            vp::status status = count_rows(slab, solid);
            if (status.ok()) status = vp::remesh_slab(on_, draws_, uploaded_->relative_grid(), slab, made, options_);
            if (status.code == vp::status_code::out_of_memory && layers > 1) {
                layers = (slab.layers + 1) / 2;
                continue;
            }
            if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
            status.or_throw();
            append(made, result);
            vp::surface_counters& sum = result.counts;
            sum.vertices += status.surface.vertices;
            sum.faces += status.surface.faces;
            sum.made_crossings += status.surface.made_crossings;
            sum.cone_crossings += status.surface.cone_crossings;
            sum.nearest_values += status.surface.nearest_values;
            counts = status.counts;
            stats.triangles_drawn += status.counts.triangles_drawn;
            ++stats.slabs;
            slab.first += slab.layers;
            slab.first_vertex += status.surface.vertices;
        }
        draws_.clear();
        uploaded_.reset();
        result.counts.components = count_components(result);
        finish(result, counts, solid, stats);
        return result;
    }

private:
    using draw = vp::draw<vp::mesh_view<>, surface_vertex_shader, remesh_shader>;
    using made_type = vp::surface<Backend, glm::vec4, glm::vec3>;

    [[nodiscard]] surface_mesh empty_mesh() const {
        surface_mesh mesh;
        for (std::size_t a = 0; a < 3; ++a) {
            const auto axis = static_cast<glm::length_t>(a);
            mesh.extent[a] = request_.grid.extent[axis];
            mesh.origin[a] = request_.grid.part_origin()[axis];
            mesh.voxel_size[a] = request_.grid.voxel_size[axis];
        }
        return mesh;
    }
    void append(const made_type& made, surface_mesh& to) const {
        to.vertices.append(made.vertices.to_host(on_));
        to.triangles.append(made.triangles.to_host(on_));
        to.quads.append(made.quads.to_host(on_));
        to.sources.append(made.sources.to_host(on_));
        std::vector<glm::vec3> values;
        for (const glm::vec3& mean : vp::get<1>(made).to_host(on_)) values.push_back(resolved_normal(mean));
        to.normals.append(values);
        if (!is_colored_) return;
        values.clear();
        for (const glm::vec4& mean : vp::get<0>(made).to_host(on_)) values.push_back(resolved_color(mean));
        to.colors.append(values);
    }
    // Adds what a solid counts of the slab's own rows; remesh_slab has those of its neighbours', too.
    [[nodiscard]] vp::status count_rows(const vp::surface_slab& slab, vp::solid_counters& all) {
        const vp::grid whole = uploaded_->relative_grid();
        const vp::grid part = whole.crop({0, 0, slab.first}, {whole.extent.x, whole.extent.y, slab.layers});
        using bits_draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, decltype(vp::constant(true))>;
        std::vector<bits_draw> draws;
        for (const auto& d : uploaded_->bits_draws()) draws.push_back({d.mesh, d.vertex_shader, vp::constant(true)});
        vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::replace>> bits(on_, part.extent);
        const vp::status status = vp::voxelize_solid(on_, draws, part, bits, vp::core::sign_options(options_));
        if (!status.ok()) return status;
        all.open_rows += status.solid.open_rows;
        all.crossings += status.solid.crossings;
        all.max_winding = std::max(all.max_winding, status.solid.max_winding);
        all.hole_edges = status.solid.hole_edges;
        all.holes = status.solid.holes;
        all.cones = status.solid.cones;
        return status;
    }
    void finish(surface_mesh& mesh, const vp::counters& triangles, const vp::solid_counters& solid,
                voxelize_stats& stats) const {
        fill_normals(mesh);
        mesh.vertices.finish();
        mesh.triangles.finish();
        mesh.quads.finish();
        mesh.sources.finish();
        mesh.normals.finish();
        mesh.colors.finish();
        stats.triangles_dropped = triangles.triangles_dropped();
        solid_counts& counts = stats.solid.emplace();
        const glm::ivec3 extent = request_.grid.extent;
        counts.rows = static_cast<std::uint64_t>(extent.y) * static_cast<std::uint64_t>(extent.z);
        counts.open_rows = solid.open_rows;
        counts.crossings = solid.crossings;
        counts.max_winding = solid.max_winding;
        counts.hole_edges = solid.hole_edges;
        counts.holes = solid.holes;
        counts.closed_holes = solid.cones;
        if (std::string warning = open_warning(request_.remesh->sign, counts); !warning.empty())
            stats.warnings.push_back("the sign of --remesh: " + warning);
        if (mesh.vertices.empty())
            stats.warnings.push_back("nothing lies inside of the model on this grid: the mesh is empty. Sheets and "
                                     "open meshes enclose nothing; --close-holes, --solid exterior and --iso D above 0 "
                                     "help");
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start_;
        stats.milliseconds.emplace_back("remesh", time.count());
    }

    Backend& on_;
    const voxelize_request& request_;
    vp::remesh_options options_;
    std::chrono::steady_clock::time_point start_;
    bool is_colored_ = false;
    std::optional<uploaded_scene<Backend>> uploaded_;
    std::vector<draw> draws_;
};

// The whole mesh, as scene_remesher::whole makes it. Adds the counts and the time.
template <class Backend>
surface_mesh remesh_scene(Backend& on, scene& model, const voxelize_request& request, bool in_bricks,
                          voxelize_stats& stats) {
    return scene_remesher<Backend>(on, model, request).whole(in_bricks, stats);
}

} // namespace voxelize
