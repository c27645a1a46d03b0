// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// An OBJ file, for models that do not fit into memory: its text is read once for vertices and once for faces, into
// temporary files of numbers, from which blocks of triangles are read as often as needed. Positions, polygons, groups,
// materials and their textures are as assimp makes them (assimp/obj_text.hpp, assimp/obj_outline.hpp).

#include "gltf_scene.hpp"
#include "model/scratch_bytes.hpp"
#include "read/assimp/obj_outline.hpp"
#include "read/assimp/obj_text.hpp"
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
    // is not streamed: lines, points, free-form surfaces, colours of some vertices only; model_error for one that is
    // damaged; write_error.
    obj_file(const std::filesystem::path& path, std::uint64_t room, const std::filesystem::path& folder,
             const gltf_limits& limits, const gltf_options& options);

    // Corners of faces: no two share one, as assimp has them.
    [[nodiscard]] std::uint64_t num_vertices() const override { return num_corners_; }
    [[nodiscard]] double held_bytes() const override;
    [[nodiscard]] bool has_colors() const override { return colors_.has_value(); }
    void read_part(std::size_t part, const visitor& visit) override;
    void read_textures(const picture_hook& take) override;

private:
    // Faces with neither a group nor a material named between them.
    struct run {
        std::uint64_t first = 0, num_triangles = 0; // in the file of triangles
        std::uint32_t texcoords_end = 0;            // behind the greatest that its faces name; 0: they name none
    };

    [[nodiscard]] std::optional<std::uint64_t> count_not_finite() override { return num_not_finite_; }
    // Returns true if the vertices have colours.
    bool read_vertices(assimp::obj_outline& outline);
    void read_outline(const assimp::obj_outline& outline);
    void make_caches(std::uint64_t room, bool has_colors);
    void read_faces();
    void number_parts();

    std::filesystem::path path_;
    gltf_limits limits_;
    gltf_options options_;
    scratch_bytes vertices_;  // position, and colour where those are asked for
    scratch_bytes texcoords_; // where a texture is asked for
    scratch_bytes triangles_; // three numbers of vertices; then, where a texture is asked for, of texture coordinates
    assimp::obj_counts counts_;
    std::uint64_t num_faces_ = 0, num_corners_ = 0;
    std::uint64_t num_not_finite_ = 0; // of the corners; until read_faces(): of the vertices
    std::optional<position_cache> positions_;
    std::optional<color_cache> colors_;
    std::optional<texcoord_cache> texcoord_cache_; // where a texture is asked for
    std::vector<run> runs_;
    assimp::model named_;                             // textures alone
    std::vector<bool> asks_for_texture_;              // by material
    std::vector<std::vector<std::uint32_t>> runs_of_; // each part, in its order
};

// The file at PATH as a stream, if a run that holds it is not likely to fit, or why it is none. Throws memory_error,
// with that, where the run surely does not fit. Nothing in a build without assimp.
[[nodiscard]] opened_stream open_obj(const std::filesystem::path& path, const stream_room& room,
                                     const std::filesystem::path& folder, const gltf_limits& limits,
                                     const gltf_options& options);

} // namespace voxelize
