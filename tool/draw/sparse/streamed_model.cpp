// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_model.hpp"

#include "draw/body_fill.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "model/placement.hpp"
#include "slab_joiner.hpp"
#include "slab_passes.hpp"
#include "sparse_voxelizer.hpp"
#include "streamed_holes.hpp"
#include "streamed_slab.hpp"
#include "streamed_vote.hpp"
#include "write/formats/output_file.hpp"

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>

#include <algorithm>
#include <chrono>
#include <limits>
#include <new>
#include <optional>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

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
        to.touched += part.solid->touched;
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

// The slabs of a plan, cut at the borders of the ranges: those within the ranges that are wanted.
template <class Varyings>
std::vector<streamed_slab<Varyings>> slabs_within(const slabs::plan& plan, std::span<const slabs::layer_range> ranges,
                                                  const std::vector<bool>& wanted) {
    std::vector<streamed_slab<Varyings>> parts;
    for (std::size_t r = 0; r < ranges.size(); ++r) {
        if (!wanted[r]) continue;
        for (const slabs::layer_range& s : plan.slabs) {
            const int begin = std::max(s.begin, ranges[r].begin), end = std::min(s.end, ranges[r].end);
            if (begin >= end) continue;
            auto& part = parts.emplace_back();
            part.layers = {begin, end};
            part.range = r;
        }
    }
    return parts;
}

void add_time(voxelize_stats& stats, const char* stage, std::chrono::steady_clock::time_point since) {
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - since;
    stats.milliseconds.emplace_back(stage, time.count());
}

// --fill body: what the draws of a slab need to know of the model's bodies.
class streamed_bodies {
public:
    // Reads the model once more where colours of vertices or textures are asked for, and once for the lids of each
    // body. Throws as streamed_holes does, and memory_error for a model whose connected parts are asked for.
    streamed_bodies(triangle_stream& model, const voxelize_request& request, double room,
                    const std::filesystem::path& folder) {
        if (!request.solid || request.solid->fill != solid_fill::body) return;
        const bool wants_colors = request.wants_colors();
        if (!wants_colors && !request.wants(target::material)) return;
        fills_ = true;
        stream_colors colors;
        if (wants_colors) colors = colors_of(model, request);
        if (colors.varies && model.parts().size() == 1)
            throw memory_error(memory::shortage("--fill body needs the connected parts of a model of one draw whose "
                                                "colours differ, which a streamed model does not have; take --fill "
                                                "mean or --fill '#rrggbb'"));
        for (std::size_t p = 0; p < model.parts().size(); ++p)
            bodies_.push_back({wants_colors ? colors.of_parts[p] : body_color{},
                               static_cast<std::int32_t>(model.parts()[p].material)});
        voxelize_request each = request;
        each.solid->rule = solid_rule::each_draw;
        each.solid->close_holes = lids_of_bodies(*request.solid);
        if (each.solid->close_holes == 0) return;
        holes_.emplace(model, each, room, folder);
    }
    [[nodiscard]] bool fills() const { return fills_; }
    // Parts that a slab has to have for the lids of their bodies.
    [[nodiscard]] std::vector<std::size_t> parts() const {
        return holes_ ? holes_->parts() : std::vector<std::size_t>();
    }
    // The state that draws of these parts carry on.
    [[nodiscard]] known_bodies of(std::span<const std::size_t> parts) const {
        known_bodies made;
        if (!fills_) return made;
        for (const std::size_t part : parts) made.bodies.push_back(bodies_[part]);
        if (holes_) made.cones = holes_->of_bodies(parts);
        return made;
    }

private:
    bool fills_ = false;
    std::vector<body> bodies_; // by part
    std::optional<streamed_holes> holes_;
};

template <class Varyings>
void draw_streamed_as(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                      const streamed_ranges& ranges, voxelize_stats& stats,
                      const std::function<void(std::size_t, sparse_volume&&)>& sink) {
    const voxelpipe::grid& whole = request.grid;
    const corner_placer classify(request, model);
    stats.backend = "cpu";
    stats.threads = thread_count(request.threads);
    stats.triangles = model.num_triangles();
    const auto room = static_cast<double>(memory::room());
    const auto start = std::chrono::steady_clock::now();

    slabs::histogram layers(whole.extent);
    surface_layers surface(classify.grid());
    vp::counters counts;
    model.for_each_block([&](const triangle_stream::block& block) {
        for (std::size_t i = 0; i < block.corners.size(); i += 3) {
            const slabs::classified c = classify(block.part, block.corners.data() + i);
            vp::core::count_class(counts, c.kind);
            if (c.kind != vp::core::triangle_class::drawn) continue;
            layers.add(c.reach);
            classify.add_to(surface, block.part, block.corners.data() + i);
        }
    });
    if (ranges.all.size() == 1) require_streamed(request, surface);
    try {
        slab_passes passes(request, needs_mean(request, model.materials()), ranges.all, ranges.drawn, room,
                           place.folder, ranges.kept);
        std::vector<bool> is_drawn(ranges.all.size()), is_wanted(ranges.all.size());
        for (const std::size_t r : ranges.drawn) is_drawn[r] = true;
        for (std::size_t r = 0; r < is_wanted.size(); ++r) is_wanted[r] = is_drawn[r] || passes.left_of(r) != 0;
        slabs::plan_options how;
        how.align = brick;
        how.layer_cost = static_cast<std::uint64_t>(decided_layer_bytes(request) / draw_bytes<Varyings>);
        const auto most = static_cast<std::uint64_t>(std::max(1.0, room / 4 / draw_bytes<Varyings>));
        auto parts = slabs_within<Varyings>(slabs::cover(layers, 2, most, how), ranges.all, is_wanted);
        place.say(std::to_string(model.num_triangles()) + " triangles do not fit into " + memory::mebibytes(room) +
                  ": they are drawn in " + std::to_string(parts.size()) + " slabs, through temporary files in " +
                  place.folder.string());

        // Nothing is drawn in the padding.
        const int padding = request.padding;
        const auto drawn_layers = [&](const slabs::layer_range& all) -> slabs::layer_range {
            return {std::max(all.begin, padding), std::max(padding, std::min(all.end, whole.extent.z - padding))};
        };
        std::vector<slabs::layer_range> drawn;
        drawn.reserve(parts.size());
        for (const auto& part : parts) drawn.push_back(drawn_layers(part.layers));
        streamed_vote vote(model, request, drawn);
        bin_triangles(model, classify, place.folder.string(), room, whole.extent.z, parts,
                      [&](const triangle_stream::block& block) { vote.add(block); });
        add_time(stats, "bin", start);
        stats.triangles_dropped = counts.triangles_dropped();
        stats.triangles_flat = counts.triangles_zero_area;

        const streamed_holes holes(model, request, room, place.folder);
        const streamed_bodies bodies(model, request, room, place.folder);

        double all = 0;
        for (const auto& part : parts) all += passes.left_of(part.range) + (is_drawn[part.range] ? 1 : 0);
        double done = 0; // of `all`
        const auto report_part = [&](voxelize_request& part) {
            if (request.progress) part.progress = [&, done](double share) { request.progress((done + share) / all); };
            ++done;
        };
        const std::uint64_t work_memory =
            request.work_memory != 0 ? request.work_memory : static_cast<std::uint64_t>(room / 8);
        // The slab without the padding.
        const auto request_of = [&](const slabs::layer_range& layers) {
            const auto [begin, end] = drawn_layers(layers);
            voxelize_request part = request;
            part.grid = whole.crop({padding, padding, begin},
                                   {whole.extent.x - 2 * padding, whole.extent.y - 2 * padding, end - begin});
            part.work_memory = work_memory;
            report_part(part);
            return part;
        };
        passes.run(
            [&](slab_pass pass, std::size_t range) {
                for (const auto& part : parts) {
                    if (part.range != range || part.triangles.size() == 0) continue;
                    if (pass == slab_pass::walls) {
                        voxelize_request walls = request;
                        walls.work_memory = work_memory;
                        report_part(walls);
                        passes.add(pass, draw_walls(scene_of(part, model), walls, part.layers));
                    } else if (drawn_layers(part.layers).size() > 0) {
                        voxelize_request slab = request_of(part.layers);
                        if (slab.solid) slab.solid->fill = solid_fill::mean; // its surface alone is drawn
                        sparse_drawer of_slab(scene_of(part, model), slab);
                        passes.add(pass, passes.draw(pass, of_slab, slab));
                    }
                }
            },
            stats);
        std::erase_if(parts, [&](const auto& part) { return !is_drawn[part.range]; });
        for (std::size_t i = 0, s = 0; i < ranges.drawn.size(); ++i) {
            const std::size_t r = ranges.drawn[i];
            const auto num_parts =
                std::count_if(parts.begin(), parts.end(), [&](const auto& p) { return p.range == r; });
            slab_joiner of_range(static_cast<std::size_t>(num_parts), place.folder);
            bool any = false; // triangle is there
            for (; s < parts.size() && parts[s].range == r; ++s) {
                const auto [begin, end] = drawn_layers(parts[s].layers);
                add_parts(parts[s].parts, holes.parts());
                add_parts(parts[s].parts, bodies.parts());
                if (passes.floods()) add_parts(parts[s].parts, {0}); // its inside needs no triangle
                std::vector<std::size_t> numbers;
                for (const part_count& c : parts[s].parts) numbers.push_back(c.part);
                scene of_slab = scene_of(parts[s], model);
                parts[s].triangles = {};
                if (begin >= end) continue;
                if (of_slab.triangle_count() == 0) { // nothing to draw; its rows are counted
                    if (request.solid)
                        (stats.solid ? *stats.solid : stats.solid.emplace()).rows +=
                            static_cast<std::uint64_t>(end - begin) *
                            static_cast<std::uint64_t>(whole.extent.y - 2 * padding);
                    continue;
                }
                voxelize_request part = request_of(parts[s].layers);
                passes.give_to(part);
                vote.give_to(part);
                const std::vector<vp::core::hole_cones> cones = holes.of_bodies(numbers);
                if (!cones.empty()) part.solid->cones = cones.data();
                const known_bodies of_part_bodies = bodies.of(numbers);
                if (bodies.fills()) part.solid->bodies = &of_part_bodies;
                voxelize_stats of_part;
                of_range.add(sparse_drawer(std::move(of_slab), part).draw(part, of_part));
                any = true;
                holes.count(of_part);
                add_part(stats, of_part);
                ++stats.slabs;
            }
            sink(i, any ? of_range.finish() : empty_bricks(request));
        }
        holes.count(stats);
        warn_of_parts(stats, request);
    } catch (const std::system_error& error) {
        throw write_error(place.folder, "temporary files for the triangles: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage("take fewer targets or voxels"));
    }
}

} // namespace

void draw_streamed(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                   const streamed_ranges& ranges, voxelize_stats& stats,
                   const std::function<void(std::size_t, sparse_volume&&)>& sink) {
    const auto draw = [&]<class Varyings>(Varyings) {
        draw_streamed_as<Varyings>(model, place, request, ranges, stats, sink);
    };
    with_varyings(model, draw);
}

sparse_volume run_streamed_voxelizer(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                                     voxelize_stats& stats) {
    sparse_volume all;
    const slabs::layer_range layers{0, request.grid.extent.z};
    const std::size_t number = 0;
    draw_streamed(model, place, request, {std::span(&layers, 1), std::span(&number, 1), nullptr}, stats,
                  [&](std::size_t, sparse_volume&& bricks) { all = std::move(bricks); });
    if (request.solid && stats.solid)
        if (std::string text = flood_warning(*request.solid, *stats.solid, stats.voxels); !text.empty())
            stats.warnings.push_back(std::move(text));
    return all;
}

} // namespace voxelize
