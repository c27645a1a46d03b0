// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "primitives.hpp"

#include "model/finite.hpp"
#include "text.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
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

std::uint64_t line_count(int mode, std::uint64_t count) {
    if (mode == TINYGLTF_MODE_POINTS) return count;
    if (mode == TINYGLTF_MODE_LINE) return count / 2;
    return count < 2 ? 0 : mode == TINYGLTF_MODE_LINE_LOOP ? count : count - 1;
}

std::vector<glm::uvec2> unrolled_lines(int mode, const std::vector<std::uint32_t>& indices, std::uint64_t count) {
    const auto index = [&](std::uint64_t i) {
        return indices.empty() ? static_cast<std::uint32_t>(i) : indices[static_cast<std::size_t>(i)];
    };
    const std::uint64_t num_lines = line_count(mode, count);
    std::vector<glm::uvec2> lines;
    lines.reserve(static_cast<std::size_t>(num_lines));
    for (std::uint64_t i = 0; i < num_lines; ++i) {
        if (mode == TINYGLTF_MODE_POINTS)
            lines.emplace_back(index(i), index(i));
        else if (mode == TINYGLTF_MODE_LINE)
            lines.emplace_back(index(2 * i), index(2 * i + 1));
        else
            lines.emplace_back(index(i), index(i + 1 == count ? 0 : i + 1));
    }
    return lines;
}

namespace {

std::string place_of(std::size_t mesh, std::size_t part) {
    return "meshes[" + std::to_string(mesh) + "].primitives[" + std::to_string(part) + "]";
}

gltf_error out_of_range(const std::string& where, std::uint32_t index, std::size_t place, std::size_t vertices) {
    return gltf_error(where + ": index " + std::to_string(index) + " at place " + std::to_string(place) +
                      " is out of range, there are " + std::to_string(vertices) + " vertices");
}

void check_position_type(const tinygltf::Accessor& accessor, const std::string& where) {
    if (accessor.type != TINYGLTF_TYPE_VEC3 || accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        throw gltf_error(where + ": POSITION is not a VEC3 of floats or of 8 or 16 bit integers");
}

} // namespace

std::string name_of(const tinygltf::Model& model, std::size_t mesh, std::size_t part) {
    const std::string& name = model.meshes[mesh].name;
    return name.empty() ? place_of(mesh, part) : printable(name);
}

material default_material() {
    material made;
    made.name = "default";
    return made;
}

void primitive_reader::show(const shown_mesh& shown, std::size_t part) {
    const tinygltf::Primitive& source = model_.meshes[shown.mesh].primitives[part];
    const bool posed = poses_.is_posed(shown, source);
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
    const std::string where = place_of(mesh, part);
    const auto position = source.attributes.find("POSITION");
    if (position == source.attributes.end()) {
        ++counted_["primitive(s) without POSITION are left out"];
        return {};
    }
    const std::size_t vertices = model_.accessors[static_cast<std::size_t>(position->second)].count;
    if (vertices > UINT32_MAX) throw gltf_error(where + ": has more vertices than an index can count");
    const std::uint64_t count =
        source.indices >= 0 ? model_.accessors[static_cast<std::size_t>(source.indices)].count : vertices;
    const bool is_lines = source.mode < TINYGLTF_MODE_TRIANGLES;
    if (is_lines) {
        if (source.mode == TINYGLTF_MODE_LINE ? count % 2 != 0 : source.mode != TINYGLTF_MODE_POINTS && count < 2)
            ++counted_["primitive(s) have indices left over that make no line"];
        memory_.charge(line_count(source.mode, count), sizeof(glm::uvec2), where);
    } else {
        if (source.mode == TINYGLTF_MODE_TRIANGLES ? count % 3 != 0 : count < 3) ++counted_[with_rest];
        memory_.charge(triangle_count(source.mode, count), sizeof(glm::uvec3), where);
    }

    primitive result;
    result.name = name_of(model_, mesh, part);
    result.material = material_index(source);
    read_part known;
    if (posed)
        known = read_posed(result, source, shown, where);
    else
        known.unit = read_positions(result, source, where);
    if (is_lines) {
        const budget::scope temporary{memory_};
        result.lines = unrolled_lines(source.mode, read_indices(source, vertices, where), count);
    } else {
        read_triangles(result, source, vertices, where);
    }
    if (known.mirrored)
        for (glm::uvec3& triangle : result.triangles) std::swap(triangle.y, triangle.z);
    read_texcoords(result, source, where);
    read_colors(result, source, where);
    if (result.triangles.empty() && result.lines.empty()) return {};
    known.primitive = static_cast<std::uint32_t>(scene_.primitives.size());
    scene_.primitives.push_back(std::move(result));
    return known;
}

void primitive_reader::read_triangles(primitive& result, const tinygltf::Primitive& source, std::size_t vertices,
                                      const std::string& where) const {
    const auto accessor = static_cast<std::size_t>(source.indices);
    if (source.mode == TINYGLTF_MODE_TRIANGLES && source.indices >= 0)
        if (const auto in_place = accessors_.in_place(accessor)) {
            // Straight from the file, in blocks. Of several faults the first in the file is named.
            const std::size_t count = model_.accessors[accessor].count;
            result.triangles.resize(count / 3);
            const auto read = [&](auto component) {
                using index_type = decltype(component);
                const auto at = [&](std::size_t i) {
                    index_type value;
                    std::memcpy(&value, in_place->first + i * in_place->stride, sizeof(value));
                    return static_cast<std::uint32_t>(value);
                };
                std::atomic<std::size_t> first_fault{count};
                for_each_block(count / 3, [&](std::size_t begin, std::size_t end) {
                    std::uint32_t greatest = 0;
                    for (std::size_t t = begin; t < end; ++t) {
                        const glm::uvec3 corners(at(3 * t), at(3 * t + 1), at(3 * t + 2));
                        result.triangles[t] = corners;
                        greatest = std::max({greatest, corners.x, corners.y, corners.z});
                    }
                    if (greatest < vertices) return;
                    std::size_t fault = 3 * begin;
                    while (at(fault) < vertices) ++fault;
                    std::size_t known = first_fault;
                    while (fault < known && !first_fault.compare_exchange_weak(known, fault)) {
                    }
                });
                for (std::size_t i = count / 3 * 3; i < count; ++i) // left over, but checked
                    if (at(i) >= vertices && first_fault == count) first_fault = i;
                if (first_fault != count) throw out_of_range(where, at(first_fault), first_fault, vertices);
            };
            switch (model_.accessors[accessor].componentType) {
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                return read(std::uint8_t{});
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                return read(std::uint16_t{});
            default:
                return read(std::uint32_t{});
            }
        }
    const budget::scope temporary{memory_};
    const std::vector<std::uint32_t> indices = read_indices(source, vertices, where);
    result.triangles = unrolled(source.mode, indices, source.indices >= 0 ? indices.size() : vertices);
}

// Empty where the vertices count up.
std::vector<std::uint32_t> primitive_reader::read_indices(const tinygltf::Primitive& source, std::size_t vertices,
                                                          const std::string& where) const {
    if (source.indices < 0) return {};
    std::vector<std::uint32_t> indices = accessors_.indices(static_cast<std::size_t>(source.indices), where);
    for (std::size_t i = 0; i < indices.size(); ++i)
        if (indices[i] >= vertices) throw out_of_range(where, indices[i], i, vertices);
    return indices;
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
        if (!is_finite(p)) ++unusable;
        result.positions.push_back(p);
    }
    if (unusable != 0) counted_[not_finite] += unusable;
    return known;
}

double primitive_reader::read_positions(primitive& result, const tinygltf::Primitive& source,
                                        const std::string& where) {
    const auto index = static_cast<std::size_t>(source.attributes.at("POSITION"));
    const tinygltf::Accessor& accessor = model_.accessors[index];
    check_position_type(accessor, where);
    memory_.charge(accessor.count, sizeof(glm::vec3), where);
    const budget::scope temporary{memory_};
    const auto warn_unusable = [&](std::uint64_t unusable) {
        if (unusable != 0) counted_[not_finite] += unusable;
    };
    if (const auto in_place = accessors_.in_place(index);
        in_place && accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT) {
        result.positions.resize(accessor.count);
        std::atomic<std::uint64_t> unusable{0};
        for_each_block(accessor.count, [&](std::size_t begin, std::size_t end) {
            std::uint64_t found = 0;
            for (std::size_t i = begin; i < end; ++i) {
                glm::vec3& p = result.positions[i];
                std::memcpy(&p, in_place->first + i * in_place->stride, sizeof(p));
                found += is_finite(p) ? 0 : 1;
            }
            unusable += found;
        });
        warn_unusable(unusable);
        return 1;
    }
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
        if (!is_finite(p)) ++unusable;
        result.positions.push_back(p);
    }
    warn_unusable(unusable);
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
        materials_.want_texture(static_cast<std::size_t>(source.material));
    if (!wanted) return;
    const std::string name = "TEXCOORD_" + std::to_string(wanted->set);
    const tinygltf::Accessor* accessor = attribute(source, name, result.positions.size(), where);
    if (accessor == nullptr) {
        ++counted_[without_texcoords];
        return;
    }
    if (accessor->type != TINYGLTF_TYPE_VEC2 || accessor->componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        throw gltf_error(where + ": " + name + " is not a VEC2 of floats or of 8 or 16 bit integers");
    memory_.charge(accessor->count, sizeof(glm::vec2), where);
    const budget::scope temporary{memory_};
    const auto place = [&m = wanted->m](double u, double v) { return transformed(m, u, v); };
    const auto index = static_cast<std::size_t>(source.attributes.at(name));
    result.texcoords.resize(accessor->count);
    if (const auto in_place = accessors_.in_place(index);
        in_place && accessor->componentType == TINYGLTF_COMPONENT_TYPE_FLOAT) {
        for_each_block(accessor->count, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                glm::vec2 uv;
                std::memcpy(&uv, in_place->first + i * in_place->stride, sizeof(uv));
                result.texcoords[i] = place(static_cast<double>(uv.x), static_cast<double>(uv.y));
            }
        });
        return;
    }
    const std::vector<double> uv = accessors_.numbers(index, accessor->normalized, where);
    for (std::size_t i = 0; i < accessor->count; ++i) result.texcoords[i] = place(uv[2 * i], uv[2 * i + 1]);
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
    if (scene_.materials.size() == model_.materials.size()) scene_.materials.push_back(default_material());
    return static_cast<std::uint32_t>(model_.materials.size());
}

void primitive_reader::finish() {
    for (const auto& [text, count] : counted_) scene_.warnings.push_back(std::to_string(count) + ' ' + text);
}

} // namespace voxelize::gltf
