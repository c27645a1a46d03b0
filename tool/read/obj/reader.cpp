// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "reader.hpp"

#include "lines.hpp"
#include "materials.hpp"
#include "model/model_error.hpp"
#include "read/assimp/linear_color.hpp"
#include "read/gltf/resources.hpp"
#include "read/gltf/text.hpp"
#include "read/mesh/number.hpp"
#include "statements.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

namespace voxelize {
namespace obj {
namespace {

class text_reader : public mesh_reader {
public:
    text_reader(std::filesystem::path path, const gltf_options& options)
        : path_(std::move(path)), is_lenient_(options.lenient), wants_colors_(options.colors) {
        if (gltf::checked_file_size(path_, gltf_limits{}.max_file_bytes) == 0) throw model_error("the file is empty");
        description_.is_double = true;
        read_outline(options);
    }

    [[nodiscard]] std::uint64_t expected_vertices() const override { return counts_.vertices; }
    [[nodiscard]] std::uint64_t expected_faces() const override { return counts_.faces; }
    void read_vertices(mesh_sink& sink) override;
    void read_faces(mesh_sink& sink) override;

private:
    void read_outline(const gltf_options& options);
    void warn_of_statements(const std::map<statement, std::pair<std::uint64_t, std::string>>& left_out);
    void vertex(std::string_view rest, std::string_view line, std::uint64_t number, mesh_sink& sink);
    void element(statement kind, std::string_view rest, std::string_view line, std::uint64_t number, mesh_sink& sink);
    // A face, line or point, or a vertex, that cannot be read; the first is told.
    void refuse(std::string what);

    // Where the outline and read_faces() are in the file: what is named, and the part that this is.
    struct place {
        std::string object, group;
        std::uint32_t material = 0; // of material_list::use()
        std::optional<std::uint32_t> part;
    };
    using part_key = std::tuple<std::string, std::string, std::uint32_t>;
    // True if a line of this kind, whose REST it is, moves AT elsewhere.
    static bool move(place& at, statement kind, std::string_view rest, material_list& names);
    [[nodiscard]] std::uint32_t part_at(place& at);

    std::filesystem::path path_;
    bool is_lenient_, wants_colors_;
    std::optional<material_list> names_;
    std::map<part_key, std::uint32_t> part_numbers_;
    obj_counts counts_;
    std::uint64_t vertices_before_ = 0, texcoords_before_ = 0; // the line that read_faces() reads
    std::uint64_t refused_ = 0;
    std::string first_refused_;
    place at_;
    std::vector<mesh_corner> corners_;
    std::vector<std::uint32_t> ends_; // of a line
};

void text_reader::refuse(std::string what) {
    if (refused_++ == 0) first_refused_ = std::move(what);
}

bool text_reader::move(place& at, statement kind, std::string_view rest, material_list& names) {
    if (kind == statement::object) {
        at.object = trimmed(rest);
        at.group.clear();
    } else if (kind == statement::group) {
        at.group = trimmed(rest);
    } else if (kind == statement::material) {
        at.material = names.use(rest);
    } else {
        return false;
    }
    at.part.reset();
    return true;
}

std::uint32_t text_reader::part_at(place& at) {
    if (at.part) return *at.part;
    const auto [found, is_new] = part_numbers_.try_emplace(part_key{at.object, at.group, at.material},
                                                           static_cast<std::uint32_t>(description_.parts.size()));
    if (is_new) {
        const std::string name = !at.group.empty() ? at.group : at.object;
        description_.parts.push_back({gltf::printable(name.empty() ? path_.filename().string() : name), at.material});
    }
    at.part = found->second;
    return found->second;
}

void text_reader::read_outline(const gltf_options& options) {
    names_.emplace(path_.parent_path(), options);
    place at;
    at.material = names_->use("");
    std::map<statement, std::pair<std::uint64_t, std::string>> left_out; // number of lines, and the first
    line_reader lines(path_);
    for (std::string_view line; lines.next(line);) {
        std::string_view rest = line;
        const statement kind = statement_of(rest);
        switch (kind) {
        case statement::vertex:
            ++counts_.vertices;
            if (!description_.has_vertex_colors && wants_colors_) {
                int numbers = 0;
                std::string_view from = before_comment(rest);
                while (!next_word(from).empty()) ++numbers;
                description_.has_vertex_colors = numbers == 6 || numbers == 7;
            }
            break;
        case statement::texcoord:
            ++counts_.texcoords;
            break;
        case statement::face:
            ++counts_.faces;
            [[fallthrough]];
        case statement::line:
        case statement::point:
            ++counts_.elements;
            (void)part_at(at);
            break;
        case statement::library:
            names_->add_libraries(rest);
            break;
        case statement::surface:
        case statement::curve:
        case statement::call:
        case statement::unknown: {
            auto& [count, first] = left_out[kind];
            if (count++ == 0) first = cited(lines.number(), line);
            break;
        }
        default:
            (void)move(at, kind, rest, *names_);
        }
    }
    if (std::max(counts_.vertices, counts_.texcoords) >= mesh_corner::none)
        throw model_error("there are " + std::to_string(std::max(counts_.vertices, counts_.texcoords)) +
                          " vertices, more than the " + std::to_string(mesh_corner::none - 1) +
                          " that indices of 32 bits name");
    if (counts_.vertices == 0) throw model_error("there is no vertex (a line that begins with 'v'): it is no OBJ file");
    if (counts_.elements == 0) (void)part_at(at); // of points
    names_->read_libraries(path_);
    for (mesh_part& part : description_.parts) part.material = names_->material_of(part.material);
    description_.materials = std::move(names_->materials);
    description_.textures = std::move(names_->textures);
    description_.files = std::move(names_->files);
    description_.warnings = std::move(names_->warnings);
    description_.has_corner_texcoords =
        counts_.texcoords != 0 &&
        std::any_of(description_.parts.begin(), description_.parts.end(),
                    [&](const mesh_part& part) { return description_.textures[part.material].is_there(); });
    warn_of_statements(left_out);
}

void text_reader::warn_of_statements(const std::map<statement, std::pair<std::uint64_t, std::string>>& left_out) {
    for (const auto& [kind, found] : left_out) {
        const auto& [count, first] = found;
        const std::string several = count > 1 ? " (and " + std::to_string(count - 1) + " more)" : "";
        const char* what = "is not known and passed over";
        if (kind == statement::surface) what = "is a free-form surface, which is not drawn: export it as polygons";
        if (kind == statement::curve) what = "is a free-form curve, which is not drawn: export it as a line";
        if (kind == statement::call) what = "names another file, which is not read";
        std::string& warning = description_.warnings.emplace_back(first);
        warning.append(1, ' ').append(what).append(several);
    }
}

void text_reader::vertex(std::string_view rest, std::string_view line, std::uint64_t number, mesh_sink& sink) {
    constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
    std::array<double, 8> n{};
    std::size_t count = 0;
    bool is_wrong = false;
    for (std::string_view from = before_comment(rest); count < n.size(); ++count) {
        const std::string_view word = next_word(from);
        if (word.empty()) break;
        std::optional<double> value = number_of(word);
        if (!value) value = number_of(word.substr(0, word.find('#')));
        is_wrong = is_wrong || !value;
        n[count] = value.value_or(nothing);
        if (word.find('#') != std::string_view::npos && !number_of(word)) from = {};
    }
    if (count < 3)
        refuse(cited(number, line) + " has " + std::to_string(count) + " numbers, and a vertex has 3 or more");
    if (count >= 3 && is_wrong) refuse(cited(number, line) + " has a coordinate that is no number");
    mesh_vertex v;
    v.position = count < 3 ? glm::dvec3(nothing) : glm::dvec3(n[0], n[1], n[2]);
    // Three more numbers are a colour, a fourth its alpha. One alone is the weight of a free-form curve's point.
    if (count == 6 || count == 7) {
        const auto is_whole = [](double value) { return value == std::floor(value) && value <= 255; };
        const bool is_byte = std::max({n[3], n[4], n[5]}) >= 2 && is_whole(n[3]) && is_whole(n[4]) && is_whole(n[5]);
        const double scale = is_byte ? 255 : 1;
        for (glm::length_t c = 0; c < 3; ++c)
            v.color[c] = assimp::linear_of(static_cast<float>(n[3 + static_cast<std::size_t>(c)] / scale));
        const double alpha = count == 7 ? n[6] / (is_byte && n[6] > 1 ? 255 : 1) : 1;
        v.color.a = alpha >= 0 && alpha <= 1 ? static_cast<float>(alpha) : 1;
    }
    sink.vertex(v);
}

void text_reader::read_vertices(mesh_sink& sink) {
    line_reader lines(path_);
    obj_counts found;
    for (std::string_view line; lines.next(line);) {
        std::string_view rest = line;
        const statement kind = statement_of(rest);
        if (kind == statement::vertex && found.vertices++ < counts_.vertices) vertex(rest, line, lines.number(), sink);
        if (kind != statement::texcoord || !description_.has_corner_texcoords) continue;
        if (found.texcoords++ >= counts_.texcoords) continue;
        glm::vec2 value(0);
        for (glm::length_t k = 0; k < 2; ++k) {
            const auto number = static_cast<float>(number_of(next_word(rest)).value_or(0));
            value[k] = std::isfinite(number) ? number : 0;
        }
        sink.texcoord(value);
    }
    if (found.vertices != counts_.vertices ||
        (description_.has_corner_texcoords && found.texcoords != counts_.texcoords))
        throw model_error("the file changes while it is read");
    if (refused_ == 0) return;
    const std::string numbers = std::to_string(counts_.vertices - refused_) + " of the file's " +
                                std::to_string(counts_.vertices) + " vertices can be read";
    if (!is_lenient_) {
        model_error error(first_refused_ + "; " + numbers);
        error.lenient_helps = true;
        throw error;
    }
    description_.warnings.push_back(first_refused_ + "; " + numbers);
    refused_ = 0;
}

void text_reader::element(statement kind, std::string_view rest, std::string_view line, std::uint64_t number,
                          mesh_sink& sink) {
    const bool is_face = kind == statement::face;
    corners_.clear();
    ends_.clear();
    for (std::string_view from = rest.substr(0, rest.find('#'));;) {
        const std::string_view word = next_word(from);
        if (word.empty()) break;
        const std::optional<corner_indices> found = corner_in(word);
        const std::optional<std::uint64_t> index = found ? resolve(found->vertex, vertices_before_) : std::nullopt;
        if (!index || *index >= counts_.vertices) {
            refuse(cited(number, line) + " has an invalid vertex index" +
                   (found ? ": there are " + std::to_string(counts_.vertices) + " vertices" : ""));
            return;
        }
        const auto vertex = static_cast<std::uint32_t>(*index);
        if (!is_face) {
            ends_.push_back(vertex);
            continue;
        }
        mesh_corner& corner = corners_.emplace_back();
        corner.vertex = vertex;
        if (!description_.has_corner_texcoords || found->texcoord == 0) continue;
        const std::optional<std::uint64_t> texcoord = resolve(found->texcoord, texcoords_before_);
        // A file may name texture coordinates that it does not have: the surface is there all the same.
        if (texcoord && *texcoord < counts_.texcoords) corner.texcoord = static_cast<std::uint32_t>(*texcoord);
    }
    const std::size_t count = is_face ? corners_.size() : ends_.size();
    if (count < (is_face ? 3U : 1U)) {
        refuse(cited(number, line) + " names " + std::to_string(count) +
               (is_face ? " vertices, and a face has 3 or more" : " vertices"));
        return;
    }
    const std::uint32_t part = part_at(at_);
    if (is_face)
        sink.face({part, corners_});
    else if (kind == statement::line)
        sink.line(part, ends_);
    else
        for (const std::uint32_t& point : ends_) sink.line(part, {&point, 1});
}

void text_reader::read_faces(mesh_sink& sink) {
    at_ = {};
    at_.material = names_->use("");
    vertices_before_ = texcoords_before_ = 0;
    const std::size_t num_parts = description_.parts.size();
    if (counts_.elements == 0)
        for (std::uint64_t v = 0; v < counts_.vertices; ++v) {
            const auto point = static_cast<std::uint32_t>(v);
            sink.line(0, {&point, 1});
        }
    std::uint64_t elements = 0;
    line_reader lines(path_);
    for (std::string_view line; counts_.elements != 0 && lines.next(line);) {
        std::string_view rest = line;
        const statement kind = statement_of(rest);
        if (kind == statement::vertex) ++vertices_before_;
        if (kind == statement::texcoord) ++texcoords_before_;
        if (kind == statement::face || kind == statement::line || kind == statement::point) {
            ++elements;
            element(kind, rest, line, lines.number(), sink);
        } else {
            (void)move(at_, kind, rest, *names_);
        }
        if (vertices_before_ > counts_.vertices || description_.parts.size() != num_parts)
            throw model_error("the file changes while it is read");
    }
    if (elements != counts_.elements) throw model_error("the file changes while it is read");
    if (refused_ == 0) return;
    const std::string numbers = "the file has " + std::to_string(elements) +
                                (elements == counts_.faces ? " lines 'f', and " : " lines 'f', 'l' and 'p', and ") +
                                std::to_string(elements - refused_) + " of them can be read";
    const std::string what = first_refused_ + "; " + numbers;
    if (!is_lenient_) {
        model_error error(what);
        error.lenient_helps = true;
        throw error;
    }
    description_.warnings.push_back(what);
    refused_ = 0;
}

} // namespace

void for_each_library_line(const std::filesystem::path& path, const std::function<void(std::string_view)>& visit) {
    line_reader lines(path);
    for (std::string_view line; lines.next(line);) {
        std::string_view rest = line;
        if (statement_of(rest) == statement::library) visit(rest);
    }
}

} // namespace obj

obj_counts count_obj(const std::filesystem::path& path) {
    obj_counts count;
    obj::line_reader lines(path);
    for (std::string_view line; lines.next(line);) {
        std::string_view rest = line;
        const obj::statement kind = obj::statement_of(rest);
        if (kind == obj::statement::vertex) ++count.vertices;
        if (kind == obj::statement::texcoord) ++count.texcoords;
        if (kind == obj::statement::face) ++count.faces;
        if (kind != obj::statement::face && kind != obj::statement::line && kind != obj::statement::point) continue;
        ++count.elements;
        while (!obj::next_word(rest).empty()) ++count.corners;
    }
    return count;
}

std::unique_ptr<mesh_reader> open_obj(const std::filesystem::path& path, const gltf_options& options) {
    return std::make_unique<obj::text_reader>(path, options);
}

} // namespace voxelize
