// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Host side of an A-buffer call, like call/framebuffer_call.cuh: the memory of its stages, and their launches.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/call/graph_cache.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/fragments/list_sink.cuh>
#include <voxelpipe/device/fragments/segmented_reduce.cuh>
#include <voxelpipe/device/fragments/shade_lists.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>

#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe::device {

template <class Draw, class Payload>
struct abuffer_call;
template <class Mesh, class VertexShader, class FragmentShader, class Payload>
struct abuffer_call<draw<Mesh, VertexShader, FragmentShader>, Payload> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    using scene_buffers = scene_memory<Mesh, VertexShader, FragmentShader>;
    using scene_type = typename scene_buffers::scene_type;

    std::span<const draw_type> draws;
    grid g;
    std::uint32_t num_primitives;
    capacities limits;
    stage_clock* clock = nullptr;
    // may_shade_late: fragments may be shaded in the finished lists; if any is discarded then, the lists are not the
    // result. filters: they are also shaded before the sort, to remove discarded ones.
    bool may_shade_late = false, filters = false;
    bool has_few_a_voxel = false;             // fragments; see min_counted
    core::arm_set arms = core::arm_set::none; // if any, launched as conservative coverage
    bool has_outputs = false;                 // every launch has output pointers, so payloads need no room beside them

    // Everything that this call's launches depend on, if it is trivially copyable.
    static constexpr bool has_bytes = std::is_trivially_copyable_v<draw_type>;
    template <coverage Rule, class Key>
    [[nodiscard]] call_bytes bytes(const void* workspace, const void* page) const {
        call_bytes b = bytes_of_call<abuffer_call, Key>(workspace, page);
        b.add(Rule);
        for (const draw_type& d : draws) b.add(d);
        b.add(g);
        b.add(num_primitives);
        b.add(limits);
        b.add(may_shade_late);
        b.add(filters);
        b.add(has_few_a_voxel);
        b.add(arms);
        return b;
    }
    // True if the raster lists the fragments, and a shader that is not constant runs afterwards.
    template <class Key>
    [[nodiscard]] bool is_listed_call() const {
        return sizeof(Key) == sizeof(std::uint32_t) && arms == core::arm_set::none &&
               (core::is_constant<FragmentShader> || may_shade_late) && draws.size() == 1 &&
               is_listable(num_primitives, core::make_snap_transform(g).fraction, g.extent);
    }
    // See framebuffer_call.
    // Given that calls like this one deferred num_deferred triangles.
    [[nodiscard]] deferral deferral_for(std::uint64_t num_deferred) const {
        return defers_few(num_primitives, num_deferred) ? deferral::by_blocks : deferral::by_pass;
    }
    template <class Key>
    [[nodiscard]] bool shades_late() const {
        return !core::is_constant<FragmentShader> && is_listed_call<Key>();
    }

    // Takes the call's memory from an arena.
    template <class Key>
    void plan_memory(arena& memory) const {
        (void)memory.take<pipeline_state>(1);
        with_lists<Key>([&]<class Lists>() { Lists(*this, memory); });
    }
    // Launches the stages up to the sorted lists, which may already be at the output pointers `outputs`
    // (are_at_output): these have room for limits.fragments primitives. The state comes first in the memory and must be
    // zero on entry.
    template <coverage Rule, class Key>
    [[nodiscard]] fragment_lists<Key, Payload> launch(arena& memory, cudaStream_t stream,
                                                      const output_pointers& outputs = {}) const {
        pipeline_state* const state = memory.take<pipeline_state>(1);
        fragment_lists<Key, Payload> sorted{};
        with_lists<Key>(
            [&]<class Lists>() { sorted = Lists(*this, memory).template launch<Rule>(state, stream, outputs); });
        return sorted;
    }

private:
    // True if fragments may be sorted by counting: no voxel is known to have more fragments than atomics serve well,
    // nor do all have too few for counting to gain.
    [[nodiscard]] bool may_count() const {
        return !has_few_a_voxel && (limits.longest_ordered <= tuning::max_of_block || limits.longest_ordered == ~0ull);
    }

    // Fragments are counted, get offsets from a scan, and are written by ascending primitive. Serves any number of
    // draws, voxels and triangles.
    template <class Key>
    struct counted_lists {
        const abuffer_call& call;
        list_buffers<Key, Payload> lists;
        scene_buffers buffers;
        list_memory list_scratch;

        counted_lists(const abuffer_call& c, arena& memory)
            : call(c), lists(take_lists<Key, Payload>(memory, num_voxels(c.g), c.limits.fragments)),
              buffers(memory, c.draws), list_scratch(memory, c.num_primitives, c.limits.fragment_records) {}
        template <coverage Rule>
        [[nodiscard]] fragment_lists<Key, Payload> launch(pipeline_state* state, cudaStream_t stream,
                                                          const output_pointers& outputs) const {
            const scene_type s = buffers.shade(call.draws, call.g, stream, call.arms);
            end_stage(call.clock, &stage_times::vertex_shade);
            return build_lists<Rule, first_value>(s, lists, list_scratch.with(state), state, call.limits, true, stream,
                                                  call.clock, outputs);
        }
    };

    // The raster lists the fragments of one draw with a constant shader, in any order.
    struct constant_lists {
        static constexpr bool shades_in_raster =
            is_cheap<VertexShader> && std::is_empty_v<typename scene_buffers::varyings>;
        const abuffer_call& call;
        list_buffers<std::uint32_t, Payload> lists;
        vertex_positions positions;
        deferred_triangles deferred;
        order_memory order;

        constant_lists(const abuffer_call& c, arena& memory)
            : call(c), lists(take_lists<std::uint32_t, Payload>(memory, num_voxels(c.g), c.limits.fragments, true,
                                                                c.may_count())),
              positions(vertex_positions::take(memory, shades_in_raster ? 0 : c.draws[0].mesh.num_vertices())),
              deferred(deferred_triangles::take(memory, c.num_primitives)),
              order(order_memory::take(memory, c.limits.fragments)) {}
        template <coverage Rule>
        [[nodiscard]] fragment_lists<std::uint32_t, Payload> launch(pipeline_state* state, cudaStream_t stream,
                                                                    const output_pointers& outputs) const {
            const draw_type& d = call.draws[0];
            const core::snap_transform snap = core::make_snap_transform(call.g);
            const auto num_vertices =
                static_cast<std::uint32_t>(shades_in_raster ? d.mesh.positions.size() : d.mesh.num_vertices());
            const auto raster = [&](const auto& source) {
                const raster_input<std::remove_cvref_t<decltype(source)>> in{source, call.num_primitives, snap.fraction,
                                                                             call.g.extent};
                list_raster<Rule>(in, num_vertices, 0, deferred.with(state), lists.keys[0], lists.values[0],
                                  prepare_lists(lists, outputs, order.tiles, call.limits), state, call.limits, stream);
            };
            if constexpr (shades_in_raster) {
                raster(shading_source<Mesh, VertexShader>{d.mesh, d.vertex_shader, snap, 0});
            } else {
                vertex_shade(d.mesh, d.vertex_shader, snap, 0, positions, static_cast<no_varyings*>(nullptr), stream);
                end_stage(call.clock, &stage_times::vertex_shade);
                raster(stored_source{geometry_from(d.mesh, positions, 0)});
            }
            end_stage(call.clock, &stage_times::fine_raster);
            fragment_lists<std::uint32_t, Payload> sorted = sort_unordered(
                lists, order, outputs, call.num_primitives, nullptr, state, call.limits, stream, call.clock);
            if constexpr (!std::is_same_v<Payload, no_payload>)
                sorted.payload = voxelpipe::get<0>(d.fragment_shader.values);
            return sorted;
        }
    };

    // The lists of one draw with any other shader, which runs on the sorted lists; with `filters`, also before the
    // sort.
    struct shaded_lists {
        static constexpr bool has_payload = !std::is_same_v<Payload, no_payload>;
        const abuffer_call& call;
        list_buffers<std::uint32_t, Payload> lists;
        scene_buffers buffers;
        deferred_triangles deferred;
        order_memory order;
        std::uint32_t* spare;
        Payload* payloads;

        shaded_lists(const abuffer_call& c, arena& memory)
            : call(c), lists(take_lists<std::uint32_t, Payload>(memory, num_voxels(c.g), c.limits.fragments, true)),
              buffers(memory, c.draws), deferred(deferred_triangles::take(memory, c.num_primitives)),
              order(order_memory::take(memory, c.limits.fragments)),
              spare(memory.take<std::uint32_t>(c.limits.fragments)),
              payloads(memory.take<Payload>(has_payload && !c.has_outputs ? c.limits.fragments : 0)) {}
        template <coverage Rule>
        [[nodiscard]] fragment_lists<std::uint32_t, Payload> launch(pipeline_state* state, cudaStream_t stream,
                                                                    const output_pointers& outputs) {
            const capacities& limits = call.limits;
            const scene_type s = buffers.shade(call.draws, call.g, stream);
            end_stage(call.clock, &stage_times::vertex_shade);
            const raster_input<stored_source> in{{s.geo.one}, call.num_primitives, s.geo.snap.fraction, call.g.extent};
            list_raster<Rule>(in, s.geo.one.num_vertices, 0, deferred.with(state), lists.keys[0], lists.values[0],
                              prepare_lists(lists, outputs, order.tiles, limits), state, limits, stream);
            if (call.filters) filter_lists(s, lists, state, limits, stream);
            end_stage(call.clock, &stage_times::fine_raster);
            fragment_lists<std::uint32_t, Payload> sorted =
                sort_unordered(lists, order, outputs, call.num_primitives, spare, state, limits, stream, call.clock);
            if (!call.filters || has_payload) {
                launch_behind(shade_lists_kernel<first_value, scene_type, Payload>, fill_device(limits.fragments),
                              threads_per_block, stream, stage::abuffer_emit, s, sorted, payloads, state, limits);
                end_stage(call.clock, &stage_times::abuffer_emit);
            }
            sorted.payloads = has_payload ? payloads : nullptr;
            sorted.payloads_in_order = true;
            sorted.are_payloads_at_output = has_payload && sorted.are_at_output;
            return sorted;
        }
    };

    template <class Key, class F>
    void with_lists(const F& f) const {
        if constexpr (sizeof(Key) == sizeof(std::uint32_t)) {
            if (is_listed_call<Key>()) {
                using listed = std::conditional_t<core::is_constant<FragmentShader>, constant_lists, shaded_lists>;
                f.template operator()<listed>();
                return;
            }
        }
        f.template operator()<counted_lists<Key>>();
    }
};

} // namespace voxelpipe::device
