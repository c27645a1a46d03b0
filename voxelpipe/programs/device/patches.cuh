// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A tessellation of one mesh, with a constant shader, straight into targets that are blended or counted where they lie.
// The program makes the points of its patches once. Triangles are not stored: the raster makes a triangle's indices of
// its number, from the patch that each 32 triangles begin in (patch_batch). Compiled by programs that draw a
// tessellation with such a shader into such targets.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/call/immediate_strategy.cuh>
#include <voxelpipe/programs/device/program_arrays.cuh>
#include <voxelpipe/programs/program_call.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <tuple>
#include <type_traits>
#include <vector>

namespace voxelpipe {
namespace device {

// The triangles of a tessellation by their numbers, for the rasters without tiles.
struct patch_source {
    const core::passes::patch_batch* batches; // of triangles
    const std::uint64_t *first_triangle, *first_point;
    const std::uint32_t* levels;
    std::uint32_t num_patches;
    std::uint32_t left_out; // a vertex outside of the grid
    const glm::vec3* positions;
    core::snap_transform snap;

    using loaded = glm::vec3;
    using stored = glm::vec3;
    [[nodiscard]] __device__ VOXELPIPE_INLINE loaded load(std::uint32_t vertex) const { return positions[vertex]; }
    [[nodiscard]] __device__ VOXELPIPE_INLINE const stored* address(std::uint32_t vertex) const {
        return positions + vertex;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static loaded load(const stored& position) { return position; }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool int32_position(const loaded& p, std::int32_t (&q)[3]) const {
        return core::snap_int32(snap, p.x, p.y, p.z, q);
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        const glm::vec3 p = positions[vertex];
        return core::snap(snap, p.x, p.y, p.z);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const {
        const uint4 packed = reinterpret_cast<const uint4*>(batches)[i / core::passes::patch_batch::size];
        std::uint32_t local = packed.y + i % core::passes::patch_batch::size, point = packed.z, level = packed.w;
        if ((level & core::passes::patch_batch::is_mixed) != 0) {
            const std::uint32_t patch = core::passes::find_owner_near(first_triangle, packed.x, num_patches, i);
            local = i - static_cast<std::uint32_t>(first_triangle[patch]);
            point = static_cast<std::uint32_t>(first_point[patch]);
            level = levels[patch];
        }
        // As lattice_triangle_of, in floats: local < 2^20, whose root is at least 2^-21 of it below the next integer.
        const auto row = static_cast<std::uint32_t>(exact::sqrt(static_cast<float>(local)));
        const std::uint32_t at = local - row * row, column = at / 2;
        const std::uint32_t upper = point + row * (row + 1) / 2 + column, lower = upper + row + 1;
        const bool points_down = at % 2 != 0;
        const bool is_even = level == (level & 1023) * 0x100401u; // then none is left out
        if (!is_even && core::lattice::unpack(level).is_left_out(core::lattice_triangle_of(local)))
            return glm::uvec3(left_out);
        return points_down ? glm::uvec3(upper, lower + 1, upper + 1) : glm::uvec3(upper, lower, lower + 1);
    }
};

// The call as immediate_strategy sees it.
template <class FragmentShader, class Framebuffer>
struct patch_call {
    struct mesh_type { // whose triangles are made by the source
        array_view<const glm::uvec3> triangles;
        array_view<const glm::vec3> positions;
        [[nodiscard]] static bool has_checked_indices() { return true; }
    };
    struct draw_type {
        mesh_type mesh;
        FragmentShader fragment_shader;
    };
    using framebuffer_type = Framebuffer;
    using groups = targets_of<Framebuffer>;
    using tracking_type = change_tracking<Framebuffer>;
    static constexpr bool shades_in_raster = true;

    std::array<draw_type, 1> draws;
    framebuffer_plan<Framebuffer> plan;
    patch_source source;
    std::uint32_t num_points;
    stage_clock* clock = nullptr;

    [[nodiscard]] bool is_tracked() const { return can_be_known(plan.fb); }
    [[nodiscard]] static bool has_checked_indices() { return true; }
    [[nodiscard]] std::size_t max_pass_triangles() const { return plan.num_primitives; }
    [[nodiscard]] static std::size_t max_pass_vertices() { return 0; }
    [[nodiscard]] std::uint32_t num_source_vertices(const mesh_type&) const { return num_points; }
    void clear_targets(const tracking_type& tracking, const pipeline_state* state, cudaStream_t stream) const {
        clear_for(plan, true, tracking, state, stream);
    }
    template <class Raster>
    void raster_draws(const vertex_positions&, const pipeline_state*, cudaStream_t, const Raster& raster) const {
        raster(draws[0], source, false);
    }
    [[nodiscard]] raster_input<patch_source> raster_input_of(const draw_type&, const patch_source& s) const {
        return {s, plan.num_primitives, s.snap.fraction, plan.g.extent};
    }
};

} // namespace device

namespace core {

// Implements voxelize with a tessellation where its triangles need not be in memory; otherwise returns nothing.
// Arguments are validated. most: triangles.
template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class Program, class... Targets>
std::optional<status> run_module(patches_tag<Known...>, cuda_backend& backend,
                                 std::span<const draw<Mesh, VertexShader, FragmentShader, tessellate<Program>>> draws,
                                 const grid& g, const framebuffer_view<Targets...>& fb, const voxelize_options& options,
                                 std::uint64_t most) {
    if constexpr (is_constant<FragmentShader> && (device::is_immediate<Targets>() && ...)) {
        using framebuffer_type = framebuffer_view<Targets...>;
        using V = typename shaded<Mesh, VertexShader>::varyings;
        using W = tessellated<Program, V>;
        using sink = passes::mesh_vertices<no_varyings>;
        const bool is_served =
            backend.strategy == voxelpipe::strategy::automatic || backend.strategy == voxelpipe::strategy::immediate;
        if (draws.size() != 1 || !is_served || backend.times != nullptr || arms_of(options.rule) != arm_set::none)
            return std::nullopt;
        struct {
            device::program_state state;
            device::program_room room;
        } found{};
        const auto& d = draws[0];
        const auto patches_memory = [&](device::arena& memory) {
            auto* const state = memory.take<decltype(found)>(1);
            const device::async_draw_base<Mesh, VertexShader, no_varyings> shaded(memory, d.mesh, d.vertex_shader, 0);
            const device::async_lattice<Program, V> lattice(memory, d.amplify.program, shaded.vertices, shaded.in,
                                                            shaded.num_inputs);
            return std::tuple(state, shaded, lattice);
        };
        try {
            device::arena plan;
            (void)patches_memory(plan);
            const device_block counted(plan.used(), backend.resource, backend.stream);
            device::arena memory(counted.data());
            const auto [state, shaded, lattice] = patches_memory(memory);
            device::check(cudaMemsetAsync(state, 0, sizeof(*state), backend.stream));
            shaded.shade(backend.stream);
            lattice.count(&state->state, {~std::uint64_t{0}, ~std::uint64_t{0}}, &state->room, backend.stream);
            device::check(cudaMemcpyAsync(&found, state, sizeof(found), cudaMemcpyDeviceToHost, backend.stream));
            device::check(cudaStreamSynchronize(backend.stream));
            const std::uint64_t triangles = found.state.largest_lattice.triangles,
                                points = found.state.largest_lattice.points;
            const std::vector<std::uint64_t> counts(std::begin(found.state.counts), std::end(found.state.counts));
            if (const status s = check_counts(counts, triangles); !s.ok()) return s;
            const snap_transform snap = make_snap_transform(g);
            if (triangles == 0 || triangles > most || points >= max_numbered ||
                !device::is_listable(static_cast<std::uint32_t>(triangles), snap.fraction, g.extent))
                return std::nullopt;

            using call_type = device::patch_call<FragmentShader, framebuffer_type>;
            call_type call;
            call.draws[0].fragment_shader = d.fragment_shader;
            call.plan = {g, fb, options, static_cast<std::uint32_t>(triangles), {}, nullptr, {}};
            device::plan_immediate(std::span<const typename call_type::draw_type>(call.draws), fb, triangles,
                                   options.count_voxels, call.plan.targets);
            if (!call.plan.targets.possible || !call.plan.targets.is_cheap) return std::nullopt;
            call.num_points = static_cast<std::uint32_t>(points + 1);
            struct arrays {
                passes::patch_batch *triangles, *points;
                glm::vec3* positions;
            } a{};
            const auto draw_memory = [&](device::arena& in) {
                auto* const drawing = in.take<device::pipeline_state>(1);
                a.triangles = in.take<passes::patch_batch>(triangles / passes::patch_batch::size + 1);
                a.points = in.take<passes::patch_batch>(points / passes::patch_batch::size + 1);
                a.positions = in.take<glm::vec3>(points + 1);
                return drawing;
            };
            device::arena size;
            (void)draw_memory(size);
            (void)device::immediate_strategy<call_type>(call, size);
            const device_block drawn(size.used(), backend.resource, backend.stream);
            device::arena draw_arena(drawn.data());
            auto* const drawing = draw_memory(draw_arena);
            const passes::patches<V> all = lattice.patches();
            call.source = {a.triangles,     all.first_triangle,
                           all.first_point, all.levels,
                           all.count,       static_cast<std::uint32_t>(points),
                           a.positions,     snap};
            device::check(cudaMemsetAsync(drawing, 0, sizeof(*drawing), backend.stream));
            const auto find_batches = [&](const std::uint64_t* first, std::uint64_t count, passes::patch_batch* to) {
                device::run_pass((count - 1) / passes::patch_batch::size + 1,
                                 passes::find_batches{first, all.first_point, all.levels, all.count, to},
                                 backend.stream);
            };
            find_batches(all.first_triangle, triangles, a.triangles);
            find_batches(all.first_point, points, a.points);
            device::run_pass(
                points + 1,
                passes::emit_points<Program, V, W, sink>{
                    d.amplify.program, all, 0, points, position_outside(g), {a.positions, nullptr}, nullptr, a.points},
                backend.stream);
            const device::immediate_strategy<call_type> how(call, draw_arena);
            known_coverage<Known...>::dispatch(
                options.rule, [&]<coverage Rule>() { how.template launch<Rule>(drawing, backend.stream); });
            device::pipeline_state end{};
            device::check(cudaMemcpyAsync(&end, drawing, sizeof(end), cudaMemcpyDeviceToHost, backend.stream));
            device::check(cudaStreamSynchronize(backend.stream));
            backend.note_strategy(
                {voxelpipe::strategy::immediate, "a tessellation's constants, blended or counted in place"});
            return without_left_out(device::to_status(end), counts[index_of(program_count::left_out)]);
        } catch (const device::cuda_failure& e) {
            return device::to_status(e);
        }
    } else {
        return std::nullopt;
    }
}

} // namespace core

} // namespace voxelpipe
