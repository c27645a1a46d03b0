// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The command line of the programs that print golden hashes.

#include "cases.hpp"
#include "files.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

namespace golden {

// Prints `name hash` for the cases of these names, for all if there are none. Names that no case has, and cases that
// fail, are named on standard error; the result is the exit code, 1 then.
template <class Backend>
int print_hashes(Backend& backend, const case_table<Backend>& cases, const std::vector<std::string>& names) {
    int code = 0;
    for (const std::string& name : names)
        if (std::none_of(cases.begin(), cases.end(), [&](const auto& c) { return c.name == name; })) {
            std::fprintf(stderr, "%s: there is no such case\n", name.c_str());
            code = 1;
        }
    for (const hashed_case<Backend>& c : cases) {
        if (!names.empty() && std::find(names.begin(), names.end(), c.name) == names.end()) continue;
        try {
            digest d;
            c.run(backend, d);
            std::printf("%s %s\n", c.name.c_str(), d.hex().c_str());
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s: %s\n", c.name.c_str(), error.what());
            code = 1;
        }
    }
    return std::fflush(stdout) == 0 ? code : 1;
}

template <class Backend>
int print_names(const case_table<Backend>& cases) {
    for (const hashed_case<Backend>& c : cases) std::printf("%s\n", c.name.c_str());
    return std::fflush(stdout) == 0 ? 0 : 1;
}

// Runs the program: prints the hash of each case of `cases`. on_threads(unsigned) makes the backend that runs them.
template <class Backend, class OnThreads>
int run_program(const std::vector<std::string>& words, const case_table<Backend>& cases, const OnThreads& on_threads) {
    if (words.size() == 2 && words[0] == "--write-model") return write_models(words[1]);
    if (words.size() == 3 && words[0] == "--file") return print_file(words[1], words[2]);
    if (words.size() == 1 && words[0] == "--list") return print_names(cases);
    unsigned threads = 0;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == "--threads" && i + 1 < words.size()) {
            threads = static_cast<unsigned>(std::strtoul(words[++i].c_str(), nullptr, 10));
        } else if (words[i].starts_with("--")) {
            std::fputs("options: [--threads N] [NAME...] | --list | --write-model FOLDER | --file NAME PATH\n", stderr);
            return 1;
        } else {
            names.push_back(words[i]);
        }
    }
    auto backend = on_threads(threads);
    return print_hashes(backend, cases, names);
}

} // namespace golden
