// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "mesh_stream.hpp"

#include "mesh_scene.hpp"
#include "mesh_values.hpp"
#include "model/scratch_bytes.hpp"
#include "polygon.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf/resources.hpp"
#include "stored_vertices.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

constexpr std::size_t block_triangles = 16384;

// The model has what is not streamed.
struct refusal : model_error {
    using model_error::model_error;
};

template <class T>
std::span<const std::byte> as_stored(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

class mesh_stream : public triangle_stream, private mesh_sink {
public:
    mesh_stream(std::unique_ptr<mesh_reader> reader, const std::filesystem::path& file, std::uint64_t room,
                std::filesystem::path folder, const gltf_limits& limits, const gltf_options& options)
        : reader_(std::move(reader)), file_(file), folder_(std::move(folder)), limits_(limits), options_(options),
          vertices_(file, folder_) {
        const mesh_description& read = reader_->description();
        has_vertex_colors_ = read.has_vertex_colors && options_.colors;
        has_vertex_texcoords_ = read.has_vertex_texcoords;
        has_face_colors_ = read.has_face_colors && options_.colors;
        has_corner_texcoords_ = read.has_corner_texcoords;
        vertices_.begin(*reader_, options_.colors, *this);
        if (!reader_->reads_faces_again()) triangles_.emplace(folder_);
        reader_->read_faces(*this);
        finish(room);
    }

    [[nodiscard]] std::uint64_t num_vertices() const override {
        return shares_ ? vertices_.count() : 3 * num_triangles();
    }
    [[nodiscard]] double held_bytes() const override {
        const auto value_bytes =
            static_cast<double>((has_colors() ? sizeof(glm::vec4) : 0) + (has_texcoords() ? sizeof(glm::vec2) : 0));
        const double while_read = 48 + value_bytes; // of a vertex
        return 36 * static_cast<double>(num_triangles()) + (36 + value_bytes) * static_cast<double>(num_vertices()) +
               (shares_ ? 0 : while_read * static_cast<double>(vertices_.count()) / 2);
    }
    [[nodiscard]] bool has_colors() const override { return has_colors_; }
    void read_part(std::size_t part, const visitor& visit) override;
    void read_textures(const picture_hook& take) override;

private:
    struct run {
        std::uint64_t first = 0, count = 0; // of triangles in their temporary file
        std::uint32_t part = 0;             // of the reader
    };

    [[nodiscard]] std::optional<std::uint64_t> count_not_finite() override {
        if (!shares_) return std::nullopt;
        return vertices_.count_not_finite();
    }

    // ---- What the reader gives
    void vertex(const mesh_vertex& v) override { vertices_.add(v); }
    void texcoord(const glm::vec2& value) override { vertices_.add_texcoord(value); }
    void face(const mesh_face& f) override;
    void line(std::uint32_t, std::span<const std::uint32_t>) override {
        throw refusal("it has lines or points, which are not streamed");
    }
    void triangle(const mesh_face& f, const mesh_corner& a, const mesh_corner& b, const mesh_corner& c);
    void own_triangle(const mesh_face& f, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

    void finish(std::uint64_t room);
    void read_stored(std::size_t part);
    void add_corner(const mesh_corner& c, const std::optional<glm::vec4>& color);
    void add_position(const glm::vec3& p, const std::optional<glm::vec4>& color);
    void end_triangle();
    void flush();

    std::unique_ptr<mesh_reader> reader_;
    std::filesystem::path file_, folder_;
    gltf_limits limits_;
    gltf_options options_;
    stored_vertices vertices_;
    std::optional<scratch_bytes> triangles_;
    bool shares_ = false, has_colors_ = false;
    bool has_vertex_colors_ = false, has_face_colors_ = false, has_vertex_texcoords_ = false,
         has_corner_texcoords_ = false, has_own_positions_ = false;
    std::vector<run> runs_;
    std::uint64_t num_copied_ = 0;            // triangles in their temporary file
    std::vector<bool> has_any_texcoord_;      // by the reader's part
    std::vector<std::uint64_t> counts_;       // of triangles, by the reader's part
    std::vector<std::uint32_t> source_parts_; // of the reader, by part
    assimp::model named_;                     // textures alone
    std::vector<bool> asked_for_;
    std::vector<glm::dvec3> places_;
    polygon_cutter cut_;
    // The block that is being filled.
    const visitor* visit_ = nullptr;
    std::size_t part_ = 0;
    std::uint64_t number_ = 0;
    std::vector<glm::vec3> block_corners_;
    std::vector<glm::vec4> block_colors_;
    std::vector<glm::vec2> block_texcoords_;
};

// ---- Faces

void mesh_stream::face(const mesh_face& f) {
    if (!f.positions.empty()) {
        if (f.positions.size() == 3) {
            own_triangle(f, f.positions[0], f.positions[1], f.positions[2]);
            return;
        }
        for (const glm::uvec3& t : cut_.cut(f.positions))
            own_triangle(f, f.positions[t.x], f.positions[t.y], f.positions[t.z]);
        return;
    }
    if (f.corners.size() == 3) {
        triangle(f, f.corners[0], f.corners[1], f.corners[2]);
        return;
    }
    if (visit_ == nullptr && reader_->reads_faces_again()) { // only their number counts now
        counts_.resize(std::max<std::size_t>(counts_.size(), f.part + std::size_t{1}));
        counts_[f.part] += f.corners.size() - 2;
        has_any_texcoord_.resize(counts_.size());
        return;
    }
    if (visit_ == nullptr) vertices_.open_positions();
    places_.clear();
    for (const mesh_corner& c : f.corners) places_.emplace_back(vertices_.position(c.vertex));
    for (const glm::uvec3& t : cut_.cut(places_)) triangle(f, f.corners[t.x], f.corners[t.y], f.corners[t.z]);
}

void mesh_stream::own_triangle(const mesh_face& f, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    if (visit_ != nullptr) {
        for (const glm::dvec3* const p : {&a, &b, &c}) add_position(glm::vec3(*p), f.color);
        end_triangle();
        return;
    }
    std::array<mesh_corner, 3> corners;
    has_own_positions_ = true;
    if (!reader_->reads_faces_again())
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k].vertex = static_cast<std::uint32_t>(vertices_.count());
            mesh_vertex v;
            v.position = k == 0 ? a : k == 1 ? b : c;
            vertex(v);
        }
    triangle(f, corners[0], corners[1], corners[2]);
}

void mesh_stream::triangle(const mesh_face& f, const mesh_corner& a, const mesh_corner& b, const mesh_corner& c) {
    if (visit_ != nullptr) {
        for (const mesh_corner* const corner : {&a, &b, &c}) add_corner(*corner, f.color);
        end_triangle();
        return;
    }
    counts_.resize(std::max<std::size_t>(counts_.size(), f.part + std::size_t{1}));
    ++counts_[f.part];
    has_any_texcoord_.resize(counts_.size());
    for (const mesh_corner* const corner : {&a, &b, &c})
        if (corner->texcoord != mesh_corner::none) has_any_texcoord_[f.part] = true;
    if (!triangles_) return;
    if (runs_.empty() || runs_.back().part != f.part) runs_.push_back({num_copied_, 0, f.part});
    ++runs_.back().count;
    ++num_copied_;
    triangles_->append(as_stored(glm::uvec3(a.vertex, b.vertex, c.vertex)));
    if (has_corner_texcoords_) triangles_->append(as_stored(glm::uvec3(a.texcoord, b.texcoord, c.texcoord)));
    if (has_face_colors_) triangles_->append(as_stored(f.color.value_or(no_face_color)));
}

void mesh_stream::finish(std::uint64_t room) {
    const mesh_description& read = reader_->description();
    materials_ = read.materials;
    warnings_ = read.warnings;
    named_.textures = read.textures;
    named_.textures.resize(materials_.size());
    named_.files = read.files;
    assimp::name_files(named_, options_);
    asked_for_ = asked_for_textures(read, options_);
    std::uint64_t first = 0;
    bool any_texture = false;
    for (std::uint32_t n = 0; n < counts_.size(); ++n) {
        if (counts_[n] == 0) continue;
        const std::uint32_t shown = read.parts[n].material;
        const bool has_texcoords =
            asked_for_[shown] && (has_vertex_texcoords_ || (has_corner_texcoords_ && has_any_texcoord_[n]));
        any_texture = any_texture || asked_for_[shown];
        parts_.push_back({read.parts[n].name, {}, shown, first, counts_[n], has_texcoords});
        source_parts_.push_back(n);
        first += counts_[n];
    }
    has_colors_ = has_vertex_colors_ || has_face_colors_;
    shares_ = parts_.size() == 1 && !has_face_colors_ && !(has_corner_texcoords_ && any_texture) && !has_own_positions_;
    vertices_.open(room, std::any_of(parts_.begin(), parts_.end(), [](const part& p) { return p.has_texcoords; }));
    for (part& p : parts_) p.to_world = translation(vertices_.origin());
}

// ---- Blocks

void mesh_stream::add_position(const glm::vec3& p, const std::optional<glm::vec4>& color) {
    block_corners_.push_back(p);
    if (has_colors_) block_colors_.push_back(color.value_or(default_color));
}

void mesh_stream::add_corner(const mesh_corner& c, const std::optional<glm::vec4>& color) {
    block_corners_.push_back(vertices_.position(c.vertex));
    if (has_colors_)
        block_colors_.push_back(color ? *color : vertices_.has_colors() ? vertices_.color(c.vertex) : default_color);
    if (!parts_[part_].has_texcoords) return;
    if (has_corner_texcoords_)
        block_texcoords_.push_back(c.texcoord != mesh_corner::none ? vertices_.corner_texcoord(c.texcoord)
                                                                   : turned({0, 0}));
    else
        block_texcoords_.push_back(vertices_.texcoord(c.vertex));
}

void mesh_stream::end_triangle() {
    if (block_corners_.size() >= 3 * block_triangles) flush();
}

void mesh_stream::flush() {
    if (block_corners_.empty()) return;
    (*visit_)({part_, number_, block_corners_, block_colors_, block_texcoords_});
    number_ += block_corners_.size() / 3;
    block_corners_.clear();
    block_colors_.clear();
    block_texcoords_.clear();
}

void mesh_stream::read_stored(std::size_t part) {
    const std::size_t bytes =
        sizeof(glm::uvec3) * (has_corner_texcoords_ ? 2 : 1) + (has_face_colors_ ? sizeof(glm::vec4) : 0);
    std::vector<char> raw;
    for (const run& r : runs_) {
        if (r.part != source_parts_[part]) continue;
        for (std::uint64_t done = 0; done < r.count;) {
            const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block_triangles, r.count - done));
            raw.resize(count * bytes);
            triangles_->read((r.first + done) * bytes, raw);
            for (std::size_t i = 0; i < count; ++i) {
                const char* from = raw.data() + i * bytes;
                glm::uvec3 vertices, texcoords(mesh_corner::none);
                std::memcpy(&vertices, from, sizeof(vertices));
                from += sizeof(vertices);
                if (has_corner_texcoords_) {
                    std::memcpy(&texcoords, from, sizeof(texcoords));
                    from += sizeof(texcoords);
                }
                std::optional<glm::vec4> color;
                if (has_face_colors_) std::memcpy(&color.emplace(), from, sizeof(glm::vec4));
                if (color == no_face_color) color.reset();
                for (glm::length_t k = 0; k < 3; ++k) add_corner({vertices[k], texcoords[k]}, color);
                end_triangle();
            }
            done += count;
        }
    }
}

void mesh_stream::read_part(std::size_t part, const visitor& visit) {
    part_ = part;
    number_ = parts_[part].first_number;
    visit_ = &visit;
    const struct at_end {
        mesh_stream& owner;
        ~at_end() {
            owner.visit_ = nullptr;
            owner.block_corners_.clear();
            owner.block_colors_.clear();
            owner.block_texcoords_.clear();
        }
    } end{*this};
    if (triangles_)
        read_stored(part);
    else
        reader_->read_faces(*this);
    flush();
}

void mesh_stream::read_textures(const picture_hook& take) {
    gltf::budget memory{limits_};
    scene shown;
    shown.materials = materials_;
    assimp::load_pictures(named_, asked_for_, gltf::folder_reader(file_.parent_path()), memory, shown, {{}, take});
    materials_ = std::move(shown.materials);
    textures_ = std::move(shown.textures);
    images_ = std::move(shown.images);
    warnings_.insert(warnings_.end(), shown.warnings.begin(), shown.warnings.end());
    for (part& one : parts_)
        one.has_texcoords = one.has_texcoords && materials_[one.material].texture != material::no_texture;
}

} // namespace

opened_stream stream_of(std::unique_ptr<mesh_reader> reader, const std::filesystem::path& file, const stream_room& room,
                        const std::filesystem::path& folder, const gltf_limits& limits, const gltf_options& options) {
    opened_stream opened;
    try {
        opened.stream = std::make_unique<mesh_stream>(std::move(reader), file, room.stream, folder, limits, options);
    } catch (const refusal& why) {
        opened.refusal = std::string("it cannot be streamed: ") + why.what();
    }
    return opened;
}

} // namespace voxelize
