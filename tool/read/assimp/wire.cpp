// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "wire.hpp"

#include "read/gltf/text.hpp"

#include <algorithm>

namespace voxelize::assimp {

std::vector<std::byte> to_bytes(const model& source) {
    wire_writer out;
    out.value(static_cast<std::uint64_t>(source.primitives.size()));
    for (const primitive& part : source.primitives) {
        out.list(part.name);
        out.list(part.positions);
        out.list(part.triangles);
        out.list(part.lines);
        out.list(part.texcoords);
        out.list(part.colors);
        out.value(part.material);
    }
    out.list(source.instances);
    out.value(static_cast<std::uint64_t>(source.materials.size()));
    for (std::size_t i = 0; i < source.materials.size(); ++i) {
        const material& entry = source.materials[i];
        out.list(entry.name);
        out.value(entry.base_color);
        out.value(entry.alpha);
        out.value(entry.double_sided);
        const texture_source& texture = source.textures[i];
        out.list(texture.path);
        out.value(texture.embedded);
        out.value(texture.wrap_s);
        out.value(texture.wrap_t);
    }
    out.value(static_cast<std::uint64_t>(source.embedded.size()));
    for (const embedded_picture& picture : source.embedded) {
        out.value(picture.width);
        out.value(picture.height);
        out.list(picture.bytes);
    }
    out.value(static_cast<std::uint64_t>(source.warnings.size()));
    for (const std::string& warning : source.warnings) out.list(warning);
    out.value(static_cast<std::uint64_t>(source.files.size()));
    for (const std::string& file : source.files) out.list(file);
    return out.take();
}

namespace {

void check(const model& m) {
    const auto require = [](bool holds) {
        if (!holds) wire_reader::fail();
    };
    for (const primitive& part : m.primitives) {
        require(part.material < m.materials.size());
        require(part.texcoords.empty() || part.texcoords.size() == part.positions.size());
        require(part.colors.empty() || part.colors.size() == part.positions.size());
        for (const glm::uvec3& t : part.triangles)
            require(t.x < part.positions.size() && t.y < part.positions.size() && t.z < part.positions.size());
        for (const glm::uvec2& l : part.lines) require(l.x < part.positions.size() && l.y < part.positions.size());
        require(part.triangles.empty() || part.lines.empty());
    }
    for (const instance& shown : m.instances)
        require(shown.primitive < m.primitives.size() && shown.to_world.is_finite());
    for (const texture_source& texture : m.textures)
        require(texture.embedded < static_cast<std::int64_t>(m.embedded.size()) &&
                texture.wrap_s <= wrap_mode::mirrored_repeat && texture.wrap_t <= wrap_mode::mirrored_repeat);
    for (const material& entry : m.materials) require(entry.alpha <= alpha_mode::blend);
    for (const embedded_picture& picture : m.embedded)
        require(picture.width == 0 || picture.bytes.size() / 4 / picture.width == picture.height);
}

} // namespace

model from_bytes(std::span<const std::byte> bytes) {
    wire_reader in{bytes};
    const auto text = [&in] {
        std::string line;
        in.list(line);
        return line;
    };
    model result;
    result.primitives.resize(in.count(44));
    for (primitive& part : result.primitives) {
        part.name = gltf::printable(text());
        in.list(part.positions);
        in.list(part.triangles);
        in.list(part.lines);
        in.list(part.texcoords);
        in.list(part.colors);
        in.value(part.material);
    }
    in.list(result.instances);
    result.materials.resize(in.count(40));
    result.textures.resize(result.materials.size());
    for (std::size_t i = 0; i < result.materials.size(); ++i) {
        material& entry = result.materials[i];
        entry.name = gltf::printable(text());
        in.value(entry.base_color);
        in.value(entry.alpha);
        std::uint8_t double_sided = 0;
        in.value(double_sided);
        entry.double_sided = double_sided != 0;
        texture_source& texture = result.textures[i];
        texture.path = text();
        in.value(texture.embedded);
        in.value(texture.wrap_s);
        in.value(texture.wrap_t);
    }
    result.embedded.resize(in.count(16));
    for (embedded_picture& picture : result.embedded) {
        in.value(picture.width);
        in.value(picture.height);
        in.list(picture.bytes);
    }
    result.warnings.resize(in.count(8));
    for (std::string& warning : result.warnings) warning = gltf::printable(text(), 300);
    result.files.resize(in.count(8));
    for (std::string& file : result.files) file = text();
    if (!in.at_end()) wire_reader::fail();
    check(result);
    return result;
}

} // namespace voxelize::assimp
