// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "checker.hpp"

#include <tiny_gltf.h>

#include <initializer_list>
#include <utility>

namespace voxelize::gltf {

namespace {

void check_choice(const json_at& at, std::string_view key, std::initializer_list<int> choices) {
    const auto value = at.integer(key, 0, largest_integer);
    bool listed = !value;
    for (const int choice : choices) listed = listed || *value == static_cast<std::uint64_t>(choice);
    if (!listed) at.fail(std::string(key) + ' ' + std::to_string(*value) + " is not one of glTF's");
}

} // namespace

void checker::check_images() {
    root_.each_object("images", [&](const json_at& image) {
        image_source source;
        source.name = printable(image.string("name").value_or(""));
        if (const auto uri = image.string("uri")) source.uri = std::string(*uri);
        source.buffer_view = image.index("bufferView", "bufferViews", num_views_);
        if (source.uri && source.buffer_view) image.fail("has both a uri and a bufferView");
        document_.images.push_back(std::move(source));
    });
}

void checker::check_samplers() {
    root_.each_object("samplers", [&](const json_at& sampler) {
        check_choice(sampler, "magFilter", {TINYGLTF_TEXTURE_FILTER_NEAREST, TINYGLTF_TEXTURE_FILTER_LINEAR});
        check_choice(sampler, "minFilter",
                     {TINYGLTF_TEXTURE_FILTER_NEAREST, TINYGLTF_TEXTURE_FILTER_LINEAR,
                      TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST, TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_NEAREST,
                      TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_LINEAR, TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR});
        for (const char* key : {"wrapS", "wrapT"})
            check_choice(sampler, key,
                         {TINYGLTF_TEXTURE_WRAP_REPEAT, TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE,
                          TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT});
        sampler.keep_only({"magFilter", "minFilter", "wrapS", "wrapT"});
    });
}

void checker::check_textures() {
    root_.each_object("textures", [&](const json_at& texture) {
        (void)texture.index("sampler", "samplers", num_samplers_);
        std::vector<std::uint32_t> pictures;
        const std::optional<std::uint32_t> plain = texture.index("source", "images", num_images_);
        const auto alternative = [&](const char* name) {
            const auto extensions = texture.object("extensions");
            const auto extension = extensions ? extensions->object(name) : std::nullopt;
            const auto source = extension ? extension->index("source", "images", num_images_) : std::nullopt;
            if (source) pictures.push_back(*source);
        };
        alternative("EXT_texture_webp");
        if (plain) pictures.push_back(*plain);
        // These cannot be decoded: they are asked for last, so that a picture that can be had is not missed for them.
        for (const char* name : {"KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"}) alternative(name);
        document_.texture_images.push_back(std::move(pictures));
        texture.keep_only({"sampler"});
    });
}

void checker::check_materials() {
    root_.each_object("materials", [&](const json_at& material) {
        (void)material.string("name");
        const std::string_view mode = material.string("alphaMode").value_or("OPAQUE");
        if (mode != "OPAQUE" && mode != "MASK" && mode != "BLEND")
            material.fail("alphaMode " + in_quotes(mode) + " is not one of glTF's");
        if (const auto cutoff = material.number("alphaCutoff"); cutoff && *cutoff < 0)
            material.fail("alphaCutoff is negative");
        (void)material.boolean("doubleSided");
        if (const auto pbr = material.object("pbrMetallicRoughness")) {
            pbr->check_numbers("baseColorFactor", 4);
            if (const auto info = pbr->object("baseColorTexture")) check_texture_info(*info);
            if (options_.shading) {
                (void)pbr->number("metallicFactor");
                (void)pbr->number("roughnessFactor");
                if (const auto info = pbr->object("metallicRoughnessTexture")) check_texture_info(*info);
                pbr->keep_only({"baseColorFactor", "baseColorTexture", "metallicFactor", "roughnessFactor",
                                "metallicRoughnessTexture"});
            } else {
                pbr->keep_only({"baseColorFactor", "baseColorTexture"});
            }
        }
        if (options_.shading) {
            material.check_numbers("emissiveFactor", 3);
            if (const auto info = material.object("emissiveTexture")) check_texture_info(*info);
        }
        if (const auto extensions = material.object("extensions"))
            if (const auto old = extensions->object("KHR_materials_pbrSpecularGlossiness")) use_diffuse(material, *old);
        if (options_.shading)
            material.keep_only({"name", "alphaMode", "alphaCutoff", "doubleSided", "pbrMetallicRoughness",
                                "emissiveFactor", "emissiveTexture"});
        else
            material.keep_only({"name", "alphaMode", "alphaCutoff", "doubleSided", "pbrMetallicRoughness"});
    });
}

// Finds the variant that is asked for among the file's.
void checker::choose_variant() {
    const auto extensions = root_.object("extensions");
    const auto of_file = extensions ? extensions->object("KHR_materials_variants") : std::nullopt;
    constexpr std::size_t most_named = 20;
    std::string known;
    if (of_file)
        of_file->each_object("variants", [&](const json_at& variant) {
            const std::string_view name = variant.string("name").value_or("");
            if (options_.variant && name == *options_.variant && !variant_) variant_ = num_variants_;
            if (num_variants_ < most_named) known += (num_variants_ == 0 ? "" : ", ") + in_quotes(name);
            ++num_variants_;
        });
    if (num_variants_ > most_named) known += ", ...";
    if (options_.variant && !variant_)
        throw gltf_error("there is no material variant " + in_quotes(*options_.variant) +
                         (num_variants_ == 0 ? ", the file has none" : "; the file has " + known));
    if (!options_.variant && num_variants_ != 0)
        tolerance_.warnings().push_back("the file has " + std::to_string(num_variants_) + " material variant(s), " +
                                        known + ": surfaces have their own materials, --variant chooses one");
}

// A primitive's mappings from variants to materials; that of the chosen one takes the place of its material.
void checker::use_variant(const json_at& primitive, const json_at& extension) const {
    std::optional<std::uint32_t> chosen;
    extension.each_object("mappings", [&](const json_at& mapping) {
        const std::uint32_t material =
            mapping.required("material", mapping.index("material", "materials", num_materials_));
        mapping.each("variants", [&](const json_at& variant) {
            if (variant.as_index("variants", num_variants_) == variant_ && !chosen) chosen = material;
        });
    });
    if (chosen) primitive.value()["material"] = *chosen;
}

// A renderer that knows the extension draws with it alone: its diffuse colour takes the place of the base colour.
void checker::use_diffuse(const json_at& material, const json_at& extension) const {
    json base = json::object();
    if (extension.check_numbers("diffuseFactor", 4)) base["baseColorFactor"] = extension.value()["diffuseFactor"];
    if (const auto info = extension.object("diffuseTexture")) {
        check_texture_info(*info);
        base["baseColorTexture"] = info->value();
    }
    base["metallicFactor"] = 0;
    material.value()["pbrMetallicRoughness"] = std::move(base);
}

void checker::check_texture_info(const json_at& info) const {
    (void)info.required("index", info.index("index", "textures", num_textures_));
    (void)info.integer("texCoord", 0, INT32_MAX);
    if (const auto extensions = info.object("extensions")) {
        if (const auto transform = extensions->object("KHR_texture_transform")) {
            transform->check_numbers("offset", 2);
            transform->check_numbers("scale", 2);
            (void)transform->number("rotation");
            (void)transform->integer("texCoord", 0, INT32_MAX);
            transform->keep_only({"offset", "scale", "rotation", "texCoord"});
        }
        extensions->keep_only({"KHR_texture_transform"});
    }
    info.keep_only({"index", "texCoord", "extensions"});
}

} // namespace voxelize::gltf
