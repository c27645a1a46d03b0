// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Golden hashes: a case computes bytes, and tests/golden/golden.txt holds their confirmed hash. Every build (compiler,
// -march=native, contraction on or off, any number of threads) must give those bytes.
//
//   GOLDEN_CASE("soup.count.thin") { digest.add(counts); }
//
// A case runs once with 1 thread and once with several; `threads` is that number. After a deliberate change of bits,
// VOXELPIPE_UPDATE_GOLDEN=1 golden_test rewrites golden.txt, and the difference is reviewed like code.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace golden {

// 64-bit FNV-1a over the raw bytes and the lengths of everything that is added.
class digest {
public:
    template <class T>
    void add(const std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T>);
        add_bytes(std::as_bytes(std::span(values)));
    }
    void add(std::uint64_t value) { add_bytes(std::as_bytes(std::span(&value, 1))); }

    [[nodiscard]] std::uint64_t value() const { return hash_; }

private:
    void add_bytes(std::span<const std::byte> bytes) {
        std::uint64_t length = bytes.size();
        for (int i = 0; i < 8; ++i, length >>= 8) mix(static_cast<std::uint8_t>(length & 0xff));
        for (const std::byte b : bytes) mix(static_cast<std::uint8_t>(b));
    }
    void mix(std::uint8_t byte) { hash_ = (hash_ ^ byte) * 0x100000001b3u; }

    std::uint64_t hash_ = 0xcbf29ce484222325u;
};

struct golden_case {
    std::string name;
    void (*run)(golden::digest& digest, unsigned threads);
};

// All cases of the program, in the order of their registration.
std::vector<golden_case>& registry();

struct registration {
    registration(const char* name, void (*run)(golden::digest&, unsigned)) { registry().push_back({name, run}); }
};

} // namespace golden

#define GOLDEN_CONCATENATE_(a, b) a##b
#define GOLDEN_CONCATENATE(a, b) GOLDEN_CONCATENATE_(a, b)
#define GOLDEN_CASE_(name, id)                                                                                         \
    static void GOLDEN_CONCATENATE(golden_case_, id)(golden::digest & digest, unsigned threads);                       \
    static const golden::registration GOLDEN_CONCATENATE(golden_registration_,                                         \
                                                         id)(name, GOLDEN_CONCATENATE(golden_case_, id));              \
    static void GOLDEN_CONCATENATE(golden_case_, id)(golden::digest & digest, unsigned threads)
#define GOLDEN_CASE(name) GOLDEN_CASE_(name, __LINE__)
