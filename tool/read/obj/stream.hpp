// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// OBJ files that do not fit into memory.

#include "read/triangle_stream.hpp"

#include <filesystem>

namespace voxelize {

// The file at PATH as a stream, if a run that holds it is not likely to fit, or why it is none (lines and points).
// Throws memory_error, with that, where the run surely does not fit, and as open_obj() and stream_of() do.
[[nodiscard]] opened_stream open_obj_stream(const std::filesystem::path& path, const stream_room& room,
                                            const std::filesystem::path& folder, const gltf_limits& limits,
                                            const gltf_options& options);

} // namespace voxelize
