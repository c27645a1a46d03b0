// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Runs a call with guessed capacities, and again with larger ones if something did not fit.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/call/capacity_history.hpp>
#include <voxelpipe/device/fragments/order_voxels.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <new>
#include <optional>

namespace voxelpipe::device {

// The counters of a call that succeeded; triangles_in counts every triangle that was looked at.
[[nodiscard]] inline status to_status(const pipeline_state& state) {
    status s;
    s.counts.triangles_nonfinite = state.nonfinite;
    s.counts.triangles_too_far = state.too_far;
    s.counts.triangles_zero_area = state.zero_area;
    s.counts.triangles_outside = state.outside;
    s.counts.triangles_drawn = state.drawn;
    s.counts.triangles_in = state.nonfinite + state.too_far + state.zero_area + state.outside + state.drawn;
    s.counts.fragments = state.fragments;
    s.counts.fragments_discarded = state.discarded;
    s.counts.voxels = state.voxels;
    s.solid.open_rows = state.solid.open_rows;
    s.solid.crossings = state.solid.crossings;
    s.solid.max_winding = state.solid.max_winding;
    return s;
}

// The stage at which a call that failed for a capacity met it.
[[nodiscard]] inline stage find_overflow(const pipeline_state& s, const capacities& c) {
    return s.tile_pairs > c.tile_pairs || s.tile_records > c.tile_records ? stage::coarse_raster
           : misses_deferred(s, c)                                        ? stage::fine_raster
                                                                          : stage::abuffer_emit;
}

// Properties of a call that determine its capacities.
struct call_key {
    std::uint64_t triangles;
    glm::ivec3 extent, offset;
    coverage rule;
    friend bool operator==(const call_key&, const call_key&) = default;
};

// Needs of earlier calls: the four capacities, the number of voxels in their lists, longest_ordered() and
// num_deferred() of their state.
struct call_needs {
    enum index { tile_pairs, tile_records, fragments, fragment_records, list_voxels, longest_ordered, deferred, count };
};
using call_history = core::capacity_history<call_key, call_needs::count>;

// Capacities and guesses that one try of a call is launched with.
struct attempt_guess {
    capacities limits;
    std::uint64_t expected_voxels; // voxels that the lists are likely to have; 0 if unknown
    std::uint64_t num_deferred; // triangles that calls like this one deferred; ~0 if unknown, or if that guess failed
};

// Thrown by a launch: the forced strategy cannot serve the call.
struct strategy_refused {};

// Calls launch(guess, state, clock), which runs the stages with guess.limits and waits, until everything fits. launch
// may change guess.limits, and returns true if it listed fragments that it can do without, in case there are too many.
// `times`: receives the times of the stages if not null. Returns the status of the call.
template <class Launch>
[[nodiscard]] status attempt(call_history& history, const call_key& key, std::uint64_t max_first_fragments,
                             stage_times* times, cudaStream_t stream, const Launch& launch) {
    using need = call_needs;
    status s;
    try {
        std::optional<stage_clock> clock;
        if (times != nullptr) clock.emplace(stream);
        const auto first = tuning::first_capacities(key.triangles);
        call_history::lengths capacity =
            history.guess(key, {first[0], first[1], std::min(first[2], max_first_fragments), first[3], 0, 0, 0});
        const auto longest = history.max_needed(key, need::longest_ordered);
        const auto num_deferred = history.max_needed(key, need::deferred);
        bool missed_deferred = false; // in any try
        for (int tries = 0;; ++tries) {
            attempt_guess guess{{capacity[need::tile_pairs], capacity[need::tile_records], capacity[need::fragments],
                                 capacity[need::fragment_records]},
                                capacity[need::list_voxels],
                                tries == 0 && num_deferred ? *num_deferred : ~std::uint64_t{0}};
            capacities& limits = guess.limits;
            if (tries == 0 && longest) limits.longest_ordered = expected_longest(*longest);
            pipeline_state state{};
            const bool need_not_list = launch(guess, state, clock ? &*clock : nullptr);
            missed_deferred = missed_deferred || misses_deferred(state, limits);
            if (state.index_error != 0) {
                s = core::failure(status_code::index_out_of_range, stage::coarse_raster);
                break;
            }
            const call_history::lengths needed{state.tile_pairs,
                                               state.tile_records,
                                               state.list_fragments + state.filtered,
                                               state.fragment_records,
                                               state.list_voxels,
                                               state.longest_ordered(),
                                               missed_deferred ? ~std::uint64_t{0}
                                                               : state.deferred.num_deferred(key.rule)};
            if (!has_failed(state, limits)) {
                s = to_status(state);
                history.fitted(key, needed);
                break;
            }
            // A pass whose records overflowed has not counted all of its cells, so that the second try may fail too.
            if (tries == 4 || needed[need::tile_pairs] > core::max_numbered ||
                (needed[need::fragments] > core::max_numbered && !need_not_list)) {
                s = core::failure(status_code::out_of_memory, find_overflow(state, limits));
                s.required = {state.tile_pairs, state.list_fragments, 0};
                break;
            }
            history.raise(capacity, needed);
        }
        if (clock) clock->read(*times);
    } catch (const cuda_failure& e) {
        s = to_status(e);
    } catch (const std::bad_alloc&) {
        s = core::failure(status_code::out_of_memory);
    } catch (const strategy_refused&) {
        s = core::failure(status_code::strategy_unavailable);
    }
    s.counts.triangles_in = key.triangles;
    return s;
}

} // namespace voxelpipe::device
