// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "backend_calls.hpp"

#include <voxelpipe/grid.hpp>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

namespace voxelpipe::capi {
namespace {

// A vertex index of a triangle, at memory of any alignment.
template <class Index>
std::uint64_t index_at(const unsigned char* triangle, int corner) {
    Index i;
    std::memcpy(&i, triangle + static_cast<std::size_t>(corner) * sizeof(Index), sizeof(Index));
    return i;
}

// Copies triangles and checks their indices.
template <class Index>
void copy_triangles(const vp_mesh_desc& d, std::uint64_t stride, vp_mesh& mesh) {
    mesh.triangles.resize(d.num_triangles);
    const auto* from = static_cast<const unsigned char*>(d.triangles);
    for (std::uint64_t t = 0; t < d.num_triangles; ++t, from += stride)
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint64_t i = index_at<Index>(from, corner);
            if (i >= d.num_vertices)
                throw failure{VP_ERROR_BAD_INDEX, "triangle " + std::to_string(t) + " names vertex " +
                                                      std::to_string(i) + " of " + std::to_string(d.num_vertices)};
            mesh.triangles[t][corner] = static_cast<std::uint32_t>(i);
            mesh.index_bound = std::max(mesh.index_bound, i + 1);
        }
}

// The stride, or that of packed elements for 0. Throws where elements would lie beyond all memory.
std::uint64_t checked_stride(std::uint64_t stride, std::uint64_t packed, std::uint64_t count, const char* what) {
    if (stride == 0) stride = packed;
    if (stride < packed)
        throw failure{VP_ERROR_BAD_ARRAY, std::string(what) + " is " + std::to_string(stride) +
                                              " bytes, and an element has " + std::to_string(packed)};
    if (count > std::numeric_limits<std::size_t>::max() / 2 / stride)
        throw failure{VP_ERROR_BAD_ARRAY, std::string(what) + ": more bytes than can be addressed"};
    return stride;
}

void copy_mesh(const vp_mesh_desc& d, vp_mesh& mesh) {
    const std::uint32_t index_bytes = d.index_bytes == 0 ? 4 : d.index_bytes;
    if (index_bytes != 2 && index_bytes != 4 && index_bytes != 8)
        throw failure{VP_ERROR_BAD_OPTION, "index_bytes is " + std::to_string(index_bytes) + ", not 2, 4 or 8"};
    if (d.num_vertices != 0) check_pointer(d.positions, "positions");
    if (d.num_triangles != 0) check_pointer(d.triangles, "triangles");
    if (d.num_parts != 0) check_pointer(d.first_of_part, "first_of_part");
    if (d.num_vertices > std::uint64_t{1} << 32) throw failure{VP_ERROR_TOO_LARGE, "more than 2^32 vertices"};
    if (d.num_triangles > std::numeric_limits<std::uint32_t>::max())
        throw failure{VP_ERROR_TOO_LARGE, "more than 2^32 - 1 triangles"};
    const std::uint64_t position_stride =
        checked_stride(d.position_stride, sizeof(glm::vec3), d.num_vertices, "position_stride");
    const std::uint64_t triangle_stride =
        checked_stride(d.triangle_stride, std::uint64_t{3} * index_bytes, d.num_triangles, "triangle_stride");
    if (d.num_parts == 0 || d.first_of_part == nullptr) {
        mesh.parts = {0};
    } else {
        for (std::uint64_t p = 0; p < d.num_parts; ++p) {
            const std::uint64_t first = d.first_of_part[p];
            if (p == 0 ? first != 0 : first < mesh.parts.back() || first > d.num_triangles)
                throw failure{VP_ERROR_BAD_OPTION, "first_of_part[" + std::to_string(p) + "] is " +
                                                       std::to_string(first) + ": not ascending from 0 to at most " +
                                                       std::to_string(d.num_triangles)};
            mesh.parts.push_back(first);
        }
    }
    mesh.positions.resize(d.num_vertices);
    const auto* from = reinterpret_cast<const unsigned char*>(d.positions);
    for (std::uint64_t v = 0; v < d.num_vertices; ++v, from += position_stride)
        std::memcpy(&mesh.positions[v], from, sizeof(glm::vec3));
    const auto copy = index_bytes == 2   ? copy_triangles<std::uint16_t>
                      : index_bytes == 4 ? copy_triangles<std::uint32_t>
                                         : copy_triangles<std::uint64_t>;
    copy(d, triangle_stride, mesh);
}

// A number that no grid can have becomes one that validate() refuses.
glm::ivec3 to_vector(const std::uint64_t (&v)[3]) {
    glm::ivec3 result;
    for (int a = 0; a < 3; ++a) result[a] = static_cast<int>(std::min<std::uint64_t>(v[a], 1 << 30));
    return result;
}

const grid& checked_grid(const grid& g) {
    finish(validate(g), nullptr);
    return g;
}

// Writes the grid that `make` gives for the bounds of the mesh.
template <class Make>
vp_code fit_grid(const vp_mesh* mesh, vp_grid* out, const Make& make) {
    return guarded([&] {
        const vp_mesh& m = checked_handle(mesh, "mesh");
        checked_struct(out, "grid");
        const grid g = checked_grid(make(bounds(array_view<const glm::vec3>(m.positions.data(), m.positions.size()))));
        vp_grid result{.struct_size = sizeof(vp_grid),
                       .reserved = 0,
                       .origin = {},
                       .voxel_size = {},
                       .extent = {},
                       .offset = {},
                       .whole = {}};
        for (int a = 0; a < 3; ++a) {
            result.origin[a] = g.origin[a];
            result.voxel_size[a] = g.voxel_size[a];
            result.extent[a] = result.whole[a] = static_cast<std::uint64_t>(g.extent[a]);
        }
        *out = result;
    });
}

} // namespace

grid grid_of(const vp_grid* from) {
    const vp_grid& f = checked_struct(from, "grid");
    if (f.reserved != 0) throw failure{VP_ERROR_VERSION, "grid: reserved is not 0"};
    grid g;
    g.extent = to_vector(f.extent);
    g.offset = to_vector(f.offset);
    g.whole = to_vector(f.whole);
    for (int a = 0; a < 3; ++a) {
        g.origin[a] = f.origin[a];
        g.voxel_size[a] = f.voxel_size[a];
    }
    return checked_grid(g);
}

} // namespace voxelpipe::capi

using namespace voxelpipe;
using namespace voxelpipe::capi;

extern "C" {

vp_code vp_mesh_create(vp_context* context, const vp_mesh_desc* desc, vp_mesh** mesh) {
    return guarded([&] {
        checked_handle(context, "context");
        check_pointer(mesh, "mesh");
        auto made = std::make_unique<vp_mesh>();
        copy_mesh(checked_struct(desc, "desc"), *made);
        *mesh = made.release();
    });
}

void vp_mesh_destroy(vp_mesh* mesh) { destroy(mesh); }

vp_code vp_grid_fit_longest(const vp_mesh* mesh, uint64_t n, vp_grid* grid) {
    return fit_grid(mesh, grid, [&](const bounding_box& box) {
        return fit_longest(box, static_cast<int>(std::min<std::uint64_t>(n, 1 << 30)));
    });
}

vp_code vp_grid_fit(const vp_mesh* mesh, const uint64_t extent[3], vp_grid* grid) {
    return fit_grid(mesh, grid, [&](const bounding_box& box) {
        check_pointer(extent, "extent");
        return fit(box, to_vector({extent[0], extent[1], extent[2]}));
    });
}

vp_code vp_grid_fit_voxel_size(const vp_mesh* mesh, const double voxel_size[3], uint64_t padding, vp_grid* grid) {
    return fit_grid(mesh, grid, [&](const bounding_box& box) {
        check_pointer(voxel_size, "voxel_size");
        for (int a = 0; a < 3; ++a)
            if (!(voxel_size[a] > 0.0)) throw failure{VP_ERROR_BAD_GRID, "voxel_size is not above 0"};
        return fit_voxel_size(box, {voxel_size[0], voxel_size[1], voxel_size[2]},
                              static_cast<int>(std::min<std::uint64_t>(padding, 1 << 20)));
    });
}

} // extern "C"
