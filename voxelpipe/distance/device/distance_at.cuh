// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// distance_at on a GPU: run_module of core::distance_at_tag, with the bytes of cpu_backend. A warp takes a point, down
// the tree of boxes to the formula; its sign by the triangles below it along x, and those that close holes.

#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/solid/core/row_crossing.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace voxelpipe::device {

struct points_history; // names the capacities of these calls

// Boxes that a row along x, from a point down, meets have distance 0.
struct row_point {
    float low[3], high[3]; // of the point, rounded

    [[nodiscard]] __device__ VOXELPIPE_INLINE float distance_from(const tree_box& b) const {
        const bool meets = b.low[0] <= high[0] && b.low[1] <= high[1] && b.high[1] >= low[1] && b.low[2] <= high[2] &&
                           b.high[2] >= low[2];
        return meets ? 0.0f : octant_search::infinity;
    }
};

// What distance_at is asked for. Bodies are numbered as in a solid: all draws, or each.
struct point_call {
    const glm::vec3* points;
    std::uint64_t num_points;
    distance_arrays out;
    fill_rule rule;
    bool has_sign;
    std::uint32_t num_draws, num_bodies;
    const core::winding_view* trees; // of each body's holes, for repair::winding; else null
};

inline constexpr unsigned warps_of_points = 4;

template <class Shading>
__global__ __launch_bounds__(32 * warps_of_points) void find_points(const __grid_constant__ distance_input in,
                                                                    const __grid_constant__ Shading shading,
                                                                    const __grid_constant__ distance_tree t,
                                                                    const __grid_constant__ point_call call,
                                                                    double largest, pipeline_state* state,
                                                                    capacities limits) {
    __shared__ tree_stack stacks[warps_of_points];
    if (has_failed(*state, limits)) return;
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    const std::uint64_t warps = std::uint64_t{gridDim.x} * warps_of_points;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * warps_of_points + warp; i < call.num_points; i += warps) {
        const glm::vec3 point = call.points[i];
        const core::snapped_position p = core::snap(in.geo.snap, point.x, point.y, point.z);
        if (!core::is_drawable(p)) {
            if (lane == 0) {
                if (call.out.distances != nullptr) call.out.distances[i] = core::bit_cast<float>(0x7fc00000u);
                if (call.out.nearest != nullptr) call.out.nearest[i] = -1;
                atomicAdd(&state->num_images, 1u);
            }
            __syncwarp();
            continue;
        }
        const tree_point at = make_tree_point(in, {p.x, p.y, p.z});
        unsigned long long square = infinite_square;
        std::uint32_t primitive = no_primitive;
        float bound = octant_search::infinity;
        const auto measure_run = [&](std::uint32_t run) {
            const std::uint64_t k = std::uint64_t{run} * 32 + lane;
            unsigned long long own = infinite_square;
            std::uint32_t id = no_primitive;
            if (k < t.num_primitives) {
                id = t.order[k];
                if (id >= in.num_counted || in.frames[id].is_wide == 2 || at.distance_from(box_of(in, id)) > bound)
                    id = no_primitive;
            }
            if (id != no_primitive) own = core::bit_cast<unsigned long long>(find_square(in, id, p, false));
            __syncwarp();
            for (int step = 16; step > 0; step /= 2) {
                const unsigned long long other = __shfl_xor_sync(0xffffffffu, own, step);
                const std::uint32_t other_id = __shfl_xor_sync(0xffffffffu, id, step);
                if (other < own || (other == own && other_id < id)) {
                    own = other;
                    id = other_id;
                }
            }
            if (own < square || (own == square && id < primitive)) {
                square = own;
                primitive = id;
                bound = static_cast<float>(exact::sqrt(core::bit_cast<double>(square)) / largest) * (1.0f + 0x1p-20f);
            }
        };
        visit_one_run(t, at, measure_run);
        visit_runs(
            t, at, stacks[warp], [&] { return bound; }, measure_run);
        float distance = core::distance_of(core::bit_cast<double>(square));

        bool is_inside = false;
        if (call.has_sign && distance > 0.0f) {
            row_point row{};
            for (int k = 0; k < 3; ++k) {
                row.low[k] = at.c[k] - 0x1p-22f * magnitude(at.c[k]);
                row.high[k] = at.c[k] + 0x1p-22f * magnitude(at.c[k]);
            }
            for (std::uint32_t body = 0; body < call.num_bodies && !is_inside; ++body) {
                int winding = 0, of_cones = 0;
                bool is_on_cone = false;
                visit_runs(
                    t, row, stacks[warp], [] { return 1.0f; },
                    [&](std::uint32_t run) {
                        const std::uint64_t k = std::uint64_t{run} * 32 + lane;
                        int own = 0, own_cones = 0;
                        bool is_on = false;
                        if (k < t.num_primitives && in.frames[t.order[k]].is_wide != 2) {
                            const loaded_triangle tri = in.geo.load(t.order[k]);
                            const std::uint32_t of = tri.draw < call.num_draws ? tri.draw : tri.draw - call.num_draws;
                            if (call.num_bodies == 1 || of == body) {
                                own = core::crossing_below(tri.a, tri.b, tri.c, p);
                                if (call.trees != nullptr && tri.draw >= call.num_draws) {
                                    own_cones = own;
                                    is_on = core::is_on_triangle(tri.a, tri.b, tri.c, p);
                                }
                            }
                        }
                        __syncwarp();
                        winding += __reduce_add_sync(0xffffffffu, own);
                        if (call.trees == nullptr) return;
                        of_cones += __reduce_add_sync(0xffffffffu, own_cones);
                        is_on_cone = is_on_cone || __any_sync(0xffffffffu, static_cast<int>(is_on)) != 0;
                    });
                is_inside =
                    call.trees != nullptr
                        ? core::is_inside_by_winding(call.trees[body], p, {winding, of_cones, is_on_cone}, call.rule)
                    : call.rule == fill_rule::even_odd ? winding % 2 != 0
                    : call.rule == fill_rule::positive ? winding > 0
                                                       : winding != 0;
            }
        }
        if (lane == 0) {
            std::int64_t nearest = -1;
            if (primitive != no_primitive) {
                const std::uint32_t draw = in.geo.find_draw(primitive);
                loaded_triangle tri;
                in.geo.draw(draw).locate(primitive, tri);
                const core::numbering& numbers = shading.draw(draw).numbers;
                nearest = numbers.whole != 0 ? numbers.of(tri.triangle, tri.instance).primitive : primitive;
            }
            if (call.out.distances != nullptr) call.out.distances[i] = is_inside ? -distance : distance;
            if (call.out.nearest != nullptr) call.out.nearest[i] = nearest;
        }
        __syncwarp();
    }
}

} // namespace voxelpipe::device

namespace voxelpipe::core {

// Implements distance_at. Arguments are validated.
template <class Mesh, class VertexShader, class Shader>
[[nodiscard]] status run_module(distance_at_tag, cuda_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> given, const grid& g,
                                backend_view<const glm::vec3> points, const distance_arrays& out,
                                const distance_options& options, std::uint64_t triangles_in) {
    using draw_type = draw<Mesh, VertexShader, distance>;
    using draws_type = device::distance_draws<Mesh, VertexShader, distance>;
    if (const status s = device::check_subsets(given, backend); !s.ok()) return s;
    std::vector<draw_type> copies;
    for (const auto& d : given) copies.push_back({d.mesh, d.vertex_shader, {}});
    const std::span<const draw_type> draws(copies);
    const bool has_sign = options.sign == distance_sign::inside && triangles_in != 0;
    const solid_options solid = has_sign ? sign_options(options) : solid_options{};
    return device::with_cones(backend, draws, g, solid, triangles_in, [&](const device::solid_cones& cones) {
        const auto num = static_cast<std::uint32_t>(triangles_in + cones.num_triangles);
        device::pipeline_state last{};
        status s = device::attempt(
            backend.history<device::points_history>(), {triangles_in, g.extent, g.offset, coverage::conservative},
            device::max_listed_entries, backend.times, backend.stream,
            [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
                const auto take = [&](device::arena& a, device::pipeline_state*& d_state, device::distance_input& in,
                                      device::tree_memory& tree) {
                    d_state = a.take<device::pipeline_state>(1);
                    const draws_type of_draws(a, draws, cones.parts.size());
                    in = device::make_distance_input(g, options);
                    in.num_counted = static_cast<std::uint32_t>(triangles_in);
                    in.frames = a.take<device::triangle_frame>(num);
                    in.triangles = a.take<device::kept_triangle>(num);
                    tree = device::tree_memory::take(a, num);
                    return of_draws;
                };
                device::pipeline_state* d_state = nullptr;
                device::distance_input in{};
                device::tree_memory tree{};
                device::arena plan;
                (void)take(plan, d_state, in, tree);
                device::arena carved(
                    backend.workspace().prepare(plan.used(), backend, backend.use_pinned_memory, backend.use_graphs));
                const draws_type of_draws = take(carved, d_state, in, tree);
                device::launch_until(stage::fine_raster, [&] {
                    state = backend.workspace().run(
                        clock, std::nullopt, sizeof(device::pipeline_state), backend.stream, [&](cudaStream_t on) {
                            typename draws_type::shading_type shading{};
                            of_draws.shade(draws, g, in.geo, shading, on, cones.parts);
                            device::end_stage(clock, &stage_times::vertex_shade);
                            device::place_triangles<0><<<device::num_blocks(num), device::threads_per_block, 0, on>>>(
                                in, device::band_memory{}, d_state, guess.limits);
                            device::check(cudaGetLastError(), stage::coarse_raster);
                            const device::distance_tree made = device::make_tree<0>(in, tree, on);
                            device::end_stage(clock, &stage_times::coarse_raster);
                            const bool is_split = options.bodies == bodies::draw;
                            const device::point_call call{points.data(),
                                                          points.size(),
                                                          out,
                                                          options.rule,
                                                          has_sign,
                                                          static_cast<std::uint32_t>(draws.size()),
                                                          is_split ? static_cast<std::uint32_t>(draws.size()) : 1u,
                                                          cones.trees.empty() ? nullptr : cones.trees[0].data()};
                            const glm::dvec3 size = g.voxel_size;
                            if (points.size() != 0) {
                                device::find_points<typename draws_type::shading_type>
                                    <<<device::fill_device(points.size() * 32), 32 * device::warps_of_points, 0, on>>>(
                                        in, shading, made, call, std::max({size.x, size.y, size.z}), d_state,
                                        guess.limits);
                                device::check(cudaGetLastError(), stage::fine_raster);
                            }
                            device::end_stage(clock, &stage_times::fine_raster);
                        });
                });
                last = state;
                return false;
            });
        if (!s.ok()) return s;
        s.distance.bad_points = last.num_images;
        s.distance.band_samples = last.drawn == 0 ? 0 : points.size() - last.num_images;
        return s;
    });
}

} // namespace voxelpipe::core
