// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The library's stage times in the statistics of a run.

#include "voxelizer.hpp"

#include <voxelpipe/stage_times.hpp>

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {

// Puts the library's stages, without those named in `absent`, in the place of their sum, "voxelize". `rest`: what the
// sum holds beside them; empty where that is nothing to show.
inline void show_stages(voxelize_stats& stats, const voxelpipe::stage_times& times,
                        std::span<const std::string_view> absent, const std::string& rest) {
    std::vector<std::pair<std::string, double>> stages;
    for (auto& [name, time] : stats.milliseconds) {
        if (name != "voxelize") {
            stages.emplace_back(name, time);
            continue;
        }
        for (const auto& [stage, field] : voxelpipe::stage_time_fields)
            if (std::find(absent.begin(), absent.end(), stage) == absent.end())
                stages.emplace_back(stage, times.*field);
        if (!rest.empty()) stages.emplace_back(rest, std::max(0.0, time - voxelpipe::sum_of(times)));
    }
    stats.milliseconds = std::move(stages);
}

} // namespace voxelize
