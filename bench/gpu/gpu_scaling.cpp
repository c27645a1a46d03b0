// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Scaling curves of the GPU backend, next to the baseline of one thread a triangle:
//   triangles  10^3 to 10^8 on a sphere at 512^3
//   grid       64^3 to 2048^3 with one mesh
//   size       triangles with edges from 0.1 voxel to most of the grid, the same number of fragments in all
//   depth      1 to 10^4 fragments a voxel, the same number of fragments in all, in few tiles or in many
// Writes one CSV; plot.py draws it. What does not fit the device's memory is left out with a line that says so.

#include "cells.hpp"
#include "device_record.hpp"
#include "generated_on_device.hpp"
#include "machine.hpp"
#include "output.hpp"
#include "scene_choice.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options {
    std::vector<std::string> series{"triangles", "grid", "size", "depth"};
    std::string scenes = VOXELPIPE_SCENES_DIR, mesh; // empty: dragon, or what stands in for it
    std::uint64_t fragments = std::uint64_t{1} << 22;
    std::uint64_t max_triangles = 100'000'000;
    int resolution = 512, max_resolution = 2048;
    gpu::cell_choice choice{{2, 10, 3, 2}, 0.5, true, true, 0}; // no stage times
    std::string out = VOXELPIPE_BENCH_OUTPUT_DIR;
};

class scaling {
public:
    explicit scaling(const options& how)
        : how_(how), table_({"series", "variant", "cell", "x", "resolution", "triangles", "fragments", "ms", "ms_q1",
                             "ms_q3", "runs", "async_ms", "baseline_ms", "mtriangles_per_s", "mfragments_per_s"}) {}

    int run(const std::string& command);

private:
    void triangles();
    void grid();
    void size();
    void depth();
    // One row a cell; what does not fit is left out.
    void point(const std::string& series, const std::string& variant, double x, const gpu::resident_mesh& mesh,
               const vp::grid& grid, const std::vector<gpu_cell>& cells);
    void leave_out(const std::string& what, const std::exception& why);
    template <class Make>
    void try_mesh(const std::string& what, Make&& make);

    const options& how_;
    gpu::session session_;
    gpu::clock_watch watch_;
    table table_;
    std::vector<std::string> notes_;
    bool failed_ = false;
};

void scaling::leave_out(const std::string& what, const std::exception& why) {
    notes_.push_back("left out: " + what + " (" + why.what() + ")");
    say(notes_.back());
}

template <class Make>
void scaling::try_mesh(const std::string& what, Make&& make) {
    try {
        make();
    } catch (const gpu::out_of_device_memory& e) {
        leave_out(what, e);
    }
    session_.trim();
}

void scaling::point(const std::string& series, const std::string& variant, double x, const gpu::resident_mesh& mesh,
                    const vp::grid& grid, const std::vector<gpu_cell>& cells) {
    for (const gpu_cell kind : cells) {
        const std::string name = series + " " + variant + " " + plain(x) + " " + std::string(name_of(kind));
        try {
            const auto cell = gpu::prepare(session_, mesh, grid, kind);
            const gpu::cell_times t = gpu::time_cell(session_, *cell, how_.choice);
            const std::uint64_t fragments = t.counts.fragments;
            const sample& whole = t.whole;
            watch_.read();
            const auto count = static_cast<double>(mesh.triangles.size());
            const auto ms = [](const sample& s) { return s.runs == 0 ? std::string{} : significant(s.median, 4); };
            table_.add_row({series, variant, std::string(name_of(kind)), plain(x), std::to_string(grid.extent.x),
                            std::to_string(mesh.triangles.size()), std::to_string(fragments), ms(whole),
                            significant(whole.low_quartile, 4), significant(whole.high_quartile, 4),
                            std::to_string(whole.runs), ms(t.async), ms(t.baseline),
                            significant(count / whole.median * 1e-3),
                            significant(static_cast<double>(fragments) / whole.median * 1e-3)});
            say(name + ": " + significant(whole.median) + " ms, " + std::to_string(fragments) + " fragments");
        } catch (const gpu::out_of_device_memory& e) {
            leave_out(name, e);
        } catch (const std::exception& e) {
            failed_ = true;
            notes_.push_back("failed: " + name + ": " + e.what());
            say(notes_.back());
        }
        session_.trim();
    }
}

void scaling::triangles() {
    const vp::grid g = gpu::unit_grid(how_.resolution);
    for (const std::uint64_t decade : {1'000u, 10'000u, 100'000u, 1'000'000u, 10'000'000u, 100'000'000u})
        for (const std::uint64_t wanted : {decade, decade * 3}) {
            if (wanted > how_.max_triangles) break;
            try_mesh(std::to_string(wanted) + " triangles", [&] {
                const gpu::resident_mesh mesh = gpu::sphere_of_quads(gpu::quads_for(wanted), how_.resolution);
                point("triangles", "sphere", static_cast<double>(mesh.triangles.size()), mesh, g,
                      {gpu_cell::bit_conservative, gpu_cell::bit_thin, gpu_cell::float_add_conservative,
                       gpu_cell::abuffer_thin});
            });
        }
}

void scaling::grid() {
    std::vector<std::string> choice;
    const std::string name =
        how_.mesh.empty() ? available_scenes(how_.scenes, choice)[1] : how_.mesh; // dragon is the second
    const mesh_data data = find_mesh(how_.scenes, name);
    notes_.push_back("grid: " + data.name + ", " + std::to_string(data.triangles.size()) + " triangles" +
                     (data.note.empty() ? "" : ", " + data.note));
    const gpu::resident_mesh mesh = gpu::upload(data);
    for (int n = 64; n <= how_.max_resolution; n *= 2)
        point("grid", data.name, n, mesh, vp::fit(data.positions, glm::ivec3(n)),
              {gpu_cell::bit_conservative, gpu_cell::bit_thin});
}

void scaling::size() {
    const int n = how_.resolution;
    const vp::grid g = gpu::unit_grid(n);
    const gpu_cell pilot = gpu_cell::bit_conservative;
    for (const double edge : {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 0.8 * n}) {
        if (edge > 0.8 * n) continue;
        try_mesh("edges of " + plain(edge) + " voxels", [&] {
            // Fragments of such a triangle, estimated from a few of them.
            constexpr std::uint64_t some = 2000;
            const gpu::resident_mesh few = gpu::scattered_triangles(some, edge, n, 1);
            const std::uint64_t fragments = gpu::prepare(session_, few, g, pilot)->call().fragments;
            const double each = static_cast<double>(fragments) / static_cast<double>(some);
            const double count = std::max(1.0, std::round(static_cast<double>(how_.fragments) / each));
            const gpu::resident_mesh mesh = gpu::scattered_triangles(static_cast<std::uint64_t>(count), edge, n, 2);
            point("size", "scattered", edge, mesh, g,
                  {gpu_cell::bit_conservative, gpu_cell::bit_thin, gpu_cell::float_add_conservative,
                   gpu_cell::abuffer_conservative});
        });
    }
}

void scaling::depth() {
    const vp::grid g = gpu::unit_grid(how_.resolution);
    for (const auto where : {gpu::placement::together, gpu::placement::spread})
        for (const std::uint64_t depth : {1u, 3u, 10u, 30u, 100u, 300u, 1'000u, 3'000u, 10'000u})
            try_mesh(std::to_string(depth) + " fragments a voxel", [&] {
                const std::uint64_t voxels = std::max<std::uint64_t>(1, how_.fragments / depth);
                const gpu::resident_mesh mesh = gpu::stacked_triangles(voxels, depth, where, how_.resolution, 3);
                point("depth", where == gpu::placement::together ? "together" : "spread", static_cast<double>(depth),
                      mesh, g,
                      {gpu_cell::bit_conservative, gpu_cell::float_add_conservative, gpu_cell::abuffer_conservative});
            });
}

int scaling::run(const std::string& command) {
    for (const std::string& name : how_.series) {
        if (name == "triangles") triangles();
        if (name == "grid") grid();
        if (name == "size") size();
        if (name == "depth") depth();
    }
    std::string text = "# GPU scaling\n\n" + gpu::describe_device(watch_) + "- clocks over the run: " + watch_.range() +
                       "\n" + describe_machine().markdown() + "- command: `" + command +
                       "`\n- times: milliseconds, medians of at most " + std::to_string(how_.choice.repeat.runs) +
                       " calls after " + std::to_string(how_.choice.repeat.warmups) +
                       " warm-ups, CUDA events around the whole call, clear included, mesh on the device, its "
                       "indices looked at once before\n"
                       "- baseline: one thread a triangle, atomics in global memory, the same sets\n";
    for (const std::string& n : notes_) text += "- " + n + "\n";
    text += "\n" + table_.markdown();
    const std::filesystem::path folder = how_.out;
    write_file(folder / "gpu_scaling.md", text);
    write_file(folder / "gpu_scaling.csv", table_.csv());
    std::cout << text << "\nwritten to " << folder.string() << ": gpu_scaling.md and gpu_scaling.csv\n";
    return failed_ ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"How cuda_backend's times grow with the work"};
    app.add_option("--series", how.series, "triangles, grid, size or depth; may be repeated")
        ->check(CLI::IsMember({"triangles", "grid", "size", "depth"}));
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes (.vpm or .vpz)")->capture_default_str();
    app.add_option("--mesh", how.mesh, "The mesh of the series grid. Default: dragon, or a generated mesh");
    app.add_option("--fragments", how.fragments, "Fragments in all, for size and depth")->capture_default_str();
    app.add_option("--most-triangles", how.max_triangles, "Where the series triangles ends")->capture_default_str();
    app.add_option("--resolution", how.resolution, "Grid of triangles, size and depth")
        ->capture_default_str()
        ->check(CLI::Range(64, 2048));
    app.add_option("--most-resolution", how.max_resolution, "Where the series grid ends")->capture_default_str();
    app.add_option("--runs", how.choice.repeat.runs, "Timed calls a figure, at most")->capture_default_str();
    app.add_option("--seconds", how.choice.repeat.seconds, "Fewer calls once they took so long")->capture_default_str();
    app.add_flag("!--no-baseline", how.choice.baseline, "Leave out the baseline");
    app.add_option("--out", how.out, "Folder for gpu_scaling.md and gpu_scaling.csv")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        return scaling(how).run(bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_gpu_scaling: %s\n", e.what());
        return 1;
    }
}
