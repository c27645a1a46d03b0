// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_model.hpp"

#include "../formats/output_file.hpp"
#include "../memory.hpp"
#include "../parallel.hpp"
#include "../placement.hpp"
#include "../surface.hpp"
#include "sparse_voxelizer.hpp"

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>

#include <algorithm>
#include <chrono>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

namespace slabs = voxelpipe::slabs;
using corner_record = slabs::record<vp::no_varyings>; // positions as the file has them

constexpr double draw_bytes =
    220; // for each triangle of a slab, at least: record, scene, snapped vertices, pairs with tiles
constexpr int brick = 8;

// The corners as the pipeline places them, in the request's grid.
class corner_placer {
public:
    corner_placer(const voxelize_request& request, const affine& to_world)
        : place_(to_world, reference_point(request.grid)),
          rule_(request.solid ? voxelpipe::coverage::conservative : request.coverage),
          is_solid_(request.solid.has_value()) {
        grid_ = request.grid;
        grid_.origin -= reference_point(request.grid);
        snap_ = vp::core::make_snap_transform(grid_);
    }
    [[nodiscard]] slabs::classified operator()(const glm::vec3* corners) const {
        return slabs::classify(snap_, grid_.extent, rule_, place_(corners[0]), place_(corners[1]), place_(corners[2]),
                               is_solid_);
    }

private:
    placed_vertex_shader place_;
    voxelpipe::coverage rule_;
    bool is_solid_; // triangles beside the grid along x count too
    voxelpipe::grid grid_;
    vp::core::snap_transform snap_{};
};

// A slab's triangles as a scene of one primitive, which knows their numbers.
scene scene_of(const slabs::bin<corner_record>& triangles, std::uint64_t whole, const affine& to_world) {
    scene model;
    model.materials.emplace_back();
    primitive& part = model.primitives.emplace_back();
    const auto count = static_cast<std::size_t>(triangles.size());
    part.positions.reserve(3 * count);
    part.triangles.reserve(count);
    part.numbers.reserve(count);
    part.whole = whole;
    triangles.for_each_block([&](std::span<const corner_record> block) {
        for (const corner_record& r : block) {
            const auto first = static_cast<std::uint32_t>(part.positions.size());
            part.positions.insert(part.positions.end(), r.positions, r.positions + 3);
            part.triangles.emplace_back(first, first + 1, first + 2);
            part.numbers.push_back(r.number);
        }
    });
    model.instances.push_back({0, to_world});
    return model;
}

} // namespace

std::unique_ptr<triangle_stream> streamed_input(const command_line& options) {
    const voxelize_request& request = options.voxelize;
    // Repairs need the whole mesh.
    const bool is_by_rule = !request.solid || (request.solid->rule != solid_rule::exterior && !request.solid->vote &&
                                               request.solid->close_holes == 0);
    const bool is_drawn_here = request.backend != backend_choice::cuda &&
                               request.strategy == voxelpipe::strategy::automatic && is_by_rule &&
                               options.storage != storage_choice::dense;
    const bool has_targets = std::all_of(request.targets.begin(), request.targets.end(), [](target t) {
        return t == target::occupancy || t == target::count || t == target::normal || t == target::triangle ||
               t == target::depth;
    });
    if (!is_drawn_here || !has_targets) return nullptr;
    std::unique_ptr<triangle_stream> file = open_stream(options.input, memory::room() / 8, options.load);
    if (file && file->held_bytes() <= static_cast<double>(memory::room())) return nullptr;
    return file;
}

void add_part(voxelize_stats& all, const voxelize_stats& part) {
    all.triangles_drawn += part.triangles_drawn;
    all.fragments += part.fragments;
    all.fragments_discarded += part.fragments_discarded;
    all.voxels += part.voxels;
    all.normals_cancelled += part.normals_cancelled;
    if (part.solid) {
        solid_counts& to = all.solid ? *all.solid : all.solid.emplace();
        to.rows += part.solid->rows;
        to.open_rows += part.solid->open_rows;
        to.crossings += part.solid->crossings;
        to.max_winding = std::max(to.max_winding, part.solid->max_winding);
        to.hole_edges = part.solid->hole_edges;
        to.holes = part.solid->holes;
        to.closed_holes = part.solid->closed_holes;
    }
    for (const auto& stage : part.milliseconds) {
        const auto found = std::find_if(all.milliseconds.begin(), all.milliseconds.end(),
                                        [&](const auto& known) { return known.first == stage.first; });
        if (found == all.milliseconds.end())
            all.milliseconds.push_back(stage);
        else
            found->second += stage.second;
    }
}

void warn_of_parts(voxelize_stats& stats, const voxelize_request& request) {
    if (std::string text = cancelled_warning(stats); !text.empty()) stats.warnings.push_back(std::move(text));
    if (!request.solid || !stats.solid) return;
    if (std::string text = open_warning(*request.solid, *stats.solid); !text.empty())
        stats.warnings.push_back(std::move(text));
}

namespace {

// A slab that is drawn at once: layers of one range.
struct streamed_slab {
    slabs::layer_range layers;
    std::size_t range;
    slabs::bin<corner_record> triangles;
};

// The slabs of a plan, cut at the borders of the ranges.
std::vector<streamed_slab> slabs_within(const slabs::plan& plan, std::span<const slabs::layer_range> ranges) {
    std::vector<streamed_slab> parts;
    for (std::size_t r = 0; r < ranges.size(); ++r)
        for (const slabs::layer_range& s : plan.slabs)
            if (const int begin = std::max(s.begin, ranges[r].begin), end = std::min(s.end, ranges[r].end); begin < end)
                parts.push_back({{begin, end}, r, {}});
    return parts;
}

} // namespace

void draw_streamed(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                   std::span<const slabs::layer_range> ranges, voxelize_stats& stats,
                   const std::function<void(std::size_t, sparse_volume&&)>& sink) {
    const voxelpipe::grid& whole = request.grid;
    const corner_placer classify(request, place.to_world);
    stats.backend = "cpu";
    stats.threads = thread_count(request.threads);
    stats.triangles = model.num_triangles();
    const auto room = static_cast<double>(memory::room());
    const auto start = std::chrono::steady_clock::now();

    slabs::histogram layers(whole.extent);
    vp::counters counts;
    model.for_each_block([&](std::span<const glm::vec3> corners, std::uint64_t) {
        for (std::size_t i = 0; i < corners.size(); i += 3) {
            const slabs::classified c = classify(corners.data() + i);
            vp::core::count_class(counts, c.kind);
            if (c.kind == vp::core::triangle_class::drawn) layers.add(c.reach);
        }
    });
    slabs::plan_options how;
    how.align = brick;
    const auto most = static_cast<std::uint64_t>(std::max(1.0, room / 4 / draw_bytes));
    std::vector<streamed_slab> parts = slabs_within(slabs::cover(layers, 2, most, how), ranges);
    place.say(std::to_string(model.num_triangles()) + " triangles do not fit into " + memory::mebibytes(room) +
              ": they are drawn in " + std::to_string(parts.size()) + " slabs, through temporary files in " +
              place.folder.string());

    try {
        // The first slab that ends behind a layer.
        std::vector<std::size_t> first_slab(static_cast<std::size_t>(whole.extent.z) + 1, parts.size());
        for (std::size_t s = parts.size(); s-- > 0;) std::fill_n(first_slab.begin(), parts[s].layers.end, s);
        std::vector<slabs::bin<corner_record>> bins(parts.size());
        {
            slabs::bin_memory<corner_record> spilled(static_cast<std::uint64_t>(room / 8), bins.size(),
                                                     place.folder.string());
            model.for_each_block([&](std::span<const glm::vec3> corners, std::uint64_t first) {
                for (std::size_t i = 0; i < corners.size(); i += 3) {
                    const slabs::classified c = classify(corners.data() + i);
                    if (c.kind != vp::core::triangle_class::drawn) continue;
                    const corner_record r{{corners[i], corners[i + 1], corners[i + 2]},
                                          static_cast<std::uint32_t>(first + i / 3)};
                    for (std::size_t s = first_slab[static_cast<std::size_t>(c.reach.lo[2])];
                         s < parts.size() && parts[s].layers.begin <= c.reach.hi[2]; ++s)
                        spilled.push(bins, s, r);
                }
            });
        }
        for (std::size_t s = 0; s < parts.size(); ++s) parts[s].triangles = std::move(bins[s]);
        const std::chrono::duration<double, std::milli> binning = std::chrono::steady_clock::now() - start;
        stats.milliseconds.emplace_back("bin", binning.count());
        stats.triangles_dropped = counts.triangles_dropped();
        stats.triangles_flat = counts.triangles_zero_area;

        // Nothing is drawn in the padding.
        const int padding = request.padding;
        for (std::size_t r = 0, s = 0; r < ranges.size(); ++r) {
            std::vector<sparse_volume> of_range;
            for (; s < parts.size() && parts[s].range == r; ++s) {
                const int begin = std::max(parts[s].layers.begin, padding),
                          end = std::min(parts[s].layers.end, whole.extent.z - padding);
                scene of_slab = scene_of(std::exchange(parts[s].triangles, {}), model.num_triangles(), place.to_world);
                if (begin >= end) continue;
                if (of_slab.triangle_count() == 0) { // nothing to draw; its rows are counted
                    if (request.solid)
                        (stats.solid ? *stats.solid : stats.solid.emplace()).rows +=
                            static_cast<std::uint64_t>(end - begin) *
                            static_cast<std::uint64_t>(whole.extent.y - 2 * padding);
                    continue;
                }
                voxelize_request part = request;
                part.grid = whole.crop({padding, padding, begin},
                                       {whole.extent.x - 2 * padding, whole.extent.y - 2 * padding, end - begin});
                part.work_memory =
                    request.work_memory != 0 ? request.work_memory : static_cast<std::uint64_t>(room / 8);
                const double done = static_cast<double>(s), all = static_cast<double>(parts.size());
                if (request.progress)
                    part.progress = [&, done, all](double share) { request.progress((done + share) / all); };
                voxelize_stats of_part;
                of_range.push_back(draw_sparse(of_slab, part, whole, of_part));
                add_part(stats, of_part);
                ++stats.slabs;
            }
            if (of_range.empty()) { // the whole grid without a triangle
                scene nothing = scene_of({}, 0, place.to_world);
                voxelize_stats none;
                voxelize_request inside = request;
                inside.grid = whole.crop(glm::ivec3(padding), whole.extent - 2 * padding);
                of_range.push_back(draw_sparse(nothing, inside, whole, none));
            }
            sink(r, of_range.size() == 1 ? std::move(of_range[0]) : join_slabs(std::move(of_range)));
        }
        warn_of_parts(stats, request);
    } catch (const std::system_error& error) {
        throw write_error(place.folder, "temporary files for the triangles: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage("take fewer targets or voxels"));
    }
}

sparse_volume run_streamed_voxelizer(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                                     voxelize_stats& stats) {
    sparse_volume all;
    const slabs::layer_range layers{0, request.grid.extent.z};
    draw_streamed(model, place, request, std::span(&layers, 1), stats,
                  [&](std::size_t, sparse_volume&& bricks) { all = std::move(bricks); });
    return all;
}

} // namespace voxelize
