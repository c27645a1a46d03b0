// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The facts beside every GPU figure: device, driver, CUDA, and the clocks while it was measured. Clocks come from
// NVML, which is loaded at run time where the driver brings it; without it they are "unknown".

#include <cuda_runtime_api.h>

#include <string>

namespace bench::gpu {

struct clocks {
    unsigned sm = 0, memory = 0; // MHz; 0: unknown
};

// Reads the clocks of the current device; keeps the range of what it has read.
class clock_watch {
public:
    clock_watch();
    ~clock_watch();
    clock_watch(const clock_watch&) = delete;
    clock_watch& operator=(const clock_watch&) = delete;

    // Best called right after work, for an idle device lowers its clocks.
    clocks read();
    [[nodiscard]] std::string driver() const; // "unknown" without NVML
    // "SM 1980-1980 MHz, memory 3201-3201 MHz"
    [[nodiscard]] std::string range() const;

private:
    struct library;
    library* nvml_ = nullptr;
    clocks low_, high_;
};

// Lines of Markdown: name, compute capability, multiprocessors, memory, L2, versions.
[[nodiscard]] std::string describe_device(const clock_watch& watch);

} // namespace bench::gpu
