// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Encoded pictures -> RGBA: PNG, JPEG, TGA and BMP, and WebP in a build with libwebp. The bytes say what they are, not
// a file's name or media type.

#include "read/gltf_scene.hpp"

#include <cstddef>
#include <span>

namespace voxelize::gltf {

// The picture in BYTES, without a name. Throws gltf_error with the bare reason: a format that is not supported is named
// (KTX2, AVIF, ...), a size that is
// too large or that the bytes cannot hold is refused before memory is taken.
[[nodiscard]] picture decode_picture(std::span<const std::byte> bytes, const gltf_limits& limits);

} // namespace voxelize::gltf
