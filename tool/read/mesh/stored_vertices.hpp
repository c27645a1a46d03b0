// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The vertices of a streamed mesh: where the file has them, or in a temporary file, and read through caches.

#include "mesh_reader.hpp"
#include "mesh_values.hpp"
#include "model/placement.hpp"
#include "model/scratch_bytes.hpp"
#include "read/vertex_cache.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

namespace voxelize {

class stored_vertices {
    // The value of a cache, from where the vertices are.
    template <class Cache>
    [[nodiscard]] const auto& at(Cache& cache, std::uint64_t i) {
        return in_place_ ? cache->at(i, bytes_) : cache->at(i, *vertices_);
    }

public:
    // FOLDER is for temporary files.
    stored_vertices(const std::filesystem::path& file, std::filesystem::path folder)
        : folder_(std::move(folder)), bytes_(file) {}

    // Takes the layouts of a reader's vertices, which it is then told to read, unless it needs no look at them.
    // with_colors: the colours are asked for.
    void begin(mesh_reader& reader, bool with_colors, mesh_sink& to);
    // Vertices as the reader gives them, or of faces that bring their own; appended unless they lie in the file.
    void add(const mesh_vertex& v);
    void add_texcoord(const glm::vec2& value);
    // Positions alone, for polygons that are cut while the rest is read.
    void open_positions();
    // Once all are there; room: bytes that the caches may take.
    void open(std::uint64_t room, bool with_texcoords);

    [[nodiscard]] bool has_colors() const { return colors_.has_value(); }
    [[nodiscard]] std::uint64_t count() const { return count_; }
    // Positions count from here.
    [[nodiscard]] const glm::dvec3& origin() const { return positions_.origin; }
    [[nodiscard]] std::uint64_t count_not_finite();

    // After open().
    [[nodiscard]] glm::vec3 position(std::uint64_t vertex) { return at(position_cache_, vertex); }
    [[nodiscard]] glm::vec4 color(std::uint64_t vertex) { return at(color_cache_, vertex); }
    [[nodiscard]] glm::vec2 texcoord(std::uint64_t vertex) { return at(texcoord_cache_, vertex); }
    [[nodiscard]] glm::vec2 corner_texcoord(std::uint64_t number) { return list_cache_->at(number, *list_); }

private:
    std::filesystem::path folder_;
    model_bytes bytes_;
    std::optional<scratch_bytes> vertices_, list_; // list_: texture coordinates of corners
    bool in_place_ = false, is_double_ = false, has_texcoords_ = false;
    std::uint64_t count_ = 0, num_texcoords_ = 0; // vertices of the file and of its faces
    std::uint64_t cut_at_ = 0;                    // vertices when the positions were last opened
    bounding_box box_;
    position_layout positions_;
    std::optional<color_layout> colors_;
    std::optional<texcoord_layout> texcoords_;
    std::optional<voxelize::position_cache> position_cache_;
    std::optional<voxelize::color_cache> color_cache_;
    std::optional<voxelize::texcoord_cache> texcoord_cache_, list_cache_;
};

} // namespace voxelize
