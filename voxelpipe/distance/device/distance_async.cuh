// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance_async: as voxelize_distance into a framebuffer, without waits and allocations, as a CUDA graph
// needs it. It works in the caller's memory, in arrays whose room is given; a call that does not fit leaves every
// target as it was, and read_distance_status says what was needed. The solid that decides the sign comes first, into
// bits of the workspace, and what it counts and lacks joins the state of the search, which then writes nothing.

#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/solid/device/solid_async.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe {

// Room of a call with distances. With band::whole only `crossings` is used.
struct distance_limits {
    std::uint64_t pairs = 0;  // pairs of a triangle and a brick of 8 x 8 x 8 samples that its band may meet, below 2^32
    std::uint64_t parts = 0;  // parts of triangles near more than 32 bricks, 1,024 bricks each
    std::uint64_t bricks = 0; // bricks that the band meets: their samples take 4 KB each
    // Crossings of triangles with rows of samples, for the sign, below 2^32: status::solid.crossings of the same call.
    // None without a sign, and with fill_rule::even_odd and bodies::call.
    std::uint64_t crossings = 0;

    // A start for a mesh of small triangles.
    [[nodiscard]] static distance_limits for_triangles(std::uint64_t triangles) {
        const auto first = tuning::first_capacities(triangles);
        return {first[0], first[1], first[3], first[2]};
    }
};

// The caller's memory, as workspace_view.
struct distance_workspace_view {
    void* memory = nullptr; // on the device, aligned to 256 bytes
    std::size_t bytes = 0;  // at least distance_workspace_bytes(...)
    distance_limits limits; // that `bytes` was computed for
    // As workspace_view::stop.
    const unsigned int* stop = nullptr;
};

namespace device {

// Gives the search what the solid before it has counted, and that it did not fit.
template <int = 0>
__global__ void take_solid_counts_kernel(const pipeline_state* solid, pipeline_state* search) {
    search->solid = solid->solid;
    search->list_fragments = solid->list_fragments;
}

[[nodiscard]] inline capacities to_capacities(const distance_limits& l) {
    return {l.pairs, l.parts, l.crossings, l.bricks};
}

// A call, and its places in the caller's memory.
template <class Draw>
class async_distance;
template <class Mesh, class VertexShader, class Shader>
class async_distance<draw<Mesh, VertexShader, Shader>> {
public:
    using draw_type = draw<Mesh, VertexShader, Shader>;

    // lists_rows: the samples of the band become lists.
    async_distance(std::span<const draw_type> draws, const grid& samples, const distance_options& options,
                   std::uint64_t triangles, const distance_limits& limits, bool lists_rows)
        : search_{draws,   samples,   options, static_cast<std::uint32_t>(triangles), to_capacities(limits),
                  nullptr, lists_rows} {
        if (options.sign == distance_sign::none || triangles == 0) return;
        for (const draw_type& d : draws) solids_.push_back({d.mesh, d.vertex_shader, constant(true)});
    }

    [[nodiscard]] bool fits() const { return search_.fits() && (solids_.empty() || solid(nullptr).entries.fits()); }
    // Takes what launch() takes.
    void plan(arena& memory) const {
        (void)search_.take(memory);
        if (!solids_.empty()) (void)take_solid(memory);
    }
    [[nodiscard]] std::size_t bytes() const {
        arena memory;
        plan(memory);
        return memory.used();
    }
    // Takes memory, the search's state first, and launches the search and the solid; then calls finish(call, its
    // memory, shading, inside_rows), which launches the rest. stop: workspace_view::stop.
    template <class Finish>
    void launch(arena& carved, const unsigned int* stop, cudaStream_t stream, const Finish& finish) const {
        auto m = search_.take(carved);
        check(cudaMemsetAsync(m.state, 0, sizeof(pipeline_state), stream));
        take_stop({nullptr, 0, {}, stop}, m.state, stream);
        check_subsets(search_.draws, &m.state->index_error, stream);
        inside_rows inside{nullptr, glm::ivec3(0)};
        if (!solids_.empty()) {
            const solid_memory s = take_solid(carved);
            const auto call = solid(s.bits);
            zero_memory(s.workspace, call.zeroed_bytes(), stream);
            arena of_solid(s.workspace);
            call.launch(of_solid, stream);
            take_solid_counts_kernel<0>
                <<<1, 1, 0, stream>>>(reinterpret_cast<const pipeline_state*>(s.workspace), m.state);
            check(cudaGetLastError(), stage::fine_raster);
            inside = {s.bits, search_.samples.extent};
        }
        const auto shading = search_.search(m, stream);
        finish(search_, m, shading, inside);
    }

private:
    using bits_target = inside_bits::target_type;
    using bits_view = framebuffer_view<bits_target>;
    using solid_draw = draw<Mesh, VertexShader, constant_output<bool>>;

    struct solid_memory {
        word* bits;
        std::byte* workspace;
    };
    [[nodiscard]] solid_memory take_solid(arena& a) const {
        solid_memory s{};
        s.bits = a.take<word>(bits_target::map::elements(search_.samples.extent));
        s.workspace = a.take<std::byte>(solid(nullptr).plan_memory());
        return s;
    }
    // bits: null for the size of its memory.
    [[nodiscard]] auto solid(word* bits) const {
        bits_view view = bits_view::on(search_.samples.extent, bits);
        voxelpipe::get<0>(view.targets).load = load_operation::clear;
        workspace_limits limits;
        limits.fragments = search_.limits.fragments;
        return make_solid_call(std::span<const solid_draw>(solids_), search_.samples, view,
                               core::sign_options(search_.options), search_.num_primitives, limits);
    }

    distance_call<draw_type> search_;
    std::vector<solid_draw> solids_; // none without a sign
};

[[nodiscard]] inline status validate_async(const distance_options& options, const grid& g) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate(options, g); !s.ok()) return s;
    return options.repair == repair::none ? status{} : core::failure(status_code::strategy_unavailable);
}

} // namespace device

// Bytes that voxelize_distance_async needs for such a call on the current device; 0 if the arguments are invalid, or
// the call repairs the mesh, which takes waits.
template <class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] std::size_t distance_workspace_bytes(std::span<const draw<Mesh, VertexShader, DistanceShader>> draws,
                                                   const grid& g, const framebuffer_view<Targets...>&,
                                                   const distance_options& options, const distance_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !device::validate_async(options, g).ok()) return 0;
    if (draws.empty()) return sizeof(device::pipeline_state);
    return device::bytes_or_none([&]() -> std::size_t {
        const device::async_distance<draw<Mesh, VertexShader, DistanceShader>> call(
            draws, core::sample_grid(g, options.sample), options, s.counts.triangles_in, limits, false);
        return call.fits() ? call.bytes() : 0;
    });
}

// Puts the call on the backend's stream and returns. A status other than ok means that nothing was launched, or that a
// launch failed; read_distance_status reports what the device finds out. strategy_unavailable: the call repairs the
// mesh. The framebuffer and the draws are as for voxelize_distance.
template <class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] status
voxelize_distance_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, DistanceShader>> draws,
                        const grid& g, const framebuffer_view<Targets...>& fb, const distance_options& options,
                        const distance_workspace_view& workspace) {
    if constexpr (core::distance_fits_targets<Mesh, VertexShader, DistanceShader, Targets...>()) {
        if (const status s = device::validate_async(options, g); !s.ok()) return s;
        const grid samples = core::sample_grid(g, options.sample);
        if (const status s = core::validate_framebuffer(fb, samples); !s.ok()) return s;
        status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        return device::with_cuda_status([&]() -> status {
            const std::size_t need = distance_workspace_bytes(draws, g, fb, options, workspace.limits);
            if (need == 0) return core::failure(status_code::size_overflow);
            if (workspace.memory == nullptr || workspace.bytes < need) {
                s.code = status_code::capacity_exceeded;
                s.required.bytes = need;
                return s;
            }
            if (draws.empty())
                return device::clear_async(backend, fb, {workspace.memory, workspace.bytes, {}, workspace.stop});
            const device::async_distance<draw<Mesh, VertexShader, DistanceShader>> call(
                draws, samples, options, s.counts.triangles_in, workspace.limits, false);
            device::launch_until(stage::tile_resolve, [&] {
                device::arena memory(workspace.memory);
                call.launch(
                    memory, workspace.stop, backend.stream,
                    [&](const auto& search, const auto& m, const auto& shading, const device::inside_rows& inside) {
                        device::shade_into(search, m, shading, inside, fb, backend.stream);
                    });
            });
            return s;
        });
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

namespace device {

// The same numbers as read_status has them.
[[nodiscard]] inline workspace_limits to_workspace_limits(const distance_limits& l) {
    workspace_limits limits;
    limits.tile_pairs = l.pairs;
    limits.tile_records = l.parts;
    limits.fragments = l.crossings;
    limits.fragment_records = l.bricks;
    return limits;
}
[[nodiscard]] inline distance_limits to_distance_limits(const workspace_limits& l) {
    return {l.tile_pairs, l.tile_records, l.fragment_records, l.fragments};
}
// Waits. The status of a call in this memory, whose state comes first; *larger has what it needs (capacity_exceeded).
[[nodiscard]] inline status read_search(cuda_backend& backend, void* memory, std::size_t bytes,
                                        const workspace_limits& limits, workspace_limits* larger) {
    status s = read_status(backend, {memory, bytes, limits, nullptr}, larger);
    if (!s.ok()) return s;
    pipeline_state state{};
    if (const status failed = read_start(memory, state, backend.stream); !failed.ok()) return failed;
    s.distance.band_samples = state.kept;
    return s;
}

} // namespace device

// Waits for the stream and returns the status of the last call in this workspace, that of voxelize_distance. `need` may
// be null. Where something did not fit (capacity_exceeded), *need receives larger limits; a call whose parts did not
// fit has not counted all pairs and bricks, so that the same call may fail once more with these.
[[nodiscard]] inline status read_distance_status(cuda_backend& backend, const distance_workspace_view& workspace,
                                                 distance_limits* need = nullptr) {
    const workspace_limits limits = device::to_workspace_limits(workspace.limits);
    workspace_limits larger = limits;
    const status s = device::read_search(backend, workspace.memory, workspace.bytes, limits, &larger);
    if (need != nullptr && s.code == status_code::capacity_exceeded) *need = device::to_distance_limits(larger);
    return s;
}

} // namespace voxelpipe
