// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_async with programs between the vertex shader and the rasterizer. The host does not learn how many triangles
// they make, so each draw has room for a number that the caller gives. What the programs make is a mesh of that size,
// whose other triangles lie outside of the grid. If it has no room for all, or a program has failed, no target is
// written, and read_status says what was needed.

#include <voxelpipe/programs/device/async_output.cuh>
#include <voxelpipe/programs/device/program_arrays.cuh>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

// The caller's memory, as workspace_view.
struct program_workspace_view {
    void* memory = nullptr; // on the device, aligned to 256 bytes
    std::size_t bytes = 0;  // at least program_workspace_bytes(...)
    program_limits limits;  // that `bytes` was computed for
};

namespace device {

// ---- the call -------------------------------------------------------------------------------------------------------

template <class Draw>
class async_programs;
template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
class async_programs<draw<Mesh, VertexShader, FragmentShader, Amplify>> {
    static constexpr bool is_plain = core::is_constant<FragmentShader>;
    using varyings = typename core::program_types<Mesh, VertexShader, Amplify>::varyings;
    using shader = core::emitted_shader<FragmentShader, varyings, is_plain>;
    using stored = typename shader::stored;
    using draw_type = async_draw<Mesh, VertexShader, Amplify, stored>;
    using vertex_shader = core::emitted_vertex_shader<stored>;
    using view_type = decltype(std::declval<const async_mesh<stored>&>().view());

public:
    using input_draw = draw<Mesh, VertexShader, FragmentShader, Amplify>;
    using emitted_draw = draw<view_type, vertex_shader, typename shader::type>;

    async_programs(arena& memory, std::span<const input_draw> draws, const program_limits& limits)
        : state_(memory.take<program_state>(1)), rooms_(memory.take<program_room>(draws.size())) {
        for (std::size_t d = 0; d < draws.size(); ++d) {
            draws_.emplace_back(memory, draws[d].mesh, draws[d].vertex_shader, draws[d].amplify,
                                static_cast<std::uint32_t>(d), limits, !is_plain);
            const async_mesh<stored>& m = draws_.back().mesh;
            if constexpr (is_plain) {
                emitted_.push_back({m.view(), {}, draws[d].fragment_shader});
            } else {
                emitted_.push_back({m.view(),
                                    {},
                                    {draws[d].fragment_shader, m.origins,
                                     static_cast<std::uint32_t>(core::elements_of<Mesh>::count(draws[d].mesh)),
                                     static_cast<std::uint32_t>(d), 0, draws.size() > 1 ? &rooms_[d].moved : nullptr}});
            }
        }
    }
    [[nodiscard]] std::span<const emitted_draw> emitted() const { return emitted_; }
    [[nodiscard]] program_state* state() const { return state_; }
    [[nodiscard]] const program_room* rooms() const { return rooms_; }
    // outside: where the triangles lie that are left out, position_outside or position_nowhere.
    void launch(const glm::vec3& outside, std::size_t bytes_before_call, cudaStream_t stream) const {
        check(cudaMemsetAsync(state_, 0, sizeof(program_state), stream));
        run_pass(1, note_call{state_, bytes_before_call, core::counts_left_out<Amplify> ? 1u : 0u}, stream);
        for (std::size_t d = 0; d < draws_.size(); ++d) draws_[d].launch(state_, rooms_ + d, outside, stream);
    }

private:
    program_state* state_;
    program_room* rooms_;
    std::vector<draw_type> draws_;
    std::vector<emitted_draw> emitted_;
};

[[nodiscard]] inline bool are_numbered(const program_limits& l, std::size_t draws) {
    constexpr std::uint64_t most = core::max_numbered / 4;
    return l.lattice_points < core::max_numbered && l.lattice_triangles < core::max_numbered && l.triangles <= most &&
           (draws == 0 || l.triangles <= core::max_numbered / draws);
}
// A size that is only planned has addresses that nobody reads: views without memory are invalid.
[[nodiscard]] inline arena planning_arena() {
    return arena(reinterpret_cast<void*>(memory_resource::alignment)); // NOLINT(performance-no-int-to-ptr)
}

// Waits for the stream and reads what the programs of the last call in this memory have found. capacity_exceeded:
// *need, if it is not null, has the room for triangles that they take, and the rest of the limits as they were.
template <class Limits>
[[nodiscard]] status read_programs(cuda_backend& backend, const void* memory, program_state& state,
                                   const Limits& limits, Limits* need) {
    if (const status s = read_start(memory, state, backend.stream); !s.ok()) return s;
    const std::vector<std::uint64_t> counts(std::begin(state.counts), std::end(state.counts));
    if (const status s = core::check_counts(counts, state.triangles); !s.ok()) return s;
    if (state.stop == 0) return {};
    status s = core::failure(status_code::capacity_exceeded, stage::vertex_shade);
    s.counts.triangles_in = state.triangles;
    if (need != nullptr) {
        *need = limits;
        need->triangles = std::max(need->triangles, state.largest);
        need->lattice_points = std::max(need->lattice_points, state.largest_lattice.points);
        need->lattice_triangles = std::max(need->lattice_triangles, state.largest_lattice.triangles);
    }
    return s;
}
// Triangles of a call behind programs that are none of those that they make: spare room, and what is left out.
[[nodiscard]] inline std::uint64_t left_out_of(const program_state& state) {
    const std::uint64_t counted = state.counts[core::index_of(core::program_count::left_out)];
    return state.capacity - state.triangles + (state.has_left_out != 0 ? counted : 0);
}
} // namespace device

// Bytes that voxelize_async needs for such a call on the current device; 0 if the arguments are invalid. out: a
// framebuffer_view, an abuffer_view or a sparse_result.
template <class Mesh, class VertexShader, class FragmentShader, class Amplify, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] std::size_t
program_workspace_bytes(std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws, const grid& g,
                        const Output& out, const voxelize_options& options, const program_limits& limits) {
    if (!core::validate_program_draws(draws).ok() || !device::are_numbered(limits, draws.size())) return 0;
    return device::bytes_or_none([&] {
        device::arena plan = device::planning_arena();
        const device::async_programs<draw<Mesh, VertexShader, FragmentShader, Amplify>> programs(plan, draws, limits);
        const std::size_t bytes = workspace_bytes(programs.emitted(), g, out, options, limits);
        return bytes == 0 ? 0 : plan.used() + bytes;
    });
}

// Puts a call with programs on the backend's stream and returns. out: a framebuffer_view, or an abuffer_view or a
// sparse_result, which are set to where lists, or bricks and values, will be. Results are those of voxelize. A status
// other than ok means that nothing was launched, or that a launch failed; read_status reports what the device finds
// out.
template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class Amplify, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_async(cuda_backend& backend,
                                    std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws,
                                    const grid& g, Output&& output, const voxelize_options& options,
                                    const program_workspace_view& workspace) {
    auto& out = device::async_output(output);
    using output_type = std::remove_cvref_t<decltype(out)>;
    if constexpr (core::check_program<Mesh, VertexShader, FragmentShader, Amplify>()) {
        using shader_output = core::program_output<Mesh, VertexShader, FragmentShader, Amplify>;
        if constexpr (core::output_kind<output_type>::template fits<shader_output>()) {
            if (const status s = core::validate_call(draws, g, out); !s.ok()) return s;
            if (!device::are_numbered(workspace.limits, draws.size())) return core::failure(status_code::size_overflow);
            using programs_type = device::async_programs<draw<Mesh, VertexShader, FragmentShader, Amplify>>;
            return device::with_cuda_status([&] {
                const std::size_t need = program_workspace_bytes(draws, g, out, options, workspace.limits);
                if (need == 0) { // refused by the call that draws, which says why
                    device::arena plan = device::planning_arena();
                    const programs_type planned(plan, draws, workspace.limits);
                    return voxelize_async<Known...>(backend, planned.emitted(), g, out, options,
                                                    workspace_view{nullptr, 0, workspace.limits});
                }
                if (workspace.memory == nullptr || workspace.bytes < need) {
                    status s = core::failure(status_code::capacity_exceeded);
                    s.required.bytes = need;
                    return s;
                }
                device::arena memory(workspace.memory);
                const programs_type programs(memory, draws, workspace.limits);
                programs.launch(core::position_outside(g), memory.used(), backend.stream);
                const workspace_view behind{static_cast<std::byte*>(workspace.memory) + memory.used(),
                                            workspace.bytes - memory.used(), workspace.limits, &programs.state()->stop};
                status s = voxelize_async<Known...>(backend, programs.emitted(), g, out, options, behind);
                s.counts = {};
                if constexpr (device::is_lists<output_type>)
                    if (s.ok() && draws.size() > 1 && out.primitives != nullptr)
                        device::run_pass(workspace.limits.fragments,
                                         device::renumber_primitives{out.counts, programs.rooms(),
                                                                     workspace.limits.triangles,
                                                                     const_cast<std::uint32_t*>(out.primitives)},
                                         backend.stream);
                return s;
            });
        }
    }
    return {}; // does not compile: a static_assert has said why
}

// As read_status of other calls. counts.triangles_in are the triangles that the programs make, without those that a
// tessellation leaves out. If there was no room for them, *need has what they take, and the rest of the limits as they
// were; with both programs, what the second one makes may be known only when the first one's has room.
[[nodiscard]] inline status read_status(cuda_backend& backend, const program_workspace_view& workspace,
                                        program_limits* need = nullptr) {
    device::program_state state{};
    if (const status s = device::read_programs(backend, workspace.memory, state, workspace.limits, need); !s.ok())
        return s;
    const workspace_view behind{static_cast<std::byte*>(workspace.memory) + state.bytes_before_call,
                                workspace.bytes - state.bytes_before_call, workspace.limits};
    workspace_limits of_call;
    const status s = read_status(backend, behind, &of_call);
    if (s.code == status_code::capacity_exceeded && need != nullptr) {
        *need = workspace.limits;
        static_cast<workspace_limits&>(*need) = of_call;
    }
    if (!s.ok()) return s;
    return core::without_left_out(s, device::left_out_of(state));
}

} // namespace voxelpipe
