// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What bricks take, known before they are drawn: a run that cannot fit ends at once and names what it needs.

#include "draw/voxelizer.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace voxelize {

// The areas of the projections of a surface along the three axes, in voxels, which are about the voxels that it
// touches: by layers of tiles, whose lower borders are multiples of a tile's height in the whole grid.
class surface_layers {
public:
    explicit surface_layers(const voxelpipe::grid& part);

    // Corners in voxels of the part.
    void add_triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);
    void add_line(const glm::dvec3& a, const glm::dvec3& b);
    // Another surface in the same part.
    void add(const surface_layers& other);

    [[nodiscard]] double voxels() const { return voxels_; }
    // The voxels of each layer of the part, lowest first.
    [[nodiscard]] const std::vector<double>& layers() const { return layers_; }
    // The signed volume that the triangles enclose, in voxels.
    [[nodiscard]] double volume() const { return volume_; }
    [[nodiscard]] double primitives() const { return primitives_; }

private:
    void add(double voxels, double low, double high);

    int first_;    // the part's first layer in a layer of tiles
    double depth_; // layers of the part
    std::vector<double> layers_;
    double voxels_ = 0, volume_ = 0, primitives_ = 0;
};

// Bricks and voxels that a surface touches.
struct brick_counts {
    double bricks = 0, voxels = 0;
};

// Bytes of a voxel in the targets that a slab is drawn into, and of its values in the result.
struct value_sizes {
    double targets = 0, values = 0, largest = 0; // largest: of one channel
    double bodies = 0;                           // of a brick of --fill body, where bodies are looked for
};
[[nodiscard]] value_sizes value_sizes_of(const voxelize_request& request, double targets);

// Bytes of a brick while its slab is drawn, without values: in a list, in the framebuffer's arrays and in the slab.
inline constexpr double drawn_brick_bytes = 160;

// Counts that the surface certainly stays below, for a look that costs nothing.
[[nodiscard]] brick_counts at_most(const surface_layers& surface);

// Bytes beyond those that are held now while bricks are drawn, joined and written. draws_surface: false where a solid
// is drawn alone.
[[nodiscard]] double needed_bytes(const voxelize_request& request, const surface_layers& surface,
                                  const brick_counts& counts, const value_sizes& bytes);

// The same need, of cut cells or of links. vertices: of all instances.
[[nodiscard]] double needed_for_cells(const voxelize_request& request, const surface_layers& surface,
                                      const brick_counts& counts, double vertices);

// The side in voxels of the cubes that are counted in place of voxels, so that counting takes about a second: 1, or a
// multiple of a brick's side.
[[nodiscard]] int counted_side(const surface_layers& surface);
// The grid of such cubes that covers a part.
[[nodiscard]] voxelpipe::grid counted_grid(const voxelpipe::grid& part, int side);
// The bricks and voxels of the touched cubes of the surface.
[[nodiscard]] brick_counts counts_of(const surface_layers& surface, const brick_counts& touched, int side);

// Throws memory_error where the bricks of a streamed surface cannot fit once they are drawn: nothing of it has been
// counted, so half of them have to.
void require_streamed(const voxelize_request& request, const surface_layers& surface);

// Throws memory_error if `bytes` do not fit; a shortage later in the run names that need.
void require_bricks(const voxelize_request& request, double bytes);

} // namespace voxelize
