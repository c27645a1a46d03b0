// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "stl_reader.hpp"

#include "faults.hpp"
#include "model/model_error.hpp"
#include "number.hpp"
#include "read/assimp/linear_color.hpp"
#include "read/gltf/text.hpp"
#include "text_scanner.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

constexpr std::uint64_t head_bytes = 80, first_facet = 84, facet_bytes = 50;
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

std::string lower(std::string_view word) {
    std::string text(word);
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

// Without the byte order mark and blanks that a text may begin with.
std::string_view trimmed(std::string_view text) {
    if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
    const std::size_t first = text.find_first_not_of(" \t\r\n\v\f");
    return first == std::string_view::npos ? std::string_view() : text.substr(first);
}

class stl_reader : public mesh_reader {
protected:
    stl_reader(const std::filesystem::path& path, const gltf_options& options)
        : name_(path.filename().string()), options_(options), file_(path),
          faults_(options.lenient, description_.warnings) {
        description_.materials.emplace_back().name = "DefaultMaterial";
        description_.textures.emplace_back();
    }

public:
    void read_vertices(mesh_sink&) override {}

protected:
    std::string name_;
    gltf_options options_;
    text_scanner file_;
    mesh_faults faults_;
};

// ---- Binary

class binary_stl : public stl_reader {
public:
    binary_stl(const std::filesystem::path& path, const gltf_options& options) : stl_reader(path, options) {
        const std::uint64_t size = file_.size();
        if (size < first_facet)
            throw model_error("the file has " + std::to_string(size) + " bytes, and a binary STL has " +
                              std::to_string(first_facet) +
                              " before its facets; it does not begin with \"solid\" either");
        const std::string header(file_.next_bytes(head_bytes));
        std::uint32_t count = 0;
        std::memcpy(&count, file_.next_bytes(sizeof(count)).data(), sizeof(count));
        const std::uint64_t room = (size - first_facet) / facet_bytes;
        faults_.promise("facets", count, room, "which ends at byte " + std::to_string(size));
        num_facets_ = std::min<std::uint64_t>(count, room);
        if (const std::uint64_t rest = size - first_facet - num_facets_ * facet_bytes; rest != 0 && room >= count)
            description_.warnings.push_back(std::to_string(rest) + " bytes follow the " + std::to_string(count) +
                                            " facets that the header promises: they are passed over");
        description_.parts.push_back({name_, 0});
        if (options.colors) read_colors(header);
    }

    [[nodiscard]] bool reads_faces_again() const override { return true; }
    [[nodiscard]] std::uint64_t expected_vertices() const override { return 3 * num_facets_; }

    void read_faces(mesh_sink& sink) override {
        for_each_facet([&](const char* facet) {
            std::array<float, 9> numbers{};
            std::memcpy(numbers.data(), facet + 3 * sizeof(float), sizeof(numbers));
            std::array<glm::dvec3, 3> corners;
            for (std::size_t k = 0; k < 3; ++k)
                corners[k] = glm::vec3(numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]);
            mesh_face face;
            face.positions = corners;
            if (description_.has_face_colors) face.color = color_of(attribute_of(facet));
            sink.face(face);
        });
        faults_.finish();
    }

private:
    template <class Visit>
    void for_each_facet(const Visit& visit) {
        constexpr std::uint64_t block = 1024;
        file_.seek(first_facet);
        for (std::uint64_t done = 0; done < num_facets_;) {
            const std::uint64_t count = std::min(block, num_facets_ - done);
            const std::string_view bytes = file_.next_bytes(count * facet_bytes);
            if (bytes.size() != count * facet_bytes) throw model_error("the file changes while it is read");
            for (std::uint64_t i = 0; i < count; ++i) visit(bytes.data() + i * facet_bytes);
            done += count;
        }
    }
    [[nodiscard]] static std::uint32_t attribute_of(const char* facet) {
        std::uint16_t value = 0;
        std::memcpy(&value, facet + facet_bytes - sizeof(value), sizeof(value));
        return value;
    }

    // The colour of the object (Magics), and whether facets have their own.
    void read_colors(const std::string& header) {
        constexpr std::string_view key = "COLOR=";
        const std::size_t at = header.find(key);
        is_magics_ = at != std::string::npos && at + key.size() + 4 <= header.size();
        if (is_magics_) {
            const auto byte = [&](std::size_t c) { return static_cast<unsigned char>(header[at + key.size() + c]); };
            for (glm::length_t c = 0; c < 4; ++c)
                object_[c] = static_cast<float>(byte(static_cast<std::size_t>(c))) / 255.0F;
            for (glm::length_t c = 0; c < 3; ++c) object_[c] = assimp::linear_of(object_[c]);
        }
        // Magics: bit 15 says that the object's colour counts; writers that know of none leave 0. VisCAM: it says that
        // the other bits are a colour.
        bool any = false;
        for_each_facet([&](const char* facet) {
            const std::uint32_t a = attribute_of(facet);
            any = any || (is_magics_ ? (a & 0x8000U) == 0 && a != 0 : (a & 0x8000U) != 0);
        });
        description_.has_face_colors = any;
        if (is_magics_ && !any) description_.materials[0].base_color = object_;
    }
    [[nodiscard]] std::optional<glm::vec4> color_of(std::uint32_t attribute) const {
        const bool is_marked = (attribute & 0x8000U) != 0;
        if (is_magics_ == is_marked) return is_magics_ ? std::optional(object_) : std::nullopt;
        const auto part = [&](std::uint32_t shift) {
            return assimp::linear_of(static_cast<float>((attribute >> shift) & 31U) / 31.0F);
        };
        return is_magics_ ? glm::vec4(part(0), part(5), part(10), 1) : glm::vec4(part(10), part(5), part(0), 1);
    }

    std::uint64_t num_facets_ = 0;
    bool is_magics_ = false;
    glm::vec4 object_ = default_color;
};

// ---- Text

class text_stl : public stl_reader {
public:
    text_stl(const std::filesystem::path& path, const gltf_options& options) : stl_reader(path, options) {
        description_.is_double = true;
    }

    void read_faces(mesh_sink& sink) override {
        file_.seek(0);
        bool is_open = false; // a facet
        bool ended = true;    // the solid
        std::uint64_t num_facets = 0, facet_line = 0;
        std::vector<glm::dvec3> corners;
        for (std::string word = next(); !word.empty(); word = next()) {
            if (word.starts_with(byte_order_mark)) word.erase(0, byte_order_mark.size());
            if (!is_open && (word == "solid" || word == "endsolid")) {
                ended = word != "solid";
                const std::string name = read_name();
                if (!ended) description_.parts.push_back({name.empty() ? name_ : name, 0});
            } else if (word == "facet") {
                if (is_open) end(sink, corners, facet_line);
                is_open = true;
                facet_line = file_.word_line();
                corners.clear();
            } else if (word == "vertex") {
                if (!is_open)
                    throw model_error("line " + std::to_string(file_.word_line()) + ": a vertex is outside of a facet");
                corners.push_back(read_vertex());
            } else if (is_open && (word == "endfacet" || is_end_of_facet(word))) {
                end(sink, corners, facet_line);
                is_open = false;
                ++num_facets;
            }
        }
        const std::string place = " (line " + std::to_string(file_.line()) + ')';
        if (is_open)
            faults_.accept("the file ends within its facet " + std::to_string(num_facets + 1) + place,
                           "the facets before it are read");
        else if (!ended)
            description_.warnings.push_back("the file ends after " + std::to_string(num_facets) +
                                            " facets without \"endsolid\"" + place);
        faults_.finish();
    }

private:
    [[nodiscard]] std::string next() {
        if (!word_.empty()) return std::exchange(word_, {});
        return lower(file_.next_word());
    }
    // "end facet" as two words.
    [[nodiscard]] bool is_end_of_facet(const std::string& word) {
        if (word != "end") return false;
        word_ = lower(file_.next_word());
        if (word_ != "facet") return false;
        word_.clear();
        return true;
    }
    // The rest of the line, up to a facet in it.
    [[nodiscard]] std::string read_name() {
        std::string name;
        for (std::string_view word = file_.next_word_of_line(); !word.empty(); word = file_.next_word_of_line()) {
            const std::string text(word);
            if (lower(text) == "facet") {
                const std::string following = lower(file_.next_word_of_line());
                if (following == "normal") {
                    word_ = "facet";
                    break;
                }
                name += (name.empty() ? "" : " ") + text + (following.empty() ? "" : " " + following);
                continue;
            }
            if (name.size() < 200) name += (name.empty() ? "" : " ") + text;
        }
        return gltf::printable(name);
    }
    [[nodiscard]] glm::dvec3 read_vertex() {
        glm::dvec3 p(0);
        for (glm::length_t a = 0; a < 3; ++a) {
            const std::string_view word = file_.next_word();
            const std::optional<double> number = number_of(word);
            if (!number)
                throw model_error("line " + std::to_string(file_.word_line()) + ": " +
                                  (word.empty() ? "the file ends" : gltf::in_quotes(word) + " is found") +
                                  " where the " + "xyz"[a] + " of a vertex was expected");
            p[a] = *number;
        }
        return p;
    }
    void end(mesh_sink& sink, const std::vector<glm::dvec3>& corners, std::uint64_t line) {
        if (corners.size() < 3) {
            faults_.accept("line " + std::to_string(line) + ": the facet has " + std::to_string(corners.size()) +
                               " vertices, and 3 were expected",
                           "it is left out");
            return;
        }
        if (description_.parts.empty()) description_.parts.push_back({name_, 0});
        mesh_face face;
        face.part = static_cast<std::uint32_t>(description_.parts.size() - 1);
        face.positions = corners;
        sink.face(face);
    }

    std::string word_; // that was read too far
};

// True for text: "solid" at the beginning, and no byte of a binary file near it.
bool is_text(const std::filesystem::path& path) {
    text_scanner file(path);
    const std::uint64_t size = file.size();
    const std::string start(file.next_bytes(1024));
    if (size >= first_facet) {
        std::uint32_t count = 0;
        std::memcpy(&count, start.data() + head_bytes, sizeof(count));
        if (size == first_facet + facet_bytes * count) return false;
    }
    return lower(trimmed(start).substr(0, 5)) == "solid" && start.find('\0') == std::string::npos;
}

} // namespace

std::unique_ptr<mesh_reader> open_stl(const std::filesystem::path& path, const gltf_options& options) {
    if (is_text(path)) return std::make_unique<text_stl>(path, options);
    return std::make_unique<binary_stl>(path, options);
}

} // namespace voxelize
