// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "compression.hpp"

#include "read/isolated.hpp"

#include <tiny_gltf.h>

#ifdef VOXELIZE_HAS_DRACO
#include <draco/compression/decode.h>
#endif

#include <stdexcept>

namespace voxelize::gltf {

#ifdef VOXELIZE_HAS_DRACO

namespace {

std::size_t component_bytes(std::uint32_t component_type) {
    return static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(component_type));
}

std::uint64_t bytes_of(const draco_accessor& accessor) {
    return accessor.count * accessor.components * component_bytes(accessor.component_type);
}

std::uint64_t bytes_of(const draco_primitive& primitive) {
    std::uint64_t sum = bytes_of(primitive.indices);
    for (const draco_accessor& attribute : primitive.attributes) sum += bytes_of(attribute);
    return sum;
}

template <class Component>
void append(std::vector<std::byte>& bytes, const Component* values, std::size_t count) {
    const auto* const at = reinterpret_cast<const std::byte*>(values);
    bytes.insert(bytes.end(), at, at + count * sizeof(Component));
}

// Calls VISIT with a value of the C++ type of COMPONENT_TYPE, which has been checked.
template <class Visit>
void with_component(std::uint32_t component_type, Visit&& visit) {
    switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
        return visit(std::int8_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return visit(std::uint8_t{});
    case TINYGLTF_COMPONENT_TYPE_SHORT:
        return visit(std::int16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return visit(std::uint16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return visit(std::uint32_t{});
    default:
        return visit(float{});
    }
}

// Decodes one primitive. Runs in the process of its own.
void decode(const draco_primitive& primitive, std::span<const std::byte> compressed, std::vector<std::byte>& bytes) {
    const auto require = [&](bool holds, const char* what) {
        if (!holds) throw std::runtime_error(primitive.where + ": " + what);
    };
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(compressed.data()), compressed.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    require(decoded.ok(), "its data cannot be decoded");
    const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
    require(mesh != nullptr, "its data is no mesh");
    for (const draco_accessor& wanted : primitive.attributes) {
        const draco::PointAttribute* const attribute = mesh->GetAttributeByUniqueId(wanted.attribute);
        require(attribute != nullptr, "an attribute is not in its data");
        require(attribute->num_components() == static_cast<int>(wanted.components) && wanted.components <= 4,
                "an attribute has another number of components than its accessor");
        require(mesh->num_points() == wanted.count, "its data has another number of vertices than its accessors");
        with_component(wanted.component_type, [&](auto component) {
            using Component = decltype(component);
            Component values[4] = {};
            for (std::uint32_t point = 0; point < mesh->num_points(); ++point) {
                require(attribute->ConvertValue<Component>(attribute->mapped_index(draco::PointIndex(point)),
                                                           static_cast<std::int8_t>(wanted.components), values),
                        "an attribute cannot be converted to its accessor's type");
                append(bytes, values, wanted.components);
            }
        });
    }
    require(std::uint64_t{mesh->num_faces()} * 3 == primitive.indices.count,
            "its data has another number of indices than its accessor");
    with_component(primitive.indices.component_type, [&](auto component) {
        using Component = decltype(component);
        for (std::uint32_t face = 0; face < mesh->num_faces(); ++face) {
            for (const draco::PointIndex& point : mesh->face(draco::FaceIndex(face))) {
                const auto index = static_cast<Component>(point.value());
                require(static_cast<std::uint32_t>(index) == point.value(),
                        "an index does not fit its accessor's type");
                append(bytes, &index, 1);
            }
        }
    });
}

} // namespace

std::vector<std::vector<std::byte>> decode_draco(const std::vector<draco_primitive>& primitives,
                                                 const std::vector<std::span<const std::byte>>& compressed,
                                                 budget& memory) {
    std::uint64_t input = 0;
    std::uint64_t output = 0;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        memory.charge(bytes_of(primitives[i]), 2, primitives[i].where); // there, and on its way
        input += compressed[i].size();
        output += bytes_of(primitives[i]);
    }
    isolation_limits limits;
    limits.memory = (std::uint64_t{64} << 20) + 16 * output + 64 * input;
    limits.result = output + 4096; // or the text of an error
    limits.seconds = 3 + 2 * (input >> 20) + (output >> 24);
    const auto work = [&] {
        std::vector<std::byte> bytes;
        bytes.reserve(static_cast<std::size_t>(output));
        for (std::size_t i = 0; i < primitives.size(); ++i) decode(primitives[i], compressed[i], bytes);
        return bytes;
    };
    std::vector<std::byte> bytes;
    try {
        bytes = run_isolated(work, limits, "Draco");
    } catch (const gltf_error&) {
        throw;
    } catch (const model_error& error) {
        throw gltf_error(error.what());
    }
    if (bytes.size() != output)
        throw gltf_error("Draco gave " + std::to_string(bytes.size()) + " bytes, not " + std::to_string(output));
    std::vector<std::vector<std::byte>> parts;
    auto at = bytes.begin();
    for (const draco_primitive& primitive : primitives) {
        const auto end = at + static_cast<std::ptrdiff_t>(bytes_of(primitive));
        parts.emplace_back(at, end);
        at = end;
    }
    return parts;
}

#else

std::vector<std::vector<std::byte>> decode_draco(const std::vector<draco_primitive>&,
                                                 const std::vector<std::span<const std::byte>>&, budget&) {
    throw gltf_error("this build has no Draco");
}

#endif

} // namespace voxelize::gltf
