// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The facts beside every figure: processor, compiler, flags, commit, date, load. And the process's own peak memory.

#include <cstdint>
#include <string>

namespace bench {

struct machine_record {
    std::string cpu;      // model name and how many logical ones
    std::string system;   // kernel and distribution
    std::string compiler; // of this program
    std::string flags;    // what this program was compiled with
    std::string commit;   // built from; "-dirty" where it had changes, "unknown" outside git; or $VOXELPIPE_COMMIT
    std::string date;     // UTC
    std::string load;     // load average of the last minute: near 0 on a quiet machine

    [[nodiscard]] std::string markdown() const;
};

machine_record describe_machine();

// Peak resident memory since the last reset, in bytes; 0 where the system does not say. The reset gives freed memory
// back first.
std::uint64_t peak_memory();
void reset_peak_memory();

} // namespace bench
