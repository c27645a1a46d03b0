// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "ply_reader.hpp"

#include "faults.hpp"
#include "model/model_error.hpp"
#include "ply_records.hpp"
#include "read/assimp/linear_color.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

// The colour among an element's properties.
class ply_color {
public:
    ply_color() = default;
    explicit ply_color(const ply_element& element) {
        for (const auto& names : {std::array{"red", "green", "blue", "alpha"},
                                  {"r", "g", "b", "a"},
                                  {"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"}}) {
            if (!element.find({names[0]}) || !element.find({names[1]}) || !element.find({names[2]})) continue;
            for (std::size_t c = 0; c < 4; ++c) place_[c] = element.find({names[c]});
            type_ = element.properties[*place_[0]].type;
            break;
        }
        if (!is_float(type_)) greatest_ = 255;
    }

    [[nodiscard]] bool is_there() const { return place_[0].has_value(); }
    // True if the numbers themselves say what their greatest is: 255, or that of their type.
    [[nodiscard]] bool has_open_range() const {
        return is_there() && !is_float(type_) && type_ != ply_type::uint8 && type_ != ply_type::int8;
    }
    void look_at(const ply_record& record) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = record[*place_[c]][0];
            if (value > 255) greatest_ = std::max(greatest_, value > 65535 ? 4294967295.0 : 65535.0);
        }
    }
    [[nodiscard]] glm::vec4 value(const ply_record& record) const {
        glm::vec4 color = default_color;
        const auto part = [&](std::size_t c) {
            return static_cast<float>(record[*place_[c]][0]) / static_cast<float>(greatest_);
        };
        for (std::size_t c = 0; c < 3; ++c) color[static_cast<glm::length_t>(c)] = assimp::linear_of(part(c));
        if (place_[3])
            if (const float alpha = part(3); alpha >= 0 && alpha <= 1) color.a = alpha;
        return color;
    }
    // Where a stream reads colours of the element; nothing where it cannot read them so.
    [[nodiscard]] std::optional<color_layout> layout(const ply_element& element) const {
        color_layout made;
        made.has_alpha = place_[3].has_value();
        made.is_encoded = true;
        made.type = type_ == ply_type::uint8 ? vertex_component::byte : vertex_component::float32;
        for (std::size_t c = 0; c < (made.has_alpha ? 4 : 3); ++c) {
            if (element.properties[*place_[c]].type != type_) return std::nullopt;
            made.place[c] = element.bytes_before(*place_[c]);
        }
        if (type_ != ply_type::uint8 && type_ != ply_type::float32) return std::nullopt;
        return made;
    }

private:
    std::array<std::optional<std::size_t>, 4> place_;
    ply_type type_ = ply_type::uint8;
    double greatest_ = 1;
};

class ply_reader : public mesh_reader {
public:
    ply_reader(const std::filesystem::path& path, const gltf_options& options)
        : file_(path), faults_(options.lenient, description_.warnings), elements_(file_.header().elements) {
        const std::vector<std::string>& textures = file_.header().textures;
        for (std::size_t i = 0; i < std::max<std::size_t>(textures.size(), 1); ++i) {
            description_.parts.push_back({path.filename().string(), static_cast<std::uint32_t>(i)});
            description_.materials.emplace_back().double_sided = true;
            if (assimp::texture_source& source = description_.textures.emplace_back(); i < textures.size())
                source.path = textures[i];
        }
        find_vertices(options);
        find_faces(options);
        if (vertex_color_.has_open_range()) look_at(vertex_, vertex_color_);
        for (list& l : lists_)
            if (l.color.has_open_range()) look_at(l.element, l.color);
        find_layouts();
    }

    [[nodiscard]] std::uint64_t expected_vertices() const override {
        const std::size_t least = file_.is_text() ? 6 : std::max<std::size_t>(elements_[vertex_].bytes(), 1);
        return std::min(elements_[vertex_].count, file_.file_bytes() / least);
    }
    [[nodiscard]] std::optional<layouts> vertices_in_place() const override { return layouts_; }
    [[nodiscard]] bool reads_faces_again() const override {
        return !file_.is_text() && description_.parts.size() == 1 && !description_.has_corner_texcoords;
    }

    void read_vertices(mesh_sink& sink) override {
        ply_record record;
        std::uint64_t found = 0;
        const bool is_there = file_.go_to(vertex_);
        for (; is_there && found < elements_[vertex_].count && file_.next(vertex_, record); ++found) {
            mesh_vertex v;
            for (std::size_t a = 0; a < 3; ++a) v.position[static_cast<glm::length_t>(a)] = record[axes_[a]][0];
            if (description_.has_vertex_colors) v.color = vertex_color_.value(record);
            if (description_.has_vertex_texcoords) v.texcoord = {record[texcoord_[0]][0], record[texcoord_[1]][0]};
            sink.vertex(v);
        }
        faults_.promise("vertices", elements_[vertex_].count, found, file_.end_place());
        num_vertices_ = found;
    }

    void read_faces(mesh_sink& sink) override {
        if (layouts_) num_vertices_ = elements_[vertex_].count;
        if (!has_faces_)
            for (std::uint32_t v = 0; v < num_vertices_; ++v) sink.line(0, {&v, 1});
        for (const list& l : lists_) {
            ply_record record;
            const std::uint64_t count = elements_[l.element].count;
            std::uint64_t found = 0;
            const bool is_there = file_.go_to(l.element);
            for (; is_there && found < count && file_.next(l.element, record); ++found) {
                if (l.is_strips)
                    read_strips(l, record, found, sink);
                else
                    read_face(l, record, found, sink);
            }
            faults_.promise(l.is_strips ? "lists of strips" : "faces", count, found, file_.end_place());
        }
        faults_.finish();
    }

private:
    // Faces, or strips of triangles.
    struct list {
        std::size_t element = 0, indices = 0;
        bool is_strips = false;
        ply_color color;
        std::optional<std::size_t> texcoords, texture; // of corners; its number
    };

    void find_vertices(const gltf_options& options) {
        const auto found = std::find_if(elements_.begin(), elements_.end(), [](const ply_element& e) {
            return e.name == "vertex" && e.find({"x"}) && e.find({"y"}) && e.find({"z"});
        });
        if (found == elements_.end())
            throw model_error("the PLY header has no element vertex with properties x, y and z");
        vertex_ = static_cast<std::size_t>(found - elements_.begin());
        if (found->count >= UINT32_MAX) throw model_error("the header promises more vertices than can be numbered");
        axes_ = {*found->find({"x"}), *found->find({"y"}), *found->find({"z"})};
        // Text may have more digits than its type.
        description_.is_double = file_.is_text();
        for (const std::size_t a : axes_) {
            const ply_type type = found->properties[a].type;
            description_.is_double = description_.is_double || (type != ply_type::float32 && bytes_of(type) >= 4);
        }
        vertex_color_ = ply_color(*found);
        description_.has_vertex_colors = options.colors && vertex_color_.is_there();
        const auto u = found->find({"s", "u", "texture_u", "texture_s"}),
                   v = found->find({"t", "v", "texture_v", "texture_t"});
        if (!u || !v || file_.header().textures.empty()) return;
        description_.has_vertex_texcoords = true;
        texcoord_ = {*u, *v};
    }

    void find_faces(const gltf_options& options) {
        for (std::size_t e = 0; e < elements_.size(); ++e) {
            const ply_element& element = elements_[e];
            if (element.name != "face" && element.name != "tristrips") continue;
            list made;
            made.element = e;
            made.is_strips = element.name == "tristrips";
            std::optional<std::size_t> indices =
                element.find({"vertex_indices", "vertex_index", "vertex_indexes"}, true);
            for (std::size_t p = 0; !indices && p < element.properties.size(); ++p)
                if (element.properties[p].length && !is_float(element.properties[p].type)) indices = p;
            if (!indices && element.count != 0)
                throw model_error("the element " + element.name + " of the PLY header has no list vertex_indices");
            if (element.count == 0) continue;
            has_faces_ = true;
            made.indices = *indices;
            if (options.colors) made.color = ply_color(element);
            if (!file_.header().textures.empty()) {
                made.texcoords = element.find({"texcoord", "texcoords"}, true);
                made.texture = element.find({"texnumber"});
            }
            description_.has_face_colors = description_.has_face_colors || made.color.is_there();
            if (made.texcoords) description_.has_corner_texcoords = true;
            lists_.push_back(made);
        }
        if (description_.has_corner_texcoords) description_.has_vertex_texcoords = false;
    }

    void look_at(std::size_t element, ply_color& color) {
        ply_record record;
        if (!file_.go_to(element)) return;
        for (std::uint64_t i = 0; i < elements_[element].count && file_.next(element, record); ++i)
            color.look_at(record);
    }

    void find_layouts() {
        const ply_element& vertex = elements_[vertex_];
        if (file_.header().format != ply_header::encoding::little_endian || vertex.has_list()) return;
        const std::optional<std::uint64_t> first = file_.offset_of(vertex_);
        if (!first || vertex.count > (file_.file_bytes() - *first) / vertex.bytes()) return;
        layouts made;
        const auto place = [&](auto& layout) {
            layout.first = *first;
            layout.count = vertex.count;
            layout.stride = vertex.bytes();
        };
        place(made.positions);
        for (std::size_t a = 0; a < 3; ++a) {
            if (!is_float(vertex.properties[axes_[a]].type)) return;
            made.positions.place[a] = vertex.bytes_before(axes_[a]);
            made.positions.is_double[a] = vertex.properties[axes_[a]].type == ply_type::float64;
        }
        if (description_.has_vertex_colors) {
            made.colors = vertex_color_.layout(vertex);
            if (!made.colors) return;
            place(*made.colors);
        }
        if (description_.has_vertex_texcoords) {
            const std::size_t u = vertex.bytes_before(texcoord_[0]), v = vertex.bytes_before(texcoord_[1]);
            for (const std::size_t t : texcoord_)
                if (vertex.properties[t].type != ply_type::float32) return;
            if (v != u + sizeof(float)) return;
            place(made.texcoords.emplace());
            made.texcoords->first += u;
        }
        layouts_ = made;
    }

    [[nodiscard]] bool names_vertex(double index) const {
        return index >= 0 && index < static_cast<double>(num_vertices_) && index == std::floor(index);
    }
    void refuse_index(const list& l, std::uint64_t number, double index) {
        char text[32];
        std::snprintf(text, sizeof(text), "%.15g", index);
        faults_.accept(file_.record_place() + ": " + (l.is_strips ? "list " : "face ") + std::to_string(number) +
                           " names a vertex " + text +
                           (num_vertices_ == 0 ? ", and there are none"
                                               : ", and 0 to " + std::to_string(num_vertices_ - 1) + " were expected"),
                       l.is_strips ? "the triangle is left out" : "the face is left out");
    }

    void read_face(const list& l, const ply_record& record, std::uint64_t number, mesh_sink& sink) {
        const std::vector<double>& indices = record[l.indices];
        corners_.clear();
        for (const double index : indices) {
            if (!names_vertex(index)) {
                refuse_index(l, number, index);
                return;
            }
            corners_.push_back({static_cast<std::uint32_t>(index), mesh_corner::none});
        }
        const std::uint32_t part = part_of(l, record);
        if (corners_.size() < 3) {
            line_.clear();
            for (const mesh_corner& c : corners_) line_.push_back(c.vertex);
            if (!line_.empty()) sink.line(part, line_);
            return;
        }
        if (l.texcoords)
            if (const std::vector<double>& values = record[*l.texcoords]; values.size() == 2 * corners_.size())
                for (std::size_t i = 0; i < corners_.size(); ++i) {
                    sink.texcoord({values[2 * i], values[2 * i + 1]});
                    corners_[i].texcoord = num_texcoords_++;
                }
        mesh_face face;
        face.part = part;
        face.corners = corners_;
        if (l.color.is_there()) face.color = l.color.value(record);
        sink.face(face);
    }

    // -1 begins a new strip; triangles that name a vertex twice join strips.
    void read_strips(const list& l, const ply_record& record, std::uint64_t number, mesh_sink& sink) {
        const std::vector<double>& indices = record[l.indices];
        std::size_t first = 0;
        for (std::size_t i = 0; i < indices.size(); ++i) {
            if (indices[i] == -1 || (indices[i] == 4294967295.0 && num_vertices_ < UINT32_MAX)) {
                first = i + 1;
                continue;
            }
            if (i < first + 2) continue;
            const bool is_turned = (i - first) % 2 != 0;
            const double a = indices[is_turned ? i - 1 : i - 2], b = indices[is_turned ? i - 2 : i - 1], c = indices[i];
            if (a == b || b == c || a == c) continue;
            corners_.clear();
            for (const double index : {a, b, c}) {
                if (!names_vertex(index)) {
                    refuse_index(l, number, index);
                    break;
                }
                corners_.push_back({static_cast<std::uint32_t>(index), mesh_corner::none});
            }
            if (corners_.size() < 3) continue;
            mesh_face face;
            face.part = part_of(l, record);
            face.corners = corners_;
            if (l.color.is_there()) face.color = l.color.value(record);
            sink.face(face);
        }
    }

    [[nodiscard]] std::uint32_t part_of(const list& l, const ply_record& record) const {
        if (!l.texture) return 0;
        const double number = record[*l.texture][0];
        return number >= 0 && number < static_cast<double>(description_.parts.size())
                   ? static_cast<std::uint32_t>(number)
                   : 0;
    }

    ply_records file_;
    mesh_faults faults_;
    const std::vector<ply_element>& elements_;
    std::size_t vertex_ = 0;
    std::array<std::size_t, 3> axes_{};
    std::array<std::size_t, 2> texcoord_{};
    ply_color vertex_color_;
    std::vector<list> lists_;
    bool has_faces_ = false;
    std::optional<layouts> layouts_;
    std::uint64_t num_vertices_ = 0;
    std::uint32_t num_texcoords_ = 0;
    std::vector<mesh_corner> corners_;
    std::vector<std::uint32_t> line_;
};

} // namespace

std::unique_ptr<mesh_reader> open_ply(const std::filesystem::path& path, const gltf_options& options) {
    return std::make_unique<ply_reader>(path, options);
}

} // namespace voxelize
