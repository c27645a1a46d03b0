// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "off_reader.hpp"

#include "faults.hpp"
#include "model/model_error.hpp"
#include "number.hpp"
#include "read/assimp/linear_color.hpp"
#include "read/gltf/text.hpp"
#include "text_scanner.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

// The word in the header, and what it says a vertex has.
struct off_header {
    bool has_texcoords = false, has_colors = false, has_normals = false, is_homogeneous = false, is_n = false;
    bool is_binary = false;

    // Returns false where WORD is no header of an OFF file.
    [[nodiscard]] bool take(std::string_view word) {
        std::string text(word);
        std::transform(text.begin(), text.end(), text.begin(),
                       [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
        if (!text.ends_with("OFF")) return false;
        text.resize(text.size() - 3);
        // A small n is a number of dimensions, a large one normals; in between only the case tells.
        if (!text.empty() && word[text.size() - 1] == 'n') {
            is_n = true;
            text.pop_back();
        }
        for (std::size_t i = 0; i < text.size(); ++i) {
            if (text.compare(i, 2, "ST") == 0) {
                has_texcoords = true;
                ++i;
            } else if (text[i] == 'C') {
                has_colors = true;
            } else if (text[i] == 'N') {
                has_normals = true;
            } else if (text[i] == '4') {
                is_homogeneous = true;
            } else {
                return false;
            }
        }
        return true;
    }
    // Numbers of a vertex before its colour.
    [[nodiscard]] std::size_t before_color() const { return 3U + (is_homogeneous ? 1U : 0U) + (has_normals ? 3U : 0U); }
};

class off_reader : public mesh_reader {
public:
    off_reader(const std::filesystem::path& path, const gltf_options& options)
        : options_(options), file_(path), faults_(options.lenient, description_.warnings) {
        description_.materials.emplace_back().name = "DefaultMaterial";
        description_.textures.emplace_back();
        description_.parts.push_back({path.filename().string(), 0});
        read_header();
        description_.is_double = !header_.is_binary;
        // The first pass counts and finds what colours are.
        for_each_vertex([&](const std::vector<double>& n) { look_at(color_of_vertex(n)); });
        after_vertices_ = file_.offset();
        line_after_vertices_ = file_.line();
        const std::uint64_t found = num_found_;
        faults_.promise("vertices", num_vertices_, found, place());
        num_vertices_ = found;
        vertices_have_colors_ = any_color_;
        any_color_ = false;
        if (num_found_ == num_vertices_)
            for_each_face([&](const std::vector<std::uint64_t>&, std::span<const double> color) { look_at(color); });
        faults_.promise("faces", num_faces_, num_found_, place());
        has_faces_ = num_faces_ != 0;
        num_faces_ = num_found_;
        if (options.colors) {
            description_.has_vertex_colors = vertices_have_colors_;
            description_.has_face_colors = any_color_;
            if (num_of_map_ != 0)
                description_.warnings.push_back(
                    std::to_string(num_of_map_) +
                    " faces have a colour by its number in a map, which the file does not have: they are white");
        }
        faults_.finish();
    }

    [[nodiscard]] std::uint64_t expected_vertices() const override { return num_vertices_; }

    void read_vertices(mesh_sink& sink) override {
        for_each_vertex([&](const std::vector<double>& n) {
            mesh_vertex v;
            v.position = {n[0], n[1], n[2]};
            if (header_.is_homogeneous) v.position /= n[3];
            v.color = color_from(color_of_vertex(n)).value_or(default_color);
            sink.vertex(v);
        });
    }

    void read_faces(mesh_sink& sink) override {
        if (!has_faces_) {
            for (std::uint32_t v = 0; v < num_vertices_; ++v) sink.line(0, {&v, 1});
            return;
        }
        std::vector<mesh_corner> corners;
        std::vector<std::uint32_t> line;
        for_each_face([&](const std::vector<std::uint64_t>& face, std::span<const double> color) {
            if (face.size() < 3) {
                line.assign(face.begin(), face.end());
                if (!line.empty()) sink.line(0, line);
                return;
            }
            corners.clear();
            for (const std::uint64_t v : face) corners.push_back({static_cast<std::uint32_t>(v), mesh_corner::none});
            mesh_face made;
            made.corners = corners;
            made.color = color_from(color);
            sink.face(made);
        });
    }

private:
    // ---- Header

    void read_header() {
        std::vector<double> counts;
        bool is_first = true;
        while (counts.size() < (header_.is_n ? 3U : 2U)) {
            if (file_.at_end()) throw model_error("the file ends before the numbers of vertices and faces" + place());
            for (std::string_view word = word_of_line(); !word.empty(); word = word_of_line()) {
                if (is_first && word.starts_with("\xEF\xBB\xBF")) word.remove_prefix(3);
                if (std::exchange(is_first, false) && header_.take(word)) continue;
                if (word == "BINARY" || word == "binary") {
                    std::string_view rest;
                    (void)file_.next_line(rest);
                    header_.is_binary = true;
                    read_binary_counts();
                    return;
                }
                const std::optional<double> number = number_of(word);
                if (!number || !(*number >= 0) || *number != std::floor(*number))
                    throw model_error("line " + std::to_string(file_.word_line()) + ": " + gltf::in_quotes(word) +
                                      " is found where the numbers of vertices and faces were expected");
                counts.push_back(*number);
            }
            end_line();
        }
        if (header_.is_n) {
            if (counts[0] != 3)
                throw model_error("the vertices of this nOFF have " +
                                  std::to_string(static_cast<long long>(counts[0])) +
                                  " dimensions, and 3 were expected");
            counts.erase(counts.begin());
        }
        set_counts(counts[0], counts[1]);
        // The number of edges may stand in a line of its own, or nowhere.
        start_ = file_.offset();
        start_line_ = file_.line();
        if (counts.size() > 2) return;
        std::vector<double> line;
        if (next_numbers(line) && line.size() == 1) {
            start_ = file_.offset();
            start_line_ = file_.line();
        }
    }
    void set_counts(double vertices, double faces) {
        if (!(vertices < UINT32_MAX && faces < UINT32_MAX))
            throw model_error("the header promises more vertices or faces than can be numbered");
        num_vertices_ = static_cast<std::uint64_t>(vertices);
        num_faces_ = static_cast<std::uint64_t>(faces);
    }
    void read_binary_counts() {
        std::array<std::int32_t, 3> counts{};
        for (std::int32_t& c : counts)
            if (!next_integer(c) || c < 0)
                throw model_error("byte " + std::to_string(file_.offset()) +
                                  ": the numbers of vertices, faces and edges were expected");
        set_counts(counts[0], counts[1]);
        start_ = file_.offset();
    }
    [[nodiscard]] std::string place() {
        return header_.is_binary ? "it ends at byte " + std::to_string(file_.offset())
                                 : "it ends in line " + std::to_string(file_.line());
    }

    // ---- Text

    // The next word of this line, before a comment.
    [[nodiscard]] std::string_view word_of_line() {
        const std::string_view word = file_.next_word_of_line();
        if (!word.starts_with('#')) return word;
        return {};
    }
    void end_line() {
        std::string_view rest;
        (void)file_.next_line(rest);
    }
    // The numbers of the next line that has any. False at the end of the file.
    [[nodiscard]] bool next_numbers(std::vector<double>& numbers) {
        numbers.clear();
        return add_numbers(numbers);
    }
    [[nodiscard]] bool add_numbers(std::vector<double>& numbers) {
        const std::size_t before = numbers.size();
        while (!file_.at_end() && numbers.size() == before) {
            for (std::string_view word = word_of_line(); !word.empty(); word = word_of_line()) {
                const std::size_t comment = word.find('#');
                const std::optional<double> number = number_of(word.substr(0, comment));
                if (!number)
                    throw model_error("line " + std::to_string(file_.word_line()) + ": " + gltf::in_quotes(word) +
                                      " is found where a number was expected");
                numbers.push_back(*number);
                if (comment != std::string_view::npos) break;
            }
            end_line();
        }
        return numbers.size() != before;
    }

    // ---- Binary

    [[nodiscard]] bool next_integer(std::int32_t& value) {
        const std::string_view bytes = file_.next_bytes(sizeof(value));
        if (bytes.size() != sizeof(value)) return false;
        std::uint32_t number = 0;
        for (const char byte : bytes) number = number << 8U | static_cast<unsigned char>(byte);
        value = static_cast<std::int32_t>(number);
        return true;
    }
    [[nodiscard]] bool next_floats(std::size_t count, std::vector<double>& numbers) {
        for (std::size_t i = 0; i < count; ++i) {
            std::int32_t bits = 0;
            if (!next_integer(bits)) return false;
            numbers.push_back(static_cast<double>(std::bit_cast<float>(bits)));
        }
        return true;
    }

    // ---- Vertices and faces

    // Calls visit with the numbers of each vertex, of which num_found_ are counted.
    template <class Visit>
    void for_each_vertex(const Visit& visit) {
        file_.seek(start_, start_line_);
        std::vector<double> numbers;
        const std::size_t least = header_.before_color() + (header_.has_texcoords ? 2U : 0U);
        const std::size_t of_binary = least + (header_.has_colors ? 4U : 0U);
        for (num_found_ = 0; num_found_ < num_vertices_; ++num_found_) {
            numbers.clear();
            if (header_.is_binary) {
                if (!next_floats(of_binary, numbers)) return;
            } else {
                while (numbers.size() < least)
                    if (!add_numbers(numbers)) return;
            }
            visit(numbers);
        }
    }
    [[nodiscard]] std::span<const double> color_of_vertex(const std::vector<double>& n) const {
        std::size_t end = n.size() - (header_.has_texcoords ? 2 : 0);
        const std::size_t first = header_.before_color();
        if (!header_.is_binary && end - first != 3 && end - first != 4) end = first; // none
        return std::span(n).subspan(first, end - first);
    }
    // Calls visit with the vertices and the colour of each face, of which num_found_ are counted.
    template <class Visit>
    void for_each_face(const Visit& visit) {
        file_.seek(after_vertices_, line_after_vertices_);
        std::vector<double> numbers;
        std::vector<std::uint64_t> vertices;
        for (num_found_ = 0; num_found_ < num_faces_; ++num_found_) {
            const std::uint64_t line = file_.line(), byte = file_.offset();
            if (!(header_.is_binary ? next_binary_face(numbers) : next_face(numbers))) return;
            const auto count = static_cast<std::size_t>(numbers[0]);
            vertices.clear();
            bool is_good = true;
            for (std::size_t i = 1; i <= count && is_good; ++i) {
                is_good = numbers[i] >= 0 && numbers[i] < static_cast<double>(num_vertices_) &&
                          numbers[i] == std::floor(numbers[i]);
                if (!is_good)
                    faults_.accept(
                        (header_.is_binary ? "byte " + std::to_string(byte) : "line " + std::to_string(line)) +
                            ": face " + std::to_string(num_found_) + " names a vertex " + number_text(numbers[i]) +
                            ", and 0 to " + std::to_string(num_vertices_ - 1) + " were expected",
                        "the face is left out");
                else
                    vertices.push_back(static_cast<std::uint64_t>(numbers[i]));
            }
            if (is_good) visit(vertices, std::span(numbers).subspan(count + 1));
        }
    }
    [[nodiscard]] static std::string number_text(double value) {
        std::string text = std::to_string(value);
        return text.substr(0, text.find(".000000"));
    }
    [[nodiscard]] bool next_face(std::vector<double>& numbers) {
        if (!next_numbers(numbers)) return false;
        check_count(numbers[0], "line " + std::to_string(file_.line() - 1));
        while (static_cast<double>(numbers.size()) < numbers[0] + 1)
            if (!add_numbers(numbers)) return false;
        return true;
    }
    [[nodiscard]] bool next_binary_face(std::vector<double>& numbers) {
        numbers.clear();
        std::int32_t count = 0, index = 0, colors = 0;
        if (!next_integer(count)) return false;
        check_count(count, "byte " + std::to_string(file_.offset() - sizeof(count)));
        numbers.push_back(count);
        for (std::int32_t i = 0; i < count; ++i) {
            if (!next_integer(index)) return false;
            numbers.push_back(index);
        }
        if (!next_integer(colors)) return false;
        check_count(colors, "byte " + std::to_string(file_.offset() - sizeof(count)));
        return next_floats(static_cast<std::size_t>(colors), numbers);
    }
    void check_count(double count, const std::string& where) const {
        if (count >= 0 && count == std::floor(count) && count < static_cast<double>(file_.size())) return;
        throw model_error(where + ": " + number_text(count) + " is found where a number of things was expected");
    }

    // ---- Colours

    void look_at(std::span<const double> color) {
        if (color.size() == 1) ++num_of_map_;
        if (color.size() < 3) return;
        any_color_ = true;
        for (const double c : color.first(3)) greatest_ = std::max(greatest_, c);
    }
    // Nothing where the numbers are no colour.
    [[nodiscard]] std::optional<glm::vec4> color_from(std::span<const double> color) const {
        if (color.size() < 3) return std::nullopt;
        const float whole = greatest_ > 1 ? 255.0F : 1.0F; // fractions, unless any of the file is more
        glm::vec4 made = default_color;
        for (glm::length_t c = 0; c < 3; ++c)
            made[c] = assimp::linear_of(static_cast<float>(color[static_cast<std::size_t>(c)]) / whole);
        if (color.size() > 3) {
            const float alpha = static_cast<float>(color[3]) / (color[3] > 1 ? 255.0F : whole);
            if (alpha >= 0 && alpha <= 1) made.a = alpha;
        }
        return made;
    }

    gltf_options options_;
    text_scanner file_;
    mesh_faults faults_;
    off_header header_;
    std::uint64_t num_vertices_ = 0, num_faces_ = 0, num_found_ = 0, num_of_map_ = 0;
    std::uint64_t start_ = 0, start_line_ = 1, after_vertices_ = 0, line_after_vertices_ = 1;
    bool any_color_ = false, vertices_have_colors_ = false, has_faces_ = false;
    double greatest_ = 0;
};

} // namespace

std::unique_ptr<mesh_reader> open_off(const std::filesystem::path& path, const gltf_options& options) {
    return std::make_unique<off_reader>(path, options);
}

} // namespace voxelize
