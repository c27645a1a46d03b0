// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Replaces the global operators, in a file of its own, so that no compiler inlines one half of a pair into a test and
// then misses the other.

#include "counted_allocations.hpp"

#include <cstdlib>
#include <new>

namespace unit {

std::atomic<std::int64_t> live_allocations{0};

} // namespace unit

void* operator new(std::size_t size) {
    void* const p = std::malloc(size == 0 ? 1 : size);
    if (p == nullptr) throw std::bad_alloc();
    ++unit::live_allocations;
    return p;
}

void operator delete(void* p) noexcept {
    if (p != nullptr) --unit::live_allocations;
    std::free(p);
}

void operator delete(void* p, std::size_t) noexcept { operator delete(p); }

// Sanitizers end the program at an allocation that cannot be had, unless told to fail it as the system would.
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }
extern "C" const char* __tsan_default_options() { return "allocator_may_return_null=1"; }
