// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Files that are wrong, or hostile: each gives its one line, and none of them much memory or time.
#include "gltf_builder.hpp"

#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>

using gltf_test::builder;
using gltf_test::json;

namespace {

std::string error_of(const std::vector<std::byte>& bytes) {
    try {
        (void)voxelize::load_gltf(bytes);
    } catch (const voxelize::gltf_error& error) {
        return error.what();
    }
    return "no error";
}

std::string error_of(const builder& file) { return error_of(file.glb()); }
std::string error_of(std::string_view text) { return error_of(gltf_test::bytes_of(text)); }

// The error of a triangle file after CHANGE(root, primitive).
template <class Change>
std::string after(Change&& change) {
    builder file;
    json& primitive = file.triangle(); // accessor and view 0: positions; 1: indices
    primitive["indices"] = file.accessor(std::vector<std::uint16_t>{0, 1, 2}, "SCALAR");
    file.root["buffers"] = {{{"byteLength", file.binary.size()}}};
    change(file.root, file.root["meshes"][0]["primitives"][0]);
    return error_of(file);
}

TEST(GltfMalformed, NotAGltf) {
    EXPECT_EQ("the file is empty", error_of(""));
    EXPECT_EQ("the GLB header is cut short", error_of("glTF\2"));
    EXPECT_NE(std::string::npos, error_of("solid cube").find("neither a GLB"));
    EXPECT_NE(std::string::npos, error_of("{\"asset\":").find("invalid JSON"));
    EXPECT_EQ("has no asset", error_of("{}"));
    EXPECT_EQ("asset: glTF version \"1.0\" is not supported, only 2.x", error_of(R"({"asset":{"version":"1.0"}})"));
    EXPECT_EQ("no such file", [] {
        try {
            (void)voxelize::load_gltf(std::filesystem::path(testing::TempDir()) / "not there.glb");
        } catch (const voxelize::gltf_error& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    }());
}

TEST(GltfMalformed, AFileThatCannotBeLookedAtSaysWhy) {
    try {
        (void)voxelize::load_gltf(std::filesystem::path(testing::TempDir()) / (std::string(300, 'a') + ".glb"));
        ADD_FAILURE() << "no error";
    } catch (const voxelize::gltf_error& error) {
        EXPECT_STREQ("cannot be read: File name too long", error.what()); // it may well be there
    }
}

TEST(GltfMalformed, EveryPrefixOfAGlbIsRefused) {
    builder file;
    file.triangle();
    const std::vector<std::byte> whole = file.glb();
    ASSERT_EQ("no error", error_of(whole));
    for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_NE("no error", error_of({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)})) << size;
}

// Every byte replaced by each of a few values: any outcome but a crash; sanitizers watch.
TEST(GltfMalformed, EveryByteMayBeWrong) {
    builder file;
    file.triangle()["indices"] = file.accessor(std::vector<std::uint16_t>{0, 1, 2}, "SCALAR");
    const std::vector<std::byte> whole = file.glb();
    std::size_t refused = 0;
    for (std::size_t at = 0; at < whole.size(); ++at) {
        for (const int value : {0x00, 0x2D, 0x39, 0x5B, 0x7F, 0xFF}) {
            std::vector<std::byte> bytes = whole;
            bytes[at] = static_cast<std::byte>(value);
            refused += error_of(bytes) != "no error";
        }
    }
    EXPECT_LT(whole.size(), refused);
}

TEST(GltfMalformed, ReferencesThatPointNowhere) {
    EXPECT_EQ("no error", after([](json&, json&) {}));
    EXPECT_EQ("meshes[0].primitives[0].attributes.POSITION: 2 is not in accessors, which has 2",
              after([](json&, json& p) { p["attributes"]["POSITION"] = 2; }));
    EXPECT_EQ("meshes[0].primitives[0].indices: must be a non-negative integer, it is -1",
              after([](json&, json& p) { p["indices"] = -1; }));
    EXPECT_EQ("meshes[0].primitives[0].material: 0 is not in materials, which has 0",
              after([](json&, json& p) { p["material"] = 0; }));
    EXPECT_EQ("nodes[0].mesh: 4294967295 is not in meshes, which has 1",
              after([](json& root, json&) { root["nodes"][0]["mesh"] = 4294967295; }));
    EXPECT_EQ("accessors[0].bufferView: 9 is not in bufferViews, which has 2",
              after([](json& root, json&) { root["accessors"][0]["bufferView"] = 9; }));
    EXPECT_EQ("bufferViews[0].buffer: 1 is not in buffers, which has 1",
              after([](json& root, json&) { root["bufferViews"][0]["buffer"] = 1; }));
    EXPECT_EQ("scene: 3 is not in scenes, which has 1", after([](json& root, json&) {
                  root["scenes"] = {{{"nodes", {0}}}};
                  root["scene"] = 3;
              }));
    EXPECT_EQ("scenes[0].nodes[1]: 1 is not in nodes, which has 1", after([](json& root, json&) {
                  root["scenes"] = {{{"nodes", {0, 1}}}};
              }));
}

TEST(GltfMalformed, WrongTypesOfJson) {
    EXPECT_EQ("nodes: must be an array", after([](json& root, json&) { root["nodes"] = 3; }));
    EXPECT_EQ("nodes[0]: must be an object", after([](json& root, json&) { root["nodes"][0] = 3; }));
    EXPECT_EQ("nodes[0].scale: must have 3 numbers", after([](json& root, json&) {
                  root["nodes"][0]["scale"] = {1, 1};
              }));
    EXPECT_EQ("nodes[0].matrix: must have numbers only",
              after([](json& root, json&) { root["nodes"][0]["matrix"] = std::vector<std::string>(16, "1"); }));
    EXPECT_EQ("accessors[0].count: must be a non-negative integer, it is \"3\"",
              after([](json& root, json&) { root["accessors"][0]["count"] = "3"; }));
    EXPECT_EQ("accessors[0].count: must be a non-negative integer, it is 2.5",
              after([](json& root, json&) { root["accessors"][0]["count"] = 2.5; }));
    EXPECT_EQ("meshes[0].primitives[0]: has no attributes", after([](json&, json& p) { p.erase("attributes"); }));
    EXPECT_EQ("meshes[0].primitives[0].mode: 7 is not in the range 0 to 6",
              after([](json&, json& p) { p["mode"] = 7; }));
}

TEST(GltfMalformed, LengthsThatDoNotFit) {
    EXPECT_EQ("accessors[0]: needs 1236 bytes of bufferViews[0], which has 36",
              after([](json& root, json&) { root["accessors"][0]["count"] = 103; }));
    EXPECT_EQ("accessors[0]: needs 48 bytes of bufferViews[0], which has 36",
              after([](json& root, json&) { root["accessors"][0]["byteOffset"] = 12; }));
    // 2^53 and 2^32 - 1: products stay inside 64 bits.
    EXPECT_EQ("accessors[0]: needs 9007250794348520 bytes of bufferViews[0], which has 36",
              after([](json& root, json&) {
                  root["accessors"][0]["byteOffset"] = 9007199254740992;
                  root["accessors"][0]["count"] = 4294967294;
                  root["accessors"][0]["componentType"] = 5126;
              }));
    EXPECT_EQ("bufferViews[0]: ends at byte 1000 of a buffer with 42",
              after([](json& root, json&) { root["bufferViews"][0]["byteLength"] = 1000; }));
    EXPECT_EQ("buffers[0]: byteLength says 45, the data has 44",
              after([](json& root, json&) { root["buffers"][0]["byteLength"] = 45; }));
    EXPECT_EQ("accessors[0]: its elements of 12 bytes overlap at byteStride 8",
              after([](json& root, json&) { root["bufferViews"][0]["byteStride"] = 8; }));
    EXPECT_EQ("meshes[0].primitives[0]: index 2 at place 2 is out of range, there are 2 vertices",
              after([](json& root, json&) { root["accessors"][0]["count"] = 2; }));
}

TEST(GltfMalformed, AttributesThatDoNotFit) {
    const auto with = [](const char* name, auto values, const char* type) {
        builder file;
        json& primitive = file.triangle();
        primitive["attributes"][name] = file.accessor(values, type);
        return error_of(file);
    };
    const std::string where = "meshes[0].primitives[0]: ";
    EXPECT_EQ(where + "COLOR_0 has 2 elements, POSITION has 3",
              with("COLOR_0", std::vector<float>{1, 1, 1, 1, 1, 1}, "VEC3"));
    EXPECT_EQ(where + "COLOR_0 is not a VEC3 or VEC4 of floats or of unsigned 8 or 16 bit integers",
              with("COLOR_0", std::vector<float>{1, 1, 1}, "SCALAR"));
    EXPECT_EQ(where + "POSITION is not a VEC3 of floats or of 8 or 16 bit integers",
              with("POSITION", std::vector<float>{1, 1, 1, 1}, "VEC2"));
    EXPECT_EQ(where + "indices are not scalars of an unsigned integer type",
              after([](json&, json& p) { p["indices"] = 0; }));
}

TEST(GltfMalformed, SparseThatDoesNotFit) {
    const auto with = [](std::vector<std::uint16_t> places, std::size_t count) {
        builder file;
        file.triangle();
        const std::vector<float> values(places.size() * 3, 1.0F);
        file.root["accessors"][0]["sparse"] = {
            {"count", count},
            {"indices",
             {{"bufferView", file.view(std::as_bytes(std::span(places)))}, {"componentType", gltf_test::u16}}},
            {"values", {{"bufferView", file.view(std::as_bytes(std::span(values)))}}}};
        return error_of(file);
    };
    EXPECT_EQ("no error", with({0, 1}, 2));
    EXPECT_EQ("meshes[0].primitives[0]: sparse index 3 of accessors[0] is out of range", with({0, 3}, 2));
    EXPECT_EQ("meshes[0].primitives[0]: sparse index 0 of accessors[0] is not in ascending order", with({1, 0}, 2));
    EXPECT_EQ("accessors[0].sparse.count: 4 is not in the range 1 to 3", with({0, 1}, 4));
    EXPECT_EQ("accessors[0].sparse.indices: needs 6 bytes of bufferViews[1], which has 4", with({0, 1}, 3));
}

TEST(GltfMalformed, NodesThatAreNoForest) {
    const auto with = [](const json& nodes, const json& scenes = nullptr) {
        builder file;
        file.triangle();
        file.root["nodes"] = nodes;
        if (!scenes.is_null()) file.root["scenes"] = scenes;
        return error_of(file);
    };
    EXPECT_EQ("nodes[0]: is below itself", with({{{"children", {0}}, {"mesh", 0}}}));
    EXPECT_EQ("nodes[1]: is below itself", with({{{"mesh", 0}}, {{"children", {2}}}, {{"children", {1}}}}));
    EXPECT_EQ("nodes[2]: is a child of two nodes", with({{{"children", {2}}}, {{"children", {2}}}, {{"mesh", 0}}}));
    EXPECT_EQ("nodes[1]: is a child of two nodes", with({{{"children", {1, 1}}}, {{"mesh", 0}}}));
    EXPECT_EQ("nodes[0]: is in the scene twice", with({{{"mesh", 0}}}, {{{"nodes", {0, 0}}}}));
    EXPECT_EQ("nodes[1]: is in the scene twice", with({{{"children", {1}}}, {{"mesh", 0}}}, {{{"nodes", {1, 0}}}}));
    EXPECT_EQ("nodes[0].rotation: is not a quaternion of a rotation",
              with({{{"rotation", {0, 0, 0, 0}}, {"mesh", 0}}}));
    EXPECT_EQ("nodes[0].matrix: its last row is not 0 0 0 1",
              with({{{"matrix", {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}, {"mesh", 0}}}));
}

TEST(GltfMalformed, LongChainsOfNodesAreWalkedWithoutRecursion) {
    builder file;
    file.triangle();
    file.root["nodes"] = json::array();
    const int length = gltf_test::is_slow_build() ? 30000 : 100000; // with checks the frames are large
    for (int i = 0; i + 1 < length; ++i) file.root["nodes"].push_back({{"children", {i + 1}}});
    file.root["nodes"].push_back({{"mesh", 0}});
    EXPECT_EQ(1U, voxelize::load_gltf(file.glb()).triangle_count());
}

TEST(GltfMalformed, DeepJsonIsRefusedBeforeItIsParsed) {
    const std::string deep = R"({"asset":{"version":"2.0"},"extras":)" + std::string(1000000, '[');
    EXPECT_EQ("the JSON text is nested deeper than 128 levels", error_of(deep));
}

TEST(GltfMalformed, PathsStayInTheFolder) {
    const auto with = [](const std::string& uri) {
        json root = {{"asset", {{"version", "2.0"}}}, {"buffers", {{{"byteLength", 1}, {"uri", uri}}}}};
        std::string asked = "nothing";
        try {
            (void)voxelize::load_gltf(gltf_test::bytes_of(root.dump()), [&](const std::filesystem::path& path, auto) {
                asked = path.generic_string();
                return std::vector<std::byte>(1);
            });
        } catch (const voxelize::gltf_error& error) {
            return std::string(error.what());
        }
        return asked;
    };
    EXPECT_EQ("a/b.bin", with("a/b.bin"));
    EXPECT_EQ("b.bin", with("./a/../b.bin"));
    EXPECT_EQ("\xC3\xA4 b", with("%C3%a4%20b"));
    for (const char* uri : {"../b.bin", "a/../../b.bin", "%2e%2e/b.bin", "a/%2E%2E/../b.bin"})
        EXPECT_NE(std::string::npos, with(uri).find("leaves the folder")) << uri;
    for (const char* uri :
         {"/etc/hostname", "%2Fetc/hostname", "file:///etc/hostname", "http://host/b.bin", "C:/b.bin", "\\b"})
        EXPECT_NE(std::string::npos, with(uri).find("not a relative path")) << uri;
    EXPECT_NE(std::string::npos, with("a%00b").find("zero byte"));
    EXPECT_NE(std::string::npos, with("").find("empty file name"));
}

TEST(GltfMalformed, OnlyRegularFilesAreRead) {
    try {
        (void)voxelize::load_gltf(std::filesystem::path("/dev/zero"));
        ADD_FAILURE() << "no error";
    } catch (const voxelize::gltf_error& error) {
        EXPECT_STREQ("not a regular file", error.what());
    }
}

TEST(GltfMalformed, ErrorsNeverSpanLinesWhateverNamesAFileUses) {
    const std::string error = error_of(R"({"asset":{"version":"9\n\u001b[31m"}})");
    EXPECT_EQ("asset: glTF version \"9??[31m\" is not supported, only 2.x", error);
}

TEST(GltfMalformed, LostGeometryIsAnErrorByName) {
    const std::string error = after([&](json& root, json&) { root["extensionsRequired"] = {"ACME_unheard_of"}; });
    EXPECT_EQ("the file requires the extension ACME_unheard_of, which is not supported", error);
    // With Draco what lies there is no mesh of it; without, nothing can be had.
    EXPECT_NE(
        std::string::npos,
        after([](json& root, json& p) {
            root["extensionsUsed"] = {"KHR_draco_mesh_compression"};
            root["accessors"][0].erase("bufferView");
            p["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}, {"attributes", {{"POSITION", 0}}}};
        }).find("Draco"));
    // A plain copy beside the compressed one is as good as a plain file.
    EXPECT_EQ("no error", after([](json& root, json& p) {
                  root["extensionsUsed"] = {"KHR_draco_mesh_compression"};
                  p["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
              }));
}

// A few hundred bytes that ask for gigabytes: refused at once.
TEST(GltfMalformed, BombsAreRefusedBeforeMemoryIsTaken) {
    const std::clock_t start = std::clock(); // of the processor: other work on the machine does not count
    const std::string zeros = after([](json& root, json&) {
        root["accessors"][0].erase("bufferView");
        root["accessors"][0]["count"] = 4294967295;
    });
    EXPECT_NE(std::string::npos, zeros.find("MiB")) << zeros;

    builder copies; // 20000 vertices shown 20000 times: kept once
    copies.mesh({{"POSITION", copies.accessor(std::vector<float>(60000), "VEC3")}});
    for (int i = 1; i < 20000; ++i) copies.append("nodes", {{"mesh", 0}});
    const voxelize::scene instances = voxelize::load_gltf(copies.glb());
    EXPECT_EQ(1U, instances.primitives.size());
    EXPECT_EQ(20000U * 20000U, instances.vertex_count());

    std::string many =
        R"({"asset": {"version": "2.0"}, "materials": [{})"; // written by hand: it is built unoptimised, too
    for (int i = 1; i < 400000; ++i) many += ",{}";
    const std::string objects = error_of(many + "]}");
    EXPECT_NE(std::string::npos, objects.find("MiB")) << objects;
    EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 60.0);
}

TEST(GltfMalformed, PicturesLargerThanTheirBytesAreRefused) {
    builder file;
    json& primitive = file.triangle();
    primitive["attributes"]["TEXCOORD_0"] = file.accessor(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2");
    primitive["material"] = 0;
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    file.root["textures"] = {{{"source", 0}}};
    const auto warning = [&](std::uint32_t width, std::uint32_t height) {
        std::vector<std::byte> picture = gltf_test::png(1, 1, {1, 2, 3, 4});
        for (int i = 0; i < 4; ++i) {
            picture[static_cast<std::size_t>(16 + i)] = static_cast<std::byte>(width >> (24 - 8 * i) & 0xFF);
            picture[static_cast<std::size_t>(20 + i)] = static_cast<std::byte>(height >> (24 - 8 * i) & 0xFF);
        }
        file.root["images"] = {{{"uri", "data:image/png;base64," + gltf_test::base64(picture)}}};
        return voxelize::load_gltf(file.glb()).warnings.at(0);
    };
    EXPECT_NE(std::string::npos, warning(16000, 16000).find("cannot come from")) << warning(16000, 16000);
    EXPECT_NE(std::string::npos, warning(100000, 10).find("images[0] cannot be used")) << warning(100000, 10);
    EXPECT_NE(std::string::npos, warning(2, 2).find("images[0] cannot be used")) << warning(2, 2);
}

} // namespace
