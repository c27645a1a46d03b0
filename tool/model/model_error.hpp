// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Errors of models that cannot be used and of files that cannot be written, whatever their format.

#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {

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
