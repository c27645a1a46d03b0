// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Compressed geometry: buffer views of EXT_meshopt_compression, primitives of KHR_draco_mesh_compression.

#include "budget.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::gltf {

// The compressions that this build has libraries for.
#ifdef VOXELIZE_HAS_MESHOPT
inline constexpr bool reads_meshopt = true;
#else
inline constexpr bool reads_meshopt = false;
#endif
#ifdef VOXELIZE_HAS_DRACO
inline constexpr bool reads_draco = true;
#else
inline constexpr bool reads_draco = false;
#endif

// The names under which files use meshopt's extension.
[[nodiscard]] constexpr bool is_meshopt(std::string_view extension) {
    return extension == "EXT_meshopt_compression" || extension == "KHR_meshopt_compression" ||
           extension == "MESHOPT_compression";
}

enum class meshopt_mode : std::uint8_t { attributes, triangles, indices };
enum class meshopt_filter : std::uint8_t { none, octahedral, quaternion, exponential };

// The compressed bytes of a buffer view; they become count * stride bytes.
struct meshopt_view {
    std::uint32_t buffer = 0;
    std::uint64_t byte_offset = 0;
    std::uint64_t byte_length = 0;
    std::uint64_t byte_stride = 0;
    std::uint64_t count = 0;
    meshopt_mode mode = meshopt_mode::attributes;
    meshopt_filter filter = meshopt_filter::none;
};

// The bytes of VIEW from COMPRESSED. The caller has charged them, and has checked that the stride fits mode and filter.
// WHERE is named in errors. Throws gltf_error.
[[nodiscard]] std::vector<std::byte> decode_meshopt(const meshopt_view& view, std::span<const std::byte> compressed,
                                                    const std::string& where);

// An accessor that a Draco mesh fills.
struct draco_accessor {
    std::uint32_t accessor = 0;
    std::uint32_t attribute = 0;      // Draco's unique id; not of indices
    std::uint32_t component_type = 0; // glTF's
    std::uint32_t components = 0;     // of an element
    std::uint64_t count = 0;
};

struct draco_primitive {
    std::string where;
    std::uint32_t buffer_view = 0;
    std::vector<draco_accessor> attributes;
    draco_accessor indices;
};

// For every primitive of the list, its COMPRESSED bytes beside it: the packed bytes of its attributes in their order,
// then of its indices. Runs in a process of its own (isolated.hpp). Throws gltf_error.
[[nodiscard]] std::vector<std::vector<std::byte>>
decode_draco(const std::vector<draco_primitive>& primitives, const std::vector<std::span<const std::byte>>& compressed,
             budget& memory);

} // namespace voxelize::gltf
