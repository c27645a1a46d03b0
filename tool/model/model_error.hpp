// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Errors of models that cannot be used and of files that cannot be written, whatever their format; the exit codes of
// the program.

#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {

// As --help prints them.
enum exit_code : int {
    exit_ok = 0,
    exit_usage = 1,     // the command line makes no sense
    exit_input = 2,     // the model or the list cannot be read, or there is nothing to voxelize
    exit_too_large = 3, // the work does not fit into memory, or with --backend cuda into the GPU's
    exit_output = 4,    // an output file cannot be written
    exit_backend = 5,   // the backend is not built in, or has no driver, device or code for the device
    exit_internal = 70  // a bug of this program
};

// One line without control characters, for a person.
struct model_error : std::runtime_error {
    using std::runtime_error::runtime_error;

    std::vector<std::string> warnings; // what was found before it came to that; one line each
    bool lenient_helps = false;        // load_options::lenient would have gone on
};

// Thrown by writers: the path and the reason in one line, ready to be shown to a person.
class write_error : public std::runtime_error {
public:
    write_error(const std::filesystem::path& path, std::string_view reason)
        : std::runtime_error("cannot write '" + path.string() + "': " + std::string(reason)) {}
};

// A picture does not fit into memory: the message names it.
class picture_memory_error : public std::bad_alloc {
public:
    // NOLINTNEXTLINE(bugprone-throw-keyword-missing): message_ is a member
    explicit picture_memory_error(const std::string& picture) : message_(picture) {}
    [[nodiscard]] const char* what() const noexcept override { return message_.what(); }

private:
    std::runtime_error message_; // which copies without throwing
};

} // namespace voxelize
