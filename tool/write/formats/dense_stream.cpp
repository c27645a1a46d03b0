// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "dense_stream.hpp"

#include <voxelpipe/core/half.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

namespace voxelize {
namespace {

constexpr std::size_t stream_piece_bytes = std::size_t{1} << 20;

// For each byte of packed bits the eight bytes 0 or 1, first voxel first.
constexpr std::array<std::array<std::uint8_t, 8>, 256> make_expansion() {
    std::array<std::array<std::uint8_t, 8>, 256> table{};
    for (unsigned value = 0; value < 256; ++value)
        for (unsigned bit = 0; bit < 8; ++bit) table[value][bit] = static_cast<std::uint8_t>(value >> bit & 1u);
    return table;
}
constexpr auto expansion = make_expansion();

void expand_bits(const volume& v, const channel& c, std::uint64_t begin, std::span<std::byte> out) {
    const auto nx = static_cast<std::uint64_t>(v.extent[0]);
    const auto pitch = static_cast<std::size_t>(v.words_per_row()) * 4;
    for (std::size_t filled = 0; filled < out.size();) {
        const std::uint64_t at = begin + filled;
        const std::byte* packed = c.data.data() + at / nx * pitch;
        auto i = static_cast<std::size_t>(at % nx);
        const std::size_t end = std::min(static_cast<std::size_t>(nx), i + out.size() - filled);
        for (; i % 8 == 0 && i + 8 <= end; i += 8, filled += 8) // most of them: a copy of eight bytes each
            std::memcpy(out.data() + filled, expansion[std::to_integer<std::size_t>(packed[i / 8])].data(), 8);
        while (i < end) {
            const auto& eight = expansion[std::to_integer<std::size_t>(packed[i / 8])];
            const std::size_t n = std::min(end, i / 8 * 8 + 8) - i;
            std::memcpy(out.data() + filled, eight.data() + i % 8, n);
            filled += n;
            i += n;
        }
    }
}

} // namespace

std::uint32_t widened_half(std::uint16_t half) {
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

channel halved(const channel& floats, std::atomic<bool>& overflows) {
    channel halves{floats.name, scalar::f16, floats.components, {}};
    halves.read = [&floats, &overflows](std::uint64_t first, std::span<std::byte> to) {
        constexpr std::size_t most = 4096; // voxels at a time
        const auto components = static_cast<std::size_t>(floats.components);
        std::vector<float> values(std::min(most, to.size() / 2 / components) * components);
        for (std::size_t done = 0; done < to.size() / 2; done += values.size(), first += values.size() / components) {
            values.resize(std::min(values.size(), to.size() / 2 - done));
            const std::span<std::byte> bytes = std::as_writable_bytes(std::span{values});
            if (floats.read)
                floats.read(first, bytes);
            else
                std::memcpy(bytes.data(), floats.data.data() + first * components * 4, bytes.size());
            for (std::size_t i = 0; i < values.size(); ++i) {
                const voxelpipe::half h(values[i]);
                if ((h.bits & 0x7fffu) == 0x7c00u && std::isfinite(values[i])) overflows = true;
                std::memcpy(to.data() + 2 * (done + i), &h.bits, 2);
            }
        }
    };
    return halves;
}

scalar streamed_type(scalar type, half_floats halves) {
    if (type == scalar::bit) return scalar::u8;
    if (type == scalar::f16 && halves == half_floats::widen) return scalar::f32;
    return type;
}

std::uint64_t streamed_bytes(const volume& v, const channel& c, half_floats halves) {
    return static_cast<std::uint64_t>(v.num_voxels()) * size_of(streamed_type(c.type, halves)) *
           static_cast<std::uint64_t>(c.components);
}

std::uint64_t streamed_bytes(const volume& v, half_floats halves) {
    std::uint64_t total = 0;
    v.for_each_channel([&](const volume& of, const channel& c) { total += streamed_bytes(of, c, halves); });
    return total;
}

std::span<const std::byte> streamed_piece(const volume& v, const channel& c, half_floats halves, std::uint64_t begin,
                                          std::size_t size, std::vector<std::byte>& room) {
    if (c.read) { // from the value that begins at or before `begin`
        const std::uint64_t each = streamed_bytes(v, c, halves) / static_cast<std::uint64_t>(v.num_voxels());
        const std::uint64_t first = begin / each, last = (begin + size + each - 1) / each;
        room.resize(static_cast<std::size_t>((last - first) * each));
        c.read(first, room);
        return std::span{room}.subspan(static_cast<std::size_t>(begin - first * each), size);
    }
    if (c.type == scalar::bit) {
        room.resize(size);
        expand_bits(v, c, begin, room);
        return room;
    }
    if (c.type != scalar::f16 || halves == half_floats::keep)
        return std::span{c.data}.subspan(static_cast<std::size_t>(begin), size);
    // From the value that begins at or before `begin`, so that a piece may begin and end anywhere.
    const auto first = static_cast<std::size_t>(begin / 4);
    const std::size_t skip = begin % 4;
    const std::size_t count = (skip + size + 3) / 4;
    room.resize(4 * count);
    for (std::size_t i = 0; i < count; ++i) {
        std::uint16_t half;
        std::memcpy(&half, c.data.data() + 2 * (first + i), 2);
        const std::uint32_t wide = widened_half(half);
        std::memcpy(room.data() + 4 * i, &wide, 4);
    }
    return std::span{room}.subspan(skip, size);
}

void stream_values(const volume& v, const channel& c, half_floats halves, const byte_sink& sink) {
    const std::uint64_t total = streamed_bytes(v, c, halves);
    std::vector<std::byte> room;
    for (std::uint64_t begin = 0; begin < total; begin += stream_piece_bytes)
        sink(streamed_piece(v, c, halves, begin,
                            static_cast<std::size_t>(std::min<std::uint64_t>(stream_piece_bytes, total - begin)),
                            room));
}

} // namespace voxelize
