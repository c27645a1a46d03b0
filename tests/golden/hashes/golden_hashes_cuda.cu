// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// golden_hashes on a GPU: the same options, names and hashes. --left-out prints the names that it has not, each with
// the reason. Ends with 77 where there is no device and a case is to run.

#include "cells.hpp"
#include "coverages.hpp"
#include "distances.hpp"
#include "labels.hpp"
#include "levels.hpp"
#include "lists.hpp"
#include "main.hpp"
#include "programs.hpp"
#include "slabs.hpp"
#include "solids.hpp"
#include "sparse.hpp"
#include "surfaces.hpp"
#include "targets.hpp"

#include <voxelpipe/cells/device/cells.cuh>
#include <voxelpipe/cells/device/sparse_cells.cuh>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/label/device/label.cuh>
#include <voxelpipe/surfaces/device/sparse_surfaces.cuh>

#include <cuda_runtime.h>

#include <cstdio>

namespace {

using backend_type = voxelpipe::cuda_backend;

// Why a case has no hash on a GPU; null: it has.
const char* why_left_out(const std::string& name) {
    if (name.find("add_unordered") != std::string::npos) return "a GPU adds in any order; the sum is tested to a bound";
    return nullptr;
}

} // namespace

int main(int argc, char** argv) {
    auto cases = golden::all_cases<backend_type>();
    if (argc == 2 && std::string(argv[1]) == "--left-out") {
        for (const auto& c : cases)
            if (const char* const reason = why_left_out(c.name); reason != nullptr)
                std::printf("%s %s\n", c.name.c_str(), reason);
        return 0;
    }
    std::erase_if(cases, [](const auto& c) { return why_left_out(c.name) != nullptr; });
    return golden::run_program({argv + 1, argv + argc}, cases, [](unsigned) {
        int count = 0;
        if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) {
            std::fputs("not run: no CUDA device\n", stderr);
            std::exit(77);
        }
        return backend_type{};
    });
}
