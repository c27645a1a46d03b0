// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "statements.hpp"

#include "lines.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <system_error>
#include <utility>

namespace voxelize::obj {
namespace {

// Statements of free-form geometry, of display and of other programs, beside those above.
constexpr std::array<std::string_view, 37> known_keys{
    "vn",       "vp",    "s",        "mg",     "lod",    "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj",
    "ctech",    "stech", "cstype",   "deg",    "bmat",   "step",  "parm",     "trim",     "hole",       "scrv",
    "sp",       "end",   "con",      "usemap", "maplib", "call",  "csh",      "res",      "version",    "units",
    "vertices", "faces", "material", "cdp",    "bsp",    "bzp",   "cdc"};

} // namespace

statement statement_of(std::string_view& line) {
    const std::string_view word = next_word(line);
    if (word.empty() || word[0] == '#') return statement::nothing;
    if (word.size() == 1) {
        switch (word[0]) {
        case 'v':
        case 'V':
            return statement::vertex;
        case 'f':
        case 'F':
            return statement::face;
        case 'l':
        case 'L':
            return statement::line;
        case 'p':
        case 'P':
            return statement::point;
        case 'o':
        case 'O':
            return statement::object;
        case 'g':
        case 'G':
            return statement::group;
        default:
            break;
        }
    }
    if (word == "vn") return statement::nothing;
    if (word == "vt") return statement::texcoord;
    const std::string key = lower(word);
    constexpr std::array<std::pair<std::string_view, statement>, 11> others{{{"vt", statement::texcoord},
                                                                             {"fo", statement::face},
                                                                             {"usemtl", statement::material},
                                                                             {"mtllib", statement::library},
                                                                             {"surf", statement::surface},
                                                                             {"bzp", statement::surface},
                                                                             {"bsp", statement::surface},
                                                                             {"curv", statement::curve},
                                                                             {"cdc", statement::curve},
                                                                             {"cdp", statement::surface},
                                                                             {"call", statement::call}}};
    for (const auto& [name, which] : others)
        if (key == name) return which;
    return std::find(known_keys.begin(), known_keys.end(), key) != known_keys.end() ? statement::nothing
                                                                                    : statement::unknown;
}

std::optional<std::uint64_t> resolve(std::int64_t index, std::uint64_t count) {
    if (index > 0) return static_cast<std::uint64_t>(index) - 1;
    const auto back = static_cast<std::uint64_t>(-index);
    if (index == 0 || back > count) return std::nullopt;
    return count - back;
}

std::optional<corner_indices> corner_in(std::string_view word) {
    corner_indices found;
    for (int place = 0; place < 3; ++place) {
        std::string_view text = word.substr(0, word.find('/'));
        const bool is_last = text.size() == word.size();
        word.remove_prefix(is_last ? word.size() : text.size() + 1);
        if (text.starts_with('+')) text.remove_prefix(1);
        std::int64_t index = 0;
        const char* const end = text.data() + text.size();
        const auto [stop, error] = std::from_chars(text.data(), end, index);
        const bool is_number = stop == end && error == std::errc() && index != 0;
        if (!is_number && (place == 0 || !text.empty())) return std::nullopt;
        if (place == 0) found.vertex = index;
        if (place == 1) found.texcoord = index;
        if (is_last) return found;
    }
    return std::nullopt;
}

} // namespace voxelize::obj
