// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include "model/system.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <iomanip>
#include <sstream>
#include <string>
#include <utility>

namespace voxelize {

progress_bar::progress_bar(bool enabled) : enabled_{enabled && os::draws_over_lines(2)} {}

void progress_bar::start(std::string what) {
    clear();
    what_ = std::move(what);
    percent_ = -1;
    start_ = std::chrono::steady_clock::now();
}

void progress_bar::show(double done) {
    if (!enabled_ || std::chrono::steady_clock::now() - start_ < std::chrono::milliseconds(500)) return;
    const int percent = static_cast<int>(std::clamp(done, 0.0, 1.0) * 100);
    if (percent == percent_) return;
    percent_ = percent;
    constexpr int width = 30;
    const int filled = percent * width / 100;
    std::fprintf(stderr, "\r\033[K%s [%s%s] %3d %%", what_.c_str(),
                 std::string(static_cast<std::size_t>(filled), '#').c_str(),
                 std::string(static_cast<std::size_t>(width - filled), '.').c_str(), percent);
    std::fflush(stderr);
    drawn_ = true;
}

void progress_bar::clear() {
    if (!drawn_) return;
    std::fputs("\r\033[K", stderr);
    std::fflush(stderr);
    drawn_ = false;
}

namespace {

double sum_of_stages(const run_report& report) {
    double sum = 0;
    for (const auto& [stage, time] : report.stats.milliseconds) sum += time;
    return sum;
}

// A number without needless digits.
std::string shortest(double number) {
    std::ostringstream text;
    text << number;
    return text.str();
}

} // namespace

void add_rest(run_report& report, double wall_milliseconds) {
    report.stats.milliseconds.emplace_back("other", std::max(0.0, wall_milliseconds - sum_of_stages(report)));
}

void print_text(std::ostream& stream, const run_report& report) {
    const voxelpipe::grid& grid = report.request.grid;
    const auto line = [&stream](const char* name) -> std::ostream& {
        return stream << "  " << std::left << std::setw(20) << name << std::right;
    };
    line("grid") << grid.extent.x << " x " << grid.extent.y << " x " << grid.extent.z << ", voxels of "
                 << grid.voxel_size.x;
    if (grid.voxel_size.y != grid.voxel_size.x || grid.voxel_size.z != grid.voxel_size.x)
        stream << " x " << grid.voxel_size.y << " x " << grid.voxel_size.z;
    stream << " from (" << grid.origin.x << ", " << grid.origin.y << ", " << grid.origin.z << ")\n";
    line("backend") << report.stats.backend << ", ";
    if (report.stats.devices > 1) stream << report.stats.devices << " x ";
    if (!report.stats.device.empty()) stream << report.stats.device << ", ";
    stream << report.stats.threads << " threads, " << report.stats.slabs
           << (report.stats.slabs == 1 ? " slab" : " slabs");
    if (!report.stats.no_cuda.empty())
        stream << " (not cuda: " << report.stats.no_cuda << ')';
    else if (!report.stats.estimate.empty())
        stream << " (auto: " << report.stats.estimate << ')';
    stream << '\n';
    if (report.stats.pass_slabs) line("drawn for passes") << *report.stats.pass_slabs << " slabs\n";
    if (report.stats.strategy.value != voxelpipe::strategy::automatic)
        line("strategy") << to_string(report.stats.strategy.value) << " (" << report.stats.strategy.why << ")\n";
    line("triangles") << report.stats.triangles;
    if (report.stats.triangles_dropped != 0) stream << " (" << report.stats.triangles_dropped << " dropped)";
    stream << '\n';
    if (report.stats.lines != 0) {
        line("lines and points") << report.stats.lines;
        if (report.stats.lines_dropped != 0) stream << " (" << report.stats.lines_dropped << " dropped)";
        stream << '\n';
    }
    line("vertices") << report.vertices << '\n';
    line("fragments") << report.stats.fragments;
    if (report.stats.fragments_discarded != 0) stream << " (" << report.stats.fragments_discarded << " more discarded)";
    stream << '\n';
    if (!report.request.remesh)
        line(report.request.distance ? "samples in band" : "voxels") << report.stats.voxels << '\n';
    if (report.bricks != 0)
        line("bricks") << report.bricks << " with a voxel, " << std::fixed << std::setprecision(1)
                       << static_cast<double>(report.brick_bytes) / (1 << 20) << " MiB\n";
    if (report.surface) {
        const voxelpipe::surface_counters& c = report.surface->counts;
        line("mesh") << c.vertices << " vertices, " << c.faces << " faces, " << c.components
                     << " components, Euler characteristic " << report.surface->euler << '\n';
        line("crossings") << c.made_crossings << " made up, " << c.cone_crossings << " on closed holes\n";
    }
    if (report.request.distance) {
        const distance_request& distance = *report.request.distance;
        line("distance") << (distance.is_whole ? std::string("whole")
                                               : "band of " + shortest(distance.band) + " voxels")
                         << ", " << (distance.is_signed ? to_string(distance.sign.rule) : "unsigned") << ", at "
                         << (distance.at_corners ? "corners" : "centres");
        if (report.stats.solid)
            stream << ", " << report.stats.solid->open_rows << " of " << report.stats.solid->rows << " rows open";
        stream << '\n';
    }
    if (report.stats.solid && report.request.solid)
        line("solid") << to_string(report.request.solid->rule) << ", " << to_string(report.request.solid->extent)
                      << ", " << report.stats.solid->crossings << " crossings, " << report.stats.solid->open_rows
                      << " of " << report.stats.solid->rows << " rows open, greatest winding "
                      << report.stats.solid->max_winding << '\n';
    if (report.stats.solid && report.stats.solid->holes != 0)
        line("holes") << report.stats.solid->closed_holes << " of " << report.stats.solid->holes << " closed, of "
                      << report.stats.solid->hole_edges << " edges in all\n";
    if (const auto& counts = report.stats.fractions; counts)
        line("fractions") << "volume of " << shortest(counts->volume()) << " voxels, " << counts->cut_voxels << " cut, "
                          << counts->below_zero << " below 0, " << counts->above_one << " above 1, "
                          << counts->open_rows << " of " << counts->rows << " rows open, " << counts->open_edges
                          << " open edges\n";
    if (const auto& counts = report.stats.fractions; counts && counts->holes != 0 && !report.request.solid)
        line("holes") << counts->closed_holes << " of " << counts->holes << " closed, of " << counts->hole_edges
                      << " edges in all\n";
    if (report.stats.normals_cancelled != 0) line("normals cancelled") << report.stats.normals_cancelled << '\n';
    stream << std::fixed << std::setprecision(1);
    for (const auto& [stage, time] : report.stats.milliseconds)
        line((stage + " ms").c_str()) << std::setw(10) << time << '\n';
    line("all ms") << std::setw(10) << sum_of_stages(report) << '\n';
    if (report.stats.device_memory != 0)
        line("GPU memory MiB") << std::setw(10) << static_cast<double>(report.stats.device_memory) / (1 << 20) << '\n';
    line("peak memory MiB") << std::setw(10) << static_cast<double>(report.peak_memory) / (1 << 20) << '\n';
}

void print_json(std::ostream& stream, const run_report& report) {
    using json = nlohmann::ordered_json;
    const voxelpipe::grid& grid = report.request.grid;
    json root;
    root["input"] = report.input.string();
    root["grid"] = {{"extent", {grid.extent.x, grid.extent.y, grid.extent.z}},
                    {"origin", {grid.origin.x, grid.origin.y, grid.origin.z}},
                    {"voxel_size", {grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z}}};
    root["coverage"] = report.request.coverage == voxelpipe::coverage::thin        ? "thin"
                       : report.request.coverage == voxelpipe::coverage::crosshair ? "crosshair"
                       : report.request.coverage == voxelpipe::coverage::diagonal  ? "diagonal"
                                                                                   : "conservative";
    if (report.stats.solid && report.request.solid) {
        root.erase("coverage");
        root["solid"] = {{"rule", to_string(report.request.solid->rule)},
                         {"extent", to_string(report.request.solid->extent)},
                         {"rows", report.stats.solid->rows},
                         {"open_rows", report.stats.solid->open_rows},
                         {"crossings", report.stats.solid->crossings},
                         {"max_winding", report.stats.solid->max_winding}};
        if (report.request.solid->vote) root["solid"]["vote"] = true;
        if (report.request.solid->winding) root["solid"]["winding"] = true;
        if (report.stats.solid->is_examined) {
            const voxelpipe::flood_counters& flood = report.stats.solid->flood;
            root["solid"]["flood"] = {{"lost_voxels", flood.lost_voxels},
                                      {"enclosed_voxels", flood.enclosed_voxels},
                                      {"face_voxels", flood.face_voxels},
                                      {"entered_holes", flood.entered_holes},
                                      {"hole_width", flood.hole_width},
                                      {"tried_closing", flood.closing},
                                      {"tried_close_holes", flood.close_holes != 0}};
        }
        if (report.request.solid->close_holes != 0) {
            root["solid"]["hole_edges"] = report.stats.solid->hole_edges;
            root["solid"]["holes"] = report.stats.solid->holes;
            root["solid"]["closed_holes"] = report.stats.solid->closed_holes;
        }
    }
    if (report.request.distance) {
        const distance_request& distance = *report.request.distance;
        root.erase("coverage");
        root["distance"] = {{"band", distance.is_whole ? json("whole") : json(distance.band)},
                            {"samples", distance.at_corners ? "corners" : "centres"},
                            {"sign", distance.is_signed ? to_string(distance.sign.rule) : "unsigned"}};
        if (report.stats.solid) root["distance"]["open_rows"] = report.stats.solid->open_rows;
    }
    if (report.surface && report.request.remesh) {
        const voxelpipe::surface_counters& c = report.surface->counts;
        root.erase("coverage");
        root["remesh"] = {{"sign", to_string(report.request.remesh->sign.rule)},
                          {"level", report.request.remesh->level},
                          {"vertices", c.vertices},
                          {"faces", c.faces},
                          {"components", c.components},
                          {"euler", report.surface->euler},
                          {"made_crossings", c.made_crossings},
                          {"cone_crossings", c.cone_crossings}};
        if (report.request.remesh->embedded)
            root["remesh"]["embedded"] = {{"rounds", c.embed_rounds},
                                          {"moved_vertices", c.moved_vertices},
                                          {"intersecting_pairs", c.intersecting_pairs}};
        if (report.stats.solid) root["remesh"]["open_rows"] = report.stats.solid->open_rows;
    }
    if (const auto& counts = report.stats.fractions; counts)
        root["fractions"] = {{"volume", counts->volume()},
                             {"cut_voxels", counts->cut_voxels},
                             {"below_zero", counts->below_zero},
                             {"above_one", counts->above_one},
                             {"rows", counts->rows},
                             {"open_rows", counts->open_rows},
                             {"open_edges", counts->open_edges}};
    if (const auto& counts = report.stats.fractions; counts && report.request.close_holes != 0) {
        root["fractions"]["hole_edges"] = counts->hole_edges;
        root["fractions"]["holes"] = counts->holes;
        root["fractions"]["closed_holes"] = counts->closed_holes;
    }
    root["targets"] = json::array();
    for (const target id : report.request.targets)
        if (!report.request.remesh) root["targets"].push_back(info_of(id).name);
    root["backend"] = report.stats.backend;
    if (!report.stats.device.empty()) root["device"] = report.stats.device;
    if (report.stats.devices != 0) root["devices"] = report.stats.devices;
    if (!report.stats.no_cuda.empty()) root["no_cuda"] = report.stats.no_cuda;
    if (report.stats.strategy.value != voxelpipe::strategy::automatic)
        root["strategy"] = {{"name", to_string(report.stats.strategy.value)}, {"why", report.stats.strategy.why}};
    if (!report.stats.estimate.empty()) root["estimate"] = report.stats.estimate;
    root["threads"] = report.stats.threads;
    root["slabs"] = report.stats.slabs;
    if (report.stats.pass_slabs) root["pass_slabs"] = *report.stats.pass_slabs;
    root["triangles"] = report.stats.triangles;
    root["triangles_dropped"] = report.stats.triangles_dropped;
    if (report.stats.lines != 0) {
        root["lines"] = report.stats.lines;
        root["lines_dropped"] = report.stats.lines_dropped;
    }
    root["vertices"] = report.vertices;
    root["fragments"] = report.stats.fragments;
    root["fragments_discarded"] = report.stats.fragments_discarded;
    root["voxels"] = report.stats.voxels;
    if (report.bricks != 0) {
        root["bricks"] = report.bricks;
        root["brick_bytes"] = report.brick_bytes;
    }
    if (report.stats.normals_cancelled != 0) root["normals_cancelled"] = report.stats.normals_cancelled;
    for (const auto& [stage, time] : report.stats.milliseconds) root["ms"][stage] = time;
    root["ms"]["total"] = sum_of_stages(report);
    if (report.stats.device_memory != 0) root["device_memory_bytes"] = report.stats.device_memory;
    root["peak_memory_bytes"] = report.peak_memory;
    root["materials"] = report.materials;
    root["files"] = json::array();
    for (const std::filesystem::path& file : report.files) root["files"].push_back(file.string());
    root["warnings"] = report.warnings;
    // Paths may be any bytes; what is not UTF-8 is replaced.
    stream << root.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
}

} // namespace voxelize
