// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "stream.hpp"

#include "model/memory.hpp"
#include "read/mesh/mesh_stream.hpp"
#include "reader.hpp"

#include <algorithm>
#include <cstdint>
#include <system_error>

namespace voxelize {
namespace {

// Bytes that a run takes which holds the model: vertices in double while it is read, triangles with corners of their
// own as they are stored and snapped, and paired with tiles.
double bytes_of_run(const obj_counts& count, double triangle) {
    const auto corners = static_cast<double>(count.corners);
    const double triangles = std::max(corners - 2 * static_cast<double>(count.faces), 0.0);
    return triangle * triangles + 24 * static_cast<double>(count.vertices);
}

} // namespace

opened_stream open_obj_stream(const std::filesystem::path& path, const stream_room& room,
                              const std::filesystem::path& folder, const gltf_limits& limits,
                              const gltf_options& options) {
    // A triangle takes eight bytes of text at least, and a vertex too. What fits so is not counted.
    constexpr double likely = 190, least = 120, most_by_byte = 24;
    std::error_code error;
    if (options.animation || !std::filesystem::is_regular_file(path, error)) return {};
    const auto bytes = static_cast<double>(std::filesystem::file_size(path, error));
    if (error || most_by_byte * bytes <= room.loaded) return {};
    const obj_counts count = count_obj(path);
    if (bytes_of_run(count, likely) <= room.loaded) return {};
    opened_stream opened = stream_of(open_obj(path, options), path, room, folder, limits, options);
    if (opened.stream || opened.refusal.empty()) return opened;
    opened.need = bytes_of_run(count, likely);
    memory::require(bytes_of_run(count, least), "the model", opened.refusal, opened.need);
    return opened;
}

} // namespace voxelize
