// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Four integers of 32 or 64 bits in parallel: plain, and in SSE2 registers if the compiler has them. Supports what
// coverage needs: sums, linear functions, and tests for non-negative lanes. Host code.

#include <cstdint>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace voxelpipe::core {

template <class Int>
struct plain_lanes {
    Int v[4];

    [[nodiscard]] static constexpr plain_lanes all(Int a) { return {{a, a, a, a}}; }
    [[nodiscard]] static constexpr plain_lanes line(Int first, Int step) { // first + step * i in lane i
        return {{first, first + step, first + 2 * step, first + 3 * step}};
    }
    [[nodiscard]] friend constexpr plain_lanes operator+(const plain_lanes& a, const plain_lanes& b) {
        return {{a.v[0] + b.v[0], a.v[1] + b.v[1], a.v[2] + b.v[2], a.v[3] + b.v[3]}};
    }
    [[nodiscard]] friend constexpr plain_lanes operator-(const plain_lanes& a, const plain_lanes& b) {
        return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2], a.v[3] - b.v[3]}};
    }
    // Bit i is set if lane i is >= 0 in all arguments.
    [[nodiscard]] friend constexpr std::uint32_t nonnegative(const plain_lanes& a, const plain_lanes& b) {
        std::uint32_t bits = 0;
        for (int i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>((a.v[i] | b.v[i]) >= 0) << i;
        return bits;
    }
    [[nodiscard]] friend constexpr std::uint32_t nonnegative(const plain_lanes& a, const plain_lanes& b,
                                                             const plain_lanes& c) {
        std::uint32_t bits = 0;
        for (int i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>((a.v[i] | b.v[i] | c.v[i]) >= 0) << i;
        return bits;
    }
};

#if defined(__SSE2__)
struct sse2_lanes32 {
    __m128i v;

    [[nodiscard]] static sse2_lanes32 all(std::int32_t a) { return {_mm_set1_epi32(a)}; }
    [[nodiscard]] static sse2_lanes32 line(std::int32_t first, std::int32_t step) {
        return {_mm_setr_epi32(first, first + step, first + 2 * step, first + 3 * step)};
    }
    [[nodiscard]] friend sse2_lanes32 operator+(const sse2_lanes32& a, const sse2_lanes32& b) {
        return {_mm_add_epi32(a.v, b.v)};
    }
    [[nodiscard]] friend std::uint32_t nonnegative(const sse2_lanes32& a, const sse2_lanes32& b,
                                                   const sse2_lanes32& c) {
        const __m128i any = _mm_or_si128(_mm_or_si128(a.v, b.v), c.v);
        return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_castsi128_ps(any))) ^ 15u;
    }
};
struct sse2_lanes64 {
    __m128i v[2];

    [[nodiscard]] static sse2_lanes64 all(std::int64_t a) {
        const __m128i both = _mm_set1_epi64x(a);
        return {{both, both}};
    }
    [[nodiscard]] static sse2_lanes64 line(std::int64_t first, std::int64_t step) {
        return {{_mm_set_epi64x(first + step, first), _mm_set_epi64x(first + 3 * step, first + 2 * step)}};
    }
    [[nodiscard]] friend sse2_lanes64 operator+(const sse2_lanes64& a, const sse2_lanes64& b) {
        return {{_mm_add_epi64(a.v[0], b.v[0]), _mm_add_epi64(a.v[1], b.v[1])}};
    }
    [[nodiscard]] friend sse2_lanes64 operator-(const sse2_lanes64& a, const sse2_lanes64& b) {
        return {{_mm_sub_epi64(a.v[0], b.v[0]), _mm_sub_epi64(a.v[1], b.v[1])}};
    }
    // Gathers the sign bits in one register: the upper halves of all four lanes.
    [[nodiscard]] friend std::uint32_t nonnegative(const sse2_lanes64& a, const sse2_lanes64& b) {
        const __m128 lo = _mm_castsi128_ps(_mm_or_si128(a.v[0], b.v[0])),
                     hi = _mm_castsi128_ps(_mm_or_si128(a.v[1], b.v[1]));
        return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_shuffle_ps(lo, hi, _MM_SHUFFLE(3, 1, 3, 1)))) ^ 15u;
    }
};
using lanes32 = sse2_lanes32;
using lanes64 = sse2_lanes64;
#else
using lanes32 = plain_lanes<std::int32_t>;
using lanes64 = plain_lanes<std::int64_t>;
#endif

} // namespace voxelpipe::core
