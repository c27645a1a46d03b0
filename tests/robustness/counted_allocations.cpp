// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Replaces the global operators new and delete. They are in a separate file, so that no compiler inlines one of a pair
// and misses the other. aligned_alloc and free are wrapped by the linker, because replacing them would disable a
// sanitizer's.

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

// The allocations of cpu_backend's buffers.
void* operator new(std::size_t size, std::align_val_t alignment) {
    const auto multiple = static_cast<std::size_t>(alignment);
    void* const p =
        unit::is_refused() ? nullptr : __real_aligned_alloc(multiple, (size + multiple - 1) / multiple * multiple);
    if (p == nullptr) throw std::bad_alloc();
    ++unit::live_allocations;
    return p;
}

void operator delete(void* p) noexcept {
    if (p != nullptr) --unit::live_allocations;
    __real_free(p);
}

void operator delete(void* p, std::size_t) noexcept { operator delete(p); }
void operator delete(void* p, std::align_val_t) noexcept { operator delete(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { operator delete(p); }

void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size) {
    void* const p = unit::is_refused() ? nullptr : __real_aligned_alloc(alignment, size);
    if (p != nullptr) ++unit::live_allocations;
    return p;
}

// Counts memory from aligned_alloc only: other code frees between two checks what it got from malloc between them.
void __wrap_free(void* p) {
    if (p != nullptr) --unit::live_allocations;
    __real_free(p);
}

// By default, sanitizers end the program if an allocation fails. This option makes them return null instead.
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }
extern "C" const char* __tsan_default_options() { return "allocator_may_return_null=1"; }
// NOLINTEND(bugprone-reserved-identifier)
