// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "mesh_scene.hpp"

#include "mesh_values.hpp"
#include "model/finite.hpp"
#include "polygon.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf/resources.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace voxelize {

namespace {

// Values of the corners of triangles, or of ends of lines, of one part.
struct corner_values {
    std::vector<glm::uvec3> triangles; // numbers of vertices
    std::vector<glm::uvec3> texcoords; // numbers of texture coordinates, where the file has them by corners
    std::vector<glm::vec4> colors;     // of triangles, where the file has them by faces
    std::vector<glm::uvec2> lines;     // numbers of vertices
};

class scene_builder : public mesh_sink {
public:
    scene_builder(mesh_reader& reader, const gltf_options& options) : reader_(reader), options_(options) {}

    void read() {
        const mesh_description& file = reader_.description();
        has_colors_ = file.has_vertex_colors && options_.colors;
        has_face_colors_ = file.has_face_colors && options_.colors;
        if (file.is_double)
            doubles_.reserve(static_cast<std::size_t>(reader_.expected_vertices()));
        else
            positions_.reserve(static_cast<std::size_t>(reader_.expected_vertices()));
        reader_.read_vertices(*this);
        origin_ = file.is_double ? float_origin(box_) : glm::dvec3(0);
        reader_.read_faces(*this);
        asked_for_ = asked_for_textures(file, options_);
        cut_ = {};
        place_vertices();
    }
    [[nodiscard]] const std::vector<bool>& asked_for() const { return asked_for_; }

    void vertex(const mesh_vertex& v) override {
        if (reader_.description().is_double) {
            include_position(box_, v.position);
            doubles_.push_back(v.position);
        } else {
            positions_.emplace_back(v.position);
        }
        if (has_colors_) colors_.push_back(v.color);
        if (reader_.description().has_vertex_texcoords) texcoords_.push_back(v.texcoord);
        if (++num_vertices_ == UINT32_MAX) throw model_error("there are more vertices than can be numbered");
    }
    void texcoord(const glm::vec2& value) override { list_.push_back(value); }

    void face(const mesh_face& f) override {
        corner_values& part = part_of(f.part);
        const auto add_color = [&] {
            if (has_face_colors_) part.colors.push_back(f.color.value_or(no_face_color));
        };
        if (!f.positions.empty()) {
            for (const glm::uvec3& t : cut_.cut(f.positions)) {
                part.triangles.emplace_back(num_vertices_, num_vertices_ + 1, num_vertices_ + 2);
                for (glm::length_t k = 0; k < 3; ++k) {
                    mesh_vertex v;
                    v.position = f.positions[t[k]];
                    vertex(v);
                }
                add_color();
            }
            return;
        }
        const auto add = [&](const mesh_corner& a, const mesh_corner& b, const mesh_corner& c) {
            part.triangles.emplace_back(a.vertex, b.vertex, c.vertex);
            if (reader_.description().has_corner_texcoords)
                part.texcoords.emplace_back(a.texcoord, b.texcoord, c.texcoord);
            add_color();
        };
        if (f.corners.size() == 3) {
            add(f.corners[0], f.corners[1], f.corners[2]);
            return;
        }
        // By the same floats as in a stream.
        places_.clear();
        for (const mesh_corner& c : f.corners)
            places_.emplace_back(doubles_.empty() ? positions_[c.vertex] : glm::vec3(doubles_[c.vertex] - origin_));
        for (const glm::uvec3& t : cut_.cut(places_)) add(f.corners[t.x], f.corners[t.y], f.corners[t.z]);
    }

    void line(std::uint32_t number, std::span<const std::uint32_t> vertices) override {
        corner_values& part = part_of(number);
        if (vertices.size() == 1) part.lines.emplace_back(vertices[0], vertices[0]);
        for (std::size_t i = 1; i < vertices.size(); ++i) part.lines.emplace_back(vertices[i - 1], vertices[i]);
    }

    // The primitives and instances of all parts, in order; of each triangles, then lines.
    void move_to(scene& result) {
        const mesh_description& file = reader_.description();
        const auto used = [](const corner_values& part) { return !part.triangles.empty() || !part.lines.empty(); };
        const bool is_one = std::count_if(parts_.begin(), parts_.end(), used) == 1;
        const bool has_texture = std::find(asked_for_.begin(), asked_for_.end(), true) != asked_for_.end();
        const bool shares = is_one && !has_face_colors_ && !(file.has_corner_texcoords && has_texture);
        for (std::size_t n = 0; n < parts_.size(); ++n) {
            corner_values part = std::move(parts_[n]);
            if (!used(part)) continue;
            primitive made;
            made.name = file.parts[n].name;
            made.material = file.parts[n].material;
            const bool is_textured = made.material < asked_for_.size() && asked_for_[made.material];
            const auto add = [&](primitive&& p) {
                result.instances.push_back(
                    {static_cast<std::uint32_t>(result.primitives.size()), translation(origin_)});
                result.primitives.push_back(std::move(p));
            };
            if (shares) {
                share(made, is_textured);
                if (!part.lines.empty() && !part.triangles.empty()) {
                    primitive lines = made;
                    made.triangles = std::move(part.triangles);
                    add(std::move(made));
                    lines.lines = std::move(part.lines);
                    add(std::move(lines));
                    continue;
                }
                made.triangles = std::move(part.triangles);
                made.lines = std::move(part.lines);
                add(std::move(made));
                continue;
            }
            primitive lines = made;
            if (!part.triangles.empty()) {
                spread_triangles(made, part, is_textured);
                add(std::move(made));
            }
            if (!part.lines.empty()) {
                spread_lines(lines, part);
                add(std::move(lines));
            }
        }
    }

private:
    // As floats, from where they count.
    void place_vertices() {
        if (!reader_.description().is_double) return;
        origin_ = float_origin(box_); // of vertices that came with faces, too
        positions_.reserve(doubles_.size());
        for (const glm::dvec3& p : doubles_) positions_.emplace_back(p - origin_);
        doubles_ = {};
    }

    corner_values& part_of(std::uint32_t number) {
        if (parts_.size() <= number) parts_.resize(std::size_t{number} + 1);
        return parts_[number];
    }
    // All vertices as the file has them.
    void share(primitive& made, bool is_textured) {
        made.positions = std::move(positions_);
        made.colors = std::move(colors_);
        if (!is_textured) texcoords_ = {};
        made.texcoords = std::move(texcoords_);
        for (glm::vec2& t : made.texcoords) t = turned(t);
    }
    // Each triangle with corners of its own.
    void spread_triangles(primitive& made, corner_values& part, bool is_textured) {
        const std::size_t count = part.triangles.size();
        const bool has_colors = !colors_.empty() || !part.colors.empty();
        const bool has_texcoords = is_textured && (!texcoords_.empty() || has_any_texcoord(part));
        made.positions.reserve(3 * count);
        made.triangles.reserve(count);
        if (has_colors) made.colors.reserve(3 * count);
        if (has_texcoords) made.texcoords.reserve(3 * count);
        for (std::size_t i = 0; i < count; ++i) {
            const auto first = static_cast<std::uint32_t>(3 * i);
            made.triangles.emplace_back(first, first + 1, first + 2);
            for (glm::length_t k = 0; k < 3; ++k) {
                const std::uint32_t v = part.triangles[i][k];
                made.positions.push_back(positions_[v]);
                if (has_colors) {
                    const bool is_of_face = !part.colors.empty() && part.colors[i] != no_face_color;
                    made.colors.push_back(is_of_face ? part.colors[i] : colors_.empty() ? default_color : colors_[v]);
                }
                if (has_texcoords) made.texcoords.push_back(turned(texcoord_of(part, i, k, v)));
            }
        }
        part.triangles = {};
    }
    [[nodiscard]] static bool has_any_texcoord(const corner_values& part) {
        return std::any_of(part.texcoords.begin(), part.texcoords.end(), [](const glm::uvec3& t) {
            return t.x != mesh_corner::none || t.y != mesh_corner::none || t.z != mesh_corner::none;
        });
    }
    [[nodiscard]] glm::vec2 texcoord_of(const corner_values& part, std::size_t i, glm::length_t k,
                                        std::uint32_t v) const {
        if (part.texcoords.empty()) return texcoords_[v];
        const std::uint32_t t = part.texcoords[i][k];
        return t != mesh_corner::none ? list_[t] : glm::vec2(0);
    }
    void spread_lines(primitive& made, const corner_values& part) const {
        const auto add = [&](std::uint32_t v) {
            made.positions.push_back(positions_[v]);
            if (!colors_.empty()) made.colors.push_back(colors_[v]);
            return static_cast<std::uint32_t>(made.positions.size() - 1);
        };
        for (const glm::uvec2& l : part.lines) {
            const std::uint32_t a = add(l.x);
            made.lines.emplace_back(a, l.x == l.y ? a : add(l.y));
        }
    }

    mesh_reader& reader_;
    const gltf_options& options_;
    bool has_colors_ = false, has_face_colors_ = false;
    bounding_box box_;
    glm::dvec3 origin_{0.0};
    std::uint32_t num_vertices_ = 0;
    std::vector<glm::dvec3> doubles_; // until all are there
    std::vector<glm::vec3> positions_;
    std::vector<glm::vec4> colors_;
    std::vector<glm::vec2> texcoords_, list_; // of vertices; of corners
    std::vector<corner_values> parts_;
    std::vector<bool> asked_for_;
    std::vector<glm::dvec3> places_;
    polygon_cutter cut_;
};

} // namespace

glm::dvec3 float_origin(const bounding_box& box) {
    glm::dvec3 origin(0);
    if (box.empty) return origin;
    constexpr double as_near = 4; // sizes from 0: two bits of a float
    for (int axis = 0; axis < 3; ++axis) {
        const double low = box.low[axis], high = box.high[axis], size = high - low;
        if (std::max(std::abs(low), std::abs(high)) <= as_near * size) continue;
        const double middle = 0.5 * low + 0.5 * high;
        const double step = size > 0 ? std::exp2(std::floor(std::log2(size))) : 0;
        origin[axis] = step > 0 ? step * std::nearbyint(middle / step) : middle;
    }
    return origin;
}

scene scene_of(mesh_reader& reader, const std::filesystem::path& file, const gltf_limits& limits,
               const gltf_options& options, const load_hooks& hooks) {
    scene result;
    assimp::model named; // its textures alone
    std::vector<bool> asked_for;
    {
        scene_builder builder(reader, options);
        builder.read();
        asked_for = builder.asked_for();
        builder.move_to(result);
    }
    const mesh_description& read = reader.description();
    result.materials = read.materials;
    result.warnings = read.warnings;
    named.textures = read.textures;
    named.textures.resize(read.materials.size());
    named.files = read.files;
    assimp::name_files(named, options);
    std::uint64_t unusable = 0;
    for (const primitive& part : result.primitives)
        unusable += static_cast<std::uint64_t>(std::count_if(part.positions.begin(), part.positions.end(),
                                                             [](const glm::vec3& p) { return !is_finite(p); }));
    if (unusable != 0) result.warnings.push_back(std::to_string(unusable) + ' ' + not_finite);
    if (hooks.geometry) hooks.geometry(result);
    gltf::budget memory{limits};
    assimp::load_pictures(named, asked_for, gltf::folder_reader(file.parent_path()), memory, result, hooks);
    for (primitive& part : result.primitives)
        if (result.materials[part.material].texture == material::no_texture) part.texcoords = {};
    return result;
}

} // namespace voxelize
