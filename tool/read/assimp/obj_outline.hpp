// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Objects, groups and materials of an OBJ file, and the triangles of its polygons, as assimp makes them without the
// whole file: assimp is given a file with one face for each run of faces, and polygons some thousands at a time. So
// all of these, and their order, are those of a file that is loaded.

#include "wire.hpp"

#include <glm/glm.hpp>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::assimp {

class obj_outline {
public:
    // A line of the file that names an object, a group, a material or a library.
    void add_structure(std::string_view line);
    // Faces follow, with none of these between them. Runs are numbered from 0.
    void add_run();
    [[nodiscard]] std::size_t num_runs() const { return num_runs_; }

    struct parts {
        model source;                                 // primitives without triangles that mean anything
        std::vector<std::vector<std::uint32_t>> runs; // of each primitive, in the order of its faces
    };
    // FILE is the model, in whose folder libraries lie. Runs in a process of its own. Throws obj_refusal for more
    // objects and groups than that has room for, and model_error.
    [[nodiscard]] parts read(const std::filesystem::path& file) const;

private:
    std::string text_ = "v 0 0 0\n";
    std::size_t num_runs_ = 0;
};

// The triangles of polygons: of the first, then of the second, ... The corners of one stand behind those of the one
// before, sizes[i] of polygon i; triangles are indices of these. A polygon without area may have none. Runs in a
// process of its own. Throws model_error.
[[nodiscard]] std::vector<glm::uvec3> cut_polygons(std::span<const glm::vec3> corners,
                                                   std::span<const std::uint32_t> sizes);

} // namespace voxelize::assimp
