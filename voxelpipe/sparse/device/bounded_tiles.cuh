// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tiles that stay in a call which never waits: what its bricks leave of the tiles that it goes on from, in memory of
// the caller.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/sparse/device/bounded_bricks.cuh>
#include <voxelpipe/sparse/passes/kept_tiles.hpp>

#include <cstdint>

namespace voxelpipe::device {

// Lists tiles where there is room for them.
struct list_bounded_tiles {
    core::list_kept_tiles list;
    const sparse_counts* made;
    __device__ void operator()(std::uint64_t i) const {
        if (made->tiles != 0) list(i);
    }
};
// The tiles of a result, and brick_tile::none() behind the last.
struct end_bounded_tiles {
    const std::uint64_t* bits; // brick_tile::bits
    const sparse_counts* made;
    brick_tile* tiles;
    __device__ void operator()(std::uint64_t i) const {
        tiles[i] = i < made->tiles ? brick_tile{bits[i]} : brick_tile::none();
    }
};

// The tiles of `before` that are left, room.bricks at most. Nothing is taken or launched if `before` can have none.
template <int = 0> // so that programs that do not call it compile no kernels
class bounded_kept_tiles {
public:
    bounded_kept_tiles(const brick_table& before, const brick_room& room, arena& memory)
        : before_(before), room_(room.bricks) {
        if (is_empty()) return;
        counts_ = memory.take<std::uint32_t>(num_places() + 1);
        first_ = memory.take<unsigned long long>(num_places() + 1);
        storage_ = memory.take<std::byte>(cell_scan_bytes(static_cast<std::uint32_t>(num_places() + 1)));
        bits_ = memory.take<std::uint64_t>(room_);
        sources_ = memory.take<std::uint32_t>(room_);
        tiles_ = memory.take<brick_tile>(room_);
    }
    [[nodiscard]] bool is_empty() const { return before_.num_tiles == 0; }
    // As many tiles as are counted and listed below: those of `before` and those of this call.
    [[nodiscard]] std::uint64_t num_places() const { return before_.num_tiles + room_; }
    [[nodiscard]] const brick_tile* tiles() const { return is_empty() ? nullptr : tiles_; }
    [[nodiscard]] std::uint64_t capacity() const { return is_empty() ? 0 : room_; }
    // On the device: how many tiles there are, or would be. Null if there can be none.
    [[nodiscard]] const unsigned long long* total() const { return is_empty() ? nullptr : first_ + num_places(); }

    // keys: of all bricks of the result, ~0 behind the last.
    void count(const std::uint64_t* keys, cudaStream_t stream) const {
        if (is_empty()) return;
        const auto n = static_cast<std::uint32_t>(num_places() + 1);
        for_each(n, core::list_kept_tiles{before_.tiles, before_.num_tiles, keys, room_, counts_}, where, stream);
        sum_counts(counts_, first_, n, storage_, cell_scan_bytes(n), where, stream);
    }
    // After the result has been published.
    void list(const std::uint64_t* keys, const sparse_counts* made, cudaStream_t stream) const {
        if (is_empty()) return;
        static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));
        const core::list_kept_tiles list{
            before_.tiles, before_.num_tiles, keys, room_, nullptr, reinterpret_cast<const std::uint64_t*>(first_),
            bits_,         sources_};
        for_each(num_places(), list_bounded_tiles{list, made}, where, stream);
        for_each(room_, end_bounded_tiles{bits_, made, tiles_}, where, stream);
    }
    // Writes the values of the tiles, behind those of the voxels, and their sums; null where these are not kept. Words
    // of bits are zero behind these.
    template <class Target>
    void store(const typename core::rank_map<Target>::element* before, typename core::rank_map<Target>::element* values,
               core::kept_sum<Target>* sums, bool is_loaded, const typename Target::value_type& background,
               const sparse_counts* made, cudaStream_t stream) const;

private:
    static constexpr stage where = stage::tile_resolve;
    brick_table before_;
    std::uint64_t room_;
    std::uint32_t* counts_ = nullptr;
    unsigned long long* first_ = nullptr; // of each place, and behind the last their number
    std::byte* storage_ = nullptr;
    std::uint64_t* bits_ = nullptr;
    std::uint32_t* sources_ = nullptr;
    brick_tile* tiles_ = nullptr;
};

// keep_tile_values, where only the device knows how many there are.
template <class Target>
struct store_bounded_tiles {
    core::keep_tile_values<Target> keep;
    brick_table before;
    const sparse_counts* made;
    __device__ void operator()(std::uint64_t i) const {
        core::keep_tile_values<Target> k = keep;
        k.first_before = before.num_in_bricks();
        k.first = made->voxels;
        k.count = made->tiles;
        if (k.count != 0 && i < k.num_calls()) k(i);
    }
};

template <int N>
template <class Target>
void bounded_kept_tiles<N>::store(const typename core::rank_map<Target>::element* before,
                                  typename core::rank_map<Target>::element* values, core::kept_sum<Target>* sums,
                                  bool is_loaded, const typename Target::value_type& background,
                                  const sparse_counts* made, cudaStream_t stream) const {
    if (is_empty()) return;
    const core::keep_tile_values<Target> keep{before, 0, sources_, 0, values, sums, 0, is_loaded, background};
    // A word of bits more than tiles could fill.
    for_each(room_ + 1, store_bounded_tiles<Target>{keep, before_, made}, where, stream);
}

} // namespace voxelpipe::device
