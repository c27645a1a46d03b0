// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The program's account of its work: a progress bar on terminals, statistics as text or as one JSON object.

#include "draw/voxelizer.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace voxelize {

// One line on standard error that is drawn over; only where that is a terminal, and only for work of more than half a
// second.
class progress_bar {
public:
    explicit progress_bar(bool enabled);
    ~progress_bar() { clear(); }
    progress_bar(const progress_bar&) = delete;
    progress_bar& operator=(const progress_bar&) = delete;

    // From here on, WHAT is being done.
    void start(std::string what);
    // DONE from 0 to 1; one call at a time.
    void show(double done);
    void clear();

private:
    bool enabled_;
    bool drawn_ = false;
    std::string what_;
    int percent_ = -1;
    std::chrono::steady_clock::time_point start_{};
};

// The mesh of --remesh.
struct surface_result {
    voxelpipe::surface_counters counts;
    std::int64_t euler = 0; // V - E + F
};

// Everything that --stats prints.
struct run_report {
    std::filesystem::path input;
    voxelize_request request;
    voxelize_stats stats; // with the stages of reading and writing in place
    std::uint64_t vertices = 0;
    std::vector<std::string> materials; // names, by the numbers of --target material
    std::vector<std::filesystem::path> files;
    std::vector<std::string> warnings;
    std::uint64_t peak_memory = 0;         // bytes
    std::optional<surface_result> surface; // of --remesh
    bool is_sparse = false;                // the voxels were kept in bricks:
    std::uint64_t bricks = 0, brick_bytes = 0;
};

// Adds the stage "other": what is left of the program's wall time, so that the stages add up to it.
void add_rest(run_report& report, double wall_milliseconds);

void print_text(std::ostream& stream, const run_report& report);
void print_json(std::ostream& stream, const run_report& report);

} // namespace voxelize
