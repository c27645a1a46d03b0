// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The parts of the tool's sparse pipeline that draw: the surface, what the sides of the grid see of it, the solid. Part
// of sparse_pipeline.hpp: a file that instantiates them includes it.

#include "sparse_outside.hpp"
#include "sparse_pipeline.hpp"
#include "sparse_solid.hpp"

#include <voxelpipe/cells/links.hpp>

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

template <class Backend>
bool sparse_pipeline<Backend>::draw_walls(sparse_volume& result, const voxelpipe::grid& slab,
                                          const vp::sparse_limits& most) {
    std::bitset<2> enabled;
    enabled[0] = true;
    bits framebuffer(this->backend_, slab.extent, enabled);
    if (!draw_part(this->uploaded_->bits_draws(), slab, framebuffer, most)) return false;
    take_bricks(result, framebuffer);
    return true;
}

template <class Backend>
std::optional<brick_counts> sparse_pipeline<Backend>::count_touched(const voxelpipe::grid& g,
                                                                    voxelpipe::coverage rule) {
    std::bitset<2> enabled;
    enabled[0] = true;
    bits framebuffer(this->backend_, g.extent, enabled);
    framebuffer.limit({0, 0});
    if constexpr (requires { this->backend_.progress; }) this->backend_.progress = nullptr;
    const auto times = std::exchange(this->backend_.times, nullptr);
    const auto& draws = this->uploaded_->bits_draws();
    const voxelpipe::status status =
        voxelpipe::voxelize(this->backend_, std::span(draws), g, framebuffer, voxelpipe::voxelize_options{rule});
    this->backend_.times = times;
    if (status.ok()) return brick_counts{};
    if (status.code != voxelpipe::status_code::capacity_exceeded) return std::nullopt;
    return brick_counts{static_cast<double>(status.required.bricks), static_cast<double>(status.required.voxels)};
}

template <class Backend>
bool sparse_pipeline<Backend>::draw_bits(sparse_volume& result, const voxelpipe::grid& slab,
                                         const vp::sparse_limits& most) {
    std::bitset<2> enabled;
    enabled[0] = !this->counts_fragments(); // one target there has to be
    enabled[1] = this->counts_fragments();
    bits framebuffer(this->backend_, slab.extent, enabled);
    if (!draw_part(this->uploaded_->bits_draws(), slab, framebuffer, most)) return false;
    const typename base::stage_timer timer{*this, "resolve"};
    take_bricks(result, framebuffer);
    for (const target wanted : this->request_.targets) {
        if (wanted == target::occupancy) add_occupancy(result);
        if (wanted == target::count && this->counts_fragments()) copy<1, std::uint32_t>(result, wanted, framebuffer);
        if (wanted == target::color_outer) add_unset(result, wanted);
    }
    return true;
}

template <class Backend>
bool sparse_pipeline<Backend>::draw_occupied(sparse_volume& result, const voxelpipe::grid& slab,
                                             const vp::sparse_limits& most) {
    std::bitset<base::num_targets> enabled;
    enabled[base::occupancy] = true;
    surface_bricks framebuffer(this->backend_, slab.extent, enabled);
    if (!draw_surface_in(slab, framebuffer, enabled, most)) return false;
    take_bricks(result, framebuffer);
    return true;
}

template <class Backend>
bool sparse_pipeline<Backend>::draw_surface(sparse_volume& result, const voxelpipe::grid& slab,
                                            const vp::sparse_limits& most) {
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
                                                       this->uploaded_->draw_table(), this->uploaded_->num_draws()});
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
        case target::links:
        case target::link_triangle:
        case target::link_material:
        case target::aperture_x:
        case target::aperture_y:
        case target::aperture_z:
            break;
        }
    }
    return true;
}

template <class Backend>
bool sparse_pipeline<Backend>::draw_outer_in(const voxelpipe::grid& slab, const vp::sparse_limits& most,
                                             sparse_volume& part) {
    std::bitset<1> enabled;
    enabled.set();
    outer_bricks framebuffer(this->backend_, slab.extent, enabled);
    if (!draw_part(this->outer_draws_, slab, framebuffer, most) ||
        !this->draw_lines(this->outer_line_draws_, slab, framebuffer, enabled))
        return false;
    const typename base::stage_timer timer{*this, "resolve"};
    take_bricks(part, framebuffer);
    resolve<glm::u8vec4>(part, target::color_outer, outer_color{values_of<0>(framebuffer)});
    return true;
}

template <class Backend>
void sparse_pipeline<Backend>::draw_outer(sparse_volume& result, int passes) {
    const voxelize_stats counted = this->stats_; // the same fragments again
    const voxelpipe::grid all = this->uploaded_->relative_grid();
    const auto columns = [](int a, int b) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); };
    column_table along_z{all.offset, all.extent, {}};
    if (this->request_.columns == nullptr) {
        const typename base::stage_timer timer{*this, "outside"};
        along_z.along[2].resize(columns(all.extent.x, all.extent.y));
        add_columns(result, along_z);
    }
    std::vector<typename base::template buffer<column_ends>>
        put; // where the draws read them, of the whole part and of a slab
    const auto ends_of = [&](const column_ends* ends, std::size_t count) {
        if constexpr (memory_access<Backend>::on_host)
            return ends;
        else
            return static_cast<const column_ends*>(
                put.emplace_back(this->backend_, std::vector(ends, ends + count)).data());
    };
    const column_ends* const ends_along_z =
        ends_of(this->request_.columns != nullptr ? this->request_.columns : along_z.along[2].data(),
                columns(all.extent.x, all.extent.y));
    const std::size_t num_kept = put.size();
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
                    put.erase(put.begin() + static_cast<std::ptrdiff_t>(num_kept), put.end());
                    for (std::size_t a = 0; a < 2; ++a)
                        view.along[a] = ends_of(ends.along[a].data(), ends.along[a].size());
                    view.along[2] = ends_along_z;
                    this->set_columns(view);
                    sparse_volume part;
                    if (!draw_outer_in(slab, most, part)) return false;
                    put_values(part, part.channels.front(), result, colors);
                    return true;
                });
    this->restore_counts(counted);
}

template <class Backend>
vp::status sparse_pipeline<Backend>::draw_solid_bits(const voxelpipe::grid& part, sparse_volume& result,
                                                     channel& counts) {
    std::bitset<2> enabled;
    enabled[0] = !this->counts_bodies();
    enabled[1] = this->counts_bodies();
    bits framebuffer(this->backend_, part.extent, enabled);
    vp::status status;
    {
        const typename base::stage_timer timer{*this, "voxelize"};
        if constexpr (requires { this->backend_.progress; })
            this->backend_.progress = [this](std::uint64_t done, std::uint64_t total) {
                this->report_(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
        status = vp::voxelize_solid(this->backend_, this->uploaded_->bits_draws(), part, framebuffer,
                                    solid_options_of(*this->request_.solid));
    }
    if (!status.ok()) return status;
    const typename base::stage_timer timer{*this, "fill"};
    take_bricks(result, framebuffer);
    // Counts of several bodies make no tiles, so all counts are 1 where there are tiles, which may be opened or cut.
    if (this->counts_bodies() && result.tiles.empty()) copy<1, std::uint32_t>(counts, framebuffer, result.num_values());
    return status;
}

template <class Backend>
sparse_volume sparse_pipeline<Backend>::draw_solid(sparse_volume&& surface_of) {
    // The outside follows from the whole grid: a flood is drawn there, with the padding, or has been before.
    const bool is_flood = this->request_.solid->rule == solid_rule::exterior;
    const voxelpipe::grid wanted_part = this->uploaded_->relative_grid();
    const voxelpipe::grid part =
        is_flood && this->request_.solid->slab == nullptr ? wanted_part.uncropped() : wanted_part;
    sparse_volume result;
    channel counts;
    const vp::status status = draw_solid_bits(part, result, counts);
    this->add_solid_counts(status, wanted_part);
    const typename base::stage_timer timer{*this, "fill"};
    result.shape = surface_of.shape;
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
            return std::all_of(fills.begin(), fills.end(), [&](const fill_values& f) { return f.of(a) == f.of(b); });
        });
    this->warn_of_solid(result.num_voxels(), surface_of.num_voxels());
    for (std::size_t t = 0; t < fills.size(); ++t) {
        const target wanted = this->request_.targets[t];
        if (wanted == target::occupancy)
            add_occupancy(result);
        else if (wanted != target::count)
            add_filled(result, surface_of, info_of(wanted).name, fills[t]);
        else if (!counts.data.empty())
            add_channel(result, wanted).data = std::move(counts.data);
        else
            fill_channel(add_channel(result, wanted), result.num_values(), 1U);
    }
    return result;
}

// Shaders of cut cells: what is untouched becomes tiles.
struct fraction_anywhere {
    static constexpr bool ignores_voxel = true;
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

template <class Backend>
sparse_volume sparse_pipeline<Backend>::draw_cells(const voxelpipe::grid& whole) {
    require_cells();
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

template <class Backend>
sparse_volume sparse_pipeline<Backend>::draw_links(const voxelpipe::grid& whole) {
    require_cells();
    sparse_volume result;
    result.shape = volume_of(whole);
    report_from(0, 1, 0, 1);
    vp::link_list<Backend> links(this->backend_);
    vp::status status;
    {
        const typename base::stage_timer timer{*this, "links"};
        status = vp::voxelize_links(this->backend_, this->uploaded_->bits_draws(),
                                    this->uploaded_->relative_grid().uncropped(), links,
                                    vp::link_options{this->request_.neighbours});
    }
    this->check(status, this->request_);
    this->stats_.triangles_dropped = status.counts.triangles_dropped();
    this->add_counts(status);
    this->stats_.slabs = 1;
    const typename base::stage_timer timer{*this, "resolve"};
    const std::vector<std::uint32_t> places = set_voxels(result, {links.voxels.data(), links.size()});
    const auto columns = static_cast<std::size_t>(links.neighbours);
    for (const target wanted : this->request_.targets) {
        channel& c = add_channel(result, wanted);
        c.components = links.neighbours;
        c.data.resize(columns * places.size() * sizeof(float));
        const auto fill = [&](const auto& value) {
            using type = decltype(value(std::size_t{0}));
            memory_access<Backend>::read(
                this->backend_, reinterpret_cast<type*>(c.data.data()), columns * places.size(),
                [&](std::size_t i) { return value(columns * places[i / columns] + i % columns); },
                thread_count(this->request_.threads));
        };
        if (wanted == target::links) fill([&](std::size_t i) { return links.q.data()[i]; });
        if (wanted == target::link_triangle)
            fill([&](std::size_t i) { return static_cast<std::int32_t>(links.primitives.data()[i]); });
        if (wanted == target::link_material)
            fill([&](std::size_t i) {
                const std::uint32_t draw = links.draws.data()[i];
                return draw == vp::no_crossing ? -1 : this->uploaded_->draw_table()[draw].material;
            });
    }
    report_from(0, 1, 1, 1);
    return result;
}

} // namespace voxelize
