// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Host side of a framebuffer call: chooses the strategy once, computes its memory (plan_memory), and launches its
// kernels on one stream without waiting (launch). voxelize reads the counters at the end; voxelize_async leaves them on
// the device.

#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/device/call/graph_cache.cuh>
#include <voxelpipe/device/call/immediate_strategy.cuh>
#include <voxelpipe/device/call/mask_strategy.cuh>
#include <voxelpipe/device/call/sorted_strategy.cuh>
#include <voxelpipe/device/call/strategy.hpp>
#include <voxelpipe/device/call/tiled_strategy.cuh>
#include <voxelpipe/device/raster/raster_draws.cuh>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

namespace voxelpipe::device {

// The strategies that these types allow. A constant in bits is never listed: bits are blended in place, and the rare
// calls that could not be (draws of several constants into bits that are loaded, with voxels counted) go to tiles. The
// kernels of lists would be a quarter of what such a program compiles.
template <class FragmentShader, class Framebuffer>
inline constexpr possible_strategies strategies_of{};
template <class FragmentShader, class... Targets>
inline constexpr possible_strategies strategies_of<FragmentShader, framebuffer_view<Targets...>> = {
    core::is_constant<FragmentShader>&& depends_on_mask<framebuffer_view<Targets...>>,
    core::is_constant<FragmentShader> && (is_immediate<Targets>() && ...),
    is_resolvable<framebuffer_view<Targets...>> && !target_groups<framebuffer_view<Targets...>>::has_ordered &&
        !(core::is_constant<FragmentShader> && has_only_bits<framebuffer_view<Targets...>>),
    target_groups<framebuffer_view<Targets...>>::has_ordered,
};

// Everything that the launches of a call depend on, except its draws. These bytes and those of the draws are the key of
// a kept graph (call/graph_cache.cuh): any field that is added here becomes part of the key.
template <class Framebuffer>
struct framebuffer_plan {
    grid g;
    Framebuffer fb;
    voxelize_options options;
    std::uint32_t num_primitives;
    capacities limits;
    const strategy_rule* rule;
    immediate_plan<targets_of<Framebuffer>::count> targets; // for constant shaders
};

// Clears the targets of a call. counts: targets may hold numbers of fragments (immediate_plan).
template <class Framebuffer, class Tracking>
void clear_for(const framebuffer_plan<Framebuffer>& plan, bool counts, const Tracking& tracking,
               const pipeline_state* state, cudaStream_t stream) {
    core::for_each_index<targets_of<Framebuffer>::count>([&]<std::size_t K>() {
        auto t = voxelpipe::get<K>(plan.fb.targets);
        if (counts && plan.targets.counts(K)) t.clear_value = {}; // the number of fragments
        if (t.load == load_operation::clear && !tracking.by_chunks[K]) clear_target(t, state, plan.limits, stream);
    });
    clear_by_chunks(tracking, plan.fb, state, plan.limits, stream);
}

template <class Draw, class Framebuffer, tuning::fine_raster_policy Policy>
struct framebuffer_call;
template <class Mesh, class VertexShader, class FragmentShader, class Framebuffer, tuning::fine_raster_policy Policy>
struct framebuffer_call<draw<Mesh, VertexShader, FragmentShader>, Framebuffer, Policy> {
    using mesh_type = Mesh;
    using vertex_shader_type = VertexShader;
    using fragment_shader_type = FragmentShader;
    using framebuffer_type = Framebuffer;
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    using scene_buffers = scene_memory<Mesh, VertexShader, FragmentShader>;
    using scene_type = typename scene_buffers::scene_type;
    using groups = target_groups<Framebuffer>;
    using fragment_type = fragment<typename scene_type::varyings>;
    using output_type =
        core::output_or_none<std::remove_cvref_t<std::invoke_result_t<const FragmentShader&, const fragment_type&>>>;
    using values = decltype(std::declval<output_type>().values);
    using tracking_type = change_tracking<Framebuffer>;
    static constexpr tuning::fine_raster_policy policy = Policy;
    static constexpr possible_strategies possible = strategies_of<FragmentShader, Framebuffer>;

    std::span<const draw_type> draws;
    framebuffer_plan<Framebuffer> plan;
    stage_clock* clock = nullptr; // receives the call's times if not null

    framebuffer_call(std::span<const draw_type> draws_, const grid& g, const Framebuffer& fb,
                     const voxelize_options& options, std::uint32_t num_primitives, const capacities& limits)
        : draws(draws_) {
        std::memset(static_cast<void*>(&plan), 0, sizeof(plan)); // padding is part of the key
        plan.g = g;
        plan.fb = fb;
        plan.options = options;
        plan.num_primitives = num_primitives;
        plan.limits = limits;
        if constexpr (possible.immediate) plan_immediate(draws, fb, num_primitives, options.count_voxels, plan.targets);
    }

    // Chooses the strategy, by the table or as forced. Returns false if a forced strategy cannot serve the call; then
    // nothing may be launched. may_list: there is memory for lists of fragments.
    [[nodiscard]] bool choose(strategy forced, bool may_list) {
        plan.rule = choose_rule(facts(may_list), forced);
        return plan.rule != nullptr;
    }
    [[nodiscard]] strategy chosen() const { return plan.rule->value; }
    // True if the call's memory grows with its fragments.
    [[nodiscard]] bool lists_fragments() const {
        return chosen() == strategy::sorted_reduce || chosen() == strategy::sorted_fold;
    }
    // Who draws deferred triangles, given that calls like this one deferred num_deferred. A wrong guess only costs
    // time: the deferred pass is left out by strategies that write no target before all triangles are drawn.
    [[nodiscard]] deferral deferral_for(std::uint64_t num_deferred) const {
        if (draws.size() != 1 || !defers_few(max_triangles(), num_deferred)) return deferral::by_pass;
        if (chosen() == strategy::immediate) return deferral::by_blocks_then_pass;
        if (lists_fragments()) return deferral::by_blocks;
        const bool is_one_pass = max_pass_triangles() == max_triangles(); // the state has the last pass's
        return chosen() == strategy::occupancy_mask && is_one_pass ? deferral::by_blocks : deferral::by_pass;
    }

    // Bytes of the workspace.
    [[nodiscard]] std::size_t plan_memory() const {
        arena memory;
        (void)memory.take<pipeline_state>(1);
        with_strategy([&]<class Strategy>() { Strategy(*this, memory); });
        return memory.used();
    }
    // Bytes at the start of the workspace that must be zero on entry. A finished call leaves them zero, except for the
    // state.
    [[nodiscard]] std::size_t zeroed_bytes() const {
        arena memory;
        (void)memory.take<pipeline_state>(1);
        if (chosen() == strategy::occupancy_mask) (void)memory.take<word>(mask_target::map::elements(plan.g.extent));
        return memory.used();
    }
    // Launches every kernel of the call. Anything that can make it fail is known before the first voxel is written.
    template <coverage Rule>
    void launch(arena& memory, cudaStream_t stream) const {
        pipeline_state* const state = memory.take<pipeline_state>(1);
        if (can_be_known(plan.fb) && !is_tracked()) // the log will not describe the targets any longer
            check(cudaMemsetAsync(plan.fb.changes, 0, core::change_log::header_words * sizeof(word), stream));
        with_strategy([&]<class Strategy>() { Strategy(*this, memory).template launch<Rule>(state, stream); });
    }
    // The stage that a failure is attributed to if it shows only at the end of the call.
    [[nodiscard]] stage last_stage() const {
        switch (chosen()) {
        case strategy::occupancy_mask:
            return stage::fine_raster;
        case strategy::immediate:
            return plan.targets.any_counted() ? stage::tile_resolve : stage::fine_raster;
        default:
            return groups::has_ordered ? stage::fine_raster : stage::tile_resolve;
        }
    }

    // Everything that the launches depend on, if it is trivially copyable.
    static constexpr bool has_bytes =
        std::is_trivially_copyable_v<draw_type> && std::is_trivially_copyable_v<Framebuffer>;
    template <coverage Rule>
    [[nodiscard]] call_bytes bytes(const void* workspace, const void* page) const {
        call_bytes b = bytes_of_call<framebuffer_call>(workspace, page);
        b.add(Rule);
        b.add(plan);
        for (const draw_type& d : draws) b.add(d);
        return b;
    }

    // ---- for the strategies -----------------------------------------------------------------------------------------

    // True if all that the call draws is marked in the framebuffer's log of changes. Tiles mark nothing.
    [[nodiscard]] bool is_tracked() const { return can_be_known(plan.fb) && chosen() != strategy::tiled; }
    // Tracking for strategies that know a drawn voxel's final value when they draw it.
    [[nodiscard]] tracking_type track() const {
        return {plan.fb, is_tracked(), [](const auto&, std::size_t) { return true; }};
    }
    [[nodiscard]] bool has_checked_indices() const {
        return std::all_of(draws.begin(), draws.end(), [](const draw_type& d) { return d.mesh.has_checked_indices(); });
    }
    // The size of the largest draw.
    [[nodiscard]] std::size_t max_triangles() const {
        std::size_t most = 0;
        for (const draw_type& d : draws) most = std::max<std::size_t>(most, d.mesh.num_triangles());
        return most;
    }
    // Triangles of a pass over some instances: fewer if their work items could not be numbered.
    [[nodiscard]] std::uint64_t pass_triangles() const {
        std::uint64_t most = tuning::max_pass_triangles;
        while (most > tuning::min_pass_triangles &&
               !is_listable(most, core::make_snap_transform(plan.g).fraction, plan.g.extent))
            most /= 2;
        return most;
    }
    // As max_triangles, of a pass (raster_each_draw).
    [[nodiscard]] std::size_t max_pass_triangles() const {
        std::size_t most = 0;
        for (const draw_type& d : draws)
            most = std::max<std::size_t>(most, d.mesh.triangles.size() * instances_of_pass(d.mesh, pass_triangles()));
        return most;
    }
    [[nodiscard]] std::size_t max_pass_vertices() const {
        std::size_t most = 0;
        for (const draw_type& d : draws)
            most = std::max<std::size_t>(most, d.mesh.positions.size() * instances_of_pass(d.mesh, pass_triangles()));
        return most;
    }
    // The raster shades vertices itself if that costs no more than reading them: once per corner instead of once per
    // vertex.
    static constexpr bool shades_in_raster =
        is_cheap<VertexShader> && std::is_empty_v<typename scene_buffers::varyings>;

    // The vertices that triangles of the raster's source may name.
    [[nodiscard]] static std::uint32_t num_source_vertices(const mesh_type& m) {
        return static_cast<std::uint32_t>(shades_in_raster ? m.positions.size() : m.num_vertices());
    }

    // Calls raster(draw, source, is_first) for each draw that has triangles.
    template <class Raster>
    void raster_draws(const vertex_positions& positions, pipeline_state* state, cudaStream_t stream,
                      const Raster& raster) const {
        raster_each_draw<shades_in_raster>(draws, core::make_snap_transform(plan.g), positions, state, clock, stream,
                                           raster, pass_triangles());
    }
    template <class Source>
    [[nodiscard]] raster_input<Source> raster_input_of(const draw_type& d, const Source& source) const {
        return {source, static_cast<std::uint32_t>(d.mesh.num_triangles()), core::make_snap_transform(plan.g).fraction,
                plan.g.extent};
    }
    void clear_targets(const tracking_type& tracking, const pipeline_state* state, cudaStream_t stream) const {
        clear_for(plan, chosen() == strategy::immediate, tracking, state, stream);
        end_stage(clock, &stage_times::clear);
    }

private:
    [[nodiscard]] call_facts facts(bool may_list) const {
        call_facts f;
        f.possible = possible;
        f.num_draws = draws.size();
        f.num_triangles = plan.num_primitives;
        f.num_voxels = num_voxels(plan.g);
        f.mask_bytes = mask_target::map::elements(plan.g.extent) * sizeof(word);
        f.fragment_capacity = plan.limits.fragments;
        f.fits_int32 = core::arms_of(plan.options.rule) == core::arm_set::none &&
                       is_listable(plan.num_primitives, core::make_snap_transform(plan.g).fraction, plan.g.extent);
        f.fits_in_passes = core::arms_of(plan.options.rule) == core::arm_set::none &&
                           is_listable(max_pass_triangles(), core::make_snap_transform(plan.g).fraction, plan.g.extent);
        if constexpr (core::is_constant<FragmentShader>) f.all_draws_equal = core::have_same_values(draws);
        f.blends_in_place = possible.immediate && plan.targets.possible;
        f.counts_are_cheap = plan.targets.is_cheap;
        f.counts_voxels = plan.options.count_voxels;
        f.clears_values = device::clears_values(plan.fb);
        f.has_checked_indices = has_checked_indices();
        f.may_list = may_list;
        return f;
    }

    // Calls f with the type of the chosen strategy. Only strategies that the program's types allow are instantiated.
    template <class F>
    void with_strategy(const F& f) const {
        switch (chosen()) {
        case strategy::occupancy_mask:
            if constexpr (possible.occupancy_mask) f.template operator()<mask_strategy<framebuffer_call>>();
            break;
        case strategy::immediate:
            if constexpr (possible.immediate) f.template operator()<immediate_strategy<framebuffer_call>>();
            break;
        case strategy::sorted_reduce:
            if constexpr (possible.sorted_reduce) f.template operator()<reduce_strategy<framebuffer_call>>();
            break;
        case strategy::sorted_fold:
            if constexpr (possible.sorted_fold) f.template operator()<fold_strategy<framebuffer_call>>();
            break;
        case strategy::automatic:
        case strategy::tiled:
            // 32-bit voxel ids, if the grid allows them, keep the lists of ordered targets small.
            if (!groups::has_ordered || num_voxels(plan.g) < max_listed_voxels)
                f.template operator()<tiled_strategy<framebuffer_call, std::uint32_t>>();
            else if constexpr (groups::has_ordered)
                f.template operator()<tiled_strategy<framebuffer_call, std::uint64_t>>();
        }
    }
};

// Calls f with a call whose policy the selector picks for the current device.
template <class Selector, class Draw, class Framebuffer, class F>
auto with_framebuffer_call(std::span<const Draw> draws, const grid& g, const Framebuffer& fb,
                           const voxelize_options& options, std::uint64_t triangles, const capacities& limits,
                           const F& f) {
    return tuning::with_policy<Selector, target_groups<Framebuffer>::max_bits()>(
        compute_capability(), [&]<tuning::fine_raster_policy Policy>() {
            return f(framebuffer_call<Draw, Framebuffer, Policy>(draws, g, fb, options,
                                                                 static_cast<std::uint32_t>(triangles), limits));
        });
}

} // namespace voxelpipe::device
