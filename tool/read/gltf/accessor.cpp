// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "accessor.hpp"

#include <algorithm>
#include <cstring>

namespace voxelize::gltf {

namespace {

// glTF is little-endian, and so is every machine that the tool is built for.
template <class Component>
Component load(const std::byte* at) {
    Component value;
    std::memcpy(&value, at, sizeof(Component));
    return value;
}

// Calls visit with a value of the C++ type of COMPONENT_TYPE, which has been checked.
template <class Visit>
void with_component(int component_type, Visit&& visit) {
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

// Reads a value of an unsigned type, which indices have.
template <class Visit>
void with_index_component(int component_type, Visit&& visit) {
    if (component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return visit(std::uint8_t{});
    if (component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return visit(std::uint16_t{});
    return visit(std::uint32_t{});
}

std::size_t component_size(int component_type) {
    return static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(component_type)));
}

std::size_t component_count(const tinygltf::Accessor& accessor) {
    return static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
}

} // namespace

void accessor_reader::read_draco() {
    const std::vector<draco_primitive>& primitives = document_.draco_primitives;
    if (primitives.empty()) return;
    std::vector<std::span<const std::byte>> compressed;
    compressed.reserve(primitives.size());
    for (const draco_primitive& primitive : primitives) compressed.push_back(view(primitive.buffer_view));
    const std::vector<std::vector<std::byte>> decoded = decode_draco(primitives, compressed, memory_);
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        auto at = decoded[i].begin();
        const auto take = [&](const draco_accessor& filled) {
            const std::size_t size =
                filled.count * filled.components * component_size(static_cast<int>(filled.component_type));
            draco_accessors_[filled.accessor].assign(at, at + static_cast<std::ptrdiff_t>(size));
            at += static_cast<std::ptrdiff_t>(size);
        };
        for (const draco_accessor& attribute : primitives[i].attributes) take(attribute);
        take(primitives[i].indices);
    }
}

std::span<const std::byte> accessor_reader::view(std::size_t index) const {
    if (index < document_.meshopt_views.size() && document_.meshopt_views[index]) {
        const auto known = meshopt_views_.find(index);
        if (known != meshopt_views_.end()) return known->second;
        const meshopt_view& compressed = *document_.meshopt_views[index];
        const std::string where = "bufferViews[" + std::to_string(index) + "]";
        memory_.charge_to_the_end(compressed.count, compressed.byte_stride, where);
        return meshopt_views_
            .emplace(index, decode_meshopt(compressed,
                                           bytes_.buffer(compressed.buffer)
                                               .subspan(static_cast<std::size_t>(compressed.byte_offset),
                                                        static_cast<std::size_t>(compressed.byte_length)),
                                           where))
            .first->second;
    }
    const tinygltf::BufferView& view = model_.bufferViews[index];
    return bytes_.buffer(static_cast<std::size_t>(view.buffer)).subspan(view.byteOffset, view.byteLength);
}

std::optional<accessor_reader::elements_in_place> accessor_reader::in_place(std::size_t index) const {
    const tinygltf::Accessor& accessor = model_.accessors[index];
    if (draco_accessors_.contains(index) || document_.zero_base[index] || accessor.sparse.isSparse ||
        accessor.count == 0)
        return std::nullopt;
    const auto view_index = static_cast<std::size_t>(accessor.bufferView);
    std::size_t stride = document_.view_strides[view_index];
    if (stride == 0) stride = component_count(accessor) * component_size(accessor.componentType);
    return elements_in_place{view(view_index).subspan(accessor.byteOffset).data(), stride};
}

std::vector<std::byte> accessor_reader::packed(std::size_t index, std::size_t element_bytes,
                                               const std::string& user) const {
    const tinygltf::Accessor& accessor = model_.accessors[index];
    memory_.charge(accessor.count, element_bytes, user);
    if (const auto found = draco_accessors_.find(index); found != draco_accessors_.end()) return found->second;
    std::vector<std::byte> elements(accessor.count * element_bytes);
    if (!document_.zero_base[index]) {
        const auto view_index = static_cast<std::size_t>(accessor.bufferView);
        const std::size_t stride =
            document_.view_strides[view_index] != 0 ? document_.view_strides[view_index] : element_bytes;
        const std::span<const std::byte> source = view(view_index).subspan(accessor.byteOffset);
        for (std::size_t i = 0; i < accessor.count; ++i)
            std::memcpy(&elements[i * element_bytes], &source[i * stride], element_bytes);
    }
    if (!accessor.sparse.isSparse) return elements;

    const auto count = static_cast<std::size_t>(accessor.sparse.count);
    const std::span<const std::byte> indices =
        view(static_cast<std::size_t>(accessor.sparse.indices.bufferView))
            .subspan(static_cast<std::size_t>(accessor.sparse.indices.byteOffset));
    const std::span<const std::byte> values = view(static_cast<std::size_t>(accessor.sparse.values.bufferView))
                                                  .subspan(static_cast<std::size_t>(accessor.sparse.values.byteOffset));
    with_index_component(accessor.sparse.indices.componentType, [&](auto component) {
        using Component = decltype(component);
        std::uint64_t least = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint64_t target_index = load<Component>(&indices[i * sizeof(Component)]);
            if (target_index < least || target_index >= accessor.count)
                throw gltf_error(user + ": sparse index " + std::to_string(target_index) + " of accessors[" +
                                 std::to_string(index) + "] is " +
                                 (target_index < least ? "not in ascending order" : "out of range"));
            std::memcpy(&elements[target_index * element_bytes], &values[i * element_bytes], element_bytes);
            least = target_index + 1;
        }
    });
    return elements;
}

std::vector<double> accessor_reader::numbers(std::size_t index, bool normalized, const std::string& user) const {
    const tinygltf::Accessor& accessor = model_.accessors[index];
    const std::size_t components = component_count(accessor);
    const std::vector<std::byte> elements = packed(index, components * component_size(accessor.componentType), user);
    memory_.charge(accessor.count * components, sizeof(double), user);
    std::vector<double> numbers(accessor.count * components);
    with_component(accessor.componentType, [&](auto component) {
        using Component = decltype(component);
        constexpr bool integral = std::numeric_limits<Component>::is_integer;
        const double scale = static_cast<double>(std::numeric_limits<Component>::max());
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            numbers[i] = static_cast<double>(load<Component>(&elements[i * sizeof(Component)]));
            // The most negative integer has no partner: both it and its neighbour are -1.
            if (integral && normalized) numbers[i] = std::max(numbers[i] / scale, -1.0);
        }
    });
    return numbers;
}

std::vector<std::uint32_t> accessor_reader::indices(std::size_t index, const std::string& user) const {
    const tinygltf::Accessor& accessor = model_.accessors[index];
    const std::vector<std::byte> elements = packed(index, component_size(accessor.componentType), user);
    memory_.charge(accessor.count, sizeof(std::uint32_t), user);
    std::vector<std::uint32_t> values(accessor.count);
    with_index_component(accessor.componentType, [&](auto component) {
        using Component = decltype(component);
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = load<Component>(&elements[i * sizeof(Component)]);
    });
    return values;
}

} // namespace voxelize::gltf
