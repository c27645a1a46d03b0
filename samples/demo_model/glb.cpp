// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "glb.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb_image_write.h>

namespace demo_model {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");

using json = nlohmann::ordered_json; // keeps the order in which we add

// Constants of the glTF 2.0 specification.
constexpr int type_u8 = 5121, type_u16 = 5123, type_u32 = 5125, type_f32 = 5126;
constexpr int target_vertices = 34962, target_indices = 34963;
constexpr int filter_linear = 9729, filter_mipmap = 9987, wrap_repeat = 10497, wrap_clamp = 33071;

// The binary chunk under construction, with the views and accessors that point into it.
class buffer_builder {
public:
    std::size_t add_view(std::span<const std::byte> bytes, int target) {
        while (bytes_.size() % 4 != 0) bytes_.push_back(std::byte{0});
        json view{{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
        if (target != 0) view["target"] = target;
        views_.push_back(view);
        bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
        return views_.size() - 1;
    }

    template <class T>
    std::size_t add_accessor(const std::vector<T>& values, int component, const char* type, int target,
                             const json& more) {
        const std::size_t view = add_view(std::as_bytes(std::span{values}), target);
        json accessor{{"bufferView", view}, {"componentType", component}, {"count", values.size()}, {"type", type}};
        accessor.update(more);
        accessors_.push_back(accessor);
        return accessors_.size() - 1;
    }

    [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }
    [[nodiscard]] const json& views() const { return views_; }
    [[nodiscard]] const json& accessors() const { return accessors_; }

private:
    std::vector<std::byte> bytes_;
    json views_ = json::array();
    json accessors_ = json::array();
};

std::vector<std::byte> encode_png(const texture& t) {
    std::vector<std::byte> png;
    const auto append = [](void* context, void* data, int size) {
        const auto* bytes = static_cast<const std::byte*>(data);
        auto& to = *static_cast<std::vector<std::byte>*>(context);
        to.insert(to.end(), bytes, bytes + size);
    };
    const bool opaque = std::all_of(t.pixels.begin(), t.pixels.end(), [](const rgba& c) { return c[3] == 255; });
    std::vector<std::uint8_t> values;
    for (const rgba& c : t.pixels) values.insert(values.end(), c.begin(), c.begin() + (opaque ? 3 : 4));
    const int components = opaque ? 3 : 4;
    if (stbi_write_png_to_func(append, &png, t.width, t.height, components, values.data(), t.width * components) == 0)
        throw std::runtime_error("cannot encode the texture " + t.name);
    return png;
}

json primitive_of(buffer_builder& buffer, const part& p) {
    const mesh& m = p.triangles;
    json low = json::array(), high = json::array();
    for (std::size_t a = 0; a < 3; ++a) {
        float from = m.positions.front()[a], to = from;
        for (const auto& position : m.positions) {
            from = std::min(from, position[a]);
            to = std::max(to, position[a]);
        }
        low.push_back(from);
        high.push_back(to);
    }
    json attributes;
    attributes["POSITION"] =
        buffer.add_accessor(m.positions, type_f32, "VEC3", target_vertices, {{"min", low}, {"max", high}});
    attributes["NORMAL"] = buffer.add_accessor(m.normals, type_f32, "VEC3", target_vertices, json::object());
    attributes["TEXCOORD_0"] = buffer.add_accessor(m.uvs, type_f32, "VEC2", target_vertices, json::object());
    if (std::any_of(m.colors.begin(), m.colors.end(), [](const rgba& c) { return c != white; }))
        attributes["COLOR_0"] = buffer.add_accessor(m.colors, type_u8, "VEC4", target_vertices, {{"normalized", true}});
    std::size_t indices;
    if (m.positions.size() < 65535) { // the highest 16-bit index is reserved
        const std::vector<std::uint16_t> narrow(m.indices.begin(), m.indices.end());
        indices = buffer.add_accessor(narrow, type_u16, "SCALAR", target_indices, json::object());
    } else {
        indices = buffer.add_accessor(m.indices, type_u32, "SCALAR", target_indices, json::object());
    }
    return {{"attributes", attributes}, {"indices", indices}, {"material", p.material}};
}

json material_of(const material& m, std::size_t texture) {
    json surface{{"baseColorFactor", m.base_color}, {"metallicFactor", 0}, {"roughnessFactor", m.roughness}};
    if (m.texture) surface["baseColorTexture"] = {{"index", texture}};
    json out{{"name", m.name}, {"pbrMetallicRoughness", surface}};
    if (m.cut_out) {
        out["alphaMode"] = "MASK";
        out["alphaCutoff"] = 0.5;
        out["doubleSided"] = true;
    }
    return out;
}

json node_of(const node& n) {
    json out{{"name", n.name}};
    const vec3 t = n.translation;
    if (t.x != 0 || t.y != 0 || t.z != 0) out["translation"] = {t.x, t.y, t.z};
    if (n.turn != 0) {
        const double half = n.turn * std::numbers::pi / 360;
        const auto rounded = [](double v) { return std::round(v * 1048576) / 1048576; }; // see geometry.hpp
        out["rotation"] = {0, rounded(std::sin(half)), 0, rounded(std::cos(half))};
    }
    if (n.scale != 1) out["scale"] = {n.scale, n.scale, n.scale};
    if (n.mesh) out["mesh"] = *n.mesh;
    if (!n.children.empty()) out["children"] = n.children;
    return out;
}

void append_u32(std::string& to, std::size_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8) to.push_back(static_cast<char>(value >> shift & 0xff));
}

} // namespace

std::size_t num_triangles(const scene& s) {
    std::size_t sum = 0;
    for (const node& n : s.nodes)
        if (n.mesh)
            for (const part& p : s.meshes[*n.mesh].parts) sum += p.triangles.num_triangles();
    return sum;
}

void write_glb(const scene& s, const std::filesystem::path& path) {
    buffer_builder buffer;
    json document;
    document["asset"] = {{"version", "2.0"}, {"generator", "VoxelPipe demo_model"}};
    document["scene"] = 0;
    document["scenes"] = json::array({{{"nodes", {0}}}});
    for (const node& n : s.nodes) document["nodes"].push_back(node_of(n));
    for (const auto& m : s.meshes) {
        json primitives = json::array();
        for (const part& p : m.parts) primitives.push_back(primitive_of(buffer, p));
        document["meshes"].push_back({{"name", m.name}, {"primitives", primitives}});
    }
    for (const texture& t : s.textures)
        document["images"].push_back(
            {{"name", t.name}, {"mimeType", "image/png"}, {"bufferView", buffer.add_view(encode_png(t), 0)}});
    document["samplers"] = json::array();
    for (const int wrap : {wrap_repeat, wrap_clamp})
        document["samplers"].push_back(
            {{"magFilter", filter_linear}, {"minFilter", filter_mipmap}, {"wrapS", wrap}, {"wrapT", wrap}});
    document["textures"] = json::array();
    for (const material& m : s.materials) {
        const std::size_t texture = document["textures"].size();
        if (m.texture) document["textures"].push_back({{"sampler", m.repeat ? 0 : 1}, {"source", *m.texture}});
        document["materials"].push_back(material_of(m, texture));
    }
    document["accessors"] = buffer.accessors();
    document["bufferViews"] = buffer.views();
    std::vector<std::byte> binary = buffer.bytes();
    document["buffers"] = json::array({{{"byteLength", binary.size()}}});
    binary.resize((binary.size() + 3) / 4 * 4);

    std::string text = document.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string head = "glTF";
    append_u32(head, 2);
    append_u32(head, 12 + 8 + text.size() + 8 + binary.size());
    append_u32(head, text.size());
    head += "JSON";
    std::string between;
    append_u32(between, binary.size());
    between += "BIN";
    between.push_back('\0');

    const std::filesystem::path temporary = path.string() + ".part";
    std::ofstream out(temporary, std::ios::binary);
    out << head << text << between;
    out.write(reinterpret_cast<const char*>(binary.data()), static_cast<std::streamsize>(binary.size()));
    out.close();
    std::error_code error;
    if (out) std::filesystem::rename(temporary, path, error);
    if (!out || error) {
        std::filesystem::remove(temporary, error);
        throw std::runtime_error("cannot write '" + path.string() + "'");
    }
}

} // namespace demo_model
