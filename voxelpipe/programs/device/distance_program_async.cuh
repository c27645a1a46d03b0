// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance_async of what programs make (distance_programs.hpp): voxelize_distance without waits and
// allocations. As in program_async.cuh, each draw has room for a number of triangles that the caller gives; those that
// the programs do not make have no position, and no distance is theirs.

#include <voxelpipe/distance/device/distance_async.cuh>
#include <voxelpipe/programs/device/program_async.cuh>
#include <voxelpipe/programs/distance_programs.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelpipe {

// Room of a call with distances of what programs make.
struct distance_program_limits : distance_limits {
    // Room of each draw, as in program_limits. The whole room is measured, so one that is much too large takes time.
    std::uint64_t triangles = 0, lattice_points = 0, lattice_triangles = 0;

    // Room for `n` triangles before and behind a geometry program, and a start for the rest.
    [[nodiscard]] static distance_program_limits for_triangles(std::uint64_t n) {
        distance_program_limits l;
        static_cast<distance_limits&>(l) = distance_limits::for_triangles(n);
        l.triangles = l.lattice_triangles = n;
        l.lattice_points = 3 * n;
        return l;
    }
};

// The caller's memory, as workspace_view.
struct distance_program_workspace_view {
    void* memory = nullptr;         // on the device, aligned to 256 bytes
    std::size_t bytes = 0;          // at least distance_workspace_bytes(...)
    distance_program_limits limits; // that `bytes` was computed for
};

namespace device {

[[nodiscard]] inline program_limits room_of_programs(const distance_program_limits& l) {
    program_limits room;
    room.triangles = l.triangles;
    room.lattice_points = l.lattice_points;
    room.lattice_triangles = l.lattice_triangles;
    return room;
}

} // namespace device

// Bytes that voxelize_distance_async needs for such a call on the current device; 0 if the arguments are invalid, or
// the call repairs the mesh, which takes waits.
template <class Mesh, class VertexShader, class DistanceShader, class Amplify, class... Targets>
requires core::is_amplifier<Amplify>
[[nodiscard]] std::size_t
distance_workspace_bytes(std::span<const draw<Mesh, VertexShader, DistanceShader, Amplify>> draws, const grid& g,
                         const framebuffer_view<Targets...>& fb, const distance_options& options,
                         const distance_program_limits& limits) {
    const program_limits room = device::room_of_programs(limits);
    if (!core::validate_program_draws(draws).ok() || !device::are_numbered(room, draws.size())) return 0;
    return device::bytes_or_none([&] {
        device::arena plan = device::planning_arena();
        const device::async_programs<draw<Mesh, VertexShader, DistanceShader, Amplify>> programs(plan, draws, room);
        const std::size_t bytes = distance_workspace_bytes(programs.emitted(), g, fb, options, limits);
        return bytes == 0 ? 0 : plan.used() + bytes;
    });
}

// Puts the call on the backend's stream and returns. Targets and values are those of voxelize_distance of the same
// draws. A status other than ok means that nothing was launched, or that a launch failed; read_distance_status reports
// what the device finds out. strategy_unavailable: the call repairs the mesh.
template <class Mesh, class VertexShader, class DistanceShader, class Amplify, class... Targets>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_distance_async(cuda_backend& backend,
                                             std::span<const draw<Mesh, VertexShader, DistanceShader, Amplify>> draws,
                                             const grid& g, const framebuffer_view<Targets...>& fb,
                                             const distance_options& options,
                                             const distance_program_workspace_view& workspace) {
    if constexpr (core::check_distance_program<Mesh, VertexShader, DistanceShader, Amplify>()) {
        if (const status s = device::validate_async(options, g); !s.ok()) return s;
        if (const status s = core::validate_program_draws(draws); !s.ok()) return s;
        const program_limits room = device::room_of_programs(workspace.limits);
        if (!device::are_numbered(room, draws.size())) return core::failure(status_code::size_overflow);
        using programs_type = device::async_programs<draw<Mesh, VertexShader, DistanceShader, Amplify>>;
        return device::with_cuda_status([&] {
            const std::size_t need = distance_workspace_bytes(draws, g, fb, options, workspace.limits);
            if (need == 0) { // refused by the call that measures, which says why
                device::arena plan = device::planning_arena();
                const programs_type planned(plan, draws, room);
                return voxelize_distance_async(backend, planned.emitted(), g, fb, options,
                                               distance_workspace_view{nullptr, 0, workspace.limits});
            }
            if (workspace.memory == nullptr || workspace.bytes < need) {
                status s = core::failure(status_code::capacity_exceeded);
                s.required.bytes = need;
                return s;
            }
            device::arena memory(workspace.memory);
            const programs_type programs(memory, draws, room);
            programs.launch(core::position_nowhere, memory.used(), backend.stream);
            const distance_workspace_view behind{static_cast<std::byte*>(workspace.memory) + memory.used(),
                                                 workspace.bytes - memory.used(), workspace.limits,
                                                 &programs.state()->stop};
            status s = voxelize_distance_async(backend, programs.emitted(), g, fb, options, behind);
            s.counts = {};
            return s;
        });
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// Waits for the stream and returns the status of the last call in this workspace, that of voxelize_distance. `need` may
// be null. Where something did not fit (capacity_exceeded), *need receives larger limits, with which the same call may
// fail once more: what did not come to be for want of room has not been counted.
[[nodiscard]] inline status read_distance_status(cuda_backend& backend,
                                                 const distance_program_workspace_view& workspace,
                                                 distance_program_limits* need = nullptr) {
    device::program_state state{};
    if (const status s = device::read_programs(backend, workspace.memory, state, workspace.limits, need); !s.ok())
        return s;
    const distance_workspace_view behind{static_cast<std::byte*>(workspace.memory) + state.bytes_before_call,
                                         workspace.bytes - state.bytes_before_call, workspace.limits};
    distance_limits of_call;
    const status s = read_distance_status(backend, behind, &of_call);
    if (s.code == status_code::capacity_exceeded && need != nullptr) {
        *need = workspace.limits;
        static_cast<distance_limits&>(*need) = of_call;
    }
    return s.ok() ? core::without_left_out_nowhere(s, device::left_out_of(state)) : s;
}

} // namespace voxelpipe
