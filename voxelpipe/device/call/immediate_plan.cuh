// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Decides, for calls of constant shaders, which targets are blended in place and which count their fragments.

#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/device/targets/finalize_counts.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <bit>
#include <span>

namespace voxelpipe::device {

template <std::size_t K, class Target, class Draw>
[[nodiscard]] bool may_be_counted(std::span<const Draw> draws, const target_view<Target>& t) {
    if constexpr (is_countable<Target>) {
        if (t.load != load_operation::clear) return false;
        if constexpr (!std::is_same_v<typename Target::blend_type, blend::count>) {
            const auto& first = voxelpipe::get<K>(draws[0].fragment_shader.values);
            for (const Draw& d : draws) // numbers: equal bytes are equal values
                if (!core::has_same_bits(first, voxelpipe::get<K>(d.fragment_shader.values))) return false;
        }
        return true;
    } else {
        return false;
    }
}

// Fills in how a call of constant shaders does without tiles; plan.modes must be new. A target is counted only if
// blending in place would not give its blend's bits, or if no other target can report how many voxels are touched.
// Assigns members one by one, because the bytes, padding included, are part of a graph's key.
template <class Draw, class... Targets>
void plan_immediate(std::span<const Draw> draws, const framebuffer_view<Targets...>& fb, std::uint64_t num_primitives,
                    bool count_voxels, immediate_plan<sizeof...(Targets)>& plan) {
    plan.possible = plan.is_cheap = true;
    plan.voxels_of = plan.bits_of = -1;
    int telling = -1, countable = -1; // the first target that reports first touches; that may be counted
    int telling_bits = -1;            // the first target that shows them by its bits after drawing
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        const auto& t = voxelpipe::get<K>(fb.targets);
        bool in_place = true, tells = true;
        for (const Draw& d : draws) {
            const auto& value = voxelpipe::get<K>(d.fragment_shader.values);
            in_place = in_place && can_be_immediate(t, value, num_primitives);
            tells = tells && tells_first(t, value, num_primitives);
        }
        const bool may_count = may_be_counted<K>(draws, t);
        if (tells && telling < 0) telling = static_cast<int>(K);
        using map = typename core::pack_element<K, Targets...>::type::map;
        if (tells && telling_bits < 0 && map::is_bit &&
            map::elements(fb.extent) * sizeof(word) <= tuning::max_counted_bits)
            telling_bits = static_cast<int>(K);
        if (may_count && countable < 0) countable = static_cast<int>(K);
        if (map::is_bit && map::elements(fb.extent) >> 30 != 0) plan.modes.of[K] = immediate_mode::blend_far;
        if (t.load == load_operation::off) plan.modes.of[K] = immediate_mode::off;
        if (in_place) return;
        if (may_count)
            plan.modes.of[K] = immediate_mode::count;
        else
            plan.possible = false;
    });
    if (count_voxels && !plan.any_counted()) {
        if (telling_bits >= 0) {
            plan.bits_of = telling_bits;
        } else if (telling >= 0) {
            plan.modes.of[telling] = immediate_mode::count_first;
            plan.modes.counts_first = true;
        } else if (countable >= 0) {
            plan.modes.of[countable] = immediate_mode::count;
        } else {
            plan.possible = false;
        }
    }
    if (count_voxels) plan.voxels_of = plan.first_counted();
    std::uint64_t bytes = 0;
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        if (plan.counts(K) && !ends_by_marks(voxelpipe::get<K>(fb.targets)))
            bytes += target::map::elements(fb.extent) * sizeof(typename target::element_type);
    });
    plan.is_cheap = bytes <= tuning::counted_bytes + num_primitives * tuning::counted_bytes_per_triangle;
}

} // namespace voxelpipe::device
