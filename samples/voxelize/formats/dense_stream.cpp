// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "dense_stream.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

namespace voxelize {
namespace {

constexpr std::size_t piece_bytes = std::size_t{1} << 20;

// For each byte of packed bits the eight bytes 0 or 1, first voxel first.
constexpr std::array<std::array<std::uint8_t, 8>, 256> make_expansion() {
    std::array<std::array<std::uint8_t, 8>, 256> table{};
    for (unsigned value = 0; value < 256; ++value)
        for (unsigned bit = 0; bit < 8; ++bit) table[value][bit] = static_cast<std::uint8_t>(value >> bit & 1u);
    return table;
}
constexpr auto expansion = make_expansion();

void stream_bits(const volume& v, const channel& c, const byte_sink& sink) {
    const auto nx = static_cast<std::size_t>(v.extent[0]);
    const auto pitch = static_cast<std::size_t>(v.words_per_row()) * 4;
    const std::size_t rows = static_cast<std::size_t>(v.extent[1]) * static_cast<std::size_t>(v.extent[2]);
    // Eight spare bytes: the last group of a row is expanded whole, and the next row overwrites what is too much.
    std::vector<std::byte> piece(std::max(piece_bytes, nx) + 8);
    std::size_t filled = 0;
    for (std::size_t row = 0; row < rows; ++row) {
        if (filled + nx + 8 > piece.size()) {
            sink(std::span{piece}.first(filled));
            filled = 0;
        }
        const std::byte* packed = c.data.data() + row * pitch;
        for (std::size_t i = 0; i < nx; i += 8)
            std::memcpy(piece.data() + filled + i, expansion[std::to_integer<std::size_t>(packed[i / 8])].data(), 8);
        filled += nx;
    }
    sink(std::span{piece}.first(filled));
}

// IEEE 754 binary16 to binary32; exact for every value, NaN payloads included.
std::uint32_t widen(std::uint16_t half) {
    const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
    const std::uint32_t exponent = half >> 10 & 0x1fu;
    const std::uint32_t mantissa = half & 0x3ffu;
    if (exponent == 0x1f) return sign | 0x7f800000u | mantissa << 13;
    if (exponent != 0) return sign | (exponent + 112) << 23 | mantissa << 13;
    if (mantissa == 0) return sign;
    // Subnormal: shift the leading one up to the hidden bit.
    const auto shift = static_cast<std::uint32_t>(std::countl_zero(mantissa)) - 21;
    return sign | (113 - shift) << 23 | (mantissa << shift & 0x3ffu) << 13;
}

void stream_widened(const channel& c, const byte_sink& sink) {
    std::vector<std::uint32_t> piece(piece_bytes / 4);
    const std::size_t count = c.data.size() / 2;
    for (std::size_t begin = 0; begin < count; begin += piece.size()) {
        const std::size_t n = std::min(piece.size(), count - begin);
        for (std::size_t i = 0; i < n; ++i) {
            std::uint16_t half;
            std::memcpy(&half, c.data.data() + 2 * (begin + i), 2);
            piece[i] = widen(half);
        }
        sink(std::as_bytes(std::span{piece}.first(n)));
    }
}

} // namespace

scalar streamed_type(scalar type, half_floats halves) {
    if (type == scalar::bit) return scalar::u8;
    if (type == scalar::f16 && halves == half_floats::widen) return scalar::f32;
    return type;
}

std::uint64_t streamed_bytes(const volume& v, const channel& c, half_floats halves) {
    return static_cast<std::uint64_t>(v.num_voxels()) * size_of(streamed_type(c.type, halves)) *
           static_cast<std::uint64_t>(c.components);
}

void stream_values(const volume& v, const channel& c, half_floats halves, const byte_sink& sink) {
    if (c.type == scalar::bit) return stream_bits(v, c, sink);
    if (c.type == scalar::f16 && halves == half_floats::widen) return stream_widened(c, sink);
    const std::span<const std::byte> all{c.data};
    for (std::size_t begin = 0; begin < all.size(); begin += piece_bytes)
        sink(all.subspan(begin, std::min(piece_bytes, all.size() - begin)));
}

} // namespace voxelize
