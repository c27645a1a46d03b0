// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The demo model read back by tinygltf, which had no part in writing it.

#include "glb.hpp"
#include "lighthouse.hpp"
#include "test_volumes.hpp"

#include <cmath>
#include <set>

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define STB_IMAGE_IMPLEMENTATION
#include <tiny_gltf.h>

using namespace voxelize::testing;

namespace {

class DemoModel : public in_folder {
protected:
    tinygltf::Model load() {
        path_ = folder_ / "demo.glb";
        demo_model::write_glb(scene(), path_);
        tinygltf::Model model;
        tinygltf::TinyGLTF loader;
        std::string error, warning;
        EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, path_.string())) << error;
        EXPECT_EQ(error, "");
        EXPECT_EQ(warning, "");
        return model;
    }

    // Painting the textures takes most of the time, so it is done once.
    static const demo_model::scene& scene() {
        static const demo_model::scene made = demo_model::make_lighthouse();
        return made;
    }

    std::filesystem::path path_;
};

// Values of an accessor without stride, as the writer lays them out.
template <class T>
std::vector<T> values_of(const tinygltf::Model& model, int accessor, int components) {
    const tinygltf::Accessor& a = model.accessors.at(static_cast<std::size_t>(accessor));
    const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(a.bufferView));
    const auto& bytes = model.buffers.at(0).data;
    std::vector<T> out(a.count * static_cast<std::size_t>(components));
    const std::size_t from = view.byteOffset + a.byteOffset;
    EXPECT_EQ(from % sizeof(T), 0u);
    EXPECT_LE(from + out.size() * sizeof(T), bytes.size());
    std::memcpy(out.data(), bytes.data() + from, out.size() * sizeof(T));
    return out;
}

} // namespace

TEST_F(DemoModel, IsValidAndUsesWhatTheLoaderReads) {
    const tinygltf::Model model = load();
    EXPECT_GE(model.meshes.size(), 8u);
    EXPECT_GE(model.materials.size(), 10u);
    EXPECT_GE(model.images.size(), 6u);
    EXPECT_GT(model.nodes.size(), model.meshes.size()); // meshes are used several times
    std::size_t colored = 0, masked = 0, textured = 0, turned = 0;
    for (const auto& mesh : model.meshes)
        for (const auto& p : mesh.primitives) {
            const auto& attributes = p.attributes;
            const auto positions = values_of<float>(model, attributes.at("POSITION"), 3);
            const auto normals = values_of<float>(model, attributes.at("NORMAL"), 3);
            const auto uvs = values_of<float>(model, attributes.at("TEXCOORD_0"), 2);
            ASSERT_EQ(positions.size(), normals.size());
            ASSERT_EQ(positions.size() / 3, uvs.size() / 2);
            for (std::size_t n = 0; n < normals.size(); n += 3) {
                const float length = std::hypot(normals[n], normals[n + 1], normals[n + 2]);
                ASSERT_NEAR(length, 1, 1e-3) << mesh.name;
            }
            const tinygltf::Accessor& bounds = model.accessors.at(static_cast<std::size_t>(attributes.at("POSITION")));
            for (std::size_t a = 0; a < 3; ++a) {
                float low = positions[a], high = positions[a];
                for (std::size_t n = a; n < positions.size(); n += 3) {
                    low = std::min(low, positions[n]);
                    high = std::max(high, positions[n]);
                }
                EXPECT_EQ(static_cast<double>(low), bounds.minValues.at(a));
                EXPECT_EQ(static_cast<double>(high), bounds.maxValues.at(a));
            }
            std::vector<std::uint32_t> indices;
            if (model.accessors.at(static_cast<std::size_t>(p.indices)).componentType ==
                TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)
                for (const std::uint16_t i : values_of<std::uint16_t>(model, p.indices, 1)) indices.push_back(i);
            else
                indices = values_of<std::uint32_t>(model, p.indices, 1);
            ASSERT_EQ(indices.size() % 3, 0u);
            // Faces and normals agree on which side is out; only on the jagged rock a few smooth normals may not.
            for (std::size_t n = 0; n < indices.size(); n += 3) {
                std::array<std::array<double, 3>, 3> corner{};
                std::array<double, 3> normal{};
                for (std::size_t c = 0; c < 3; ++c)
                    for (std::size_t a = 0; a < 3; ++a) {
                        ASSERT_LT(indices[n + c], positions.size() / 3);
                        corner[c][a] = static_cast<double>(positions[3 * std::size_t{indices[n + c]} + a]);
                        normal[a] += static_cast<double>(normals[3 * std::size_t{indices[n + c]} + a]);
                    }
                double along = 0;
                for (std::size_t a = 0; a < 3; ++a) {
                    const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
                    const auto edge = [&](std::size_t e, std::size_t axis) {
                        return corner[e][axis] - corner[0][axis];
                    };
                    along += normal[a] * (edge(1, b) * edge(2, c) - edge(1, c) * edge(2, b));
                }
                if (along < 0) ++turned;
            }
            if (attributes.contains("COLOR_0")) ++colored;
            const auto& material = model.materials.at(static_cast<std::size_t>(p.material));
            if (material.alphaMode == "MASK") ++masked;
            if (material.pbrMetallicRoughness.baseColorTexture.index >= 0) ++textured;
        }
    EXPECT_LE(turned * 1000, demo_model::num_triangles(scene()));
    EXPECT_GE(colored, 4u);
    EXPECT_GE(masked, 2u);
    EXPECT_GE(textured, 8u);
    const std::size_t triangles = demo_model::num_triangles(scene());
    EXPECT_GE(triangles, 10000u);
    EXPECT_LE(triangles, 50000u);
}

TEST_F(DemoModel, EveryNodeHangsOnTheRootOnce) {
    const tinygltf::Model model = load();
    std::multiset<int> reached;
    std::vector<int> open = model.scenes.at(0).nodes;
    while (!open.empty()) {
        const int n = open.back();
        open.pop_back();
        reached.insert(n);
        ASSERT_EQ(reached.count(n), 1u);
        const auto& children = model.nodes.at(static_cast<std::size_t>(n)).children;
        open.insert(open.end(), children.begin(), children.end());
    }
    EXPECT_EQ(reached.size(), model.nodes.size());
}

TEST_F(DemoModel, CutOutTexturesHaveBothKindsOfPixel) {
    const tinygltf::Model model = load();
    int cut_out = 0;
    for (const auto& material : model.materials) {
        if (material.alphaMode != "MASK") continue;
        const auto& texture =
            model.textures.at(static_cast<std::size_t>(material.pbrMetallicRoughness.baseColorTexture.index));
        const auto& image = model.images.at(static_cast<std::size_t>(texture.source));
        std::size_t opaque = 0, clear = 0;
        for (std::size_t n = 3; n < image.image.size(); n += 4) ++(image.image[n] >= 128 ? opaque : clear);
        EXPECT_GT(opaque, 100u) << image.name;
        EXPECT_GT(clear, 100u) << image.name;
        ++cut_out;
    }
    EXPECT_EQ(cut_out, 2);
}

TEST_F(DemoModel, SameBytesEveryTime) {
    load();
    const std::string first = read_file(path_);
    demo_model::write_glb(demo_model::make_lighthouse(), folder_ / "again.glb");
    EXPECT_TRUE(read_file(folder_ / "again.glb") == first);
    EXPECT_THROW(demo_model::write_glb(scene(), folder_ / "no" / "a.glb"), std::runtime_error);
    EXPECT_EQ(names(), (std::vector<std::string>{"again.glb", "demo.glb"}));
}
