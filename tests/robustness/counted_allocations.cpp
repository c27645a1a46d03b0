// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Replaces the global operators, in a file of its own, so that no compiler inlines one half of a pair into a test and
// then misses the other. aligned_alloc and free are wrapped by the linker: replacing them outright would take the place
// of a sanitizer's.

#include "counted_allocations.hpp"

#include <cstddef>
#include <cstdlib>
#include <new>

// NOLINTBEGIN(bugprone-reserved-identifier): names that linker and sanitizers ask for
extern "C" {
void* __real_aligned_alloc(std::size_t alignment, std::size_t size);
void __real_free(void* p);
void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size);
void __wrap_free(void* p);
}

namespace unit {

std::atomic<std::int64_t> live_allocations{0};
std::atomic<std::int64_t> allocations_left{no_end_of_allocations};

namespace {

bool is_refused() { return allocations_left.fetch_sub(1) <= 0; }

} // namespace
} // namespace unit

void* operator new(std::size_t size) {
    void* const p = unit::is_refused() ? nullptr : std::malloc(size == 0 ? 1 : size);
    if (p == nullptr) throw std::bad_alloc();
    ++unit::live_allocations;
    return p;
}

void operator delete(void* p) noexcept {
    if (p != nullptr) --unit::live_allocations;
    __real_free(p);
}

void operator delete(void* p, std::size_t) noexcept { operator delete(p); }

void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size) {
    void* const p = unit::is_refused() ? nullptr : __real_aligned_alloc(alignment, size);
    if (p != nullptr) ++unit::live_allocations;
    return p;
}

// Of memory from aligned_alloc, as far as tests look: what others free they have got from malloc between two looks.
void __wrap_free(void* p) {
    if (p != nullptr) --unit::live_allocations;
    __real_free(p);
}

// Sanitizers end the program at an allocation that cannot be had, unless told to fail it as the system would.
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }
extern "C" const char* __tsan_default_options() { return "allocator_may_return_null=1"; }
// NOLINTEND(bugprone-reserved-identifier)
