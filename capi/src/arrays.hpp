// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Arrays of the caller's that calls write. One that is packed is drawn into as it is, another through a packed copy.

#include "calls.hpp"

#include <bindings/bits.hpp>

#include <array>
#include <cstddef>
#include <cstring>

namespace voxelpipe::capi {

// Where the values of an array lie, checked.
struct array_place {
    std::byte* data = nullptr;
    std::array<std::size_t, 4> count{};  // elements along x, y, z, and values of a voxel
    std::array<std::size_t, 4> stride{}; // bytes
    bool is_packed = false;

    [[nodiscard]] std::size_t elements() const { return count[0] * count[1] * count[2] * count[3]; }
};

// Throws unless the array has one of the types, memory for a grid of this extent with `values` a voxel, and no two
// elements in the same place. `what` names it in messages.
[[nodiscard]] array_place place_of(const vp_array* array, const char* what, std::initializer_list<std::int32_t> types,
                                   const glm::ivec3& extent, std::size_t values = 1);

// Calls draw(memory), which gives a status, with packed memory for the array's elements. If it succeeds, they are in
// the array afterwards; if not, the array is as it was.
template <class T, class Draw>
[[nodiscard]] status draw_into(const array_place& to, unsigned threads, const Draw& draw) {
    if (to.is_packed) return draw(reinterpret_cast<T*>(to.data));
    std::vector<T> packed(to.elements());
    const status s = draw(packed.data());
    if (!s.ok()) return s;
    const std::size_t rows = to.count[1] * to.count[2], row = to.count[0] * to.count[3];
    cpu::parallel_for(bindings::workers_of(threads), rows, [&](unsigned, std::size_t r) {
        std::byte* const row_at = to.data + r % to.count[1] * to.stride[1] + r / to.count[1] * to.stride[2];
        for (std::size_t i = 0; i < row; ++i)
            std::memcpy(row_at + i / to.count[3] * to.stride[0] + i % to.count[3] * to.stride[3], &packed[r * row + i],
                        sizeof(T));
    });
    return s;
}

// Draws bits into the array's memory, which become bytes where the array has those. draw(words).
template <class Draw>
[[nodiscard]] status draw_bits_into(const vp_array* array, const grid& g, unsigned threads, const Draw& draw) {
    const array_place to = place_of(array, "out", {VP_TYPE_UINT8, VP_TYPE_BITS}, g.extent);
    if (array->type == VP_TYPE_BITS) return draw_into<std::uint32_t>(to, threads, draw);
    return draw_into<std::uint8_t>(to, threads, [&](std::uint8_t* bytes) {
        std::vector<std::uint32_t> words(bindings::words_per_row(g.extent) * static_cast<std::size_t>(g.extent.y) *
                                         static_cast<std::size_t>(g.extent.z));
        const status s = draw(words.data());
        if (s.ok()) bindings::expand(words.data(), bytes, g.extent, threads);
        return s;
    });
}

} // namespace voxelpipe::capi
