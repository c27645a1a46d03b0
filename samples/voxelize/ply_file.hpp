// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A binary PLY file of triangles, read block by block: for models that do not fit into memory. Faces are read in order,
// vertices where faces name them. Colours and what else vertices and faces have are passed over.

#include "position_cache.hpp"
#include "triangle_stream.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

namespace voxelize {

class ply_file : public triangle_stream {
public:
    // The file at PATH, if it is one: binary with the little end first, vertices with x, y and z (float or double)
    // before faces of one list of three indices each, and nothing after these. room: bytes that may be held.
    [[nodiscard]] static std::unique_ptr<ply_file> open(const std::filesystem::path& path, std::uint64_t room);

    // What the header says.
    struct layout {
        position_layout vertices;
        std::uint64_t first_face = 0, num_faces = 0; // byte, faces
        std::size_t face_bytes = 0;
        std::size_t list = 0; // bytes of a face before the length of its list of indices
        std::size_t length_bytes = 0, index_bytes = 0;
    };
    ply_file(const std::filesystem::path& path, const layout& header, std::uint64_t room)
        : header_(header), file_(path), vertices_(header.vertices, room) {}

    [[nodiscard]] std::uint64_t num_triangles() const override { return header_.num_faces; }
    [[nodiscard]] std::uint64_t num_vertices() const override { return header_.vertices.count; }
    void for_each_block(const visitor& visit) override;

private:
    layout header_;
    model_bytes file_;
    position_cache vertices_;
};

} // namespace voxelize
