// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract and remesh on a GPU: their passes are those of every backend (surfaces/passes), for which cuda_backend has
// loops, CUB's sums and sorts. What they call besides is included here: solids for the sign, distances for a
// level, and nearest triangles for values.

#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/device/distance_at.cuh>
#include <voxelpipe/solid/device/solid.cuh>
#include <voxelpipe/surfaces/device/active_cells_kernels.cuh>
#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Rows by warps.
inline void for_each_row(const cuda_backend& backend, std::uint64_t num_rows, const count_active_cells& pass) {
    device::with_runtime_errors([&] { device::count_active_cells(pass, num_rows, backend.stream); });
}
inline void for_each_row(const cuda_backend& backend, std::uint64_t num_rows, const list_active_cells& pass) {
    device::with_runtime_errors([&] { device::list_active_cells(pass, num_rows, nullptr, backend.stream); });
}

} // namespace voxelpipe::core::passes
