// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "triangle_stream.hpp"

#include "assimp/file_name.hpp"
#include "glb_file.hpp"
#include "ply_file.hpp"
#include "stl_file.hpp"

#include <cmath>

namespace voxelize {

triangle_stream::boxes triangle_stream::bounds(const affine& place) {
    boxes found;
    for_each_block([&](std::span<const glm::vec3> corners, std::uint64_t) {
        for (const glm::vec3& p : corners) {
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
            const glm::dvec3 placed = place(glm::dvec3(p));
            found.own.include({p, p, false});
            found.placed.include({placed, placed, false});
        }
    });
    return found;
}

std::unique_ptr<triangle_stream> open_stream(const std::filesystem::path& file, std::uint64_t room,
                                             const load_options& options) {
    const std::string extension = assimp::lower_extension(file);
    if (extension == ".stl") return stl_file::open(file);
    if (extension == ".ply") return ply_file::open(file, room);
    if (extension == ".glb") return glb_file::open(file, room, options.limits, options.gltf);
    return nullptr;
}

} // namespace voxelize
