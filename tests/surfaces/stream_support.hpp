// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces of streams, and of what one call draws, on any backend.

#include "slab_support.hpp"

#include <voxelpipe/slabs/stream_surface.hpp>

#include <algorithm>
#include <type_traits>

namespace surface_tests {

// What `Options` of a call draw: a solid's bits, or distances.
template <class Options>
using drawn_by = std::conditional_t<std::is_same_v<Options, vp::solid_options>, vp::bit, float>;

// extract of one call with the whole mesh.
template <class Backend, class Options>
[[nodiscard]] host_surface extract_drawn(Backend& backend, const host_mesh& mesh, const vp::grid& g,
                                         const vp::extract_options& o, const Options& how) {
    const vp::mesh<Backend> m{backend, mesh.positions, mesh.triangles};
    vp::framebuffer<Backend, vp::target<drawn_by<Options>, vp::blend::replace>> all(backend, g.extent);
    vp::status drawn;
    if constexpr (std::is_same_v<Options, vp::solid_options>)
        drawn = vp::voxelize_solid(backend, m, g, vp::passthrough{}, vp::constant(true), all, how);
    else
        drawn = vp::voxelize_distance(backend, m, g, vp::passthrough{}, vp::distance{}, all, how);
    vp::surface<Backend> s(backend);
    const vp::status made = vp::extract(backend, all, g, s, o);
    host_surface whole = to_host(backend, s, drawn.ok() ? made : drawn);
    whole.status.counts = drawn.counts;
    whole.status.solid = drawn.solid;
    return whole;
}

// The pieces of a stream, one after the other.
struct streamed_surface {
    host_surface surface;
    int pieces = 0;
};

// The mesh in chunks of 50 triangles.
template <class Backend, class Options>
[[nodiscard]] streamed_surface stream_surface(Backend& backend, const host_mesh& mesh, const vp::grid& g,
                                              const vp::extract_options& o, const Options& how,
                                              vp::slabs::stream_options cut, int axis = 2) {
    constexpr bool is_solid = std::is_same_v<Options, vp::solid_options>;
    cut.repair = how.repair;
    cut.is_solid = is_solid;
    if constexpr (!is_solid) cut.band = how.band;
    vp::slabs::stream stream(backend, g, vp::passthrough{}, cut);
    if (axis != 2) stream.cut_into(vp::slabs::equal_layers(g, axis, cut.num_slabs));
    for (std::size_t first = 0; first < mesh.triangles.size(); first += 50) {
        const std::size_t count = std::min<std::size_t>(50, mesh.triangles.size() - first);
        stream.add({mesh.positions, {mesh.triangles.data() + first, count}}).or_throw();
    }
    streamed_surface found;
    found.surface.samples = g;
    const auto sink = [&](const vp::surface_slab& slab, const vp::surface<Backend>& piece) {
        EXPECT_EQ(slab.first_vertex, found.surface.vertices.size());
        EXPECT_EQ(piece.samples, g);
        append(found.surface, to_host(backend, piece, vp::status{}));
        ++found.pieces;
    };
    vp::status s;
    if constexpr (is_solid)
        s = vp::slabs::extract_solid(stream, sink, o, how);
    else
        s = vp::slabs::extract_distance(stream, sink, o, how);
    found.surface.status = s;
    return found;
}

} // namespace surface_tests
