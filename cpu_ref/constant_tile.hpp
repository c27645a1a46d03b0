// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tiles of a scene whose shader gives every fragment the same values. Then only coverage matters and, for blends in
// which a repetition counts, the number of fragments of each voxel. A tile gathers one bit, and if needed one number,
// per voxel; at its end each target is updated once per covered voxel.

#include <cpu_ref/tile_fragments.hpp>

#include <array>

namespace voxelpipe::cpu {

// True if folding the same value a second time changes nothing.
template <class Blend, class T>
inline constexpr bool folds_once = std::is_same_v<Blend, blend::replace> || std::is_same_v<Blend, blend::min> ||
                                   std::is_same_v<Blend, blend::max> || std::is_same_v<Blend, blend::bit_and> ||
                                   std::is_same_v<Blend, blend::bit_or> || std::is_same_v<Blend, blend::mean> ||
                                   (std::is_same_v<Blend, blend::add_saturate> && std::is_same_v<T, bool>);

template <class Target>
inline constexpr bool target_folds_once = folds_once<typename Target::blend_type, typename Target::value_type>;

// True if an active target needs the number of fragments of each voxel.
template <class... Targets>
[[nodiscard]] bool needs_repeats(const framebuffer_view<Targets...>& fb) {
    bool repeats = false;
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target_type = typename core::pack_element<I, Targets...>::type;
        if (!target_folds_once<target_type> && get<I>(fb.targets).load != load_operation::off) repeats = true;
    });
    return repeats;
}

// One thread's data of its current tile.
struct constant_scratch {
    std::array<std::uint32_t, tile_rows> touched{};
    std::unique_ptr<std::uint32_t[]> repeats; // fragments of each voxel; null if no target needs them
    counters counts{};
};

template <coverage Rule, bool Repeats>
void cover_tile(const geometry& s, const core::voxel_box& tile, const std::uint32_t* primitives, std::size_t stride,
                std::size_t count, constant_scratch& scratch) {
    std::uint32_t* const touched = scratch.touched.data();
    [[maybe_unused]] std::uint32_t* const repeats = scratch.repeats.get();
    std::uint64_t fragments = 0;
    const auto along_x = [&](int row, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
        touched[row] |= bits;
        const int width = interval_width(bits);
        fragments += static_cast<unsigned>(width);
        if constexpr (Repeats) {
            std::uint32_t* const r = repeats + tile_voxel(row, std::countr_zero(bits));
            for (int i = 0; i < width; ++i) ++r[i];
        }
    };
    const auto across = [&](int row, int step, int x, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
        const int width = interval_width(bits);
        fragments += static_cast<unsigned>(width);
        int at = row + std::countr_zero(bits) * step;
        for (int i = 0; i < width; ++i, at += step) {
            touched[at] |= 1u << x;
            if constexpr (Repeats) ++repeats[tile_voxel(at, x)];
        }
    };
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t id =
            *reinterpret_cast<const std::uint32_t*>(reinterpret_cast<const std::byte*>(primitives) + i * stride);
        cover_in_tile<Rule>(gathered_triangle(s, id), s.snap.fraction, s.arms, tile, along_x, across);
    }
    scratch.counts.fragments += fragments;
}

// The type of a constant shader's value for a target: the target's, or floats for a mean. Targets of blend::count
// ignore the value, whatever its type.
template <class Target, class Value>
using folded_value = std::conditional_t<std::is_same_v<typename Target::blend_type, blend::mean>,
                                        std::remove_cvref_t<Value>, typename Target::value_type>;

// Folds a constant value into one target, 32 voxels along x at a time.
template <class Target, class Value = typename Target::value_type>
class constant_folder {
public:
    using value_type = typename Target::value_type;

    constant_folder(const target_view<Target>& t, const Value& value) : t_(t), value_(value) {
        if constexpr (by_words) {
            from_zero_ = fold(false, 1) ? ~0u : 0u;
            from_one_ = fold(true, 1) ? ~0u : 0u;
        }
    }

    // Updates voxels x + i for the bits i of `word`; x is a multiple of 32. Voxel x + i has repeats[i] fragments, or
    // one if `repeats` is null or a repetition changes nothing.
    void apply(int x, int y, int z, std::uint32_t word, const std::uint32_t* repeats) {
        if constexpr (by_words) {
            std::uint32_t& stored = t_.elements[map::cell(t_.extent, x, y, z)];
            stored = (stored & ~word) | (word & ((stored & from_one_) | (~stored & from_zero_)));
        } else {
            for (; word != 0; word &= word - 1) {
                const int column = std::countr_zero(word);
                const std::uint32_t n = target_folds_once<Target> || repeats == nullptr ? 1 : repeats[column];
                t_.store(x + column, y, z,
                         t_.load == load_operation::clear ? onto_clear(n) : fold(t_(x + column, y, z), n));
            }
        }
    }

private:
    using map = typename Target::map;
    using traits = typename Target::traits;
    // If a result depends only on the stored bit, a word is updated at once.
    static constexpr bool by_words = map::is_bit && target_folds_once<Target>;
    // A cleared target need not be read. It has few different results, of which this many are kept.
    static constexpr std::uint32_t num_known = target_folds_once<Target> ? 2 : 16;

    [[nodiscard]] value_type fold(const value_type& stored, std::uint32_t n) const {
        auto a = traits::begin(stored);
        for (std::uint32_t i = 0; i < n; ++i) traits::apply(a, value_);
        return traits::end(a);
    }
    [[nodiscard]] value_type onto_clear(std::uint32_t n) {
        if (n >= num_known) return fold(t_.clear_value, n);
        for (; known_end_ <= n; ++known_end_) known_[known_end_] = fold(t_.clear_value, known_end_);
        return known_[n];
    }

    const target_view<Target>& t_;
    const Value& value_;
    std::uint32_t from_zero_ = 0, from_one_ = 0;
    std::array<value_type, num_known> known_{};
    std::uint32_t known_end_ = 0;
};

// `at`: position in the target of the tile's lowest voxel; x is a multiple of 32.
template <class Target, class Value>
void resolve_constant_target(const glm::ivec3& at, const target_view<Target>& t, const Value& value,
                             const constant_scratch& scratch) {
    const int x0 = at.x, y0 = at.y, z0 = at.z;
    constant_folder<Target, Value> folder(t, value);
    for (std::size_t row = 0; row < tile_rows; ++row) {
        const std::uint32_t word = scratch.touched[row];
        if (word == 0) continue;
        const int y = y0 + static_cast<int>(row) % tile_size, z = z0 + static_cast<int>(row) / tile_size;
        folder.apply(x0, y, z, word, scratch.repeats == nullptr ? nullptr : scratch.repeats.get() + row * tile_size);
    }
}

// Ends the tile: updates the targets, counts voxels, and resets the scratch.
template <class Values, class... Targets>
void resolve_constant_tile(const glm::ivec3& at, const framebuffer_view<Targets...>& fb, const Values& values,
                           constant_scratch& scratch) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto& t = get<I>(fb.targets);
        using target_type = typename core::pack_element<I, Targets...>::type;
        folded_value<target_type, decltype(get<I>(values))> value{};
        if constexpr (!std::is_same_v<typename target_type::blend_type, blend::count>) value = get<I>(values);
        if (t.load != load_operation::off) resolve_constant_target<target_type>(at, t, value, scratch);
    });
    for (std::size_t row = 0; row < tile_rows; ++row) {
        std::uint32_t word = scratch.touched[row];
        if (word == 0) continue;
        scratch.touched[row] = 0;
        scratch.counts.voxels += static_cast<unsigned>(std::popcount(word));
        if (scratch.repeats != nullptr)
            for (; word != 0; word &= word - 1)
                scratch.repeats[row * tile_size + static_cast<std::size_t>(std::countr_zero(word))] = 0;
    }
}

} // namespace voxelpipe::cpu
