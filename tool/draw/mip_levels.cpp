// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "mip_levels.hpp"

#include "model/parallel.hpp"
#include "model/srgb.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace voxelize {

namespace {

using texel16 = glm::vec<4, std::uint16_t>; // linear light and alpha, 65535 is 1

// Bytes to 16 bits and back, by tables: colours through linear light, alpha as it is.
struct converter {
    std::array<std::uint16_t, 256> linear{};
    std::vector<std::uint8_t> encoded; // of every 16-bit value, the nearest sRGB byte

    converter() : encoded(65536) {
        const color_tables tables = make_color_tables();
        for (std::size_t b = 0; b < 256; ++b)
            linear[b] = static_cast<std::uint16_t>(std::lround(static_cast<double>(tables.linear[b]) * 65535));
        for (std::size_t v = 0; v < encoded.size(); ++v)
            encoded[v] = encode_srgb(tables, static_cast<float>(static_cast<double>(v) / 65535));
    }
    [[nodiscard]] texel16 widen(const glm::u8vec4& t) const {
        return {linear[t.r], linear[t.g], linear[t.b], static_cast<std::uint16_t>(t.a * 257)};
    }
    [[nodiscard]] glm::u8vec4 narrow(const texel16& t) const {
        return {encoded[t.r], encoded[t.g], encoded[t.b], static_cast<std::uint8_t>((t.a + 128) / 257)};
    }
};

// Source texels [first, last] that a texel covers along one axis, with weights that add up to the source's side.
struct cover {
    std::uint32_t first, last;
    std::uint64_t first_weight, inner_weight, last_weight;

    cover(std::uint32_t i, std::uint32_t source, std::uint32_t size) {
        const std::uint64_t begin = std::uint64_t{i} * source; // in units of 1 / size source texels
        const std::uint64_t end = begin + source;
        first = static_cast<std::uint32_t>(begin / size);
        last = static_cast<std::uint32_t>((end - 1) / size);
        inner_weight = size;
        first_weight = std::min<std::uint64_t>(end, (std::uint64_t{first} + 1) * size) - begin;
        last_weight = end - std::uint64_t{last} * size;
    }
    [[nodiscard]] std::uint64_t weight(std::uint32_t s) const {
        return s == first ? first_weight : s == last ? last_weight : inner_weight;
    }
};

// The mean of four texels, rounded as by the weights of `halved`: these are equal, so they cancel.
texel16 mean_of_four(const std::array<texel16, 4>& texels, bool by_alpha) {
    std::uint32_t sums[4] = {};
    std::uint64_t shown[3] = {};
    for (const texel16& texel : texels) {
        for (int c = 0; c < 4; ++c) sums[c] += texel[c];
        for (int c = 0; c < 3; ++c) shown[c] += std::uint64_t{texel.a} * texel[c];
    }
    texel16 out;
    for (int c = 0; c < 4; ++c) out[c] = static_cast<std::uint16_t>((sums[c] + 2) / 4);
    if (by_alpha && sums[3] != 0)
        for (int c = 0; c < 3; ++c) out[c] = static_cast<std::uint16_t>((shown[c] + sums[3] / 2) / sums[3]);
    return out;
}

// READ(x, y) gives the texel16s of a picture of `width` x `height`; the result is one level smaller. Sums fit: weights
// add up to less than 2^28, a colour times an alpha is less than 2^32.
template <class Read>
std::vector<texel16> halved(std::uint32_t width, std::uint32_t height, bool by_alpha, int threads, const Read& read) {
    const std::uint32_t w = std::max(width / 2, 1U), h = std::max(height / 2, 1U);
    std::vector<texel16> result(std::size_t{w} * h);
    const bool even = width % 2 == 0 && height % 2 == 0;
    constexpr std::uint32_t rows = 16;
    parallel_for((h + rows - 1) / rows, threads, [&](std::size_t block) {
        const auto from = static_cast<std::uint32_t>(block) * rows;
        for (std::uint32_t y = from; y < std::min(h, from + rows); ++y) {
            if (even) {
                for (std::uint32_t x = 0; x < w; ++x)
                    result[std::size_t{y} * w + x] = mean_of_four({read(2 * x, 2 * y), read(2 * x + 1, 2 * y),
                                                                   read(2 * x, 2 * y + 1), read(2 * x + 1, 2 * y + 1)},
                                                                  by_alpha);
                continue;
            }
            const cover down(y, height, h);
            for (std::uint32_t x = 0; x < w; ++x) {
                const cover across(x, width, w);
                std::uint64_t sums[4] = {}, shown[3] = {}; // plain, and by alpha
                for (std::uint32_t sy = down.first; sy <= down.last; ++sy)
                    for (std::uint32_t sx = across.first; sx <= across.last; ++sx) {
                        const std::uint64_t weight = down.weight(sy) * across.weight(sx);
                        const texel16 texel = read(sx, sy);
                        for (int c = 0; c < 4; ++c) sums[c] += weight * texel[c];
                        if (by_alpha)
                            for (int c = 0; c < 3; ++c) shown[c] += weight * texel.a * texel[c];
                    }
                const std::uint64_t area = std::uint64_t{width} * height;
                texel16& out = result[std::size_t{y} * w + x];
                for (int c = 0; c < 4; ++c) out[c] = static_cast<std::uint16_t>((sums[c] + area / 2) / area);
                if (by_alpha && sums[3] != 0)
                    for (int c = 0; c < 3; ++c) out[c] = static_cast<std::uint16_t>((shown[c] + sums[3] / 2) / sums[3]);
            }
        }
    });
    return result;
}

} // namespace

int mip_level_count(std::uint32_t width, std::uint32_t height) {
    int levels = 1;
    for (std::uint32_t side = std::max(width, height); side > 1; side /= 2) ++levels;
    return levels;
}

std::vector<glm::u8vec4> with_mip_levels(const picture& source, bool by_alpha, int threads, int first) {
    static const converter convert;
    std::uint32_t width = source.width, height = source.height;
    const auto next_size = [&] {
        width = std::max(width / 2, 1U);
        height = std::max(height / 2, 1U);
    };
    const int count = mip_level_count(width, height);
    std::size_t total = 0;
    for (int level = 0; level < count; ++level, next_size())
        if (level >= first) total += std::size_t{width} * height;
    std::vector<glm::u8vec4> texels;
    texels.reserve(total);
    if (first == 0) {
        texels.resize(source.rgba.size() / 4);
        std::memcpy(texels.data(), source.rgba.data(), source.rgba.size());
    }

    width = source.width;
    height = source.height;
    std::vector<texel16> made;
    for (int level = 1; level < count; ++level, next_size()) {
        const auto from_picture = [&](std::uint32_t x, std::uint32_t y) {
            glm::u8vec4 texel;
            std::memcpy(&texel, source.rgba.data() + 4 * (std::size_t{y} * width + x), sizeof(texel));
            return convert.widen(texel);
        };
        const auto from_level = [&](std::uint32_t x, std::uint32_t y) { return made[std::size_t{y} * width + x]; };
        made = level == 1 ? halved(width, height, by_alpha, threads, from_picture)
                          : halved(width, height, by_alpha, threads, from_level);
        if (level < first) continue;
        for (const texel16& t : made) texels.push_back(convert.narrow(t));
    }
    return texels;
}

} // namespace voxelize
