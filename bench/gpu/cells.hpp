// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One cell of the table, ready to be called over and over: a mesh on the device, a grid, a target and a coverage rule,
// behind an interface, so that each pipeline is instantiated in one source file and every benchmark only loops.

#include "gpu_report.hpp"
#include "session.hpp"

#include <voxelpipe/stage_times.hpp>
#include <voxelpipe/status.hpp>

#include <memory>

namespace bench::gpu {

namespace vp = voxelpipe;

class prepared_cell {
public:
    prepared_cell() = default;
    virtual ~prepared_cell() = default;
    prepared_cell(const prepared_cell&) = delete;
    prepared_cell& operator=(const prepared_cell&) = delete;

    // The whole of vp::voxelize, clear included; throws where it fails.
    virtual vp::counters call() = 0;
    // call() adds the time of each stage to this from now on; null: to nothing.
    virtual void set_times(vp::stage_times* times) = 0;

    // vp::voxelize_async in memory that is found to suffice, for a cell that has been called; false where there is
    // none.
    virtual bool prepare_async() { return false; }
    virtual void call_async() {}
    // Elements in which the last results of call() and of call_async() differ, where they lie apart.
    virtual std::uint64_t async_differences() { return 0; }

    // The baseline (baseline/one_thread_a_triangle.cuh) with its clear; false where it has no such output.
    virtual bool prepare_baseline() { return false; }
    virtual void call_baseline() {}
    // Elements in which the last results of call() and of call_baseline() differ.
    virtual std::uint64_t differences() { return 0; }
};

// The timings of a cell; runs = 0 if it has no such form. async: captured once as a CUDA graph, as a program would
// that never waits.
struct cell_times {
    vp::counters counts;
    sample whole, async, baseline;
    vp::stage_times stages; // medians
};
struct cell_choice {
    repetition repeat;
    double baseline_seconds = 1; // fewer runs of the baseline once it took so long
    bool async = true, baseline = true;
    int stage_runs = 5; // calls of their own, for the time of each stage; 0: none
};

// Times a cell. With the baseline, what the last timed call of each form left is compared with it; throws
// std::runtime_error where they differ, for a wrong figure is worse than none.
[[nodiscard]] cell_times time_cell(const session& s, prepared_cell& cell, const cell_choice& how);

// The mesh and the session must outlive the cell.
[[nodiscard]] std::unique_ptr<prepared_cell> prepare(session& s, const resident_mesh& mesh, const vp::grid& grid,
                                                     gpu_cell cell);

} // namespace bench::gpu
