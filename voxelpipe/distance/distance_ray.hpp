// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reading a distance field, on the host and on the device: its value and gradient anywhere, and the first point at
// which a ray meets one of its levels. The same bits on both.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/distance/distance.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <type_traits>

namespace voxelpipe {

// A field of distances in memory that the caller of its functions can read; not owned. Between samples it is trilinear,
// and beyond the outermost ones constant along each axis.
struct distance_samples {
    const float* values; // x fastest
    glm::ivec3 extent;   // samples an axis, 1 at least
    glm::dvec3 first;    // world position of the lowest sample
    glm::dvec3 spacing;  // world units, per axis, > 0

    // The eight samples around a position, and where it lies between them.
    struct cell {
        float v[8];    // x changes fastest
        float part[3]; // 0 to 1
    };
    // The cell of samples that holds a world position; positions outside the field are moved to its border.
    [[nodiscard]] VOXELPIPE_HD cell cell_at(const glm::dvec3& world) const {
        cell c{};
        int low[3], high[3];
        for (int k = 0; k < 3; ++k) {
            const double last = extent[k] - 1;
            double at = exact::div(world[k] - first[k], spacing[k]);
            at = at > 0.0 ? at : 0.0;
            at = at < last ? at : last;
            low[k] = static_cast<int>(at);
            low[k] = low[k] < extent[k] - 1 ? low[k] : extent[k] > 1 ? extent[k] - 2 : 0;
            high[k] = extent[k] > 1 ? low[k] + 1 : 0;
            c.part[k] = exact::to_float(at - low[k]);
        }
        for (int i = 0; i < 8; ++i) {
            const auto x = static_cast<std::size_t>((i & 1) != 0 ? high[0] : low[0]),
                       y = static_cast<std::size_t>((i & 2) != 0 ? high[1] : low[1]),
                       z = static_cast<std::size_t>((i & 4) != 0 ? high[2] : low[2]);
            c.v[i] = values[(z * static_cast<std::size_t>(extent.y) + y) * static_cast<std::size_t>(extent.x) + x];
        }
        return c;
    }

    // The distance at a world position.
    [[nodiscard]] VOXELPIPE_HD float operator()(const glm::dvec3& world) const {
        const cell c = cell_at(world);
        return between(face(c, 0), face(c, 4), c.part[2]);
    }

    // Its derivatives along x, y and z: about a unit vector away from the surface within the band, 0 beyond it.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 gradient(const glm::dvec3& world) const {
        const cell c = cell_at(world);
        const auto along = [&](int step, int a, int b) {
            const auto change = [&](int i) { return exact::sub(c.v[i + step], c.v[i]); };
            const int sa = 1 << a, sb = 1 << b;
            return between(between(change(0), change(sa), c.part[a]), between(change(sb), change(sa + sb), c.part[a]),
                           c.part[b]);
        };
        return {exact::div(along(1, 1, 2), exact::to_float(spacing.x)),
                exact::div(along(2, 0, 2), exact::to_float(spacing.y)),
                exact::div(along(4, 0, 1), exact::to_float(spacing.z))};
    }

private:
    [[nodiscard]] VOXELPIPE_HD static float between(float a, float b, float t) { return exact::lerp(a, b, t); }
    [[nodiscard]] VOXELPIPE_HD static float face(const cell& c, int i) {
        return between(between(c.v[i], c.v[i + 1], c.part[0]), between(c.v[i + 2], c.v[i + 3], c.part[0]), c.part[1]);
    }
};

// The samples of a field that voxelize_distance has drawn in a linear target. `g` and `where` as in that call.
template <class Target>
[[nodiscard]] distance_samples samples_of(const target_view<Target>& distances, const grid& g,
                                          sample where = sample::centre) {
    static_assert(std::is_same_v<typename Target::value_type, float> &&
                      std::is_same_v<typename Target::layout_type, layout::linear>,
                  "voxelpipe: a field of distances is read from a linear target of float");
    const grid s = core::sample_grid(g, where);
    return {distances.elements, s.extent, s.to_world(glm::dvec3(0.5)), s.voxel_size};
}

// Where a ray meets a level.
struct distance_hit {
    bool hit;           // false: nowhere up to `farthest`; the rest is 0
    float t;            // along the direction
    glm::vec3 gradient; // of the field there
};

// The first point of origin + t * direction, 0 <= t <= farthest, at which the field passes through `level`, from either
// side, among those between the outermost samples. The direction has length 1. Steps are the distance left, but a
// quarter of the least spacing at least: what is thinner than that may be missed. A field of a band takes steps of the
// band.
[[nodiscard]] VOXELPIPE_HD inline distance_hit trace(const distance_samples& field, const glm::dvec3& origin,
                                                     const glm::dvec3& direction, double farthest, float level = 0.0f) {
    double begin = 0.0, end = farthest;
    for (int k = 0; k < 3; ++k) {
        const double low = field.first[k], high = exact::fma(field.spacing[k], field.extent[k] - 1, low);
        if (!(direction[k] < 0.0 || direction[k] > 0.0)) {
            if (origin[k] < low || origin[k] > high) return {};
            continue;
        }
        const double a = exact::div(low - origin[k], direction[k]), b = exact::div(high - origin[k], direction[k]);
        begin = core::greater(begin, core::lesser(a, b));
        end = core::lesser(end, core::greater(a, b));
    }
    if (!(begin <= end)) return {};
    const auto at = [&](double t) {
        return glm::dvec3(exact::fma(direction.x, t, origin.x), exact::fma(direction.y, t, origin.y),
                          exact::fma(direction.z, t, origin.z));
    };
    const auto over = [&](double t) { return exact::sub(field(at(t)), level); };
    const double least =
        exact::mul(0.25, core::lesser(core::lesser(field.spacing.x, field.spacing.y), field.spacing.z));
    double t = begin;
    float here = over(t);
    const bool above = here > 0.0f;
    while (true) {
        if (!(here < 0.0f || here > 0.0f)) return {true, exact::to_float(t), field.gradient(at(t))};
        if (!(t < end)) return {};
        // A trilinear field changes by sqrt(3) a unit at most.
        const double step = exact::mul(0.57735, exact::to_double(here < 0.0f ? -here : here));
        double next = core::add_doubles(t, core::greater(step, least));
        next = core::lesser(next, end);
        const float there = over(next);
        if ((there > 0.0f) != above) { // halves the interval, whose ends lie on two sides
            double low = t, high = next;
            for (int i = 0; i < 40; ++i) {
                const double middle = exact::mul(0.5, core::add_doubles(low, high));
                if ((over(middle) > 0.0f) == above)
                    low = middle;
                else
                    high = middle;
            }
            return {true, exact::to_float(high), field.gradient(at(high))};
        }
        t = next;
        here = there;
    }
}

} // namespace voxelpipe
