// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distance fields on a GPU, by scene, grid and band: the whole call into a dense target and into sparse bricks, with
// and without a sign, whole fields of the dragon, and the dragon less a twentieth of its triangles with signs by
// winding numbers; the times of the stages; and the target that the project has set itself. Prints a table of medians;
// --out writes it as CSV too.

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
    std::vector<std::string> bands{"3"}; // voxels
    bool dense = true, sparse = true, whole = true, open = true;
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
// Milliseconds that a call should take at most, sign included; 0: none is set. band: voxels; 0: the whole field.
double target_of(std::string_view scene, int n, double band, bool has_sign, std::string_view output) {
    if (band == 0) return scene == "dragon" && n == 256 ? 25 : scene == "dragon" && n == 512 ? 150 : 0;
    if (band != 3) return 0;
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

// draw: a call that waits, and returns its status.
template <class Draw>
measured measure(gpu::session& session, vp::cuda_backend& backend, const gpu::repetition& repeat, const Draw& draw) {
    const auto call = [&] {
        const vp::status s = draw();
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

// The mesh less about one in twenty of its triangles.
mesh_data with_holes(const mesh_data& whole) {
    mesh_data open = whole;
    open.name += " less 5 %";
    open.triangles.clear();
    for (std::size_t i = 0; i < whole.triangles.size(); ++i)
        if ((static_cast<std::uint32_t>(i) * 2654435761u >> 16) % 20 != 0) open.triangles.push_back(whole.triangles[i]);
    return open;
}

// A mesh on the device, and its draw.
struct drawn_mesh {
    gpu::resident_mesh mesh;
    draw_type draw;

    drawn_mesh(vp::cuda_backend& backend, const mesh_data& data) : mesh(gpu::upload(data)) {
        vp::mesh_view<> view{{mesh.positions.data(), mesh.positions.size()},
                             {mesh.triangles.data(), mesh.triangles.size()}};
        view.checked = vp::check_indices(backend, view.triangles);
        draw = {view, {}, {}};
    }
};

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
    const auto add = [&](const mesh_data& data, int n, double band, const std::string& sign, const std::string& output,
                         double target_ms, const measured& m) {
        watch.read();
        const bool has_sign = sign == "nonzero";
        const double peer = band != 3 || sign == "winding" ? 0 : published_peer(data.name, n, has_sign);
        if (peer > 0 && !has_sign) ahead[output == "bricks" ? 1 : 0].push_back(peer / m.time.median);
        const std::string width = band == 0 ? "whole" : significant(band);
        rows.add_row({data.name, std::to_string(n), width, sign, output, std::to_string(data.triangles.size()),
                      std::to_string(m.status.distance.band_samples), ms(m.time.median), ms(target_ms),
                      ratio(target_ms, m.time.median), ms(peer), ratio(peer, m.time.median),
                      ms(m.stages.vertex_shade + m.stages.coarse_raster + m.stages.tile_sort), ms(m.stages.fine_raster),
                      ms(m.stages.clear + m.stages.tile_resolve)});
        say(data.name + " " + std::to_string(n) + " " + width + " " + sign + " " + output + " " +
            significant(m.time.median) + " ms");
    };
    // Calls f(output, measured) for each target. band: 0 for the whole field.
    const auto fields = [&](const draw_type& d, const vp::grid& g, double band, vp::distance_options o, const auto& f) {
        vp::cuda_backend backend(session.stream());
        o.band = band == 0 ? vp::band::whole : vp::band(band);
        const auto into = [&](auto& fb) {
            return measure(session, backend, how.repeat,
                           [&] { return vp::voxelize_distance(backend, std::span<const draw_type>(&d, 1), g, fb, o); });
        };
        if (how.dense || band == 0) {
            vp::framebuffer<vp::cuda_backend, target> fb(backend, g.extent);
            f("dense", into(fb));
        }
        if (how.sparse && band != 0) {
            vp::sparse_framebuffer<vp::cuda_backend, target> fb(backend, g.extent);
            f("bricks", into(fb));
        }
    };
    const auto guarded = [&](const mesh_data& data, int n, const auto& cell) {
        try {
            vp::cuda_backend backend(session.stream());
            const drawn_mesh d(backend, data);
            cell(backend, d.draw, vp::fit(data.positions, glm::ivec3(n)));
        } catch (const std::exception& e) {
            failed = true;
            notes.push_back("failed: " + data.name + " " + std::to_string(n) + ": " + e.what());
            say(notes.back());
        }
        session.trim();
    };
    const auto both_signs = [&](const mesh_data& data, int n, double band) {
        guarded(data, n, [&](vp::cuda_backend&, const draw_type& d, const vp::grid& g) {
            for (const bool has_sign : {false, true})
                fields(d, g, band, {.sign = has_sign ? vp::distance_sign::inside : vp::distance_sign::none},
                       [&](const std::string& output, const measured& m) {
                           add(data, n, band, has_sign ? "nonzero" : "none", output,
                               target_of(data.name, n, band, has_sign, output), m);
                       });
        });
    };
    // Signs of an open mesh: of the band, and of all samples as bits.
    const auto winding = [&](const mesh_data& data, int n) {
        guarded(data, n, [&](vp::cuda_backend& backend, const draw_type& d, const vp::grid& g) {
            fields(d, g, 3, {.repair = vp::repair::winding}, [&](const std::string& output, const measured& m) {
                add(data, n, 3, "winding", output, n == 1024 ? 6 : 0, m);
            });
            vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, vp::blend::bit_or>> bits(backend, g.extent);
            const measured m = measure(session, backend, how.repeat, [&] {
                return vp::voxelize_solid(
                    backend, d.mesh, g, vp::passthrough{}, vp::constant(true), bits,
                    vp::solid_options{.extent = vp::solid_extent::centre, .repair = vp::repair::winding});
            });
            add(data, n, 0, "winding", "bits", n == 1024 ? 10 : 0, m);
        });
    };
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        for (const int n : how.resolutions)
            for (const std::string& band : how.bands) both_signs(data, n, std::stod(band));
        if (data.name != "dragon") continue;
        if (how.whole)
            for (const int n : {256, 512}) both_signs(data, n, 0);
        if (how.open)
            for (const int n : {512, 1024}) winding(with_holes(data), n);
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
    line.add("--band", how.bands, "Width of the band in voxels; may be repeated");
    line.add_flag("!--no-dense", how.dense, "Leave out dense targets");
    line.add_flag("!--no-sparse", how.sparse, "Leave out sparse bricks");
    line.add_flag("!--no-whole", how.whole, "Leave out whole fields");
    line.add_flag("!--no-open", how.open, "Leave out the open mesh, whose signs are by winding numbers");
    return line.run(argc, argv, [&](const std::string& typed) { return run(how, typed); });
}
