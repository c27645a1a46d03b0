// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What --remesh makes: a closed mesh whose vertices lie in the cells of a grid of samples.

#include "model/scratch_bytes.hpp"
#include "model/srgb.hpp"

#include <voxelpipe/surfaces/surface.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace voxelize {

// An array of a mesh: in memory, or in a temporary file of which each thread holds a few blocks, so that a mesh may be
// larger than memory.
template <class T>
class surface_list {
public:
    surface_list() = default;
    surface_list(std::vector<T> values) : values_(std::move(values)) {}
    // In a new file in FOLDER, which goes with the list and its copies. Members throw write_error.
    explicit surface_list(const std::filesystem::path& folder)
        : file_(std::make_shared<scratch_bytes>(folder, "the mesh")), id_(next_id()) {}

    [[nodiscard]] std::size_t size() const { return file_ ? size_ : values_.size(); }
    [[nodiscard]] bool empty() const { return size() == 0; }
    // Any threads may read a list that does not change.
    [[nodiscard]] T operator[](std::size_t n) const { return file_ ? read(n) : values_[n]; }

    void append(const std::vector<T>& values) {
        if (file_)
            file_->append(std::as_bytes(std::span(values)));
        else
            values_.insert(values_.end(), values.begin(), values.end());
        size_ += values.size();
    }
    void set(std::size_t n, const T& value) {
        if (!file_) {
            values_[n] = value;
            return;
        }
        file_->replace(n * sizeof(T), std::as_bytes(std::span(&value, 1)));
        id_ = next_id(); // blocks that threads hold are of another list now
    }
    // To be called once all values are there, before several threads read.
    void finish() {
        if (file_) file_->flush();
    }

private:
    static constexpr std::size_t block_items = 1024;
    struct block {
        std::uint64_t list = 0, used = 0; // 0: of none
        std::size_t number = 0;
        std::vector<T> items;
    };
    static std::uint64_t next_id() {
        static std::atomic<std::uint64_t> last{0};
        return ++last;
    }

    // A face's vertices lie in four rows of cells.
    [[nodiscard]] T read(std::size_t n) const {
        static thread_local std::array<block, 8> blocks;
        static thread_local std::uint64_t now = 0;
        const std::size_t number = n / block_items;
        block* oldest = blocks.data();
        for (block& b : blocks) {
            if (b.list == id_ && b.number == number) {
                b.used = ++now;
                return b.items[n % block_items];
            }
            if (b.used < oldest->used) oldest = &b;
        }
        oldest->list = 0; // until its items are there
        oldest->items.resize(std::min(block_items, size_ - number * block_items));
        file_->read(number * block_items * sizeof(T),
                    std::span(reinterpret_cast<char*>(oldest->items.data()), oldest->items.size() * sizeof(T)));
        oldest->list = id_;
        oldest->number = number;
        oldest->used = ++now;
        return oldest->items[n % block_items];
    }

    std::vector<T> values_; // without a file
    std::shared_ptr<scratch_bytes> file_;
    std::size_t size_ = 0;
    std::uint64_t id_ = 0;
};

struct surface_mesh {
    std::array<int, 3> extent{};        // of the samples
    std::array<double, 3> origin{};     // the world's position of the grid's lowest corner
    std::array<double, 3> voxel_size{}; // the distances of neighbouring samples
    surface_list<voxelpipe::surface_vertex> vertices;
    surface_list<glm::uvec3> triangles; // counter-clockwise seen from outside; empty where there are quads
    surface_list<glm::uvec4> quads;
    surface_list<std::uint32_t>
        sources;                     // number of a triangle of the model that each vertex comes from; UINT32_MAX: none
    surface_list<glm::vec3> normals; // of the vertices: unit, outward
    surface_list<glm::vec3> colors;  // of the vertices: linear, 0 to 1; empty: there are none
    voxelpipe::surface_counters counts;

    [[nodiscard]] std::size_t num_faces() const { return triangles.size() + quads.size(); }
    // V - E + F of a closed mesh.
    [[nodiscard]] std::int64_t euler() const {
        const std::size_t edges = 3 * triangles.size() / 2 + 2 * quads.size();
        return static_cast<std::int64_t>(vertices.size() + num_faces()) - static_cast<std::int64_t>(edges);
    }
};

// A mesh as its writers see it: faces, places of vertices, colours as bytes.
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
            const glm::uvec4 q = mesh_.quads[n];
            return {q.x, q.y, q.z, q.w};
        }
        const glm::uvec3 t = mesh_.triangles[n];
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
        const voxelpipe::surface_vertex v = mesh_.vertices[vertex];
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
        const voxelpipe::surface_vertex v = mesh_.vertices[vertex];
        const std::uint32_t step = 1U << (16 - bits), half = bits == 16 ? 0 : step / 2;
        const std::uint32_t q = std::clamp((v.q[axis] + half) / step * step, step, 65536U - step);
        return place(v, axis, q);
    }

protected:
    const surface_mesh& mesh_;

private:
    color_tables tables_;
};

} // namespace voxelize
