// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse framebuffers on CPU threads: surfaces, solids, and lists that become bricks.

#include <cpu_ref/cpu_backend.hpp>
#include <cpu_ref/solid/solid.hpp>
#include <cpu_ref/sparse/list_source.hpp>
#include <cpu_ref/sparse/sparse_solid.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelpipe::core {

// Implements voxelize. Arguments are validated. Exceptions of a user's shader or progress function pass through.
template <class Draws, class Coverage, class... Targets>
[[nodiscard]] status run_module(sparse_tag, cpu_backend& backend, const Draws& draws, const grid& g,
                                sparse_framebuffer<cpu_backend, Targets...>& out, const voxelize_options& options,
                                std::uint64_t triangles_in, Coverage) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        auto s = cpu::make_scene(how, draws, cpu::tile_aligned(g));
        s.lead = g.offset - s.where.offset;
        s.arms = arms_of(options.rule);
        return Coverage::dispatch(options.rule, [&]<coverage Rule>() {
            return cpu::draw_sparse_surface<Rule>(how, backend, g, s, options.count_voxels, out);
        });
    });
}

// Implements voxelize_solid, in the same way.
template <class Draw, class... Targets>
[[nodiscard]] status run_module(sparse_tag, cpu_backend& backend, std::span<const Draw> draws, const grid& g,
                                sparse_framebuffer<cpu_backend, Targets...>& out, const solid_options& options,
                                std::uint64_t triangles_in) {
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        if constexpr (is_constant<cpu::solid_shader_of<Draw>>)
            if (makes_tiles(draws, options, out))
                return cpu::run_solid(
                    how, draws, g, glm::ivec3(0), options, [&](const auto& sweep, const status& result) {
                        return cpu::draw_solid_tiles(how, backend, sweep, draws, g, options, out, result);
                    });
        const grid aligned = cpu::tile_aligned(g);
        const auto finish = [&](auto& sweep, const status& result) {
            return cpu::draw_sparse_solid(how, backend, sweep, draws, g, options, out, result);
        };
        return cpu::run_solid(how, draws, aligned, g.offset - aligned.offset, options, finish);
    });
}

// Implements voxelize of nothing into a sparse framebuffer.
template <class... Targets>
[[nodiscard]] status run_module(clear_sparse_tag, cpu_backend& backend, const grid& g,
                                sparse_framebuffer<cpu_backend, Targets...>& out) {
    return backend.guarded(0, [&](const cpu::execution& how) {
        return cpu::draw_sparse(how, backend, g, cpu::empty_source{}, false, status{}, out);
    });
}

// Lists with all outputs become the contents of a sparse framebuffer. `drawn` has the counts of the call.
template <class Payload, class... Targets>
[[nodiscard]] status run_module(store_sparse_tag, cpu_backend& backend, const grid& g,
                                const abuffer<cpu_backend, Payload>& lists,
                                sparse_framebuffer<cpu_backend, Targets...>& out, const status& drawn) {
    return backend.guarded(drawn.counts.triangles_in, [&](const cpu::execution& how) {
        status s = cpu::draw_sparse(how, backend, g, cpu::list_source<Payload>(how, g, lists), false, status{}, out);
        if (s.ok()) s.counts = drawn.counts;
        return s;
    });
}

// Fills the slots of a brick_slots.
inline void run_module(brick_slots_tag, cpu_backend&, const brick_table& table, std::uint32_t* slots, int log2_slots) {
    std::fill_n(slots, std::size_t{1} << log2_slots, brick_lookup::free_slot);
    for (std::uint64_t b = 0; b < table.count; ++b)
        insert_brick(slots, log2_slots, table.keys[b], static_cast<std::uint32_t>(b));
}

} // namespace voxelpipe::core
