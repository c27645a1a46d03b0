// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Work by libraries that hostile input may crash, in a process of its own: whatever happens there, this process gets
// bytes or a model_error, within bounded time and memory.

#include "model/model_error.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace voxelize {

// The work ran out of the memory that it was given.
struct isolation_memory_error : model_error {
    using model_error::model_error;
};

struct isolation_limits {
    std::uint64_t memory = std::uint64_t{1} << 30; // bytes of address space beyond what this process has
    std::uint64_t seconds = 10;                    // of processor time
    std::uint64_t result = std::uint64_t{1} << 30; // bytes that may come back
};

// WORK runs in a copy of this process and gives the bytes that come back. It may throw: a std::exception's text comes
// back as a model_error, lack of memory as an isolation_memory_error. So does the end by a signal or by lack of time,
// all in one line that begins with WHO
// ("assimp"). WORK must not wait for other threads of this process: they are not in the copy. Sanitizers, which reserve
// address space of their own, run it without the bound on memory.
[[nodiscard]] std::vector<std::byte> run_isolated(const std::function<std::vector<std::byte>()>& work,
                                                  const isolation_limits& limits, const std::string& who);

} // namespace voxelize
