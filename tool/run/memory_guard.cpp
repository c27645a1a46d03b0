// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The program's operator new and delete: malloc and free, with large blocks counted against the budget of memory.hpp.
// Linked into the program alone, not into the libraries that its tests link.
#include "model/memory.hpp"

#include <malloc.h>

#include <algorithm>
#include <cstdint>
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

// Bytes of a block, and blocks of an alignment, which on Windows begin within one of malloc's: that one's address
// stands before them.
#if defined(_WIN32)
void* whole(void* block) noexcept { return static_cast<void**>(block)[-1]; }
std::size_t bytes_of(void* block) noexcept { return _msize(block); }
std::size_t bytes_of(void* block, std::align_val_t) noexcept { return _msize(whole(block)); }
void* aligned(std::size_t align, std::size_t size) noexcept {
    align =
        std::max<std::size_t>(align, 2 * sizeof(void*)); // as malloc's blocks are, so that an address fits before it
    void* const made = size < SIZE_MAX - align ? std::malloc(size + align) : nullptr;
    if (made == nullptr) return nullptr;
    void* const block = static_cast<char*>(made) + (align - reinterpret_cast<std::uintptr_t>(made) % align);
    static_cast<void**>(block)[-1] = made;
    return block;
}
void free_aligned(void* block) noexcept { std::free(whole(block)); }
#else
std::size_t bytes_of(void* block) noexcept { return malloc_usable_size(block); }
std::size_t bytes_of(void* block, std::align_val_t) noexcept { return malloc_usable_size(block); }
void* aligned(std::size_t align, std::size_t size) noexcept { return std::aligned_alloc(align, size); }
void free_aligned(void* block) noexcept { std::free(block); }
#endif

// Bytes of small blocks that this thread has taken since the process was measured, less those that it gave back.
thread_local std::size_t small_bytes = 0;

// Many small blocks without a large one between them would grow past the limit without a look at it.
bool take(std::size_t size) noexcept {
    if (size >= voxelize::memory::counted_block) return voxelize::memory::take(size);
    small_bytes += size;
    if (small_bytes < voxelize::memory::measured_after) return true;
    return voxelize::memory::take_small(std::exchange(small_bytes, 0));
}

// Counts a block that malloc gave, null where it gave none. FREE gives it back.
template <class... Alignment>
void* guarded(void* block, std::size_t wanted, void (*free)(void*), Alignment... align) {
    if (block == nullptr) {
        voxelize::memory::refused(wanted);
        throw std::bad_alloc{};
    }
    if (!take(bytes_of(block, align...))) {
        free(block);
        throw std::bad_alloc{};
    }
    return block;
}

void given_back(std::size_t size) noexcept {
    if (size >= voxelize::memory::counted_block)
        voxelize::memory::give_back(size);
    else
        small_bytes -= std::min(size, small_bytes);
}
void release(void* block) noexcept {
    if (block == nullptr) return;
    given_back(bytes_of(block));
    std::free(block);
}
void release(void* block, std::align_val_t align) noexcept {
    if (block == nullptr) return;
    given_back(bytes_of(block, align));
    free_aligned(block);
}

// malloc keeps the memory of blocks below its threshold, and raises that as it goes. Fixed at the least counted block:
// what is counted is gone once it is given back, and only small blocks stay. The system grants a process some 65
// thousand mappings, of which the rest of it needs a few.
#if !defined(__wasi__) && !defined(_WIN32) // whose malloc has no mappings
[[maybe_unused]] const int fixed_threshold = mallopt(M_MMAP_THRESHOLD, voxelize::memory::counted_block);
[[maybe_unused]] const int most_mappings = mallopt(M_MMAP_MAX, 1 << 15);
#endif

} // namespace

// Every form is replaced, since sanitizers replace those that are left out by forms that do not call these.
void* operator new(std::size_t size) { return guarded(std::malloc(size != 0 ? size : 1), size, std::free); }
void* operator new(std::size_t size, std::align_val_t align) {
    const auto a = static_cast<std::size_t>(align);
    return guarded(aligned(a, (size + a - 1) / a * a), size, free_aligned, align);
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
void operator delete(void* block, std::align_val_t align) noexcept { release(block, align); }
void operator delete(void* block, std::size_t, std::align_val_t align) noexcept { release(block, align); }
void operator delete(void* block, const std::nothrow_t&) noexcept { release(block); }
void operator delete(void* block, std::align_val_t align, const std::nothrow_t&) noexcept { release(block, align); }
void operator delete[](void* block) noexcept { release(block); }
void operator delete[](void* block, std::size_t) noexcept { release(block); }
void operator delete[](void* block, std::align_val_t align) noexcept { release(block, align); }
void operator delete[](void* block, std::size_t, std::align_val_t align) noexcept { release(block, align); }
void operator delete[](void* block, const std::nothrow_t&) noexcept { release(block); }
void operator delete[](void* block, std::align_val_t align, const std::nothrow_t&) noexcept { release(block, align); }
#endif
