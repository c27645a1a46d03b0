// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces that extract (extract.hpp) and remesh (remesh.hpp) make: closed manifold meshes (docs/design.md,
// "Surfaces"), their options, and where their vertices lie in the world.

#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// Where vertices lie in their cells. The faces are the same ones for all three, but for the diagonals of quads.
enum class place : std::uint8_t {
    corner, // in the middle of the cell, which for samples at voxels' centres is a corner of voxels
    mean,   // at the mean of the sheet's crossings
    sharp,  // where the planes of the sheet's crossings meet: keeps creases and corners. Without normals, as mean
};

// What happens at the faces of the grid.
enum class border : std::uint8_t {
    closed, // samples beyond the grid are outside, so that every surface is closed
    open,   // faces of which a cell reaches beyond the grid are left out: the surface has a boundary there
};

// Written {.place = place::corner, .quads = true}.
struct extract_options {
    voxelpipe::place place = voxelpipe::place::mean;      // where vertices lie
    double level = 0.0;                                   // of a field, world units: what is below it is inside; finite
    voxelpipe::border border = voxelpipe::border::closed; // at the faces of the grid
    bool quads = false;                                   // quads in place of triangles
    std::uint32_t min_component = 0;                      // components of fewer vertices are left out
    // Vertices of triangles that intersect each other are moved to the mean of their crossings, as place::mean has
    // them, in rounds, until no two intersect or all that do are there: surface_counters::intersecting_pairs says how
    // many are left. Quads count as the triangles that they would be cut into; parts that are left out count too.
    bool embedded = false;
};

// A vertex: its cell, and its place there. No two vertices of different cells coincide.
struct surface_vertex {
    glm::ivec3 cell;     // the cell's lowest sample, counted as voxels of the grid; -1 beyond its lower faces
    std::uint16_t q[3];  // from that sample, in units of 2^-16 of the samples' spacing; 1 to 65535
    std::uint16_t sheet; // number of the sheet in the cell, 0 to 3
    friend bool operator==(const surface_vertex&, const surface_vertex&) = default;
};

// Position of a vertex in the world; `samples` is the grid that the surface was made on. In double, vertices of
// different cells differ.
[[nodiscard]] VOXELPIPE_HD inline glm::dvec3 position(const grid& samples, const surface_vertex& v) {
    constexpr double unit = 1.0 / 65536;
    return samples.to_world(
        {v.cell.x + 0.5 + v.q[0] * unit, v.cell.y + 0.5 + v.q[1] * unit, v.cell.z + 0.5 + v.q[2] * unit});
}

// surface<Backend> is a mesh; surface<Backend, Values...> has one value of each type a vertex besides, which remesh
// gets from fragment shaders: floats and glm::vec2 to vec4, which are means, and integers, of which the majority
// counts.
template <class Backend, class... Values>
struct surface;

// A surface, in a backend's memory. Indices are counter-clockwise seen from outside. Vertices are ordered by cell (z,
// then y, then x), then sheet; faces by the lower sample of the edge that they cross, then its axis. The first index of
// a quad is that of its lowest cell; triangles 2 i and 2 i + 1 are quad i.
template <class Backend>
struct surface<Backend> {
    // Memory of the backend.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    grid samples;                    // whose voxels' centres the samples are
    buffer<surface_vertex> vertices; // each is used by a face
    buffer<glm::uvec3> triangles;    // empty with `quads`
    buffer<glm::uvec4> quads;        // empty without
    buffer<std::uint32_t> sources;   // of remesh: a primitive that a vertex comes from, the lowest one; 2^32 - 1: none

    // Empty.
    explicit surface(Backend& backend)
        : vertices(backend, 0), triangles(backend, 0), quads(backend, 0), sources(backend, 0) {}
};

// The same with values of its vertices, one array for each result of the fragment shaders: get<I>(surface).
template <class Backend, class First, class... Others>
struct surface<Backend, First, Others...> : surface<Backend> {
    core::pack<typename Backend::template buffer<First>, typename Backend::template buffer<Others>...> values;

    // Empty.
    explicit surface(Backend& backend)
        : surface<Backend>(backend), values{core::make_pack(typename Backend::template buffer<First>(backend, 0),
                                                            typename Backend::template buffer<Others>(backend, 0)...)} {
    }
};

// Values I of the vertices, in their order.
template <std::size_t I, class Backend, class First, class... Others>
[[nodiscard]] const auto& get(const surface<Backend, First, Others...>& s) {
    return get<I>(s.values);
}

namespace core {

[[nodiscard]] inline status validate(const extract_options& o) {
    const bool known = o.place <= place::sharp && o.border <= border::open;
    return known && o.level - o.level == 0.0 ? status{} : failure(status_code::bad_surface_options);
}

} // namespace core
} // namespace voxelpipe
