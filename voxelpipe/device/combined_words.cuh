// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Words of bits that a warp sets together. Neighbouring triangles, which are a warp's, touch the same words again and
// again: of hairball's thin fragments in 1024^3, 76 in 100 are the first of their triangle in a word, but 17 in 100 the
// first of 32 triangles. So a warp gathers bits in shared memory, by the number of their word, and each word takes one
// reduction in L2. For thin coverage only: conservative rows, of 1.8 bits on average there, have gathered some already,
// and to gather more takes more instructions than it saves.

#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/device/direct_target.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// What one warp keeps: places by a hash of a word's number. What finds its place taken by another word goes to memory
// at once.
struct word_places {
    static constexpr int log2_count = 8, count = 1 << log2_count;
    static constexpr std::uint32_t none = ~0u; // no target that is blended by 32-bit numbers has that word
    uint2 places[count];                       // the number of a word, its bits

    // All lanes take part, here and below; nothing waits.
    __device__ VOXELPIPE_INLINE void start() {
        for (int i = static_cast<int>(threadIdx.x) % 32; i < count; i += 32) places[i] = uint2{none, 0};
        __syncwarp();
    }
    // By any lanes. In assembly, so that no compiler provides for memory that is not shared.
    __device__ VOXELPIPE_INLINE void set(word* words, std::uint32_t number, word bits) {
        const std::uint32_t place = number * 0x9e3779b1u >> (32 - log2_count);
        const auto at = static_cast<std::uint32_t>(__cvta_generic_to_shared(places + place));
        std::uint32_t seen = 0;
        asm volatile("atom.relaxed.cta.shared.cas.b32 %0, [%1], %2, %3;"
                     : "=r"(seen)
                     : "r"(at), "r"(none), "r"(number)
                     : "memory");
        if (seen == none || seen == number)
            asm volatile("red.relaxed.cta.shared.or.b32 [%0 + 4], %1;" ::"r"(at), "r"(bits) : "memory");
        else
            reduce_or(words + number, bits);
    }
    __device__ VOXELPIPE_INLINE void flush(word* words) {
        __syncwarp();
        for (int i = static_cast<int>(threadIdx.x) % 32; i < count; i += 32) {
            const uint2 place = places[i];
            if (place.x == none) continue;
            reduce_or(words + place.x, place.y);
            places[i] = uint2{none, 0};
        }
        __syncwarp();
    }
};

struct no_words {};

// Whether a call gathers its thin fragments so: those of one target of bits that true sets, by 32-bit numbers.
template <class Call>
inline constexpr bool combines_words = Call::output::only_sets && (Call::rule == coverage::thin);
template <class Call>
using warp_words = std::conditional_t<combines_words<Call>, word_places, no_words>;

// Takes the place of the sink that it is made from, for fragments one by one.
template <class Call>
struct combining_sink : Call::sink {
    word_places& words;

    __device__ VOXELPIPE_INLINE combining_sink(const typename Call::sink& sink, word_places& words_)
        : Call::sink(sink), words(words_) {
        this->mine = {};
        words.start();
    }
    __device__ VOXELPIPE_INLINE void put(const word_place& at, bool wanted) {
        if (!wanted) return;
        ++this->mine.fragments;
        words.set(voxelpipe::get<0>(this->call.out.fb.targets).elements, at.number(), at.bit());
    }
    __device__ VOXELPIPE_INLINE void flush() { words.flush(voxelpipe::get<0>(this->call.out.fb.targets).elements); }
};

} // namespace voxelpipe::device
