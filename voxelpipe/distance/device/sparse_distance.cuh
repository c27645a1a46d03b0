// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance into sparse framebuffers on a GPU: run_module of core::sparse_distance_tag, with the bytes of
// cpu_backend. The samples of the band become lists, and the lists the bricks of the framebuffer.

#include <voxelpipe/device/call/list_arrays.cuh>
#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/sparse_distance.hpp>
#include <voxelpipe/sparse/device/sparse.cuh>

#include <cstdint>
#include <span>

namespace voxelpipe::core {

// Implements voxelize_distance. Arguments are validated.
template <class Mesh, class VertexShader, class Shader, class... Targets>
[[nodiscard]] status run_module(sparse_distance_tag, cuda_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& samples,
                                sparse_framebuffer<cuda_backend, Targets...>& fb, const distance_options& options,
                                std::uint64_t triangles_in) {
    using draw_type = draw<Mesh, VertexShader, Shader>;
    using payload = typename outputs_payload<
        distance_output<Shader, typename device::distance_call<draw_type>::draws_type::varyings>>::type;
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    device::inside_bits inside;
    const status solid = inside.draw(backend, draws, samples, options, triangles_in);
    if (!solid.ok()) return solid;
    abuffer<cuda_backend, payload> lists(backend);
    status s = device::attempt_distance(
        backend, draws, samples, options, triangles_in, true,
        [&](const auto& call, const auto& m, const auto& shading, cudaStream_t on) {
            device::list_samples<payload>(call, m, shading, inside.rows(), {}, on);
        },
        [&](const auto& call, const auto& m, const auto& shading, const device::pipeline_state& state) {
            device::list_arrays<payload> arrays(backend, state.fragments, state.fragments);
            const device::solid_list_arrays<payload> to{arrays.voxels.data(), arrays.offsets.data(),
                                                        arrays.primitives.data(), arrays.payloads.data()};
            if (state.fragments != 0) {
                device::list_samples<payload>(call, m, shading, inside.rows(), to, backend.stream);
                device::end_offsets_kernel<payload><<<1, 1, 0, backend.stream>>>(to, state.fragments, state.fragments);
                device::check(cudaGetLastError(), stage::abuffer_emit);
            }
            arrays.move_into(lists, state.fragments, state.fragments);
        });
    s.solid = solid.solid;
    if (!s.ok()) return s;
    lists.extent = samples.extent;
    return device::finish_sparse(backend, samples, lists, fb, s);
}

} // namespace voxelpipe::core
