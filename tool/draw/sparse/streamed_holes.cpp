// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_holes.hpp"

#include "draw/surface.hpp"
#include "model/memory.hpp"
#include "model/placement.hpp"

#include <voxelpipe/slabs/holes.hpp>

#include <new>
#include <stdexcept>
#include <utility>

namespace voxelize {

streamed_holes::streamed_holes(triangle_stream& model, const voxelize_request& request, double room,
                               const std::filesystem::path& folder) {
    if (!request.solid || request.solid->close_holes == 0) return;
    closes_ = true;
    is_each_draw_ = request.solid->rule == solid_rule::each_draw;
    voxelpipe::grid grid = request.grid;
    const glm::dvec3 reference = reference_point(grid);
    grid.origin -= reference;
    const vp::core::snap_transform snap = vp::core::make_snap_transform(grid);
    const auto finder_for = [&](std::uint64_t num_triangles) {
        return vp::slabs::hole_finder(num_triangles, static_cast<std::uint64_t>(room / 8), folder.string());
    };
    const auto add = [&](vp::slabs::hole_finder& finder, std::size_t part) {
        const affine& to_world = model.parts()[part].to_world;
        const placed_vertex_shader place(to_world, reference);
        const bool mirrors = to_world.mirrors();
        model.read_part(part, [&](const triangle_stream::block& b) {
            for (std::size_t i = 0; i < b.corners.size(); i += 3) {
                const auto at = [&](std::size_t k) {
                    const glm::vec3 p = place(b.corners[i + k]);
                    return vp::core::snap(snap, p.x, p.y, p.z);
                };
                finder.add(at(0), at(mirrors ? 2 : 1), at(mirrors ? 1 : 2));
            }
        });
    };
    try {
        if (is_each_draw_) {
            for (std::size_t part = 0; part < model.parts().size(); ++part) {
                auto finder = finder_for(model.parts()[part].num_triangles);
                add(finder, part);
                cones_.push_back(finder.finish(request.solid->close_holes));
                if (!cones_.back().triangles.empty()) parts_.push_back(part);
            }
        } else {
            auto finder = finder_for(model.num_triangles());
            for (std::size_t part = 0; part < model.parts().size(); ++part) add(finder, part);
            cones_.push_back(finder.finish(request.solid->close_holes));
            if (!cones_.back().triangles.empty()) parts_.push_back(0);
        }
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage("the edges of the model's holes are held"));
    } catch (const std::length_error&) {
        throw model_error("its holes have more vertices than can be numbered");
    }
}

std::vector<voxelpipe::core::hole_cones> streamed_holes::of_bodies(std::span<const std::size_t> parts) const {
    if (!closes_) return {};
    if (!is_each_draw_) return cones_;
    std::vector<voxelpipe::core::hole_cones> of_parts;
    for (const std::size_t part : parts) of_parts.push_back(cones_[part]);
    return of_parts;
}

void streamed_holes::count(voxelize_stats& stats) const {
    if (!closes_) return;
    solid_counts& counts = stats.solid ? *stats.solid : stats.solid.emplace();
    counts.hole_edges = counts.holes = counts.closed_holes = 0;
    for (const voxelpipe::core::hole_cones& cones : cones_) {
        counts.hole_edges += cones.edges;
        counts.holes += cones.holes;
        counts.closed_holes += cones.cones;
    }
}

} // namespace voxelize
