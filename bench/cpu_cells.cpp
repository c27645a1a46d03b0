// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cut cells on the CPU: fractions, dense and sparse, next to what one would do without them: our own solid in a grid of
// rows --finer times as fine along each axis, slab by slab, whose bits are averaged. Milliseconds, peak memory, and how
// far the averages are off.

#include "machine.hpp"
#include "mesh_file.hpp"
#include "output.hpp"
#include "scene_choice.hpp"
#include "table.hpp"
#include "timer.hpp"

#include <CLI/CLI.hpp>
#include <cpu_ref/backend.hpp>
#include <cpu_ref/parallel.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using bench::significant;
using number = vp::target<float, vp::blend::replace>;
using bit = vp::target<vp::bit, vp::blend::bit_or>;

struct options {
    std::string scenes = VOXELPIPE_SCENES_DIR, out;
    std::vector<std::string> meshes{"dragon"};
    std::vector<int> resolutions{256, 512};
    unsigned threads = 2;
    double seconds = 2.0;
    int finer = 6;
    int layers = 64; // of the coarse grid, in a slab of the finer one
};

// Milliseconds that a call should take at most; 0: none is set.
double target_of(const std::string& scene, int n, const std::string& what) {
    return scene == "dragon" && n == 512 && what == "fraction" ? 500 : 0;
}

// Bits [first, first + count) of a row, count < 32.
std::uint32_t bits_of(const std::uint32_t* row, std::size_t first, unsigned count) {
    const std::size_t shift = first % 32;
    std::uint32_t bits = row[first / 32] >> shift;
    if (shift + count > 32) bits |= row[first / 32 + 1] << (32 - shift);
    return bits & ((1u << count) - 1);
}

// Adds up the bits of a slab by voxel of the coarse grid.
void average(const options& how, const std::uint32_t* bits, const glm::ivec3& fine, int first_layer,
             const glm::ivec3& coarse, std::vector<float>& means) {
    const auto f = static_cast<unsigned>(how.finer);
    const auto words = static_cast<std::size_t>((fine.x + 31) / 32);
    const auto rows = static_cast<std::size_t>(coarse.y) * static_cast<std::size_t>(fine.z / how.finer);
    const float each = 1.0f / static_cast<float>(f * f * f);
    vp::cpu::parallel_for(how.threads, rows, [&](unsigned, std::size_t r) {
        const auto y = static_cast<std::size_t>(coarse.y);
        const std::size_t j = r % y, k = r / y;
        std::vector<std::uint32_t> counts(static_cast<std::size_t>(coarse.x));
        for (std::size_t z = 0; z < f; ++z)
            for (std::size_t v = 0; v < f; ++v) {
                const std::uint32_t* const row =
                    bits + ((k * f + z) * static_cast<std::size_t>(fine.y) + j * f + v) * words;
                for (std::size_t i = 0; i < counts.size(); ++i)
                    counts[i] += static_cast<std::uint32_t>(std::popcount(bits_of(row, i * f, f)));
            }
        float* const to =
            means.data() + ((static_cast<std::size_t>(first_layer) + k) * y + j) * static_cast<std::size_t>(coarse.x);
        for (std::size_t i = 0; i < counts.size(); ++i) to[i] = each * static_cast<float>(counts[i]);
    });
}

int run(const options& how, const std::string& command) {
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.meshes.empty() ? bench::available_scenes(how.scenes, notes) : how.meshes;
    bench::table rows({"scene", "resolution", "what", "triangles", "cut_voxels", "values", "ms", "target_ms",
                       "target/ours", "ms/fraction", "peak_MiB", "mean_error", "largest_error"});
    for (const std::string& name : names) {
        const bench::mesh_data mesh = bench::find_mesh(how.scenes, name);
        const vp::mesh_view<> view{mesh.positions, mesh.triangles};
        for (const int n : how.resolutions) {
            const vp::grid g = vp::fit(mesh.positions, glm::ivec3(n));
            vp::cpu_backend backend{how.threads};
            vp::status s;
            double fraction_ms = 0;
            const auto add = [&](const std::string& what, std::uint64_t values, double ms, double mean, double most) {
                const double target = target_of(mesh.name, n, what);
                if (fraction_ms <= 0) fraction_ms = ms;
                const auto shown = [](double v) { return v > 0 ? significant(v) : std::string{}; };
                rows.add_row({mesh.name, std::to_string(n), what, std::to_string(mesh.triangles.size()),
                              std::to_string(s.cells.cut_voxels), std::to_string(values), significant(ms, 4),
                              shown(target), shown(target / ms), significant(ms / fraction_ms),
                              significant(static_cast<double>(bench::peak_memory()) / (1 << 20), 4), shown(mean),
                              shown(most)});
                bench::say(mesh.name + " " + std::to_string(n) + " " + what + " " + significant(ms) + " ms");
            };
            vp::framebuffer<vp::cpu_backend, number> dense{backend, g.extent};
            const auto draw = [&](auto& fb, bool edges) {
                vp::cell_options o;
                o.count_open_edges = edges;
                bench::reset_peak_memory();
                return bench::measure({0, 3, 20, how.seconds},
                                      [&] {
                                          s = vp::voxelize_cells(backend, view, g, vp::passthrough{}, vp::fraction{},
                                                                 fb, o);
                                          s.or_throw();
                                      })
                    .wall_ms;
            };
            double ms = draw(dense, false);
            const std::vector<float> fractions = vp::get<0>(dense).to_host(backend);
            add("fraction", fractions.size(), ms, 0, 0);
            ms = draw(dense, true);
            add("fraction, open edges", fractions.size(), ms, 0, 0);
            {
                vp::sparse_framebuffer<vp::cpu_backend, number> sparse{backend, g.extent};
                ms = draw(sparse, false);
                add("fraction, sparse", sparse.num_values(), ms, 0, 0);
            }
            if (how.finer < 2) continue;
            const vp::grid fine = vp::fit(mesh.positions, how.finer * g.extent);
            std::vector<float> means(fractions.size());
            bench::reset_peak_memory();
            ms =
                bench::measure({0, 1, 3, how.seconds}, [&] {
                    for (int begin = 0; begin < g.extent.z; begin += how.layers) {
                        const int depth = how.finer * std::min(how.layers, g.extent.z - begin);
                        const vp::grid slab =
                            fine.crop({0, 0, how.finer * begin}, {fine.extent.x, fine.extent.y, depth});
                        vp::framebuffer<vp::cpu_backend, bit> bits{backend, slab.extent};
                        vp::voxelize_solid(backend, view, slab, vp::passthrough{}, vp::constant(true), bits).or_throw();
                        average(how, vp::get<0>(bits.view().targets).elements, slab.extent, begin, g.extent, means);
                    }
                }).wall_ms;
            double sum = 0, most = 0;
            for (std::size_t i = 0; i < means.size(); ++i) {
                const double error = std::abs(static_cast<double>(means[i]) - fractions[i]);
                sum += error;
                most = std::max(most, error);
            }
            add("the solid " + std::to_string(how.finer) + " x finer, averaged", means.size(), ms,
                sum / static_cast<double>(s.cells.cut_voxels), most);
        }
    }
    std::string text = "# Cut cells on the CPU\n\n" + bench::describe_machine().markdown() + "- command: `" + command +
                       "`\n- " + std::to_string(how.threads) +
                       " threads; milliseconds of whole calls, medians\n"
                       "- errors of the averages against the fractions: their sum over the voxels that are cut, and "
                       "the largest\n- peak: resident memory of the process, mesh and results included\n";
    for (const std::string& note : notes) text += "- " + note + "\n";
    text += "\n" + rows.markdown();
    std::cout << text;
    if (!how.out.empty()) {
        bench::write_file(std::filesystem::path(how.out) / "cpu_cells.md", text);
        bench::write_file(std::filesystem::path(how.out) / "cpu_cells.csv", rows.csv());
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"cpu_backend's times of fractions next to a finer solid that is averaged"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes")->capture_default_str();
    app.add_option("--mesh", how.meshes, "A scene, a generated mesh or a file; may be repeated")->capture_default_str();
    app.add_option("--resolution", how.resolutions, "Voxels a side; may be repeated")->capture_default_str();
    app.add_option("--threads", how.threads, "0: as many as the machine runs at once")->capture_default_str();
    app.add_option("--seconds", how.seconds, "Time to spend on each figure, at least three runs")
        ->capture_default_str();
    app.add_option("--finer", how.finer, "How many rows of the solid a voxel has along each axis; 1: none")
        ->check(CLI::Range(1, 31))
        ->capture_default_str();
    app.add_option("--layers", how.layers, "Layers of voxels whose finer rows are held at once")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--out", how.out, "Folder for cpu_cells.md and cpu_cells.csv");
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how, bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_cpu_cells: %s\n", e.what());
        return 1;
    }
}
