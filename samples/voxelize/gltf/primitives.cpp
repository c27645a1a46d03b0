// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "primitives.hpp"

#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace voxelize::gltf {

std::uint64_t triangle_count(int mode, std::uint64_t count) {
    if (mode == TINYGLTF_MODE_TRIANGLES) return count / 3;
    return count < 3 ? 0 : count - 2;
}

std::vector<glm::uvec3> unrolled(int mode, const std::vector<std::uint32_t>& indices, std::uint64_t count) {
    const auto index = [&](std::uint64_t i) {
        return indices.empty() ? static_cast<std::uint32_t>(i) : indices[static_cast<std::size_t>(i)];
    };
    const std::uint64_t num_triangles = triangle_count(mode, count);
    std::vector<glm::uvec3> triangles;
    triangles.reserve(static_cast<std::size_t>(num_triangles));
    for (std::uint64_t i = 0; i < num_triangles; ++i) {
        glm::uvec3 corners;
        if (mode == TINYGLTF_MODE_TRIANGLES) {
            corners = {index(3 * i), index(3 * i + 1), index(3 * i + 2)};
        } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
            corners = {index(i), index(i + 1 + i % 2), index(i + 2 - i % 2)};
        } else {
            corners = {index(i + 1), index(i + 2), index(0)};
        }
        const bool stitch = corners.x == corners.y || corners.y == corners.z || corners.z == corners.x;
        if (stitch && mode != TINYGLTF_MODE_TRIANGLES) continue;
        triangles.push_back(corners);
    }
    return triangles;
}

namespace {

void check_position_type(const tinygltf::Accessor& accessor, const std::string& where) {
    if (accessor.type != TINYGLTF_TYPE_VEC3 || accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        throw gltf_error(where + ": POSITION is not a VEC3 of floats or of 8 or 16 bit integers");
}

} // namespace

void primitive_reader::show(const shown_mesh& shown, std::size_t part) {
    const tinygltf::Primitive& source = model_.meshes[shown.mesh].primitives[part];
    const bool posed = source.mode >= TINYGLTF_MODE_TRIANGLES && poses_.is_posed(shown, source);
    const std::tuple key{shown.mesh, part, posed ? shown.node : -1};
    auto found = known_.find(key);
    if (found == known_.end()) found = known_.emplace(key, read(shown, part, posed)).first;
    const read_part& known = found->second;
    if (!known.primitive) return;
    memory_.charge(1, sizeof(instance), "nodes");
    // A unit of 1 must leave every bit of the transform, even that of -0.
    affine to_world = known.unit == 1 ? shown.to_world : shown.to_world.after(affine::scaling(known.unit));
    if (known.origin) {
        to_world = affine{};
        for (std::size_t axis = 0; axis < 3; ++axis) to_world.m[axis][3] = (*known.origin)[static_cast<int>(axis)];
    }
    if (!to_world.is_finite()) {
        ++counted_["node(s) with a transform that is not finite are left out"];
        return;
    }
    scene_.instances.push_back({*known.primitive, to_world});
}

primitive_reader::read_part primitive_reader::read(const shown_mesh& shown, std::size_t part, bool posed) {
    const std::size_t mesh = shown.mesh;
    const tinygltf::Primitive& source = model_.meshes[mesh].primitives[part];
    const std::string where = "meshes[" + std::to_string(mesh) + "].primitives[" + std::to_string(part) + "]";
    if (source.mode < TINYGLTF_MODE_TRIANGLES) {
        ++counted_["primitive(s) of points or lines have no surface and are left out"];
        return {};
    }
    const auto position = source.attributes.find("POSITION");
    if (position == source.attributes.end()) {
        ++counted_["primitive(s) without POSITION are left out"];
        return {};
    }
    const std::size_t vertices = model_.accessors[static_cast<std::size_t>(position->second)].count;
    if (vertices > UINT32_MAX) throw gltf_error(where + ": has more vertices than an index can count");
    const std::uint64_t count =
        source.indices >= 0 ? model_.accessors[static_cast<std::size_t>(source.indices)].count : vertices;
    const std::uint64_t num_triangles = triangle_count(source.mode, count);
    if (source.mode == TINYGLTF_MODE_TRIANGLES ? count % 3 != 0 : count < 3)
        ++counted_["primitive(s) have indices left over that make no triangle"];
    memory_.charge(num_triangles, sizeof(glm::uvec3), where);

    primitive result;
    result.name = model_.meshes[mesh].name.empty() ? where : printable(model_.meshes[mesh].name);
    result.material = material_index(source);
    read_part known;
    if (posed)
        known = read_posed(result, source, shown, where);
    else
        known.unit = read_positions(result, source, where);
    {
        const budget::scope temporary{memory_};
        std::vector<std::uint32_t> indices;
        if (source.indices >= 0) indices = accessors_.indices(static_cast<std::size_t>(source.indices), where);
        for (std::size_t i = 0; i < indices.size(); ++i)
            if (indices[i] >= vertices)
                throw gltf_error(where + ": index " + std::to_string(indices[i]) + " at place " + std::to_string(i) +
                                 " is out of range, there are " + std::to_string(vertices) + " vertices");
        result.triangles = unrolled(source.mode, indices, count);
        if (known.mirrored)
            for (glm::uvec3& triangle : result.triangles) std::swap(triangle.y, triangle.z);
    }
    read_texcoords(result, source, where);
    read_colors(result, source, where);
    if (result.triangles.empty()) return {};
    known.primitive = static_cast<std::uint32_t>(scene_.primitives.size());
    scene_.primitives.push_back(std::move(result));
    return known;
}

// Positions that a node bends. Those of a skin are in the world; far from its origin they are kept relative to a place
// among them, since a float would round them.
primitive_reader::read_part primitive_reader::read_posed(primitive& result, const tinygltf::Primitive& source,
                                                         const shown_mesh& shown, const std::string& where) {
    const auto index = static_cast<std::size_t>(source.attributes.at("POSITION"));
    const tinygltf::Accessor& accessor = model_.accessors[index];
    check_position_type(accessor, where);
    memory_.charge(accessor.count, sizeof(glm::vec3), where);
    const budget::scope temporary{memory_};
    memory_.charge(accessor.count, 2 * sizeof(glm::dvec3), where);
    const posed_positions posed =
        poses_.positions(shown, source, accessors_.numbers(index, accessor.normalized, where), where);
    glm::dvec3 low(std::numeric_limits<double>::infinity());
    glm::dvec3 high(-low);
    const auto at = [&](std::size_t i) {
        return glm::dvec3(posed.xyz[3 * i], posed.xyz[3 * i + 1], posed.xyz[3 * i + 2]);
    };
    for (std::size_t i = 0; i < accessor.count; ++i) {
        low = glm::min(low, at(i));
        high = glm::max(high, at(i));
    }
    read_part known;
    known.mirrored = posed.mirrored;
    glm::dvec3 origin(0);
    if (posed.in_world) {
        constexpr double far = 1024; // sides of the box: ten bits of the float
        const glm::dvec3 side = high - low;
        const glm::dvec3 reach = glm::max(glm::abs(low), glm::abs(high));
        if (std::max({reach.x, reach.y, reach.z}) > far * std::max({side.x, side.y, side.z})) origin = low;
        known.origin = origin;
    }
    std::uint64_t unusable = 0;
    result.positions.reserve(accessor.count);
    for (std::size_t i = 0; i < accessor.count; ++i) {
        const glm::vec3 p(at(i) - origin);
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) ++unusable;
        result.positions.push_back(p);
    }
    if (unusable != 0)
        counted_["vertices at positions that are not finite: their triangles will be dropped"] += unusable;
    return known;
}

double primitive_reader::read_positions(primitive& result, const tinygltf::Primitive& source,
                                        const std::string& where) {
    const auto index = static_cast<std::size_t>(source.attributes.at("POSITION"));
    const tinygltf::Accessor& accessor = model_.accessors[index];
    check_position_type(accessor, where);
    memory_.charge(accessor.count, sizeof(glm::vec3), where);
    const budget::scope temporary{memory_};
    // Integers of at most 16 bits are floats as they stand. Their fractions are not: the transform divides.
    const std::vector<double> local = accessors_.numbers(index, false, where);
    double least = -std::numeric_limits<double>::infinity();
    double unit = 1;
    if (accessor.normalized && accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT) {
        const bool byte = accessor.componentType == TINYGLTF_COMPONENT_TYPE_BYTE ||
                          accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
        const bool is_signed = accessor.componentType == TINYGLTF_COMPONENT_TYPE_BYTE ||
                               accessor.componentType == TINYGLTF_COMPONENT_TYPE_SHORT;
        const double greatest = (byte ? 255 : 65535) >> static_cast<int>(is_signed);
        unit = 1 / greatest;
        least = -greatest; // the most negative integer has no partner: both it and its neighbour are -1
    }
    result.positions.reserve(accessor.count);
    std::uint64_t unusable = 0;
    for (std::size_t i = 0; i < accessor.count; ++i) {
        const glm::vec3 p(std::max(local[3 * i], least), std::max(local[3 * i + 1], least),
                          std::max(local[3 * i + 2], least));
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) ++unusable;
        result.positions.push_back(p);
    }
    if (unusable != 0)
        counted_["vertices at positions that are not finite: their triangles will be dropped"] += unusable;
    return unit;
}

// The accessor of attribute NAME, one element a vertex; null where the primitive has none.
const tinygltf::Accessor* primitive_reader::attribute(const tinygltf::Primitive& source, const std::string& name,
                                                      std::size_t vertices, const std::string& where) const {
    const auto found = source.attributes.find(name);
    if (found == source.attributes.end()) return nullptr;
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(found->second)];
    if (accessor.count != vertices)
        throw gltf_error(where + ": " + name + " has " + std::to_string(accessor.count) + " elements, POSITION has " +
                         std::to_string(vertices));
    return &accessor;
}

void primitive_reader::read_texcoords(primitive& result, const tinygltf::Primitive& source, const std::string& where) {
    if (source.material < 0) return;
    const std::optional<texture_coordinates> wanted =
        materials_.read_texture(static_cast<std::size_t>(source.material));
    if (!wanted) return;
    const std::string name = "TEXCOORD_" + std::to_string(wanted->set);
    const tinygltf::Accessor* accessor = attribute(source, name, result.positions.size(), where);
    if (accessor == nullptr) {
        ++counted_["primitive(s) without the texture coordinates of their base-colour texture are not textured"];
        return;
    }
    if (accessor->type != TINYGLTF_TYPE_VEC2 || accessor->componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        throw gltf_error(where + ": " + name + " is not a VEC2 of floats or of 8 or 16 bit integers");
    memory_.charge(accessor->count, sizeof(glm::vec2), where);
    const budget::scope temporary{memory_};
    const std::vector<double> uv =
        accessors_.numbers(static_cast<std::size_t>(source.attributes.at(name)), accessor->normalized, where);
    const std::array<double, 6>& m = wanted->m;
    result.texcoords.reserve(accessor->count);
    for (std::size_t i = 0; i < accessor->count; ++i) {
        const double u = uv[2 * i];
        const double v = uv[2 * i + 1];
        result.texcoords.emplace_back(static_cast<float>(std::fma(m[0], u, std::fma(m[1], v, m[2]))),
                                      static_cast<float>(std::fma(m[3], u, std::fma(m[4], v, m[5]))));
    }
}

void primitive_reader::read_colors(primitive& result, const tinygltf::Primitive& source,
                                   const std::string& where) const {
    const tinygltf::Accessor* accessor = attribute(source, "COLOR_0", result.positions.size(), where);
    if (accessor == nullptr) return;
    const bool vec3 = accessor->type == TINYGLTF_TYPE_VEC3;
    if ((!vec3 && accessor->type != TINYGLTF_TYPE_VEC4) ||
        (accessor->componentType != TINYGLTF_COMPONENT_TYPE_FLOAT &&
         accessor->componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
         accessor->componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT))
        throw gltf_error(where + ": COLOR_0 is not a VEC3 or VEC4 of floats or of unsigned 8 or 16 bit integers");
    memory_.charge(accessor->count, sizeof(glm::vec4), where);
    const budget::scope temporary{memory_};
    // Integer colours are fractions, whether or not the file remembers to say so.
    const std::vector<double> rgba =
        accessors_.numbers(static_cast<std::size_t>(source.attributes.at("COLOR_0")), true, where);
    const std::size_t components = vec3 ? 3 : 4;
    result.colors.reserve(accessor->count);
    for (std::size_t i = 0; i < accessor->count; ++i) {
        const double* at = &rgba[i * components];
        result.colors.emplace_back(at[0], at[1], at[2], vec3 ? 1.0 : at[3]);
    }
}

std::uint32_t primitive_reader::material_index(const tinygltf::Primitive& source) {
    if (source.material >= 0) return static_cast<std::uint32_t>(source.material);
    if (scene_.materials.size() == model_.materials.size()) {
        scene_.materials.emplace_back();
        scene_.materials.back().name = "default";
    }
    return static_cast<std::uint32_t>(model_.materials.size());
}

void primitive_reader::finish() {
    for (const auto& [text, count] : counted_) scene_.warnings.push_back(std::to_string(count) + ' ' + text);
}

} // namespace voxelize::gltf
