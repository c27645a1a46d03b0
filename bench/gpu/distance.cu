// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distance fields on a GPU, by scene and grid: the whole call into a dense target and into sparse bricks, band 3, with
// and without a sign, and whole fields of the second scene; the times of the stages; and the target that the project
// has set itself. Prints a table of medians; --out writes it as CSV too.

#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/device/sparse_distance.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options : gpu::run_options {
    bool dense = true, sparse = true, whole = true;
};

// Milliseconds of another library on an H200: its fastest of several batches, without and with a sign.
struct published_distance {
    std::string_view scene;
    int resolution;
    double plain, with_sign;
};
constexpr published_distance published_distances[] = {
    {"dragon", 512, 29.4, 36.0},      {"dragon", 1024, 32.0, 54.2}, {"conference", 512, 12.4, 17.7},
    {"conference", 1024, 15.0, 33.9}, {"hairball", 512, 150, 166},  {"hairball", 1024, 187, 231},
    {"blade", 512, 52.2, 63.0},       {"blade", 1024, 53.6, 81.3},  {"asiandragon", 512, 248, 280},
    {"asiandragon", 1024, 230, 284},
};
double published_peer(std::string_view scene, int n, bool has_sign) {
    for (const auto& p : published_distances)
        if (p.scene == scene && p.resolution == n) return has_sign ? p.with_sign : p.plain;
    return 0;
}
// Milliseconds that a call should take at most, sign included; 0: none is set.
double target_of(std::string_view scene, int n, bool is_whole, bool has_sign, std::string_view output) {
    if (is_whole) return scene == "dragon" && n == 256 ? 25 : scene == "dragon" && n == 512 ? 150 : 0;
    if (scene == "dragon" && n == 1024 && has_sign && output == "bricks") return 3.5;
    return published_peer(scene, n, false) / 4.5; // no cell below
}

using target = vp::target<float, vp::blend::replace>;
using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::distance>;

struct measured {
    sample time;
    vp::status status;
    vp::stage_times stages;
};

template <class Output>
measured measure(gpu::session& session, vp::cuda_backend& backend, const draw_type& d, const vp::grid& g, Output& out,
                 const vp::distance_options& o, const gpu::repetition& repeat) {
    const auto call = [&] {
        const vp::status s = vp::voxelize_distance(backend, std::span<const draw_type>(&d, 1), g, out, o);
        if (s.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(s.message());
        s.or_throw();
        return s;
    };
    measured m;
    m.status = call();
    m.time = gpu::time_calls(session, repeat, [&] { (void)call(); });
    backend.times = &m.stages;
    (void)call();
    backend.times = nullptr;
    return m;
}

int run(const options& how, const std::string& command) {
    gpu::session session;
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "band", "sign", "output", "triangles", "band_samples", "ms", "target_ms",
                "target/ours", "peer_ms", "peer/ours", "lists_ms", "search_ms", "store_ms"});
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.names.empty() ? available_scenes(how.scenes, notes) : how.names;
    const auto ms = [](double value) { return value > 0 ? significant(value, 4) : std::string{}; };
    const auto ratio = [](double a, double b) { return a > 0 && b > 0 ? significant(a / b) : std::string{}; };
    std::vector<double> ahead[2]; // of the peer without a sign: dense, bricks
    bool failed = false;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const gpu::resident_mesh mesh = gpu::upload(data);
        const auto cells = [&](int n, bool is_whole) {
            vp::cuda_backend backend(session.stream());
            vp::mesh_view<> view{{mesh.positions.data(), mesh.positions.size()},
                                 {mesh.triangles.data(), mesh.triangles.size()}};
            view.checked = vp::check_indices(backend, view.triangles);
            const draw_type d{view, {}, {}};
            const vp::grid g = vp::fit(data.positions, glm::ivec3(n));
            const auto add = [&](const std::string& output, bool has_sign, const measured& m) {
                watch.read();
                const double target_ms = target_of(data.name, n, is_whole, has_sign, output),
                             peer = is_whole ? 0 : published_peer(data.name, n, has_sign);
                if (peer > 0 && !has_sign) ahead[output == "bricks" ? 1 : 0].push_back(peer / m.time.median);
                rows.add_row({data.name, std::to_string(n), is_whole ? "whole" : "3", has_sign ? "nonzero" : "none",
                              output, std::to_string(data.triangles.size()),
                              std::to_string(m.status.distance.band_samples), ms(m.time.median), ms(target_ms),
                              ratio(target_ms, m.time.median), ms(peer), ratio(peer, m.time.median),
                              ms(m.stages.vertex_shade + m.stages.coarse_raster + m.stages.tile_sort),
                              ms(m.stages.fine_raster), ms(m.stages.clear + m.stages.tile_resolve)});
                say(data.name + " " + std::to_string(n) + (is_whole ? " whole " : " ") + (has_sign ? "sign " : "") +
                    output + " " + significant(m.time.median) + " ms");
            };
            for (const bool has_sign : {false, true}) {
                vp::distance_options o;
                if (is_whole) o.band = vp::band::whole;
                if (!has_sign) o.sign = vp::distance_sign::none;
                if (how.dense || is_whole) {
                    vp::framebuffer<vp::cuda_backend, target> fb(backend, g.extent);
                    add("dense", has_sign, measure(session, backend, d, g, fb, o, how.repeat));
                }
                if (how.sparse && !is_whole) {
                    vp::sparse_framebuffer<vp::cuda_backend, target> fb(backend, g.extent);
                    add("bricks", has_sign, measure(session, backend, d, g, fb, o, how.repeat));
                }
            }
            session.trim();
        };
        const auto guarded = [&](int n, bool is_whole) {
            try {
                cells(n, is_whole);
            } catch (const std::exception& e) {
                failed = true;
                notes.push_back("failed: " + name + " " + std::to_string(n) + ": " + e.what());
                say(notes.back());
            }
        };
        for (const int n : how.resolutions) guarded(n, false);
        if (how.whole && data.name == "dragon")
            for (const int n : {256, 512}) guarded(n, true);
    }
    notes.push_back("ahead of the peer without a sign, geometric means: dense " +
                    significant(geometric_mean(ahead[0])) + ", bricks " + significant(geometric_mean(ahead[1])));
    gpu::write_report(
        how,
        {"Distance fields on a GPU",
         "gpu_distance",
         "CUDA events around the whole call, clear included, mesh on the device",
         {"peer: quoted, another library's fastest on an NVIDIA H200, without and with a sign; target: what "
          "a call should take at most"},
         notes,
         {}},
        watch, command, rows);
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {512, 1024};
    gpu::command line("bench_gpu_distance",
                      "cuda_backend's times of distance fields next to targets and quoted figures", how,
                      "gpu_distance.md and gpu_distance.csv");
    line.add_meshes();
    line.add_flag("!--no-dense", how.dense, "Leave out dense targets");
    line.add_flag("!--no-sparse", how.sparse, "Leave out sparse bricks");
    line.add_flag("!--no-whole", how.whole, "Leave out whole fields");
    return line.run(argc, argv, [&](const std::string& typed) { return run(how, typed); });
}
