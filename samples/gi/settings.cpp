// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "settings.hpp"

#include <CLI/CLI.hpp>

#include <charconv>
#include <map>

namespace gi {
namespace {

// Two whole numbers with an x between them.
bool read_size(const std::string& text, int& width, int& height) {
    const char* const end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, width);
    if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return false;
    const auto second = std::from_chars(first.ptr + 1, end, height);
    return second.ec == std::errc() && second.ptr == end;
}

view_choice read_view(const std::string& text, int& level) {
    static const std::map<std::string, view_choice> names{{"final", view_choice::final},
                                                          {"direct", view_choice::direct},
                                                          {"ao", view_choice::ao},
                                                          {"indirect", view_choice::indirect},
                                                          {"voxels", view_choice::level}};
    if (const auto found = names.find(text); found != names.end()) return found->second;
    const char* const end = text.data() + text.size();
    if (text.rfind("level:", 0) == 0) {
        const auto number = std::from_chars(text.data() + 6, end, level);
        if (number.ec == std::errc() && number.ptr == end && level >= 0 && level <= 10) return view_choice::level;
    }
    throw usage_error("--view is final, direct, ao, indirect, voxels or level:K with K from 0 to 10, not " + text);
}

backend_choice read_backend(const std::string& text) {
    if (text == "auto") return backend_choice::automatic;
    if (text == "cpu") return backend_choice::cpu;
    if (text == "cuda") return backend_choice::cuda;
    throw usage_error("--backend is auto, cpu or cuda, not " + text);
}

void check_range(const char* name, double value, double low, double high) {
    const auto text = [](double v) { return std::to_string(static_cast<long long>(v)); };
    if (!(value >= low && value <= high))
        throw usage_error(std::string(name) + " is from " + text(low) + " to " + text(high));
}

} // namespace

settings parse_command_line(int argc, const char* const* argv) {
    settings s;
    std::string size = "1280x720", view = "final", backend = "auto";
    CLI::App app{"Voxel cone tracing: a scene that is voxelized again in every frame, lit by its own voxels.", "gi"};
    app.footer("\nOutputs: .mp4, .mkv, .webm (needs ffmpeg; without it a .png a frame beside it), or .png.\n"
               "Exit codes: 0 done, 1 command line, 2 scene, 3 memory, 4 output, 70 a bug.");
    app.add_option("--scene", s.scene, "cornell, atrium, or a model's file (.glb, .gltf, .obj ...)")
        ->capture_default_str();
    app.add_option("-o,--output", s.output, "the film or picture")->capture_default_str();
    app.add_option("--frames", s.frames, "pictures to render; 1 writes a .png")->capture_default_str();
    app.add_option("--size", size, "pixels, WIDTHxHEIGHT")->capture_default_str();
    app.add_option("-r,--resolution", s.resolution, "voxels along the scene's longest side")->capture_default_str();
    app.add_option("--view", view, "final, direct, ao, indirect, voxels, or level:K")->capture_default_str();
    app.add_option("--start", s.start, "time of the first frame, from 0 to 1, a whole round")->capture_default_str();
    app.add_option("--round", s.round, "frames of a whole round")->capture_default_str();
    app.add_option("--samples", s.samples, "rays a side of a pixel: 2 is 4 a pixel")->capture_default_str();
    app.add_flag("--still", s.still, "nothing moves, every frame stands at --start");
    app.add_flag("--thorough", s.thorough, "more cones and bounces, no dark seams in corners: for pictures, not films");
    app.add_option("--backend", backend, "auto, cpu or cuda; the pictures are the same")->capture_default_str();
    app.add_option("--threads", s.threads, "0: one for each core")->capture_default_str();
    app.add_flag("--window", s.window, "show it in a window instead, until that is closed");
    app.add_flag("--stats", s.stats, "print milliseconds of each stage");
    app.add_flag("-q,--quiet", s.quiet, "print nothing but errors");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        throw early_exit{app.help()};
    } catch (const CLI::ParseError& e) {
        throw usage_error(e.what());
    }
    s.view = read_view(view, s.level);
    s.backend = read_backend(backend);
    if (!read_size(size, s.width, s.height)) throw usage_error("--size is WIDTHxHEIGHT, not " + size);
    check_range("--size's width", s.width, 1, 16384);
    check_range("--size's height", s.height, 1, 16384);
    check_range("--resolution", s.resolution, 16, 1024);
    check_range("--frames", s.frames, 1, 1000000);
    check_range("--samples", s.samples, 1, 16);
    check_range("--start", s.start, 0, 1);
    check_range("--round", s.round, 1, 1000000);
    check_range("--threads", s.threads, 0, 1024);
    return s;
}

} // namespace gi
