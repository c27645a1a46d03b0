// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance on a GPU: run_module of core::distance_tag, with the bytes of cpu_backend. Its kernels are compiled
// by programs that call it, and by no other.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/scene/subset.cuh>
#include <voxelpipe/distance/device/distance_call.cuh>
#include <voxelpipe/solid/device/solid.cuh>

#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <vector>

namespace voxelpipe {

namespace device {

// The samples that are inside: bits of a framebuffer, or none.
class inside_bits {
public:
    using target_type = target<bit, blend::replace>;
    using framebuffer_type = framebuffer<cuda_backend, target_type>;

    // Draws the solid. A status that is not ok says why there are no bits.
    template <class Mesh, class VertexShader, class Shader>
    [[nodiscard]] status draw(cuda_backend& backend, std::span<const voxelpipe::draw<Mesh, VertexShader, Shader>> draws,
                              const grid& samples, const distance_options& options, std::uint64_t triangles_in) {
        if (options.sign == distance_sign::none || triangles_in == 0) return {};
        using shader = constant_output<bool>;
        std::vector<voxelpipe::draw<Mesh, VertexShader, shader>> solids;
        for (const auto& d : draws) solids.push_back({d.mesh, d.vertex_shader, constant(true)});
        bits_.emplace(backend, samples.extent);
        return run_module(core::solid_tag{}, backend,
                          std::span<const voxelpipe::draw<Mesh, VertexShader, shader>>(solids), samples, bits_->view(),
                          core::sign_options(options), triangles_in);
    }
    [[nodiscard]] inside_rows rows() const {
        if (!bits_) return {nullptr, glm::ivec3(0)};
        const auto& t = get<0>(bits_->view().targets);
        return {t.elements, t.extent};
    }

private:
    std::optional<framebuffer_type> bits_;
};

struct distance_history; // names the capacities of these calls

// Runs a call with capacities that suffice: finish(call, memory, shading, stream) launches what comes behind the
// search, and then(call, memory, shading, state) goes on once the call has succeeded and was waited for.
template <class Draw, class Finish, class Then>
[[nodiscard]] status attempt_distance(cuda_backend& backend, std::span<const Draw> draws, const grid& samples,
                                      const distance_options& options, std::uint64_t triangles_in, bool lists_rows,
                                      const Finish& finish, const Then& then) {
    pipeline_state last{};
    status s =
        attempt(backend.history<distance_history>(),
                {triangles_in, samples.extent, samples.offset, coverage::conservative}, max_listed_entries,
                backend.times, backend.stream, [&](attempt_guess& guess, pipeline_state& state, stage_clock* clock) {
                    using call_type = distance_call<Draw>;
                    const call_type call{draws,        samples, options,   static_cast<std::uint32_t>(triangles_in),
                                         guess.limits, clock,   lists_rows};
                    if (!call.fits()) throw std::bad_alloc();
                    void* const memory = backend.workspace().prepare(call.plan_memory(), backend,
                                                                     backend.use_pinned_memory, backend.use_graphs);
                    arena carved(memory);
                    auto m = call.take(carved);
                    typename call_type::shading_type shading{};
                    launch_until(stage::tile_resolve, [&] {
                        state = backend.workspace().run(clock, std::nullopt, sizeof(pipeline_state), backend.stream,
                                                        [&](cudaStream_t on) {
                                                            shading = call.search(m, on);
                                                            finish(call, m, shading, on);
                                                        });
                    });
                    if (!has_failed(state, guess.limits)) then(call, m, shading, state);
                    last = state;
                    return false;
                });
    s.distance.band_samples = s.ok() ? last.kept : 0;
    return s;
}

} // namespace device

namespace core {

// Implements voxelize_distance into a framebuffer. Arguments are validated.
template <class Mesh, class VertexShader, class Shader, class... Targets>
[[nodiscard]] status run_module(distance_tag, cuda_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& samples,
                                const framebuffer_view<Targets...>& fb, const distance_options& options,
                                std::uint64_t triangles_in) {
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    device::inside_bits inside;
    const status solid = inside.draw(backend, draws, samples, options, triangles_in);
    if (!solid.ok()) return solid;
    status s = device::attempt_distance(
        backend, draws, samples, options, triangles_in, false,
        [&](const auto& call, const auto& m, const auto& shading, cudaStream_t on) {
            device::shade_into(call, m, shading, inside.rows(), fb, on);
        },
        [](const auto&...) {});
    s.solid = solid.solid;
    return s;
}

} // namespace core

} // namespace voxelpipe
