// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The paper's table on one GPU: five scenes x 128, 512, 1024 x every kind of cell (gpu_report.hpp), next to a baseline
// of our own, whose voxels must be the same, to floors measured in the same run, and to published figures. Prints
// Markdown and writes it and CSV to a folder.

#include "cells.hpp"
#include "device_record.hpp"
#include "floors.hpp"
#include "machine.hpp"
#include "output.hpp"
#include "scene_choice.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <iostream>
#include <map>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options {
    std::string scenes = VOXELPIPE_SCENES_DIR;
    std::vector<std::string> meshes, cells; // empty: the five scenes, all cells
    std::vector<int> resolutions{128, 512, 1024};
    gpu::cell_choice choice;
    std::string out = VOXELPIPE_BENCH_OUTPUT_DIR;
};

// Two cells that must agree: the A-buffer keeps exactly the fragments that the framebuffers blend.
bool same_fragments(const std::vector<gpu_row>& rows) {
    std::map<std::string, std::uint64_t> seen;
    for (const gpu_row& r : rows) {
        if (!r.failure.empty()) continue;
        const std::string key = r.scene + std::to_string(r.resolution) + (is_thin(r.cell) ? "thin" : "conservative");
        if (seen.emplace(key, r.fragments).first->second != r.fragments) return false;
    }
    return true;
}

int run(const options& how, const std::string& command) {
    std::vector<gpu_cell> cells;
    for (const gpu_cell c : gpu_cells)
        if (how.cells.empty() || std::find(how.cells.begin(), how.cells.end(), name_of(c)) != how.cells.end())
            cells.push_back(c);
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.meshes.empty() ? available_scenes(how.scenes, notes) : how.meshes;

    gpu::session session;
    gpu::clock_watch watch;
    const double bandwidth = gpu::copy_bandwidth(session);
    watch.read();
    std::map<std::uint64_t, double> clear_ms;
    for (const int n : how.resolutions)
        for (const gpu_cell c : cells) {
            const std::uint64_t bytes = framebuffer_bytes(c, n);
            if (!clear_ms.contains(bytes)) clear_ms[bytes] = gpu::memset_ms(session, bytes);
        }

    std::vector<gpu_row> rows;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        notes.push_back(data.name + ": " + std::to_string(data.triangles.size()) + " triangles" +
                        (data.note.empty() ? "" : ", " + data.note));
        const gpu::resident_mesh mesh = gpu::upload(data);
        const double gather = gpu::gather_ms(session, mesh);
        for (const int n : how.resolutions) {
            const vp::grid grid = vp::fit(data.positions, glm::ivec3(n));
            for (const gpu_cell c : cells) {
                gpu_row row;
                row.scene = data.name;
                row.resolution = n;
                row.cell = c;
                row.triangles = data.triangles.size();
                row.published = published_anchor(data.name, n, c);
                try {
                    const auto cell = gpu::prepare(session, mesh, grid, c);
                    const gpu::cell_times t = gpu::time_cell(session, *cell, how.choice);
                    row.fragments = t.counts.fragments;
                    row.whole = t.whole;
                    row.async = t.async;
                    row.baseline = t.baseline;
                    row.stages = t.stages;
                } catch (const std::exception& e) {
                    row.failure = e.what();
                }
                watch.read();
                row.floor_ms = gather + clear_ms[framebuffer_bytes(c, n)];
                if (is_abuffer(c)) row.floor_ms += 8e3 * static_cast<double>(row.fragments) / bandwidth;
                say(row.scene + " " + std::to_string(n) + " " + std::string(name_of(c)) + ": " +
                    (row.failure.empty() ? significant(row.whole.median) + " ms" : row.failure));
                rows.push_back(std::move(row));
                session.trim();
            }
        }
    }

    const bench::machine_record record = describe_machine();
    const std::string measured = gpu::describe_device(watch) + "- clocks over the run: " + watch.range() +
                                 "\n- device copy, read and write: " + significant(bandwidth * 1e-12) + " TB/s\n" +
                                 record.markdown() + "- command: `" + command + "`\n";
    std::string text =
        "# GPU table\n\n" + measured + "- times: milliseconds, medians of " + std::to_string(how.choice.repeat.runs) +
        " calls after " + std::to_string(how.choice.repeat.warmups) +
        " warm-ups, CUDA events around the whole call, clear included, mesh on the device, its "
        "indices looked at once before (mesh_view::checked, as vp::mesh does where it is made); the "
        "caches are not flushed between calls\n"
        "- async: voxelize_async in the caller's memory, captured once as a CUDA graph: nobody waits for "
        "its counters, as in the published programs\n"
        "- baseline: one thread a triangle, atomics in global memory, the library's exact sets; "
        "compared word by word before it is timed, fewer runs where it is slow\n"
        "- floor: triangles read once and the grid written once (but where changes are tracked: nothing of it), "
        "or 8 bytes a fragment (A-buffer), measured in this run\n"
        "- 2011, peer, target: quoted (bench/published_gpu_figures.hpp), NVIDIA H200\n";
    for (const std::string& n : notes) text += "- " + n + "\n";
    const bool agree = same_fragments(rows);
    if (!agree) text += "- **cells of one scene disagree in the number of fragments**\n";
    text += "\n" + gpu_table_short(rows).markdown() + "\n## Geometric means\n\n" + gpu_means(rows).markdown();
    const std::filesystem::path folder = how.out;
    write_file(folder / "gpu.md", text);
    write_file(folder / "gpu.csv", gpu_table_all(rows).csv());
    std::string files = "gpu.md and gpu.csv";
    if (const table stages = gpu_stage_table(rows); !stages.empty()) {
        write_file(folder / "gpu_stages.md",
                   "# Stages of the GPU table\n\n" + measured + "- milliseconds: medians of " +
                       std::to_string(how.choice.stage_runs) +
                       " calls of vp::voxelize with an event at the end of each stage, after the table's own; an event "
                       "takes a few microseconds of the stream, so short calls come out longer than without\n"
                       "- call: the whole call without events, as in the table\n"
                       "- which stage a call without tiles has: docs/pipeline.md, \"Stage times\"\n\n" +
                       stages.markdown());
        write_file(folder / "gpu_stages.csv", stages.csv());
        files += ", gpu_stages.md and gpu_stages.csv";
    }
    std::cout << text << "\nwritten to " << folder.string() << ": " << files << "\n";
    const bool failed = std::any_of(rows.begin(), rows.end(), [](const gpu_row& r) { return !r.failure.empty(); });
    return failed || !agree ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"cuda_backend's times next to a plain baseline, to floors and to published figures"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes (.vpm or .vpz)")->capture_default_str();
    app.add_option("--mesh", how.meshes,
                   "Scene, generated mesh (icosphere, torus_knot, torus_knot_fine, hairball_generated, room, "
                   "one_triangle) or file; may be repeated. Default: the five scenes");
    app.add_option("--resolution", how.resolutions, "Voxels along the longest side; may be repeated")
        ->capture_default_str();
    app.add_option("--cell", how.cells, "Only this cell, e.g. bit_thin; may be repeated")
        ->check([](const std::string& name) {
            gpu_cell cell{};
            return parse(name, cell) ? std::string{} : "no cell is called " + name;
        });
    app.add_option("--runs", how.choice.repeat.runs, "Timed calls a figure")->capture_default_str();
    app.add_option("--warmups", how.choice.repeat.warmups, "Calls before them")->capture_default_str();
    app.add_option("--baseline-seconds", how.choice.baseline_seconds, "Fewer runs of the baseline once it took so long")
        ->capture_default_str();
    app.add_flag("!--no-baseline", how.choice.baseline, "Leave out the baseline and the comparison with it");
    app.add_option("--stage-runs", how.choice.stage_runs, "Calls a cell for the time of each stage; 0: none")
        ->capture_default_str();
    app.add_flag("!--no-async", how.choice.async, "Leave out voxelize_async");
    app.add_option("--out", how.out, "Folder for gpu.md and gpu.csv")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how, bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_gpu_table: %s\n", e.what());
        return 1;
    }
}
