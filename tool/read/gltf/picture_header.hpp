// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a picture says of itself, read before it is decoded: its size and its structure. A picture that is cut
// short, too large or more than its bytes can hold is refused here with that reason; stb_image calls all of them
// unknown.

#include "read/gltf_scene.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelize::gltf {

// Throws gltf_error with the bare reason where WIDTH x HEIGHT pixels are more than limits.max_image_side on a side.
void check_sides(std::uint64_t width, std::uint64_t height, const gltf_limits& limits);

// BYTES begin with the signature of a PNG. Throws gltf_error with the bare reason where the chunks end before the
// picture does, where one that is needed is missing or unknown, where the picture is too large, or where its rows, one
// byte for the filter before each, are more than 1032 times its compressed bytes: deflate gives no more.
void check_png(std::span<const std::byte> bytes, const gltf_limits& limits);

// BYTES begin with the signature of a JPEG. Throws gltf_error with the bare reason where there is no frame of a kind
// that can be decoded, where the picture is too large, or where it has more blocks of 8 x 8 pixels than bits, but for
// 64 MiB of pixels: a file that is cut short is decoded as far as it goes.
void check_jpeg(std::span<const std::byte> bytes, const gltf_limits& limits);

// True if BYTES begin with the header of a TGA, which has no signature: for those that have none of another format.
[[nodiscard]] bool is_tga(std::span<const std::byte> bytes);
// True unless a TGA says that the fourth byte of its pixels is no alpha.
[[nodiscard]] bool states_tga_alpha(std::span<const std::byte> bytes);

// BYTES are a TGA's, or begin with the signature of a BMP. Throws gltf_error with the bare reason where the picture is
// too large, where it is a BMP of a kind that is not supported, or where its bytes cannot hold its pixels: a packet of
// a TGA holds 128 at most.
void check_tga(std::span<const std::byte> bytes, const gltf_limits& limits);
void check_bmp(std::span<const std::byte> bytes, const gltf_limits& limits);

// True if a picture whose file begins with START has texels that may not be opaque, as far as START tells. False for
// what is no picture that is read.
[[nodiscard]] bool may_have_alpha(std::span<const std::byte> start);

} // namespace voxelize::gltf
