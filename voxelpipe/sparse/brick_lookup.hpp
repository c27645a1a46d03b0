// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Finds bricks by a hash of their keys, in one or two reads instead of the log2(bricks) of brick_table::find_brick.
// Tiles are bisected. Slots hold numbers of bricks, by linear probing; at least half of them are free. Host and device
// read them alike.

#include <voxelpipe/core/brick_table.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

namespace voxelpipe {

namespace core {
// Names the call by which a backend fills the slots: run_module(brick_slots_tag, backend, table, slots, log2 of their
// number), which argument-dependent lookup finds by the tag.
struct brick_slots_tag {};
} // namespace core

// Refers to slots that someone else owns, made for the table that is passed.
struct brick_lookup {
    static constexpr std::uint32_t free_slot = ~std::uint32_t{0}; // marks a slot without a brick

    const std::uint32_t* slots = nullptr; // numbers of bricks, in the backend's memory
    int log2_slots = 0;                   // there are 2^log2_slots of them

    // For fewer than 2^31 bricks.
    [[nodiscard]] static int log2_slots_for(std::uint64_t bricks) {
        return static_cast<int>(std::bit_width(bricks == 0 ? 1 : 2 * bricks - 1));
    }
    // The slot at which the search for a brick's key begins.
    [[nodiscard]] VOXELPIPE_HD static std::uint64_t first_slot(std::uint64_t key, int log2_slots) {
        return key * 0x9e3779b97f4a7c15u >> (64 - log2_slots);
    }

    // The number of the brick with this key; brick_table::none if it does not exist.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find_brick(const brick_table& table, std::uint64_t key) const {
        const std::uint64_t last = (std::uint64_t{1} << log2_slots) - 1;
        for (std::uint64_t at = first_slot(key, log2_slots);; at = (at + 1) & last) {
            const std::uint32_t brick = slots[at];
            if (brick == free_slot) return brick_table::none;
            if (table.keys[brick] == key) return brick;
        }
    }
    // As brick_table::find.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find(const brick_table& table, const glm::ivec3& voxel) const {
        if (!table.is_in_part(voxel)) return brick_table::none;
        const std::uint64_t key = core::morton_key(voxel + table.offset), of_brick = key / core::sparse_brick_voxels;
        const std::uint64_t brick = find_brick(table, of_brick);
        return brick == brick_table::none ? table.rank_of_tile(of_brick) : table.rank_of(brick, key);
    }
};

namespace core {

// Puts a brick into slots that are free at first, by one thread.
inline void insert_brick(std::uint32_t* slots, int log2_slots, std::uint64_t key, std::uint32_t brick) {
    const std::uint64_t last = (std::uint64_t{1} << log2_slots) - 1;
    std::uint64_t at = brick_lookup::first_slot(key, log2_slots);
    while (slots[at] != brick_lookup::free_slot) at = (at + 1) & last;
    slots[at] = brick;
}

} // namespace core

// Owns the slots for the bricks that a sparse framebuffer has now, in the memory of its backend; the framebuffer's next
// call makes them stale. Throws std::length_error beyond 2^31 - 1 bricks, and what a buffer throws.
template <class Backend>
class brick_slots {
public:
    // Fills the slots on the backend.
    template <class Framebuffer>
    brick_slots(Backend& backend, const Framebuffer& fb)
        : log2_slots_(brick_lookup::log2_slots_for(checked(fb.num_bricks()))),
          slots_(backend, std::size_t{1} << log2_slots_) {
        run_module(core::brick_slots_tag{}, backend, fb.view().table, slots_.data(), log2_slots_);
    }
    // Refers to the slots.
    [[nodiscard]] brick_lookup lookup() const { return {slots_.data(), log2_slots_}; }

private:
    static std::uint64_t checked(std::uint64_t bricks) {
        if (bricks >> 31 != 0) throw std::length_error("voxelpipe: a lookup holds 2^31 - 1 bricks at most");
        return bricks;
    }
    int log2_slots_;
    typename Backend::template buffer<std::uint32_t> slots_;
};
template <class Backend, class Framebuffer>
brick_slots(Backend&, const Framebuffer&) -> brick_slots<Backend>;

} // namespace voxelpipe
