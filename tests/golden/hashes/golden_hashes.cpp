// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// golden_hashes [--threads N] [NAME...]   prints `name hash` for each case of ../hashes.txt, computed here and now,
// with
//                                         N threads (default 0: all cores)
// golden_hashes --list                    prints the names
// golden_hashes --write-model FOLDER      writes the models that the tool's cases read
// golden_hashes --file NAME PATH          prints `NAME hash` for a file of the tool, or for a folder of files, by their
//                                         decoded content
//
// Needs the library and GLM alone, so that it can be built for any machine:
//   COMPILER -std=c++20 -O1 -I. tests/golden/hashes/*.cpp -o golden_hashes -pthread
// With -DVOXELPIPE_GOLDEN_FEW it has the cases of cells.cpp, coverages.cpp and distances.cpp alone, which are quick to
// compile.
// scripts/golden.sh runs it.

#include "main.hpp"

#include <cpu_ref/backend.hpp>

namespace {

using backend_type = voxelpipe::cpu_backend;

golden::case_table<backend_type> cases() {
#if defined(VOXELPIPE_GOLDEN_FEW)
    golden::case_table<backend_type> few;
    golden::add_cells(few);
    golden::add_coverages(few);
    golden::add_distances(few);
    return few;
#else
    return golden::all_cases<backend_type>();
#endif
}

} // namespace

int main(int argc, char** argv) {
    return golden::run_program({argv + 1, argv + argc}, cases(),
                               [](unsigned threads) { return backend_type{threads}; });
}
