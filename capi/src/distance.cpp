// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "backend_calls.hpp"

using namespace voxelpipe;
using namespace voxelpipe::capi;

namespace {

distance_options distance_options_of(const vp_distance_options* from) {
    const vp_distance_options o = options_of(from);
    distance_options options;
    if (o.is_whole != 0 && o.band != 0.0) throw failure{VP_ERROR_BAD_OPTION, "band is not 0, and is_whole is set"};
    if (o.is_whole != 0)
        options.band = band::whole;
    else if (o.band != 0.0)
        options.band = band(o.band);
    options.sample = o.at_corners != 0 ? sample::corner : sample::centre;
    const vp_solid_options sign{sizeof(vp_solid_options), o.fill, o.bodies, VP_EXTENT_CENTRE, o.repair, o.closing,
                                o.max_hole_edges};
    const solid_options solid = solid_options_of(sign);
    options.sign = o.is_unsigned != 0 ? distance_sign::none : distance_sign::inside;
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    return options;
}

} // namespace

extern "C" {

vp_code vp_distance(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_distance_options* options,
                    const vp_array* out, const vp_array* nearest, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const distance_options o = distance_options_of(options);
        check_counters(counters);
        const glm::ivec3 extent = o.sample == sample::corner ? g.at_corners().extent : g.extent;
        const array_place to = place_of(out, "out", {VP_TYPE_FLOAT32}, extent);
        if (nearest == nullptr) {
            finish(draw_into<float>(to, c.threads,
                                    [&](float* d) { return c.on.fields->distance_field(m, g, extent, o, d, nullptr); }),
                   counters);
            return;
        }
        const array_place to_nearest = place_of(nearest, "nearest", {VP_TYPE_INT64}, extent);
        finish(draw_into<float>(to, c.threads,
                                [&](float* d) {
                                    return draw_into<std::int64_t>(to_nearest, c.threads, [&](std::int64_t* n) {
                                        return c.on.fields->distance_field(m, g, extent, o, d, n);
                                    });
                                }),
               counters);
    });
}

vp_code vp_distance_at(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                       const vp_distance_options* options, const float* points, uint64_t num_points,
                       uint64_t point_stride, float* distances_out, int64_t* nearest, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const distance_options o = distance_options_of(options);
        check_counters(counters);
        if (num_points != 0) check_pointer(points, "points");
        if (point_stride == 0) point_stride = sizeof(glm::vec3);
        if (point_stride < sizeof(glm::vec3) || num_points > UINT64_MAX / 2 / point_stride)
            throw failure{VP_ERROR_BAD_ARRAY, "point_stride is less than 12 bytes, or there are more bytes than can be "
                                              "addressed"};
        std::vector<glm::vec3> at(num_points);
        const auto* from = reinterpret_cast<const unsigned char*>(points);
        for (std::uint64_t i = 0; i < num_points; ++i) std::memcpy(&at[i], from + i * point_stride, sizeof(glm::vec3));
        finish(c.on.fields->distances_at(m, g, o, at, distances_out, nearest), counters);
    });
}

} // extern "C"
