// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The words of one tile for a group of render targets: the position of each target's planes, how a fragment is blended
// into them, and how a finished tile is written to the framebuffer. The same layout serves shared memory (fine raster)
// and global memory (images of split tiles).

#include <voxelpipe/device/scene/fragment_shade.cuh>
#include <voxelpipe/device/targets/blend_method.cuh>
#include <voxelpipe/device/targets/target_traits.cuh>
#include <voxelpipe/framebuffer.hpp>

#include <utility>

namespace voxelpipe::device {

// Targets I... of a framebuffer, in one tile of 2^(3 * Log2Size) voxels:
//   planes of the atomic targets, words of the bit targets, the winner plane, one touched bit per voxel.
template <int Log2Size, class Framebuffer, std::size_t... I>
struct tile_image {
    static constexpr int log2_size = Log2Size;
    static constexpr int size = 1 << Log2Size;
    static constexpr int voxels = 1 << (3 * Log2Size);
    static constexpr std::size_t num_targets = sizeof...(I);
    template <std::size_t K>
    using target = typename targets_of<Framebuffer>::template at<K>;

    VOXELPIPE_HD static constexpr int words_of(int bits) { return voxels / 32 * bits; }
    static constexpr bool has_winner = ((method_of<target<I>>() == blend_method::winner) || ...);
    static constexpr bool has_atomic = ((method_of<target<I>>() == blend_method::atomic) || ...);
    static constexpr bool has_bits = ((method_of<target<I>>() == blend_method::bits) || ...);
    static constexpr bool has_only_bits = has_bits && !has_atomic && !has_winner;
    static constexpr int winner_at = (words_of(bits_per_voxel<target<I>>()) + ...);
    static constexpr int touched_at = winner_at + (has_winner ? voxels : 0);
    static constexpr int words = touched_at + voxels / 32;
    static constexpr std::size_t bytes = words * sizeof(word);

    // First word of target K's planes.
    template <std::size_t K>
    VOXELPIPE_HD static constexpr int offset() {
        int at = 0;
        bool before = true;
        ((before = before && I != K, at += before ? words_of(bits_per_voxel<target<I>>()) : 0), ...);
        return at;
    }

    template <class Each>
    __device__ VOXELPIPE_INLINE static void for_each_target(Each&& each) {
        (each.template operator()<I>(), ...);
    }

    // All threads of the block call it; a barrier must follow.
    __device__ static void clear(word* tile) {
        for_each_target([&]<std::size_t K>() {
            using t = target<K>;
            word* const plane = tile + offset<K>();
            if constexpr (method_of<t>() == blend_method::atomic) {
                using blend_type = value_blend<typename t::blend_type, typename t::value_type>;
                for (int i = static_cast<int>(threadIdx.x); i < voxels; i += static_cast<int>(blockDim.x))
                    blend_type::clear(plane, i, voxels);
            } else if constexpr (method_of<t>() == blend_method::bits) {
                for (int i = static_cast<int>(threadIdx.x); i < voxels / 32; i += static_cast<int>(blockDim.x))
                    plane[i] = bit_blend<typename t::blend_type>::neutral;
            }
        });
        for (int i = winner_at + static_cast<int>(threadIdx.x); i < words; i += static_cast<int>(blockDim.x))
            tile[i] = 0;
    }

    // Blends one fragment into voxel i of the tile. The winner plane holds primitive + 1, and 0 without a winner.
    template <class Values>
    __device__ VOXELPIPE_INLINE static void blend(word* tile, int i, std::uint32_t primitive, const Values& values,
                                                  bool track) {
        const word mask = 1u << (i & 31);
        for_each_target([&]<std::size_t K>() {
            using t = target<K>;
            word* const plane = tile + offset<K>();
            if constexpr (method_of<t>() == blend_method::atomic)
                value_blend<typename t::blend_type, typename t::value_type>::accumulate(plane, i, voxels,
                                                                                        voxelpipe::get<K>(values));
            else if constexpr (method_of<t>() == blend_method::bits)
                bit_blend<typename t::blend_type>::accumulate(plane + (i >> 5), mask, voxelpipe::get<K>(values));
        });
        if constexpr (has_winner) atomicMax(tile + winner_at + i, primitive + 1);
        if (track) touch(tile, i >> 5, mask);
    }

    // Blends equal fragments into a row of voxels from i on, a bit for each, all in one word. Targets of bits only.
    template <class Values>
    __device__ VOXELPIPE_INLINE static void blend_row(word* tile, int i, word bits, const Values& values, bool track) {
        const word mask = bits << (i & 31);
        for_each_target([&]<std::size_t K>() {
            using t = target<K>;
            if constexpr (has_only_bits)
                bit_blend<typename t::blend_type>::accumulate(tile + offset<K>() + (i >> 5), mask,
                                                              voxelpipe::get<K>(values));
        });
        if (track) touch(tile, i >> 5, mask);
    }

private:
    __device__ VOXELPIPE_INLINE static void touch(word* tile, int at, word mask) {
        word* const touched = tile + touched_at + at;
        if ((*touched & mask) != mask) atomicOr(touched, mask);
    }
};

// A row of a tile's bits in the framebuffer, 8, 16 or 32 of them: rows of different tiles never share one.
template <int Size>
using bit_row =
    std::conditional_t<Size == 32, std::uint32_t, std::conditional_t<Size == 16, std::uint16_t, std::uint8_t>>;

template <class Image>
[[nodiscard]] __device__ VOXELPIPE_INLINE voxel_position voxel_in_tile(const core::voxel_box& box, int i) {
    constexpr int size = Image::size;
    return {static_cast<int>(box.lo[0]) + i % size, static_cast<int>(box.lo[1]) + i / size % size,
            static_cast<int>(box.lo[2]) + i / (size * size)};
}

template <class Image>
inline constexpr int rows_per_word = 32 / Image::size; // of a tile's bits

// Stores row r of the tile for bit target K; `bits` is the whole word that holds the row.
template <class Image, std::size_t K, class Framebuffer>
__device__ void store_bit_row(const Framebuffer& fb, const core::voxel_box& box, int r, word bits) {
    using t = typename Image::template target<K>;
    using blend_type = bit_blend<typename t::blend_type>;
    constexpr int size = Image::size;
    const auto x0 = static_cast<int>(box.lo[0]), y = static_cast<int>(box.lo[1]) + r % size,
               z = static_cast<int>(box.lo[2]) + r / size;
    const auto& view = voxelpipe::get<K>(fb.targets);
    if (view.load == load_operation::off || y > box.hi[1] || z > box.hi[2]) return;
    word v = bits >> (r % rows_per_word<Image> * size);
    if constexpr (size < 32) v &= (1u << size) - 1;
    if (v == (size < 32 ? blend_type::neutral & ((1u << (size & 31)) - 1) : blend_type::neutral)) return;
    auto* const rows = reinterpret_cast<bit_row<size>*>(view.elements + t::map::cell(view.extent, x0 & ~31, y, z));
    bit_row<size>& stored = rows[(x0 & 31) / size];
    word value = stored;
    blend_type::merge(value, v);
    stored = static_cast<bit_row<size>>(value);
}

// Stores a touched voxel of all targets whose last fragment wins: shades that fragment. winner: its primitive + 1.
template <class Image, class Scene, class Framebuffer>
__device__ void store_winners(const Scene& s, const Framebuffer& fb, const voxel_position& at, word winner) {
    const auto out = shade_fragment(s, winner - 1, at.x, at.y, at.z);
    Image::for_each_target([&]<std::size_t K>() {
        if constexpr (method_of<typename Image::template target<K>>() == blend_method::winner)
            store_winner(voxelpipe::get<K>(fb.targets), at, voxelpipe::get<K>(out.values));
    });
}

// Writes every touched voxel of a tile that is not split from its image in shared memory. Returns how many touched
// voxels this thread found. All threads of the block call it.
template <class Image, class Scene, class Framebuffer>
__device__ std::uint32_t store_tile(const Scene& s, const Framebuffer& fb, const core::voxel_box& box, const word* tile,
                                    bool track) {
    const int first = static_cast<int>(threadIdx.x), step = static_cast<int>(blockDim.x);
    constexpr int size = Image::size;
    std::uint32_t num_touched = 0;
    if (track)
        for (int w = first; w < Image::voxels / 32; w += step)
            num_touched += static_cast<std::uint32_t>(__popc(tile[Image::touched_at + w]));
    if constexpr (Image::has_bits) {
        for (int r = first; r < size * size; r += step)
            Image::for_each_target([&]<std::size_t K>() {
                if constexpr (method_of<typename Image::template target<K>>() == blend_method::bits)
                    store_bit_row<Image, K>(fb, box, r, tile[Image::template offset<K>() + r / rows_per_word<Image>]);
            });
    }
    if constexpr (Image::has_atomic || Image::has_winner) {
        for (int i = first; i < Image::voxels; i += step) {
            if (((tile[Image::touched_at + (i >> 5)] >> (i & 31)) & 1u) == 0) continue;
            const voxel_position at = voxel_in_tile<Image>(box, i);
            Image::for_each_target([&]<std::size_t K>() {
                using t = typename Image::template target<K>;
                if constexpr (method_of<t>() == blend_method::atomic) {
                    using blend_type = value_blend<typename t::blend_type, typename t::value_type>;
                    store_cell(voxelpipe::get<K>(fb.targets), at,
                               blend_type::load(tile + Image::template offset<K>(), i, Image::voxels));
                }
            });
            if constexpr (Image::has_winner) store_winners<Image>(s, fb, at, tile[Image::winner_at + i]);
        }
    }
    return num_touched;
}

} // namespace voxelpipe::device
