// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "padding.hpp"

#include "model/targets.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

// Fills with the empty value of the target that the channel is of.
void fill_empty(channel& c) {
    const std::optional<target> id = target_named(c.name);
    const std::uint32_t empty = id ? info_of(*id).empty : 0;
    if (empty == 0) return; // as it is
    for (std::size_t at = 0; at + sizeof(empty) <= c.data.size(); at += sizeof(empty))
        std::memcpy(c.data.data() + at, &empty, sizeof(empty));
}

// Sets bit FIRST + i of the words at TO for every bit i of the COUNT words at FROM.
void or_bits(std::byte* to, const std::byte* from, std::size_t count, int first) {
    to += std::size_t{4} * static_cast<std::size_t>(first / 32);
    std::uint64_t carry = 0;
    for (std::size_t w = 0; w <= count; ++w) {
        std::uint32_t word = 0;
        if (w < count) std::memcpy(&word, from + 4 * w, 4);
        carry |= std::uint64_t{word} << (first % 32);
        const auto low = static_cast<std::uint32_t>(carry);
        carry >>= 32;
        if (low == 0) continue; // the row may end here
        std::memcpy(to + 4 * w, &low, 4);
    }
}

} // namespace

volume padded(volume inner, int padding) {
    if (padding == 0) return inner;
    volume outer;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        outer.extent[axis] = inner.extent[axis] + 2 * std::int64_t{padding};
        outer.voxel_size[axis] = inner.voxel_size[axis];
        outer.origin[axis] = inner.origin[axis] - padding * inner.voxel_size[axis];
    }
    for (channel& from : inner.channels) {
        channel& to = outer.add(from.name, from.type, from.components);
        fill_empty(to);
        const std::size_t voxel = size_of(from.type) * static_cast<std::size_t>(from.components);
        for (std::int64_t k = 0; k < inner.extent[2]; ++k) {
            for (std::int64_t j = 0; j < inner.extent[1]; ++j) {
                const auto row = static_cast<std::size_t>((k + padding) * outer.extent[1] + j + padding);
                const auto inner_row = static_cast<std::size_t>(k * inner.extent[1] + j);
                if (from.type == scalar::bit) {
                    const auto words = static_cast<std::size_t>(inner.words_per_row());
                    or_bits(to.data.data() + 4 * row * static_cast<std::size_t>(outer.words_per_row()),
                            from.data.data() + 4 * inner_row * words, words, padding);
                } else {
                    const std::size_t first =
                        row * static_cast<std::size_t>(outer.extent[0]) + static_cast<std::size_t>(padding);
                    const auto count = static_cast<std::size_t>(inner.extent[0]);
                    std::memcpy(to.data.data() + first * voxel, from.data.data() + inner_row * count * voxel,
                                count * voxel);
                }
            }
        }
        from.data = channel_bytes(); // = {} would keep the memory
    }
    for (volume& faces : inner.faces) outer.faces.push_back(padded(std::move(faces), padding));
    return outer;
}

} // namespace voxelize
