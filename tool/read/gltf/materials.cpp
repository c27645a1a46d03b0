// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "materials.hpp"

#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <string>
#include <utility>

namespace voxelize::gltf {

namespace {

wrap_mode wrap_of(int value) {
    if (value == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return wrap_mode::clamp_to_edge;
    if (value == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) return wrap_mode::mirrored_repeat;
    return wrap_mode::repeat;
}

texture_coordinates coordinates_of(const tinygltf::TextureInfo& info) {
    texture_coordinates result;
    result.set = info.texCoord;
    const auto found = info.extensions.find("KHR_texture_transform");
    if (found == info.extensions.end()) return result;
    const tinygltf::Value& transform = found->second;
    const auto pair = [&](const char* key, double fallback) {
        if (!transform.Has(key)) return std::array{fallback, fallback};
        return std::array{transform.Get(key).Get(0).GetNumberAsDouble(), transform.Get(key).Get(1).GetNumberAsDouble()};
    };
    const auto offset = pair("offset", 0);
    const auto scale = pair("scale", 1);
    const double angle = transform.Has("rotation") ? transform.Get("rotation").GetNumberAsDouble() : 0;
    if (transform.Has("texCoord")) result.set = transform.Get("texCoord").GetNumberAsInt();
    // Counter-clockwise as one sees it in the picture, where v runs downwards: that is what the extension's prose and
    // every viewer do, its GLSL listing has the sign the other way round. Scale first, then rotation, then offset.
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    result.m = {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
    return result;
}

} // namespace

void material_reader::read_factors() {
    for (const tinygltf::Material& source : model_.materials) {
        material result;
        result.name = printable(source.name);
        for (int i = 0; i < 4; ++i)
            result.base_color[i] = static_cast<float>(source.pbrMetallicRoughness.baseColorFactor[std::size_t(i)]);
        if (source.alphaMode == "MASK") result.alpha = alpha_mode::mask;
        if (source.alphaMode == "BLEND") result.alpha = alpha_mode::blend;
        result.alpha_cutoff = static_cast<float>(source.alphaCutoff);
        result.double_sided = source.doubleSided;
        if (options_.shading) {
            if (source.emissiveFactor.size() == 3)
                for (int i = 0; i < 3; ++i)
                    result.emission[i] = static_cast<float>(source.emissiveFactor[std::size_t(i)]);
            result.roughness = static_cast<float>(source.pbrMetallicRoughness.roughnessFactor);
            result.metallic = static_cast<float>(source.pbrMetallicRoughness.metallicFactor);
        }
        scene_.materials.push_back(std::move(result));
    }
}

std::vector<material_reader::wanted_texture> material_reader::textures_of(std::size_t material_index) const {
    const tinygltf::Material& source = model_.materials[material_index];
    const alpha_mode alpha = scene_.materials[material_index].alpha;
    const bool cuts = alpha == alpha_mode::mask || (alpha == alpha_mode::blend && options_.blend_cuts);
    std::vector<wanted_texture> found;
    const auto add = [&](const tinygltf::TextureInfo& info, std::int32_t material::*field, const char* name) {
        if (info.index >= 0) found.push_back({&info, field, name});
    };
    if (options_.colors || cuts)
        add(source.pbrMetallicRoughness.baseColorTexture, &material::texture, "baseColorTexture");
    if (options_.shading) {
        add(source.pbrMetallicRoughness.metallicRoughnessTexture, &material::roughness_texture,
            "metallicRoughnessTexture");
        if (scene_.materials[material_index].emission != glm::vec3(0.0F))
            add(source.emissiveTexture, &material::emission_texture, "emissiveTexture");
    }
    return found;
}

std::optional<texture_coordinates> material_reader::want_texture(std::size_t material_index) {
    const std::vector<wanted_texture> textures = textures_of(material_index);
    if (textures.empty()) return std::nullopt;
    bool has_picture = false;
    if (!wanted_[material_index]) queue_.push_back(material_index);
    for (const wanted_texture& wanted : textures) {
        const std::vector<std::uint32_t>& pictures =
            bytes_.texture_images(static_cast<std::size_t>(wanted.info->index));
        has_picture = has_picture || !pictures.empty();
        if (wanted_[material_index]) continue;
        for (const std::uint32_t picture : pictures)
            users_[picture].push_back(static_cast<std::uint32_t>(material_index));
    }
    wanted_[material_index] = true;
    if (!has_picture) return std::nullopt;
    return coordinates_of(*textures.front().info);
}

void material_reader::read_textures(const load_hooks& hooks) {
    for (const std::size_t index : queue_) {
        const std::vector<wanted_texture> textures = textures_of(index);
        for (const wanted_texture& wanted : textures) {
            if (coordinates_of(*wanted.info) == coordinates_of(*textures.front().info))
                scene_.materials[index].*wanted.field =
                    scene_texture(static_cast<std::size_t>(wanted.info->index), hooks);
            else
                leave_out(index, wanted);
        }
    }
    for (primitive& part : scene_.primitives) {
        const material& m = scene_.materials[part.material];
        if (std::max({m.texture, m.roughness_texture, m.emission_texture}) == material::no_texture) part.texcoords = {};
    }
}

void material_reader::leave_out(std::size_t material_index, const wanted_texture& wanted) {
    scene_.warnings.push_back("materials[" + std::to_string(material_index) + "]." + wanted.name +
                              " is left out: its coordinates are not those of the material's other textures");
    material& m = scene_.materials[material_index];
    const material defaults;
    if (wanted.field == &material::emission_texture) m.emission = defaults.emission;
    if (wanted.field == &material::roughness_texture) {
        m.roughness = defaults.roughness;
        m.metallic = defaults.metallic;
    }
}

std::int32_t material_reader::scene_texture(std::size_t index, const load_hooks& hooks) {
    std::optional<std::int32_t>& result = texture_of_[index];
    if (result) return *result;
    result = material::no_texture;
    const tinygltf::Texture& source = model_.textures[index];
    const std::vector<std::uint32_t>& pictures = bytes_.texture_images(index);
    if (pictures.empty()) {
        scene_.warnings.push_back("textures[" + std::to_string(index) +
                                  "] names no picture: the colour factor is used alone");
        return *result;
    }
    std::int32_t image = material::no_texture;
    for (std::size_t i = 0; i < pictures.size() && image == material::no_texture; ++i)
        image = scene_image(pictures[i],
                            i + 1 == pictures.size() ? "the colour factor is used alone"
                                                     : "the texture's other picture is tried",
                            hooks);
    if (image == material::no_texture) return *result;
    texture entry;
    entry.image = static_cast<std::uint32_t>(image);
    if (source.sampler >= 0) {
        const tinygltf::Sampler& sampler = model_.samplers[static_cast<std::size_t>(source.sampler)];
        entry.wrap_s = wrap_of(sampler.wrapS);
        entry.wrap_t = wrap_of(sampler.wrapT);
        // The magnification filter decides how level 0 is sampled, linear where none is given.
        if (sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) entry.filter = filter_mode::nearest;
    }
    result = static_cast<std::int32_t>(scene_.textures.size());
    scene_.textures.push_back(entry);
    return *result;
}

std::int32_t material_reader::scene_image(std::size_t index, const char* instead, const load_hooks& hooks) {
    std::optional<std::int32_t>& result = image_of_[index];
    if (result) return *result;
    result = material::no_texture;
    try {
        const std::optional<std::uint32_t> view = bytes_.image_view(index);
        picture decoded = bytes_.decode_image(index, view ? accessors_.view(*view) : std::span<const std::byte>{});
        if (hooks.picture) hooks.picture(scene_, decoded, users_[index]);
        scene_.images.push_back(std::move(decoded));
        result = static_cast<std::int32_t>(scene_.images.size() - 1);
    } catch (const gltf_error& error) {
        scene_.warnings.push_back("images[" + std::to_string(index) + "] cannot be used: " + error.what() + "; " +
                                  instead);
    } catch (const std::bad_alloc&) {
        throw picture_memory_error("the picture images[" + std::to_string(index) + "]" + bytes_.image_title(index));
    }
    return *result;
}

} // namespace voxelize::gltf
