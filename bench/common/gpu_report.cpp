// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "gpu_report.hpp"

#include "published_gpu_figures.hpp"

#include <algorithm>

namespace bench {

namespace {

constexpr std::array<std::string_view, gpu_cells.size()> names{
    "bit_conservative",
    "bit_thin",
    "bit_counted_conservative",
    "float_replace_conservative",
    "float_add_conservative",
    "float_add_unordered_conservative",
    "float_add_varying_conservative",
    "float_replace_tracked_conservative",
    "float_add_tracked_conservative",
    "float_add_varying_tracked_conservative",
    "abuffer_thin",
    "abuffer_conservative",
};

std::string ms(double value) { return value > 0 ? significant(value, 4) : ""; }
std::string ratio(double value) { return value > 0 ? significant(value, 3) : ""; }
std::string short_ms(double value) { return value > 0 ? significant(value, 3) : "-"; }
std::string times(double value) { return value > 0 ? significant(value, 3) + " ×" : "-"; }

// Takes the values above 0 only, since 0 is no figure; 0 if there are none.
double min_of(const std::vector<double>& values) {
    double least = 0;
    for (const double v : values)
        if (v > 0 && (least == 0 || v < least)) least = v;
    return least;
}

double divide(double a, double b) { return a > 0 && b > 0 ? a / b : 0; }

} // namespace

std::string_view name_of(gpu_cell cell) { return names[static_cast<std::size_t>(cell)]; }

bool parse(std::string_view name, gpu_cell& cell) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return false;
    cell = gpu_cells[static_cast<std::size_t>(found - names.begin())];
    return true;
}

bool is_thin(gpu_cell cell) { return cell == gpu_cell::bit_thin || cell == gpu_cell::abuffer_thin; }
bool is_abuffer(gpu_cell cell) { return cell == gpu_cell::abuffer_thin || cell == gpu_cell::abuffer_conservative; }
bool is_bit(gpu_cell cell) {
    return cell == gpu_cell::bit_conservative || cell == gpu_cell::bit_thin ||
           cell == gpu_cell::bit_counted_conservative;
}

gpu_cell untracked(gpu_cell cell) {
    switch (cell) {
    case gpu_cell::float_replace_tracked_conservative:
        return gpu_cell::float_replace_conservative;
    case gpu_cell::float_add_tracked_conservative:
        return gpu_cell::float_add_conservative;
    case gpu_cell::float_add_varying_tracked_conservative:
        return gpu_cell::float_add_varying_conservative;
    default:
        return cell;
    }
}

double gpu_anchor::fastest() const {
    if (original > 0 && peer > 0) return std::min(original, peer);
    return original > 0 ? original : peer;
}

gpu_anchor published_anchor(std::string_view scene, int resolution, gpu_cell cell) {
    const auto p =
        std::find_if(published_gpu_scenes.begin(), published_gpu_scenes.end(),
                     [&](const published_gpu_scene& s) { return s.scene == scene && s.resolution == resolution; });
    if (p == published_gpu_scenes.end()) return {};
    gpu_anchor a;
    switch (untracked(cell)) {
    case gpu_cell::bit_conservative:
        a = {p->original_bit, p->peer_bit, p->peer, p->floor_bit, p->target_bit, p->paper_bit};
        break;
    case gpu_cell::bit_thin:
        a = {p->original_bit_thin, 0, {}, p->floor_bit, p->target_bit_thin, 0};
        break;
    case gpu_cell::float_add_conservative:
    case gpu_cell::float_add_unordered_conservative:
    case gpu_cell::float_add_varying_conservative:
        a = {p->original_float, 0, {}, p->floor_float, p->target_float, p->paper_float};
        break;
    case gpu_cell::abuffer_thin:
        a = {p->original_abuffer, 0, {}, p->floor_abuffer, p->target_abuffer, p->paper_abuffer};
        break;
    case gpu_cell::bit_counted_conservative:
    case gpu_cell::float_replace_conservative:
    case gpu_cell::abuffer_conservative:
    default:
        return {};
    }
    a.target = std::max(a.target, 1.3 * a.floor);
    return a;
}

std::uint64_t framebuffer_bytes(gpu_cell cell, int n) {
    const auto side = static_cast<std::uint64_t>(n);
    if (is_abuffer(cell) || is_tracked(cell)) return 0;
    return is_bit(cell) ? (side + 31) / 32 * 4 * side * side : 4 * side * side * side;
}

double gpu_row::ahead_of_fastest() const { return divide(published.fastest(), whole.median); }
double gpu_row::async_ahead_of_fastest() const { return divide(published.fastest(), async.median); }
double gpu_row::ahead_of_baseline() const { return divide(baseline.median, whole.median); }
double gpu_row::of_target() const { return divide(published.target, whole.median); }
double gpu_row::times_floor() const { return divide(whole.median, floor_ms); }

table gpu_table_all(const std::vector<gpu_row>& rows) {
    table t({"scene",
             "resolution",
             "cell",
             "triangles",
             "fragments",
             "ms",
             "ms_q1",
             "ms_q3",
             "ms_min",
             "ms_max",
             "runs",
             "async_ms",
             "async_q1",
             "async_q3",
             "baseline_ms",
             "floor_ms",
             "original_ms",
             "peer_ms",
             "peer",
             "target_ms",
             "paper_ms",
             "fastest_over_ms",
             "fastest_over_async_ms",
             "ms_over_floor",
             "target_over_ms",
             "baseline_over_ms",
             "fragments_per_us",
             "failure"});
    for (const gpu_row& r : rows)
        t.add_row({r.scene,
                   std::to_string(r.resolution),
                   std::string(name_of(r.cell)),
                   std::to_string(r.triangles),
                   std::to_string(r.fragments),
                   ms(r.whole.median),
                   ms(r.whole.low_quartile),
                   ms(r.whole.high_quartile),
                   ms(r.whole.least),
                   ms(r.whole.most),
                   std::to_string(r.whole.runs),
                   ms(r.async.median),
                   ms(r.async.low_quartile),
                   ms(r.async.high_quartile),
                   ms(r.baseline.median),
                   ms(r.floor_ms),
                   ms(r.published.original),
                   ms(r.published.peer),
                   std::string(r.published.peer_name),
                   ms(r.published.target),
                   ms(r.published.paper),
                   ratio(r.ahead_of_fastest()),
                   ratio(r.async_ahead_of_fastest()),
                   ratio(r.times_floor()),
                   ratio(r.of_target()),
                   ratio(r.ahead_of_baseline()),
                   ratio(divide(static_cast<double>(r.fragments) * 1e-3, r.whole.median)),
                   r.failure});
    return t;
}

table gpu_table_short(const std::vector<gpu_row>& rows) {
    table t({"scene", "N", "cell", "fragments", "ours, ms", "quartiles", "async, ms", "baseline, ms", "floor, ms",
             "2011, ms", "peer, ms", "target, ms", "ahead of the fastest", "async ahead", "target / ours",
             "ours / floor"});
    for (const gpu_row& r : rows) {
        if (!r.failure.empty()) {
            t.add_row({r.scene, std::to_string(r.resolution), std::string(name_of(r.cell)), "", r.failure});
            continue;
        }
        t.add_row({r.scene, std::to_string(r.resolution), std::string(name_of(r.cell)), std::to_string(r.fragments),
                   short_ms(r.whole.median), short_ms(r.whole.low_quartile) + "–" + short_ms(r.whole.high_quartile),
                   short_ms(r.async.median), short_ms(r.baseline.median), short_ms(r.floor_ms),
                   short_ms(r.published.original), short_ms(r.published.peer), short_ms(r.published.target),
                   times(r.ahead_of_fastest()), times(r.async_ahead_of_fastest()), times(r.of_target()),
                   times(r.times_floor())});
    }
    return t;
}

table gpu_stage_table(const std::vector<gpu_row>& rows) {
    std::vector<std::string> columns{"scene", "resolution", "cell"};
    for (const auto& [name, field] : voxelpipe::stage_time_fields) columns.emplace_back(name);
    columns.insert(columns.end(), {"all stages", "call"});
    table t(columns);
    for (const gpu_row& r : rows) {
        const double sum = voxelpipe::sum_of(r.stages);
        if (sum <= 0) continue;
        std::vector<std::string> cells{r.scene, std::to_string(r.resolution), std::string(name_of(r.cell))};
        for (const auto& [name, field] : voxelpipe::stage_time_fields) cells.push_back(ms(r.stages.*field));
        cells.push_back(ms(sum));
        cells.push_back(ms(r.whole.median));
        t.add_row(std::move(cells));
    }
    return t;
}

table gpu_means(const std::vector<gpu_row>& rows) {
    table t({"cells", "number", "ahead of the fastest", "least of it", "at 1.5 × or more", "at the target",
             "async ahead", "least of it", "at 1.5 × or more", "ahead of the baseline", "ours / floor"});
    const auto line = [&](const std::string& name, const auto& belongs) {
        std::vector<double> fastest, async, baseline, floors;
        int cells = 0, target = 0;
        for (const gpu_row& r : rows) {
            if (!belongs(r) || r.whole.runs == 0) continue;
            ++cells;
            fastest.push_back(r.ahead_of_fastest());
            async.push_back(r.async_ahead_of_fastest());
            baseline.push_back(r.ahead_of_baseline());
            floors.push_back(r.times_floor());
            target += r.of_target() >= 1;
        }
        if (cells == 0) return;
        const auto at_least_goal = [](const std::vector<double>& ahead) {
            return min_of(ahead) > 0
                       ? std::to_string(std::count_if(ahead.begin(), ahead.end(), [](double a) { return a >= 1.5; }))
                       : "-";
        };
        t.add_row({name, std::to_string(cells), times(geometric_mean(fastest)), times(min_of(fastest)),
                   at_least_goal(fastest), min_of(fastest) > 0 ? std::to_string(target) : "-",
                   times(geometric_mean(async)), times(min_of(async)), at_least_goal(async),
                   times(geometric_mean(baseline)), times(geometric_mean(floors))});
    };
    for (const gpu_cell cell : gpu_cells)
        line(std::string(name_of(cell)), [&](const gpu_row& r) { return r.cell == cell; });
    line("all with a figure of their own", [](const gpu_row& r) {
        return r.published.fastest() > 0 && !is_tracked(r.cell) &&
               r.cell != gpu_cell::float_add_unordered_conservative &&
               r.cell != gpu_cell::float_add_varying_conservative;
    });
    line("all with a figure", [](const gpu_row& r) { return r.published.fastest() > 0; });
    return t;
}

} // namespace bench
