// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "preview_camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace voxelize {
namespace {

constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180; }

vec3 cross(const vec3& a, const vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

vec3 normalized(const vec3& a) { return a * (1 / std::sqrt(dot(a, a))); }

} // namespace

camera::ray camera::through(double x, double y) const {
    const vec3 offset = right * (x * half_width) + above * (y * half_height);
    if (!perspective) return {eye + offset, forward};
    return {eye, normalized(forward + offset)};
}

world_axes axes_of(up_axis up) {
    if (up == up_axis::y) return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1};
    return {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 2};
}

vec3 direction_of(const world_axes& axes, double azimuth, double elevation) {
    const double a = radians(azimuth), e = radians(elevation);
    return axes.right * (std::sin(a) * std::cos(e)) + axes.up * std::sin(e) + axes.front * (std::cos(a) * std::cos(e));
}

camera fit_camera(const preview_scene& scene, const vec3& voxel_size, const preview_options& options) {
    const world_axes axes = axes_of(options.up);
    camera c;
    c.forward = direction_of(axes, options.azimuth, options.elevation) * -1.0;
    c.right = direction_of(axes, options.azimuth + 90, 0); // level for any elevation, also straight down
    c.above = cross(c.right, c.forward);
    c.perspective = options.field_of_view > 0;
    const double aspect = static_cast<double>(options.width) / options.height;
    constexpr double margin = 0.9; // share of the picture that the voxels fill
    const double tan_y = c.perspective ? std::tan(radians(options.field_of_view / 2)) : 0.0;
    const double tan_x = tan_y * aspect;

    // The nearest planes of the view frustum's four sides that keep all voxels inside: with z towards the viewer, a
    // point is inside the right side if x + z tan <= const. The camera then stands where opposite planes meet.
    constexpr double infinity = std::numeric_limits<double>::infinity();
    double right = -infinity, left = -infinity, top = -infinity, bottom = -infinity, front = -infinity;
    scene.for_each_row([&](const vec3& low, const vec3& high) {
        for (unsigned corner = 0; corner < 8; ++corner) {
            vec3 p{};
            for (std::size_t a = 0; a < 3; ++a) p[a] = (corner >> a & 1u ? high[a] : low[a]) * voxel_size[a];
            const double x = dot(p, c.right), y = dot(p, c.above), z = -dot(p, c.forward);
            right = std::max(right, x + z * tan_x * margin);
            left = std::max(left, -x + z * tan_x * margin);
            top = std::max(top, y + z * tan_y * margin);
            bottom = std::max(bottom, -y + z * tan_y * margin);
            front = std::max(front, z);
        }
    });
    const double x = (right - left) / 2;
    const double y = (top - bottom) / 2;
    double z;
    if (c.perspective) {
        z = std::max((right + left) / (2 * tan_x * margin), (top + bottom) / (2 * tan_y * margin));
        c.half_width = tan_x / options.zoom;
        c.half_height = tan_y / options.zoom;
    } else {
        const double half_height = std::max((top + bottom) / 2, (right + left) / 2 / aspect) / margin / options.zoom;
        z = front + half_height; // anywhere before the nearest voxel
        c.half_width = half_height * aspect;
        c.half_height = half_height;
    }
    c.eye = c.right * x + c.above * y - c.forward * z;
    return c;
}

} // namespace voxelize
