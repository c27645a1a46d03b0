// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How a framebuffer call is drawn. A call has one strategy, chosen once by the table `rules` below from what the host
// knows of the call (call_facts). All strategies give identical bits; they differ in time and memory.
// docs/pipeline.md has a diagram for each.
//
// An A-buffer call has no strategy: its fragments are listed and sorted (call/abuffer_call.cuh).

#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// How cuda_backend draws. All strategies give the same bits.
enum class strategy : std::uint32_t {
    automatic, // the first rule that applies
    // Sets a bit for each touched voxel in memory of the call, then fills all targets from these bits. Writes no target
    // before all triangles have been drawn.
    occupancy_mask,
    // Blends each fragment into the targets where they lie, by atomics. A target whose blend has no atomic of its own
    // holds the number of fragments meanwhile, and a last pass turns numbers into values.
    immediate,
    // Lists (voxel, primitive) pairs, sorts them by voxel, then shades and blends the run of each voxel in any order.
    sorted_reduce,
    // The same with pairs in triangle order, folded in it: for blends that depend on the order.
    sorted_fold,
    // The pipeline of the paper: coarse raster, tile sort, tile split, fine raster in shared memory, tile resolve
    // (section 4). Takes any call.
    tiled,
};

[[nodiscard]] constexpr const char* to_string(strategy s) {
    switch (s) {
    case strategy::automatic:
        return "automatic";
    case strategy::occupancy_mask:
        return "occupancy_mask";
    case strategy::immediate:
        return "immediate";
    case strategy::sorted_reduce:
        return "sorted_reduce";
    case strategy::sorted_fold:
        return "sorted_fold";
    case strategy::tiled:
        return "tiled";
    }
    return "unknown";
}

// The chosen strategy, and the rule that chose it in words.
struct strategy_choice {
    strategy value = strategy::automatic; // never automatic after a call
    const char* why = "no call yet";      // static memory
};

namespace device {

// The strategies that a program's types allow: only these are instantiated. `tiled` always is.
struct possible_strategies {
    bool occupancy_mask = false; // a constant shader, and blends that give the same for one fragment as for many
    bool immediate = false;      // a constant shader, and targets that are blended or counted where they lie
    bool sorted_reduce = false;  // blends in any order, but for a constant in bits alone
    bool sorted_fold = false;    // some blend depends on it
};

// Properties of a call that are known before its launch.
struct call_facts {
    possible_strategies possible;
    std::size_t num_draws = 1;
    std::uint64_t num_triangles = 0;
    std::uint64_t num_voxels = 0;        // of the grid
    std::uint64_t mask_bytes = 0;        // of an occupancy mask
    std::uint64_t fragment_capacity = 0; // fragments that the lists hold
    bool fits_int32 = false;             // the raster of 32 bits serves grid, mesh and coverage (int32_triangle)
    bool fits_in_passes = false;         // it does in passes of some instances, which lists cannot take
    bool all_draws_equal = false;        // constant shaders: each draw gives the same values
    bool blends_in_place = false;        // every target is blended or counted where it lies, for these values
    bool counts_are_cheap = false;       // and reading the counted ones costs less than tiles would
    bool counts_voxels = false;          // the status reports how many voxels were touched
    bool clears_values = false;          // some target of values is cleared, and so written from end to end anyway
    bool has_checked_indices = false;    // no draw's indices need a pass that looks at them
    bool may_list = true;                // there is memory for lists of fragments
};

// Fragments whose runs the passes over sorted lists number.
inline constexpr std::uint64_t max_sorted_fragments = std::uint64_t{1} << 28;
// Voxel ids of lists have 32 bits.
inline constexpr std::uint64_t max_listed_voxels = 0xffffffffu;

// ---- can it? --------------------------------------------------------------------------------------------------------

[[nodiscard]] constexpr bool can_use_mask(const call_facts& f) {
    return f.possible.occupancy_mask && f.all_draws_equal && (f.fits_int32 || f.fits_in_passes) &&
           f.num_draws <= tuning::max_raster_draws && f.mask_bytes <= tuning::max_mask_bytes;
}
[[nodiscard]] constexpr bool can_use_immediate(const call_facts& f) {
    return f.possible.immediate && f.blends_in_place && (f.fits_int32 || f.fits_in_passes) &&
           f.num_draws <= tuning::max_raster_draws;
}
[[nodiscard]] constexpr bool can_list(const call_facts& f) {
    return f.may_list && f.fits_int32 && f.num_draws <= tuning::max_raster_draws && f.num_voxels < max_listed_voxels &&
           f.fragment_capacity <= max_sorted_fragments;
}
[[nodiscard]] constexpr bool can_use_reduce(const call_facts& f) { return f.possible.sorted_reduce && can_list(f); }
[[nodiscard]] constexpr bool can_use_fold(const call_facts& f) { return f.possible.sorted_fold && can_list(f); }
[[nodiscard]] constexpr bool always(const call_facts&) { return true; }

// ---- does it pay? ---------------------------------------------------------------------------------------------------

[[nodiscard]] constexpr bool use_immediate(const call_facts& f) { return can_use_immediate(f) && f.counts_are_cheap; }
[[nodiscard]] constexpr bool use_mask(const call_facts& f) {
    if (!can_use_mask(f)) return false;
    if (!use_immediate(f)) return true;
    if (f.mask_bytes > tuning::max_mask_bytes_in_place) return false;
    return f.counts_voxels || f.clears_values ||
           (!f.has_checked_indices &&
            f.mask_bytes <= tuning::min_mask_bytes + f.num_triangles * tuning::mask_bytes_per_triangle);
}

struct strategy_rule {
    strategy value;
    const char* when;                       // what `applies` asks for, in words
    bool (*applies)(const call_facts& f);   // the strategy serves the call, and pays
    bool (*can_serve)(const call_facts& f); // it serves the call: so that it may be forced
};
inline constexpr strategy_rule rules[] = {
    // The first that applies.
    {strategy::occupancy_mask, "constant shader, blends that ignore repeats, a mask that pays", use_mask, can_use_mask},
    {strategy::immediate, "constant shader, every target blended or counted in place", use_immediate,
     can_use_immediate},
    {strategy::sorted_reduce, "blends in any order, room for lists of fragments", can_use_reduce, can_use_reduce},
    {strategy::sorted_fold, "a blend in triangle order, room for lists of fragments", can_use_fold, can_use_fold},
    {strategy::tiled, "everything else", always, always},
};

// The rule that a call follows: the first that applies, or that of a forced strategy. Null if the forced strategy
// cannot serve the call.
[[nodiscard]] constexpr const strategy_rule* choose_rule(const call_facts& f, strategy forced) {
    for (const strategy_rule& rule : rules)
        if (forced == strategy::automatic ? rule.applies(f) : rule.value == forced && rule.can_serve(f)) return &rule;
    return nullptr;
}

} // namespace device
} // namespace voxelpipe
