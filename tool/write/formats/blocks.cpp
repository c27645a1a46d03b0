// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "blocks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <limits>
#include <string_view>
#include <system_error>

namespace voxelize {
namespace {

struct default_block {
    std::string_view name;
    rgb8 color;
};
constexpr std::array<default_block, 49> default_table{{
    {"white_concrete", {207, 213, 214}},
    {"orange_concrete", {224, 97, 1}},
    {"magenta_concrete", {169, 48, 159}},
    {"light_blue_concrete", {36, 137, 199}},
    {"yellow_concrete", {241, 175, 21}},
    {"lime_concrete", {94, 169, 25}},
    {"pink_concrete", {214, 101, 143}},
    {"gray_concrete", {55, 58, 62}},
    {"light_gray_concrete", {125, 125, 115}},
    {"cyan_concrete", {21, 119, 136}},
    {"purple_concrete", {100, 32, 156}},
    {"blue_concrete", {45, 47, 143}},
    {"brown_concrete", {96, 60, 32}},
    {"green_concrete", {73, 91, 36}},
    {"red_concrete", {142, 33, 33}},
    {"black_concrete", {8, 10, 15}},
    {"white_wool", {234, 236, 237}},
    {"orange_wool", {241, 118, 20}},
    {"magenta_wool", {190, 69, 180}},
    {"light_blue_wool", {58, 175, 217}},
    {"yellow_wool", {249, 198, 40}},
    {"lime_wool", {112, 185, 26}},
    {"pink_wool", {238, 141, 172}},
    {"gray_wool", {63, 68, 72}},
    {"light_gray_wool", {142, 142, 135}},
    {"cyan_wool", {21, 138, 145}},
    {"purple_wool", {122, 42, 173}},
    {"blue_wool", {53, 57, 157}},
    {"brown_wool", {114, 72, 41}},
    {"green_wool", {85, 110, 28}},
    {"red_wool", {161, 39, 35}},
    {"black_wool", {21, 21, 26}},
    {"terracotta", {152, 94, 68}},
    {"white_terracotta", {210, 178, 161}},
    {"orange_terracotta", {162, 84, 38}},
    {"magenta_terracotta", {150, 88, 109}},
    {"light_blue_terracotta", {113, 109, 138}},
    {"yellow_terracotta", {186, 133, 35}},
    {"lime_terracotta", {104, 118, 53}},
    {"pink_terracotta", {162, 78, 79}},
    {"gray_terracotta", {58, 42, 36}},
    {"light_gray_terracotta", {135, 107, 98}},
    {"cyan_terracotta", {87, 91, 91}},
    {"purple_terracotta", {118, 70, 86}},
    {"blue_terracotta", {74, 60, 91}},
    {"brown_terracotta", {77, 51, 36}},
    {"green_terracotta", {76, 83, 42}},
    {"red_terracotta", {143, 61, 47}},
    {"black_terracotta", {37, 23, 16}},
}};

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blanks = " \t\r";
    const std::size_t first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

template <class Number>
bool parse_whole(std::string_view text, Number& number, int base = 10) {
    const char* const end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end, number, base);
    return error == std::errc{} && at == end && !text.empty();
}

// "#a2834f" or "162,131,79".
std::optional<rgb8> parse_block_color(std::string_view text) {
    rgb8 color{};
    if (text.starts_with('#')) {
        if (text.size() != 7) return std::nullopt;
        for (std::size_t a = 0; a < 3; ++a)
            if (!parse_whole(text.substr(1 + 2 * a, 2), color[a], 16)) return std::nullopt;
        return color;
    }
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t comma = text.find(',');
        if ((comma == std::string_view::npos) != (a == 2)) return std::nullopt;
        if (!parse_whole(trimmed(text.substr(0, comma)), color[a])) return std::nullopt;
        text.remove_prefix(a == 2 ? text.size() : comma + 1);
    }
    return color;
}

bool has_only(std::string_view text, std::string_view more) {
    return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || more.find(c) != std::string_view::npos;
    });
}

// "oak_log[axis=y]" -> "minecraft:oak_log[axis=y]"; nothing where it is no name of a block.
std::optional<std::string> block_name(std::string_view word) {
    constexpr std::size_t longest = 32767; // NBT has the length of a text in 16 bits
    if (word.size() > longest) return std::nullopt;
    const std::size_t bracket = word.find('[');
    const std::string_view name = word.substr(0, bracket);
    const std::size_t colon = name.find(':');
    const bool has_space = colon != std::string_view::npos;
    if (has_space && !has_only(name.substr(0, colon), "_-.")) return std::nullopt;
    if (!has_only(has_space ? name.substr(colon + 1) : name, "_-./")) return std::nullopt;
    if (bracket != std::string_view::npos) {
        if (!word.ends_with(']')) return std::nullopt;
        std::string_view states = word.substr(bracket + 1, word.size() - bracket - 2);
        while (true) {
            const std::string_view state = states.substr(0, states.find(','));
            const std::size_t equal = state.find('=');
            if (equal == std::string_view::npos || !has_only(state.substr(0, equal), "_") ||
                !has_only(state.substr(equal + 1), "_"))
                return std::nullopt;
            if (state.size() == states.size()) break;
            states.remove_prefix(state.size() + 1);
        }
    }
    return has_space ? std::string(word) : "minecraft:" + std::string(word);
}

// A list as it is read.
class list_reader {
public:
    explicit list_reader(const std::filesystem::path& path) : path_(path) {}

    void add_line(std::string_view text) {
        ++line_;
        if (line_ == 1 && text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3); // byte order mark
        text = trimmed(text);
        if (text.empty() || text.starts_with('#')) return;
        const std::size_t blank = text.find_first_of(" \t");
        const std::string_view word = text.substr(0, blank);
        const std::string_view rest = blank == std::string_view::npos ? "" : trimmed(text.substr(blank));
        const std::optional<std::string> name = block_name(word);
        if (!name) fail('"' + std::string(word) + "\" is no block; one is written minecraft:oak_log[axis=y]");
        if (*name == "minecraft:air") fail("air is what empty voxels are; name another block");
        constexpr std::string_view material = "material";
        if (rest.starts_with(material) && rest.size() > material.size() &&
            (rest[material.size()] == ' ' || rest[material.size()] == '\t')) {
            add_material(std::string(trimmed(rest.substr(material.size()))), number_of(*name));
            return;
        }
        const std::optional<rgb8> color = parse_block_color(rest);
        if (!color)
            fail("behind the block stands its colour, #rrggbb or R,G,B from 0 to 255, or \"material NAME\", not \"" +
                 std::string(rest) + '"');
        list_.colors.push_back({*color, number_of(*name)});
    }

    block_list take() {
        if (list_.names.empty()) fail("there is no block in it");
        if (!list_.colors.empty()) return std::move(list_);
        for (const default_block& block : default_table)
            list_.colors.push_back({block.color, number_of("minecraft:" + std::string(block.name))});
        return std::move(list_);
    }

private:
    [[noreturn]] void fail(const std::string& why) const {
        throw block_list_error(
            path_.string() + (list_.names.empty() && line_ == 0 ? "" : ", line " + std::to_string(line_)) + ": " + why);
    }
    void add_material(std::string name, std::uint16_t block) {
        if (name.size() > 1 && name.front() == '"' && name.back() == '"') {
            list_.materials.push_back({name.substr(1, name.size() - 2), std::nullopt, block, line_});
            return;
        }
        std::int32_t number = 0;
        const bool is_number = parse_whole(std::string_view(name), number) && number >= 0;
        list_.materials.push_back({std::move(name), is_number ? std::optional(number) : std::nullopt, block, line_});
    }
    std::uint16_t number_of(const std::string& name) {
        const auto [at, is_new] = numbers_.try_emplace(name, static_cast<std::uint16_t>(list_.names.size() + 1));
        if (is_new) list_.names.push_back(name);
        if (list_.names.size() > most_blocks_of_list)
            fail("more than " + std::to_string(most_blocks_of_list) + " blocks, the most of a list");
        return at->second;
    }

    std::filesystem::path path_;
    int line_ = 0;
    block_list list_;
    std::map<std::string, std::uint16_t> numbers_;
};

} // namespace

std::uint16_t block_list::nearest(std::uint32_t rgb) const {
    std::uint16_t best = 0;
    int least = std::numeric_limits<int>::max();
    for (const of_color& each : colors) {
        int distance = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const int d = each.color[a] - static_cast<int>(rgb >> 8 * a & 0xffU);
            distance += d * d;
        }
        if (distance < least) {
            least = distance;
            best = each.block;
        }
    }
    return best;
}

const block_list& default_blocks() {
    static const block_list list = [] {
        block_list made;
        for (const default_block& block : default_table) {
            made.names.push_back("minecraft:" + std::string(block.name));
            made.colors.push_back({block.color, static_cast<std::uint16_t>(made.names.size())});
        }
        return made;
    }();
    return list;
}

block_list read_block_list(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file || std::filesystem::is_directory(path)) throw block_list_error(path.string() + ": it cannot be read");
    list_reader reader(path);
    for (std::string line; std::getline(file, line);) reader.add_line(line);
    return reader.take();
}

std::shared_ptr<const block_list> with_materials(const block_list& list, const std::filesystem::path& path,
                                                 std::span<const std::string> materials,
                                                 std::vector<std::string>& warnings) {
    auto made = std::make_shared<block_list>(list);
    for (const block_list::of_material& each : list.materials) {
        bool is_there = false;
        for (std::size_t n = 0; n < materials.size(); ++n) {
            if (materials[n] != each.name) continue;
            is_there = true;
            made->of_number.try_emplace(static_cast<std::int32_t>(n), each.block);
        }
        if (!is_there && each.number && *each.number < static_cast<std::int64_t>(materials.size())) {
            is_there = true;
            made->of_number.try_emplace(*each.number, each.block);
        }
        if (!is_there)
            warnings.push_back(path.string() + ", line " + std::to_string(each.line) +
                               ": the model has no material \"" + each.name + '"');
    }
    return made;
}

} // namespace voxelize
