// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sweeps the fine raster's policies over scenes, resolutions, targets and rules, checks that none changes a voxel, and
// prints the winner of every cell and, a target, the policy that is best on the whole: what voxelpipe/tuning/ holds,
// with the GPU's name beside it.

#include "device_record.hpp"
#include "machine.hpp"
#include "output.hpp"
#include "policies.hpp"
#include "scene_choice.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <tuple>

namespace bench::gpu {

std::vector<policy>& policies() {
    static std::vector<policy> all;
    return all;
}

} // namespace bench::gpu

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct options {
    std::string scenes = VOXELPIPE_SCENES_DIR;
    std::vector<std::string> meshes; // empty: conference, dragon and hairball, or their stand-ins
    std::vector<int> resolutions{128, 512, 1024};
    gpu::repetition repeat{3, 20, 5, 2};
    std::string out = VOXELPIPE_BENCH_OUTPUT_DIR;
};

// The median, or 0 and why there is none.
double time_policy(gpu::session& s, gpu::prepared_cell& cell, const options& how, std::string& why) {
    try {
        (void)cell.call();
        if (cell.prepare_baseline()) {
            cell.call_baseline();
            if (cell.differences() != 0) throw std::logic_error("a policy changes voxels");
        }
        return gpu::time_calls(s, how.repeat, [&] { (void)cell.call(); }).median;
    } catch (const std::logic_error&) {
        throw;
    } catch (const std::exception& e) { // more registers or shared memory than this GPU has
        why = e.what();
        return 0;
    }
}

int run(const options& how, const std::string& command) {
    std::vector<gpu::policy> all = gpu::policies();
    std::sort(all.begin(), all.end(), [](const gpu::policy& a, const gpu::policy& b) {
        return std::tie(a.log2_tile_size, a.threads_per_block, a.min_blocks_per_sm) <
               std::tie(b.log2_tile_size, b.threads_per_block, b.min_blocks_per_sm);
    });
    std::vector<std::string> names = how.meshes, notes;
    if (names.empty()) {
        const std::vector<std::string> scenes = available_scenes(how.scenes, notes);
        names = {scenes[0], scenes[1], scenes[3]};
    }
    gpu::session session;
    gpu::clock_watch watch;
    table csv({"scene", "resolution", "target", "coverage", "threads_per_block", "log2_tile_size", "min_blocks_per_sm",
               "ms", "over_best", "failure"});
    table winners({"scene", "N", "target", "coverage", "winner", "ms", "second", "slowest / winner"});
    std::map<std::pair<gpu::tuned_target, std::size_t>, std::vector<double>> over_best; // of (target, policy)
    std::map<gpu::tuned_target, int> cells;
    for (const std::string& name : names) {
        const mesh_data data = find_mesh(how.scenes, name);
        notes.push_back(data.name + ": " + std::to_string(data.triangles.size()) + " triangles" +
                        (data.note.empty() ? "" : ", " + data.note));
        const gpu::resident_mesh mesh = gpu::upload(data);
        for (const int n : how.resolutions) {
            const vp::grid grid = vp::fit(data.positions, glm::ivec3(n));
            for (const gpu::tuned_target target : gpu::tuned_targets)
                for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
                    std::vector<std::pair<double, std::size_t>> times; // of those that ran
                    std::vector<std::string> why(all.size());
                    std::vector<double> ms(all.size());
                    for (std::size_t i = 0; i < all.size(); ++i) {
                        const auto cell = all[i].prepare(session, mesh, grid, rule, target);
                        if (cell == nullptr) continue;
                        ms[i] = time_policy(session, *cell, how, why[i]);
                        if (ms[i] > 0) times.emplace_back(ms[i], i);
                    }
                    session.trim();
                    watch.read();
                    std::sort(times.begin(), times.end());
                    if (times.empty()) throw std::runtime_error("no policy runs " + gpu::name_of(target));
                    const auto [best, winner] = times.front();
                    const std::string covers = rule == vp::coverage::thin ? "thin" : "conservative";
                    for (std::size_t i = 0; i < all.size(); ++i) {
                        if (ms[i] == 0 && why[i].empty()) continue;
                        csv.add_row({data.name, std::to_string(n), gpu::name_of(target), covers,
                                     std::to_string(all[i].threads_per_block), std::to_string(all[i].log2_tile_size),
                                     std::to_string(all[i].min_blocks_per_sm), ms[i] > 0 ? significant(ms[i], 4) : "",
                                     ms[i] > 0 ? significant(ms[i] / best) : "", why[i]});
                        if (ms[i] > 0) over_best[{target, i}].push_back(ms[i] / best);
                    }
                    ++cells[target];
                    winners.add_row(
                        {data.name, std::to_string(n), gpu::name_of(target), covers, all[winner].name(),
                         significant(best),
                         times.size() > 1 ? all[times[1].second].name() + ": " + significant(times[1].first) : "",
                         significant(times.back().first / best) + " ×"});
                    say(data.name + " " + std::to_string(n) + " " + gpu::name_of(target) + " " + covers + ": " +
                        all[winner].name() + ", " + significant(best) + " ms");
                }
        }
    }
    // Best on the whole: the geometric mean of its distance to each cell's winner, among those that ran everywhere.
    table whole({"target", "policy", "over the winners, geometric mean", "at worst"});
    for (const gpu::tuned_target target : gpu::tuned_targets) {
        std::vector<std::pair<double, std::size_t>> order;
        for (std::size_t i = 0; i < all.size(); ++i) {
            const auto& distances = over_best[{target, i}];
            if (static_cast<int>(distances.size()) == cells[target] && !distances.empty())
                order.emplace_back(geometric_mean(distances), i);
        }
        std::sort(order.begin(), order.end());
        for (const auto& [mean, i] : order) {
            const auto& distances = over_best[{target, i}];
            whole.add_row({gpu::name_of(target), all[i].name(), significant(mean, 4) + " ×",
                           significant(*std::max_element(distances.begin(), distances.end())) + " ×"});
        }
    }
    std::string text = "# Fine raster policies\n\n" + gpu::describe_device(watch) +
                       "- clocks over the run: " + watch.range() + "\n" + describe_machine().markdown() +
                       "- command: `" + command + "`\n- milliseconds of whole calls, medians of " +
                       std::to_string(how.repeat.runs) + " after " + std::to_string(how.repeat.warmups) +
                       " warm-ups; every policy's voxels are those of the baseline\n";
    for (const std::string& n : notes) text += "- " + n + "\n";
    text += "\n## On the whole, best first\n\n" + whole.markdown() + "\n## Cell by cell\n\n" + winners.markdown();
    const std::filesystem::path folder = how.out;
    write_file(folder / "gpu_tune.md", text);
    write_file(folder / "gpu_tune.csv", csv.csv());
    std::cout << text << "\nwritten to " << folder.string() << ": gpu_tune.md and gpu_tune.csv\n";
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    options how;
    CLI::App app{"Sweeps block and tile sizes of the fine raster"};
    app.add_option("--scenes", how.scenes, "Folder of the benchmark scenes (.vpm or .vpz)")->capture_default_str();
    app.add_option("--mesh", how.meshes, "Scene, generated mesh or file; may be repeated");
    app.add_option("--resolution", how.resolutions, "Voxels along the longest side; may be repeated")
        ->capture_default_str();
    app.add_option("--runs", how.repeat.runs, "Timed calls a figure")->capture_default_str();
    app.add_option("--out", how.out, "Folder for gpu_tune.md and gpu_tune.csv")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        return run(how, bench::command_line(argc, argv));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_gpu_tune: %s\n", e.what());
        return 1;
    }
}
