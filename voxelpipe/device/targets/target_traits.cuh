// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Compile-time facts about the targets of a framebuffer: their types, the bits of a voxel in a tile, and the groups
// that the tile passes draw together; and how one finished voxel is stored.

#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/device/targets/blend_method.cuh>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/tuning/tuning_fine_raster.hpp>

#include <array>
#include <cstddef>
#include <type_traits>
#include <utility>

namespace voxelpipe::device {

template <class Framebuffer>
struct targets_of;
template <class... Targets>
struct targets_of<framebuffer_view<Targets...>> {
    static constexpr std::size_t count = sizeof...(Targets);
    template <std::size_t I>
    using at = typename core::pack_element<I, Targets...>::type;
};

// Bits of a tile image that one voxel of the target takes.
template <class Target>
[[nodiscard]] VOXELPIPE_HD constexpr int bits_per_voxel() {
    if constexpr (method_of<Target>() == blend_method::atomic)
        return 32 * value_blend<typename Target::blend_type, typename Target::value_type>::words;
    else if constexpr (method_of<Target>() == blend_method::bits)
        return 1;
    else
        return 0; // winners share one plane
}

// ---- groups of targets ----------------------------------------------------------------------------------------------

// Groups of targets that the tile passes draw together, assigned greedily: a group is closed when one more target would
// not fit into the shared memory of the smallest tile. Group `ordered` is not drawn in tiles.
template <class Framebuffer>
struct target_groups {
    static constexpr std::size_t count = targets_of<Framebuffer>::count;
    static constexpr int ordered = -1;

    static constexpr std::array<int, count> assign() {
        std::array<int, count> groups{};
        int group = 0, bits = 1, members = 0; // 1: the touched bit
        bool winner = false;
        core::for_each_index<count>([&]<std::size_t K>() {
            using t = typename targets_of<Framebuffer>::template at<K>;
            constexpr blend_method method = method_of<t>();
            if constexpr (method == blend_method::ordered) {
                groups[K] = ordered;
            } else {
                static_assert(bits_per_voxel<t>() + 1 <= tuning::max_bits_per_voxel,
                              "voxelpipe: a render target needs more shared memory than a tile of 8^3 voxels can have");
                const int more = method == blend_method::winner ? (winner ? 0 : 32) : bits_per_voxel<t>();
                if (members > 0 && bits + more > tuning::max_bits_per_voxel) {
                    ++group;
                    bits = 1;
                    members = 0;
                    winner = false;
                }
                bits += method == blend_method::winner ? (winner ? 0 : 32) : bits_per_voxel<t>();
                winner = winner || method == blend_method::winner;
                ++members;
                groups[K] = group;
            }
        });
        return groups;
    }
    static constexpr std::array<int, count> group_of = assign();
    static constexpr int num_groups() {
        int n = 0;
        for (const int g : group_of) n = g + 1 > n ? g + 1 : n;
        return n;
    }
    static constexpr std::size_t size_of(int group) {
        std::size_t n = 0;
        for (const int g : group_of) n += g == group;
        return n;
    }
    static constexpr bool has_ordered = size_of(ordered) != 0;

    template <int Group>
    static constexpr auto members() {
        constexpr std::size_t n = size_of(Group);
        std::array<std::size_t, n> m{};
        std::size_t at = 0;
        for (std::size_t k = 0; k < count; ++k)
            if (group_of[k] == Group) m[at++] = k;
        return m;
    }
    // The members of a group as an index_sequence.
    template <int Group, std::size_t... N>
    static constexpr auto sequence(std::index_sequence<N...>) {
        constexpr auto m = members<Group>();
        return std::index_sequence<m[N]...>{};
    }
    template <int Group>
    using indices = decltype(sequence<Group>(std::make_index_sequence<size_of(Group)>{}));

    // Bits of a voxel in the largest group. The tile size follows from it, because all groups share one coarse pass.
    static constexpr int max_bits() {
        int most = 1;
        for (int g = 0; g < num_groups(); ++g) {
            int bits = 1;
            bool winner = false;
            core::for_each_index<count>([&]<std::size_t K>() {
                using t = typename targets_of<Framebuffer>::template at<K>;
                if (group_of[K] != g) return;
                bits += bits_per_voxel<t>();
                winner = winner || method_of<t>() == blend_method::winner;
            });
            bits += winner ? 32 : 0;
            most = bits > most ? bits : most;
        }
        return most;
    }
};

// ---- one voxel ------------------------------------------------------------------------------------------------------

// Sets or clears one bit of a target, while other threads may change other bits of the word.
template <class Target>
__device__ void store_bit(const target_view<Target>& t, int x, int y, int z, bool v) {
    word* const w = t.elements + Target::map::cell(t.extent, x, y, z);
    const word mask = 1u << (x & 31);
    if (v)
        atomicOr(w, mask);
    else
        atomicAnd(w, ~mask);
}

// Stores a touched voxel of an atomic target.
template <class Target, class Cell>
__device__ void store_cell(const target_view<Target>& view, const voxel_position& at, const Cell& cell) {
    if (view.load == load_operation::off) return;
    const auto stored = view.load == load_operation::clear ? view.clear_value : view(at.x, at.y, at.z);
    view.store(at.x, at.y, at.z,
               value_blend<typename Target::blend_type, typename Target::value_type>::finish(cell, stored));
}

// Stores a touched voxel of a target whose last fragment wins: that fragment's value.
template <class Target, class Value>
__device__ void store_winner(const target_view<Target>& view, const voxel_position& at, const Value& value) {
    if (view.load == load_operation::off) return;
    if constexpr (Target::map::is_bit)
        store_bit(view, at.x, at.y, at.z, value);
    else
        view.store(at.x, at.y, at.z, core::canonical(value));
}

// An occupancy mask is laid out like this target.
using mask_target = target<bit, blend::bit_or>;

} // namespace voxelpipe::device
