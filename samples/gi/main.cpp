// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// gi: cone-traced light in a scene that is voxelized again in every frame. See --help.

#include "film.hpp"
#include "renderer.hpp"
#include "window.hpp"

#include "model/model_error.hpp"
#include "run/report.hpp"
#include "write/formats/output_file.hpp"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <new>

namespace gi {
namespace {

scene make_scene(const settings& s) {
    if (s.scene == "cornell") return make_cornell();
    if (s.scene == "atrium") return make_atrium();
    return load_scene(s.scene);
}

std::unique_ptr<renderer> make_renderer(scene world, const settings& s) {
    if (s.backend == backend_choice::cpu) return make_cpu_renderer(std::move(world), s);
    const std::string why = why_no_cuda();
    if (why.empty()) return make_cuda_renderer(std::move(world), s);
    if (s.backend == backend_choice::cuda) throw usage_error("--backend cuda: " + why);
    return make_cpu_renderer(std::move(world), s);
}

// Medians over the frames but the first, which does more.
void print_stats(const std::vector<frame>& frames, const std::string& device) {
    std::cout << "milliseconds a frame on " << device << (frames.size() > 1 ? ", median without the first" : "")
              << ":\n";
    std::vector<double> totals;
    const std::size_t first = frames.size() > 1 ? 1 : 0;
    const auto median = [](std::vector<double> v) {
        std::sort(v.begin(), v.end());
        return v[v.size() / 2];
    };
    for (std::size_t stage = 0; stage < frames[0].milliseconds.size(); ++stage) {
        std::vector<double> times;
        for (std::size_t i = first; i < frames.size(); ++i) times.push_back(frames[i].milliseconds[stage].second);
        std::printf("  %-10s%10.2f\n", frames[0].milliseconds[stage].first.c_str(), median(times));
    }
    for (std::size_t i = first; i < frames.size(); ++i) {
        double sum = 0;
        for (const auto& [stage, ms] : frames[i].milliseconds) sum += ms;
        totals.push_back(sum);
    }
    std::printf("  %-10s%10.2f\n", "frame", median(totals));
}

void run(const settings& s) {
    scene world = make_scene(s);
    if (!s.quiet)
        for (const std::string& warning : world.warnings) std::cerr << "gi: warning: " << warning << '\n';
    const std::unique_ptr<renderer> renderer = make_renderer(std::move(world), s);
    if (s.window) return show_window(*renderer, s);
    const std::unique_ptr<film> out = open_film(s);
    voxelize::progress_bar bar{!s.quiet && s.frames > 1};
    bar.start("rendering on " + renderer->device());
    std::vector<frame> frames;
    for (int i = 0; i < s.frames; ++i) {
        frame made = renderer->render(s.still ? s.start : s.start + i / s.round);
        out->add(made.pixels);
        made.pixels = {};
        frames.push_back(std::move(made));
        bar.show(static_cast<double>(i + 1) / s.frames);
    }
    bar.clear();
    const auto files = out->finish();
    if (!s.quiet) {
        std::cout << "wrote " << files.front().string();
        if (files.size() > 1) std::cout << " to " << files.back().string();
        std::cout << '\n';
    }
    if (s.stats) print_stats(frames, renderer->device());
}

int fail(int code, const std::string& why) {
    std::cerr << "gi: " << why << '\n';
    return code;
}

int run_main(int argc, char** argv) {
    settings s;
    try {
        s = parse_command_line(argc, argv);
        run(s);
    } catch (const early_exit& text) {
        std::cout << text.text;
    } catch (const usage_error& error) {
        return fail(voxelize::exit_usage, std::string(error.what()) + "\nTry: gi --help");
    } catch (const voxelize::model_error& error) {
        return fail(voxelize::exit_input, s.scene + ": " + error.what());
    } catch (const std::bad_alloc&) {
        return fail(voxelize::exit_too_large, "out of memory: take a smaller --resolution or --size");
    } catch (const voxelize::write_error& error) {
        return fail(voxelize::exit_output, error.what());
    } catch (const std::exception& error) {
        return fail(voxelize::exit_internal, std::string("unexpected error, please report it: ") + error.what());
    }
    return voxelize::exit_ok;
}

} // namespace
} // namespace gi

int main(int argc, char** argv) { return gi::run_main(argc, argv); }
