// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "memory.hpp"

#include "system.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <string_view>

namespace voxelize::memory {

namespace {

std::atomic<std::uint64_t> counted{0};          // bytes of large blocks that are held
std::atomic<std::uint64_t> allowed{UINT64_MAX}; // that they may reach: the limit without what else is resident
std::atomic<std::uint64_t> overhead{0};         // what else is resident, when it was measured last
std::atomic<std::uint64_t> unmeasured{0};       // bytes that were taken since then
std::atomic<std::uint64_t> wanted{0};           // counted bytes of the last refusal; 0: there was none
std::atomic<double> expected{0};                // bytes in all that the run was said to come to
std::uint64_t limit_bytes = UINT64_MAX;
bool limit_is_option = false;

#if defined(__wasi__)
// WebAssembly's memory grows and never shrinks: what it holds is not what is taken. Data and the stack lie below the
// heap. Of the heap only counted blocks are known.
extern "C" const char __heap_base;
os::residence residence_now() noexcept {
    const std::uint64_t below_heap = reinterpret_cast<std::uintptr_t>(&__heap_base);
    return {below_heap + counted, 0};
}
std::uint64_t heap_bytes() noexcept { return 0; }
#else
using os::heap_bytes;
using os::residence_now;
#endif

std::uint64_t difference(std::uint64_t a, std::uint64_t b) { return a > b ? a - b : 0; }

// Code, stacks, small blocks and what other libraries take have to fit beside the counted blocks. What is resident
// without these does not tell: pages of a block that nothing has touched yet are counted and not resident, and would
// hide as much of the rest.
void measure_overhead() noexcept {
    static const std::uint64_t data_of_libraries = [] {
        const os::residence at_first = residence_now();
        return difference(at_first.all, at_first.of_files + heap_bytes() + counted);
    }();
    unmeasured = 0;
    const os::residence now = residence_now();
    const std::uint64_t rest = std::max(difference(now.all, counted), now.of_files + data_of_libraries + heap_bytes());
    // What comes between two looks.
    constexpr std::uint64_t reserve = std::uint64_t{512} << 10;
    overhead = rest + reserve;
    if (limit_bytes != UINT64_MAX) allowed = difference(limit_bytes, rest + reserve);
}

std::string limit_text() {
    return mebibytes(static_cast<double>(limit_bytes)) +
           (limit_is_option ? " are allowed by --max-memory" : " may be used of this machine's memory (--max-memory)");
}

std::string need_text(double least, double likely) {
    constexpr double spare = 1.5 * (1 << 20); // an estimate is to suffice
    return likely > least ? "about " + mebibytes(likely + spare) + " are needed"
                          : "at least " + mebibytes(least) + " are needed";
}

std::string with(const std::string& hint) { return hint.empty() ? hint : ": " + hint; }

} // namespace

#if defined(__wasi__)
// Addresses have 32 bits. A browser may give less, which malloc then says.
std::uint64_t machine_limit() {
    constexpr std::uint64_t addressed = std::uint64_t{1} << 32;
    return addressed - addressed / 10;
}
#else
std::uint64_t machine_limit() {
    const std::uint64_t allowed = os::allowed_memory();
    return allowed - allowed / 10;
}
#endif

void set_limit(std::uint64_t limit, bool is_option) {
    limit_bytes = limit != 0 ? limit : machine_limit();
    limit_is_option = is_option;
    measure_overhead();
}

std::uint64_t limit() { return limit_bytes; }

std::uint64_t resident() { return residence_now().all; }

#if defined(__wasi__)
std::uint64_t peak() { return std::uint64_t{__builtin_wasm_memory_size(0)} * 65536; }
#else
std::uint64_t peak() { return os::most_resident(); }
#endif

std::uint64_t room() {
    measure_overhead();
    const std::uint64_t blocks = counted;
    return allowed > blocks ? allowed - blocks : 0;
}

bool take(std::size_t bytes) noexcept {
    constexpr std::uint64_t worth_a_look = std::uint64_t{4} << 20;
    if (unmeasured += bytes; unmeasured >= worth_a_look) measure_overhead();
    const std::uint64_t now = counted += bytes;
    if (now <= allowed) return true;
    wanted = now;
    counted -= bytes;
    return false;
}

void give_back(std::size_t bytes) noexcept { counted -= bytes; }

bool take_small(std::size_t bytes) noexcept {
    measure_overhead();
    const std::uint64_t now = counted;
    if (limit_bytes == UINT64_MAX || now + overhead <= limit_bytes) return true;
    wanted = now + bytes;
    return false;
}

void refused(std::size_t bytes) noexcept { wanted = counted + bytes; }

void require(double bytes, const std::string& what, const std::string& hint, double likely) {
    if (bytes <= static_cast<double>(room())) return;
    const auto held = static_cast<double>(counted + overhead);
    throw memory_error(what + ": " + need_text(held + bytes, std::max<double>(held + likely, expected)) + ", and " +
                       limit_text() + with(hint));
}

void expect(double bytes) {
    (void)room(); // measures
    expected = static_cast<double>(counted + overhead) + bytes;
}

std::string shortage(const std::string& hint, double likely) {
    likely = std::max<double>(likely, expected);
    const double held = static_cast<double>(overhead) + static_cast<double>(wanted != 0 ? wanted : counted);
    const std::string need = wanted != 0 ? need_text(held, likely) : "the system gave no more than " + mebibytes(held);
    return "not enough memory: " + need + ", and " + limit_text() + with(hint);
}

std::string mebibytes(double bytes) {
    return std::to_string(static_cast<long long>(std::ceil(std::min(bytes / (1 << 20), 9e18)))) + " MiB";
}

} // namespace voxelize::memory
