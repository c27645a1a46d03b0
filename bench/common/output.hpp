// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Output that every benchmark program writes besides its tables.

#include <filesystem>
#include <string>

namespace bench {

// A line of progress to standard error, at once.
void say(const std::string& line);

// Throws std::runtime_error where the file cannot be written; makes its folder.
void write_file(const std::filesystem::path& file, const std::string& text);

// The program's name and its arguments, absolute paths without their folders: for the record.
[[nodiscard]] std::string command_line(int argc, const char* const* argv);

} // namespace bench
