// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --distance: scene + options -> volume with the channel "distance", and beside it values of the nearest triangle, on
// the CPU. The whole grid is drawn at once into the volume's own memory, or slab by slab while outputs are written.

#include "draw/voxelizer.hpp"
#include "model/scene.hpp"
#include "model/volume.hpp"

namespace voxelize {

// Values that there are beside distances: those of the nearest triangle at its closest point, and `distance` itself.
[[nodiscard]] bool is_of_nearest(target id);

// Bytes that drawing the distances of this model comes to, beyond those that are held before it, about.
[[nodiscard]] double distance_need(const scene& model, const voxelize_request& request);

// request.distance is set; request.grid is that of the samples, not cropped. Lines and points have no distances: a
// warning counts them. A model without triangles gives the band's distance everywhere, or infinity, which a warning
// says. Where the field does not fit, but two slabs of distance_request::slab_layers layers do, the channels of the
// volume have no data: they draw slabs on the CPU as they are read, and keep two. Then `stats` has to outlive the
// volume, and its counts and warnings are whole once all of it has been read and add_distance_warnings was called;
// otherwise they are at once. Throws memory_error with need and limit before anything is drawn where neither fits,
// backend_error for a GPU.
[[nodiscard]] volume run_distance_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats);

// True if a volume's channels are drawn as they are read.
[[nodiscard]] bool is_drawn_late(const volume& v);

// Adds the warnings that follow from the counts of all samples.
void add_distance_warnings(const voxelize_request& request, voxelize_stats& stats);

} // namespace voxelize
