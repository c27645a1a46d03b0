// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of all languages: where a call on a GPU runs, for files that are compiled without CUDA.

#include <cstdint>

namespace voxelpipe::bindings {

// The device and stream of a call. The stream is the caller's.
struct device_stream {
    int device = 0;
    std::uintptr_t stream = 0; // a cudaStream_t
};

} // namespace voxelpipe::bindings
