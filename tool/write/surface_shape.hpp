// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the writers of --remesh's meshes share: faces, places of vertices, their colours as bytes.

#include "formats/formats.hpp"
#include "formats/output_file.hpp"
#include "model/srgb.hpp"
#include "model/surface_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace voxelize {

class surface_shape {
public:
    using index_list = std::array<std::uint32_t, 4>; // of a face; its last is not used by triangles

    // Refers to the mesh.
    explicit surface_shape(const surface_mesh& mesh) : mesh_(mesh), tables_(make_color_tables()) {}

    [[nodiscard]] const surface_mesh& mesh() const { return mesh_; }
    [[nodiscard]] std::size_t faces() const { return mesh_.num_faces(); }
    [[nodiscard]] bool has_quads() const { return !mesh_.quads.empty(); }
    [[nodiscard]] std::size_t corners() const { return has_quads() ? 4 : 3; }
    [[nodiscard]] index_list face(std::size_t n) const {
        if (has_quads()) {
            const glm::uvec4& q = mesh_.quads[n];
            return {q.x, q.y, q.z, q.w};
        }
        const glm::uvec3& t = mesh_.triangles[n];
        return {t.x, t.y, t.z, t.z};
    }
    // Triangles of all faces: a quad is cut from its first corner.
    [[nodiscard]] std::size_t triangles() const { return has_quads() ? 2 * faces() : faces(); }
    [[nodiscard]] std::array<std::uint32_t, 3> triangle(std::size_t n) const {
        if (!has_quads()) {
            const index_list f = face(n);
            return {f[0], f[1], f[2]};
        }
        const index_list f = face(n / 2);
        return {f[0], f[1 + n % 2], f[2 + n % 2]};
    }

    [[nodiscard]] bool has_colors() const { return !mesh_.colors.empty(); }
    // sRGB bytes of a vertex.
    [[nodiscard]] std::array<std::uint8_t, 3> encoded(std::size_t vertex) const {
        std::array<std::uint8_t, 3> bytes{};
        for (std::size_t c = 0; c < 3; ++c)
            bytes[c] = encode_srgb(tables_, mesh_.colors[vertex][static_cast<glm::length_t>(c)]);
        return bytes;
    }
    // The same in one number, red lowest.
    [[nodiscard]] std::uint32_t encoded_number(std::size_t vertex) const {
        const std::array<std::uint8_t, 3> c = encoded(vertex);
        return c[0] | std::uint32_t{c[1]} << 8U | std::uint32_t{c[2]} << 16U;
    }

    // Place of a vertex along an axis, in voxels from the grid's low corner.
    [[nodiscard]] static double place(const voxelpipe::surface_vertex& v, std::size_t axis, std::uint32_t q) {
        return v.cell[static_cast<glm::length_t>(axis)] + 0.5 + q / 65536.0;
    }
    [[nodiscard]] double world(std::size_t vertex, std::size_t axis) const {
        const voxelpipe::surface_vertex& v = mesh_.vertices[vertex];
        return std::fma(place(v, axis, v.q[axis]), mesh_.voxel_size[axis], mesh_.origin[axis]);
    }
    // Bits of a place in its cell that floats of the grid tell apart.
    [[nodiscard]] int float_bits() const {
        int log2 = 0;
        while ((1 << log2) < *std::max_element(mesh_.extent.begin(), mesh_.extent.end()) + 1) ++log2;
        return std::clamp(22 - log2, 1, 16);
    }
    // The same in that many bits, still within the cell.
    [[nodiscard]] double rounded(std::size_t vertex, std::size_t axis, int bits) const {
        const voxelpipe::surface_vertex& v = mesh_.vertices[vertex];
        const std::uint32_t step = 1U << (16 - bits), half = bits == 16 ? 0 : step / 2;
        const std::uint32_t q = std::clamp((v.q[axis] + half) / step * step, step, 65536U - step);
        return place(v, axis, q);
    }

protected:
    const surface_mesh& mesh_;

private:
    color_tables tables_;
};

// Writes a .glb: colours are linear, as normalised 16-bit integers. Throws write_error where it would pass 4 GiB.
void write_surface_glb(output_file& out, const surface_shape& shape, const std::filesystem::path& path,
                       const write_options& options);

} // namespace voxelize
