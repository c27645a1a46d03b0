// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cut cells on a GPU, by scene and grid: the fractions of a dense float target, with and without the count of open
// edges, and all that a shader can ask for; the solid of a grid six times finer along each axis, whose bits somebody
// would average instead, before they are averaged; the fractions on two threads of the CPU, whose bytes must be the
// same; and the target that the project has set itself. Prints a table of medians; --out writes it as CSV too.

#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/cells/device/cells.cuh>
#include <voxelpipe/solid/device/solid.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <cpu_ref/cells/voxelize_cells.hpp>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options : gpu::run_options {
    bool finer = true, cpu = true;
    int finest = 3072; // most voxels along an axis of the finer grid
};

// All that is measured, in targets of their own.
struct all_measures {
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area, vp::cell_value::sheets>;
    VOXELPIPE_HD vp::output<float, float, float> operator()(const fragment& f) const {
        return vp::outputs(f.fraction, f.centroid.x + f.centroid.y + f.centroid.z,
                           f.is_multi_cut ? -static_cast<float>(f.area) : static_cast<float>(f.area));
    }
};

using number = vp::target<float, vp::blend::replace>;

// Milliseconds that a call should take at most; 0: none is set.
double target_of(std::string_view scene, int n, std::string_view what, bool on_gpu) {
    if (scene != "dragon" || n != 512 || what != "fraction") return 0;
    return on_gpu ? 1.5 : 500;
}

template <class Call>
vp::status checked(const Call& call) {
    const vp::status s = call();
    if (s.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(s.message());
    s.or_throw();
    return s;
}

int run(const options& how, const std::string& command) {
    gpu::session session;
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "what", "device", "triangles", "cut_voxels", "records", "ms", "target_ms",
                "target/ours", "finer_ms", "finer/ours"});
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.names.empty() ? available_scenes(how.scenes, notes) : how.names;
    const auto ms = [](double value) { return value > 0 ? significant(value, 4) : std::string{}; };
    const auto ratio = [](double a, double b) { return a > 0 && b > 0 ? significant(a / b) : std::string{}; };
    bool failed = false;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const gpu::resident_mesh mesh = gpu::upload(data);
        const auto cells = [&](int n) {
            vp::cuda_backend backend(session.stream());
            vp::mesh_view<> view{{mesh.positions.data(), mesh.positions.size()},
                                 {mesh.triangles.data(), mesh.triangles.size()}};
            view.checked = vp::check_indices(backend, view.triangles);
            const vp::grid g = vp::fit(data.positions, glm::ivec3(n));
            double finer = 0;
            const auto add = [&](const std::string& what, bool on_gpu, const vp::status& s, double time) {
                const double target_ms = target_of(data.name, n, what, on_gpu);
                rows.add_row({data.name, std::to_string(n), what, on_gpu ? "gpu" : "cpu, 2 threads",
                              std::to_string(data.triangles.size()), std::to_string(s.cells.cut_voxels),
                              std::to_string(s.cells.cell_records), ms(time), ms(target_ms), ratio(target_ms, time),
                              on_gpu ? ms(finer) : std::string{}, on_gpu ? ratio(finer, time) : std::string{}});
                say(data.name + " " + std::to_string(n) + " " + what + (on_gpu ? " " : " on the CPU ") +
                    significant(time) + " ms");
            };
            if (const glm::ivec3 fine = 6 * g.extent; how.finer && std::max({fine.x, fine.y, fine.z}) <= how.finest) {
                const vp::grid small = vp::fit(data.positions, fine);
                vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, vp::blend::bit_or>> fb(backend, small.extent);
                const auto call = [&] {
                    return checked([&] {
                        return vp::voxelize_solid(backend, view, small, vp::passthrough{},
                                                  vp::constant_output<bool>{true}, fb);
                    });
                };
                (void)call();
                finer = gpu::time_calls(session, how.repeat, [&] { (void)call(); }).median;
            }
            session.trim();
            std::vector<float> fractions;
            const auto measure = [&](const std::string& what, const auto& shader, auto& fb, bool edges) {
                vp::cell_options o;
                o.count_open_edges = edges;
                const auto call = [&] {
                    return checked(
                        [&] { return vp::voxelize_cells(backend, view, g, vp::passthrough{}, shader, fb, o); });
                };
                const vp::status s = call();
                add(what, true, s, gpu::time_calls(session, how.repeat, [&] { (void)call(); }).median);
                if (fractions.empty()) fractions = vp::get<0>(fb).to_host(backend);
            };
            {
                vp::framebuffer<vp::cuda_backend, number> fb(backend, g.extent);
                measure("fraction", vp::fraction{}, fb, false);
                measure("fraction, open edges", vp::fraction{}, fb, true);
            }
            {
                vp::framebuffer<vp::cuda_backend, number, number, number> fb(backend, g.extent);
                measure("all measures", all_measures{}, fb, false);
            }
            session.trim();
            if (!how.cpu) return;
            vp::cpu_backend host(2);
            const vp::mesh<vp::cpu_backend> on_host(host, data.positions, data.triangles);
            vp::framebuffer<vp::cpu_backend, number> fb(host, g.extent);
            vp::cell_options o;
            o.count_open_edges = false;
            std::vector<double> times;
            vp::status s;
            for (int i = 0; i < 5; ++i) {
                const auto start = std::chrono::steady_clock::now();
                s = checked(
                    [&] { return vp::voxelize_cells(host, on_host, g, vp::passthrough{}, vp::fraction{}, fb, o); });
                const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
                times.push_back(time.count());
            }
            std::sort(times.begin(), times.end());
            add("fraction", false, s, times[2]);
            const std::vector<float> expected = vp::get<0>(fb).to_host(host);
            if (std::memcmp(expected.data(), fractions.data(), expected.size() * sizeof(float)) != 0)
                throw std::runtime_error("the GPU's fractions are not the CPU's");
        };
        for (const int n : how.resolutions) {
            try {
                cells(n);
            } catch (const std::exception& e) {
                failed = true;
                notes.push_back("failed: " + name + " " + std::to_string(n) + ": " + e.what());
                say(notes.back());
            }
        }
    }
    gpu::write_report(how,
                      {"Cut cells on a GPU",
                       "gpu_cut_cells",
                       "CUDA events around the whole call, clear included, mesh on the device; on the CPU a clock",
                       {"target: what a call should take at most; finer: the solid of a grid six times finer along "
                        "each axis, not averaged yet"},
                       notes,
                       {}},
                      watch, command, rows);
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {256, 512};
    gpu::command line("bench_gpu_cut_cells",
                      "cuda_backend's times of fractions next to those of a finer solid and of two threads", how,
                      "gpu_cut_cells.md and gpu_cut_cells.csv");
    line.add_meshes();
    line.add_flag("!--no-finer", how.finer, "Leave out the finer solid");
    line.add_flag("!--no-cpu", how.cpu, "Leave out the CPU");
    return line.run(argc, argv, [&](const std::string& typed) { return run(how, typed); });
}
