// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tool's pipeline, a template over the backend: instantiated for cpu_backend in voxelizer.cpp and for cuda_backend
// in cuda_*.cu (cuda_pipeline.cuh), which also include pipeline_solid.hpp and pipeline_surface.hpp. Takes a scene,
// uploads it, draws every slab of the grid into a framebuffer of all wanted targets and resolves it into the volume. A
// solid is drawn after its surface, and the voxels inside are filled on the host.

#include "backend_memory.hpp"
#include "body_fill.hpp"
#include "model/parallel.hpp"
#include "model/placement.hpp"
#include "model/resolve.hpp"
#include "outside.hpp"
#include "show_stages.hpp"
#include "solid_options.hpp"
#include "surface.hpp"
#include "uploaded_scene.hpp"
#include "voxelizer.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <bitset>
#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

template <class Backend>
class pipeline {
public:
    // A backend in host memory takes the scene's arrays over one by one, so that they are not held twice. Another one
    // leaves the scene as it is.
    pipeline(Backend& backend, scene& model, const voxelize_request& request, voxelize_stats& stats)
        : backend_{backend}, request_{request}, stats_{stats} {
        for (const target wanted : request.targets) wanted_[static_cast<std::size_t>(wanted)] = true;
        // A flood is compared with the surface, to tell whether anything is enclosed.
        draws_surface_ = request.solid ? request.solid->rule == solid_rule::exterior : request.targets.empty();
        for (const target wanted : request.targets)
            draws_surface_ = draws_surface_ || (request.solid ? wanted != target::occupancy &&
                                                                    wanted != target::count && !is_of_cells(wanted)
                                                              : !is_of_cells(wanted));
        // The bits of all voxels decide what the sides of the grid see and what lies inside.
        keeps_bits_ = request.solid ? draws_surface_ : wants(target::occupancy) || wants(target::color_outer);
        if (request.solid) bits_name_ = "surface";
        const std::uint64_t num_lines = model.line_count();
        draws_lines_ = num_lines != 0 && !request.solid && draws_surface_;
        if (num_lines != 0 && request.solid)
            stats.warnings.push_back(std::to_string(num_lines) +
                                     " line(s) and point(s) enclose nothing: --solid leaves them out");
        else if (num_lines != 0 && request.wants_cells())
            stats.warnings.push_back(std::to_string(num_lines) + " line(s) and point(s) enclose nothing: --target " +
                                     name_of_cells(request) + " leaves them out");
        keeps_bits_ = keeps_bits_ || draws_lines_; // of which the voxels are counted
        stats_.triangles = model.triangle_count();
        stats_.lines = draws_lines_ ? num_lines : 0;
        if (wants(target::triangle) && stats_.triangles + num_lines > INT32_MAX)
            throw std::runtime_error("more triangles and lines than --target triangle can number");
        const stage_timer timer{*this, "upload"};
        if (fills_bodies(request))
            bodies_ = std::make_unique<model_bodies>(model, request); // before the scene is taken
        uploaded_ = std::make_unique<uploaded_scene<Backend>>(backend, model, request, wanted_, draws_lines_);
        if (bodies_) {
            if constexpr (memory_access<Backend>::on_host)
                bodies_->take_draws(uploaded_->bits_draws());
            else
                bodies_->make_draws(model);
        }
        only_bits_ = !uploaded_->has_masks() && !draws_lines_ && !wants(target::color) && !wants(target::color_max) &&
                     !wants(target::color_replace) && !wants(target::normal) && !wants(target::material) &&
                     !wants(target::triangle) && !wants(target::depth);
    }

    [[nodiscard]] volume run() {
        volume result = unset_volume();
        draw_layers(result, 0, request_.grid.extent.z);
        return finish(std::move(result));
    }
    // The parts of run(), for pipelines on several devices that share a volume: one makes it, each draws the surface of
    // some layers, and one finishes it.
    [[nodiscard]] volume unset_volume() const {
        volume result = volume_of(request_.grid);
        for (const target wanted : request_.targets) {
            const target_info& info = info_of(wanted);
            volume* holder = &result;
            if (const int axis = axis_of_faces(wanted); axis >= 0) {
                holder = &result.faces.emplace_back(volume_of(request_.grid));
                center_on_faces(*holder, request_.grid, axis);
                ++holder->extent[static_cast<std::size_t>(axis)];
            }
            holder->add_unset(std::string(info.name), info.type, info.components);
        }
        // Channels that nobody asked for come last.
        if (keeps_bits_ && result.find(bits_name_) == nullptr) result.add_unset(bits_name_, scalar::bit);
        return result;
    }
    // Layers [first, last).
    void draw_layers(volume& result, int first, int last) {
        if (!draws_surface_) return;
        stats_.slabs = for_each_slab(first, last, slab_depth(surface_voxel_bytes()),
                                     [&](const voxelpipe::grid& part, int begin, int slab, int slabs) {
                                         report_from(0, slab, slabs);
                                         if (only_bits_)
                                             draw_bits(result, part, begin);
                                         else
                                             draw_surface(result, part, begin);
                                     });
    }
    [[nodiscard]] volume finish(volume result) {
        const int layers = request_.grid.extent.z;
        if (draws_lines_) // a voxel may have been drawn twice
            stats_.voxels = static_cast<std::uint64_t>(result.popcount(*result.find(bits_name_)));
        if (wants(target::normal)) count_cancelled_normals(result);
        if (wants(target::color_outer)) {
            const voxelize_stats counted = stats_; // the same fragments again
            const std::vector<buffer<column_ends>> ends = put_columns(result);
            for_each_slab(0, layers, slab_depth(sizeof(std::uint64_t)),
                          [&](const voxelpipe::grid& part, int begin, int slab, int slabs) {
                              report_from(1, slab, slabs);
                              draw_outer(result, part, begin);
                          });
            restore_counts(counted);
        }
        if (request_.solid) {
            if (!wants(target::occupancy)) result.add_unset(inside_name_, scalar::bit);
            const double voxel_bytes = 0.125 + (counts_bodies() ? sizeof(std::uint32_t) : 0);
            const int slabs = for_each_slab(0, layers, slab_depth(voxel_bytes),
                                            [&](const voxelpipe::grid& part, int begin, int slab, int all) {
                                                report_from(num_passes() - (request_.wants_cells() ? 2 : 1), slab, all);
                                                draw_solid(result, part, begin);
                                            });
            if (!draws_surface_) stats_.slabs = slabs;
            finish_solid(result);
        }
        if constexpr (memory_access<Backend>::on_host)
            if (request_.wants_cells()) draw_cells(result);
        result.channels.resize(request_.targets.size() - result.faces.size());
        return result;
    }

protected: // sparse_pipeline draws the same into bricks
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // In the order of surface_fragment_shader's outputs.
    enum : std::size_t { occupancy, count, color_sum, color_max, color_last, normal_sum, triangle, depth, num_targets };
    using surface_framebuffer =
        vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::bit_or>, vp::target<std::uint32_t, vp::blend::count>,
                        vp::target<glm::vec4, vp::blend::add>, vp::target<glm::u8vec4, vp::blend::max>,
                        vp::target<glm::u8vec4, vp::blend::replace>, vp::target<glm::vec3, vp::blend::add>,
                        vp::target<std::uint32_t, vp::blend::replace>, vp::target<float, vp::blend::min>>;
    using outer_draw = vp::draw<vp::mesh_view<>, surface_vertex_shader, outer_fragment_shader>;
    using outer_line_draw =
        vp::draw<vp::lines_view<>, surface_vertex_shader, line_fragment_shader<outer_fragment_shader>>;
    using outer_framebuffer = vp::framebuffer<Backend, vp::target<std::uint64_t, vp::blend::max>>;
    using bits_target = vp::target<vp::bit, vp::blend::bit_or>;
    using bits_map = typename bits_target::map;
    using bits_framebuffer = vp::framebuffer<Backend, bits_target, vp::target<std::uint32_t, vp::blend::count>>;

    // Adds the time until its end to a stage of the statistics.
    class stage_timer {
    public:
        stage_timer(pipeline& owner, const char* stage) : owner_{owner}, stage_{stage} {}
        ~stage_timer() {
            const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start_;
            owner_.add_time(stage_, time.count());
        }
        stage_timer(const stage_timer&) = delete;
        stage_timer& operator=(const stage_timer&) = delete;

    private:
        pipeline& owner_;
        const char* stage_;
        std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    };

    void add_time(const char* stage, double milliseconds) {
        for (auto& [name, sum] : stats_.milliseconds) {
            if (name == stage) {
                sum += milliseconds;
                return;
            }
        }
        stats_.milliseconds.emplace_back(stage, milliseconds);
    }

    [[nodiscard]] bool wants(target id) const { return wanted_[static_cast<std::size_t>(id)]; }

    // ---- slabs -----------------------------------------------------------------------------------------------------

    [[nodiscard]] std::bitset<num_targets> enabled_targets() const {
        std::bitset<num_targets> enabled;
        enabled[occupancy] = keeps_bits_;
        enabled[count] = counts_fragments() || wants(target::color);
        enabled[color_sum] = wants(target::color);
        enabled[color_max] = wants(target::color_max);
        enabled[color_last] = wants(target::color_replace);
        enabled[normal_sum] = wants(target::normal);
        enabled[triangle] = wants(target::triangle) || wants(target::material);
        enabled[depth] = wants(target::depth);
        if (enabled.none()) enabled[occupancy] = true;
        return enabled;
    }

    [[nodiscard]] double surface_voxel_bytes() const {
        constexpr double bytes[num_targets] = {0.125, 4, 16, 4, 4, 12, 4, 4};
        const std::bitset<num_targets> enabled = enabled_targets();
        double voxel_bytes = 0;
        for (std::size_t i = 0; i < num_targets; ++i) voxel_bytes += enabled[i] ? bytes[i] : 0;
        return voxel_bytes;
    }

    // Layers that go into the working memory at once; whole tiles where more than one tile's height fits.
    [[nodiscard]] int slab_depth(double voxel_bytes) const {
        const glm::ivec3 extent = request_.grid.extent;
        const double layer_bytes = voxel_bytes * extent.x * extent.y;
        const double layers =
            std::clamp(static_cast<double>(request_.work_memory) / layer_bytes, 1.0, static_cast<double>(extent.z));
        constexpr int tile = 32;
        const int depth = static_cast<int>(layers);
        return depth < extent.z && depth > tile ? depth / tile * tile : depth;
    }

    // For layers [first, last) of the grid: VISIT(part of the grid, its first layer, number of the slab, how many there
    // are); returns how many.
    template <class Visit>
    int for_each_slab(int first, int last, int depth, const Visit& visit) {
        const glm::ivec3 extent = request_.grid.extent;
        const int slabs = (last - first + depth - 1) / depth;
        for (int slab = 0; slab < slabs; ++slab) {
            const int begin = first + slab * depth;
            const glm::ivec3 size{extent.x, extent.y, std::min(depth, last - begin)};
            visit(uploaded_->relative_grid().crop({0, 0, begin}, size), begin, slab, slabs);
        }
        return slabs;
    }

    // Surface, outer colours, solid, cut cells.
    [[nodiscard]] int num_passes() const {
        return (draws_surface_ ? 1 : 0) + (wants(target::color_outer) ? 1 : 0) + (request_.solid ? 1 : 0) +
               (request_.wants_cells() ? 1 : 0);
    }
    // The bar shows one slab of a pass from here on.
    void report_from(int pass, int slab, int slabs) {
        report_ = [this, pass, slab, slabs](double done) {
            if (request_.progress) request_.progress((pass + (slab + done) / slabs) / num_passes());
        };
    }

    // As numbers of triangles; of solids it is the number of bodies.
    [[nodiscard]] bool counts_fragments() const { return wants(target::count) && !request_.solid; }

    static void check(const vp::status& status, const voxelize_request& request) {
        if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
        if (status.code == vp::status_code::strategy_unavailable)
            throw backend_error(std::string("--strategy ") + to_string(request.strategy) +
                                " cannot draw these targets; automatic and tiled can");
        status.or_throw();
    }

    // False if the framebuffer's limits are too small; nothing is drawn then.
    template <class Draw, class Framebuffer>
    bool draw(const std::vector<Draw>& draws, const voxelpipe::grid& part, Framebuffer& framebuffer,
              std::uint64_t& dropped) {
        const vp::status status = vp::voxelize(backend_, std::span<const Draw>(draws), part, framebuffer,
                                               vp::voxelize_options{request_.coverage});
        if (status.code == vp::status_code::capacity_exceeded) return false;
        check(status, request_);
        dropped = status.counts.triangles_dropped();
        add_counts(status);
        return true;
    }
    // Lines into the `enabled` targets of a framebuffer that triangles have been drawn into; it loads them from then
    // on. False as draw().
    template <class Draw, class Framebuffer, std::size_t N>
    bool draw_lines(const std::vector<Draw>& draws, const voxelpipe::grid& part, Framebuffer& framebuffer,
                    std::bitset<N> enabled) {
        if (draws.empty()) return true;
        const stage_timer timer{*this, "voxelize"};
        vp::core::for_each_index<N>([&]<std::size_t I>() {
            if (enabled[I]) vp::get<I>(framebuffer).load();
        });
        return draw(draws, part, framebuffer, stats_.lines_dropped);
    }

    void add_counts(const vp::status& status) {
        stats_.triangles_drawn += status.counts.triangles_drawn;
        stats_.triangles_flat += status.counts.triangles_zero_area;
        stats_.fragments += status.counts.fragments;
        stats_.fragments_discarded += status.counts.fragments_discarded;
        stats_.voxels += status.counts.voxels;
    }

    // The framebuffer of the slab before serves again where it has the size: its memory is there already.
    template <class Framebuffer, std::size_t N>
    Framebuffer& framebuffer_for(std::unique_ptr<Framebuffer>& kept, glm::ivec3 extent, std::bitset<N> enabled) {
        if (kept == nullptr || kept->extent() != extent) {
            kept.reset();
            kept = std::make_unique<Framebuffer>(backend_, extent, enabled);
        }
        return *kept;
    }

    void draw_bits(volume& result, const voxelpipe::grid& part, int begin);

    void draw_surface(volume& result, const voxelpipe::grid& part, int begin);

    // ---- color-outer: the whole of the grid is known
    // -----------------------------------------------------------------

    void make_outer_draws();
    // Ends of the columns, for the draws.
    void set_columns(const column_view& columns);
    // Makes the draws, with the ends of the result's columns. The draws read what is returned.
    [[nodiscard]] std::vector<buffer<column_ends>> put_columns(const volume& result);

    void draw_outer(volume& result, const voxelpipe::grid& part, int begin);

    // Takes the counts back to what they were; the times go on.
    void restore_counts(const voxelize_stats& counted) {
        std::vector<std::pair<std::string, double>> times = std::move(stats_.milliseconds);
        stats_ = counted;
        stats_.milliseconds = std::move(times);
    }

    // ---- solids ----------------------------------------------------------------------------------------------------

    // Otherwise the count is 1 inside.
    [[nodiscard]] bool counts_bodies() const {
        return wants(target::count) && request_.solid->rule == solid_rule::each_draw;
    }

    // The channel of a solid's bits: the occupancy, or one that stands for it.
    [[nodiscard]] std::string_view inside_name() const {
        return wants(target::occupancy) ? info_of(target::occupancy).name : std::string_view(inside_name_);
    }

    void add_solid_counts(const vp::status& status, const voxelpipe::grid& part);

    // The outside follows from the whole grid: a flood is drawn there, with the padding.
    void draw_solid(volume& result, const voxelpipe::grid& slab, int begin);

    // The volume's other values, once all bits are there.
    void finish_solid(volume& result);
    // Gives the voxels of SOLID that are not of SURFACE the colour and the material of the nearest triangle.
    void fill_nearest(volume& result, const channel& solid, const channel& surface);
    // What the flood of --solid exterior did; and which repairs help an open model, each of which is tried. Does
    // nothing for a part of the model, and where the bits do not fit into the run's memory. Throws grid_error for
    // a flood where the grid lies within the model: what is outside follows from the whole.
    void examine_solid();
    void examine_solid_bits(const voxelpipe::grid& whole); // in the whole grid
    // `voxels`: of the solid; `surface`: those of them that a triangle touches.
    void warn_of_solid(std::uint64_t voxels, std::uint64_t surface);

    // Draws the channel of fractions into the volume itself, in one call: its sums run over whole rows, and each
    // triangle's parts are found once.
    void draw_cells(volume& result);
    // Counts of cut cells, and what is to be said of them; COUNTS has the rows, and how many are open.
    void note_cells(const vp::status& status, fraction_counts counts);

    // Counts the covered voxels whose resolved normal is 0.
    void count_cancelled_normals(const volume& result);

    void report_cancelled_normals(std::uint64_t count) {
        stats_.normals_cancelled = count;
        if (std::string warning = cancelled_warning(stats_); !warning.empty())
            stats_.warnings.push_back(std::move(warning));
    }

    // Elements of a target, in the backend's memory.
    template <std::size_t I, class Framebuffer>
    [[nodiscard]] static auto* elements_of(Framebuffer& framebuffer) {
        return std::as_const(vp::get<I>(framebuffer).view().elements);
    }

    // The backend counts work of its own; the bar runs from 0 to 1 for each slab. Returns what draw() does.
    template <class Draw, class Framebuffer>
    bool draw_reporting(const std::vector<Draw>& draws, const voxelpipe::grid& part, Framebuffer& framebuffer) {
        const stage_timer timer{*this, "voxelize"};
        if constexpr (requires { backend_.progress; }) {
            backend_.progress = [this](std::uint64_t done, std::uint64_t total) {
                report_(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
        }
        const bool is_drawn = draw(draws, part, framebuffer, stats_.triangles_dropped);
        report_(1.0);
        return is_drawn;
    }

    // ---- resolve: slab -> volume -----------------------------------------------------------------------------------

    // The address of voxel (0, 0, begin) of a channel.
    template <class T>
    [[nodiscard]] static T* channel_at(volume& result, std::string_view name, int begin) {
        channel* c = result.find(name);
        const std::size_t layer = result.num_bytes(c->type, c->components) / static_cast<std::size_t>(result.extent[2]);
        return reinterpret_cast<T*>(c->data.data() + layer * static_cast<std::size_t>(begin));
    }

    // A target as it is.
    template <std::size_t I, class Framebuffer>
    void copy(volume& result, target id, Framebuffer& framebuffer, int begin) {
        copy<I>(result, info_of(id).name, framebuffer, begin);
    }
    template <std::size_t I, class Framebuffer>
    void copy(volume& result, std::string_view name, Framebuffer& framebuffer, int begin) {
        const auto* const elements = elements_of<I>(framebuffer);
        using element = std::remove_cvref_t<decltype(*elements)>;
        using map = typename std::remove_cvref_t<decltype(vp::get<I>(framebuffer))>::target_type::map;
        memory_access<Backend>::read(backend_, channel_at<element>(result, name, begin),
                                     map::elements(framebuffer.extent()), as_it_is<element>{elements},
                                     thread_count(request_.threads));
    }

    // A channel that is worked out from targets: VALUE(i) for every voxel of the slab.
    template <class T, class Value>
    void resolve(volume& result, target id, glm::ivec3 extent, int begin, const Value& value) {
        const std::size_t voxels = static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) *
                                   static_cast<std::size_t>(extent.z);
        memory_access<Backend>::read(backend_, channel_at<T>(result, info_of(id).name, begin), voxels, value,
                                     thread_count(request_.threads));
    }

    Backend& backend_;
    const voxelize_request& request_;
    voxelize_stats& stats_;
    wanted_targets wanted_;
    bool only_bits_ = false;
    bool draws_surface_ = false; // else a solid's bits are all there is
    bool draws_lines_ = false;   // after the triangles
    bool keeps_bits_ = false;    // of the surface, in the channel bits_name_
    std::string bits_name_ = "occupancy";
    const std::string inside_name_ = "inside"; // the channel of a solid's bits where no occupancy is asked for
    std::function<void(double)> report_;
    std::unique_ptr<uploaded_scene<Backend>> uploaded_;
    std::unique_ptr<model_bodies> bodies_; // with --fill body, where it shows
    std::unique_ptr<surface_framebuffer> surface_framebuffer_;
    std::unique_ptr<bits_framebuffer> bits_framebuffer_;
    std::unique_ptr<bits_framebuffer> solid_framebuffer_;
    std::vector<outer_draw> outer_draws_;
    std::vector<outer_line_draw> outer_line_draws_;
    std::unique_ptr<outer_framebuffer> outer_framebuffer_;
};

} // namespace voxelize
