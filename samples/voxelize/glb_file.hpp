// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A binary glTF file of plain triangles, read block by block: for models that do not fit into memory.

#include "affine.hpp"
#include "gltf_scene.hpp"
#include "position_cache.hpp"
#include "triangle_stream.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace voxelize {

class glb_file : public triangle_stream {
public:
    // The file at PATH, if all that its scene shows are triangles as they stand in it (find_parts()). room: bytes that
    // may be held.
    [[nodiscard]] static std::unique_ptr<glb_file> open(const std::filesystem::path& path, std::uint64_t room,
                                                        const gltf_limits& limits, const gltf_options& options);

    glb_file(const std::filesystem::path& path, const gltf_parts& parts, std::uint64_t room);

    [[nodiscard]] std::uint64_t num_triangles() const override { return num_triangles_; }
    [[nodiscard]] std::uint64_t num_vertices() const override { return num_vertices_; }
    // Positions and indices as they are loaded, snapped, and paired with tiles.
    [[nodiscard]] double held_bytes() const override {
        return 36 * (static_cast<double>(num_triangles_) + static_cast<double>(num_vertices_));
    }
    [[nodiscard]] affine to_world() const override { return parts_.to_world; }
    [[nodiscard]] std::vector<std::string> warnings() const override { return parts_.warnings; }
    void for_each_block(const visitor& visit) override;

private:
    gltf_parts parts_;
    model_bytes file_;
    std::uint64_t room_, num_triangles_ = 0, num_vertices_ = 0;
};

} // namespace voxelize
