// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// distance_at on CPU threads: each point by itself, down the tree of boxes to the formula; its sign by the triangles
// below it along x.

#include <cpu_ref/distance/voxelize_distance.hpp>
#include <voxelpipe/solid/core/row_crossing.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The tree's point of a snapped position.
[[nodiscard]] inline vector3 place(const core::snapped_position& p, const vector3& scale) {
    return {static_cast<double>(p.x) * scale.x, static_cast<double>(p.y) * scale.y, static_cast<double>(p.z) * scale.z};
}

// The nearest triangle of any point. hint: one that may be near, on which the result does not depend;
// nearest_triangle{}.primitive: none is known.
[[nodiscard]] inline nearest_triangle find_nearest(const geometry& s, const triangle_tree& tree, const vector3& scale,
                                                   const core::distance_scale& world, double largest,
                                                   const core::snapped_position& p, std::uint32_t hint) {
    nearest_triangle best;
    float bound = std::numeric_limits<float>::infinity();
    const vector3 at = place(p, scale);
    const auto take = [&](std::uint32_t primitive) {
        const snapped_triangle u = find_triangle(s, primitive);
        best.take(core::find_distance(core::see_wide(u.a, u.b, u.c, p), world).square, primitive);
        bound = static_cast<float>(std::sqrt(best.square) / largest) * (1.0f + 0x1p-20f);
    };
    if (hint != nearest_triangle{}.primitive) take(hint);
    tree.visit(
        at, [&] { return bound; },
        [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const placed_triangle& t = tree[i];
                const auto gap = [](double a, double b, double c, double q) {
                    return std::max({std::min({a, b, c}) - q, q - std::max({a, b, c}), 0.0});
                };
                const auto& v = t.vertex;
                const double x = gap(v[0].x, v[1].x, v[2].x, at.x), y = gap(v[0].y, v[1].y, v[2].y, at.y),
                             z = gap(v[0].z, v[1].z, v[2].z, at.z);
                const double most =
                    double{bound} * (1.0 + 0x1p-20) + 0x1p-40 * (std::abs(at.x) + std::abs(at.y) + std::abs(at.z));
                if (x * x + y * y + z * z > most * most) continue;
                if (t.primitive != best.primitive) take(t.primitive);
            }
        });
    return best;
}

// True if a body has the point inside. trees: of each body's holes, for repair::winding, or none.
[[nodiscard]] inline bool is_inside(const solid_geometry& s, const triangle_tree& tree, const vector3& scale,
                                    fill_rule rule, const std::vector<core::winding_tree>& trees,
                                    const core::snapped_position& p, std::vector<std::int64_t>& windings) {
    std::fill(windings.begin(), windings.end(), 0);
    std::vector<core::winding_sample> samples(trees.size());
    tree.visit_below(place(p, scale), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const std::uint32_t id = tree[i].primitive;
            const snapped_triangle t = find_triangle(s, id);
            const std::size_t part = s.find(id).draw, body = s.body[part];
            const int crossing = core::crossing_below(t.a, t.b, t.c, p);
            windings[body] += crossing;
            if (trees.empty() || !s.is_repair[part]) continue;
            samples[body].k_cones += crossing;
            samples[body].is_on_cone = samples[body].is_on_cone || core::is_on_triangle(t.a, t.b, t.c, p);
        }
    });
    for (std::size_t body = 0; body < trees.size(); ++body) {
        samples[body].k = windings[body];
        if (core::is_inside_by_winding(trees[body].view(), p, samples[body], rule)) return true;
    }
    if (!trees.empty()) return false;
    return std::any_of(windings.begin(), windings.end(), [&](std::int64_t w) {
        return rule == fill_rule::even_odd ? w % 2 != 0 : rule == fill_rule::positive ? w > 0 : w != 0;
    });
}

} // namespace voxelpipe::cpu

namespace voxelpipe::core {

// Implements distance_at. Arguments are validated.
template <class Mesh, class VertexShader, class Shader>
[[nodiscard]] status run_module(distance_at_tag, cpu_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& g,
                                backend_view<const glm::vec3> points, const distance_arrays& out,
                                const distance_options& options, std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        const cpu::distance_call<cpu::scene<Mesh, VertexShader, Shader>> call(how, draws, g, options);
        status result = call.begin({});
        if (!result.ok()) return result;
        const double unit = std::ldexp(1.0, -call.shapes.snap.fraction);
        const cpu::vector3 scale{call.scene.voxel.x * unit, call.scene.voxel.y * unit, call.scene.voxel.z * unit};
        const double largest = std::max({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z});

        // The bodies, with the cones that close them.
        std::optional<cpu::solid_geometry> bodies;
        std::unique_ptr<cpu::triangle_tree> body_tree;
        std::vector<winding_tree> trees;
        std::size_t num_bodies = 0;
        if (options.sign == distance_sign::inside && triangles_in != 0) {
            const solid_options solid = sign_options(options);
            bodies.emplace(cpu::make_solid_geometry(how, draws, g, glm::ivec3(0), solid));
            if (has_cones(options.repair) && !cpu::add_cones(*bodies, solid, result.solid))
                return cpu::solid_failure(status_code::too_many_triangles, *bodies);
            if (options.repair == repair::winding) trees = cpu::make_winding_trees(how, *bodies);
            body_tree = std::make_unique<cpu::triangle_tree>(how, *bodies, cpu::reach_of(options, g),
                                                             triple<std::int64_t>{}, scale);
            num_bodies = *std::max_element(bodies->body.begin(), bodies->body.end()) + std::size_t{1};
        }

        how.enter(stage::fine_raster);
        const cpu::stopwatch watch(how.times, &stage_times::fine_raster);
        constexpr std::size_t block = 256;
        const std::size_t blocks = (points.size() + block - 1) / block;
        std::vector<std::uint64_t> bad(blocks);
        cpu::parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
            std::vector<std::int64_t> windings(num_bodies);
            cpu::nearest_triangle n; // of the point before, which is near, as a rule
            for (std::size_t i = b * block; i < std::min(points.size(), (b + 1) * block); ++i) {
                const glm::vec3 point = points[i];
                const snapped_position p = snap(call.shapes.snap, point.x, point.y, point.z);
                float distance = std::numeric_limits<float>::quiet_NaN();
                std::int64_t nearest = -1;
                if (!is_drawable(p)) {
                    ++bad[b];
                } else {
                    n = cpu::find_nearest(call.shapes, *call.tree, scale, call.scene.scale, largest, p, n.primitive);
                    distance = distance_of(n.square);
                    if (!call.tree->empty())
                        nearest = call.shapes.numbers_of(call.shapes.find(n.primitive), n.primitive).primitive;
                    if (distance > 0.0f && body_tree != nullptr &&
                        cpu::is_inside(*bodies, *body_tree, scale, options.rule, trees, p, windings))
                        distance = -distance;
                }
                if (out.distances != nullptr) out.distances[i] = distance;
                if (out.nearest != nullptr) out.nearest[i] = nearest;
            }
        });
        for (const std::uint64_t n : bad) result.distance.bad_points += n;
        result.distance.band_samples = call.tree->empty() ? 0 : points.size() - result.distance.bad_points;
        return result;
    });
}

} // namespace voxelpipe::core
