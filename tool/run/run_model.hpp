// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// One model, from its file to the outputs.

#include "command_line.hpp"
#include "model/model_error.hpp"
#include "report.hpp"

#include <chrono>
#include <string>

namespace voxelize {

class output_check;

struct run_outcome {
    exit_code code = exit_ok;
    bool is_conflict = false; // an output would replace a file that the run needs
    std::string error;        // one line, if the code is not exit_ok
    run_report report;        // of a failure, the warnings alone
};

// Does the work of a command line. The program, or this model, began at BEGIN. known: of a list, what all of its models
// read and write; may be null. Throws nothing.
[[nodiscard]] run_outcome run_model(const command_line& options, std::chrono::steady_clock::time_point begin,
                                    output_check* known = nullptr);

} // namespace voxelize
