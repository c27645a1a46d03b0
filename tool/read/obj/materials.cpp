// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "materials.hpp"

#include "lines.hpp"
#include "model/model_error.hpp"
#include "read/assimp/file_name.hpp"
#include "read/assimp/linear_color.hpp"
#include "read/gltf/picture_header.hpp"
#include "read/gltf/resources.hpp"
#include "read/gltf/text.hpp"
#include "read/mesh/number.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

namespace voxelize::obj {
namespace {

namespace fs = std::filesystem;

constexpr const char* default_name = "DefaultMaterial";

bool is_file(const fs::path& file) {
    std::error_code error;
    return fs::is_regular_file(file, error);
}

// The finite numbers that REST begins with, up to three.
std::vector<double> numbers_in(std::string_view rest) {
    std::vector<double> numbers;
    while (numbers.size() < 3) {
        const std::optional<double> value = number_of(next_word(rest));
        if (!value || !std::isfinite(*value)) break;
        numbers.push_back(*value);
    }
    return numbers;
}

// Linear light of CIE XYZ with the white of D65.
glm::vec3 from_xyz(const std::vector<double>& n) {
    const auto row = [&](double x, double y, double z) {
        return static_cast<float>(std::clamp(x * n[0] + y * n[1] + z * n[2], 0.0, 1.0));
    };
    return {row(3.2404542, -1.5371385, -0.4985314), row(-0.9692660, 1.8760108, 0.0415560),
            row(0.0556434, -0.2040259, 1.0572252)};
}

// A colour as "Kd", "Ke" and their kind state it: one number for all channels, three, or "xyz" before either.
// IS_ENCODED: the numbers are sRGB. Nothing where REST is none of these (a spectral curve in a file is not read).
std::optional<glm::vec3> color_in(std::string_view rest, bool is_encoded) {
    std::string_view from = rest;
    const bool is_xyz = lower(next_word(from)) == "xyz";
    std::vector<double> n = numbers_in(is_xyz ? from : rest);
    if (n.empty()) return std::nullopt;
    while (n.size() < 3) n.push_back(n[0]);
    if (is_xyz) return from_xyz(n);
    const auto channel = [&](double value) {
        const auto rounded = static_cast<float>(value);
        return is_encoded ? assimp::linear_of(rounded) : std::max(rounded, 0.0F);
    };
    return glm::vec3(channel(n[0]), channel(n[1]), channel(n[2]));
}

std::optional<float> fraction_in(std::string_view rest) {
    const std::vector<double> n = numbers_in(rest);
    if (n.empty()) return std::nullopt;
    return static_cast<float>(std::clamp(n[0], 0.0, 1.0));
}

// The options of a map that count here.
struct map_options {
    bool clamps = false;
    char channel = 0; // of -imfchan
};

// Cuts the options off REST, what follows the key of a map; a file's name is left.
map_options cut_options(std::string_view& rest) {
    struct option {
        std::string_view name;
        int least, most; // numbers of arguments; beyond the least only numbers are
    };
    constexpr std::array<option, 13> known{{{"-blendu", 1, 1},
                                            {"-blendv", 1, 1},
                                            {"-bm", 1, 1},
                                            {"-boost", 1, 1},
                                            {"-cc", 1, 1},
                                            {"-clamp", 1, 1},
                                            {"-imfchan", 1, 1},
                                            {"-mm", 1, 2},
                                            {"-o", 1, 3},
                                            {"-s", 1, 3},
                                            {"-t", 1, 3},
                                            {"-texres", 1, 1},
                                            {"-type", 1, 1}}};
    map_options found;
    while (true) {
        std::string_view from = rest;
        const std::string word = lower(next_word(from));
        const auto* const which =
            std::find_if(known.begin(), known.end(), [&](const option& one) { return one.name == word; });
        if (which == known.end()) return found;
        for (int i = 0; i < which->most; ++i) {
            std::string_view behind = from;
            const std::string argument = lower(next_word(behind));
            // The last word of the line is the file.
            if (argument.empty() || trimmed(behind).empty() || (i >= which->least && !number_of(argument))) break;
            if (which->name == "-clamp") found.clamps = argument == "on";
            if (which->name == "-imfchan") found.channel = argument[0];
            from = behind;
        }
        rest = from;
    }
}

// True if the picture in FILE may have texels that are not opaque, as far as its first bytes tell.
bool has_alpha(const fs::path& file) {
    std::vector<char> start(std::size_t{1} << 16);
    std::ifstream in(file, std::ios::binary);
    in.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
    return gltf::may_have_alpha(std::as_bytes(std::span(start)));
}

} // namespace

std::vector<std::string> library_names(std::string_view rest, const std::function<bool(const std::string&)>& is_there) {
    const std::string whole = name_of(rest);
    if (whole.empty()) return {};
    if (is_there(whole)) return {whole};
    const std::string all = name_of(before_comment(rest)), low = lower(all);
    constexpr std::string_view extension = ".mtl";
    std::vector<std::string> names;
    for (std::size_t start = 0; start < all.size();) {
        std::size_t end = start;
        do {
            end = low.find(extension, end);
            if (end != std::string::npos) end += extension.size();
        } while (end < all.size() && !is_blank(all[end]));
        end = std::min(end, all.size());
        std::string name = name_of(std::string_view(all).substr(start, end - start));
        std::vector<std::string> words;
        std::string_view left = name;
        for (std::string_view word = next_word(left); !word.empty(); word = next_word(left)) words.emplace_back(word);
        if (words.size() > 1 && !is_there(name) && std::any_of(words.begin(), words.end(), is_there))
            names.insert(names.end(), words.begin(), words.end());
        else if (!name.empty())
            names.push_back(std::move(name));
        start = end;
        while (start < all.size() && is_blank(all[start])) ++start;
    }
    return names;
}

fs::path find_file(const fs::path& folder, const std::string& name, const fs::path& in) {
    const std::optional<fs::path> path = assimp::local_file(name);
    if (!path) return {};
    for (const fs::path& place : {*path, in.parent_path() / *path, path->filename()})
        if (is_file(folder / place)) return place;
    return {};
}

material_list::material_list(fs::path folder, const gltf_options& options)
    : folder_(std::move(folder)), options_(options) {
    (void)add_material(default_name);
}

std::uint32_t material_list::add_material(std::string name) {
    material added;
    added.name = std::move(name);
    materials.push_back(std::move(added));
    textures.emplace_back();
    return static_cast<std::uint32_t>(materials.size() - 1);
}

void material_list::add_libraries(std::string_view rest) {
    for (std::string& name : library_names(rest, [&](const auto& each) { return !find_file(folder_, each).empty(); }))
        if (std::find(named_.begin(), named_.end(), name) == named_.end()) named_.push_back(std::move(name));
}

std::uint32_t material_list::use(std::string_view rest) {
    std::string name = name_of(rest);
    const auto [found, is_new] = numbers_.try_emplace(name, static_cast<std::uint32_t>(used_.size()));
    if (is_new) used_.push_back({std::move(name)});
    return found->second;
}

void material_list::read_libraries(const fs::path& model) {
    std::vector<std::string> missing;
    std::size_t read = 0;
    for (const std::string& name : named_) {
        const fs::path file = find_file(folder_, name);
        if (!file.empty() && read_library(file))
            ++read;
        else
            missing.push_back(name);
    }
    std::string stand_in;
    if (read == 0 && !missing.empty()) {
        const fs::path beside = fs::path(model.filename()).replace_extension(".mtl");
        if (is_file(folder_ / beside) && read_library(beside)) stand_in = beside.string();
    }
    bool any_is_known = false;
    std::vector<std::string> unknown;
    for (used_name& one : used_) {
        if (one.name.empty()) continue; // the default material
        auto found = defined_.find(one.name);
        if (found == defined_.end()) found = defined_.find(name_of(before_comment(one.name)));
        if (found != defined_.end()) {
            one.material = found->second;
            any_is_known = true;
            continue;
        }
        unknown.push_back(gltf::in_quotes(one.name));
        one.material = add_material(gltf::printable(one.name));
    }
    for (const std::string& name : missing)
        warnings.push_back("the material library " + gltf::in_quotes(name) + " cannot be read: " +
                           (!stand_in.empty() ? gltf::in_quotes(stand_in) + " is read in its place"
                            : any_is_known    ? "surfaces of its materials are white"
                                              : "surfaces are white"));
    if (missing.empty() && !named_.empty() && !unknown.empty())
        warnings.push_back("the material " + unknown[0] +
                           (unknown.size() > 1 ? " and " + std::to_string(unknown.size() - 1) + " more are" : " is") +
                           " in no material library of the file: surfaces of it are white");
}

bool material_list::read_library(const fs::path& file) {
    try {
        (void)gltf::checked_file_size(folder_ / file, gltf_limits{}.max_file_bytes);
        line_reader lines(folder_ / file);
        files.push_back(file.generic_string());
        is_open_ = false;
        for (std::string_view line; lines.next(line);) statement(line, file, lines.number());
        finish_material();
        return true;
    } catch (const model_error&) {
        finish_material();
        return false;
    }
}

void material_list::begin_material(std::string_view rest) {
    finish_material();
    const std::string name = name_of(rest);
    if (defined_.contains(name)) return; // the first one counts
    const std::uint32_t index = add_material(gltf::printable(name));
    defined_.emplace(name, index);
    defined_.try_emplace(name_of(before_comment(name)), index);
    is_open_ = true;
    has_opacity_ = is_black_ = false;
}

void material_list::finish_material() {
    if (!std::exchange(is_open_, false)) return;
    material& made = materials.back();
    const assimp::texture_source& texture = textures.back();
    // Exporters leave black beside a texture.
    if (is_black_ && !texture.path.empty()) made.base_color = {1, 1, 1, made.base_color.a};
    const bool is_cut =
        !texture.alpha_path.empty() || (!texture.path.empty() && has_alpha(folder_ / fs::path(texture.path)));
    if (made.base_color.a < 1 || is_cut) made.alpha = alpha_mode::blend;
}

void material_list::warn(const fs::path& library, std::uint64_t number, std::string_view line, const char* what) {
    constexpr std::size_t most_lines = 20;
    if (warnings.size() < most_lines)
        warnings.push_back(gltf::in_quotes(library.generic_string()) + ", " + cited(number, line) + ' ' + what);
}

void material_list::set_texture(std::string_view rest, const fs::path& library, bool is_alpha) {
    const map_options how = cut_options(rest);
    const std::string whole = name_of(rest), cut = name_of(before_comment(rest));
    fs::path found = find_file(folder_, whole, library);
    if (found.empty()) found = find_file(folder_, cut, library);
    const std::string path = found.empty() ? cut : found.generic_string();
    if (path.empty()) return;
    assimp::texture_source& texture = textures.back();
    const wrap_mode wrap = how.clamps ? wrap_mode::clamp_to_edge : wrap_mode::repeat;
    if (!is_alpha || texture.path.empty()) texture.wrap_s = texture.wrap_t = wrap;
    if (!is_alpha) {
        texture.path = path;
    } else {
        texture.alpha_path = path;
        texture.alpha_channel = how.channel;
    }
}

void material_list::statement(std::string_view line, const fs::path& library, std::uint64_t number) {
    std::string_view rest = line;
    const std::string key = lower(next_word(rest));
    if (key.empty() || key[0] == '#') return;
    if (key == "newmtl") {
        begin_material(rest);
        return;
    }
    if (!is_open_) return;
    material& made = materials.back();
    if (key == "kd") {
        const std::optional<glm::vec3> color = color_in(rest, true);
        if (!color) {
            warn(library, number, line, "states no colour that can be read: it is passed over");
            return;
        }
        is_black_ = *color == glm::vec3(0);
        made.base_color = glm::vec4(*color, made.base_color.a);
    } else if (key == "d") {
        std::string_view from = rest;
        const std::optional<float> value = fraction_in(lower(next_word(from)) == "-halo" ? from : rest);
        if (!value) {
            warn(library, number, line, "states no opacity: it is passed over");
            return;
        }
        has_opacity_ = true; // which counts whatever "Tr" says
        made.base_color.a = *value;
    } else if (key == "tr") {
        const std::optional<float> value = fraction_in(rest);
        if (value && !has_opacity_) made.base_color.a = 1 - *value;
    } else if (key == "map_kd") {
        set_texture(rest, library, false);
    } else if (key == "map_d" || key == "map_opacity") {
        set_texture(rest, library, true);
    } else if (options_.shading && (key == "map_ke" || key == "map_pr" || key == "map_pm")) {
        warn(library, number, line, "names a picture of light, roughness or metal, which are not read of an MTL");
    } else if (options_.shading && key == "ke") {
        made.emission = color_in(rest, false).value_or(made.emission);
    } else if (options_.shading && key == "pr") {
        made.roughness = fraction_in(rest).value_or(made.roughness);
    } else if (options_.shading && key == "pm") {
        made.metallic = fraction_in(rest).value_or(made.metallic);
    }
}

} // namespace voxelize::obj
