// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The preview's camera: placed so that the occupied voxels just fit into the picture. Internal to the preview.
// Positions are world units from the low corner of the grid (voxel * voxel_size), so that a far origin costs no digits.

#include "preview.hpp"
#include "preview_scene.hpp"

namespace voxelize {

struct camera {
    vec3 eye{};            // perspective: where all rays start; orthographic: the middle of the image plane
    vec3 right{};          // unit vectors: to the right of the picture,
    vec3 above{};          // to its top,
    vec3 forward{};        // and into it
    double half_width = 1; // of the image plane: at distance 1 (perspective), or in world units (orthographic)
    double half_height = 1;
    bool perspective = true;

    struct ray {
        vec3 origin;
        vec3 direction; // unit length
    };
    // x and y run from -1 (left, bottom) to 1 (right, top).
    [[nodiscard]] ray through(double x, double y) const;
    // Width in world units that one picture height shows at a distance along a ray.
    [[nodiscard]] double height_at(double distance) const { return 2 * half_height * (perspective ? distance : 1.0); }
};

// Unit vectors of the world as the picture sees it: to the right at azimuth 0, up, and towards the viewer at azimuth 0.
struct world_axes {
    vec3 right{}, up{}, front{};
    std::size_t up_index = 1;
};
[[nodiscard]] world_axes axes_of(up_axis up);

// Direction with that azimuth and elevation in degrees, unit length.
[[nodiscard]] vec3 direction_of(const world_axes& axes, double azimuth, double elevation);

[[nodiscard]] camera fit_camera(const preview_scene& scene, const vec3& voxel_size, const preview_options& options);

} // namespace voxelize
