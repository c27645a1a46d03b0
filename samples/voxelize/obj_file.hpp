// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// An OBJ file, for models that do not fit into memory: its text is read once for vertices and once for faces, into
// temporary files of numbers, from which blocks of triangles are read as often as needed. Positions, polygons, groups
// and materials are as assimp makes them (assimp/obj_text.hpp, assimp/obj_outline.hpp).

#include "scratch_bytes.hpp"
#include "triangle_stream.hpp"
#include "vertex_cache.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace voxelize {

class obj_file : public triangle_stream {
public:
    // room: bytes of vertices that may be held. folder: for temporary files. Throws assimp::obj_refusal for a file that
    // is not streamed: lines, points, free-form surfaces, colours of some vertices only, textures that the options ask
    // for; model_error for one that is damaged; write_error.
    obj_file(const std::filesystem::path& path, std::uint64_t room, const std::filesystem::path& folder,
             const gltf_options& options);

    // Corners of faces: no two share one, as assimp has them.
    [[nodiscard]] std::uint64_t num_vertices() const override { return num_corners_; }
    [[nodiscard]] double held_bytes() const override;
    [[nodiscard]] bool has_colors() const override { return colors_.has_value(); }
    [[nodiscard]] std::vector<std::string> warnings() const override { return warnings_; }
    void read_part(std::size_t part, const visitor& visit) override;

private:
    // Faces with neither a group nor a material named between them.
    struct run {
        std::uint64_t first = 0, num_triangles = 0; // in the file of triangles
    };

    void read_vertices(const std::filesystem::path& path, std::uint64_t room, const gltf_options& options);
    void read_faces(const std::filesystem::path& path);
    void number_parts();

    scratch_bytes vertices_;  // position, and colour where those are asked for
    scratch_bytes triangles_; // three numbers of vertices
    std::uint64_t num_vertices_ = 0, num_faces_ = 0, num_corners_ = 0;
    std::optional<position_cache> positions_;
    std::optional<color_cache> colors_;
    std::vector<run> runs_;
    std::vector<std::string> warnings_;
    std::vector<std::vector<std::uint32_t>> runs_of_; // each part, in its order
};

// The file at PATH as a stream, if a run that holds it is not likely to fit into memory, or why it is none. Throws
// memory_error, with that, where the run surely does not fit. Nothing in a build without assimp.
[[nodiscard]] opened_stream open_obj(const std::filesystem::path& path, std::uint64_t room,
                                     const std::filesystem::path& folder, const gltf_options& options);

} // namespace voxelize
