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

#include "digest.hpp"

#include <string>
#include <vector>

namespace golden {

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
