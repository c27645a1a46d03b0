// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// OBJ files that tests write, read as a whole and as a stream, which give the same.

#include "gltf_builder.hpp"
#include "tool_runner.hpp"

#include <read/model_file.hpp>
#include <read/triangle_stream.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace obj_test {

namespace fs = std::filesystem;

inline void write(const fs::path& file, const std::string& bytes) {
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
}

inline std::string png(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgba) {
    const std::vector<std::byte> bytes = gltf_test::png(width, height, rgba);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// A model of one file or more, in a folder of its own.
class files {
public:
    explicit files(const std::string& text, const std::vector<std::pair<std::string, std::string>>& others = {}) {
        write(model(), text);
        for (const auto& [name, bytes] : others) write(folder_.path() / name, bytes);
    }
    [[nodiscard]] fs::path model() const { return folder_.path() / "m.obj"; }
    [[nodiscard]] fs::path folder() const { return folder_.path(); }
    [[nodiscard]] voxelize::scene load(const voxelize::load_options& options = {}) const {
        return voxelize::load_model(model(), options);
    }
    // The stream of a model for which there is no room.
    [[nodiscard]] voxelize::opened_stream stream(const voxelize::load_options& options = {}) const {
        return voxelize::open_stream(model(), {std::uint64_t{1} << 20, 0}, folder_.path(), options);
    }
    // The message of the error that loading gives, and the stream too; "" where there is none.
    [[nodiscard]] std::string error(const voxelize::load_options& options = {}) const {
        const auto message_of = [](const auto& work) -> std::string {
            try {
                work();
            } catch (const voxelize::model_error& error) {
                return error.what();
            }
            return "";
        };
        const std::string loaded = message_of([&] { (void)load(options); });
        voxelize::opened_stream opened;
        const std::string streamed = message_of([&] { opened = stream(options); });
        // A file without a face is no stream: it is loaded then.
        if (!streamed.empty() || opened.stream) {
            EXPECT_EQ(loaded, streamed);
        }
        for (const char c : loaded) EXPECT_TRUE(c >= ' ' && c <= '~') << loaded;
        return loaded;
    }

private:
    tool_test::scratch_folder folder_;
};

inline std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    return text;
}

// The bits of all values, so that NaN is equal to itself and 0 is not -0.
template <class T>
std::string bits_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// One entry for each corner of a triangle, in order, and for each part.
struct flat_model {
    std::vector<std::string> names;
    std::vector<std::uint64_t> materials, triangles; // of the parts
    std::vector<glm::dvec3> origins;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec4> colors;
    std::vector<glm::vec2> texcoords;
};

inline glm::dvec3 origin_of(const voxelize::affine& place) { return place(glm::dvec3(0)); }
inline constexpr glm::vec2 no_texcoord{-7.0F};

inline flat_model flat(const voxelize::scene& whole) {
    flat_model model;
    for (const voxelize::instance& one : whole.instances) {
        const voxelize::primitive& part = whole.primitives[one.primitive];
        if (part.triangles.empty()) continue;
        model.names.push_back(part.name);
        model.materials.push_back(part.material);
        model.triangles.push_back(part.triangles.size());
        model.origins.push_back(origin_of(one.to_world));
        for (const glm::uvec3& t : part.triangles)
            for (const std::uint32_t v : {t.x, t.y, t.z}) {
                model.positions.push_back(part.positions[v]);
                if (!part.colors.empty()) model.colors.push_back(part.colors[v]);
                model.texcoords.push_back(part.texcoords.empty() ? no_texcoord : part.texcoords[v]);
            }
    }
    return model;
}

inline flat_model flat(voxelize::triangle_stream& stream) {
    flat_model model;
    std::uint64_t next = 0;
    for (const auto& part : stream.parts()) {
        EXPECT_EQ(next, part.first_number);
        next += part.num_triangles;
        model.names.push_back(part.name);
        model.materials.push_back(part.material);
        model.triangles.push_back(part.num_triangles);
        model.origins.push_back(origin_of(part.to_world));
    }
    next = 0;
    stream.for_each_block([&](const voxelize::triangle_stream::block& block) {
        EXPECT_EQ(next, block.first_number);
        next += block.corners.size() / 3;
        model.positions.insert(model.positions.end(), block.corners.begin(), block.corners.end());
        model.colors.insert(model.colors.end(), block.colors.begin(), block.colors.end());
        if (!stream.parts()[block.part].has_texcoords)
            model.texcoords.resize(model.texcoords.size() + block.corners.size(), no_texcoord);
        model.texcoords.insert(model.texcoords.end(), block.texcoords.begin(), block.texcoords.end());
    });
    EXPECT_EQ(next, stream.num_triangles());
    return model;
}

// How a material's texture is sampled, and its picture.
inline std::string texture_of(const voxelize::material& shown, const std::vector<voxelize::texture>& textures,
                              const std::vector<voxelize::picture>& images) {
    if (shown.texture == voxelize::material::no_texture) return "none";
    const voxelize::texture& t = textures[static_cast<std::size_t>(shown.texture)];
    const voxelize::picture& p = images[t.image];
    return p.name + ' ' + std::to_string(p.width) + 'x' + std::to_string(p.height) + ' ' +
           std::to_string(static_cast<int>(t.wrap_s)) + ' ' + std::to_string(static_cast<int>(t.wrap_t)) + ' ' +
           std::string(p.rgba.begin(), p.rgba.end());
}

// A model that can be streamed gives the same triangles, materials and warnings both ways.
inline void expect_same(const files& model, const voxelize::load_options& options = {}) {
    const voxelize::scene whole = model.load(options);
    const voxelize::opened_stream opened = model.stream(options);
    ASSERT_TRUE(opened.stream) << opened.refusal;
    voxelize::triangle_stream& stream = *opened.stream;
    (void)stream.bounds();
    stream.read_textures({});
    const flat_model a = flat(whole), b = flat(stream);
    EXPECT_EQ(a.names, b.names);
    EXPECT_EQ(a.materials, b.materials);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.origins, b.origins);
    EXPECT_TRUE(bits_of(a.positions) == bits_of(b.positions));
    EXPECT_TRUE(bits_of(a.colors) == bits_of(b.colors));
    EXPECT_TRUE(bits_of(a.texcoords) == bits_of(b.texcoords));
    EXPECT_EQ(whole.warnings, stream.warnings());
    EXPECT_EQ(whole.vertex_count(), stream.num_vertices());
    ASSERT_EQ(whole.materials.size(), stream.materials().size());
    for (std::size_t i = 0; i < whole.materials.size(); ++i) {
        const voxelize::material &m = whole.materials[i], &n = stream.materials()[i];
        EXPECT_EQ(m.name, n.name);
        EXPECT_EQ(m.base_color, n.base_color) << m.name;
        EXPECT_EQ(m.alpha, n.alpha) << m.name;
        EXPECT_EQ(texture_of(m, whole.textures, whole.images), texture_of(n, stream.textures(), stream.images()))
            << m.name;
    }
}

} // namespace obj_test
