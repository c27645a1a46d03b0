// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The CPU table: cpu_backend on 1, 2, .. N threads next to the plain one-thread baseline
// (baseline/plain_voxelizer.hpp), whose voxel sets must be the same, and next to published figures. Prints Markdown and
// writes it and CSV to a folder.

#include "generated_meshes.hpp"
#include "machine.hpp"
#include "mesh_file.hpp"
#include "plain_solid.hpp"
#include "plain_voxelizer.hpp"
#include "published_figures.hpp"
#include "table.hpp"
#include "timer.hpp"

#include <CLI/CLI.hpp>
#include <cpu_ref/backend.hpp>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <thread>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using bench::significant;

struct options {
    std::string scenes = VOXELPIPE_SCENES_DIR;
    std::vector<std::string> meshes; // names of scenes or generated meshes, or files; empty: the five scenes
    std::vector<int> resolutions{128, 512, 1024};
    std::vector<std::string> cells; // empty: all
    unsigned threads = 0;           // largest number; 0: the machine's
    double seconds = 2.0;
    double baseline_limit = 20.0;
    bool no_baseline = false;
    bool scenes_only = false, icosphere_only = false;
    bool processor_time = false; // in place of wall time, and one thread
    std::string out = VOXELPIPE_BENCH_OUTPUT_DIR;
};

// ---- one cell -------------------------------------------------------------------------------------------------------

enum class output_kind { bits, sums, lists, solid };

struct cell_kind {
    const char* name;
    output_kind output;
    vp::coverage rule;
    vp::fill_rule fill = vp::fill_rule::nonzero; // solid only
};
constexpr cell_kind cell_kinds[]{
    {"bit conservative", output_kind::bits, vp::coverage::conservative},
    {"bit thin", output_kind::bits, vp::coverage::thin},
    {"float add conservative", output_kind::sums, vp::coverage::conservative},
    {"A-buffer thin", output_kind::lists, vp::coverage::thin},
    {"A-buffer conservative", output_kind::lists, vp::coverage::conservative},
    {"bit solid even_odd", output_kind::solid, {}, vp::fill_rule::even_odd},
    {"bit solid nonzero", output_kind::solid, {}, vp::fill_rule::nonzero},
};

struct our_run {
    unsigned threads;
    bench::timing time;
    vp::stage_times stages; // medians, milliseconds
    std::uint64_t peak_bytes;
    vp::counters counts;
};

// The tables' unit: wall time, or the time that all threads computed.
bench::timing shown(bench::timing t, const options& how) {
    if (how.processor_time) t.wall_ms = t.cpu_ms;
    return t;
}

vp::stage_times median_of(const std::vector<vp::stage_times>& runs) {
    vp::stage_times medians;
    for (const auto& [name, field] : vp::stage_time_fields) {
        std::vector<double> v;
        for (const vp::stage_times& r : runs) v.push_back(r.*field);
        medians.*field = bench::median(v);
    }
    return medians;
}

// Times `call(backend)`, which returns a status.
template <class Call>
our_run time_ours(unsigned threads, const options& how, Call&& call) {
    vp::cpu_backend backend{threads};
    our_run run{};
    run.threads = threads;
    vp::stage_times times{};
    backend.times = &times;
    std::vector<vp::stage_times> all;
    bench::reset_peak_memory();
    run.time = shown(bench::measure(
                         {1, 3, 20, how.seconds},
                         [&] {
                             times = {};
                             const vp::status s = call(backend);
                             s.or_throw();
                             run.counts = s.counts;
                         },
                         [&](int) { all.push_back(times); }),
                     how);
    run.stages = median_of(all);
    run.peak_bytes = bench::peak_memory();
    return run;
}

struct cell_result {
    std::vector<our_run> ours;
    bench::timing baseline;
    bool baseline_ran = false;
    double baseline_tests = 0;
    double floor_ms = 0; // the mesh read and the words of the grid written, in one thread; bits only
};

// The least that a call in one thread has to do.
double floor_of(const bench::mesh_data& mesh, std::vector<std::uint32_t>& words, const options& how) {
    float sum = 0; // keeps the reads
    const bench::timing t = shown(bench::measure(
                                      {1, 3, 5, 0.2},
                                      [&] {
                                          std::fill(words.begin(), words.end(), 0u);
                                          for (const glm::uvec3& i : mesh.triangles)
                                              sum +=
                                                  mesh.positions[i.x].x + mesh.positions[i.y].y + mesh.positions[i.z].z;
                                      },
                                      [](int) {}),
                                  how);
    volatile float kept = sum;
    (void)kept;
    return t.wall_ms;
}

[[noreturn]] void differ(const bench::mesh_data& mesh, const cell_kind& kind) {
    throw std::runtime_error(mesh.name + ", " + kind.name + ": the baseline gives another result than cpu_backend");
}

cell_result run_cell(const bench::mesh_data& mesh, const vp::grid& grid, const cell_kind& kind,
                     const std::vector<unsigned>& threads, const options& how) {
    cell_result result;
    const vp::mesh_view<> view{mesh.positions, mesh.triangles};
    // The baseline of solids has one rule, and a voxel costs it less than a test.
    if (kind.output == output_kind::solid)
        result.baseline_tests = kind.fill == vp::fill_rule::even_odd ? 0 : std::numeric_limits<double>::infinity();
    else
        result.baseline_tests = bench::baseline::tests_needed(mesh, grid, kind.rule);
    // A test takes some 3 ns; more where triangles are tiny, but then there are few tests.
    const bool baseline = !how.no_baseline && result.baseline_tests * 3e-9 < how.baseline_limit;
    const bench::repetition plain_runs{0, 1, 5, how.seconds};
    result.baseline_ran = baseline;
    // One bit a voxel: draw(backend, framebuffer) is timed, and the baseline fills the same words.
    const auto run_bits = [&](const auto& draw, const auto& draw_plain) {
        using target = vp::target<vp::bit, blend::bit_or>;
        std::vector<std::uint32_t> words(target::map::elements(grid.extent));
        vp::framebuffer_view<target> fb{grid.extent, {}};
        vp::get<0>(fb.targets) = {words.data(), grid.extent, vp::load_operation::clear, false};
        for (const unsigned n : threads)
            result.ours.push_back(time_ours(n, how, [&](vp::cpu_backend& b) { return draw(b, fb); }));
        std::vector<std::uint32_t> plain(words.size());
        result.floor_ms = floor_of(mesh, plain, how);
        if (!baseline) return;
        result.baseline = shown(bench::measure(plain_runs, [&] { draw_plain(plain); }), how);
        if (plain != words) differ(mesh, kind);
    };
    switch (kind.output) {
    case output_kind::bits:
        run_bits(
            [&](vp::cpu_backend& b, auto& fb) {
                return vp::voxelize(b, view, grid, vp::passthrough{}, vp::constant(true), fb, kind.rule);
            },
            [&](std::vector<std::uint32_t>& plain) { bench::baseline::bits(mesh, grid, kind.rule, plain); });
        break;
    case output_kind::solid:
        run_bits(
            [&](vp::cpu_backend& b, auto& fb) {
                return vp::voxelize_solid(b, view, grid, vp::passthrough{}, vp::constant(true), fb,
                                          {.rule = kind.fill});
            },
            [&](std::vector<std::uint32_t>& plain) { bench::baseline::solid_bits(mesh, grid, plain); });
        break;
    case output_kind::sums: {
        using target = vp::target<float, blend::add>;
        std::vector<float> values(target::map::elements(grid.extent));
        vp::framebuffer_view<target> fb{grid.extent, {}};
        vp::get<0>(fb.targets) = {values.data(), grid.extent, vp::load_operation::clear, 0.0f};
        for (const unsigned n : threads)
            result.ours.push_back(time_ours(n, how, [&](vp::cpu_backend& b) {
                return vp::voxelize(b, view, grid, vp::passthrough{}, vp::constant(1.0f), fb, kind.rule);
            }));
        if (baseline) {
            std::vector<float> plain(values.size());
            result.baseline = bench::measure(plain_runs, [&] { bench::baseline::sums(mesh, grid, kind.rule, plain); });
            if (plain != values) differ(mesh, kind); // sums of ones, far below 2^24: exact in both
        }
        break;
    }
    case output_kind::lists: {
        vp::host_abuffer<void> last;
        for (const unsigned n : threads)
            result.ours.push_back(time_ours(n, how, [&](vp::cpu_backend& b) {
                vp::abuffer<vp::cpu_backend> lists{b}; // made anew, as a caller who keeps none would
                const vp::status s = vp::voxelize(b, view, grid, vp::passthrough{}, vp::constant(), lists, kind.rule);
                return s;
            }));
        if (baseline) {
            vp::cpu_backend b{threads.back()};
            vp::abuffer<vp::cpu_backend> lists{b};
            vp::voxelize(b, view, grid, vp::passthrough{}, vp::constant(), lists, kind.rule).or_throw();
            last = lists.to_host(b);
            bench::baseline::lists plain;
            result.baseline =
                bench::measure(plain_runs, [&] { plain = bench::baseline::fragments(mesh, grid, kind.rule); });
            if (plain.voxels != last.voxels || plain.offsets != last.offsets || plain.primitives != last.primitives)
                differ(mesh, kind);
        }
        break;
    }
    }
    return result;
}

// ---- tables ---------------------------------------------------------------------------------------------------------

std::string baseline_text(const cell_result& r) {
    if (r.baseline_ran) return significant(r.baseline.wall_ms);
    return "-";
}

std::vector<std::string> thread_columns(const std::vector<unsigned>& threads) {
    std::vector<std::string> out;
    for (const unsigned n : threads) out.push_back(std::to_string(n) + (n == 1 ? " thread" : " threads"));
    return out;
}

void say(const std::string& text) {
    std::fprintf(stderr, "%s\n", text.c_str());
    std::fflush(stderr);
}

// The icosphere of 500k triangles next to what others have published.
bench::table published_table(const std::vector<unsigned>& threads, const options& how) {
    std::vector<std::string> columns{"N", "voxels"};
    for (const auto& c : thread_columns(threads)) columns.push_back("VoxelPipe, " + c);
    columns.emplace_back("baseline, 1 thread");
    for (const auto& p : bench::published_figures) columns.emplace_back(p.program);
    columns.emplace_back("ahead of the best of them");
    bench::table t(columns);
    const bench::mesh_data mesh = bench::icosphere(158);
    for (std::size_t i = 0; i < bench::published_resolutions.size(); ++i) {
        const int n = bench::published_resolutions[i];
        say("icosphere " + std::to_string(n));
        const vp::grid grid = vp::fit(mesh.positions, glm::ivec3(n));
        const cell_result r = run_cell(mesh, grid, cell_kinds[0], threads, how);
        std::vector<std::string> row{std::to_string(n), std::to_string(r.ours.back().counts.voxels)};
        double ours = r.ours.front().time.wall_ms;
        for (const our_run& o : r.ours) {
            row.push_back(significant(o.time.wall_ms));
            if (o.threads == 2) ours = o.time.wall_ms; // theirs had two cores
        }
        row.push_back(baseline_text(r));
        double best = 0;
        for (const auto& p : bench::published_figures) {
            row.emplace_back(p.milliseconds[i]);
            if (p.best[i] > 0 && (best == 0 || p.best[i] < best)) best = p.best[i];
        }
        row.push_back(significant(best / ours) + " ×");
        t.add_row(row);
    }
    return t;
}

bench::mesh_data find_mesh(const std::string& name, const options& how) {
    if (name == "icosphere") return bench::icosphere(300);
    if (name == "torus_knot") return bench::torus_knot(4356, 100);
    if (name == "torus_knot_fine") return bench::torus_knot(12500, 288);
    if (name == "hairball_generated") return bench::hairball(1500, 160, 1);
    if (name == "room") return bench::room(331000, 1);
    if (name == "one_triangle") return bench::one_triangle();
    std::string why;
    if (bench::has_scene(how.scenes, name, why)) return bench::load_scene(how.scenes, name);
    if (std::filesystem::exists(name)) return bench::read_mesh(name);
    throw std::runtime_error("no mesh is called " + name + " (" + why + ")");
}

// The five scenes, or a generated mesh of the same kind for each that is absent.
std::vector<std::string> default_meshes(const options& how, std::vector<std::string>& notes) {
    const char* const stand_in[] = {"room", "torus_knot", "icosphere", "hairball_generated", "torus_knot_fine"};
    std::vector<std::string> out;
    for (std::size_t i = 0; i < bench::scene_names.size(); ++i) {
        const std::string name(bench::scene_names[i]);
        std::string why;
        if (bench::has_scene(how.scenes, name, why)) {
            out.push_back(name);
        } else {
            notes.push_back("scene " + name + " is absent (" + why + "): the generated mesh " + stand_in[i] +
                            " stands in its place");
            out.emplace_back(stand_in[i]);
        }
    }
    return out;
}

struct scene_tables {
    bench::table times, stages;
};

scene_tables scene_table(const std::vector<std::string>& names, const std::vector<unsigned>& threads,
                         const options& how, std::vector<std::string>& notes) {
    std::vector<std::string> columns{"mesh", "triangles", "N", "cell", "fragments", "voxels"};
    for (const auto& c : thread_columns(threads)) columns.push_back(c + ", ms");
    columns.insert(columns.end(),
                   {"scaling", "baseline, ms", "floor, ms", "ahead of it, 1 thread", "fragments/us", "peak, MiB"});
    scene_tables out{bench::table(columns),
                     bench::table({"mesh", "N", "cell", "threads", "vertex shade", "coarse raster", "tile sort",
                                   "clear", "fine raster", "A-buffer emit", "all, ms", "cpu, ms"})};
    for (const std::string& name : names) {
        const bench::mesh_data mesh = find_mesh(name, how);
        notes.push_back(mesh.name + ": " + std::to_string(mesh.triangles.size()) + " triangles" +
                        (mesh.note.empty() ? "" : ", " + mesh.note));
        for (const int n : how.resolutions) {
            const vp::grid grid = vp::fit(mesh.positions, glm::ivec3(n));
            for (const cell_kind& kind : cell_kinds) {
                if (!how.cells.empty() && std::find(how.cells.begin(), how.cells.end(), kind.name) == how.cells.end())
                    continue;
                say(mesh.name + " " + std::to_string(n) + " " + kind.name);
                const cell_result r = run_cell(mesh, grid, kind, threads, how);
                const our_run &one = r.ours.front(), &all = r.ours.back();
                std::vector<std::string> row{
                    mesh.name, std::to_string(mesh.triangles.size()), std::to_string(n),
                    kind.name, std::to_string(all.counts.fragments),  std::to_string(all.counts.voxels)};
                for (const our_run& o : r.ours) row.push_back(significant(o.time.wall_ms));
                row.push_back(significant(one.time.wall_ms / all.time.wall_ms) + " ×");
                row.push_back(baseline_text(r));
                row.push_back(r.floor_ms > 0 ? significant(r.floor_ms) : "-");
                row.push_back(r.baseline_ran ? significant(r.baseline.wall_ms / one.time.wall_ms) + " ×" : "-");
                row.push_back(significant(static_cast<double>(all.counts.fragments) / all.time.wall_ms * 1e-3));
                row.push_back(std::to_string(all.peak_bytes >> 20));
                out.times.add_row(row);
                for (const our_run& o : r.ours)
                    out.stages.add_row({mesh.name, std::to_string(n), kind.name, std::to_string(o.threads),
                                        significant(o.stages.vertex_shade), significant(o.stages.coarse_raster),
                                        significant(o.stages.tile_sort), significant(o.stages.clear),
                                        significant(o.stages.fine_raster), significant(o.stages.abuffer_emit),
                                        significant(o.time.wall_ms), significant(o.time.cpu_ms)});
            }
        }
    }
    return out;
}

void write_file(const std::filesystem::path& file, const std::string& text) {
    std::ofstream out(file);
    out << text;
    if (!out.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

int run(const options& how) {
    const unsigned machine = std::max(1u, std::thread::hardware_concurrency());
    const unsigned most = how.processor_time ? 1 : how.threads != 0 ? how.threads : machine;
    std::vector<unsigned> threads;
    for (unsigned n = 1; n < most; n *= 2) threads.push_back(n);
    threads.push_back(most);

    const bench::machine_record record = bench::describe_machine();
    std::string text = "# CPU table\n\n" + record.markdown() + "- times: milliseconds of " +
                       (how.processor_time ? "processor time of one thread" : "wall time") +
                       " of whole calls, medians, clear included, mesh and framebuffer in memory\n"
                       "- baseline: one thread, every voxel of each triangle's bounding box tested exactly; solids, "
                       "even_odd: every voxel "
                       "behind a crossing flipped; the same voxels\n"
                       "- floor: one thread, the mesh read and the words of the grid written\n"
                       "\n";
    std::filesystem::create_directories(how.out);
    const std::filesystem::path folder = how.out;
    const std::string name = how.processor_time ? "cpu_processor_time" : "cpu"; // of the files
    if (!how.scenes_only) {
        const bench::table t = published_table(threads, how);
        text +=
            "## Icosphere, 499,280 triangles, conservative bits, next to published figures\n\n"
            "The other programs' figures are quoted (2 cores, ±40 %), ours and the baseline's are measured here.\n\n" +
            t.markdown() + "\n";
        write_file(folder / "cpu_published.csv", t.csv());
    }
    if (!how.icosphere_only) {
        std::vector<std::string> notes;
        const std::vector<std::string> names = how.meshes.empty() ? default_meshes(how, notes) : how.meshes;
        const scene_tables t = scene_table(names, threads, how, notes);
        text += "## Scenes\n\n";
        for (const std::string& n : notes) text += "- " + n + "\n";
        text += "\n" + t.times.markdown() + "\n### Stages, ms\n\n" + t.stages.markdown();
        write_file(folder / (how.processor_time ? name + ".csv" : "cpu_scenes.csv"), t.times.csv());
        if (!how.processor_time) write_file(folder / "cpu_stages.csv", t.stages.csv());
    }
    write_file(folder / (name + ".md"), text);
    std::cout << text << "\nwritten to " << folder.string() << ": " << name << ".md and CSV files\n";
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"cpu_backend's times next to a plain baseline and to published figures"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes")->capture_default_str();
    app.add_option(
        "--mesh", how.meshes,
        "Scene, generated mesh (icosphere, torus_knot, torus_knot_fine, hairball_generated, room, one_triangle) "
        "or .vpm file; may be repeated. Default: the five scenes");
    app.add_option("--resolution", how.resolutions, "Voxels along the longest side; may be repeated")
        ->capture_default_str();
    app.add_option("--cell", how.cells, "Only this cell, e.g. \"bit thin\"; may be repeated");
    app.add_option("--threads", how.threads, "Largest number of threads; 0: as many as the machine runs at once");
    app.add_option("--seconds", how.seconds, "Time to spend on each figure, at least three runs")
        ->capture_default_str();
    app.add_option("--baseline-limit", how.baseline_limit, "Leave out the baseline where it would take longer, seconds")
        ->capture_default_str();
    app.add_flag("--no-baseline", how.no_baseline, "Leave out the baseline");
    app.add_flag("--processor-time", how.processor_time,
                 "Processor time of one thread in place of wall time, for machines that do other work");
    app.add_flag("--scenes-only", how.scenes_only, "Leave out the table of published figures");
    app.add_flag("--icosphere-only", how.icosphere_only, "Only the table of published figures");
    app.add_option("--out", how.out, "Folder for cpu.md and the CSV files")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_cpu_table: %s\n", e.what());
        return 1;
    }
}
