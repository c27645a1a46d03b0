// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A glTF file of plain triangles, read block by block from its own bytes and from the files that it names: for models
// that do not fit into memory.

#include "gltf_parts.hpp"
#include "gltf_scene.hpp"
#include "triangle_stream.hpp"
#include "vertex_cache.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace voxelize {

class gltf_stream : public triangle_stream {
public:
    // The file at PATH, if all that its scene shows are triangles as they stand in it (find_parts()), and if it may not
    // fit when it is loaded.
    [[nodiscard]] static std::unique_ptr<gltf_stream> open(const std::filesystem::path& path, const stream_room& room,
                                                           const gltf_limits& limits, const gltf_options& options);

    gltf_stream(const std::filesystem::path& path, gltf_parts&& parts, std::uint64_t room, const gltf_limits& limits,
                const gltf_options& options);

    [[nodiscard]] std::uint64_t num_vertices() const override { return num_vertices_; }
    // Positions and indices as they are loaded, snapped, and paired with tiles, and what else vertices have.
    [[nodiscard]] double held_bytes() const override {
        return 36 * (static_cast<double>(num_triangles()) + static_cast<double>(num_vertices_)) + value_bytes_;
    }
    [[nodiscard]] bool has_colors() const override { return has_colors_; }
    void read_part(std::size_t part, const visitor& visit) override;
    void read_textures(const picture_hook& take) override;

private:
    [[nodiscard]] std::optional<std::uint64_t> count_not_finite() override;

    std::filesystem::path path_;
    gltf_limits limits_;
    gltf_options options_;
    gltf_parts source_; // its parts as those of the stream
    std::vector<model_bytes> files_;
    std::uint64_t room_, num_vertices_ = 0;
    bool has_colors_ = false;
    double value_bytes_ = 0; // of colours and texture coordinates
};

} // namespace voxelize
