// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "stored_vertices.hpp"

#include "mesh_scene.hpp"

#include <cstddef>
#include <span>

namespace voxelize {

namespace {

template <class T>
std::span<const std::byte> raw_bytes(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

} // namespace

void stored_vertices::begin(mesh_reader& reader, bool with_colors, mesh_sink& to) {
    const mesh_description& read = reader.description();
    const std::optional<mesh_reader::layouts> placed = reader.vertices_in_place();
    in_place_ = placed.has_value();
    is_double_ = read.is_double;
    has_texcoords_ = read.has_vertex_texcoords;
    const bool has_colors = read.has_vertex_colors && with_colors;
    if (!in_place_ && has_colors) colors_.emplace();        // add() stores them
    if (!in_place_ || is_double_) reader.read_vertices(to); // floats in place need no look
    std::size_t stride = 0;
    if (in_place_) {
        positions_ = placed->positions;
        count_ = positions_.count;
        colors_ = placed->colors;
        texcoords_ = placed->texcoords;
    } else {
        for (std::size_t a = 0; a < 3; ++a) {
            positions_.is_double[a] = is_double_;
            positions_.place[a] = a * (is_double_ ? sizeof(double) : sizeof(float));
        }
        stride = is_double_ ? sizeof(glm::dvec3) : sizeof(glm::vec3);
        if (colors_) {
            for (std::size_t c = 0; c < 4; ++c) colors_->place[c] = stride + c * sizeof(float);
            colors_->has_alpha = true;
            stride += sizeof(glm::vec4);
        }
        if (has_texcoords_) {
            texcoords_.emplace();
            texcoords_->first = stride;
            stride += sizeof(glm::vec2);
        }
        positions_.stride = stride;
        if (colors_) colors_->stride = stride;
        if (texcoords_) texcoords_->stride = stride;
    }
    if (texcoords_) texcoords_->transform = upside_down;
    if (is_double_) positions_.origin = float_origin(box_);
}

void stored_vertices::add(const mesh_vertex& v) {
    if (is_double_) include_position(box_, v.position);
    ++count_;
    if (in_place_) return;
    if (!vertices_) vertices_.emplace(folder_);
    if (is_double_) {
        vertices_->append(raw_bytes(v.position));
    } else {
        vertices_->append(raw_bytes(glm::vec3(v.position)));
    }
    if (colors_) vertices_->append(raw_bytes(v.color));
    if (has_texcoords_) vertices_->append(raw_bytes(v.texcoord));
}

void stored_vertices::add_texcoord(const glm::vec2& value) {
    if (!list_) list_.emplace(folder_);
    list_->append(raw_bytes(value));
    ++num_texcoords_;
}

void stored_vertices::open_positions() {
    if (position_cache_ && cut_at_ == count_) return;
    cut_at_ = positions_.count = count_;
    constexpr std::uint64_t room = std::uint64_t{4} << 20;
    position_cache_.emplace(positions_, room);
}

void stored_vertices::open(std::uint64_t room, bool with_texcoords) {
    if (!with_texcoords) texcoords_.reset();
    const std::uint64_t lists = 1 + (colors_ ? 1 : 0) + (with_texcoords ? 1 : 0);
    positions_.count = count_;
    if (is_double_) positions_.origin = float_origin(box_); // with vertices of faces
    position_cache_.emplace(positions_, room / lists);
    if (colors_) {
        colors_->count = count_;
        color_cache_.emplace(*colors_, room / lists);
    }
    if (texcoords_) {
        texcoords_->count = count_;
        texcoord_cache_.emplace(*texcoords_, room / lists);
    }
    if (list_ && with_texcoords) {
        texcoord_layout layout;
        layout.count = num_texcoords_;
        layout.stride = sizeof(glm::vec2);
        layout.transform = upside_down;
        list_cache_.emplace(layout, room / lists);
    }
}

std::uint64_t stored_vertices::count_not_finite() {
    if (in_place_) return voxelize::count_not_finite(positions_, bytes_);
    return voxelize::count_not_finite(positions_, *vertices_);
}

} // namespace voxelize
