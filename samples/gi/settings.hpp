// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The user's choices, and the command line that says them.

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace gi {

// The device that renders frames: `automatic` takes a GPU if the program is built for one and finds it.
enum class backend_choice : std::uint8_t { automatic, cpu, cuda };

enum class view_choice : std::uint8_t { final, direct, ao, indirect, level };

struct settings {
    std::string scene = "cornell"; // cornell, atrium or a file
    std::filesystem::path output = "gi.mp4";
    int width = 1280, height = 720; // pixels
    int resolution = 128;           // voxels along the longest side of the scene
    int frames = 240;
    double start = 0;   // time of the first frame; a whole round is 1
    double round = 240; // frames of a whole round
    view_choice view = view_choice::final;
    int level = 0;      // of view_choice::level
    int samples = 1;    // a side of a pixel
    bool still = false; // nothing moves
    // All cones at every voxel, more and narrower ones at every pixel, none that starts within a wall beside it, and
    // light that bounces more often: for pictures, which may take longer than frames of a film.
    bool thorough = false;
    backend_choice backend = backend_choice::automatic;
    unsigned threads = 0; // of the CPU; 0: one for each core
    bool stats = false, quiet = false, window = false;
};

// Text that --help and the like ask for; not an error.
struct early_exit {
    std::string text;
};
// The command line makes no sense: one line.
struct usage_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Throws early_exit and usage_error.
[[nodiscard]] settings parse_command_line(int argc, const char* const* argv);

} // namespace gi
