// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Runs a grid on one CPU thread: blocks one after the other in order of their numbers, and each thread of a block as a
// fiber that runs until it waits for others. Threads of a warp do not run in step, and their order is random each time,
// so a kernel that relies on either fails here sooner than on a device. If threads wait for one another at different
// places, or for lanes that never arrive, the program ends with a message.

#include <cstddef>
#include <cstdint>
#include <functional>

struct uint3 {
    unsigned x, y, z;
};
struct dim3 {
    unsigned x, y, z;
    constexpr dim3(unsigned x_ = 1, unsigned y_ = 1, unsigned z_ = 1) : x(x_), y(y_), z(z_) {}
};

// The running thread's.
extern uint3 threadIdx, blockIdx;
extern dim3 blockDim, gridDim;

namespace emulation {

enum class meeting_kind { syncwarp, ballot, any, all, shuffle, match, add, maximum, disjunction };

// Runs `body` in every thread of a grid. At most 1024 threads a block, along x.
void run_grid(dim3 blocks, dim3 threads, std::size_t shared_bytes, const std::function<void()>& body);

// Waits until all lanes of the mask that have not ended arrive with the same mask and kind. Each lane then gets the
// result of the kind: lanes' predicates as bits, the value of the lane `from`, lanes with the same value, sum, maximum
// or bitwise or.
[[nodiscard]] std::uint64_t meet(meeting_kind kind, unsigned mask, std::uint64_t value, unsigned from);
// Waits for all threads of the block that have not ended. Returns how many passed true.
[[nodiscard]] unsigned meet_block(bool predicate);

// Dynamic shared memory of the running block.
[[nodiscard]] unsigned char* dynamic_shared();
// Addresses in shared memory as 32 bits, relative to an address near all static memory.
[[nodiscard]] std::uint32_t shared_address(const void* p);
[[nodiscard]] void* shared_pointer(std::uint32_t address);

} // namespace emulation
