// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Sources of a material's colour: the alternatives that extensions bring, and the formats of pictures.
#include "gltf_builder.hpp"

#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

using gltf_test::builder;
using gltf_test::json;
using voxelize::scene;

namespace {

constexpr bool has_webp = VOXELPIPE_TOOL_HAS_WEBP;

// 2 x 2 pixels that decode to 255, 1, 0.
constexpr const char* red_webp =
    "data:image/webp;base64,UklGRjwAAABXRUJQVlA4IDAAAADQAQCdASoCAAIAAUAmJaACdLoB+AADsAD+8ut//NgVzXPv9//S4P0uD9Lg/"
    "9KQAAA=";

std::string uri(const char* type, const std::vector<std::byte>& bytes) {
    return std::string("data:image/") + type + ";base64," + gltf_test::base64(bytes);
}

std::string green_png() { return uri("png", gltf_test::png(1, 1, {0, 255, 0, 255})); }

// A triangle with a texture; its JSON is left to the test.
builder with_texture(const json& texture, const json& images) {
    builder file;
    json& primitive = file.triangle();
    primitive["attributes"]["TEXCOORD_0"] = file.accessor(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2");
    primitive["material"] = 0;
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    file.root["textures"] = json::array({texture}); // g++ makes an array of {texture}, clang++ does not
    file.root["images"] = images;
    return file;
}

scene load(const builder& file) { return voxelize::load_gltf(file.glb()); }

std::string text_of(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    return text;
}

// The first pixel of the picture that the triangle shows; nothing where it shows none.
std::vector<int> first_pixel(const scene& scene) {
    const std::int32_t texture = scene.materials.at(scene.primitives.at(0).material).texture;
    if (texture < 0) return {};
    const auto& rgba = scene.images.at(scene.textures.at(static_cast<std::size_t>(texture)).image).rgba;
    return {rgba[0], rgba[1], rgba[2], rgba[3]};
}

json with_webp(int source) { return {{"source", 0}, {"extensions", {{"EXT_texture_webp", {{"source", source}}}}}}; }

// Programs that light a model ask for more than its colours. A texture with coordinates of its own is left out, with
// its factors; without one the factors stand alone.
TEST(GltfPictures, TexturesOfLightAreReadWhereTheyAreAskedFor) {
    builder file =
        with_texture({{"source", 0}}, {{{"uri", green_png()}}, {{"uri", green_png()}}, {{"uri", green_png()}}});
    file.root["textures"] = {{{"source", 0}}, {{"source", 1}}, {{"source", 2}}};
    json& material = file.root["materials"][0];
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 1}};
    material["pbrMetallicRoughness"]["roughnessFactor"] = 0.25;
    material["emissiveTexture"] = {{"index", 2}};
    material["emissiveFactor"] = {1.0, 0.5, 0.0};
    const scene colors = load(file);
    EXPECT_EQ(1U, colors.images.size());
    EXPECT_EQ(-1, colors.materials[0].roughness_texture);
    EXPECT_EQ(-1, colors.materials[0].emission_texture);
    EXPECT_EQ(glm::vec3(0.0f), colors.materials[0].emission);

    voxelize::gltf_options shading;
    shading.shading = true;
    const scene lit = voxelize::load_gltf(file.glb(), {}, {}, shading);
    EXPECT_EQ("", text_of(lit.warnings));
    EXPECT_EQ(3U, lit.images.size());
    EXPECT_EQ(1, lit.materials[0].roughness_texture);
    EXPECT_EQ(2, lit.materials[0].emission_texture);
    EXPECT_EQ(0.25f, lit.materials[0].roughness);
    EXPECT_EQ(1.0f, lit.materials[0].metallic);
    EXPECT_EQ(glm::vec3(1.0f, 0.5f, 0.0f), lit.materials[0].emission);

    material["emissiveTexture"]["texCoord"] = 1;
    const scene apart = voxelize::load_gltf(file.glb(), {}, {}, shading);
    EXPECT_EQ("materials[0].emissiveTexture is left out: its coordinates are not those of the material's other "
              "textures\n",
              text_of(apart.warnings));
    EXPECT_EQ(-1, apart.materials[0].emission_texture);
    EXPECT_EQ(glm::vec3(0.0f), apart.materials[0].emission);
    EXPECT_EQ(2U, apart.images.size());

    material["pbrMetallicRoughness"].erase("baseColorTexture"); // the others have coordinates too
    material["emissiveTexture"]["texCoord"] = 0;
    const scene plain = voxelize::load_gltf(file.glb(), {}, {}, shading);
    EXPECT_EQ(3U, plain.primitives[0].texcoords.size());
    EXPECT_EQ(-1, plain.materials[0].texture);
    EXPECT_EQ(0, plain.materials[0].roughness_texture);
}

TEST(GltfPictures, WebpIsPreferredToItsFallback) {
    builder file = with_texture(with_webp(1), {{{"uri", green_png()}}, {{"uri", red_webp}}});
    file.root["extensionsUsed"] = {"EXT_texture_webp"};
    const scene scene = load(file);
    if (has_webp) {
        EXPECT_EQ((std::vector<int>{255, 1, 0, 255}), first_pixel(scene));
        EXPECT_EQ("", text_of(scene.warnings));
        EXPECT_EQ(1U, scene.images.size()); // the other one is not even decoded
    } else {
        EXPECT_EQ((std::vector<int>{0, 255, 0, 255}), first_pixel(scene));
        EXPECT_EQ("images[1] cannot be used: it is WebP, and this build has no libwebp; the texture's other picture is "
                  "tried\n",
                  text_of(scene.warnings));
    }
}

TEST(GltfPictures, WebpAloneIsEnough) {
    builder file =
        with_texture({{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}, json::array({{{"uri", red_webp}}}));
    file.root["extensionsUsed"] = {"EXT_texture_webp"};
    file.root["extensionsRequired"] = {"EXT_texture_webp"};
    const scene scene = load(file);
    EXPECT_EQ(has_webp, first_pixel(scene) == (std::vector<int>{255, 1, 0, 255}));
    EXPECT_EQ(has_webp, scene.warnings.empty());
}

TEST(GltfPictures, TheFallbackStandsInForADamagedPicture) {
    std::string cut(red_webp);
    cut.resize(cut.size() - 44);
    const scene scene = load(with_texture(with_webp(1), {{{"uri", green_png()}}, {{"uri", cut}}}));
    EXPECT_EQ((std::vector<int>{0, 255, 0, 255}), first_pixel(scene));
    ASSERT_EQ(1U, scene.warnings.size());
    EXPECT_EQ(0U, scene.warnings[0].find("images[1] cannot be used: it ")) << scene.warnings[0];
    EXPECT_NE(std::string::npos, scene.warnings[0].find("the texture's other picture is tried")) << scene.warnings[0];
}

TEST(GltfPictures, AWebpOfImpossibleSizeIsRefused) {
    if (!has_webp) GTEST_SKIP() << "built without libwebp";
    // A lossless header of 16384 x 16384 and nothing behind it.
    std::vector<std::byte> bomb = gltf_test::bytes_of("RIFF\x18xxxWEBPVP8L");
    for (const int byte : {0x0C, 0, 0, 0, 0x2F, 0xFF, 0xFF, 0xFF, 0x0F, 0, 0, 0, 0, 0, 0, 0})
        bomb.push_back(static_cast<std::byte>(byte));
    for (std::size_t i = 5; i < 8; ++i) bomb[i] = std::byte{0};
    const scene scene = load(with_texture({{"source", 0}}, json::array({{{"uri", uri("webp", bomb)}}})));
    EXPECT_EQ(
        "images[0] cannot be used: its 16384 x 16384 pixels are too large: at most 16785408 are read from a WebP of "
        "32 bytes; the colour factor is used alone\n",
        text_of(scene.warnings));
}

// What is said of one picture, without what is done in its place.
std::string reason_against(const std::vector<std::byte>& picture) {
    const scene scene = load(with_texture({{"source", 0}}, json::array({{{"uri", uri("png", picture)}}})));
    if (scene.warnings.empty()) return "";
    const std::string before = "images[0] cannot be used: ", behind = "; the colour factor is used alone";
    const std::string& line = scene.warnings.front();
    EXPECT_EQ(1U, scene.warnings.size());
    EXPECT_TRUE(line.starts_with(before) && line.ends_with(behind)) << line;
    return line.substr(before.size(), line.size() - before.size() - behind.size());
}

// Writes NUMBER into COUNT bytes from AT on, the high one first.
void put(std::vector<std::byte>& bytes, std::size_t at, std::uint32_t number, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<std::byte>(number >> 8 * (count - 1 - i));
}

// A PNG whose rows are all 0, of BITS for each pixel of one channel, compressed as far as deflate goes.
std::vector<std::byte> black_png(std::uint32_t width, std::uint32_t height, std::uint32_t bits) {
    const std::vector<Bytef> raw(std::size_t{height} * (1 + (std::size_t{width} * bits + 7) / 8));
    uLongf size = compressBound(raw.size());
    std::vector<Bytef> data(size);
    EXPECT_EQ(Z_OK, compress2(data.data(), &size, raw.data(), raw.size(), 9));
    std::vector<std::byte> file = gltf_test::bytes_of("\x89PNG\r\n\x1a\n");
    const auto chunk = [&file](const char* type, const std::vector<std::byte>& content) {
        const std::size_t at = file.size();
        file.resize(at + 12 + content.size()); // the checksum stays 0: it is not read
        put(file, at, static_cast<std::uint32_t>(content.size()), 4);
        std::memcpy(file.data() + at + 4, type, 4);
        std::copy(content.begin(), content.end(), file.begin() + static_cast<std::ptrdiff_t>(at) + 8);
    };
    std::vector<std::byte> header(13);
    put(header, 0, width, 4);
    put(header, 4, height, 4);
    put(header, 8, bits, 1);
    chunk("IHDR", header);
    std::vector<std::byte> stream(size);
    std::memcpy(stream.data(), data.data(), size);
    chunk("IDAT", stream);
    chunk("IEND", {});
    return file;
}

// The start of a JPEG: its frame, of three channels.
std::vector<std::byte> jpeg_frame(std::uint32_t width, std::uint32_t height, int kind = 0xC0, int depth = 8) {
    std::vector<std::byte> file;
    for (const int byte : {0xFF, 0xD8, 0xFF, 0xE0, 0, 4, 1,    1, 0xFF, kind, 0, 17,   depth, 0, 0, 0,
                           0,    3,    1,    0x11, 0, 2, 0x11, 0, 3,    0x11, 0, 0xFF, 0xDA,  0, 12})
        file.push_back(static_cast<std::byte>(byte));
    put(file, 13, height, 2);
    put(file, 15, width, 2);
    return file;
}

TEST(GltfPictures, OneThatIsTooLargeSaysItsSizeAndTheLimit) {
    std::vector<std::byte> png = gltf_test::png(1, 1, {1, 2, 3, 4});
    put(png, 16, 20000, 4);
    EXPECT_EQ("its 20000 x 1 pixels are too large: at most 16384 a side are read", reason_against(png));
    EXPECT_EQ("its 8 x 40000 pixels are too large: at most 16384 a side are read",
              reason_against(jpeg_frame(8, 40000)));
    EXPECT_EQ("its 16000 x 16000 pixels cannot come from 31 bytes", reason_against(jpeg_frame(16000, 16000)));
}

TEST(GltfPictures, AGreyPngThatDeflateHoldsIsRead) {
    const std::vector<std::byte> grey = black_png(8192, 3072, 8);
    EXPECT_LT(grey.size(),
              8192U * 3072 * 4 / 3072); // the bound of old refused more than 64 MiB and 1024 times the file
    EXPECT_EQ("", reason_against(grey));
    EXPECT_EQ("", reason_against(black_png(1000, 700, 1)));
}

// 16 bytes of compressed data hold at most 16512 bytes of rows: 3302 of one pixel and its filter.
TEST(GltfPictures, APngOfMoreThanDeflateHoldsIsRefused) {
    std::vector<std::byte> png = gltf_test::png(1, 1, {1, 2, 3, 4});
    put(png, 20, 3303, 4);
    EXPECT_EQ("its 1 x 3303 pixels cannot come from 16 bytes of compressed data", reason_against(png));
    put(png, 20, 3302, 4);
    EXPECT_EQ("it cannot be decoded (damaged PNG: not enough pixels)", reason_against(png));
    put(png, 28, 1, 1); // interlaced: the pixels of a column come in four passes, with the same rows
    EXPECT_EQ("it cannot be decoded (damaged PNG: not enough pixels)", reason_against(png));
    put(png, 20, 3303, 4);
    EXPECT_EQ("its 1 x 3303 pixels cannot come from 16 bytes of compressed data", reason_against(png));
}

TEST(GltfPictures, EveryDamageHasAReason) {
    const std::vector<std::byte> whole = gltf_test::png(2, 2, std::vector<std::uint8_t>(16, 200));
    const auto check = [](const std::vector<std::byte>& picture, std::size_t at) {
        const std::string reason = reason_against(picture);
        EXPECT_EQ(std::string::npos, reason.find("()")) << at << ": " << reason;
        EXPECT_EQ(std::string::npos, reason.find("unknown")) << at << ": " << reason;
        EXPECT_NE("it cannot be decoded", reason) << at;
        return reason;
    };
    for (std::size_t size = 8; size + 8 < whole.size(); ++size) {
        const std::string reason = check({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}, size);
        EXPECT_EQ(0U, reason.find("the PNG is cut short")) << reason;
    }
    for (std::size_t at = 8; at < whole.size(); ++at)
        for (const int value : {0, 65, 255}) {
            std::vector<std::byte> damaged = whole;
            damaged[at] = static_cast<std::byte>(value);
            check(damaged, at);
        }
    std::vector<std::byte> strange = whole;
    put(strange, 37, 0, 4); // the type of the chunk IDAT
    EXPECT_EQ("the PNG has a chunk \"????\", which is not known and not optional", check(strange, 37));

    EXPECT_EQ("the JPEG is cut short: it has no frame", reason_against(gltf_test::bytes_of("\xFF\xD8\xFF")));
    EXPECT_EQ("it is a JPEG of a kind that is not supported: lossless, hierarchical or arithmetic",
              reason_against(jpeg_frame(8, 8, 0xC9)));
    EXPECT_EQ("it is a JPEG of 12 bits a channel, and only 8 are supported",
              reason_against(jpeg_frame(8, 8, 0xC1, 12)));
    EXPECT_EQ(0U, reason_against(jpeg_frame(8, 8)).find("it cannot be decoded (damaged JPEG: "));
}

TEST(GltfPictures, AFormatThatIsRefusedIsNamed) {
    const auto warning = [](const char* extension, std::string_view magic) {
        std::vector<std::byte> bytes = gltf_test::bytes_of(magic);
        bytes.resize(64);
        builder file =
            with_texture({{"extensions", {{extension, {{"source", 0}}}}}}, json::array({{{"uri", uri("png", bytes)}}}));
        file.root["extensionsUsed"] = {extension};
        file.root["extensionsRequired"] = {extension};
        return text_of(load(file).warnings);
    };
    const std::string end =
        ", which is not supported (PNG, JPEG, WebP, TGA and BMP are); the colour factor is used alone\n";
    EXPECT_EQ("images[0] cannot be used: it is KTX2" + end,
              warning("KHR_texture_basisu", std::string_view("\xABKTX 20\xBB\r\n\x1A\n", 12)));
    EXPECT_EQ("images[0] cannot be used: it is AVIF" + end, warning("EXT_texture_avif", std::string_view("\0\0\0\x1C"
                                                                                                         "ftypavif",
                                                                                                         12)));
    EXPECT_EQ("images[0] cannot be used: it is DDS" + end, warning("MSFT_texture_dds", "DDS "));
}

TEST(GltfPictures, APlainPictureBesideKtx2IsUsedInSilence) {
    builder file = with_texture({{"source", 0}, {"extensions", {{"KHR_texture_basisu", {{"source", 1}}}}}},
                                {{{"uri", green_png()}}, {{"uri", "data:image/ktx2;base64,AAAA"}}});
    file.root["extensionsUsed"] = {"KHR_texture_basisu"};
    const scene scene = load(file);
    EXPECT_EQ((std::vector<int>{0, 255, 0, 255}), first_pixel(scene));
    EXPECT_EQ("", text_of(scene.warnings));
}

TEST(GltfPictures, AlternativesThatPointNowhereAreErrors) {
    try {
        (void)load(with_texture(with_webp(2), {{{"uri", green_png()}}, {{"uri", red_webp}}}));
        ADD_FAILURE() << "no error";
    } catch (const voxelize::gltf_error& error) {
        EXPECT_STREQ("textures[0].extensions.EXT_texture_webp.source: 2 is not in images, which has 2", error.what());
    }
}

// KHR_materials_pbrSpecularGlossiness: what is drawn is its diffuse colour, whatever the fallback says.
TEST(GltfPictures, DiffuseTakesThePlaceOfBaseColour) {
    builder file = with_texture({{"source", 0}}, json::array({{{"uri", green_png()}}}));
    file.root["extensionsUsed"] = {"KHR_materials_pbrSpecularGlossiness"};
    json& material = file.root["materials"][0];
    material = {{"alphaMode", "MASK"},
                {"extensions",
                 {{"KHR_materials_pbrSpecularGlossiness",
                   {{"diffuseTexture", {{"index", 0}}}, {"diffuseFactor", {1, 0.5, 0.25, 0.75}}}}}}};
    scene scene = load(file);
    EXPECT_EQ("", text_of(scene.warnings));
    EXPECT_EQ((std::vector<int>{0, 255, 0, 255}), first_pixel(scene));
    EXPECT_EQ(glm::vec4(1, 0.5F, 0.25F, 0.75F), scene.materials[0].base_color);
    EXPECT_EQ(voxelize::alpha_mode::mask, scene.materials[0].alpha);
    EXPECT_EQ(3U, scene.primitives[0].texcoords.size());

    material["pbrMetallicRoughness"]["baseColorFactor"] = {0, 0, 1, 1};
    EXPECT_EQ(glm::vec4(1, 0.5F, 0.25F, 0.75F), load(file).materials[0].base_color);
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = json::object(); // its own default is white
    scene = load(file);
    EXPECT_EQ(glm::vec4(1), scene.materials[0].base_color);
    EXPECT_TRUE(first_pixel(scene).empty());
}

} // namespace
