// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blends fragments into render targets in place (targets/immediate_mode.cuh): rows of bits, cubes and slim boxes of one
// triangle, and single voxels of a warp.

#include <voxelpipe/core/slim_box.hpp>
#include <voxelpipe/device/targets/immediate_mode.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// True for rows of bits whose words fragments change by one or, or by one and.
template <class Target>
inline constexpr bool has_word_rows =
    Target::map::is_bit && !Target::map::bricks &&
    (bit_blend<typename Target::blend_type>::sets || bit_blend<typename Target::blend_type>::clears);
// True if fragments of this value change such rows at all.
template <class Target, class Value>
[[nodiscard]] __device__ VOXELPIPE_INLINE bool changes_bits(const Value& value) {
    if constexpr (std::is_same_v<typename Target::blend_type, blend::count>)
        return true;
    else
        return value == bit_blend<typename Target::blend_type>::sets;
}
// Changes these bits of a word, if any, without a branch.
template <class Target>
__device__ VOXELPIPE_INLINE void reduce_word(word* at, word bits) {
    if constexpr (bit_blend<typename Target::blend_type>::sets)
        asm volatile("{ .reg .pred any; setp.ne.u32 any, %1, 0; @any red.relaxed.gpu.global.or.b32 [%0], %1; }" ::"l"(
                         __cvta_generic_to_global(at)),
                     "r"(bits)
                     : "memory");
    else
        asm volatile("{ .reg .pred any; setp.ne.u32 any, %1, 0; @any red.relaxed.gpu.global.and.b32 [%0], %2; }" ::"l"(
                         __cvta_generic_to_global(at)),
                     "r"(bits), "r"(~bits)
                     : "memory");
}
// Number of a voxel's word in rows with fewer than 2^30 words, modulo 2^32: the voxel may lie outside the extent.
template <class Target>
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t word_of(const target_view<Target>& t, int x, int y, int z) {
    const auto words_x = static_cast<std::uint32_t>((t.extent.x + 31) / 32);
    return (static_cast<std::uint32_t>(z) * static_cast<std::uint32_t>(t.extent.y) + static_cast<std::uint32_t>(y)) *
               words_x +
           static_cast<std::uint32_t>(x >> 5);
}
// The word with this number, below 2^30: its byte offset fits 32 bits.
template <class Target>
[[nodiscard]] __device__ VOXELPIPE_INLINE word* word_at(const target_view<Target>& t, std::uint32_t number) {
    return reinterpret_cast<word*>(reinterpret_cast<char*>(t.elements) + 4u * number);
}
// Position of a voxel in such rows, as a linear quantity: the number of its row's first word, and x; both modulo 2^32.
struct word_position {
    std::uint32_t row, x;
    [[nodiscard]] __device__ VOXELPIPE_INLINE word_position operator+(const word_position& other) const {
        return {row + other.row, x + other.x};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word_position operator*(int n) const {
        return {row * static_cast<std::uint32_t>(n), x * static_cast<std::uint32_t>(n)};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t number() const { return row + (x >> 5); }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word bit() const { return 1u << (x & 31); }
};
template <class Target>
[[nodiscard]] __device__ VOXELPIPE_INLINE word_position word_position_of(const target_view<Target>& t,
                                                                         const glm::ivec3& p) {
    return {word_of(t, 0, p.y, p.z), static_cast<std::uint32_t>(p.x)};
}
template <class Target>
[[nodiscard]] __device__ VOXELPIPE_INLINE word_position word_position_of(const target_view<Target>&,
                                                                         const word_position& p) {
    return p;
}

// Blends fragments of one value into the voxels x0 + i of a row, for the bits i of `mask`; x0 + 31 may lie beyond the
// extent. Returns how many voxels were touched for the first time, if tells_first holds and the mode is count_first.
template <class Target, class Value>
__device__ VOXELPIPE_INLINE unsigned blend_row(const target_view<Target>& t, int x0, int y, int z, word mask,
                                               const Value& value, immediate_mode mode) {
    using map = typename Target::map;
    unsigned first = 0;
    if constexpr (has_word_rows<Target>) {
        if (mode == immediate_mode::blend) {
            if (!changes_bits<Target>(value)) return 0;
            word* const at = t.elements + word_of(t, x0, y, z);
            const int shift = x0 & 31;
            reduce_word<Target>(at, mask << shift);
            reduce_word<Target>(at + 1, __funnelshift_l(mask, 0, shift));
            return 0;
        }
    }
    if constexpr (map::is_bit) {
        using blend_type = bit_blend<typename Target::blend_type>;
        bool v = true;
        if constexpr (!std::is_same_v<typename Target::blend_type, blend::count>) v = value;
        const auto one = [&](int x, word bits) {
            word* const w = t.elements + map::cell(t.extent, x, y, z);
            if constexpr (blend_type::sets) {
                if (!v) return;
                if (mode != immediate_mode::count_first) {
                    reduce_or(w, bits);
                    return;
                }
                const word seen = __ldca(w); // possibly stale: bits that are set stay set
                if ((bits & ~seen) != 0) first += static_cast<unsigned>(__popc(bits & ~atomicOr(w, bits)));
            } else if constexpr (blend_type::clears) {
                if (v) return;
                if (mode != immediate_mode::count_first) {
                    reduce_and(w, ~bits);
                    return;
                }
                const word seen = __ldca(w);
                if ((bits & seen) != 0) first += static_cast<unsigned>(__popc(bits & atomicAnd(w, ~bits)));
            } else {
                if (v) atomicXor(w, bits);
            }
        };
        const int shift = x0 & 31;
        const word low = mask << shift, high = shift == 0 ? 0 : mask >> (32 - shift);
        if (low != 0) one(x0, low);
        if (high != 0) one(x0 + 32, high);
    } else {
        for (; mask != 0; mask &= mask - 1) {
            const int x = x0 + __ffs(static_cast<int>(mask)) - 1;
            auto* const at = t.elements + map::cell(t.extent, x, y, z);
            if constexpr (std::is_same_v<typename Target::blend_type, blend::count>) {
                if (mode == immediate_mode::count_first) {
                    using method = global_blend<blend::count, typename Target::value_type>;
                    first += static_cast<unsigned>(method::apply_first(at, value));
                    continue;
                }
            }
            blend_value<Target, true>(at, value, 1, mode);
        }
    }
    return first;
}

// Blends fragments of one value into 2 x 2 x 2 voxels from (x, y, z) on; bit x + 2 y + 4 z of `voxels` says which.
// Voxels without a bit may lie outside the extent. The rows' loads are in flight together.
template <class Target, class Value>
__device__ VOXELPIPE_INLINE unsigned blend_cube(const target_view<Target>& t, int x, int y, int z, word voxels,
                                                const Value& value, immediate_mode mode) {
    if constexpr (has_word_rows<Target>) {
        if (mode == immediate_mode::blend) {
            if (!changes_bits<Target>(value)) return 0;
            constexpr bool sets = bit_blend<typename Target::blend_type>::sets;
            const auto row = static_cast<std::uint32_t>((t.extent.x + 31) / 32);
            const std::uint32_t slice = row * static_cast<std::uint32_t>(t.extent.y), first = word_of(t, x, y, z);
            word* const at[4] = {word_at(t, first), word_at(t, first + row), word_at(t, first + slice),
                                 word_at(t, first + slice + row)};
            const int shift = x & 31;
            word missing[4];
            for (int k = 0; k < 4; ++k) missing[k] = (voxels >> 2 * k & 3u) << shift;
            for (int k = 0; k < 4; ++k)
                if (missing[k] != 0) { // the word may be stale: changed bits stay changed
                    const word seen = __ldca(at[k]);
                    missing[k] &= sets ? ~seen : seen;
                }
            for (int k = 0; k < 4; ++k) reduce_word<Target>(at[k], missing[k]);
            if (shift == 31 && (voxels & 0xaau) != 0) { // the following words
                const std::uint32_t next = first + 1;
                reduce_word<Target>(t.elements + next, voxels >> 1 & 1u);
                reduce_word<Target>(t.elements + (next + row), voxels >> 3 & 1u);
                reduce_word<Target>(t.elements + (next + slice), voxels >> 5 & 1u);
                reduce_word<Target>(t.elements + (next + slice + row), voxels >> 7 & 1u);
            }
            return 0;
        }
    }
    unsigned touched = 0;
    if constexpr (Target::map::is_bit) {
#pragma unroll 1
        for (int k = 0; k < 4; ++k)
            if ((voxels >> 2 * k & 3u) != 0)
                touched += blend_row(t, x, y + k % 2, z + k / 2, voxels >> 2 * k & 3u, value, mode);
    } else {
#pragma unroll 1
        for (; voxels != 0; voxels &= voxels - 1) {
            const int i = __ffs(static_cast<int>(voxels)) - 1;
            touched += blend_row(t, x + i % 2, y + i / 2 % 2, z + i / 4, 1u, value, mode);
        }
    }
    return touched;
}

// Blends fragments of one value into rows of a slim box from (x, y, z) on, within the extent. The rows' loads are in
// flight together.
template <class Target, class Value>
__device__ VOXELPIPE_INLINE unsigned blend_slim(const target_view<Target>& t, int x, int y, int z,
                                                const core::slim_rows& rows, const Value& value, immediate_mode mode) {
    constexpr int count = core::slim_rows::count;
    if constexpr (has_word_rows<Target>) {
        if (mode == immediate_mode::blend) {
            if (!changes_bits<Target>(value)) return 0;
            constexpr bool sets = bit_blend<typename Target::blend_type>::sets;
            const auto by_y = static_cast<std::uint32_t>((t.extent.x + 31) / 32);
            const std::uint32_t by_z = by_y * static_cast<std::uint32_t>(t.extent.y);
            const std::uint32_t even = rows.along_y ? by_y : by_z, odd = rows.along_y ? by_z : by_y;
            const std::uint32_t first = word_of(t, x, y, z);
            const int shift = x & 31;
            word* at[count];
            word missing[count];
            for (unsigned k = 0; k < count; ++k) {
                at[k] = word_at(t, first + k / 2 * even + k % 2 * odd);
                missing[k] = (rows.bits >> 4 * k & 15u) << shift;
            }
            for (int k = 0; k < count; ++k)
                if (missing[k] != 0) { // the word may be stale: changed bits stay changed
                    const word seen = __ldca(at[k]);
                    missing[k] &= sets ? ~seen : seen;
                }
            for (int k = 0; k < count; ++k) reduce_word<Target>(at[k], missing[k]);
            const word beyond = rows.bits & (shift < 30 ? 0u : shift == 30 ? 0x444444u : 0x666666u);
            if (beyond != 0) { // the following words
#pragma unroll 1
                for (unsigned k = 0; k < count; ++k)
                    reduce_word<Target>(word_at(t, first + k / 2 * even + k % 2 * odd + 1),
                                        (beyond >> 4 * k & 15u) >> (32 - shift));
            }
            return 0;
        }
    }
    unsigned touched = 0;
#pragma unroll 1
    for (int k = 0; k < count; ++k) {
        const word bits = rows.bits >> 4 * k & 15u;
        const int even = k / 2, odd = k % 2;
        if (bits != 0)
            touched +=
                blend_row(t, x, y + (rows.along_y ? even : odd), z + (rows.along_y ? odd : even), bits, value, mode);
    }
    return touched;
}

// ---- targets of values, blended in place ----------------------------------------------------------------------------

// True if values of a row along x are neighbours in memory. The functions below are for the mode blend.
template <class Target>
inline constexpr bool has_value_rows = !Target::map::is_bit && !Target::map::bricks && is_immediate<Target>();

template <class Target, class Value>
__device__ VOXELPIPE_INLINE void add_where(typename Target::element_type* at, const Value& value, bool wanted) {
    using value_type = typename Target::value_type;
    if constexpr (std::is_floating_point_v<value_type>) { // all floating-point blends in place are sums
        reduce_add_where(at, value, wanted);
    } else if (wanted) {
        global_blend<typename Target::blend_type, value_type>::apply(at, value);
    }
}
// As blend_row; fastest if the set bits are neighbours.
template <class Target, class Value>
__device__ VOXELPIPE_INLINE void add_row(const target_view<Target>& t, int x0, int y, int z, word mask,
                                         const Value& value) {
    if (mask == 0) return;
    const int skipped = __ffs(static_cast<int>(mask)) - 1;
    auto* at = t.elements + Target::map::cell(t.extent, x0 + skipped, y, z);
    for (mask >>= skipped; mask != 0; mask >>= 4, at += 4)
        for (int k = 0; k < 4; ++k) add_where<Target>(at + k, value, (mask >> k & 1u) != 0);
}
// As blend_cube.
template <class Target, class Value>
__device__ VOXELPIPE_INLINE void add_cube(const target_view<Target>& t, int x, int y, int z, word voxels,
                                          const Value& value) {
    // The first voxel may lie outside, even before the target's elements.
    const std::int64_t row = t.extent.x, slice = row * t.extent.y, first = (std::int64_t{z} * t.extent.y + y) * row + x;
    for (unsigned k = 0; k < 4; ++k) {
        auto* const at = t.elements + (first + (k % 2 != 0 ? row : 0) + (k / 2 != 0 ? slice : 0));
        for (unsigned i = 0; i < 2; ++i) add_where<Target>(at + i, value, (voxels >> (2 * k + i) & 1u) != 0);
    }
}

// Blends one voxel of a target of values, for every lane that calls it. Lanes with the same voxel, as neighbours in a
// fine mesh often have, are counted and take one atomic together.
template <class Target, class Value>
__device__ VOXELPIPE_INLINE unsigned blend_shared(const target_view<Target>& t, int x, int y, int z, const Value& value,
                                                  immediate_mode mode) {
    using map = typename Target::map;
    if (mode == immediate_mode::count_first) return blend_row(t, x, y, z, 1u, value, mode);
    auto* const at = t.elements + map::cell(t.extent, x, y, z);
    const unsigned same = __match_any_sync(__activemask(), reinterpret_cast<unsigned long long>(at));
    if ((same & ((1u << threadIdx.x % 32) - 1)) == 0)
        blend_value<Target, false>(at, value, static_cast<unsigned>(__popc(same)), mode);
    return 0;
}

// Blends up to four voxels, position(i) for the bits i of `wanted`; their loads are in flight together. If the mode is
// to blend rows of bits, positions may be word_positions.
template <class Target, class Value, class Position>
__device__ VOXELPIPE_INLINE unsigned blend_voxels(const target_view<Target>& t, word wanted, const Position& position,
                                                  const Value& value, immediate_mode mode) {
    if constexpr (has_word_rows<Target>) {
        if (mode == immediate_mode::blend) {
            if (!changes_bits<Target>(value)) return 0;
            constexpr bool sets = bit_blend<typename Target::blend_type>::sets;
            word* at[4];
            word missing[4];
            for (int k = 0; k < 4; ++k) {
                const word_position p = word_position_of(t, position(k));
                at[k] = t.elements + p.number();
                missing[k] = (wanted >> k & 1u) != 0 ? p.bit() : 0;
            }
            for (int k = 0; k < 4; ++k)
                if (missing[k] != 0) { // the word may be stale: changed bits stay changed
                    const word seen = __ldca(at[k]);
                    missing[k] &= sets ? ~seen : seen;
                }
            for (int k = 0; k < 4; ++k) reduce_word<Target>(at[k], missing[k]);
            return 0;
        }
    }
    unsigned touched = 0;
    if constexpr (!std::is_same_v<decltype(position(0)), word_position>) {
#pragma unroll 1
        for (; wanted != 0; wanted &= wanted - 1) {
            const glm::ivec3 p = position(__ffs(static_cast<int>(wanted)) - 1);
            touched += blend_row(t, p.x, p.y, p.z, 1u, value, mode);
        }
    }
    return touched;
}

} // namespace voxelpipe::device
