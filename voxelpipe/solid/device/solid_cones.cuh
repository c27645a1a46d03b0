// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::close_holes and repair::winding: the boundary of each body's snapped mesh is found on the device
// (solid/passes/find_boundary.hpp) and goes to the host, which makes the cones (solid/core/holes.hpp); these come back
// as further triangles of the body, for repair::winding with a tree over the holes.

#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/call/backend_passes.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/core/winding_lids.hpp>
#include <voxelpipe/solid/passes/find_boundary.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
#include <thread>
#include <vector>

namespace voxelpipe::device {

// Triangles that close the holes of a body, after snapping.
struct cone_part {
    draw_geometry geometry; // first_primitive is unset
    std::uint32_t num_triangles = 0;
    core::winding_view tree{}; // repair::winding: of the same holes
};

// The cones of a call, and their memory.
struct solid_cones {
    // One for each body, in order; empty without repair.
    std::vector<cone_part> parts;
    std::uint64_t num_triangles = 0;
    solid_counters counts; // of the holes

    std::vector<device_buffer<core::snapped_position>> positions;
    std::vector<device_buffer<int32_position>> near;
    std::vector<device_buffer<glm::uvec3>> triangles;
    std::vector<device_buffer<core::winding_node>> nodes;
    std::vector<device_buffer<core::winding_hole>> holes;
    std::vector<device_buffer<core::snapped_position>> lids, corners;
    std::vector<device_buffer<core::winding_view>> trees; // repair::winding: one array, of the parts' trees
};

// The boundary of draws that are one body. Waits. Throws as find_cones().
template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] core::hole_boundary find_boundary_of(const stream_memory& from,
                                                   std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                   std::size_t first_draw, const core::snap_transform& snap) {
    std::uint64_t num_vertices = 0;
    for (const auto& d : draws) num_vertices += d.mesh.num_vertices();
    device_buffer<core::snapped_position> exact(from, num_vertices);
    std::vector<core::passes::body_triangles> parts;
    {
        device_buffer<int32_position> near(from, num_vertices);
        std::uint64_t first = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const Mesh& mesh = draws[d].mesh;
            vertex_shade(mesh, draws[d].vertex_shader, snap, static_cast<std::uint32_t>(first_draw + d),
                         {exact.data() + first, near.data() + first}, static_cast<no_varyings*>(nullptr), from.stream);
            parts.push_back({core::triangles_of(mesh), static_cast<std::uint32_t>(mesh.num_triangles()),
                             static_cast<std::uint32_t>(mesh.num_vertices()), 0, static_cast<std::uint32_t>(first)});
            first += mesh.num_vertices();
        }
    }
    backend_passes passes(from.stream, from.resource);
    return core::find_boundary(passes, exact.data(), num_vertices,
                               std::span<const core::passes::body_triangles>(parts));
}

// The cones of each body: its boundary is found on the device, and closed on the host. Waits. Throws std::bad_alloc,
// std::length_error, cuda_failure, or std::runtime_error with CUDA's text.
template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] std::vector<core::hole_cones> find_cones(const stream_memory& from,
                                                       std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                       const grid& g, const solid_options& options) {
    const core::snap_transform snap = core::make_snap_transform(g);
    std::vector<core::hole_cones> found;
    const std::size_t each = options.bodies == bodies::draw ? 1 : draws.size();
    for (std::size_t first = 0; first < draws.size(); first += each)
        found.push_back(options.cones != nullptr // cones that are given need no mesh
                            ? core::moved(options.cones[found.size()], snap.offset)
                            : core::close_boundary(find_boundary_of(from, draws.subspan(first, each), first, snap),
                                                   options.max_hole_edges));
    return found;
}

// Waits. Throws as find_cones().
template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] solid_cones make_cones(const stream_memory& from,
                                     std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                     const solid_options& options) {
    solid_cones made;
    for (const core::hole_cones& cones : find_cones(from, draws, g, options)) {
        made.counts.hole_edges += cones.edges;
        made.counts.holes += cones.holes;
        made.counts.cones += cones.cones;
        std::vector<int32_position> near;
        near.reserve(cones.positions.size());
        for (const core::snapped_position& p : cones.positions) near.push_back(int32_position::of(p));
        using positions_view = array_view<const core::snapped_position>;
        auto& exact_memory =
            made.positions.emplace_back(from, positions_view(cones.positions.data(), cones.positions.size()));
        auto& near_memory = made.near.emplace_back(from, array_view<const int32_position>(near.data(), near.size()));
        auto& triangle_memory = made.triangles.emplace_back(
            from, array_view<const glm::uvec3>(cones.triangles.data(), cones.triangles.size()));
        cone_part part;
        const auto num_vertices = static_cast<std::uint32_t>(cones.positions.size());
        part.num_triangles = static_cast<std::uint32_t>(cones.triangles.size());
        part.geometry = {{triangle_memory.data(), part.num_triangles, num_vertices},
                         {exact_memory.data(), near_memory.data()},
                         0,
                         num_vertices};
        if (options.repair == repair::winding) {
            const core::winding_tree tree(
                cones, core::make_distance_scale(g.voxel_size, core::make_snap_transform(g).fraction),
                std::thread::hardware_concurrency());
            auto& nodes = made.nodes.emplace_back(
                from, array_view<const core::winding_node>(tree.nodes().data(), tree.nodes().size()));
            auto& holes = made.holes.emplace_back(
                from, array_view<const core::winding_hole>(tree.holes().data(), tree.holes().size()));
            auto& lids = made.lids.emplace_back(from, positions_view(tree.lids().data(), tree.lids().size()));
            auto& corners =
                made.corners.emplace_back(from, positions_view(tree.corners().data(), tree.corners().size()));
            part.tree = tree.view(nodes.data(), lids.data(), holes.data(), corners.data());
        }
        made.parts.push_back(part);
        made.num_triangles += cones.triangles.size();
    }
    if (options.repair == repair::winding) {
        std::vector<core::winding_view> trees;
        for (const cone_part& part : made.parts) trees.push_back(part.tree);
        made.trees.emplace_back(from, array_view<const core::winding_view>(trees.data(), trees.size()));
    }
    return made;
}

// Runs a call, run(cones), and adds what was found of the holes to its status. The cones are there until it returns.
template <class Mesh, class VertexShader, class SolidShader, class Run>
[[nodiscard]] status with_cones(const stream_memory& from, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                const grid& g, const solid_options& options, std::uint64_t triangles_in,
                                const Run& run) {
    solid_cones cones;
    if (core::has_cones(options.repair)) {
        status failed;
        failed.counts.triangles_in = triangles_in;
        failed.where = stage::coarse_raster;
        try {
            cones = make_cones(from, draws, g, options);
        } catch (const cuda_failure& e) {
            failed = to_status(e);
        } catch (const std::bad_alloc&) {
            failed.code = status_code::out_of_memory;
        } catch (const std::length_error&) {
            failed.code = status_code::too_many_triangles;
        } catch (const std::runtime_error&) { // a CUDA error of a buffer
            failed.code = status_code::device_error;
        }
        if (failed.ok() && triangles_in + cones.num_triangles > std::numeric_limits<std::uint32_t>::max())
            failed.code = status_code::too_many_triangles;
        if (!failed.ok()) return failed;
    }
    status s = run(cones);
    if (s.ok()) {
        s.solid.hole_edges = cones.counts.hole_edges;
        s.solid.holes = cones.counts.holes;
        s.solid.cones = cones.counts.cones;
    }
    return s;
}

} // namespace voxelpipe::device
