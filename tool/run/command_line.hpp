// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// argv -> options, checked as far as that goes without reading the model.

#include "draw/sparse/sparse_voxelizer.hpp"
#include "draw/voxelizer.hpp"
#include "model/placement.hpp"
#include "read/model_file.hpp"
#include "write/formats/formats.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace voxelize {

enum class stats_format : std::uint8_t { none, text, json };

// Many models in one run (batch.hpp), or one by several processes (slab_run.hpp).
struct batch_request {
    std::filesystem::path list; // a file with a model a line, "-" for standard input; empty: there is one model
    int rank = 0;               // this process takes the models, or the slabs, whose number is RANK modulo WORLD_SIZE
    int world_size = 1;
    int jobs = 1; // models at a time
};

struct command_line {
    std::filesystem::path input; // empty with batch.list
    batch_request batch;
    std::vector<std::string> arguments; // as given, without those of --list and of the machine that change no output
    std::vector<std::filesystem::path> outputs;
    load_options load;
    grid_request grid;
    voxelize_request voxelize; // all but its grid and progress
    // Targets that only some outputs ask for: those that show the voxels' shape or colours. Formats that hold every
    // target leave them out, so that one output does not change the content or the names of another.
    std::vector<target> implied;
    storage_choice storage = storage_choice::automatic;
    bool by_slabs = false;                    // one model, drawn and written slab by slab
    write_options write;                      // all but its progress and blocks
    std::filesystem::path block_file;         // the list of blocks; empty: there is none
    std::shared_ptr<const block_list> blocks; // as it is read
    std::uint64_t max_memory = 0;             // bytes, resident; 0: what the machine has
    std::vector<std::string> warnings;        // of what makes sense, but hardly what was meant; one line each
    stats_format stats = stats_format::none;
    bool quiet = false;
};

// Asked for --help or --version: TEXT goes to standard output and the program ends well.
struct early_exit {
    std::string text;
};

// A fault of the command line, one line.
struct usage_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Throws early_exit or usage_error.
[[nodiscard]] command_line parse_command_line(int argc, const char* const* argv);

} // namespace voxelize
