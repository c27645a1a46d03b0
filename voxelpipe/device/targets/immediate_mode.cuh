// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Render targets that fragments are blended into in place, by one atomic on global memory: bits, and integers whose
// stored value is the blend's accumulator. Sums of floats qualify only if every partial sum is exact, which the host
// can prove for a shader with constant values; then no order of additions can change a bit. Other sums, if all draws
// give one constant, are counted: a cleared target holds the number of each voxel's fragments until the end of the call
// (targets/finalize_counts.cuh).

#include <voxelpipe/device/targets/global_blend.cuh>
#include <voxelpipe/device/targets/repeated_fold.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// How the fragments of a call enter one of its targets.
enum class immediate_mode : std::uint32_t {
    blend,       // in place; a target of bits in rows has fewer than 2^30 words
    blend_far,   // in place, with any number of words
    count_first, // in place, and counts voxels without earlier fragments; needs tells_first
    count,       // the target holds each voxel's number of fragments
    off          // the target is not written
};
template <std::size_t N>
struct immediate_modes {
    immediate_mode of[N] = {}; // by target
    bool counts_first = false;
};

template <class Target>
[[nodiscard]] constexpr bool is_immediate() {
    if constexpr (Target::map::is_bit)
        return method_of<Target>() == blend_method::bits;
    else
        return !Target::map::planes &&
               global_blend<typename Target::blend_type, typename Target::value_type>::available;
}

// True if a number of fragments fits a voxel's storage and determines the voxel's value. A constant instead of a
// function, because device code uses it.
template <class Target>
inline constexpr bool is_countable = false;
template <class Target>
requires(!Target::map::is_bit && is_immediate<Target>()) inline constexpr bool is_countable<Target> =
    core::repeated_fold<typename Target::blend_type, typename Target::value_type>::available;

// True if this target may be blended in place with up to `most` fragments of this value.
template <class Target, class Value>
[[nodiscard]] bool can_be_immediate(const target_view<Target>& t, const Value& value, std::uint64_t most) {
    if (t.load == load_operation::off) return true;
    if constexpr (Target::map::is_bit)
        return true;
    else
        return global_blend<typename Target::blend_type, typename Target::value_type>::allowed(value, t, most);
}

// True if blending in place reports which voxels are touched for the first time.
template <class Target, class Value>
[[nodiscard]] bool tells_first(const target_view<Target>& t, const Value& value, std::uint64_t most) {
    if (t.load == load_operation::off) return false;
    if constexpr (Target::map::is_bit) {
        using blend_type = bit_blend<typename Target::blend_type>;
        if (t.load != load_operation::clear) return false;
        if constexpr (blend_type::sets)
            return !t.clear_value && value;
        else if constexpr (blend_type::clears)
            return t.clear_value && !value;
        else
            return false;
    } else {
        return global_blend<typename Target::blend_type, typename Target::value_type>::tells_first(t, most);
    }
}

// Blends n > 0 fragments of one value into the voxel at `at`; with `One`, n is 1.
template <class Target, bool One, class Value>
__device__ VOXELPIPE_INLINE void blend_value(typename Target::element_type* at, const Value& value, unsigned n,
                                             immediate_mode mode) {
    using method = global_blend<typename Target::blend_type, typename Target::value_type>;
    using number = unsigned_word<typename Target::value_type>;
    if constexpr (is_countable<Target>) {
        if (mode == immediate_mode::count) {
            reduce_add(reinterpret_cast<number*>(at), number{n});
            return;
        }
    }
    if constexpr (One)
        method::apply(at, value);
    else
        method::apply_many(at, value, n);
}

} // namespace voxelpipe::device
