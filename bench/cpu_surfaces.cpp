// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Surfaces on the CPU: from triangles to a mesh, sign included, at each place, and at place::sharp with embedded;
// milliseconds, triangles a second and peak memory.

#include "machine.hpp"
#include "mesh_file.hpp"
#include "output.hpp"
#include "scene_choice.hpp"
#include "table.hpp"
#include "timer.hpp"

#include <CLI/CLI.hpp>
#include <cpu_ref/backend.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using bench::significant;

struct options {
    std::string scenes = VOXELPIPE_SCENES_DIR, out;
    std::vector<std::string> meshes;
    std::vector<int> resolutions{256, 512};
    unsigned threads = 2;
    double seconds = 2.0;
};

struct way {
    const char* name;
    vp::remesh_options options;
};

int run(const options& how, const std::string& command) {
    const std::vector<way> ways{{"corner", {.place = vp::place::corner}},
                                {"mean", {.place = vp::place::mean}},
                                {"sharp", {}},
                                {"sharp, embedded", {.embedded = true}}};
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.meshes.empty() ? bench::available_scenes(how.scenes, notes) : how.meshes;
    bench::table rows(
        {"scene", "resolution", "place", "triangles", "faces", "rounds", "pairs", "ms", "Mfaces/s", "peak_MiB"});
    for (const std::string& name : names) {
        const bench::mesh_data mesh = bench::find_mesh(how.scenes, name);
        const vp::mesh_view<> view{mesh.positions, mesh.triangles};
        for (const int n : how.resolutions)
            for (const way& w : ways) {
                const vp::grid g = vp::fit(mesh.positions, glm::ivec3(n));
                vp::cpu_backend backend{how.threads};
                bench::say(mesh.name + " " + std::to_string(n) + " " + w.name);
                bench::reset_peak_memory();
                vp::surface<vp::cpu_backend> out(backend);
                vp::status s;
                const double ms = bench::measure({0, 3, 20, how.seconds}, [&] {
                                      s = vp::remesh(backend, view, g, vp::passthrough{}, out, w.options);
                                      s.or_throw();
                                  }).wall_ms;
                rows.add_row({mesh.name, std::to_string(n), w.name, std::to_string(mesh.triangles.size()),
                              std::to_string(s.surface.faces), std::to_string(s.surface.embed_rounds),
                              std::to_string(s.surface.intersecting_pairs), significant(ms, 4),
                              significant(static_cast<double>(s.surface.faces) / ms / 1e3, 4),
                              significant(static_cast<double>(bench::peak_memory()) / (1 << 20), 4)});
            }
    }
    std::string text = "# Surfaces on the CPU\n\n" + bench::describe_machine().markdown() + "- command: `" + command +
                       "`\n- " + std::to_string(how.threads) +
                       " threads; milliseconds of whole calls from triangles to a mesh, medians\n"
                       "- peak: resident memory of the process, mesh and result included\n";
    for (const std::string& note : notes) text += "- " + note + "\n";
    text += "\n" + rows.markdown();
    std::cout << text;
    if (!how.out.empty()) {
        bench::write_file(std::filesystem::path(how.out) / "cpu_surfaces.md", text);
        bench::write_file(std::filesystem::path(how.out) / "cpu_surfaces.csv", rows.csv());
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"cpu_backend's times and memory of remesh"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes")->capture_default_str();
    app.add_option("--mesh", how.meshes, "A scene, a generated mesh or a file; may be repeated. Default: five scenes");
    app.add_option("--resolution", how.resolutions, "Voxels a side; may be repeated")->capture_default_str();
    app.add_option("--threads", how.threads, "0: as many as the machine runs at once")->capture_default_str();
    app.add_option("--seconds", how.seconds, "Time to spend on each figure, at least three runs")
        ->capture_default_str();
    app.add_option("--out", how.out, "Folder for cpu_surfaces.md and cpu_surfaces.csv");
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how, bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_cpu_surfaces: %s\n", e.what());
        return 1;
    }
}
