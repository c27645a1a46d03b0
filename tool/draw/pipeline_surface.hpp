// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The surface in the tool's pipeline: one slab with all its targets, and the colours that the sides of the grid see.
// Part of pipeline.hpp: a file that instantiates the pipeline includes it.

#include "model/parallel.hpp"
#include "pipeline.hpp"

#include <algorithm>
#include <atomic>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelize {

template <class Backend>
void pipeline<Backend>::draw_bits(volume& result, const voxelpipe::grid& part, int begin) {
    std::bitset<2> enabled;
    enabled[0] = keeps_bits_ || !counts_fragments();
    enabled[1] = counts_fragments();
    bits_framebuffer& framebuffer = framebuffer_for(bits_framebuffer_, part.extent, enabled);
    draw_reporting(uploaded_->bits_draws(), part, framebuffer);
    const stage_timer timer{*this, "resolve"};
    if (keeps_bits_) copy<0>(result, bits_name_, framebuffer, begin);
    if (counts_fragments()) copy<1>(result, target::count, framebuffer, begin);
}

template <class Backend>
void pipeline<Backend>::draw_surface(volume& result, const voxelpipe::grid& part, int begin) {
    if (draws_lines_) surface_framebuffer_.reset(); // it loads its targets
    const std::bitset<num_targets> enabled = enabled_targets();
    surface_framebuffer& framebuffer = framebuffer_for(surface_framebuffer_, part.extent, enabled);
    if (enabled[triangle]) vp::get<triangle>(framebuffer).clear(UINT32_MAX); // as int32: -1
    draw_reporting(uploaded_->draws(), part, framebuffer);
    draw_lines(uploaded_->line_draws(), part, framebuffer, enabled);
    const stage_timer timer{*this, "resolve"};
    if (keeps_bits_) copy<occupancy>(result, bits_name_, framebuffer, begin);
    if (counts_fragments()) copy<count>(result, target::count, framebuffer, begin);
    if (wants(target::color))
        resolve<glm::u8vec4>(
            result, target::color, part.extent, begin,
            mean_color{elements_of<color_sum>(framebuffer), elements_of<count>(framebuffer), uploaded_->tables()});
    if (wants(target::color_max)) copy<color_max>(result, target::color_max, framebuffer, begin);
    if (wants(target::color_replace)) copy<color_last>(result, target::color_replace, framebuffer, begin);
    if (wants(target::normal))
        resolve<glm::vec3>(result, target::normal, part.extent, begin,
                           unit_normal{elements_of<normal_sum>(framebuffer)});
    if (wants(target::triangle)) copy<triangle>(result, target::triangle, framebuffer, begin);
    if (wants(target::material))
        resolve<std::int32_t>(
            result, target::material, part.extent, begin,
            material_of_triangle{elements_of<triangle>(framebuffer), uploaded_->draw_table(), uploaded_->num_draws()});
    if (wants(target::depth)) copy<depth>(result, target::depth, framebuffer, begin);
}

template <class Backend>
void pipeline<Backend>::make_outer_draws() {
    outer_draws_.clear();
    outer_line_draws_.clear();
    const auto& draws = uploaded_->draws();
    for (std::size_t i = 0; i < draws.size(); ++i)
        outer_draws_.push_back(
            {draws[i].mesh, draws[i].vertex_shader, {draws[i].fragment_shader, uploaded_->double_sided()[i] != 0}});
    for (const auto& d : uploaded_->line_draws())
        outer_line_draws_.push_back({d.mesh, d.vertex_shader, {{d.fragment_shader.of_triangles}}});
}

template <class Backend>
void pipeline<Backend>::set_columns(const column_view& columns) {
    for (outer_draw& draw : outer_draws_) draw.fragment_shader.columns = columns;
    for (outer_line_draw& draw : outer_line_draws_) draw.fragment_shader.of_triangles.columns = columns;
}

template <class Backend>
auto pipeline<Backend>::put_columns(const volume& result) -> std::vector<buffer<column_ends>> {
    const stage_timer timer{*this, "outside"};
    const column_table table = columns_of(result, *result.find(bits_name_), request_.grid.offset, request_.threads);
    std::vector<buffer<column_ends>> ends;
    column_view view{table.low, table.extent};
    for (std::size_t a = 0; a < 3; ++a) view.along[a] = ends.emplace_back(backend_, table.along[a]).data();
    make_outer_draws();
    set_columns(view);
    return ends;
}

template <class Backend>
void pipeline<Backend>::draw_outer(volume& result, const voxelpipe::grid& part, int begin) {
    std::bitset<1> all;
    all.set();
    if (draws_lines_) outer_framebuffer_.reset();
    outer_framebuffer& framebuffer = framebuffer_for(outer_framebuffer_, part.extent, all);
    draw_reporting(outer_draws_, part, framebuffer);
    draw_lines(outer_line_draws_, part, framebuffer, all);
    const stage_timer timer{*this, "resolve"};
    resolve<glm::u8vec4>(result, target::color_outer, part.extent, begin, outer_color{elements_of<0>(framebuffer)});
}

template <class Backend>
void pipeline<Backend>::count_cancelled_normals(const volume& result) {
    const stage_timer timer{*this, "resolve"};
    const auto* const normals = reinterpret_cast<const glm::vec3*>(result.find("normal")->data.data());
    const auto voxels = static_cast<std::size_t>(result.num_voxels());
    constexpr std::size_t block = 1 << 20;
    std::atomic<std::uint64_t> with_normal{0};
    parallel_for((voxels + block - 1) / block, thread_count(request_.threads), [&](std::size_t b) {
        std::uint64_t found = 0;
        for (std::size_t i = b * block; i < std::min(voxels, (b + 1) * block); ++i)
            found += normals[i] != glm::vec3(0) ? 1 : 0;
        with_normal += found;
    });
    report_cancelled_normals(stats_.voxels - with_normal);
}

} // namespace voxelize
