// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_model.hpp"

#include "../formats/output_file.hpp"
#include "../memory.hpp"
#include "../parallel.hpp"
#include "../placement.hpp"
#include "../surface.hpp"
#include "sparse_voxelizer.hpp"
#include "streamed_holes.hpp"

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>

#include <algorithm>
#include <chrono>
#include <limits>
#include <new>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

namespace slabs = voxelpipe::slabs;
// What a vertex may have.
struct vertex_color {
    glm::vec4 color;
};
struct vertex_texcoord {
    glm::vec2 texcoord;
};
struct vertex_texcoord_color {
    glm::vec2 texcoord;
    glm::vec4 color;
};
template <class Varyings>
constexpr bool has_color = requires(Varyings v) {
    v.color;
};
template <class Varyings>
constexpr bool has_texcoord = requires(Varyings v) {
    v.texcoord;
};

// Positions as the file has them, with what else the vertices have.
template <class Varyings>
using corner_record = slabs::record<Varyings>;

// For each triangle of a slab, at least: record, scene, snapped vertices, pairs with tiles.
template <class Varyings>
constexpr double draw_bytes = std::is_empty_v<Varyings> ? 220 : 220 + 6 * sizeof(Varyings);
constexpr int brick = 8;

template <class Varyings>
corner_record<Varyings> record_of(const triangle_stream::block& from, std::size_t triangle) {
    const std::size_t i = 3 * triangle;
    const auto number = static_cast<std::uint32_t>(from.first_number + triangle);
    corner_record<Varyings> made{};
    made.number = number;
    for (std::size_t k = 0; k < 3; ++k) {
        made.positions[k] = from.corners[i + k];
        if constexpr (has_color<Varyings>)
            made.varyings[k].color = from.colors.empty() ? glm::vec4(1) : from.colors[i + k];
        if constexpr (has_texcoord<Varyings>)
            made.varyings[k].texcoord = from.texcoords.empty() ? glm::vec2(0) : from.texcoords[i + k];
    }
    return made;
}

// The corners as the pipeline places them, in the request's grid.
class corner_placer {
public:
    corner_placer(const voxelize_request& request, const triangle_stream& model)
        : rule_(request.solid ? voxelpipe::coverage::conservative : request.coverage),
          is_solid_(request.solid.has_value()) {
        for (const triangle_stream::part& p : model.parts())
            places_.emplace_back(p.to_world, reference_point(request.grid));
        grid_ = request.grid;
        grid_.origin -= reference_point(request.grid);
        snap_ = vp::core::make_snap_transform(grid_);
    }
    [[nodiscard]] slabs::classified operator()(std::size_t part, const glm::vec3* corners) const {
        const placed_vertex_shader& place = places_[part];
        return slabs::classify(snap_, grid_.extent, rule_, place(corners[0]), place(corners[1]), place(corners[2]),
                               is_solid_);
    }

private:
    std::vector<placed_vertex_shader> places_; // by part
    voxelpipe::coverage rule_;
    bool is_solid_; // triangles beside the grid along x count too
    voxelpipe::grid grid_;
    vp::core::snap_transform snap_{};
};

// How many triangles of a part are in a slab.
struct part_count {
    std::size_t part;
    std::size_t triangles;
};

// A slab that is drawn at once: layers of one range.
template <class Varyings>
struct streamed_slab {
    slabs::layer_range layers;
    std::size_t range = 0;
    slabs::bin<corner_record<Varyings>> triangles;
    std::vector<part_count> parts; // of its triangles, in their order
};

// A slab's triangles as a scene of the parts that are there. A primitive's triangles have the numbers of the whole
// model: `whole` counts those of parts that are left out before it, too. Consumes the triangles.
template <class Varyings>
scene scene_of(streamed_slab<Varyings>&& slab, const triangle_stream& model) {
    scene made;
    made.materials = model.materials();
    made.textures = model.textures();
    made.images = model.images();
    std::uint64_t before = 0; // triangles of the model before the primitive's `whole`
    for (const part_count& count : slab.parts) {
        const triangle_stream::part& source = model.parts()[count.part];
        const std::uint64_t end = source.first_number + source.num_triangles;
        made.instances.push_back({static_cast<std::uint32_t>(made.primitives.size()), source.to_world});
        primitive& part = made.primitives.emplace_back();
        part.material = source.material;
        part.whole = end - std::exchange(before, end);
        part.positions.reserve(3 * count.triangles);
        part.triangles.reserve(count.triangles);
        part.numbers.reserve(count.triangles);
        if constexpr (has_color<Varyings>) part.colors.reserve(3 * count.triangles);
        if constexpr (has_texcoord<Varyings>)
            if (source.has_texcoords) part.texcoords.reserve(3 * count.triangles);
    }
    std::size_t at = 0; // the primitive
    slab.triangles.for_each_block([&](std::span<const corner_record<Varyings>> block) {
        for (const corner_record<Varyings>& r : block) {
            while (made.primitives[at].triangles.size() == slab.parts[at].triangles) ++at;
            primitive& part = made.primitives[at];
            const triangle_stream::part& source = model.parts()[slab.parts[at].part];
            const auto first = static_cast<std::uint32_t>(part.positions.size());
            part.positions.insert(part.positions.end(), r.positions, r.positions + 3);
            part.triangles.emplace_back(first, first + 1, first + 2);
            const std::uint64_t skipped = source.first_number + source.num_triangles - part.whole;
            part.numbers.push_back(static_cast<std::uint32_t>(r.number - skipped));
            if constexpr (has_color<Varyings>)
                for (const Varyings& v : r.varyings) part.colors.push_back(v.color);
            if constexpr (has_texcoord<Varyings>)
                if (source.has_texcoords)
                    for (const Varyings& v : r.varyings) part.texcoords.push_back(v.texcoord);
        }
    });
    slab.triangles = {};
    // Lids need a triangle in their body's draw.
    constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
    for (primitive& part : made.primitives)
        if (part.triangles.empty()) {
            part.positions.emplace_back(nowhere, nowhere, nowhere);
            part.triangles.emplace_back(0U, 0U, 0U);
            part.numbers.push_back(0);
        }
    return made;
}

// Adds parts without triangles to a slab's.
void add_parts(std::vector<part_count>& to, const std::vector<std::size_t>& parts) {
    for (const std::size_t part : parts) {
        const auto at =
            std::lower_bound(to.begin(), to.end(), part, [](const part_count& c, std::size_t p) { return c.part < p; });
        if (at == to.end() || at->part != part) to.insert(at, {part, 0});
    }
}

} // namespace

opened_stream streamed_input(const command_line& options, const std::filesystem::path& folder) {
    const voxelize_request& request = options.voxelize;
    // The other two need the whole grid.
    const bool is_by_rule = !request.solid || (request.solid->rule != solid_rule::exterior && !request.solid->vote);
    const bool is_drawn_here = request.backend != backend_choice::cuda &&
                               request.strategy == voxelpipe::strategy::automatic && is_by_rule &&
                               options.storage != storage_choice::dense;
    const auto wants = [&](const auto& is_wanted) {
        return std::any_of(request.targets.begin(), request.targets.end(), is_wanted);
    };
    // Both see the whole grid at once.
    const bool sees_whole_grid = wants([](target t) { return t == target::color_outer; }) ||
                                 (request.solid && !request.solid->fill_color &&
                                  wants([](target t) { return info_of(t).name.starts_with("color"); }));
    if (!is_drawn_here || sees_whole_grid) return {};
    opened_stream opened = open_stream(options.input, memory::room() / 8, folder, options.load);
    if (opened.stream && opened.stream->held_bytes() <= static_cast<double>(memory::room())) return {};
    return opened;
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

// The slabs of a plan, cut at the borders of the ranges.
template <class Varyings>
std::vector<streamed_slab<Varyings>> slabs_within(const slabs::plan& plan, std::span<const slabs::layer_range> ranges) {
    std::vector<streamed_slab<Varyings>> parts;
    for (std::size_t r = 0; r < ranges.size(); ++r)
        for (const slabs::layer_range& s : plan.slabs)
            if (const int begin = std::max(s.begin, ranges[r].begin), end = std::min(s.end, ranges[r].end);
                begin < end) {
                auto& part = parts.emplace_back();
                part.layers = {begin, end};
                part.range = r;
            }
    return parts;
}

// The triangles of each slab.
template <class Varyings>
void bin_triangles(triangle_stream& model, const corner_placer& classify, const stream_place& place, double room,
                   int layers, std::vector<streamed_slab<Varyings>>& parts) {
    // The first slab that ends behind a layer.
    std::vector<std::size_t> first_slab(static_cast<std::size_t>(layers) + 1, parts.size());
    for (std::size_t s = parts.size(); s-- > 0;) std::fill_n(first_slab.begin(), parts[s].layers.end, s);
    std::vector<slabs::bin<corner_record<Varyings>>> bins(parts.size());
    {
        slabs::bin_memory<corner_record<Varyings>> spilled(static_cast<std::uint64_t>(room / 8), bins.size(),
                                                           place.folder.string());
        model.for_each_block([&](const triangle_stream::block& block) {
            for (std::size_t i = 0; 3 * i < block.corners.size(); ++i) {
                const slabs::classified c = classify(block.part, block.corners.data() + 3 * i);
                if (c.kind != vp::core::triangle_class::drawn) continue;
                const corner_record<Varyings> r = record_of<Varyings>(block, i);
                for (std::size_t s = first_slab[static_cast<std::size_t>(c.reach.lo[2])];
                     s < parts.size() && parts[s].layers.begin <= c.reach.hi[2]; ++s) {
                    spilled.push(bins, s, r);
                    std::vector<part_count>& counts = parts[s].parts;
                    if (counts.empty() || counts.back().part != block.part) counts.push_back({block.part, 0});
                    ++counts.back().triangles;
                }
            }
        });
    }
    for (std::size_t s = 0; s < parts.size(); ++s) parts[s].triangles = std::move(bins[s]);
}

template <class Varyings>
void draw_streamed_as(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                      std::span<const slabs::layer_range> ranges, voxelize_stats& stats,
                      const std::function<void(std::size_t, sparse_volume&&)>& sink) {
    const voxelpipe::grid& whole = request.grid;
    const corner_placer classify(request, model);
    stats.backend = "cpu";
    stats.threads = thread_count(request.threads);
    stats.triangles = model.num_triangles();
    const auto room = static_cast<double>(memory::room());
    const auto start = std::chrono::steady_clock::now();

    slabs::histogram layers(whole.extent);
    vp::counters counts;
    model.for_each_block([&](const triangle_stream::block& block) {
        for (std::size_t i = 0; i < block.corners.size(); i += 3) {
            const slabs::classified c = classify(block.part, block.corners.data() + i);
            vp::core::count_class(counts, c.kind);
            if (c.kind == vp::core::triangle_class::drawn) layers.add(c.reach);
        }
    });
    slabs::plan_options how;
    how.align = brick;
    const auto most = static_cast<std::uint64_t>(std::max(1.0, room / 4 / draw_bytes<Varyings>));
    auto parts = slabs_within<Varyings>(slabs::cover(layers, 2, most, how), ranges);
    place.say(std::to_string(model.num_triangles()) + " triangles do not fit into " + memory::mebibytes(room) +
              ": they are drawn in " + std::to_string(parts.size()) + " slabs, through temporary files in " +
              place.folder.string());

    try {
        bin_triangles(model, classify, place, room, whole.extent.z, parts);
        const std::chrono::duration<double, std::milli> binning = std::chrono::steady_clock::now() - start;
        stats.milliseconds.emplace_back("bin", binning.count());
        stats.triangles_dropped = counts.triangles_dropped();
        stats.triangles_flat = counts.triangles_zero_area;

        const streamed_holes holes(model, request, room, place.folder);

        // Nothing is drawn in the padding.
        const int padding = request.padding;
        for (std::size_t r = 0, s = 0; r < ranges.size(); ++r) {
            std::vector<sparse_volume> of_range;
            for (; s < parts.size() && parts[s].range == r; ++s) {
                const int begin = std::max(parts[s].layers.begin, padding),
                          end = std::min(parts[s].layers.end, whole.extent.z - padding);
                add_parts(parts[s].parts, holes.parts());
                std::vector<std::size_t> numbers;
                for (const part_count& c : parts[s].parts) numbers.push_back(c.part);
                scene of_slab = scene_of(std::move(parts[s]), model);
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
                const std::vector<vp::core::hole_cones> cones = holes.of_bodies(numbers);
                if (!cones.empty()) part.solid->cones = cones.data();
                voxelize_stats of_part;
                of_range.push_back(draw_sparse(of_slab, part, whole, of_part));
                holes.count(of_part);
                add_part(stats, of_part);
                ++stats.slabs;
            }
            if (of_range.empty()) { // the whole grid without a triangle
                scene nothing;
                voxelize_stats none;
                voxelize_request inside = request;
                inside.grid = whole.crop(glm::ivec3(padding), whole.extent - 2 * padding);
                of_range.push_back(draw_sparse(nothing, inside, whole, none));
            }
            sink(r, of_range.size() == 1 ? std::move(of_range[0]) : join_slabs(std::move(of_range)));
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
                   std::span<const slabs::layer_range> ranges, voxelize_stats& stats,
                   const std::function<void(std::size_t, sparse_volume&&)>& sink) {
    const auto draw = [&]<class Varyings>(Varyings) {
        draw_streamed_as<Varyings>(model, place, request, ranges, stats, sink);
    };
    if (model.has_colors() && model.has_texcoords())
        draw(vertex_texcoord_color{});
    else if (model.has_colors())
        draw(vertex_color{});
    else if (model.has_texcoords())
        draw(vertex_texcoord{});
    else
        draw(vp::no_varyings{});
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
