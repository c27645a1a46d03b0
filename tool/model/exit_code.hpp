// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The program's exit codes, as --help prints them.

namespace voxelize {

enum exit_code : int {
    exit_ok = 0,
    exit_usage = 1,     // the command line makes no sense
    exit_input = 2,     // the model or the list cannot be read, or there is nothing to voxelize
    exit_too_large = 3, // the work does not fit into memory, or with --backend cuda into the GPU's
    exit_output = 4,    // an output file cannot be written
    exit_backend = 5,   // the backend is not built in, or has no driver, device or code for the device
    exit_internal = 70  // a bug of this program
};

} // namespace voxelize
