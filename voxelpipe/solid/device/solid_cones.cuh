// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::close_holes and repair::winding: the snapped mesh goes to the host once, which finds the holes and their
// cones (solid/core/holes.hpp), and the cones come back as further triangles of each body; for repair::winding with a
// tree over the holes.

#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/core/winding_lids.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
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
    std::vector<device_buffer<core::winding_node>> nodes, holes;
    std::vector<device_buffer<core::snapped_position>> lids, corners;
    std::vector<device_buffer<core::winding_view>> trees; // repair::winding: one array, of the parts' trees
};

template <class T>
[[nodiscard]] std::vector<T> copy_to_host(const T* from, std::size_t count, cudaStream_t stream) {
    std::vector<T> host(count);
    if (count != 0) check(cudaMemcpyAsync(host.data(), from, count * sizeof(T), cudaMemcpyDefault, stream));
    return host;
}

// The cones of each body, found on the host. Waits. Throws std::bad_alloc, std::length_error, cuda_failure, or
// std::runtime_error with CUDA's text.
template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] std::vector<core::hole_cones> find_cones(const stream_memory& from,
                                                       std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                       const grid& g, const solid_options& options) {
    struct mesh_on_host {
        std::vector<core::snapped_position> positions;
        std::vector<glm::uvec3> triangles;
    };
    const core::snap_transform snap = core::make_snap_transform(g);
    std::vector<mesh_on_host> meshes(draws.size());
    for (std::size_t d = 0; d < draws.size() && options.cones == nullptr; ++d) { // cones that are given need no mesh
        const Mesh& mesh = draws[d].mesh;
        const device_buffer<core::snapped_position> exact(from, mesh.num_vertices());
        const device_buffer<int32_position> near(from, mesh.num_vertices());
        vertex_shade(mesh, draws[d].vertex_shader, snap, static_cast<std::uint32_t>(d),
                     {const_cast<core::snapped_position*>(exact.data()), const_cast<int32_position*>(near.data())},
                     static_cast<no_varyings*>(nullptr), from.stream);
        meshes[d] = {copy_to_host(exact.data(), exact.size(), from.stream),
                     copy_to_host(mesh.triangles.data(), mesh.triangles.size(), from.stream)};
    }
    check(cudaStreamSynchronize(from.stream), stage::vertex_shade);

    std::vector<core::hole_cones> found;
    const bool is_split = options.bodies == bodies::draw;
    for (std::size_t first = 0; first < draws.size();) {
        const std::size_t last = is_split ? first + 1 : draws.size();
        std::vector<core::hole_part> body;
        for (std::size_t d = first; d < last; ++d)
            body.push_back({meshes[d].positions.data(),
                            meshes[d].positions.size(),
                            {meshes[d].triangles.data(), static_cast<std::uint32_t>(meshes[d].triangles.size()),
                             static_cast<std::uint32_t>(draws[d].mesh.positions.size())},
                            draws[d].mesh.num_triangles()});
        found.push_back(options.cones != nullptr ? core::moved(options.cones[found.size()], snap.offset)
                                                 : core::close_holes(body, options.max_hole_edges));
        first = last;
    }
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
                cones, core::make_distance_scale(g.voxel_size, core::make_snap_transform(g).fraction));
            using nodes_view = array_view<const core::winding_node>;
            auto& nodes = made.nodes.emplace_back(from, nodes_view(tree.nodes().data(), tree.nodes().size()));
            auto& holes = made.holes.emplace_back(from, nodes_view(tree.holes().data(), tree.holes().size()));
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
