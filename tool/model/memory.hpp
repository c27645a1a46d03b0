// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The run's one budget of memory: --max-memory, or what the machine has. It bounds the peak resident memory of the
// whole process. Large blocks are counted as they are taken and given back (memory_guard.cpp replaces the program's
// operator new), so nothing goes past the limit: std::bad_alloc is thrown instead. What is known to need much says so
// before it begins, by require().

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace voxelize {

// The work does not fit into the memory that it may use; one line with need and limit.
struct memory_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

namespace memory {

// Blocks below this many bytes are not counted one by one.
inline constexpr std::size_t counted_block = std::size_t{64} << 10;
// Each thread has the process measured after this many bytes of such blocks.
inline constexpr std::size_t measured_after = std::size_t{256} << 10;

// Bytes that this process may use if it is not told otherwise: nine tenths of the machine's memory, of its control
// group's limit or of its own limit of address space, whichever is least.
[[nodiscard]] std::uint64_t machine_limit();

// LIMIT in bytes holds from here on; 0 for machine_limit(). IS_OPTION: messages name --max-memory, not the machine.
void set_limit(std::uint64_t limit, bool is_option);
[[nodiscard]] std::uint64_t limit();

// Bytes of this process in physical memory: now, and the most so far.
[[nodiscard]] std::uint64_t resident();
[[nodiscard]] std::uint64_t peak();

// Bytes that may still be taken.
[[nodiscard]] std::uint64_t room();

// For operator new: a block of BYTES has been taken. False where that is past the limit: it has to be given back
// without being counted.
[[nodiscard]] bool take(std::size_t bytes) noexcept;
void give_back(std::size_t bytes) noexcept;
// For operator new: small blocks of BYTES together have been taken, which are not counted. False if the process is past
// the limit.
[[nodiscard]] bool take_small(std::size_t bytes) noexcept;
// For operator new: the system had no BYTES more.
void refused(std::size_t bytes) noexcept;

// Throws memory_error where WHAT, which needs at least BYTES more than are held now, does not fit. LIKELY: what it will
// come to, more or less, to be named. HINT follows the figures.
void require(double bytes, const std::string& what, const std::string& hint = "", double likely = 0);

// The run will need about BYTES more than are held now: later shortages name that need.
void expect(double bytes);

// The message for a std::bad_alloc: the need as far as it is known, LIKELY in all where that is more, and the limit.
// HINT follows the figures.
[[nodiscard]] std::string shortage(const std::string& hint = "", double likely = 0);

// The hint for calls that voxelize: what a person can do about it.
inline constexpr const char* fewer_voxels_hint = "take fewer targets or voxels";

// BYTES in MiB for a message, rounded up.
[[nodiscard]] std::string mebibytes(double bytes);

} // namespace memory

} // namespace voxelize
