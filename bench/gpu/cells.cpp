// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"

#include <string>
#include <vector>

namespace bench::gpu {

std::unique_ptr<prepared_cell> prepare(session& s, const resident_mesh& mesh, const vp::grid& grid, gpu_cell cell) {
    const vp::coverage rule = is_thin(cell) ? vp::coverage::thin : vp::coverage::conservative;
    const bool tracks = is_tracked(cell);
    switch (untracked(cell)) {
    case gpu_cell::bit_conservative:
    case gpu_cell::bit_thin:
        return make_bits(s, mesh, grid, rule, false);
    case gpu_cell::bit_counted_conservative:
        return make_bits(s, mesh, grid, rule, true);
    case gpu_cell::float_replace_conservative:
        return make_float_replace(s, mesh, grid, rule, tracks);
    case gpu_cell::float_add_conservative:
        return make_float_add(s, mesh, grid, rule, tracks);
    case gpu_cell::float_add_unordered_conservative:
        return make_float_add_unordered(s, mesh, grid, rule);
    case gpu_cell::float_add_varying_conservative:
        return make_float_add_varying(s, mesh, grid, rule, tracks);
    case gpu_cell::abuffer_thin:
    case gpu_cell::abuffer_conservative:
        return make_abuffer(s, mesh, grid, rule);
    default:
        break;
    }
    throw std::invalid_argument("no such cell");
}

namespace {

vp::stage_times time_stages(prepared_cell& cell, int runs) {
    std::vector<vp::stage_times> all(static_cast<std::size_t>(runs));
    for (vp::stage_times& times : all) {
        cell.set_times(&times);
        (void)cell.call();
    }
    cell.set_times(nullptr);
    vp::stage_times medians;
    for (const auto& [name, field] : vp::stage_time_fields) {
        std::vector<double> values;
        for (const vp::stage_times& times : all) values.push_back(times.*field);
        medians.*field = summarize(std::move(values)).median;
    }
    return medians;
}

} // namespace

cell_times time_cell(const session& s, prepared_cell& cell, const cell_choice& how) {
    cell_times t;
    const bool compare = how.baseline && cell.prepare_baseline();
    if (compare) cell.call_baseline();
    const auto must_agree = [&](const char* form) {
        if (!compare) return;
        if (const std::uint64_t n = cell.differences(); n != 0)
            throw std::runtime_error(std::string(form) + " differs from the baseline in " + std::to_string(n) +
                                     " words");
    };
    t.whole = time_calls(s, how.repeat, [&] { t.counts = cell.call(); });
    must_agree("voxelize");
    if (how.async && cell.prepare_async()) {
        const captured_call captured(s, [&] { cell.call_async(); });
        t.async = time_calls(s, how.repeat, [&] { captured.launch(); });
        must_agree("voxelize_async");
        if (const std::uint64_t n = cell.async_differences(); n != 0)
            throw std::runtime_error("voxelize_async differs from voxelize in " + std::to_string(n) + " words");
    }
    if (how.stage_runs > 0) {
        t.stages = time_stages(cell, how.stage_runs);
        must_agree("voxelize with stage times");
    }
    if (compare) {
        repetition repeat = how.repeat;
        repeat.seconds = how.baseline_seconds;
        t.baseline = time_calls(s, repeat, [&] { cell.call_baseline(); });
    }
    return t;
}

} // namespace bench::gpu
