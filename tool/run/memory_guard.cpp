// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The program's operator new and delete: malloc and free, with large blocks counted against the budget of memory.hpp.
// Linked into the program alone, not into the libraries that its tests link.
#include "model/memory.hpp"

#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <new>
#include <utility>

// Thread sanitizer has operators of its own that no program can replace: the budget is not kept there.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define VOXELIZE_KEEPS_OPERATORS
#endif
#endif
#ifdef __SANITIZE_THREAD__
#define VOXELIZE_KEEPS_OPERATORS
#endif

#ifndef VOXELIZE_KEEPS_OPERATORS
namespace {

// Bytes of small blocks that this thread has taken since the process was measured, less those that it gave back.
thread_local std::size_t small_bytes = 0;

// Many small blocks without a large one between them would grow past the limit without a look at it.
bool take(std::size_t size) noexcept {
    if (size >= voxelize::memory::counted_block) return voxelize::memory::take(size);
    small_bytes += size;
    if (small_bytes < voxelize::memory::measured_after) return true;
    return voxelize::memory::take_small(std::exchange(small_bytes, 0));
}

void* guarded(void* block, std::size_t wanted) {
    if (block == nullptr) {
        voxelize::memory::refused(wanted);
        throw std::bad_alloc{};
    }
    if (!take(malloc_usable_size(block))) {
        std::free(block);
        throw std::bad_alloc{};
    }
    return block;
}

void release(void* block) noexcept {
    if (block == nullptr) return;
    const std::size_t size = malloc_usable_size(block);
    if (size >= voxelize::memory::counted_block)
        voxelize::memory::give_back(size);
    else
        small_bytes -= std::min(size, small_bytes);
    std::free(block);
}

// malloc keeps the memory of blocks below its threshold, and raises that as it goes. Fixed at the least counted block:
// what is counted is gone once it is given back, and only small blocks stay. The system grants a process some 65
// thousand mappings, of which the rest of it needs a few.
#if !defined(__wasi__) // whose malloc has no mappings
[[maybe_unused]] const int fixed_threshold = mallopt(M_MMAP_THRESHOLD, voxelize::memory::counted_block);
[[maybe_unused]] const int most_mappings = mallopt(M_MMAP_MAX, 1 << 15);
#endif

} // namespace

// Every form is replaced, since sanitizers replace those that are left out by forms that do not call these.
void* operator new(std::size_t size) { return guarded(std::malloc(size != 0 ? size : 1), size); }
void* operator new(std::size_t size, std::align_val_t align) {
    const auto a = static_cast<std::size_t>(align);
    return guarded(std::aligned_alloc(a, (size + a - 1) / a * a), size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    try {
        return operator new(size);
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}
void* operator new(std::size_t size, std::align_val_t align, const std::nothrow_t&) noexcept {
    try {
        return operator new(size, align);
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new[](std::size_t size, std::align_val_t align) { return operator new(size, align); }
void* operator new[](std::size_t size, const std::nothrow_t& t) noexcept { return operator new(size, t); }
void* operator new[](std::size_t size, std::align_val_t align, const std::nothrow_t& t) noexcept {
    return operator new(size, align, t);
}
void operator delete(void* block) noexcept { release(block); }
void operator delete(void* block, std::size_t) noexcept { release(block); }
void operator delete(void* block, std::align_val_t) noexcept { release(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { release(block); }
void operator delete(void* block, const std::nothrow_t&) noexcept { release(block); }
void operator delete(void* block, std::align_val_t, const std::nothrow_t&) noexcept { release(block); }
void operator delete[](void* block) noexcept { release(block); }
void operator delete[](void* block, std::size_t) noexcept { release(block); }
void operator delete[](void* block, std::align_val_t) noexcept { release(block); }
void operator delete[](void* block, std::size_t, std::align_val_t) noexcept { release(block); }
void operator delete[](void* block, const std::nothrow_t&) noexcept { release(block); }
void operator delete[](void* block, std::align_val_t, const std::nothrow_t&) noexcept { release(block); }
#endif
