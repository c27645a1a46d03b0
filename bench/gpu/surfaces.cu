// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Surfaces on a GPU, by scene and grid: meshes of bits (place::mean), by extract and by extract_async; from triangles
// to a sharp mesh with a colour a vertex, sign included, without and with embedded; and the same with every twentieth
// triangle gone, closed by repair::exterior. Beside them the targets that the project has set itself. Prints a table of
// medians; --out writes it as CSV too.

#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/surfaces/device/extract_async.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

using bits = vp::target<vp::bit, vp::blend::replace>;

// A colour that follows the normal.
struct surface_color {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        glm::vec3 color;
        for (int a = 0; a < 3; ++a) color[a] = vp::exact::fma(0.5f, f.normal[a], 0.5f);
        return vp::outputs(color);
    }
};
using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, surface_color>;

// Milliseconds that a call should take at most; 0: none is set.
double target_of(std::string_view scene, int n, std::string_view what) {
    if (scene != "dragon") return 0;
    if (what == "extract" || what == "extract_async") return n == 1024 ? 0.6 : 0;
    if (what == "remesh") return n == 1024 ? 3 : n == 512 ? 1.2 : 0;
    return what == "remesh exterior" && n == 512 ? 4 : 0;
}

struct measured_surface {
    sample time;
    vp::status status;
};

template <class Call>
measured_surface measure(gpu::session& session, const gpu::repetition& repeat, const Call& once) {
    const auto call = [&] {
        const vp::status s = once();
        if (s.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(s.message());
        s.or_throw();
        return s;
    };
    measured_surface m;
    m.status = call();
    m.time = gpu::time_calls(session, repeat, [&] { (void)call(); });
    return m;
}

// Without every twentieth triangle, by a fixed seed.
mesh_data without_some(const mesh_data& from) {
    mesh_data m = from;
    std::mt19937 random(1);
    m.triangles.clear();
    for (const auto& t : from.triangles)
        if (random() % 20 != 0) m.triangles.push_back(t);
    return m;
}

class surface_rows {
public:
    surface_rows(const gpu::run_options& how, gpu::session& session, gpu::clock_watch& watch, table& rows)
        : how_(how), session_(session), watch_(watch), rows_(rows) {}

    void of_bits(const mesh_data& data, const vp::mesh_view<>& view, const vp::grid& g) {
        vp::cuda_backend backend(session_.stream());
        vp::framebuffer<vp::cuda_backend, bits> inside(backend, g.extent);
        vp::voxelize_solid(backend, view, g, vp::passthrough{}, vp::constant(true), inside).or_throw();
        const auto from = vp::get<0>(inside.view().targets);
        vp::surface<vp::cuda_backend> out(backend);
        const measured_surface waits =
            measure(session_, how_.repeat, [&] { return vp::extract(backend, from, g, out); });
        add(data, g, "extract", waits);
        // The room that the surface needs, and nothing beyond it.
        vp::surface_limits limits;
        std::optional<vp::cuda_backend::buffer<std::uint8_t>> memory;
        vp::surface_workspace_view workspace;
        vp::surface_result result;
        vp::status found;
        for (int attempt = 0; attempt < 3; ++attempt) {
            memory.reset();
            memory.emplace(backend, vp::extract_workspace_bytes(from, g, {}, limits));
            workspace = {memory->data(), memory->size(), limits};
            vp::extract_async(backend, from, g, result, {}, workspace).or_throw();
            found = vp::read_surface_status(backend, workspace, &limits);
            if (found.ok()) break;
        }
        found.or_throw();
        measured_surface never =
            measure(session_, how_.repeat, [&] { return vp::extract_async(backend, from, g, result, {}, workspace); });
        never.status = found;
        add(data, g, "extract_async", never);
    }

    void of_triangles(const mesh_data& data, const vp::mesh_view<>& view, const vp::grid& g, const std::string& what,
                      const vp::remesh_options& o) {
        vp::cuda_backend backend(session_.stream());
        const draw_type d{view, {}, {}};
        vp::surface<vp::cuda_backend, glm::vec3> out(backend);
        add(data, g, what, measure(session_, how_.repeat, [&] {
                return vp::remesh(backend, std::span<const draw_type>(&d, 1), g, out, o);
            }));
    }

private:
    void add(const mesh_data& data, const vp::grid& g, const std::string& what, const measured_surface& m) {
        watch_.read();
        const int n = g.extent.x;
        const double target_ms = target_of(data.name, n, what);
        const auto& s = m.status.surface;
        rows_.add_row({data.name, std::to_string(n), what, std::to_string(data.triangles.size()),
                       std::to_string(s.vertices), std::to_string(s.faces), std::to_string(s.made_crossings),
                       std::to_string(s.embed_rounds), std::to_string(s.intersecting_pairs),
                       significant(m.time.median, 4), target_ms > 0 ? significant(target_ms, 4) : std::string{},
                       target_ms > 0 ? significant(target_ms / m.time.median) : std::string{},
                       significant(static_cast<double>(s.faces) / m.time.median / 1e3, 4)});
        say(data.name + " " + std::to_string(n) + " " + what + " " + significant(m.time.median) + " ms");
    }

    const gpu::run_options& how_;
    gpu::session& session_;
    gpu::clock_watch& watch_;
    table& rows_;
};

int run(const gpu::run_options& how, const std::string& command) {
    gpu::session session;
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "call", "triangles", "vertices", "faces", "made_crossings", "rounds", "pairs",
                "ms", "target_ms", "target/ours", "Mfaces/s"});
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.names.empty() ? available_scenes(how.scenes, notes) : how.names;
    surface_rows cells(how, session, watch, rows);
    bool failed = false;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name), broken = without_some(data);
        const gpu::resident_mesh mesh = gpu::upload(data), holes = gpu::upload(broken);
        for (const int n : how.resolutions) {
            const vp::grid g = vp::fit(data.positions, glm::ivec3(n));
            const auto view_of = [&](const gpu::resident_mesh& m) {
                vp::cuda_backend backend(session.stream());
                vp::mesh_view<> view{{m.positions.data(), m.positions.size()},
                                     {m.triangles.data(), m.triangles.size()}};
                view.checked = vp::check_indices(backend, view.triangles);
                return view;
            };
            const auto guarded = [&](const std::string& what, const auto& row) {
                try {
                    row();
                } catch (const std::exception& e) {
                    failed = true;
                    notes.push_back("failed: " + name + " " + std::to_string(n) + " " + what + ": " + e.what());
                    say(notes.back());
                }
                session.trim();
            };
            const vp::mesh_view<> view = view_of(mesh), with_holes = view_of(holes);
            vp::remesh_options embedded, exterior;
            embedded.embedded = true;
            exterior.repair = vp::repair::exterior;
            exterior.closing = 1;
            guarded("bits", [&] { cells.of_bits(data, view, g); });
            guarded("remesh", [&] { cells.of_triangles(data, view, g, "remesh", {}); });
            guarded("embedded", [&] { cells.of_triangles(data, view, g, "remesh embedded", embedded); });
            guarded("exterior", [&] { cells.of_triangles(broken, with_holes, g, "remesh exterior", exterior); });
        }
    }
    gpu::write_report(how,
                      {"Surfaces on a GPU",
                       "gpu_surfaces",
                       "CUDA events around the whole call, mesh or bits and the result on the device",
                       {"extract: bits -> place::mean; remesh: triangles -> place::sharp, sign and a colour a vertex "
                        "included; exterior: closing 1, every twentieth triangle gone",
                        "extract_async: the room is what the surface needs; target: what a call should take at most"},
                       notes,
                       {}},
                      watch, command, rows);
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    gpu::run_options how;
    how.resolutions = {512, 1024};
    gpu::command line("bench_gpu_surfaces", "cuda_backend's times of extract and remesh next to targets", how,
                      "gpu_surfaces.md and gpu_surfaces.csv");
    line.add_meshes();
    return line.run(argc, argv, [&](const std::string& typed) { return run(how, typed); });
}
