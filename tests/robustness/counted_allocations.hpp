// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counts what the program that links counted_allocations.cpp has got from operator new and std::aligned_alloc (what
// cpu_backend::buffer allocates with) and not yet given back, and refuses allocations on demand. malloc called by
// others is not counted. Needs the linker options --wrap=aligned_alloc and --wrap=free.

#include <atomic>
#include <cstdint>
#include <limits>

namespace unit {

extern std::atomic<std::int64_t> live_allocations;

// How many more allocations succeed, of all threads together: each one takes 1, and is refused where none is left.
// Below zero if one has been refused.
inline constexpr std::int64_t no_end_of_allocations = std::numeric_limits<std::int64_t>::max();
extern std::atomic<std::int64_t> allocations_left;

} // namespace unit
