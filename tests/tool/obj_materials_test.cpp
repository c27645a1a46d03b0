// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Materials of OBJ files: libraries, colours, opacity and textures, and statements that cannot be read, which never
// cost geometry.
#include "obj_files.hpp"

#include <cmath>

namespace {

using obj_test::expect_same;
using obj_test::files;
using obj_test::joined;
using obj_test::png;
using others = std::vector<std::pair<std::string, std::string>>;

// sRGB bytes that a linear colour shows as.
glm::ivec3 shown_as(const glm::vec3& linear) {
    glm::ivec3 bytes;
    for (int i = 0; i < 3; ++i) {
        const double c = linear[i];
        bytes[i] =
            static_cast<int>(std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
    }
    return bytes;
}

// A square of side 2 in z = 5 that faces +z, with texture coordinates and a material.
const std::string square = "mtllib square.mtl\nv 0 0 5\nv 2 0 5\nv 2 2 5\nv 0 2 5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                           "usemtl paint\nf 1/1 2/2 3/3 4/4\n";
const std::vector<std::uint8_t> four_texels{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 9, 9, 9, 255};

// The square with a library "paint" that states this.
files painted(const std::string& statements, others more = {}) {
    more.emplace_back("square.mtl", "newmtl paint\n" + statements + "\n");
    return files(square, more);
}

const voxelize::material& paint_of(const voxelize::scene& scene) {
    return scene.materials.at(scene.primitives.at(0).material);
}

// The texels of the square's picture.
const voxelize::picture& picture_of(const voxelize::scene& scene) {
    return scene.images.at(scene.textures.at(static_cast<std::size_t>(paint_of(scene).texture)).image);
}

TEST(ObjMaterials, ShowTheColoursThatTheFileSays) {
    const voxelize::scene scene =
        files(square, {{"square.mtl", "newmtl other\nKd 1 0 0\nnewmtl paint\nKd 0.5 0.25 0.75\nd 0.5\n"}}).load();
    EXPECT_EQ("", joined(scene.warnings));
    const voxelize::material& paint = paint_of(scene);
    EXPECT_EQ("paint", paint.name);
    EXPECT_EQ(glm::ivec3(128, 64, 191), shown_as(paint.base_color));
    EXPECT_EQ(0.5F, paint.base_color.a);
    EXPECT_EQ(voxelize::alpha_mode::blend, paint.alpha);
    EXPECT_EQ(voxelize::material::no_texture, paint.texture);
    EXPECT_TRUE(scene.primitives[0].texcoords.empty());
    EXPECT_EQ(3U, scene.materials.size()) << "the default material, and those of the library in its order";
}

TEST(ObjMaterials, ColoursAreReadInEveryForm) {
    const auto color = [](const std::string& statements) {
        const voxelize::scene scene = painted(statements).load();
        EXPECT_EQ("", joined(scene.warnings)) << statements;
        EXPECT_EQ(2U, scene.triangle_count()) << statements;
        return shown_as(paint_of(scene).base_color);
    };
    const glm::ivec3 white(255), red(255, 0, 0);
    EXPECT_EQ(red, color("Kd 1 0 0"));
    EXPECT_EQ(red, color("\t kd 1. .0 0 # red"));
    EXPECT_EQ(red, color("KD 1 0 \\\n 0\r\n"));
    EXPECT_EQ(red, color("Kd 7 -1 0"));
    EXPECT_EQ(glm::ivec3(51), color("Kd .2"));
    EXPECT_EQ(glm::ivec3(254, 0, 0), color("Kd xyz 0.4 0.2 0.0")) << "CIE XYZ";
    EXPECT_EQ(white, color("Ks 1 1 1\nillum 2\n")) << "no Kd";
    EXPECT_EQ(red, color("Kd 1 0 0\naniso 0.7\nanisor 0.8\nPcr 1\nfrobnicate\nmap_aniso\nsharpness x\nKa"));
    EXPECT_EQ(red, color("Kd 1 0 0\nnewmtl paint\nKd 0 1 0")) << "the first one counts";
}

TEST(ObjMaterials, StatementsThatCannotBeReadCostNothingElse) {
    for (const std::string wrong : {"Kd", "Kd red", "Kd spectral red.rfl", "Kd nan 0 0"}) {
        const voxelize::scene scene = painted("d 0.5\n" + wrong).load();
        EXPECT_EQ(2U, scene.triangle_count());
        EXPECT_EQ(glm::vec4(1, 1, 1, 0.5F), paint_of(scene).base_color) << wrong;
        EXPECT_EQ("\"square.mtl\", line 3: '" + wrong + "' states no colour that can be read: it is passed over\n",
                  joined(scene.warnings));
    }
    const voxelize::scene scene = painted("Kd 1 0 0\nd x\nTr\nmap_Kd\nmap_d").load();
    EXPECT_EQ(glm::vec4(1, 0, 0, 1), paint_of(scene).base_color);
    EXPECT_EQ("\"square.mtl\", line 3: 'd x' states no opacity: it is passed over\n", joined(scene.warnings));
    expect_same(painted("Kd x\nd x"));
}

TEST(ObjMaterials, OpacityIsOfDOrTr) {
    const auto alpha = [](const std::string& statements) { return paint_of(painted(statements).load()).base_color.a; };
    EXPECT_EQ(0.25F, alpha("d 0.25"));
    EXPECT_EQ(0.25F, alpha("d -halo 0.25"));
    EXPECT_EQ(0.75F, alpha("Tr 0.25"));
    EXPECT_EQ(1.0F, alpha("d 1\nTr 1")) << "d counts where a file has both";
    EXPECT_EQ(1.0F, alpha("Tr 1\nd 1"));
    EXPECT_EQ(1.0F, alpha("d 7"));
}

TEST(ObjMaterials, LightIsReadWhereItIsAskedFor) {
    const files model = painted("Ke 2 1 .5\nPr 0.3\nPm 1\n");
    voxelize::load_options options;
    EXPECT_EQ(glm::vec3(0), paint_of(model.load(options)).emission);
    options.gltf.shading = true;
    const voxelize::material paint = paint_of(model.load(options));
    EXPECT_EQ(glm::vec3(2, 1, 0.5F), paint.emission);
    EXPECT_EQ(0.3F, paint.roughness);
    EXPECT_EQ(1.0F, paint.metallic);
}

// The colour at the top left of the square, of a picture whose top row is red, green.
TEST(ObjMaterials, TexturesStandUpright) {
    for (const char* name :
         {"maps/wood grain.png", "maps\\wood grain.png", ".\\maps\\wood grain.png", "\"maps/wood grain.png\"",
          "-s 2 2 -o 0.5 0 maps/wood grain.png", "-blendu on -blendv off -bm 1 -clamp off -mm 0 1 maps/wood grain.png",
          "-imfchan l -cc on -boost 2 -texres 64 -t 1 2 3 maps/wood grain.png # oak", "C:\\work\\maps\\wood.png"}) {
        const voxelize::scene scene =
            painted("Kd 1 1 1\nmap_Kd " + std::string(name),
                    {{"maps/wood grain.png", png(2, 2, four_texels)}, {"wood.png", png(2, 2, four_texels)}})
                .load();
        ASSERT_EQ("", joined(scene.warnings)) << name;
        const voxelize::primitive& part = scene.primitives.at(0);
        ASSERT_EQ(0, paint_of(scene).texture) << name;
        EXPECT_EQ(four_texels, picture_of(scene).rgba);
        EXPECT_EQ(voxelize::wrap_mode::repeat, scene.textures[0].wrap_s);
        EXPECT_EQ(voxelize::alpha_mode::blend, paint_of(scene).alpha) << "a picture with alpha";
        ASSERT_EQ(part.positions.size(), part.texcoords.size());
        for (std::size_t i = 0; i < part.positions.size(); ++i) { // v runs down: (0, 0) is the top left, at (0, 2)
            const glm::dvec3 p = scene.instances.at(0).to_world(part.positions[i]);
            EXPECT_EQ(glm::vec2(static_cast<float>(p.x) / 2, 1 - static_cast<float>(p.y) / 2), part.texcoords[i]);
        }
    }
    const voxelize::scene clamped = painted("map_Kd -clamp on wood.png", {{"wood.png", png(2, 2, four_texels)}}).load();
    EXPECT_EQ(voxelize::wrap_mode::clamp_to_edge, clamped.textures.at(0).wrap_s);
}

TEST(ObjMaterials, ATextureIsFoundBesideTheModelOrItsLibrary) {
    const std::string picture = png(1, 1, {1, 2, 3, 255});
    for (const char* name : {"C:\\work\\wood.png", "/home/me/wood.png", "../maps/wood.png", "maps/wood.png"}) {
        const voxelize::scene scene = painted("Kd 0 0 0\nmap_Kd " + std::string(name), {{"wood.png", picture}}).load();
        EXPECT_EQ("", joined(scene.warnings)) << name;
        EXPECT_EQ(1U, scene.images.size()) << name;
        // Black beside a texture is what exporters leave there.
        EXPECT_EQ(glm::vec4(1), paint_of(scene).base_color);
    }
    const std::string text = "mtllib lib\\square.mtl\n" + square.substr(square.find('\n') + 1);
    const files model(text, {{"lib/square.mtl", "newmtl paint\nmap_Kd wood.png\n"}, {"lib/wood.png", picture}});
    EXPECT_EQ(1U, model.load().images.size()) << joined(model.load().warnings);
}

TEST(ObjMaterials, ATextureThatCannotBeHadIsAWarning) {
    const auto with = [](const others& more) {
        const voxelize::scene scene = painted("Kd 0.5 0.5 0.5\nmap_Kd wood.tga", more).load();
        EXPECT_EQ(2U, scene.triangle_count());
        EXPECT_TRUE(scene.primitives.at(0).texcoords.empty());
        return joined(scene.warnings);
    };
    EXPECT_EQ("the texture \"wood.tga\" cannot be used: no such file; the material's colour is used alone\n", with({}));
    EXPECT_EQ("the texture \"wood.tga\" cannot be used: it is neither PNG, JPEG, WebP, TGA nor BMP; the material's "
              "colour is used alone\n",
              with({{"wood.tga", "\x01\x02"}}));
}

TEST(ObjMaterials, AlphaOfAPictureCounts) {
    const std::vector<std::uint8_t> leaf{1, 2, 3, 0, 4, 5, 6, 255};
    const voxelize::scene scene = painted("Kd 1 1 1\nmap_Kd leaf.png", {{"leaf.png", png(2, 1, leaf)}}).load();
    EXPECT_EQ(voxelize::alpha_mode::blend, paint_of(scene).alpha);
    EXPECT_EQ(leaf, picture_of(scene).rgba);
}

TEST(ObjMaterials, APictureOfAlphaAloneCounts) {
    const std::string wood = png(2, 1, {10, 20, 30, 255, 40, 50, 60, 255});
    // Grey, in a larger picture; then in the alpha of one.
    const std::string grey = png(2, 2, {0, 0, 0, 255, 255, 255, 255, 255, 128, 128, 128, 255, 0, 255, 0, 255});
    const std::string mask = png(1, 1, {255, 255, 255, 51});
    const others all{{"wood.png", wood}, {"grey.png", grey}, {"mask.png", mask}};
    const auto texels = [&](const std::string& statements) {
        const voxelize::scene scene = painted(statements, all).load();
        EXPECT_EQ("", joined(scene.warnings)) << statements;
        EXPECT_EQ(voxelize::alpha_mode::blend, paint_of(scene).alpha) << statements;
        expect_same(painted(statements, all));
        return picture_of(scene).rgba;
    };
    EXPECT_EQ((std::vector<std::uint8_t>{10, 20, 30, 0, 40, 50, 60, 255, 10, 20, 30, 128, 40, 50, 60, 149}),
              texels("map_Kd wood.png\nmap_d grey.png"));
    EXPECT_EQ((std::vector<std::uint8_t>{10, 20, 30, 0, 40, 50, 60, 255, 10, 20, 30, 128, 40, 50, 60, 0}),
              texels("map_d -imfchan r grey.png\nmap_Kd wood.png"));
    EXPECT_EQ((std::vector<std::uint8_t>{10, 20, 30, 51, 40, 50, 60, 51}), texels("map_Kd wood.png\nmap_d mask.png"));
    EXPECT_EQ((std::vector<std::uint8_t>{255, 255, 255, 51}), texels("Kd 1 0 0\nmap_d mask.png"));
    EXPECT_EQ((std::vector<std::uint8_t>{255, 255, 255, 51}), texels("map_Kd mask.png\nmap_d mask.png"));
    const voxelize::scene scene = painted("map_Kd wood.png\nmap_d gone.png", all).load();
    EXPECT_EQ(1U, scene.images.size());
    EXPECT_EQ("the texture \"gone.png\" cannot be used: no such file; the material's colours are opaque\n",
              joined(scene.warnings));
}

// The header of a TGA.
std::string tga(int type, int width, int height, int bits, int descriptor, const std::string& pixels) {
    std::string bytes(18, '\0');
    bytes[2] = static_cast<char>(type);
    bytes[12] = static_cast<char>(width & 0xFF);
    bytes[13] = static_cast<char>(width >> 8);
    bytes[14] = static_cast<char>(height & 0xFF);
    bytes[15] = static_cast<char>(height >> 8);
    bytes[16] = static_cast<char>(bits);
    bytes[17] = static_cast<char>(descriptor);
    return bytes + pixels;
}

// A BMP with the header of 40 bytes.
std::string bmp(int width, int height, int bits, int compression, const std::string& pixels) {
    std::string bytes("BM");
    const auto put = [&bytes](int value, int count) {
        for (int i = 0; i < count; ++i) bytes += static_cast<char>(static_cast<unsigned>(value) >> (8 * i) & 0xFFU);
    };
    put(54 + static_cast<int>(pixels.size()), 4);
    put(0, 4);
    put(54, 4);
    put(40, 4);
    put(width, 4);
    put(height, 4);
    put(1, 2);
    put(bits, 2);
    put(compression, 4);
    put(static_cast<int>(pixels.size()), 4);
    for (int i = 0; i < 4; ++i) put(0, 4);
    return bytes + pixels;
}

TEST(ObjMaterials, TgaAndBmpAreRead) {
    const auto texels = [](const std::string& picture) {
        const voxelize::scene scene = painted("map_Kd a.pic", {{"a.pic", picture}}).load();
        EXPECT_EQ("", joined(scene.warnings));
        return scene.images.size() == 1 ? picture_of(scene).rgba : std::vector<std::uint8_t>();
    };
    using rgba = std::vector<std::uint8_t>;
    const rgba two{3, 2, 1, 255, 6, 5, 4, 255};
    EXPECT_EQ(two, texels(tga(2, 2, 1, 24, 0, "\1\2\3\4\5\6")));
    EXPECT_EQ(two, texels(tga(10, 2, 1, 24, 0, "\1\1\2\3\4\5\6"))) << "packed";
    EXPECT_EQ((rgba{3, 2, 1, 255, 3, 2, 1, 255}), texels(tga(10, 2, 1, 24, 0, "\x81\1\2\3"))) << "a run";
    EXPECT_EQ((rgba{3, 2, 1, 9}), texels(tga(2, 1, 1, 32, 8, "\1\2\3\x9")));
    EXPECT_EQ((rgba{3, 2, 1, 255}), texels(tga(2, 1, 1, 32, 0, "\1\2\3\x9"))) << "it says that it has no alpha";
    EXPECT_EQ((rgba{7, 7, 7, 255}), texels(tga(3, 1, 1, 8, 0, "\7"))) << "grey";
    EXPECT_EQ((rgba{1, 1, 1, 255, 2, 2, 2, 255}), texels(tga(3, 1, 2, 8, 0, "\2\1"))) << "the lowest row first";
    EXPECT_EQ((rgba{2, 2, 2, 255, 1, 1, 1, 255}), texels(tga(3, 1, 2, 8, 0x20, "\2\1"))) << "the top row first";
    EXPECT_EQ(two, texels(bmp(2, 1, 24, 0, std::string("\1\2\3\4\5\6\0\0", 8))));
    EXPECT_EQ((rgba{3, 2, 1, 9}), texels(bmp(1, 1, 32, 0, "\1\2\3\x9")));
    EXPECT_EQ((rgba{3, 2, 1, 255, 6, 5, 4, 255}), texels(bmp(1, -2, 24, 0, std::string("\1\2\3\0\4\5\6\0", 8))))
        << "the top row first";
}

TEST(ObjMaterials, TgaAndBmpThatCannotBeAreRefused) {
    const auto reason = [](const std::string& picture) {
        const std::string all = joined(painted("map_Kd a.pic", {{"a.pic", picture}}).load().warnings);
        const std::string before = "the texture \"a.pic\" cannot be used: ",
                          behind = "; the material's colour is used alone\n";
        EXPECT_TRUE(all.starts_with(before) && all.ends_with(behind)) << all;
        return all.substr(before.size(), all.size() - before.size() - behind.size());
    };
    EXPECT_EQ("the TGA is cut short: its 2 x 1 pixels cannot come from 23 bytes", reason(tga(2, 2, 1, 24, 0, "12345")));
    EXPECT_EQ("the TGA is cut short: its 16000 x 16000 pixels cannot come from 22 bytes",
              reason(tga(10, 16000, 16000, 24, 0, "\xFF\1\2\3")));
    EXPECT_EQ("its 20000 x 1 pixels are too large: at most 16384 a side are read",
              reason(tga(2, 20000, 1, 24, 0, "1")));
    EXPECT_EQ("the BMP is cut short: its 2 x 1 pixels cannot come from 58 bytes", reason(bmp(2, 1, 24, 0, "1234")));
    EXPECT_EQ("it is a compressed BMP, and only those without compression are supported",
              reason(bmp(2, 1, 8, 1, "1234")));
    EXPECT_EQ("its 20000 x 1 pixels are too large: at most 16384 a side are read", reason(bmp(20000, 1, 24, 0, "1")));
    EXPECT_EQ("the BMP is cut short within its header", reason("BM and so on"));
    EXPECT_EQ("it is KTX2, which is not supported (PNG, JPEG, WebP, TGA and BMP are)",
              reason(std::string("\xABKTX 20\xBB\r\n\x1A\n and more of it")));
}

// A square of two materials, A and B, behind LIBRARIES.
std::string two_materials(const std::string& libraries) {
    return libraries + "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n";
}

glm::vec4 color_of(const voxelize::scene& scene, const std::string& name) {
    for (const voxelize::material& entry : scene.materials)
        if (entry.name == name) return entry.base_color;
    ADD_FAILURE() << "no material " << name;
    return {};
}

TEST(ObjMaterials, SeveralLibrariesAreRead) {
    const glm::vec4 red(1, 0, 0, 1), green(0, 1, 0, 1);
    const others all{{"red.mtl", "newmtl a\nKd 1 0 0"},
                     {"my greens.MTL", "\xEF\xBB\xBFnewmtl b\r\nKd 0 1 0\r\n"},
                     {"plain", "newmtl b\nKd 0 1 0\n"},
                     {"greens.mtl", "newmtl b\nKd 0 1 0\nnewmtl a\nKd 0 0 1\n"}};
    for (const char* const libraries :
         {"mtllib red.mtl my greens.MTL\n", "mtllib my greens.MTL  red.mtl\r\n", "mtllib red.mtl plain\n",
          "mtllib red.mtl\nmtllib my greens.MTL\n", "mtllib red.mtl\nmtllib plain\n",
          "mtllib red.mtl greens.mtl # both\n", "\xEF\xBB\xBF  mtllib red.mtl \\\n greens.mtl\n",
          "mtllib \"red.mtl\"\nmtllib \"my greens.MTL\"\n", "mtllib .\\red.mtl\nmtllib C:\\work\\greens.mtl\n"}) {
        const voxelize::scene scene = files(two_materials(libraries), all).load();
        EXPECT_EQ("", joined(scene.warnings)) << libraries;
        EXPECT_EQ(red, color_of(scene, "a")) << libraries;
        EXPECT_EQ(green, color_of(scene, "b")) << libraries;
    }
    // Behind the faces.
    EXPECT_EQ(red, color_of(files(two_materials("") + "mtllib red.mtl plain\n", all).load(), "a"));
}

TEST(ObjMaterials, AMessageNamesTheLibraryThatCannotBeRead) {
    const auto warnings = [](const std::string& libraries, const others& all) {
        const files model(two_materials(libraries), all);
        expect_same(model);
        return joined(model.load().warnings);
    };
    const std::string a = "newmtl a\nKd 1 0 0\n", start = "the material library ";
    EXPECT_EQ(start + "\"gone.mtl\" cannot be read: surfaces of its materials are white\n",
              warnings("mtllib red.mtl gone.mtl\n", {{"red.mtl", a}}));
    EXPECT_EQ(start + "\"gone.mtl\" cannot be read: surfaces of its materials are white\n",
              warnings("mtllib gone.mtl\nmtllib red.mtl\n", {{"red.mtl", a}}));
    EXPECT_EQ(start + "\"one.mtl\" cannot be read: surfaces are white\n" + start +
                  "\"two.mtl\" cannot be read: surfaces are white\n",
              warnings("mtllib one.mtl two.mtl\n", {}));
    EXPECT_EQ(start + "\"m.mtl\" cannot be read: surfaces are white\n", warnings("mtllib m.mtl\n", {}));
    EXPECT_EQ(start + "\"wide.mtl\" cannot be read: surfaces are white\n",
              warnings("mtllib wide.mtl\n", {{"wide.mtl", "\xFF\xFEn"}}));
    // That beside the model, with its name, where nothing that is named is there.
    EXPECT_EQ(start + "\"gone.mtl\" cannot be read: \"m.mtl\" is read in its place\n",
              warnings("mtllib gone.mtl\n", {{"m.mtl", a}}));
    EXPECT_EQ("the material \"b\" is in no material library of the file: surfaces of it are white\n",
              warnings("mtllib red.mtl\n", {{"red.mtl", a}}));
    EXPECT_EQ("", warnings("", {{"m.mtl", a}}));
    const voxelize::scene scene = files(two_materials("mtllib red.mtl gone.mtl\n"), {{"red.mtl", a}}).load();
    EXPECT_EQ(glm::vec4(1, 0, 0, 1), color_of(scene, "a"));
    EXPECT_EQ(glm::vec4(1), color_of(scene, "b"));
    EXPECT_EQ(glm::vec4(1), files(square.substr(square.find('v'))).load().materials.at(0).base_color);
}

TEST(ObjMaterials, NamesMayHaveBlanksAndNumberSigns) {
    for (const char* const name : {"old oak", "Material #25", "a#1", "oak  # comment"}) {
        const std::string defined = std::string(name).substr(0, std::string(name).find("  #"));
        const std::string text =
            "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl  " + std::string(name) + " \nf 1 2 3\n";
        const voxelize::scene scene = files(text, {{"m.mtl", "newmtl " + defined + "\t\nKd 1 0 0\n"}}).load();
        EXPECT_EQ("", joined(scene.warnings)) << name;
        EXPECT_EQ(glm::vec4(1, 0, 0, 1), paint_of(scene).base_color) << name;
    }
}

TEST(ObjMaterials, FilesOutsideTheFolderAreNotRead) {
    const files model(two_materials("mtllib ../out.mtl\nmtllib a/../../out.mtl\n"));
    obj_test::write(model.folder().parent_path() / "out.mtl", "newmtl a\nKd 1 0 0\n");
    EXPECT_EQ(glm::vec4(1), color_of(model.load(), "a"));
    obj_test::fs::remove(model.folder().parent_path() / "out.mtl");
}

TEST(ObjMaterials, TexturesMatterOnlyWhereColoursDo) {
    const files model("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1e39 -1e39 7\nusemtl a\nf 1/1 2/1 3/1\n"
                      "usemtl b\nf 1/1 2/2 3/1\nusemtl c\nf 1/2 3/2 2/1\n",
                      {{"m.mtl", "newmtl a\nKd 0 0 0\nmap_Kd none.png\nd 0.5\nnewmtl b\nmap_Kd one.png\nnewmtl c\n"},
                       {"one.png", png(4, 4, std::vector<std::uint8_t>(64, 255))}});
    voxelize::load_options options;
    const auto textures = [&] {
        expect_same(model, options);
        const voxelize::scene scene = model.load(options);
        return std::pair{scene.textures.size(), scene.warnings.size()};
    };
    EXPECT_EQ(std::pair(std::size_t{1}, std::size_t{1}), textures()) << "none.png is not there";
    options.gltf.colors = false;
    EXPECT_EQ(std::pair(std::size_t{0}, std::size_t{0}), textures());
    options.gltf.blend_cuts = true;
    EXPECT_EQ(std::pair(std::size_t{1}, std::size_t{1}), textures()) << "a and b are masks then";
}

} // namespace
