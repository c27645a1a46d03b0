// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The command line and the report of the GPU benchmarks. Plain C++: nvcc takes longer for CLI11 than for most of the
// programs that use it.

#include "device_record.hpp"
#include "session.hpp"
#include "table.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bench::gpu {

// The options of every benchmark.
struct run_options {
    std::string scenes = VOXELPIPE_SCENES_DIR; // folder
    std::vector<std::string> names;            // of scenes, generated meshes or files; empty: the five scenes
    std::vector<int> resolutions;              // voxels a side
    repetition repeat;
    std::string out; // folder of the report's files; empty: it is printed only
};

// The command line of a benchmark, which sets options that live longer than it does.
class command {
public:
    // `files` are those that --out writes, for its help. Adds --scenes, --runs, --seconds and --out.
    command(const std::string& name, const std::string& description, run_options& how, const std::string& files);
    ~command();
    command(const command&) = delete;
    command& operator=(const command&) = delete;

    // --mesh and --resolution.
    void add_meshes();
    // An option that is a number or, with several words, may be repeated. The help shows the value that it has now.
    void add(const std::string& option, int& value, const std::string& help);
    void add(const std::string& option, double& value, const std::string& help);
    void add(const std::string& option, std::uint64_t& value, const std::string& help);
    // Without `choices` any word will do.
    void add(const std::string& option, std::vector<std::string>& words, const std::string& help,
             const std::vector<std::string>& choices = {});
    // "--name" sets the value, "!--no-name" clears it.
    void add_flag(const std::string& flag, bool& value, const std::string& help);

    // Calls `body` with the command as it was typed. Returns the program's exit status: that of `body`, or not 0 after
    // a wrong option or an exception, which is printed.
    [[nodiscard]] int run(int argc, char** argv, const std::function<int(const std::string& typed)>& body);

private:
    struct parser;
    std::unique_ptr<parser> parser_;
    std::string name_;
    run_options& how_;
};

// A report: device, commit, date, clocks and command, then how it was timed, facts, notes and the table.
struct run_report {
    std::string title;
    std::string file;               // its name without extension
    std::string timing;             // behind "milliseconds, medians of at most N calls, "
    std::vector<std::string> facts; // a line each
    std::vector<std::string> notes; // further lines: what failed, what stands in for a scene
    std::string after;              // Markdown behind the table
};

// Prints the report and, with --out, writes it as FILE.md and the table as FILE.csv.
void write_report(const run_options& how, const run_report& report, const clock_watch& watch, const std::string& typed,
                  const table& rows);

} // namespace bench::gpu
