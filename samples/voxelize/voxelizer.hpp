// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// scene + options -> volume: all targets in one pass of the pipeline, on the backend of the user's choice. The result
// is the same bytes for every backend, number of threads and amount of working memory.

#include "scene.hpp"
#include "targets.hpp"
#include "volume.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/status.hpp>

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

enum class backend_choice : std::uint8_t { automatic, cpu, cuda };

struct voxelize_request {
    voxelpipe::grid grid;
    voxelpipe::coverage coverage = voxelpipe::coverage::conservative;
    std::vector<target> targets{target::occupancy}; // channels of the volume, in this order, none twice
    int depth_axis = 2;                             // 0 x, 1 y, 2 z
    backend_choice backend = backend_choice::automatic;
    int threads = 0; // 0: all cores
    // Bytes for what exists only while the pipeline runs. A grid that needs more is computed in slabs along z.
    std::uint64_t work_memory = std::uint64_t{128} << 20;
    std::function<void(double)> progress; // called with 0..1, one call at a time; may be empty
};

struct voxelize_stats {
    std::string backend; // "cpu"
    int threads = 0;     // that it ran on
    int slabs = 0;
    std::uint64_t triangles = 0;
    std::uint64_t triangles_dropped = 0;   // a position that is not finite, or too far from the grid to be snapped
    std::uint64_t fragments = 0;           // kept, over all voxels
    std::uint64_t fragments_discarded = 0; // by an alpha mask
    std::uint64_t voxels = 0;              // with at least one fragment
    std::vector<std::pair<std::string, double>> milliseconds; // stage -> time, in pipeline order
};

// The grid's voxels do not fit into memory.
struct memory_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The backend was not built, or there is no device for it.
struct backend_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Consumes the scene: its arrays move to the backend. Throws memory_error, backend_error, and std::runtime_error for
// what the library refuses.
[[nodiscard]] volume run_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats);

// Bytes of the volume that a request gives.
[[nodiscard]] double volume_bytes(const voxelize_request& request);

} // namespace voxelize
