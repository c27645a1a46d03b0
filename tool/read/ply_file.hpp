// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A binary PLY file of triangles, read block by block: for models that do not fit into memory. Faces are read in order,
// vertices where faces name them. Vertex colours are read where they are asked for; what else vertices and faces have
// is passed over.

#include "triangle_stream.hpp"
#include "vertex_cache.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

namespace voxelize {

class ply_file : public triangle_stream {
public:
    // The file at PATH, if it is one: binary with the little end first, vertices with x, y and z (float or double)
    // before faces of one list of three indices each, and nothing after these. Where COLORS are asked for, vertices may
    // have red, green, blue and alpha, all bytes or all floats, and no texture may be named. room: bytes that may be
    // held.
    [[nodiscard]] static std::unique_ptr<ply_file> open(const std::filesystem::path& path, std::uint64_t room,
                                                        bool colors);

    // The header's content.
    struct layout {
        position_layout vertices;
        std::optional<color_layout> colors;
        std::uint64_t first_face = 0, num_faces = 0; // byte, faces
        std::size_t face_bytes = 0;
        std::size_t list = 0; // bytes of a face before the length of its list of indices
        std::size_t length_bytes = 0, index_bytes = 0;
    };
    ply_file(const std::filesystem::path& path, const layout& header, std::uint64_t room);

    [[nodiscard]] std::uint64_t num_vertices() const override { return header_.vertices.count; }
    [[nodiscard]] bool has_colors() const override { return colors_.has_value(); }
    void read_part(std::size_t part, const visitor& visit) override;

private:
    [[nodiscard]] std::optional<std::uint64_t> count_not_finite() override {
        return voxelize::count_not_finite(header_.vertices, file_);
    }

    layout header_;
    model_bytes file_;
    position_cache vertices_;
    std::optional<color_cache> colors_;
};

} // namespace voxelize
