// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// scene + options -> sparse volume: the values that run_voxelizer gives, of the voxels that exist.

#include "draw/voxelizer.hpp"
#include "model/sparse_volume.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace voxelize {

// The user's choice between bricks and a dense grid.
enum class storage_choice : std::uint8_t { automatic, sparse, dense };

struct storage_decision {
    bool sparse = false;
    bool lists = false; // .npy and .npz list voxels, in place of the grid
    std::string reason; // half a line, if the choice was automatic and fell on bricks
};

// Bytes that a dense grid needs: with all targets, and without those that only some outputs ask for.
struct dense_needs {
    double all = 0, alone = 0;
};

// Bricks where an output has no dense form, or where the bytes that a dense grid needs do not fit the run's memory.
// .npy and .npz list voxels where they would do so as the only output. Throws backend_error where --sparse cannot be
// had.
[[nodiscard]] storage_decision choose_storage(storage_choice choice, const voxelize_request& request,
                                              std::span<const std::filesystem::path> outputs, const dense_needs& dense);

struct cuda_facts; // cuda_device.hpp

// Draws parts of a grid from one model, which it keeps. Members throw std::bad_alloc.
class sparse_drawer {
public:
    // Consumes the scene. The request is that of the whole grid, or of a part of it.
    sparse_drawer(scene&& model, const voxelize_request& request);
    // On a GPU that can be used. The scene stays whole and lasts as long as this; members throw device_memory_error,
    // too.
    sparse_drawer(scene& model, const voxelize_request& request, const cuda_facts& facts);
    sparse_drawer(const sparse_drawer&) = delete;
    sparse_drawer& operator=(const sparse_drawer&) = delete;
    ~sparse_drawer();

    // About the model, whatever is drawn of it.
    [[nodiscard]] const std::vector<std::string>& warnings() const;

    // A part may differ from the request in its crop of the whole grid, in what the other parts decide (columns, and
    // those of solid), in work_memory and progress. Volumes have the shape of the whole.

    // All that is asked for. The counts replace those that are there; the times follow.
    [[nodiscard]] sparse_volume draw(const voxelize_request& part, voxelize_stats& stats);
    // The surface alone, where a solid is asked for.
    [[nodiscard]] sparse_volume surface(const voxelize_request& part);
    // The voxels that it occupies, without channels.
    [[nodiscard]] sparse_volume occupied(const voxelize_request& part);
    // The walls of a flood of --solid exterior: all voxels that triangles touch, whatever materials cut off.
    [[nodiscard]] sparse_volume walls(const voxelize_request& part);

private:
    struct state;
    std::unique_ptr<state> state_;
};

// A volume of the request's shape and channels without a voxel.
[[nodiscard]] sparse_volume empty_bricks(const voxelize_request& request);

// sparse_drawer::walls() of a model that is wanted for nothing else, in layers of the request's grid. Consumes the
// scene. Throws std::bad_alloc.
[[nodiscard]] sparse_volume draw_walls(scene&& model, const voxelize_request& request,
                                       const voxelpipe::slabs::layer_range& layers);

// Bytes of a layer of a flood or a vote while it is decided, about: parities along three axes and the cover, or the
// flood's window; the bits once more as words with their places, four times as large. 0 if the request has neither.
[[nodiscard]] double decided_layer_bytes(const voxelize_request& request);

// Consumes the scene. The backend is chosen as by run_voxelizer. A flood or a vote whose bits do not fit into the run's
// memory is drawn in slabs, on the CPU. folder: for
// temporary files. Throws as run_voxelizer does, and write_error for a folder that is full.
[[nodiscard]] sparse_volume run_sparse_voxelizer(scene&& model, const voxelize_request& request,
                                                 const std::filesystem::path& folder, voxelize_stats& stats);

} // namespace voxelize
