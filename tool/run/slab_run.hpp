// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One model whose result is drawn and written slab by slab: by one process that may be stopped and run again, or by
// several that share the slabs, on one machine or on any that see one folder. Slabs lie in a folder beside the output,
// OUT.zarr.WORK.slabs (OUT.pvti.PIECES.WORK.slabs), with a mark for each that is whole; WORK says which model and
// options they are of. A process draws those of its slabs that have no mark. The one after which none is left makes the
// output of the folder. So nothing passes between the processes but files.

#include "command_line.hpp"
#include "draw/sparse/streamed_model.hpp"
#include "model/scene.hpp"
#include "read/triangle_stream.hpp"
#include "report.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace voxelize {

// The model: loaded, or to be read.
struct slab_source {
    scene model;
    triangle_stream* stream = nullptr; // null: `model` holds it
    stream_place place;                // of the stream
};

struct slab_outcome {
    std::int64_t slabs = 0; // of the grid
    std::int64_t drawn = 0; // by this process, now
    std::int64_t left = 0;  // that have no mark at its end, other processes' ones
    bool finished = false;  // the output is there
};

// The reason why the options cannot be drawn slab by slab: the rest of a sentence that names what is needed, or empty.
[[nodiscard]] std::string why_not_by_slabs(const command_line& options);

// Consumes the source. Adds the counts of the slabs drawn now to report.stats; those of all slabs, once the output is
// there. Throws as run_voxelizer does, and write_error.
[[nodiscard]] slab_outcome run_by_slabs(const command_line& options, slab_source&& source, run_report& report);

} // namespace voxelize
