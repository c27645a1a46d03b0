// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Words of bits that a warp sets together. Neighbouring triangles, which a warp has, touch the same words repeatedly:
// of hairball's thin fragments in 1024^3, 76 in 100 are the first of their triangle in a word, but only 17 in 100 are
// the first of 32 triangles. So a warp gathers bits in shared memory, by word number, and each word takes one reduction
// in L2. Only for thin coverage: conservative rows, of 1.8 bits on average there, have gathered some already, and
// gathering more takes more instructions than it saves.

#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/device/targets/global_target.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// Shared memory of one warp: slots by a hash of the word's number. A word whose slot is taken by another goes to memory
// at once.
struct word_slots {
    static constexpr int log2_count = tuning::log2_word_slots, count = 1 << log2_count;
    static constexpr std::uint32_t none = ~0u; // no target that is blended by 32-bit numbers has that word
    uint2 slots[count];                        // number of a word, its bits

    // All lanes call it.
    __device__ VOXELPIPE_INLINE void start() {
        for (int i = static_cast<int>(threadIdx.x) % 32; i < count; i += 32) slots[i] = uint2{none, 0};
        __syncwarp();
    }
    // Any lanes call it. In assembly, so that the compiler does not provide for addresses outside shared memory.
    __device__ VOXELPIPE_INLINE void set(word* words, std::uint32_t number, word bits) {
        const std::uint32_t slot = number * 0x9e3779b1u >> (32 - log2_count);
        const auto at = static_cast<std::uint32_t>(__cvta_generic_to_shared(slots + slot));
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
            const uint2 slot = slots[i];
            if (slot.x == none) continue;
            reduce_or(words + slot.x, slot.y);
            slots[i] = uint2{none, 0};
        }
        __syncwarp();
    }
};

struct no_words {};

// True if a call gathers its thin fragments: it has one target of bits, set to true, with 32-bit word numbers.
template <class Call>
inline constexpr bool combines_words = Call::output::only_sets && (Call::rule == coverage::thin);
template <class Call>
using warp_words = std::conditional_t<combines_words<Call>, word_slots, no_words>;

// Replaces the sink that it is made from, for single fragments.
template <class Call>
struct combining_sink : Call::sink {
    word_slots& words;

    __device__ VOXELPIPE_INLINE combining_sink(const typename Call::sink& sink, word_slots& words_)
        : Call::sink(sink), words(words_) {
        this->mine = {};
        words.start();
    }
    __device__ VOXELPIPE_INLINE void emit(const word_position& at, bool wanted) {
        if (!wanted) return;
        ++this->mine.fragments;
        words.set(voxelpipe::get<0>(this->call.out.fb.targets).elements, at.number(), at.bit());
    }
    __device__ VOXELPIPE_INLINE void flush() { words.flush(voxelpipe::get<0>(this->call.out.fb.targets).elements); }
};

// ---- close cubes ----------------------------------------------------------------------------------------------------

// Bits of a batch of triangles that all lie within a few voxels, set by their warp at once. On the finest meshes 32
// neighbours touch two or three words again and again, and warps that test those one by one wait for one another.

// True if batches of a mesh are likely to lie within 4 x 4 x 4 voxels, as far as the host knows; otherwise the test
// costs more than it gains. On a surface as large as three faces of the grid, 32 triangles then cover at most five
// voxels.
[[nodiscard]] inline bool may_be_close(std::uint32_t num_triangles, const glm::ivec3& extent) {
    const std::uint64_t x = static_cast<std::uint32_t>(extent.x), y = static_cast<std::uint32_t>(extent.y),
                        z = static_cast<std::uint32_t>(extent.z);
    return num_triangles >= tuning::min_close_triangles * (x * y + y * z + z * x);
}

// Sets the 2 x 2 x 2 cubes of a warp's lanes if all lie within 4 x 4 x 4 voxels, so that two words hold them. Each lane
// has the voxels x + 2 y + 4 z from lo on; lo is arbitrary if there are none, and no voxel lies outside the target.
// Returns false, with nothing done, if they do not lie so. All lanes call it.
template <class Target>
[[nodiscard]] __device__ VOXELPIPE_INLINE bool set_close_cubes(const target_view<Target>& t,
                                                               const std::int32_t (&lo)[3], word voxels) {
    constexpr unsigned all = 0xffffffffu;
    constexpr int middle_lane = 16; // its cube is to be in the middle
    const auto lane = static_cast<int>(threadIdx.x) % 32;
    std::int32_t begin[3]; // possibly outside the grid
    std::uint32_t from[3];
    for (int k = 0; k < 3; ++k) {
        const auto mine = static_cast<std::uint32_t>(lo[k]), first = __shfl_sync(all, mine, middle_lane) - 1;
        begin[k] = static_cast<std::int32_t>(first);
        from[k] = mine - first;
    }
    if (!__all_sync(all, voxels != 0 ? core::max3(from[0], from[1], from[2]) <= 2 : lane != middle_lane)) return false;
    const word by_z = (voxels & 0xfu) | (voxels & 0xf0u) << 12;
    const word by_y = ((by_z & 0x30003u) | (by_z << 2 & 0x300030u)) << ((from[0] + 4 * from[1]) & 31); // x + 4 y + 16 z
    const std::uint64_t mine = std::uint64_t{by_y} << (16 * from[2] & 63);
    const word low = __reduce_or_sync(all, static_cast<word>(mine)),
               high = __reduce_or_sync(all, static_cast<word>(mine >> 32));
    const word row = (lane < 8 ? low : high) >> (4 * lane & 31) & 15u;
    if (lane < 16 && row != 0) {
        const auto shift = static_cast<unsigned>(begin[0] & 31);
        const std::uint32_t number = word_of(t, begin[0], begin[1] + lane % 4, begin[2] + lane / 4);
        word missing = row << shift;
        if (missing != 0)
            missing &= ~__ldca(word_at(t, number)); // the word may be stale: bits are never cleared, so that is safe
        reduce_word<Target>(word_at(t, number), missing);
        if (shift > 28) reduce_word<Target>(word_at(t, number + 1), row >> (32 - shift));
    }
    return true;
}

} // namespace voxelpipe::device
