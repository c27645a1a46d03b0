// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counts what the program that links counted_allocations.cpp has allocated with new and not yet deleted.

#include <atomic>
#include <cstdint>

namespace unit {

extern std::atomic<std::int64_t> live_allocations;

} // namespace unit
