// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "output.hpp"

#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace bench {

void say(const std::string& line) {
    std::fprintf(stderr, "%s\n", line.c_str());
    std::fflush(stderr);
}

void write_file(const std::filesystem::path& file, const std::string& text) {
    if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
    std::ofstream out(file);
    out << text;
    if (!out.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

std::string command_line(int argc, const char* const* argv) {
    std::string text = std::filesystem::path(argv[0]).filename().string();
    for (int i = 1; i < argc; ++i) {
        const std::filesystem::path word = argv[i];
        text += ' ';
        text += (word.is_absolute() ? word.filename() : word).string();
    }
    return text;
}

} // namespace bench
