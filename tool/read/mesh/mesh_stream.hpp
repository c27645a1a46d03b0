// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Any mesh_reader -> triangle_stream.

#include "mesh_reader.hpp"
#include "read/triangle_stream.hpp"

#include <filesystem>
#include <memory>

namespace voxelize {

// Reads all that the reader gives once, and again what it can read fast; the rest stands in temporary files in FOLDER.
// room: bytes of vertices that may be held. Gives a refusal in place of a stream for lines and points. Throws
// model_error and write_error.
[[nodiscard]] opened_stream stream_of(std::unique_ptr<mesh_reader> reader, const std::filesystem::path& file,
                                      const stream_room& room, const std::filesystem::path& folder,
                                      const gltf_limits& limits, const gltf_options& options);

} // namespace voxelize
