// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Solids into bits on a GPU, by scene, grid and fill rule or repair: the whole call, the same captured as a graph, a
// plain baseline of ours (one thread a triangle, each voxel behind a crossing flipped by an atomic), whose bits must be
// the same, the floor measured in the same run, and the fastest published figure. Repairs wait on the host, so they
// have whole calls only. Prints a table of medians; --out writes it as CSV too. --scaling times both rules over
// triangles, 10^3 to 10^7 on a sphere, and over grids instead.

#include "floors.hpp"
#include "generated_on_device.hpp"
#include "output.hpp"
#include "run.hpp"
#include "scene_choice.hpp"
#include "table.hpp"

#include <voxelpipe/solid/device/solid_async.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

// ---- the baseline ---------------------------------------------------------------------------------------------------

constexpr unsigned block_size = 256;

__global__ void flip_behind_triangles(const vp::mesh_view<> mesh, const vp::core::snap_transform snap,
                                      const glm::ivec3 extent, std::uint32_t* words) {
    const std::size_t i = std::size_t{blockIdx.x} * block_size + threadIdx.x;
    if (i >= mesh.triangles.size()) return;
    const glm::uvec3 index = mesh.triangles[i];
    vp::core::snapped_position p[3];
    for (int k = 0; k < 3; ++k) {
        const glm::vec3 v = mesh.positions[index[k]];
        p[k] = vp::core::snap(snap, v.x, v.y, v.z);
        if (!vp::core::is_drawable(p[k])) return;
    }
    const vp::core::voxel_box whole{{{0, 0, 0}}, {{extent.x - 1, extent.y - 1, extent.z - 1}}};
    const auto rows = vp::core::rows_within<0>(p[0], p[1], p[2], snap.fraction, whole);
    vp::core::for_each_crossing<0, vp::core::centre_offset<>>(
        p[0], p[1], p[2], snap.fraction, rows, [&](std::int64_t y, std::int64_t z, std::int64_t first, int) {
            const std::int64_t words_x = (extent.x + 31) / 32;
            std::uint32_t* const row = words + (z * extent.y + y) * words_x;
            for (std::int64_t x = first < 0 ? 0 : first; x < extent.x; x = (x / 32 + 1) * 32) {
                const std::int64_t left = extent.x - x / 32 * 32;
                atomicXor(row + x / 32, (left < 32 ? (1u << left) - 1 : ~0u) & (~0u << (x & 31)));
            }
        });
}

__global__ void count_different(const std::uint32_t* a, const std::uint32_t* b, std::size_t count,
                                unsigned long long* different) {
    unsigned long long mine = 0;
    for (std::size_t i = std::size_t{blockIdx.x} * block_size + threadIdx.x; i < count; i += gridDim.x * block_size)
        mine += static_cast<unsigned>(__popc(a[i] ^ b[i]));
    if (mine != 0) atomicAdd(different, mine);
}

std::uint64_t differences(const gpu::session& s, const std::uint32_t* a, const std::uint32_t* b, std::size_t count) {
    const gpu::device_array<unsigned long long> on_device(1);
    gpu::check(cudaMemsetAsync(on_device.data(), 0, on_device.bytes(), s.stream()), "comparison");
    count_different<<<1024, block_size, 0, s.stream()>>>(a, b, count, on_device.data());
    gpu::check(cudaGetLastError(), "comparison");
    unsigned long long different = 0;
    gpu::check(cudaMemcpyAsync(&different, on_device.data(), sizeof(different), cudaMemcpyDeviceToHost, s.stream()),
               "comparison");
    s.wait();
    return different;
}

// ---- the table ------------------------------------------------------------------------------------------------------

struct options : gpu::run_options {
    bool baseline = true, repairs = true, scaling = false;
    int scaling_resolution = 512, max_resolution = 2048; // of the series triangles, and where the series grid ends
};

// The draws of a cell.
struct solid_kind {
    std::string_view name;
    vp::solid_options options;
};
constexpr solid_kind rules[] = {{"even_odd", {.rule = vp::fill_rule::even_odd}},
                                {"nonzero", {.rule = vp::fill_rule::nonzero}}};
constexpr solid_kind repairs[] = {{"close_holes", {.rule = vp::fill_rule::nonzero, .repair = vp::repair::close_holes}},
                                  {"exterior", {.repair = vp::repair::exterior}},
                                  {"vote", {.repair = vp::repair::vote}}};
bool is_parity(const solid_kind& kind) { return kind.options.rule == vp::fill_rule::even_odd; }

struct published_solid {
    std::string_view scene;
    int resolution;
    double peer; // ms
};
// The fastest of three kernels of two public voxelizers, clear included, on an H200; their sets are not exact.
constexpr published_solid published_solids[] = {
    {"conference", 128, 2.62},   {"conference", 512, 12.6},   {"conference", 1024, 15.2},   {"dragon", 128, 0.0245},
    {"dragon", 512, 0.262},      {"dragon", 1024, 1.67},      {"blade", 128, 0.0308},       {"blade", 512, 0.139},
    {"blade", 1024, 0.633},      {"hairball", 128, 0.0825},   {"hairball", 512, 1.30},      {"hairball", 1024, 6.80},
    {"asiandragon", 128, 0.089}, {"asiandragon", 512, 0.215}, {"asiandragon", 1024, 0.675},
};
double published_peer(std::string_view scene, int n) {
    for (const auto& p : published_solids)
        if (p.scene == scene && p.resolution == n) return p.peer;
    return 0;
}

// One scene in one grid.
class solid_cell {
    using target = vp::target<vp::bit, vp::blend::bit_or>;
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;

public:
    solid_cell(gpu::session& s, const gpu::resident_mesh& mesh, const vp::grid& g)
        : session_(s), backend_(s.stream()), grid_(g), framebuffer_(backend_, g.extent) {
        vp::mesh_view<> view{{mesh.positions.data(), mesh.positions.size()},
                             {mesh.triangles.data(), mesh.triangles.size()}};
        view.checked = vp::check_indices(backend_, view.triangles);
        draw_ = {view, {}, {true}};
    }

    vp::status call(const solid_kind& kind) {
        const vp::status s = vp::voxelize_solid(backend_, draws(), grid_, framebuffer_, kind.options);
        if (s.code == vp::status_code::out_of_memory) throw gpu::out_of_device_memory(s.message());
        s.or_throw();
        return s;
    }
    // Times the call as a graph. Empty if no limits suffice.
    sample time_async(const solid_kind& kind, const gpu::repetition& how, std::uint64_t crossings) {
        const vp::solid_options& options = kind.options;
        vp::workspace_limits limits;
        limits.fragments = is_parity(kind) ? 0 : crossings + 1024;
        const std::size_t bytes = vp::solid_workspace_bytes(draws(), grid_, framebuffer_.view(), options, limits);
        const gpu::device_array<std::byte> memory(bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        const auto launch = [&] {
            vp::voxelize_solid_async(backend_, draws(), grid_, framebuffer_.view(), options, workspace).or_throw();
        };
        launch();
        vp::read_status(backend_, workspace).or_throw();
        const gpu::captured_call graph(session_, launch);
        const sample t = gpu::time_calls(session_, how, [&] { graph.launch(); });
        vp::read_status(backend_, workspace).or_throw();
        return t;
    }
    // Times the baseline. Throws if its bits differ from those of the last call.
    sample time_baseline(const gpu::repetition& how) {
        const std::size_t count = target::map::elements(grid_.extent);
        const gpu::device_array<std::uint32_t> words(count);
        const auto blocks = static_cast<unsigned>((draw_.mesh.triangles.size() + block_size - 1) / block_size);
        const sample t = gpu::time_calls(session_, how, [&] {
            gpu::check(cudaMemsetAsync(words.data(), 0, words.bytes(), session_.stream()), "baseline");
            flip_behind_triangles<<<blocks, block_size, 0, session_.stream()>>>(
                draw_.mesh, vp::core::make_snap_transform(grid_), grid_.extent, words.data());
            gpu::check(cudaGetLastError(), "baseline");
        });
        const std::uint64_t n = differences(session_, vp::get<0>(framebuffer_).view().elements, words.data(), count);
        if (n != 0) throw std::runtime_error(std::to_string(n) + " voxels are not those of the baseline");
        return t;
    }
    [[nodiscard]] std::uint64_t bytes() const { return target::map::elements(grid_.extent) * sizeof(std::uint32_t); }

private:
    [[nodiscard]] std::span<const draw_type> draws() const { return {&draw_, 1}; }
    gpu::session& session_;
    vp::cuda_backend backend_;
    draw_type draw_;
    vp::grid grid_;
    vp::framebuffer<vp::cuda_backend, target> framebuffer_;
};

int run(const options& how, const std::string& command) {
    gpu::session session;
    gpu::clock_watch watch;
    table rows({"scene", "resolution", "rule", "triangles", "crossings", "voxels", "open_rows", "ms", "async_ms",
                "baseline_ms", "floor_ms", "peer_ms", "peer/ours", "peer/async", "baseline/ours"});
    std::vector<std::string> notes;
    const std::vector<std::string> names = how.names.empty() ? available_scenes(how.scenes, notes) : how.names;
    const auto ms = [](double value) { return value > 0 ? significant(value, 4) : std::string{}; };
    const auto ratio = [](double a, double b) { return a > 0 && b > 0 ? significant(a / b) : std::string{}; };
    std::vector<double> ahead[2]; // of the peer, by rule
    bool failed = false;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        const gpu::resident_mesh mesh = gpu::upload(data);
        const double gather = gpu::gather_ms(session, mesh);
        for (const int n : how.resolutions) try {
                solid_cell cell(session, mesh, vp::fit(data.positions, glm::ivec3(n)));
                const double floor = gather + gpu::memset_ms(session, cell.bytes());
                for (const solid_kind& kind : rules) {
                    const bool parity = is_parity(kind);
                    const vp::status s = cell.call(kind);
                    const sample whole = gpu::time_calls(session, how.repeat, [&] { (void)cell.call(kind); });
                    sample baseline;
                    if (how.baseline && parity) baseline = cell.time_baseline({1, 5, 2, 1});
                    const sample async = cell.time_async(kind, how.repeat, s.solid.crossings);
                    watch.read();
                    const double peer = published_peer(data.name, n);
                    if (peer > 0) ahead[parity ? 0 : 1].push_back(peer / whole.median);
                    rows.add_row({data.name, std::to_string(n), std::string(kind.name),
                                  std::to_string(data.triangles.size()), std::to_string(s.solid.crossings),
                                  std::to_string(s.counts.voxels), std::to_string(s.solid.open_rows), ms(whole.median),
                                  ms(async.median), ms(baseline.median), ms(floor), ms(peer), ratio(peer, whole.median),
                                  ratio(peer, async.median), ratio(baseline.median, whole.median)});
                    say(data.name + " " + std::to_string(n) + " " + std::string(kind.name) + " " +
                        significant(whole.median) + " ms");
                }
                if (how.repairs)
                    for (const solid_kind& kind : repairs) {
                        const vp::status s = cell.call(kind);
                        const sample whole = gpu::time_calls(session, how.repeat, [&] { (void)cell.call(kind); });
                        rows.add_row({data.name, std::to_string(n), std::string(kind.name),
                                      std::to_string(data.triangles.size()), std::to_string(s.solid.crossings),
                                      std::to_string(s.counts.voxels), std::to_string(s.solid.open_rows),
                                      ms(whole.median), "", "", ms(floor), "", "", "", ""});
                        say(data.name + " " + std::to_string(n) + " " + std::string(kind.name) + " " +
                            significant(whole.median) + " ms");
                    }
                session.trim();
            } catch (const std::exception& e) {
                failed = true;
                notes.push_back("failed: " + name + " " + std::to_string(n) + ": " + e.what());
                say(notes.back());
            }
    }
    notes.push_back("ahead of the peer, geometric means: even_odd " + significant(geometric_mean(ahead[0])) +
                    ", nonzero " + significant(geometric_mean(ahead[1])));
    gpu::write_report(how,
                      {"Solids into bits on a GPU",
                       "gpu_solids",
                       "CUDA events around the whole call, clear included, mesh on the device",
                       {"peer: quoted, the fastest of three kernels of two public voxelizers on an NVIDIA H200; their "
                        "sets are not exact"},
                       notes,
                       {}},
                      watch, command, rows);
    return failed ? 1 : 0;
}

// ---- the curves -----------------------------------------------------------------------------------------------------

int run_scaling(const options& how, const std::string& command) {
    gpu::session session;
    gpu::clock_watch watch;
    table rows({"series", "variant", "cell", "x", "resolution", "triangles", "fragments", "ms", "ms_q1", "ms_q3",
                "runs", "async_ms", "baseline_ms", "mtriangles_per_s", "mfragments_per_s"});
    std::vector<std::string> notes;
    bool failed = false;
    const auto point = [&](const std::string& series, const std::string& variant, double x,
                           const gpu::resident_mesh& mesh, const vp::grid& g) {
        const auto ms = [](double value) { return value > 0 ? significant(value, 4) : std::string{}; };
        try {
            solid_cell cell(session, mesh, g);
            for (const solid_kind& kind : rules) {
                const vp::status s = cell.call(kind);
                const sample whole = gpu::time_calls(session, how.repeat, [&] { (void)cell.call(kind); });
                sample baseline;
                if (how.baseline && is_parity(kind)) baseline = cell.time_baseline({1, 3, 2, 1});
                const sample async = cell.time_async(kind, how.repeat, s.solid.crossings);
                watch.read();
                const auto per_second = [&](std::uint64_t n) {
                    return significant(static_cast<double>(n) / whole.median * 1e-3, 4);
                };
                rows.add_row({series, variant, "bit_solid_" + std::string(kind.name), significant(x, 9),
                              std::to_string(g.extent.x), std::to_string(mesh.triangles.size()),
                              std::to_string(s.solid.crossings), ms(whole.median), ms(whole.low_quartile),
                              ms(whole.high_quartile), std::to_string(whole.runs), ms(async.median),
                              ms(baseline.median), per_second(mesh.triangles.size()), per_second(s.solid.crossings)});
                say(series + " " + significant(x, 9) + " " + std::string(kind.name) + " " + ms(whole.median) + " ms");
            }
        } catch (const std::exception& e) {
            failed = true;
            notes.push_back("failed: " + series + " " + significant(x, 9) + ": " + e.what());
            say(notes.back());
        }
        session.trim();
    };
    const vp::grid unit = gpu::unit_grid(how.scaling_resolution);
    for (const std::uint64_t wanted :
         {1'000u, 3'000u, 10'000u, 30'000u, 100'000u, 300'000u, 1'000'000u, 3'000'000u, 10'000'000u}) {
        const gpu::resident_mesh mesh = gpu::sphere_of_quads(gpu::quads_for(wanted), how.scaling_resolution);
        point("triangles", "sphere", static_cast<double>(mesh.triangles.size()), mesh, unit);
    }
    const std::string name = how.names.empty() ? available_scenes(how.scenes, notes)[1] : how.names[0]; // dragon
    const mesh_data data = find_mesh(how.scenes, name);
    const gpu::resident_mesh mesh = gpu::upload(data);
    for (int n = 64; n <= how.max_resolution; n *= 2)
        point("grid", data.name, n, mesh, vp::fit(data.positions, glm::ivec3(n)));
    gpu::write_report(how,
                      {"Solids into bits on a GPU, over triangles and grids",
                       "gpu_solids_scaling",
                       "clear included, mesh on the device; fragments: crossings",
                       {},
                       notes,
                       {}},
                      watch, command, rows);
    return failed ? 1 : 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    how.resolutions = {128, 256, 512, 1024};
    gpu::command line("bench_gpu_solids",
                      "cuda_backend's times of solids next to a plain baseline, the floor and published figures", how,
                      "gpu_solids.md and gpu_solids.csv, or gpu_solids_scaling");
    line.add_meshes();
    line.add_flag("!--no-baseline", how.baseline, "Leave out the baseline");
    line.add_flag("!--no-repairs", how.repairs, "Leave out the repairs");
    line.add_flag("--scaling", how.scaling, "Curves over triangles and grids, instead of the table");
    line.add("--most-resolution", how.max_resolution, "Where the curve over grids ends");
    return line.run(argc, argv, [&](const std::string& command) {
        return how.scaling ? run_scaling(how, command) : run(how, command);
    });
}
