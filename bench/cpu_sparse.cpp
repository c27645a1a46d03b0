// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers on the CPU over the grid's size: time, bytes of the result and peak memory of occupancy, and of
// the sums of four varyings with a count. Up to --largest-dense the dense twin beside it. Each row has the growth since
// the row before: a surface has four times the voxels at twice the resolution.

#include "machine.hpp"
#include "mean_shaders.hpp"
#include "mesh_file.hpp"
#include "output.hpp"
#include "scene_choice.hpp"
#include "table.hpp"
#include "timer.hpp"

#include <CLI/CLI.hpp>
#include <cpu_ref/backend.hpp>

#include <algorithm>
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
    std::vector<int> resolutions{256, 512, 1024, 2048, 4096};
    unsigned threads = 0;
    double seconds = 2.0;
    int largest_dense = 512;
};

using bit = vp::target<vp::bit, vp::blend::bit_or>;
using sum = vp::target<glm::vec4, vp::blend::add>;
using count = vp::target<std::uint32_t, vp::blend::count>;

struct measured {
    double ms = 0;
    std::uint64_t voxels = 0, bricks = 0, bytes = 0, peak = 0;
};

template <class Framebuffer, class VertexShader, class Shader>
measured measure(const bench::mesh_data& mesh, const vp::grid& g, const Shader& shader, const options& how) {
    vp::cpu_backend backend{how.threads};
    const vp::mesh_view<> view{mesh.positions, mesh.triangles};
    measured m;
    bench::reset_peak_memory();
    {
        Framebuffer framebuffer{backend, g.extent};
        m.ms = bench::measure({0, 3, 20, how.seconds}, [&] {
                   const vp::status s = vp::voxelize(backend, view, g, VertexShader{}, shader, framebuffer);
                   s.or_throw();
                   m.voxels = s.counts.voxels;
               }).wall_ms;
        if constexpr (requires { framebuffer.num_bricks(); }) {
            m.bricks = framebuffer.num_bricks();
            m.bytes = framebuffer.num_bytes();
        }
    }
    m.peak = bench::peak_memory();
    return m;
}

int run(const options& how, const std::string& command) {
    using sparse_bits = vp::sparse_framebuffer<vp::cpu_backend, bit>;
    using sparse_mean = vp::sparse_framebuffer<vp::cpu_backend, sum, count>;
    using dense_bits = vp::framebuffer<vp::cpu_backend, bit>;
    using dense_mean = vp::framebuffer<vp::cpu_backend, sum, count>;
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.meshes.empty() ? bench::available_scenes(how.scenes, notes) : how.meshes;
    bench::table rows({"scene", "resolution", "output", "bricks", "voxels", "ms", "dense_ms", "result_MiB", "peak_MiB",
                       "voxels_x", "ms_x", "bytes_x"});
    const auto mib = [](std::uint64_t bytes) { return significant(static_cast<double>(bytes) / (1 << 20), 4); };
    const auto growth = [](double now, double before) {
        return before > 0 ? significant(now / before) : std::string{};
    };
    for (const std::string& name : names) {
        const bench::mesh_data mesh = bench::find_mesh(how.scenes, name);
        for (const bool is_mean : {false, true}) {
            measured before;
            for (const int n : how.resolutions) {
                const vp::grid g = vp::fit(mesh.positions, glm::ivec3(n));
                const auto bits = vp::constant(true);
                bench::say(mesh.name + " " + std::to_string(n) + (is_mean ? " mean" : " occupancy"));
                measured dense;
                if (n <= how.largest_dense)
                    dense = is_mean ? measure<dense_mean, pass_position>(mesh, g, give_position{}, how)
                                    : measure<dense_bits, vp::passthrough>(mesh, g, bits, how);
                const measured m = is_mean ? measure<sparse_mean, pass_position>(mesh, g, give_position{}, how)
                                           : measure<sparse_bits, vp::passthrough>(mesh, g, bits, how);
                rows.add_row({mesh.name, std::to_string(n), is_mean ? "mean" : "occupancy", std::to_string(m.bricks),
                              std::to_string(m.voxels), significant(m.ms, 4),
                              dense.ms > 0 ? significant(dense.ms, 4) : std::string{}, mib(m.bytes), mib(m.peak),
                              growth(static_cast<double>(m.voxels), static_cast<double>(before.voxels)),
                              growth(m.ms, before.ms),
                              growth(static_cast<double>(m.bytes), static_cast<double>(before.bytes))});
                before = m;
            }
        }
    }
    std::string text =
        "# Sparse framebuffers on the CPU\n\n" + bench::describe_machine().markdown() + "- command: `" + command +
        "`\n- milliseconds of whole calls, medians; conservative coverage; mean: the sums of four floats "
        "that vary and a count\n- peak: resident memory of the process, mesh and result included\n"
        "- the last three columns: growth since the row before\n";
    for (const std::string& note : notes) text += "- " + note + "\n";
    text += "\n" + rows.markdown();
    std::cout << text;
    if (!how.out.empty()) {
        bench::write_file(std::filesystem::path(how.out) / "cpu_sparse.md", text);
        bench::write_file(std::filesystem::path(how.out) / "cpu_sparse.csv", rows.csv());
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"cpu_backend's times and memory of sparse framebuffers over the grid's size"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes")->capture_default_str();
    app.add_option("--mesh", how.meshes, "A scene, a generated mesh or a file; may be repeated. Default: five scenes");
    app.add_option("--resolution", how.resolutions, "Voxels a side; may be repeated")->capture_default_str();
    app.add_option("--threads", how.threads, "0: as many as the machine runs at once")->capture_default_str();
    app.add_option("--seconds", how.seconds, "Time to spend on each figure, at least three runs")
        ->capture_default_str();
    app.add_option("--largest-dense", how.largest_dense, "Largest grid of dense targets")->capture_default_str();
    app.add_option("--out", how.out, "Folder for cpu_sparse.md and cpu_sparse.csv");
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how, bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_cpu_sparse: %s\n", e.what());
        return 1;
    }
}
