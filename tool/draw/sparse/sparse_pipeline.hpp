// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The tool's pipeline into a sparse framebuffer: the draws, targets and values of pipeline.hpp, resolved voxel by voxel
// that exists, for a backend in host memory. Slab by slab, so that the sums of colours are held for one slab at a time.
// A solid is drawn after its surface, the whole grid in one call. The request may be changed between calls to another
// crop of its grid, with what that needs.

#include "brick_count.hpp"
#include "brick_need.hpp"
#include "draw/pipeline_solid.hpp"
#include "draw/pipeline_surface.hpp"
#include "model/memory.hpp"
#include "model/sparse_volume.hpp"
#include "sparse_outside.hpp"
#include "sparse_solid.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

template <class Backend>
class sparse_pipeline : pipeline<Backend> {
    using base = pipeline<Backend>;
    static_assert(memory_access<Backend>::on_host);

public:
    using base::base;

    // `padding` layers of `whole`, which the request's grid is a part of, hold nothing.
    [[nodiscard]] sparse_volume run(const voxelpipe::grid& whole) {
        if (this->request_.wants_cells()) return draw_cells(whole);
        require_part();
        sparse_volume result = surface_in(whole, this->num_passes());
        if (!this->request_.solid) return result;
        report_from(this->num_passes() - 1, this->num_passes(), 0, 1);
        return draw_solid(std::move(result));
    }
    // Without the solid.
    [[nodiscard]] sparse_volume surface(const voxelpipe::grid& whole) {
        return surface_in(whole, this->num_passes() - (this->request_.solid ? 1 : 0));
    }
    // The voxels that the surface occupies, without channels.
    [[nodiscard]] sparse_volume occupied(const voxelpipe::grid& whole) {
        if (!this->uploaded_->has_masks() && !this->draws_lines_) return walls(whole);
        return bricks_of(whole,
                         [this](const voxelpipe::grid& slab, const vp::sparse_limits& most, sparse_volume& part) {
                             std::bitset<base::num_targets> enabled;
                             enabled[base::occupancy] = true;
                             surface_bricks framebuffer(this->backend_, slab.extent, enabled);
                             if (!draw_surface_in(slab, framebuffer, enabled, most)) return false;
                             take_bricks(part, framebuffer);
                             return true;
                         });
    }
    // The voxels that triangles touch, whatever masks cut off.
    [[nodiscard]] sparse_volume walls(const voxelpipe::grid& whole) {
        return bricks_of(whole,
                         [this](const voxelpipe::grid& slab, const vp::sparse_limits& most, sparse_volume& part) {
                             std::bitset<2> enabled;
                             enabled[0] = true;
                             bits framebuffer(this->backend_, slab.extent, enabled);
                             if (!draw_part(this->uploaded_->bits_draws(), slab, framebuffer, most)) return false;
                             take_bricks(part, framebuffer);
                             return true;
                         });
    }

private:
    template <class Framebuffer>
    struct twin;
    template <class... Targets>
    struct twin<vp::framebuffer<Backend, Targets...>> {
        using type = vp::sparse_framebuffer<Backend, Targets...>;
    };
    using surface_bricks = typename twin<typename base::surface_framebuffer>::type;
    using outer_bricks = typename twin<typename base::outer_framebuffer>::type;
    using bits = typename twin<typename base::bits_framebuffer>::type;

    // The bar shows a pass from `begin` to `end` of its work from here on.
    void report_from(int pass, int passes, double begin, double end) {
        this->report_ = [=, this](double done) {
            if (this->request_.progress) this->request_.progress((pass + begin + done * (end - begin)) / passes);
        };
    }
    // The surface, which is drawn by the first of `passes` passes.
    [[nodiscard]] sparse_volume surface_in(const voxelpipe::grid& whole, int passes) {
        sparse_volume result;
        result.shape = volume_of(whole);
        this->stats_.slabs = 1;
        if (this->draws_surface_) draw_slabs(result, passes);
        if (this->wants(target::color_outer)) draw_outer(result, passes);
        return result;
    }

    // ---- cut cells -------------------------------------------------------------------------------------------------

    struct fraction_anywhere {
        static constexpr bool ignores_voxel = true; // what is untouched becomes tiles
        vp::output<float, float, glm::vec3> operator()(const vp::cell_fragment& f) const {
            return vp::outputs(f.fraction, 0.0F, glm::vec3(0));
        }
    };
    struct measures_anywhere {
        static constexpr bool ignores_voxel = true;
        using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area>;
        vp::output<float, float, glm::vec3> operator()(const fragment& f) const {
            return vp::outputs(f.fraction, static_cast<float>(f.area), f.centroid);
        }
    };

    // ---- slabs of the surface --------------------------------------------------------------------------------------

    // Bytes of a voxel while its bit alone is drawn.
    static constexpr double bit_bytes = 0.375;
    // Bytes of a voxel while a slab is drawn: the targets, once more while they are packed, and the channels.
    [[nodiscard]] double voxel_bytes() const {
        double bytes = 0.25;
        if (this->only_bits_)
            bytes += this->counts_fragments() ? 8 : 0;
        else
            bytes += 2 * this->surface_voxel_bytes();
        for (const target wanted : this->request_.targets)
            bytes += static_cast<double>(size_of(info_of(wanted).type)) * info_of(wanted).components;
        return bytes;
    }
    // Throws memory_error where the request's part cannot fit, before any of it is drawn.
    void require_part() {
        const typename base::stage_timer timer{*this, "estimate"};
        const voxelize_request& request = this->request_;
        const surface_layers surface = surface_of(*this->uploaded_);
        value_sizes bytes =
            value_sizes_of(request, this->only_bits_ ? (this->counts_fragments() ? 4 : 0.125)
                                                     : static_cast<double>(this->surface_voxel_bytes()));
        if (this->bodies_ && !this->bodies_->is_everywhere()) bytes.bodies = body_map::brick_bytes;
        if (2 * needed_bytes(request, surface, at_most(surface), bytes) < static_cast<double>(memory::room())) return;
        const int side = counted_side(surface);
        this->backend_.progress = nullptr;
        const std::optional<brick_counts> counted =
            count_touched<bits>(this->backend_, *this->uploaded_, counted_grid(this->uploaded_->relative_grid(), side),
                                side == 1 && !request.solid ? request.coverage : voxelpipe::coverage::conservative);
        if (counted) require_bricks(request, needed_bytes(request, surface, counts_of(surface, *counted, side), bytes));
    }
    // As many slabs as keep within the working memory at `bytes_of_voxel` a voxel; a slab that does not is halved, down
    // to a tile's height. Their borders are borders of bricks. draw(slab, most) returns false, without having done
    // anything, if it has more than `most`. Returns the number of slabs.
    template <class Draw>
    int draw_within(double bytes_of_voxel, int pass, int passes, const Draw& draw) {
        const voxelpipe::grid all = this->uploaded_->relative_grid();
        // The share of the memory that earlier slabs have left.
        const auto work = [this] {
            return this->request_.work_memory != 0 ? static_cast<double>(this->request_.work_memory)
                                                   : static_cast<double>(memory::room()) / 4;
        };
        constexpr int tile = 32, brick_area = 64;
        const double slabs = std::ceil(surface_of(*this->uploaded_).voxels() *
                                       (bytes_of_voxel + drawn_brick_bytes / brick_area) / work());
        const auto whole_tiles = [](double depth) { return std::max(1, static_cast<int>(depth / tile)) * tile; };
        int depth = slabs <= 1 ? all.extent.z + tile : whole_tiles(all.extent.z / slabs);
        int drawn = 0;
        for (int begin = 0; begin < all.extent.z;) {
            const int border = (all.offset.z + begin) / tile * tile + depth - all.offset.z;
            const int end = std::min(border, all.extent.z);
            const voxelpipe::grid slab = all.crop({0, 0, begin}, {all.extent.x, all.extent.y, end - begin});
            report_from(pass, passes, static_cast<double>(begin) / all.extent.z,
                        static_cast<double>(end) / all.extent.z);
            vp::sparse_limits most;
            if (end - begin > tile) {
                most.bricks = static_cast<std::uint64_t>(work() / drawn_brick_bytes);
                most.voxels = static_cast<std::uint64_t>(work() / bytes_of_voxel);
            }
            if (draw(slab, most)) {
                begin = end;
                ++drawn;
            } else {
                depth = whole_tiles((end - begin) / 2.0);
            }
        }
        return drawn;
    }
    // The bricks of the request's part. draw(slab, most, part) as draw_within() has it.
    template <class Draw>
    [[nodiscard]] sparse_volume bricks_of(const voxelpipe::grid& whole, const Draw& draw) {
        std::vector<sparse_volume> parts;
        draw_within(bit_bytes, 0, 1, [&](const voxelpipe::grid& slab, const vp::sparse_limits& most) {
            sparse_volume part;
            part.shape = volume_of(whole);
            if (!draw(slab, most, part)) return false;
            parts.push_back(std::move(part));
            return true;
        });
        return join_slabs(std::move(parts));
    }
    void draw_slabs(sparse_volume& result, int passes) {
        std::vector<sparse_volume> parts;
        this->stats_.slabs =
            draw_within(voxel_bytes(), 0, passes, [&](const voxelpipe::grid& slab, const vp::sparse_limits& most) {
                sparse_volume part;
                part.shape = result.shape;
                if (!(this->only_bits_ ? draw_bits(part, slab, most) : draw_surface(part, slab, most))) return false;
                parts.push_back(std::move(part));
                return true;
            });
        const typename base::stage_timer timer{*this, "resolve"};
        result = join_slabs(std::move(parts));
        if (this->draws_lines_) this->stats_.voxels = result.num_voxels(); // a voxel may have been drawn twice
        if (this->wants(target::normal)) count_cancelled(result);
    }
    // False if there is more than `most`; nothing is drawn then.
    template <class Draw, class Framebuffer>
    [[nodiscard]] bool draw_part(const std::vector<Draw>& draws, const voxelpipe::grid& slab, Framebuffer& framebuffer,
                                 const vp::sparse_limits& most) {
        framebuffer.limit(most);
        return this->draw_reporting(draws, slab, framebuffer);
    }

    [[nodiscard]] bool draw_bits(sparse_volume& result, const voxelpipe::grid& slab, const vp::sparse_limits& most) {
        std::bitset<2> enabled;
        enabled[0] = !this->counts_fragments(); // one target there has to be
        enabled[1] = this->counts_fragments();
        bits framebuffer(this->backend_, slab.extent, enabled);
        if (!draw_part(this->uploaded_->bits_draws(), slab, framebuffer, most)) return false;
        const typename base::stage_timer timer{*this, "resolve"};
        take_bricks(result, framebuffer);
        for (const target wanted : this->request_.targets) {
            if (wanted == target::occupancy) add_occupancy(result);
            if (wanted == target::count && this->counts_fragments())
                copy<1, std::uint32_t>(result, wanted, framebuffer);
            if (wanted == target::color_outer) add_unset(result, wanted);
        }
        return true;
    }

    // False as draw_part().
    [[nodiscard]] bool draw_surface_in(const voxelpipe::grid& slab, surface_bricks& framebuffer,
                                       std::bitset<base::num_targets> enabled, const vp::sparse_limits& most) {
        return draw_part(this->uploaded_->draws(), slab, framebuffer, most) &&
               this->draw_lines(this->uploaded_->line_draws(), slab, framebuffer, enabled);
    }

    [[nodiscard]] bool draw_surface(sparse_volume& result, const voxelpipe::grid& slab, const vp::sparse_limits& most) {
        auto enabled = this->enabled_targets();
        if (enabled.count() > 1) enabled[base::occupancy] = false;
        surface_bricks framebuffer(this->backend_, slab.extent, enabled);
        if (enabled[base::triangle]) vp::get<base::triangle>(framebuffer).clear(UINT32_MAX); // as int32: -1
        if (!draw_surface_in(slab, framebuffer, enabled, most)) return false;
        const typename base::stage_timer timer{*this, "resolve"};
        take_bricks(result, framebuffer);
        for (const target wanted : this->request_.targets) {
            switch (wanted) {
            case target::occupancy:
                add_occupancy(result);
                break;
            case target::count:
                if (!this->counts_fragments()) break;
                copy<base::count, std::uint32_t>(result, wanted, framebuffer);
                break;
            case target::color:
                resolve<glm::u8vec4>(result, wanted,
                                     mean_color{values_of<base::color_sum>(framebuffer),
                                                values_of<base::count>(framebuffer), this->uploaded_->tables()});
                break;
            case target::color_max:
                copy<base::color_max, glm::u8vec4>(result, wanted, framebuffer);
                break;
            case target::color_replace:
                copy<base::color_last, glm::u8vec4>(result, wanted, framebuffer);
                break;
            case target::color_outer:
                add_unset(result, wanted);
                break;
            case target::normal:
                resolve<glm::vec3>(result, wanted, unit_normal{values_of<base::normal_sum>(framebuffer)});
                break;
            case target::material:
                resolve<std::int32_t>(result, wanted,
                                      material_of_triangle{values_of<base::triangle>(framebuffer),
                                                           this->uploaded_->draw_table(),
                                                           this->uploaded_->num_draws()});
                break;
            case target::triangle:
                copy<base::triangle, std::uint32_t>(result, wanted, framebuffer);
                break;
            case target::depth:
                copy<base::depth, float>(result, wanted, framebuffer);
                break;
            case target::distance: // those of --distance alone, which draws no bricks
            case target::nearest:
            case target::fraction: // not of surfaces
            case target::area_vector:
            case target::area:
            case target::centroid:
            case target::aperture_x:
            case target::aperture_y:
            case target::aperture_z:
                break;
            }
        }
        return true;
    }

    // Fills the channel of color-outer, once all voxels of the request's part are known.
    void draw_outer(sparse_volume& result, int passes) {
        const voxelize_stats counted = this->stats_; // the same fragments again
        const voxelpipe::grid all = this->uploaded_->relative_grid();
        const auto columns = [](int a, int b) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); };
        column_table along_z{all.offset, all.extent, {}};
        if (this->request_.columns == nullptr) {
            const typename base::stage_timer timer{*this, "outside"};
            along_z.along[2].resize(columns(all.extent.x, all.extent.y));
            add_columns(result, along_z);
        }
        this->make_outer_draws();
        channel& colors = *std::find_if(result.channels.begin(), result.channels.end(),
                                        [](const channel& c) { return c.name == info_of(target::color_outer).name; });
        draw_within(2 * sizeof(std::uint64_t) + sizeof(glm::u8vec4), 1, passes,
                    [&](const voxelpipe::grid& slab, const vp::sparse_limits& most) {
                        column_table ends{slab.offset, slab.extent, {}};
                        ends.along[0].resize(columns(slab.extent.y, slab.extent.z));
                        ends.along[1].resize(columns(slab.extent.x, slab.extent.z));
                        {
                            const typename base::stage_timer timer{*this, "outside"};
                            add_columns(result, ends);
                        }
                        column_view view = ends.view();
                        view.along[2] =
                            this->request_.columns != nullptr ? this->request_.columns : along_z.along[2].data();
                        this->set_columns(view);
                        std::bitset<1> enabled;
                        enabled.set();
                        outer_bricks framebuffer(this->backend_, slab.extent, enabled);
                        if (!draw_part(this->outer_draws_, slab, framebuffer, most) ||
                            !this->draw_lines(this->outer_line_draws_, slab, framebuffer, enabled))
                            return false;
                        const typename base::stage_timer timer{*this, "resolve"};
                        sparse_volume part;
                        take_bricks(part, framebuffer);
                        resolve<glm::u8vec4>(part, target::color_outer, outer_color{values_of<0>(framebuffer)});
                        put_values(part, part.channels.front(), result, colors);
                        return true;
                    });
        this->restore_counts(counted);
    }

    // What is cut or inside, in one call for the whole grid.
    [[nodiscard]] sparse_volume draw_cells(const voxelpipe::grid& whole) {
        sparse_volume result;
        result.shape = volume_of(whole);
        report_from(0, 1, 0, 1);
        using real = vp::target<float, vp::blend::replace>;
        using point = vp::target<glm::vec3, vp::blend::replace>;
        const voxelpipe::grid grid = this->uploaded_->relative_grid();
        std::bitset<3> enabled(1);
        enabled[1] = this->wants(target::area);
        enabled[2] = this->wants(target::centroid);
        vp::sparse_framebuffer<Backend, real, real, point> framebuffer(this->backend_, grid.extent, enabled);
        vp::cell_options options;
        if (this->request_.close_holes != 0) {
            options.repair = vp::repair::close_holes;
            options.max_hole_edges = this->request_.close_holes;
        }
        vp::status status;
        const auto draw_by = [&](const auto& shader) {
            using draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, std::remove_cvref_t<decltype(shader)>>;
            std::vector<draw> draws;
            for (const auto& d : this->uploaded_->bits_draws()) draws.push_back({d.mesh, d.vertex_shader, shader});
            status = vp::voxelize_cells(this->backend_, draws, grid, framebuffer, options);
        };
        {
            const typename base::stage_timer timer{*this, "fractions"};
            if (enabled.count() > 1)
                draw_by(measures_anywhere{});
            else
                draw_by(fraction_anywhere{});
        }
        this->check(status, this->request_);
        fraction_counts counts;
        counts.open_rows = status.cells.open_rows;
        counts.rows = static_cast<std::uint64_t>(grid.extent.y) * static_cast<std::uint64_t>(grid.extent.z);
        this->note_cells(status, counts);
        const typename base::stage_timer timer{*this, "resolve"};
        take_bricks(result, framebuffer);
        const auto* const fractions = values_of<0>(framebuffer);
        for (const target wanted : this->request_.targets) {
            if (wanted == target::area) copy<1, float>(result, wanted, framebuffer);
            if (wanted == target::centroid) copy<2, glm::vec3>(result, wanted, framebuffer);
            if (wanted == target::fraction)
                resolve<float>(result, wanted, [=, clamps = this->request_.clamp](std::size_t i) {
                    return clamps ? std::clamp(fractions[i], 0.0F, 1.0F) : fractions[i];
                });
        }
        return result;
    }

    // The solid's bricks and tiles, and the values of the surface where that lies in them: in bricks.
    [[nodiscard]] sparse_volume draw_solid(sparse_volume&& surface_of) {
        // The outside follows from the whole grid: a flood is drawn there, with the padding, or has been before.
        const bool is_flood = this->request_.solid->rule == solid_rule::exterior;
        const voxelpipe::grid wanted_part = this->uploaded_->relative_grid();
        const voxelpipe::grid part =
            is_flood && this->request_.solid->slab == nullptr ? wanted_part.uncropped() : wanted_part;
        std::bitset<2> enabled;
        enabled[0] = !this->counts_bodies();
        enabled[1] = this->counts_bodies();
        bits framebuffer(this->backend_, part.extent, enabled);
        vp::status status;
        {
            const typename base::stage_timer timer{*this, "voxelize"};
            this->backend_.progress = [this](std::uint64_t done, std::uint64_t total) {
                this->report_(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
            status = vp::voxelize_solid(this->backend_, this->uploaded_->bits_draws(), part, framebuffer,
                                        solid_options_of(*this->request_.solid));
        }
        this->add_solid_counts(status, wanted_part);
        const typename base::stage_timer timer{*this, "fill"};
        sparse_volume result;
        result.shape = surface_of.shape;
        take_bricks(result, framebuffer);
        // Counts of several bodies make no tiles, so all counts are 1 where there are tiles, which may be opened or
        // cut.
        const bool has_counts = this->counts_bodies() && result.tiles.empty();
        if (!surface_of.keys.empty() && !result.tiles.empty()) result = open_tiles(result, &surface_of.keys);
        if (part.extent != wanted_part.extent)
            keep_part(result, wanted_part.offset, wanted_part.extent);
        else if (is_flood && wanted_part.offset.x != 0 && !result.tiles.empty()) // as without slabs, where it is padded
            result = open_tiles(result);
        std::optional<body_map> bodies;
        if (this->bodies_) bodies.emplace(this->bodies_->find_in(wanted_part));
        std::vector<fill_values> fills; // by target
        for (const target wanted : this->request_.targets)
            fills.push_back(wanted == target::occupancy || wanted == target::count
                                ? fill_values{}
                                : fill_of(surface_of, wanted, *this->request_.solid, bodies ? &*bodies : nullptr));
        if (bodies && !bodies->is_everywhere() && !result.tiles.empty())
            result = bodies->with_whole_tiles(result, [&](std::uint32_t a, std::uint32_t b) {
                return std::all_of(fills.begin(), fills.end(),
                                   [&](const fill_values& f) { return f.of(a) == f.of(b); });
            });
        this->warn_of_solid(result.num_voxels(), surface_of.num_voxels());
        for (std::size_t t = 0; t < fills.size(); ++t) {
            const target wanted = this->request_.targets[t];
            if (wanted == target::occupancy)
                add_occupancy(result);
            else if (wanted != target::count)
                add_filled(result, surface_of, info_of(wanted).name, fills[t]);
            else if (has_counts)
                copy<1, std::uint32_t>(result, wanted, framebuffer);
            else
                resolve<std::uint32_t>(result, wanted, [](std::size_t) { return 1U; });
        }
        return result;
    }

    template <class Framebuffer>
    void take_bricks(sparse_volume& result, const Framebuffer& framebuffer) {
        const auto& from = framebuffer.contents();
        const auto list = [](const auto& b) { return std::vector(b.data(), b.data() + b.size()); };
        result.keys = list(from.keys);
        result.masks = list(from.masks);
        result.offsets = list(from.offsets);
        result.tiles = list(from.tiles);
    }
    template <std::size_t I, class Framebuffer>
    [[nodiscard]] static const auto* values_of(const Framebuffer& framebuffer) {
        return get<I>(framebuffer.contents().values).data();
    }
    // A channel whose values come later.
    void add_unset(sparse_volume& result, target id) {
        resolve<glm::u8vec4>(result, id, [](std::size_t) { return glm::u8vec4(0); });
    }
    static void add_occupancy(sparse_volume& result) { result.channels.push_back({"occupancy", scalar::bit, 1, {}}); }

    template <class T, class Value>
    void resolve(sparse_volume& result, target id, const Value& value) {
        const target_info& info = info_of(id);
        channel c{std::string(info.name), info.type, info.components, {}};
        const auto values = static_cast<std::size_t>(result.num_values());
        c.data.resize(values * sizeof(T));
        memory_access<Backend>::read(this->backend_, reinterpret_cast<T*>(c.data.data()), values, value,
                                     thread_count(this->request_.threads));
        result.channels.push_back(std::move(c));
    }
    template <std::size_t I, class T, class Framebuffer>
    void copy(sparse_volume& result, target id, const Framebuffer& framebuffer) {
        resolve<T>(result, id, as_it_is<T>{values_of<I>(framebuffer)});
    }

    void count_cancelled(const sparse_volume& result) {
        const auto* const normals = reinterpret_cast<const glm::vec3*>(result.find("normal")->data.data());
        std::uint64_t cancelled = 0;
        for (std::uint64_t i = 0; i < result.num_voxels(); ++i) cancelled += normals[i] == glm::vec3(0) ? 1 : 0;
        this->report_cancelled_normals(cancelled);
    }
};

} // namespace voxelize
