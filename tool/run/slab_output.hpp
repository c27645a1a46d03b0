// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The folder that the slabs of slab_run.hpp are written into, by the format of the output. They come in any order and
// from any process; the process that finds all of them makes the output of the folder.

#include "model/volume.hpp"
#include "write/formats/formats.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace voxelize {

class slab_output {
public:
    slab_output() = default;
    slab_output(const slab_output&) = delete;
    slab_output& operator=(const slab_output&) = delete;
    virtual ~slab_output() = default;

    [[nodiscard]] virtual std::int64_t num_slabs() const = 0;
    [[nodiscard]] virtual voxelpipe::slabs::layer_range layers(std::int64_t slab) const = 0;
    // The path that the user means, after which the folder is named.
    [[nodiscard]] virtual const std::filesystem::path& target() const = 0;
    // Throws write_error if the target is there and may not be replaced.
    virtual void check_target() const {}

    // Writes a slab into the folder, whose folder data/ is there; `v` has the grid's shape and the slab's values.
    virtual void write(const std::filesystem::path& folder, std::int64_t slab, const volume& v) const = 0;
    // Makes the output of the folder's slabs, and gives its files. data/ is gone then. It may be called again where a
    // process ended in it.
    [[nodiscard]] virtual std::vector<std::filesystem::path> finish(const std::filesystem::path& folder) const = 0;
};

// True for outputs that can be written so.
[[nodiscard]] bool has_slab_output(const std::filesystem::path& output);

// For an output of such a format. `shape`: extent, place and channels of the grid, without values.
[[nodiscard]] std::unique_ptr<slab_output> make_slab_output(const std::filesystem::path& output, const volume& shape,
                                                            const write_options& options);

} // namespace voxelize
