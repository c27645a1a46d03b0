// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Host side of a framebuffer call: which targets go through which path, what memory that takes (plan), and the launch
// of every stage on one stream, without a wait (launch). The same plan serves voxelize, which reads the state once at
// the end, and voxelize_async, which leaves it on the device.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/call/graph_cache.cuh>
#include <voxelpipe/device/call/immediate_plan.cuh>
#include <voxelpipe/device/fragments/fold.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/fragments/segmented_reduce.cuh>
#include <voxelpipe/device/raster/mask_sink.cuh>
#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/device/scene/check_indices.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/device/targets/clear_target.cuh>
#include <voxelpipe/device/targets/fill_from_mask.cuh>
#include <voxelpipe/device/targets/finalize_counts.cuh>
#include <voxelpipe/device/tiles/tile_passes.cuh>

#include <algorithm>
#include <cstdint>
#include <span>

namespace voxelpipe::device {

// Whether a constant shader and its targets need no tiles.
template <class FragmentShader, class Framebuffer>
inline constexpr bool can_draw_immediately = false;
template <class FragmentShader, class... Targets>
inline constexpr bool
    can_draw_immediately<FragmentShader, framebuffer_view<Targets...>> = core::is_constant<FragmentShader> &&
                                                                         (is_immediate<Targets>() && ...);

inline constexpr std::size_t max_immediate_draws = 16; // each has launches of its own

template <class Draw, class Framebuffer, tuning::fine_raster_policy Policy>
struct framebuffer_call;
template <class Mesh, class VertexShader, class FragmentShader, class Framebuffer, tuning::fine_raster_policy Policy>
struct framebuffer_call<draw<Mesh, VertexShader, FragmentShader>, Framebuffer, Policy> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    using scene_buffers = scene_memory<Mesh, VertexShader, FragmentShader>;
    using scene_type = typename scene_buffers::scene_type;
    using groups = target_groups<Framebuffer>;
    using values = decltype(std::declval<typename scene_type::fragment_output>().values);
    static constexpr bool in_tiles = groups::num_groups() > 0;
    static constexpr bool can_be_listed = is_resolvable<Framebuffer> || groups::has_ordered;
    using tracking_type = change_tracking<Framebuffer>;

    std::span<const draw_type> draws;
    grid g;
    Framebuffer fb;
    voxelize_options options;
    std::uint32_t num_primitives;
    capacities limits;
    bool may_list = false; // fragments, where limits.fragments holds them
    core::tile_grid tiles{g.extent, Policy.log2_tile_size};
    stage_clock* clock = nullptr; // where the call is asked for its times

    // Carves the memory and, with Run, launches every stage. Whatever can fail is known before the first voxel is
    // written. The state comes first in the memory, whose first zeroed_bytes() are zeroed before.
    template <coverage Rule, bool Run>
    void go(arena& memory, cudaStream_t stream) const {
        pipeline_state* const state = memory.take<pipeline_state>(1);
        if constexpr (Run)
            if (can_be_known(fb) && !is_tracked_call())
                check(cudaMemsetAsync(fb.changes, 0, core::change_log::header_words * sizeof(word), stream));
        if constexpr (can_use_mask) {
            if (uses_mask()) {
                launch_mask<Rule, Run>(memory, state, stream);
                return;
            }
        }
        if constexpr (can_draw_immediately<FragmentShader, Framebuffer>) {
            if (is_immediate_call()) {
                launch_immediate<Rule, Run>(memory, state, stream);
                return;
            }
        }
        if constexpr (can_be_listed) {
            if (is_listed_call()) {
                if constexpr (groups::has_ordered)
                    launch_folded<Rule, Run>(memory, state, stream);
                else
                    launch_listed<Rule, Run>(memory, state, stream);
                return;
            }
        }
        // Voxel ids of 32 bits keep the lists of the ordered targets small wherever the grid allows.
        if (!groups::has_ordered || num_voxels(g) < std::numeric_limits<std::uint32_t>::max())
            launch_tiles<Rule, Run, std::uint32_t>(memory, state, stream);
        else if constexpr (groups::has_ordered)
            launch_tiles<Rule, Run, std::uint64_t>(memory, state, stream);
    }

    // All that the launches of this call depend on, where it is plain bytes.
    static constexpr bool has_bytes =
        std::is_trivially_copyable_v<draw_type> && std::is_trivially_copyable_v<Framebuffer>;
    template <coverage Rule>
    [[nodiscard]] call_bytes bytes(const void* workspace, const void* page) const {
        call_bytes b = bytes_of_call<framebuffer_call>(workspace, page);
        b.add(Rule);
        for (const draw_type& d : draws) b.add(d);
        b.add(g);
        b.add(fb);
        b.add(options);
        b.add(num_primitives);
        b.add(limits);
        b.add(may_list);
        return b;
    }
    // Of the memory, from its start: zeroed before, and, but for the state, by a call that has run.
    [[nodiscard]] std::size_t zeroed_bytes() const {
        arena memory;
        (void)memory.take<pipeline_state>(1);
        if (uses_mask()) (void)memory.take<word>(mask_target::map::elements(g.extent));
        return memory.used();
    }
    // Whether the call lists its fragments: its memory grows with them.
    [[nodiscard]] bool is_listed_call() const {
        if (uses_mask()) return false;
        if constexpr (can_draw_immediately<FragmentShader, Framebuffer>)
            if (is_immediate_call()) return false;
        if (!can_be_listed || !may_list || draws.size() > max_immediate_draws) return false;
        if (num_voxels(g) >= std::numeric_limits<std::uint32_t>::max() || limits.fragments > max_resolved) return false;
        return is_listable(num_primitives, core::make_snap_transform(g).fraction, g.extent);
    }

    // Of this call: what a failure that shows only at its end is put down to.
    [[nodiscard]] stage last_stage() const {
        if (uses_mask()) return stage::fine_raster;
        if constexpr (can_draw_immediately<FragmentShader, Framebuffer>) {
            if (is_immediate_call())
                return plan_immediate(draws, fb, num_primitives, options.count_voxels).any_counted()
                           ? stage::tile_resolve
                           : stage::fine_raster;
        }
        return groups::has_ordered ? stage::fine_raster : stage::tile_resolve;
    }

    // Whether limits.skips_deferred_pass may hold, where calls like this one num_deferred so many triangles: it can be
    // made once more, since it writes nothing where that was wrong, or clears all that it draws into.
    [[nodiscard]] bool can_skip_deferred_pass(std::uint64_t left) const {
        if (draws.size() != 1 || !leaves_few(max_triangles(), left)) return false;
        if (uses_mask() || is_listed_call()) return true;
        if constexpr (can_draw_immediately<FragmentShader, Framebuffer>)
            // Sums' first kernel (raster/block_pass.cuh) draws nothing at its end for the second.
            return is_immediate_call() && clears_all_in_use(fb) && (has_only_bits<Framebuffer> || left == 0);
        return false;
    }

private:
    static constexpr bool can_use_mask = core::is_constant<FragmentShader> && depends_on_mask<Framebuffer>;
    [[nodiscard]] bool uses_mask() const {
        if (!can_use_mask || draws.size() > max_immediate_draws || !have_one_value() ||
            !is_listable(num_primitives, core::make_snap_transform(g).fraction, g.extent))
            return false;
        const std::uint64_t bytes = mask_target::map::elements(g.extent) * sizeof(word);
        bool can_be_immediate = false;
        if constexpr (can_draw_immediately<FragmentShader, Framebuffer>)
            can_be_immediate = plan_immediate(draws, fb, num_primitives, options.count_voxels).possible;
        if (!can_be_immediate) return bytes <= max_mask_bytes;
        if (bytes > max_mask_bytes_of_immediate) return false;
        return options.count_voxels || clears_values(fb) ||
               (!have_checked_indices() && bytes <= min_mask_bytes + num_primitives * mask_bytes_per_triangle);
    }
    // Whether no call need look at any draw's indices.
    [[nodiscard]] bool have_checked_indices() const {
        for (const draw_type& d : draws)
            if (!d.mesh.has_checked_indices()) return false;
        return true;
    }
    // Whether all draws give the same bytes.
    [[nodiscard]] bool have_one_value() const {
        if constexpr (core::is_constant<FragmentShader>) {
            const auto& first = draws[0].fragment_shader.values;
            for (const draw_type& d : draws)
                if (std::memcmp(&first, &d.fragment_shader.values, sizeof(first)) != 0) return false;
        }
        return true;
    }
    [[nodiscard]] bool is_immediate_call() const {
        if (draws.size() > max_immediate_draws ||
            !is_listable(num_primitives, core::make_snap_transform(g).fraction, g.extent))
            return false;
        return plan_immediate(draws, fb, num_primitives, options.count_voxels).possible;
    }

    // Whether all that the call draws is marked, since the framebuffer tracks its changes.
    [[nodiscard]] bool is_tracked_call() const {
        if (!can_be_known(fb)) return false;
        if constexpr (can_draw_immediately<FragmentShader, Framebuffer>)
            if (is_immediate_call()) return true;
        return uses_mask() || is_listed_call();
    }
    // Of calls that know what a voxel ends with when it is drawn.
    [[nodiscard]] tracking_type track() const {
        return {fb, is_tracked_call(), [](const auto&, std::size_t) { return true; }};
    }

    // Vertices are shaded by the raster itself where that costs nothing.
    static constexpr bool on_the_spot = is_cheap<VertexShader> && std::is_empty_v<typename scene_buffers::varyings>;

    template <coverage Rule, bool Run>
    void launch_mask(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        word* const touched = memory.take<word>(mask_target::map::elements(g.extent));
        const vertex_positions positions = vertex_positions::take(memory, on_the_spot ? 0 : max_vertices());
        const deferred_triangles deferred = deferred_triangles::take(memory, max_triangles());
        if constexpr (Run) {
            const core::snap_transform snap = core::make_snap_transform(g);
            for (std::size_t i = 0; i < draws.size(); ++i) {
                const draw_type& d = draws[i];
                const auto num_triangles = static_cast<std::uint32_t>(d.mesh.triangles.size());
                const auto num_vertices = static_cast<std::uint32_t>(d.mesh.positions.size());
                if (num_triangles == 0) continue;
                if (i != 0) check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
                const auto raster = [&](const auto& source) {
                    using source_type = std::remove_cvref_t<decltype(source)>;
                    const raster_call<Rule, source_type, mask_output> call{
                        {source, num_triangles, snap.fraction, g.extent},
                        {touched, g.extent, num_vertices, state, false},
                        deferred.with(state)};
                    launch_raster(call, state, stage::fine_raster, stream, on_the_spot && i == 0,
                                  limits.skips_deferred_pass != 0);
                    end_stage(clock, &stage_times::fine_raster);
                };
                raster_draw(d, static_cast<std::uint32_t>(i), snap, positions, stream, raster);
            }
            fill_from_mask(touched, fb, track(), draws[0].fragment_shader.values, options.count_voxels, state, limits,
                           stream);
            end_stage(clock, &stage_times::tile_resolve);
        }
    }

    // raster(source), with vertices that are shaded there, or before.
    template <class Raster>
    void raster_draw(const draw_type& d, std::uint32_t number, const core::snap_transform& snap,
                     const vertex_positions& positions, cudaStream_t stream, const Raster& raster) const {
        if constexpr (on_the_spot) {
            raster(shading_source<Mesh, VertexShader>{d.mesh, d.vertex_shader, snap, number});
        } else {
            vertex_shade(d.mesh, d.vertex_shader, snap, number, positions, static_cast<no_varyings*>(nullptr),
                         stream); // nobody reads them
            end_stage(clock, &stage_times::vertex_shade);
            raster(stored_source{
                {d.mesh.triangles.data(), positions, 0, static_cast<std::uint32_t>(d.mesh.positions.size())}});
        }
    }

    template <coverage Rule, bool Run>
    void launch_immediate(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        const auto plan = plan_immediate(draws, fb, num_primitives, options.count_voxels);
        bool has_marks = false; // of this call alone
        core::for_each_index<groups::count>([&]<std::size_t K>() {
            has_marks = has_marks || (plan.counts(K) && ends_by_marks(voxelpipe::get<K>(fb.targets)));
        });
        const tracking_type tracking(fb, is_tracked_call(),
                                     [&](const auto& t, std::size_t k) { return !plan.counts(k) || ends_by_marks(t); });
        chunk_marks marks = tracking.marks();
        const bool is_tracked = marks.words != nullptr; // those hold what the call's own would, and more
        has_marks = has_marks && !is_tracked;
        if (has_marks) marks = chunk_marks::take(memory, g.extent);
        const vertex_positions positions = vertex_positions::take(memory, on_the_spot ? 0 : max_vertices());
        const deferred_triangles deferred = deferred_triangles::take(memory, max_triangles());
        if constexpr (Run) {
            if (has_marks) check(cudaMemsetAsync(marks.words, 0, marks.rows.num_words() * sizeof(word), stream));
            for (const draw_type& d : draws)
                if (!d.mesh.has_checked_indices())
                    check_indices(d.mesh.triangles.data(), d.mesh.triangles.size(), d.mesh.positions.size(), state,
                                  stream);
            if (!have_checked_indices()) end_stage(clock, &stage_times::coarse_raster);
            core::for_each_index<groups::count>([&]<std::size_t K>() {
                auto t = voxelpipe::get<K>(fb.targets);
                if (plan.counts(K)) t.clear_value = {}; // no fragments
                if (t.load == load_operation::clear && !tracking.by_chunks[K]) clear_target(t, state, limits, stream);
            });
            clear_by_chunks(tracking, fb, state, limits, stream);
            end_stage(clock, &stage_times::clear);
            const core::snap_transform snap = core::make_snap_transform(g);
            for (std::size_t i = 0; i < draws.size(); ++i) {
                const draw_type& d = draws[i];
                const auto num_triangles = static_cast<std::uint32_t>(d.mesh.triangles.size());
                if (num_triangles == 0) continue;
                if (i != 0) check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
                const auto raster = [&](const auto& source) {
                    using source_type = std::remove_cvref_t<decltype(source)>;
                    using values_type = decltype(d.fragment_shader.values);
                    const auto draw_into = [&](const auto& output) {
                        const raster_call<Rule, source_type, std::remove_cvref_t<decltype(output)>> call{
                            {source, num_triangles, snap.fraction, g.extent}, output, deferred.with(state)};
                        // Without a check and a clear these may be the first kernels, but then nobody writes to
                        // the indices (mesh_view::checked).
                        launch_raster(call, state, stage::fine_raster, stream, false, limits.skips_deferred_pass != 0);
                        end_stage(clock, &stage_times::fine_raster);
                    };
                    // The kernels that know that they only set bits.
                    if constexpr (is_mask_itself<Framebuffer>) {
                        const auto& t = voxelpipe::get<0>(fb.targets);
                        if (plan.modes.of[0] == immediate_mode::blend && t.load != load_operation::off &&
                            voxelpipe::get<0>(d.fragment_shader.values)) {
                            draw_into(mask_output{t.elements, g.extent,
                                                  static_cast<std::uint32_t>(d.mesh.positions.size()), state, true});
                            return;
                        }
                    }
                    const framebuffer_output<Framebuffer, values_type> output{fb, d.fragment_shader.values, plan.modes,
                                                                              marks};
                    if constexpr (has_only_values<Framebuffer>) {
                        if (plan.only_blends() && all_in_use(fb)) {
                            if (is_tracked)
                                draw_into(blended_output<Framebuffer, values_type, true>{output});
                            else
                                draw_into(blended_output<Framebuffer, values_type, false>{output});
                            return;
                        }
                    }
                    draw_into(output);
                };
                raster_draw(d, static_cast<std::uint32_t>(i), snap, positions, stream, raster);
            }
            if (plan.has_last_pass()) {
                finalize_counts(plan, fb, draws[0].fragment_shader.values, marks, state, limits, stream);
                end_stage(clock, &stage_times::tile_resolve);
            }
        }
    }

    // Appends the fragments of all draws to two arrays.
    template <coverage Rule>
    void list_draws(const scene_type& s, const vertex_positions& positions, const deferred_triangles& deferred,
                    std::uint32_t* voxels, std::uint32_t* primitives, sort_preparation preparation,
                    pipeline_state* state, cudaStream_t stream) const {
        draw_geometry of_draw{draws[0].mesh.triangles.data(), positions, 0, 0};
        for (const draw_type& d : draws) {
            const auto num_triangles = static_cast<std::uint32_t>(d.mesh.triangles.size());
            of_draw.triangles = d.mesh.triangles.data();
            of_draw.num_vertices = static_cast<std::uint32_t>(d.mesh.positions.size());
            if (num_triangles != 0) {
                if (of_draw.first_primitive != 0)
                    check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
                const raster_input<stored_source> in{{of_draw}, num_triangles, s.geo.snap.fraction, g.extent};
                list_raster<Rule>(in, of_draw.num_vertices, of_draw.first_primitive, deferred.with(state), voxels,
                                  primitives, preparation, state, limits, stream);
                preparation.is_wanted = false;
            }
            of_draw.positions = of_draw.positions.from(of_draw.num_vertices);
            of_draw.first_primitive += num_triangles;
        }
    }
    // Of a draw.
    [[nodiscard]] std::size_t max_triangles() const {
        std::size_t most = 0;
        for (const draw_type& d : draws) most = std::max(most, d.mesh.triangles.size());
        return most;
    }
    [[nodiscard]] std::size_t max_vertices() const {
        std::size_t most = 0;
        for (const draw_type& d : draws) most = std::max(most, d.mesh.positions.size());
        return most;
    }

    template <coverage Rule, bool Run>
    void launch_listed(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        using ends_type = run_ends<voxel_cells<Framebuffer>>;
        const scene_buffers buffers(memory, draws);
        const sort_pairs pairs = sort_pairs::take(memory, limits.fragments);
        const sort_memory sort =
            sort_memory::take(memory, limits.fragments, static_cast<int>(std::bit_width(num_voxels(g) - 1)));
        const deferred_triangles deferred = deferred_triangles::take(memory, max_triangles());
        const ends_type ends = ends_type::take(memory, limits.fragments);
        if constexpr (Run) {
            const scene_type s = buffers.shade(draws, g, stream);
            end_stage(clock, &stage_times::vertex_shade);
            sort_preparation preparation;
            preparation.is_wanted = preparation.sorts = true;
            preparation.sort = sort;
            preparation.capacity = limits.fragments;
            list_draws<Rule>(s, buffers.positions, deferred, pairs.keys[0], pairs.values[0], preparation, state,
                             stream);
            end_stage(clock, &stage_times::fine_raster);
            const int at = sort_fragments(pairs, sort_count{state, limits}, limits.fragments, sort, stream);
            end_stage(clock, &stage_times::tile_sort);
            const tracking_type tracking = track();
            clear_targets(tracking, state, stream);
            mark_voxels(tracking, pairs.keys[at], &state->list_fragments, limits.fragments, state, limits, stream);
            resolve_fragments(s, fb, {pairs.keys[at], pairs.values[at]}, ends, options.count_voxels, state, limits,
                              stream);
            end_stage(clock, &stage_times::tile_resolve);
        }
    }

    // The same for blends that need an order: lists that are in it are folded.
    template <coverage Rule, bool Run>
    void launch_folded(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        auto lists = take_lists<std::uint32_t, values>(memory, num_voxels(g), limits.fragments, true);
        const scene_buffers buffers(memory, draws);
        const deferred_triangles deferred = deferred_triangles::take(memory, max_triangles());
        const order_memory order = order_memory::take(memory, limits.fragments);
        auto* const spare = memory.take<std::uint32_t>(limits.fragments);
        auto* const payloads = memory.take<values>(limits.fragments);
        if constexpr (Run) {
            const scene_type s = buffers.shade(draws, g, stream);
            end_stage(clock, &stage_times::vertex_shade);
            list_draws<Rule>(s, buffers.positions, deferred, lists.keys[0], lists.values[0],
                             prepare_lists(lists, {}, order.tiles, limits), state, stream);
            filter_lists(s, lists, state, limits, stream);
            end_stage(clock, &stage_times::fine_raster);
            fragment_lists<std::uint32_t, values> sorted =
                sort_unordered(lists, order, {}, num_primitives, spare, state, limits, stream, clock);
            launch_behind(shade_lists_kernel<all_values, scene_type, values>, fill_device(limits.fragments),
                          threads_per_block, stream, stage::abuffer_emit, s, sorted, payloads, state, limits);
            end_stage(clock, &stage_times::abuffer_emit);
            sorted.payloads = payloads;
            sorted.payloads_in_order = true;
            const tracking_type tracking = track();
            clear_targets(tracking, state, stream);
            mark_voxels(tracking, sorted.voxels, &state->list_voxels, limits.fragments, state, limits, stream);
            fold_lists(sorted, fb, options.count_voxels, state, limits, std::make_index_sequence<groups::count>{},
                       stream, clock);
        }
    }

    void clear_targets(const tracking_type& tracking, const pipeline_state* state, cudaStream_t stream) const {
        core::for_each_index<groups::count>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(fb.targets);
            if (t.load == load_operation::clear && !tracking.by_chunks[K]) clear_target(t, state, limits, stream);
        });
        clear_by_chunks(tracking, fb, state, limits, stream);
        end_stage(clock, &stage_times::clear);
    }

    template <coverage Rule, bool Run, class Key>
    void launch_tiles(arena& memory, pipeline_state* state, cudaStream_t stream) const {
        const scene_buffers buffers(memory, draws);
        scene_type s{};
        if constexpr (Run) {
            s = buffers.shade(draws, g, stream);
            end_stage(clock, &stage_times::vertex_shade);
        }
        tile_work work;
        if constexpr (in_tiles) {
            const tile_memory m(memory, tiles, num_primitives, limits,
                                max_image_words<Policy.log2_tile_size, Framebuffer>(),
                                default_pairs_per_item(limits.tile_pairs));
            if constexpr (Run) work = coarse_pass<Rule>(s.geo, m, state, limits, stream, clock);
        }
        fragment_lists<Key, values> lists{};
        if constexpr (groups::has_ordered) lists = list_fragments<Rule, Run, Key>(memory, s, state, stream);
        if constexpr (Run) {
            clear_targets({}, state, stream);
            // Fragments and voxels are counted once: by the lists, where there are any.
            if constexpr (in_tiles)
                fine_pass<Rule, Policy>(s, fb, work,
                                        {!groups::has_ordered, !groups::has_ordered && options.count_voxels}, state,
                                        limits, stream, clock);
            if constexpr (groups::has_ordered)
                fold_ordered(lists, fb, options.count_voxels, state, limits, stream, clock);
        }
    }

    template <coverage Rule, bool Run, class Key>
    [[nodiscard]] fragment_lists<Key, values> list_fragments(arena& memory, const scene_type& s, pipeline_state* state,
                                                             cudaStream_t stream) const {
        const auto lists = take_lists<Key, values>(memory, num_voxels(g), limits.fragments);
        const list_memory share(memory, num_primitives, limits.fragment_records);
        if constexpr (Run)
            return build_lists<Rule, all_values>(s, lists, share.with(state), state, limits, !in_tiles, stream, clock);
        else
            return {};
    }
};

// Calls f with the call whose policy is the selector's for the current device.
template <class Selector, class Draw, class Framebuffer, class F>
auto with_framebuffer_call(std::span<const Draw> draws, const grid& g, const Framebuffer& fb,
                           const voxelize_options& options, std::uint64_t triangles, const capacities& limits,
                           const F& f) {
    return tuning::with_policy<Selector, target_groups<Framebuffer>::max_bits()>(
        compute_capability(), [&]<tuning::fine_raster_policy Policy>() {
            return f(framebuffer_call<Draw, Framebuffer, Policy>{draws, g, fb, options,
                                                                 static_cast<std::uint32_t>(triangles), limits});
        });
}

} // namespace voxelpipe::device
