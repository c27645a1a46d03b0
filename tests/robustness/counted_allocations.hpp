// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counts live allocations by operator new and std::aligned_alloc (which cpu_backend::buffer uses), and lets allocations
// fail on demand. Direct calls of malloc are not counted. Needs the linker options --wrap=aligned_alloc and
// --wrap=free.

#include <atomic>
#include <cstdint>
#include <limits>

namespace unit {

extern std::atomic<std::int64_t> live_allocations;

// Number of allocations that may still succeed, over all threads. Each one subtracts 1 and fails if the result is
// negative, so a negative value means that one failed.
inline constexpr std::int64_t no_end_of_allocations = std::numeric_limits<std::int64_t>::max();
extern std::atomic<std::int64_t> allocations_left;

} // namespace unit
