// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Any mesh_reader -> scene.

#include "mesh_reader.hpp"
#include "model/placement.hpp"

#include <filesystem>

namespace voxelize {

// The place that floats count from, for positions in double within BOX: 0 along an axis whose coordinates floats tell
// apart as well as near 0, else near the middle, at a number of few digits. The positions of a scene and of a stream
// are differences from it, its transforms lead back.
[[nodiscard]] glm::dvec3 float_origin(const bounding_box& box);

// Reads all that the reader gives. FILE: the model's own, beside which its pictures are. Throws model_error, and
// std::bad_alloc where an honest file does not fit into memory.
[[nodiscard]] scene scene_of(mesh_reader& reader, const std::filesystem::path& file, const gltf_limits& limits,
                             const gltf_options& options, const load_hooks& hooks = {});

} // namespace voxelize
