// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "ply_header.hpp"

#include "model/model_error.hpp"
#include "read/gltf/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <numeric>
#include <utility>

namespace voxelize {
namespace {

constexpr std::string_view blank = " \t\v\f";

// The first word of TEXT, which it loses.
std::string_view take_word(std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of(blank), text.size()));
    const std::string_view word = text.substr(0, text.find_first_of(blank));
    text.remove_prefix(word.size());
    return word;
}

std::optional<ply_type> type_of(std::string_view name) {
    using enum ply_type;
    static constexpr std::array<std::pair<std::string_view, ply_type>, 20> types{
        {{"char", int8},     {"uchar", uint8},     {"short", int16},  {"ushort", uint16}, {"int", int32},
         {"uint", uint32},   {"long", int64},      {"ulong", uint64}, {"float", float32}, {"double", float64},
         {"int8", int8},     {"uint8", uint8},     {"int16", int16},  {"uint16", uint16}, {"int32", int32},
         {"uint32", uint32}, {"float32", float32}, {"int64", int64},  {"uint64", uint64}, {"float64", float64}}};
    const auto* const found =
        std::find_if(types.begin(), types.end(), [name](const auto& t) { return t.first == name; });
    return found != types.end() ? std::optional(found->second) : std::nullopt;
}

class header_reader {
public:
    explicit header_reader(text_scanner& file) : file_(file) {}

    ply_header read() {
        std::string_view line;
        (void)file_.next_line(line);
        if (line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
        const std::string_view magic = take_word(line);
        if (magic != "ply" && magic != "PLY")
            throw model_error("line 1: " + gltf::in_quotes(magic) + " is found where \"ply\" was expected");
        const bool ends_by_cr_alone = file_.ended_by_cr() && !file_.ended_by_cr_lf();
        constexpr std::uint64_t longest = std::uint64_t{1} << 20; // bytes
        while (file_.offset() < longest && file_.next_line(line)) {
            const std::string_view key = take_word(line);
            if (key == "end_header") {
                if (!has_format_) throw model_error("the PLY header has no format");
                found_.data = file_.offset();
                found_.line = file_.line();
                // The first byte of the data may be an LF.
                if (ends_by_cr_alone && file_.ended_by_cr_lf() && found_.format != ply_header::encoding::text)
                    --found_.data;
                drop_stray_lists();
                return std::move(found_);
            }
            if (key == "format")
                read_format(line);
            else if (key == "element")
                read_element(line);
            else if (key == "property")
                read_property(line);
            else if (key == "comment")
                read_comment(line);
            // All else is obj_info, or a comment whose word is missing, as Blender 2.4 wrote it.
        }
        throw model_error("the PLY header has no end_header");
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw model_error("line " + std::to_string(file_.word_line()) + ": " + what);
    }

    void read_format(std::string_view line) {
        const std::string_view name = take_word(line);
        has_format_ = true;
        if (name == "ascii")
            found_.format = ply_header::encoding::text;
        else if (name == "binary_little_endian")
            found_.format = ply_header::encoding::little_endian;
        else if (name == "binary_big_endian")
            found_.format = ply_header::encoding::big_endian;
        else
            fail("the format is " + gltf::in_quotes(name) +
                 ", and ascii, binary_little_endian or binary_big_endian was expected");
    }
    void read_element(std::string_view line) {
        ply_element& element = found_.elements.emplace_back();
        element.name = take_word(line);
        const std::string_view count = take_word(line);
        const char* const end = count.data() + count.size();
        if (element.name.empty() || std::from_chars(count.data(), end, element.count).ptr != end || count.empty())
            fail("the number of elements " + gltf::in_quotes(element.name) + " was expected, and " +
                 gltf::in_quotes(count) + " is found");
    }
    void read_property(std::string_view line) {
        if (found_.elements.empty()) fail("a property stands before the first element");
        ply_property made;
        std::string_view type = take_word(line);
        if (type == "list") {
            const std::string_view length = take_word(line);
            made.length = type_of(length);
            if (!made.length)
                fail(gltf::in_quotes(length) + " is found where the type of a list's length was expected");
            type = take_word(line);
        }
        const std::optional<ply_type> known = type_of(type);
        if (!known) fail(gltf::in_quotes(type) + " is found where a property's type was expected");
        made.type = *known;
        made.name = take_word(line);
        if (made.name.empty()) fail("a property has no name");
        found_.elements.back().properties.push_back(std::move(made));
    }
    // Blender 2.7 wrote the property of the faces behind those of the vertices where a mesh has none.
    void drop_stray_lists() {
        const auto is_of_faces = [](const ply_element& e) { return e.name == "face" || e.name == "tristrips"; };
        if (std::any_of(found_.elements.begin(), found_.elements.end(), is_of_faces)) return;
        for (ply_element& e : found_.elements)
            if (e.name == "vertex" && !e.properties.empty() && e.properties.back().length &&
                e.properties.back().name == "vertex_indices")
                e.properties.pop_back();
    }
    void read_comment(std::string_view line) {
        const std::string_view key = take_word(line);
        if (key != "TextureFile" && key != "TextureFile:") return;
        line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
        line = line.substr(0, line.find_last_not_of(blank) + 1);
        if (!line.empty()) found_.textures.emplace_back(line);
    }

    text_scanner& file_;
    ply_header found_;
    bool has_format_ = false;
};

} // namespace

std::size_t bytes_of(ply_type type) {
    switch (type) {
    case ply_type::int8:
    case ply_type::uint8:
        return 1;
    case ply_type::int16:
    case ply_type::uint16:
        return 2;
    case ply_type::int32:
    case ply_type::uint32:
    case ply_type::float32:
        return 4;
    case ply_type::int64:
    case ply_type::uint64:
    case ply_type::float64:
        break;
    }
    return 8;
}

bool ply_element::has_list() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const ply_property& p) { return p.length.has_value(); });
}

std::size_t ply_element::bytes() const { return bytes_before(properties.size()); }

std::size_t ply_element::bytes_before(std::size_t property) const {
    return std::accumulate(
        properties.begin(), properties.begin() + static_cast<std::ptrdiff_t>(property), std::size_t{0},
        [](std::size_t sum, const ply_property& p) { return sum + bytes_of(p.length.value_or(p.type)); });
}

std::optional<std::size_t> ply_element::find(std::initializer_list<std::string_view> names, bool is_list) const {
    for (const std::string_view name : names)
        for (std::size_t i = 0; i < properties.size(); ++i)
            if (properties[i].name == name && properties[i].length.has_value() == is_list) return i;
    return std::nullopt;
}

ply_header read_ply_header(text_scanner& file) { return header_reader(file).read(); }

} // namespace voxelize
