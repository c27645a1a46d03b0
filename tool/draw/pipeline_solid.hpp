// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Solids in the tool's pipeline: their bits, slab by slab, and the values of the voxels inside; and fractions. Part of
// pipeline.hpp: a file that instantiates the pipeline includes it.

#include "distance/distance_shader.hpp"
#include "model/memory.hpp"
#include "model/placement.hpp"
#include "pipeline.hpp"

#include <voxelpipe/cells/cells.hpp>
#include <voxelpipe/solid/diagnose_repair.hpp>

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

template <class Backend>
void pipeline<Backend>::add_solid_counts(const vp::status& status, const voxelpipe::grid& part) {
    check(status, request_);
    if (!draws_surface_) {
        stats_.triangles_dropped = status.counts.triangles_dropped();
        add_counts(status);
    }
    solid_counts& counts = stats_.solid ? *stats_.solid : stats_.solid.emplace();
    counts.rows += static_cast<std::uint64_t>(part.extent.y) * static_cast<std::uint64_t>(part.extent.z);
    counts.open_rows += status.solid.open_rows;
    counts.crossings += status.solid.crossings;
    counts.max_winding = std::max(counts.max_winding, status.solid.max_winding);
    counts.hole_edges = status.solid.hole_edges;
    counts.holes = status.solid.holes;
    counts.closed_holes = status.solid.cones;
}

template <class Backend>
void pipeline<Backend>::draw_solid(volume& result, const voxelpipe::grid& slab, int begin) {
    const bool is_flood = request_.solid->rule == solid_rule::exterior;
    const voxelpipe::grid part = is_flood ? slab.uncropped() : slab;
    std::bitset<2> enabled;
    enabled[0] = true;
    enabled[1] = counts_bodies();
    bits_framebuffer& framebuffer = framebuffer_for(solid_framebuffer_, part.extent, enabled);
    vp::status status;
    {
        const stage_timer timer{*this, "voxelize"};
        status =
            vp::voxelize_solid(backend_, uploaded_->bits_draws(), part, framebuffer, solid_options_of(*request_.solid));
    }
    add_solid_counts(status, slab);
    report_(1.0);
    const stage_timer timer{*this, "resolve"};
    if (part.extent == slab.extent) {
        copy<0>(result, inside_name(), framebuffer, begin);
    } else {
        const auto* const words = elements_of<0>(framebuffer);
        std::vector<std::uint32_t> bits(bits_map::elements(part.extent));
        memory_access<Backend>::read(backend_, bits.data(), bits.size(), as_it_is<std::uint32_t>{words},
                                     thread_count(request_.threads));
        copy_part(result, *result.find(inside_name()), bits, {part.extent.x, part.extent.y, part.extent.z},
                  {slab.offset.x, slab.offset.y, slab.offset.z});
    }
    if (counts_bodies()) copy<1>(result, target::count, framebuffer, begin);
}

template <class Backend>
void pipeline<Backend>::finish_solid(volume& result) {
    const stage_timer timer{*this, "fill"};
    const channel& solid = *result.find(inside_name());
    warn_of_solid(static_cast<std::uint64_t>(result.popcount(solid)),
                  draws_surface_ ? static_cast<std::uint64_t>(result.popcount(*result.find(bits_name_))) : 0);
    if (wants(target::count) && !counts_bodies()) count_bits(result, solid, request_.threads);
    if (!draws_surface_) return;
    const channel& surface = *result.find(bits_name_);
    if constexpr (memory_access<Backend>::on_host)
        if (request_.solid->fill == solid_fill::nearest) fill_nearest(result, solid, surface);
    const voxelpipe::grid part = uploaded_->relative_grid();
    std::optional<body_map> bodies;
    if (bodies_) bodies.emplace(bodies_->find_in(part));
    fill_inside(result, solid, surface, *request_.solid, bodies ? &*bodies : nullptr,
                {part.offset.x, part.offset.y, part.offset.z}, request_.threads);
}

template <class Backend>
void pipeline<Backend>::fill_nearest(volume& result, const channel& solid, const channel& surface) {
    using number_target = vp::target<std::uint32_t, vp::blend::replace>;
    using color_target = vp::target<glm::u8vec4, vp::blend::replace>;
    using float_target = vp::target<float, vp::blend::replace>;
    using view = vp::framebuffer_view<float_target, number_target, color_target,
                                      vp::target<glm::vec3, vp::blend::replace>, float_target>;
    using draw = vp::draw<vp::mesh_view<>, surface_vertex_shader, nearest_shader>;
    const bool wants_color = request_.wants_colors();
    if (!wants_color && !wants(target::material)) return;
    std::vector<draw> draws;
    for (const auto& d : uploaded_->draws())
        draws.push_back({d.mesh, d.vertex_shader, {d.fragment_shader, wants_color}});
    vp::distance_options how;
    how.band = vp::band::whole;
    how.sign = vp::distance_sign::none;
    constexpr double voxel_bytes = sizeof(std::uint32_t) + sizeof(glm::u8vec4);
    const int all = request_.grid.extent.z, depth = slab_depth(voxel_bytes);
    for_each_slab(0, all, depth, [&](const voxelpipe::grid& part, int begin, int, int) {
        const std::size_t voxels = static_cast<std::size_t>(part.extent.x) * static_cast<std::size_t>(part.extent.y) *
                                   static_cast<std::size_t>(part.extent.z);
        std::vector<std::uint32_t> numbers(voxels);
        std::vector<glm::u8vec4> colors(wants_color ? voxels : 0);
        const vp::status status = vp::voxelize_distance(
            backend_, draws, part,
            view::on(part.extent, nullptr, numbers.data(), wants_color ? colors.data() : nullptr, nullptr, nullptr),
            how);
        check(status, request_);
        const material_of_triangle materials{numbers.data(), uploaded_->draw_table(), uploaded_->num_draws()};
        const auto first = static_cast<std::size_t>(result.index(0, 0, begin));
        for (channel& c : result.channels) {
            const std::optional<target> id = target_named(c.name);
            if (!id || (!is_color(*id) && *id != target::material)) continue;
            for_each_voxel_in(result, begin, begin + part.extent.z, solid, surface, [&](std::size_t i) {
                std::byte* const at = c.data.data() + 4 * i;
                if (is_color(*id)) {
                    glm::u8vec4 color = colors[i - first];
                    color.a = 255;
                    std::memcpy(at, &color, sizeof(color));
                } else {
                    const std::int32_t number = materials(i - first);
                    std::memcpy(at, &number, sizeof(number));
                }
            });
        }
    });
}

template <class Backend>
void pipeline<Backend>::examine_solid() {
    const solid_request& solid = *request_.solid;
    solid_counts& counts = *stats_.solid;
    const bool is_flood = solid.rule == solid_rule::exterior;
    if (!solid.is_whole || solid.vote || (!is_flood && counts.open_rows == 0)) return;
    const voxelpipe::grid whole = uploaded_->relative_grid().uncropped();
    // Some twenty bits a voxel on the host, and one of the backend's.
    const double words = static_cast<double>(bits_map::elements(whole.extent));
    if (24 * sizeof(std::uint32_t) * words > static_cast<double>(memory::room())) return;
    try {
        examine_solid_bits(whole);
    } catch (const std::bad_alloc&) { // the solid is there, and nothing is known of it
    }
}

template <class Backend>
void pipeline<Backend>::examine_solid_bits(const voxelpipe::grid& whole) {
    const solid_request& solid = *request_.solid;
    solid_counts& counts = *stats_.solid;
    const bool is_flood = solid.rule == solid_rule::exterior;
    const stage_timer timer{*this, "examine"};
    const auto clock = std::exchange(backend_.times, nullptr); // of the solid alone
    if constexpr (requires { backend_.progress; }) backend_.progress = {};
    std::bitset<2> enabled;
    enabled[0] = true;
    bits_framebuffer& framebuffer = framebuffer_for(solid_framebuffer_, whole.extent, enabled);
    vp::solid_options how = solid_options_of(solid);
    if (!is_flood) {
        how.repair = vp::repair::close_holes;
        how.max_hole_edges = vp::solid_options{}.max_hole_edges;
        const vp::status closed = vp::voxelize_solid(backend_, uploaded_->bits_draws(), whole, framebuffer, how);
        counts.lids_balance = closed.ok() && closed.solid.open_rows == 0;
        how.closing = 0;
    }
    const auto& draws = uploaded_->bits_draws();
    using draw_type = typename std::remove_cvref_t<decltype(draws)>::value_type;
    const vp::status status =
        voxelpipe::diagnose_repair(backend_, std::span<const draw_type>(draws), whole, how, framebuffer);
    backend_.times = clock;
    if (status.code == vp::status_code::crop_without_whole && is_flood)
        throw grid_error("the grid lies within the model, and what --solid exterior makes of it follows from the whole "
                         "model (" +
                         status.message() + "): take a grid that holds the model, or --solid nonzero");
    counts.is_examined = status.ok() || status.code == vp::status_code::crop_without_whole;
    if (status.ok()) counts.flood = status.solid.flood;
}

// Cell shader that returns the fraction, and puts what belongs to the rows' axis into its place: the component of the
// mesh's area within the voxel, and the part of its faces that is inside.
struct fraction_and_faces {
    float* areas = nullptr;     // three a voxel; null: none are wanted
    float* apertures = nullptr; // of the faces across the axis, one more along it than voxels
    glm::ivec3 extent{}, offset{};
    int axis = 0;
    double face = 1; // area of a voxel's face across the axis

    [[nodiscard]] std::int64_t index(const vp::cell_fragment& f, const glm::ivec3& in) const {
        const glm::ivec3 p = f.voxel - offset;
        return (static_cast<std::int64_t>(p.z) * in.y + p.y) * in.x + p.x;
    }
    vp::output<float> operator()(const vp::cell_fragment& f) const {
        if (areas != nullptr) // the units' difference is exact
            areas[3 * index(f, extent) + axis] =
                static_cast<float>(static_cast<double>(f.aperture - f.next_aperture) * 0x1p-44 * face);
        if (apertures != nullptr) {
            glm::ivec3 in = extent;
            ++in[axis];
            float* const lower = apertures + index(f, in);
            const std::int64_t step = axis == 0 ? 1 : axis == 1 ? in.x : static_cast<std::int64_t>(in.x) * in.y;
            const auto part = [](std::int64_t units) { return static_cast<float>(units) * 0x1p-44F; };
            *lower = part(f.aperture);
            if (f.voxel[axis] - offset[axis] + 1 == extent[axis]) lower[step] = part(f.next_aperture);
        }
        return vp::outputs(f.fraction);
    }
};

// The same with the area and the centroid of the part inside, null where they are not wanted.
struct measured_fraction : fraction_and_faces {
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area>;
    float* sizes = nullptr;
    float* centroids = nullptr; // three a voxel

    vp::output<float> operator()(const fragment& f) const {
        const std::int64_t voxel = index(f, extent);
        if (sizes != nullptr) sizes[voxel] = static_cast<float>(f.area);
        for (int i = 0; i < 3 && centroids != nullptr; ++i) centroids[3 * voxel + i] = f.centroid[i];
        return fraction_and_faces::operator()(f);
    }
};

template <class Backend>
void pipeline<Backend>::draw_cells(volume& result) {
    // The surface and the solid are drawn; their working memory is freed before the cells take theirs.
    surface_framebuffer_.reset();
    bits_framebuffer_.reset();
    solid_framebuffer_.reset();
    outer_framebuffer_.reset();
    report_from(num_passes() - 1, 0, 1);
    const voxelpipe::grid grid = uploaded_->relative_grid();
    const glm::ivec3 extent = request_.grid.extent;
    const auto num_voxels =
        static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) * static_cast<std::size_t>(extent.z);
    // A channel of zeros, for most voxels get no fragment; null where nobody wants it.
    const auto zeros = [&](target id) -> float* {
        if (!wants(id)) return nullptr;
        volume* holder = &result;
        for (volume& faces : result.faces)
            if (faces.find(info_of(id).name) != nullptr) holder = &faces;
        channel& c = *holder->find(info_of(id).name);
        std::fill(c.data.begin(), c.data.end(), std::byte{0});
        return channel_at<float>(*holder, info_of(id).name, 0);
    };
    measured_fraction shader;
    shader.extent = extent;
    shader.offset = grid.offset;
    shader.sizes = zeros(target::area);
    shader.centroids = zeros(target::centroid);
    float* const areas = zeros(target::area_vector);
    const std::array<float*, 3> apertures{zeros(target::aperture_x), zeros(target::aperture_y),
                                          zeros(target::aperture_z)};
    std::vector<float> scratch;
    if (!wants(target::fraction)) scratch.resize(num_voxels);
    float* const values =
        scratch.empty() ? channel_at<float>(result, info_of(target::fraction).name, 0) : scratch.data();
    const auto view = vp::framebuffer_view<vp::target<float, vp::blend::replace>>::on(extent, values);
    vp::cell_options options;
    if (request_.close_holes != 0) {
        options.repair = vp::repair::close_holes;
        options.max_hole_edges = request_.close_holes;
    }
    const auto draw_by = [&](const auto& of_voxels) {
        using draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, std::remove_cvref_t<decltype(of_voxels)>>;
        std::vector<draw> draws;
        for (const auto& d : uploaded_->bits_draws()) draws.push_back({d.mesh, d.vertex_shader, of_voxels});
        return vp::voxelize_cells(backend_, draws, grid, view, options);
    };
    fraction_counts counts;
    vp::status status;
    {
        const stage_timer timer{*this, "fractions"};
        // Rows along x come last: the fractions, all that is no axis', and the counts are theirs.
        for (int axis = 2; axis >= 0; --axis) {
            shader.areas = areas;
            shader.apertures = apertures[static_cast<std::size_t>(axis)];
            if (axis != 0 && areas == nullptr && shader.apertures == nullptr) continue;
            shader.axis = axis;
            shader.face = grid.voxel_size[(axis + 1) % 3] * grid.voxel_size[(axis + 2) % 3];
            options.axis = axis;
            options.count_open_edges = axis == 0;
            const bool measures = axis == 0 && (shader.sizes != nullptr || shader.centroids != nullptr);
            status = measures ? draw_by(shader) : draw_by(static_cast<const fraction_and_faces&>(shader));
            check(status, request_);
            counts.open_rows += status.cells.open_rows;
            counts.rows +=
                static_cast<std::uint64_t>(extent[(axis + 1) % 3]) * static_cast<std::uint64_t>(extent[(axis + 2) % 3]);
        }
        if (request_.clamp)
            memory_access<Backend>::read(
                backend_, values, num_voxels, [values](std::size_t i) { return std::clamp(values[i], 0.0F, 1.0F); },
                thread_count(request_.threads));
    }
    note_cells(status, counts);
}

template <class Backend>
void pipeline<Backend>::note_cells(const vp::status& status, fraction_counts counts) {
    if (!draws_surface_ && !request_.solid) { // otherwise these are counts of what was drawn before
        stats_.triangles_dropped = status.counts.triangles_dropped();
        add_counts(status);
        stats_.slabs = 1;
    }
    counts.volume_low = status.cells.volume_low;
    counts.volume_high = status.cells.volume_high;
    counts.cut_voxels = status.cells.cut_voxels;
    counts.below_zero = status.cells.below_zero;
    counts.above_one = status.cells.above_one;
    counts.open_edges = status.cells.open_edges;
    counts.hole_edges = status.cells.hole_edges;
    counts.holes = status.cells.holes;
    counts.closed_holes = status.cells.cones;
    stats_.fractions = counts;
    add_fraction_warnings(request_, stats_);
    report_(1.0);
}

template <class Backend>
void pipeline<Backend>::warn_of_solid(std::uint64_t voxels, std::uint64_t surface) {
    stats_.voxels = voxels;
    stats_.solid->touched += surface;
    examine_solid();
    if (std::string warning = flood_warning(*request_.solid, *stats_.solid, voxels); !warning.empty())
        stats_.warnings.push_back(std::move(warning));
    if (std::string warning = open_warning(*request_.solid, *stats_.solid); !warning.empty())
        stats_.warnings.push_back(std::move(warning));
}

} // namespace voxelize
