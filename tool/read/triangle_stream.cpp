// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "triangle_stream.hpp"

#include "gltf_stream.hpp"
#include "model/finite.hpp"
#include "model/memory.hpp"
#include "model/model_error.hpp"
#include "read/assimp/file_name.hpp"
#include "read/mesh/mesh_formats.hpp"
#include "read/mesh/mesh_stream.hpp"
#include "read/obj/stream.hpp"

#include <algorithm>
#include <system_error>

namespace voxelize {

void triangle_stream::scale_lengths(double factor) {
    if (factor == 1) return;
    for (part& p : parts_) {
        p.to_world = affine::scaling(factor).after(p.to_world);
        if (!p.to_world.is_finite()) throw model_error("--scale is too large for the model");
    }
}

bool triangle_stream::has_texcoords() const {
    return std::any_of(parts_.begin(), parts_.end(), [](const part& p) { return p.has_texcoords; });
}

void triangle_stream::for_each_block(const visitor& visit) {
    for (std::size_t part = 0; part < parts_.size(); ++part) read_part(part, visit);
}

triangle_stream::boxes triangle_stream::bounds() {
    boxes found;
    found.own.resize(parts_.size());
    const std::optional<std::uint64_t> counted = count_not_finite();
    std::uint64_t corners = 0; // that are not finite
    for_each_block([&](const block& b) {
        const affine& place = parts_[b.part].to_world;
        bounding_box& own = found.own[b.part];
        for (const glm::vec3& p : b.corners) {
            if (!is_finite(p)) {
                ++corners;
                continue;
            }
            const glm::dvec3 placed = place(glm::dvec3(p));
            own.include({p, p, false});
            found.placed.include({placed, placed, false});
        }
    });
    if (const std::uint64_t count = counted.value_or(corners); count != 0)
        warnings_.push_back(std::to_string(count) + ' ' + not_finite);
    return found;
}

void triangle_stream::add_only_part(const std::filesystem::path& file, std::uint64_t num_triangles) {
    materials_.emplace_back();
    if (num_triangles != 0) parts_.push_back({file.filename().string(), {}, 0, 0, num_triangles});
}

namespace {

// True unless a file is so small that what it holds surely fits: a triangle is not read from less than a byte.
bool may_not_fit(const std::filesystem::path& file, const stream_room& room) {
    constexpr double most_by_byte = 300;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return false;
    const auto bytes = static_cast<double>(std::filesystem::file_size(file, error));
    return !error && most_by_byte * bytes > room.loaded;
}

} // namespace

opened_stream open_stream(const std::filesystem::path& file, const stream_room& room,
                          const std::filesystem::path& folder, const load_options& options) {
    const std::string extension = assimp::lower_extension(file);
    opened_stream opened;
    const bool is_mesh = extension == ".obj" || is_mesh_format(extension);
    if (is_mesh && (options.gltf.animation || options.gltf.variant)) return opened; // refused by load_model()
    if (extension == ".obj")
        opened = open_obj_stream(file, room, folder, options.limits, options.gltf);
    else if (is_mesh_format(extension) && may_not_fit(file, room))
        opened = stream_of(open_mesh(file, options.gltf), file, room, folder, options.limits, options.gltf);
    if (extension == ".glb" || extension == ".gltf")
        opened.stream = gltf_stream::open(file, room, options.limits, options.gltf);
    // The open stream has taken some of the room.
    const double left = std::min(room.loaded, static_cast<double>(memory::room()));
    if (opened.stream && opened.stream->held_bytes() <= left) opened.stream = nullptr;
    if (opened.stream) opened.stream->scale_lengths(options.scale);
    return opened;
}

} // namespace voxelize
