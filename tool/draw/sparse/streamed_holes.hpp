// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --close-holes for a model that is read block by block: the lids of its holes, found in one pass over the triangles
// through temporary files (voxelpipe/slabs/holes.hpp), for the slabs that are drawn later.

#include "draw/voxelizer.hpp"
#include "read/triangle_stream.hpp"

#include <voxelpipe/solid/core/holes.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace voxelize {

class streamed_holes {
public:
    // Nothing unless the request closes holes. room: bytes that the run may take; an eighth is for the search, beside
    // the boundaries of the holes. Throws memory_error where those do not fit, model_error, and std::system_error of
    // files.
    streamed_holes(triangle_stream& model, const voxelize_request& request, double room,
                   const std::filesystem::path& folder);

    // Parts that a slab has to have, if only with a triangle that is dropped, since lids may lie there: ascending.
    [[nodiscard]] const std::vector<std::size_t>& parts() const { return parts_; }
    // The lids of a slab's bodies (voxelpipe::solid_options::cones), whose draws are of these parts; empty if no hole
    // is to be closed.
    [[nodiscard]] std::vector<voxelpipe::core::hole_cones> of_bodies(std::span<const std::size_t> parts) const;
    // Puts down the holes of the whole model.
    void count(voxelize_stats& stats) const;

private:
    bool closes_ = false, is_each_draw_ = false;
    std::vector<voxelpipe::core::hole_cones> cones_; // of each body: of each part with each_draw
    std::vector<std::size_t> parts_;
};

} // namespace voxelize
