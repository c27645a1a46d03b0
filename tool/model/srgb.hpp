// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// sRGB bytes <-> linear light, by tables that the host makes once: no pow at run time, so every backend gives the same
// bits. encode() gives the nearest byte; encode(linear[b]) is b.

#include <voxelpipe/core/exact.hpp>

#include <glm/gtc/type_precision.hpp>
#include <glm/vec4.hpp>

#include <cmath>
#include <cstdint>

namespace voxelize {

struct color_tables {
    float linear[256];    // of an sRGB byte
    float fraction[256];  // byte / 255: alpha
    float threshold[256]; // the least linear value that encodes to this byte or more; [0] is 0
};

[[nodiscard]] inline color_tables make_color_tables() {
    const auto to_linear = [](double encoded) {
        return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
    };
    color_tables tables{};
    for (int byte = 0; byte < 256; ++byte) {
        tables.linear[byte] = static_cast<float>(to_linear(byte / 255.0));
        tables.fraction[byte] = static_cast<float>(byte / 255.0);
        tables.threshold[byte] = byte == 0 ? 0.0F : static_cast<float>(to_linear((byte - 0.5) / 255.0));
    }
    return tables;
}

// Values in [0, 1]; what lies outside gets the nearest byte, NaN gets 0.
[[nodiscard]] VOXELPIPE_HD inline std::uint8_t encode_srgb(const color_tables& tables, float linear) {
    int byte = 0;
    for (int step = 128; step > 0; step >>= 1)
        if (linear >= tables.threshold[byte + step]) byte += step;
    return static_cast<std::uint8_t>(byte);
}

// Nearest byte of a fraction in [0, 1].
[[nodiscard]] VOXELPIPE_HD inline std::uint8_t encode_fraction(float value) {
    return static_cast<std::uint8_t>(voxelpipe::exact::fma(value, 255.0f, 0.5f));
}

[[nodiscard]] VOXELPIPE_HD inline glm::u8vec4 encode(const color_tables& tables, const glm::vec4& color) {
    return {encode_srgb(tables, color.r), encode_srgb(tables, color.g), encode_srgb(tables, color.b),
            encode_fraction(color.a)};
}

} // namespace voxelize
