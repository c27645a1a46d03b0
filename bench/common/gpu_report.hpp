// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The GPU table without a GPU: which cells there are, what is published for each, and how measured times become rows,
// ratios and means.

#include "statistics.hpp"
#include "table.hpp"

#include <voxelpipe/stage_times.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace bench {

enum class gpu_cell : std::uint8_t {
    bit_conservative,
    bit_thin,
    bit_counted_conservative,         // with count_voxels, the default, which no published figure includes
    float_replace_conservative,       // by a constant
    float_add_conservative,           // reproducible sum of a constant
    float_add_unordered_conservative, // plain additions of a constant
    float_add_varying_conservative,   // reproducible sum of an interpolated value: no short cut for constants
    // The same into framebuffers that track their changes.
    float_replace_tracked_conservative,
    float_add_tracked_conservative,
    float_add_varying_tracked_conservative,
    abuffer_thin,
    abuffer_conservative,
};
inline constexpr std::array<gpu_cell, 12> gpu_cells{
    gpu_cell::bit_conservative,
    gpu_cell::bit_thin,
    gpu_cell::bit_counted_conservative,
    gpu_cell::float_replace_conservative,
    gpu_cell::float_add_conservative,
    gpu_cell::float_add_unordered_conservative,
    gpu_cell::float_add_varying_conservative,
    gpu_cell::float_replace_tracked_conservative,
    gpu_cell::float_add_tracked_conservative,
    gpu_cell::float_add_varying_tracked_conservative,
    gpu_cell::abuffer_thin,
    gpu_cell::abuffer_conservative,
};

[[nodiscard]] std::string_view name_of(gpu_cell cell); // e.g. "bit_conservative"
[[nodiscard]] bool parse(std::string_view name, gpu_cell& cell);
[[nodiscard]] bool is_thin(gpu_cell cell);
[[nodiscard]] bool is_abuffer(gpu_cell cell);
[[nodiscard]] bool is_bit(gpu_cell cell);
// The same cell where nothing is tracked.
[[nodiscard]] gpu_cell untracked(gpu_cell cell);
[[nodiscard]] inline bool is_tracked(gpu_cell cell) { return untracked(cell) != cell; }

// The published figures of a scene's cell; 0 or empty if there are none. target: never under 1.3 x the published floor.
struct gpu_anchor {
    double original = 0; // 2011
    double peer = 0;
    std::string_view peer_name;
    double floor = 0;
    double target = 0;
    double paper = 0;
    [[nodiscard]] double fastest() const;
};
// Tracked, varying and unordered sums stand beside the one float figure of 2011.
[[nodiscard]] gpu_anchor published_anchor(std::string_view scene, int resolution, gpu_cell cell);

// Bytes that a call writes whatever it draws, the framebuffer of a cube of n^3 voxels; 0 for an A-buffer, and for one
// that tracks its changes.
[[nodiscard]] std::uint64_t framebuffer_bytes(gpu_cell cell, int n);

struct gpu_row {
    std::string scene;
    int resolution = 0;
    gpu_cell cell{};
    std::uint64_t triangles = 0, fragments = 0;
    sample whole, async, baseline; // runs = 0 where there is none
    double floor_ms = 0;           // measured in the same run
    voxelpipe::stage_times stages; // medians of calls of their own; all 0 where they were not asked for
    gpu_anchor published;
    std::string failure; // what went wrong; then there are no times

    [[nodiscard]] double ahead_of_fastest() const;       // fastest anchor / ours; 0 where there is none
    [[nodiscard]] double async_ahead_of_fastest() const; // the same of voxelize_async
    [[nodiscard]] double ahead_of_baseline() const;
    [[nodiscard]] double of_target() const; // target / ours: 1 or more has reached it
    [[nodiscard]] double times_floor() const;
};

// Every column, in milliseconds with quartiles and extremes.
[[nodiscard]] table gpu_table_all(const std::vector<gpu_row>& rows);
// The report for people.
[[nodiscard]] table gpu_table_short(const std::vector<gpu_row>& rows);
// Milliseconds of every stage beside the whole call's, in a column each; rows that have them.
[[nodiscard]] table gpu_stage_table(const std::vector<gpu_row>& rows);
// A line a kind of cell, one for the cells with a target of their own, and one for all with an anchor.
[[nodiscard]] table gpu_means(const std::vector<gpu_row>& rows);

} // namespace bench
