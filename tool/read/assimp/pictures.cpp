// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures.hpp"

#include "file_name.hpp"
#include "read/gltf/picture_file.hpp"
#include "read/gltf/text.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace voxelize::assimp {

namespace {

class picture_loader {
public:
    picture_loader(const model& source, const gltf_file_reader& read_file, gltf::budget& memory, scene& result,
                   const load_hooks& hooks)
        : source_{source}, read_file_{read_file}, memory_{memory}, scene_{result}, hooks_{hooks} {}

    // Material INDEX will show its texture. All that do are named before the first is loaded.
    void will_show(std::size_t index) {
        users_[key_of(source_.textures[index])].push_back(static_cast<std::uint32_t>(index));
    }

    // The texture of material INDEX in the scene, or none and a warning.
    std::int32_t load(std::size_t index) {
        const texture_source& wanted = source_.textures[index];
        const std::string key = key_of(wanted);
        auto found = images_.find(key);
        if (found == images_.end()) {
            std::int32_t image = material::no_texture;
            try {
                picture decoded = decode(wanted);
                decoded.name = gltf::printable(key);
                if (hooks_.picture) hooks_.picture(scene_, decoded, users_[key]);
                image = static_cast<std::int32_t>(scene_.images.size());
                scene_.images.push_back(std::move(decoded));
            } catch (const model_error& error) {
                scene_.warnings.push_back("the texture " + gltf::in_quotes(key) + " cannot be used: " + error.what() +
                                          "; the material's colour is used alone");
            } catch (const std::bad_alloc&) {
                throw picture_memory_error("the picture " + gltf::in_quotes(key));
            }
            found = images_.emplace(key, image).first;
        }
        if (found->second == material::no_texture) return material::no_texture;
        texture entry;
        entry.image = static_cast<std::uint32_t>(found->second);
        entry.wrap_s = wanted.wrap_s;
        entry.wrap_t = wanted.wrap_t;
        scene_.textures.push_back(entry);
        return static_cast<std::int32_t>(scene_.textures.size() - 1);
    }

private:
    static std::string key_of(const texture_source& wanted) {
        std::string key = wanted.path;
        if (key.empty() && wanted.embedded >= 0) key = '*' + std::to_string(wanted.embedded);
        if (wanted.alpha_path.empty()) return key;
        if (!key.empty()) key += " with ";
        return key + wanted.alpha_path + (wanted.alpha_channel != 0 ? std::string(":") + wanted.alpha_channel : "");
    }

    picture decode(const texture_source& wanted) const {
        if (wanted.alpha_path.empty()) return decode_color(wanted);
        const bool is_alone = wanted.path.empty() && wanted.embedded < 0;
        picture alpha;
        try {
            alpha = decode_file(wanted.alpha_path);
        } catch (const model_error& error) {
            if (is_alone) throw;
            scene_.warnings.push_back("the texture " + gltf::in_quotes(wanted.alpha_path) +
                                      " cannot be used: " + error.what() + "; the material's colours are opaque");
            return decode_color(wanted);
        }
        if (is_alone) {
            picture white;
            white.width = white.height = 1;
            white.rgba.assign(4, 255);
            return with_alpha(white, alpha, wanted.alpha_channel);
        }
        return with_alpha(wanted.path == wanted.alpha_path ? opaque(alpha) : decode_color(wanted), alpha,
                          wanted.alpha_channel);
    }

    static picture opaque(picture shown) {
        for (std::size_t at = 3; at < shown.rgba.size(); at += 4) shown.rgba[at] = 255;
        return shown;
    }

    // COLOR, with its alpha multiplied by a channel of ALPHA, at the greater size of both along each axis.
    picture with_alpha(const picture& color, const picture& alpha, char channel) const {
        const auto is_opaque = [&alpha] {
            for (std::size_t at = 3; at < alpha.rgba.size(); at += 4)
                if (alpha.rgba[at] != 255) return false;
            return true;
        };
        constexpr std::string_view channels = "rgbm";
        std::size_t which = channels.find(channel);
        if (which == std::string_view::npos && channel != 'l' && !is_opaque()) which = 3;
        picture result;
        result.width = std::max(color.width, alpha.width);
        result.height = std::max(color.height, alpha.height);
        memory_.charge(std::uint64_t{result.width} * result.height, 4, "a texture with its alpha");
        result.rgba.resize(std::size_t{4} * result.width * result.height);
        const auto texel = [&result](const picture& of, std::uint32_t x, std::uint32_t y) {
            const std::size_t column = std::uint64_t{x} * of.width / result.width;
            const std::size_t row = std::uint64_t{y} * of.height / result.height;
            return of.rgba.data() + 4 * (row * of.width + column);
        };
        std::uint8_t* to = result.rgba.data();
        for (std::uint32_t y = 0; y < result.height; ++y)
            for (std::uint32_t x = 0; x < result.width; ++x, to += 4) {
                const std::uint8_t *const c = texel(color, x, y), *const a = texel(alpha, x, y);
                // Rec. 601, in 1/256.
                const unsigned value =
                    which != std::string_view::npos ? a[which] : (77U * a[0] + 150U * a[1] + 29U * a[2] + 128U) >> 8U;
                std::copy_n(c, 3, to);
                to[3] = static_cast<std::uint8_t>((c[3] * value + 127U) / 255U);
            }
        return result;
    }

    picture decode_color(const texture_source& wanted) const {
        if (!wanted.path.empty()) return decode_file(wanted.path);
        const embedded_picture& embedded = source_.embedded[static_cast<std::size_t>(wanted.embedded)];
        if (embedded.width == 0) return gltf::decode_picture(embedded.bytes, memory_.limits());
        if (embedded.height == 0) throw model_error("it has no pixels");
        memory_.charge(embedded.bytes.size(), 1, "an embedded texture");
        picture result;
        result.width = embedded.width;
        result.height = embedded.height;
        for (const std::byte byte : embedded.bytes) result.rgba.push_back(std::to_integer<std::uint8_t>(byte));
        return result;
    }

    picture decode_file(const std::string& name) const {
        const std::optional<std::filesystem::path> path = local_file(name);
        if (!path) throw model_error("it is no file's name");
        if (!read_file_) throw model_error("other files are not read");
        // At the path that the model names, else beside the model.
        std::vector<std::byte> bytes;
        try {
            bytes = read_file_(*path, memory_.limits().max_file_bytes);
        } catch (const model_error&) {
            if (path->filename() == *path) throw;
            bytes = read_file_(path->filename(), memory_.limits().max_file_bytes);
        }
        memory_.grant_input(bytes.size());
        return gltf::decode_picture(bytes, memory_.limits());
    }

    const model& source_;
    const gltf_file_reader& read_file_;
    gltf::budget& memory_;
    scene& scene_;
    const load_hooks& hooks_;
    std::map<std::string, std::int32_t> images_;
    std::map<std::string, std::vector<std::uint32_t>> users_; // the materials that show each picture
};

} // namespace

bool asks_for_texture(const material& shown, const texture_source& source, const gltf_options& options) {
    return source.is_there() && (options.colors || (options.blend_cuts && shown.alpha == alpha_mode::blend));
}

void name_files(const model& source, const gltf_options& options) {
    if (!options.names_file) return;
    const auto name = [&](const std::string& file, bool is_beside) {
        const std::optional<std::filesystem::path> path = local_file(file);
        if (!path) return;
        options.names_file(*path);
        if (is_beside) options.names_file(path->filename());
    };
    for (const std::string& file : source.files) name(file, false);
    for (const texture_source& texture : source.textures)
        for (const std::string* const path : {&texture.path, &texture.alpha_path})
            if (!path->empty()) name(*path, true);
}

void load_pictures(const model& source, const std::vector<bool>& asked_for, const gltf_file_reader& read_file,
                   gltf::budget& memory, scene& result, const load_hooks& hooks) {
    picture_loader pictures{source, read_file, memory, result, hooks};
    for (std::size_t i = 0; i < asked_for.size(); ++i)
        if (asked_for[i]) pictures.will_show(i);
    for (std::size_t i = 0; i < asked_for.size(); ++i)
        if (asked_for[i]) result.materials[i].texture = pictures.load(i);
}

} // namespace voxelize::assimp
