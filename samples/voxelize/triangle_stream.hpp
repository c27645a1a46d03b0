// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model's triangles, read from its file block by block: for models that do not fit into memory.

#include "affine.hpp"
#include "model_file.hpp"
#include "placement.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace voxelize {

class triangle_stream {
public:
    // Three corners a triangle, and the number of the first.
    using visitor = std::function<void(std::span<const glm::vec3> corners, std::uint64_t first)>;

    triangle_stream() = default;
    triangle_stream(const triangle_stream&) = delete;
    triangle_stream& operator=(const triangle_stream&) = delete;
    virtual ~triangle_stream() = default;

    [[nodiscard]] virtual std::uint64_t num_triangles() const = 0;
    // Vertices of the file; three a triangle where it shares none.
    [[nodiscard]] virtual std::uint64_t num_vertices() const { return 3 * num_triangles(); }
    // Bytes that a run takes, at least, which holds the model.
    [[nodiscard]] virtual double held_bytes() const { return 300 * static_cast<double>(num_triangles()); }
    // Of all of them.
    [[nodiscard]] virtual affine to_world() const { return {}; }
    // What was left out or put right; one line each.
    [[nodiscard]] virtual std::vector<std::string> warnings() const { return {}; }
    // Calls visit with all triangles in order, some thousands at a time. Throws model_error where the file is damaged.
    virtual void for_each_block(const visitor& visit) = 0;
    // The boxes around all finite corners, as they are and by a transform.
    struct boxes {
        bounding_box own, placed;
    };
    [[nodiscard]] boxes bounds(const affine& place);
};

// The file as a stream, where it is of a kind that can be read so (stl_file.hpp, ply_file.hpp, glb_file.hpp); otherwise
// null. room: bytes that the stream may hold.
[[nodiscard]] std::unique_ptr<triangle_stream> open_stream(const std::filesystem::path& file, std::uint64_t room,
                                                           const load_options& options);

} // namespace voxelize
