// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vertex shade: runs the vertex shader once per vertex and snaps the position. Input is one draw's mesh and shader;
// output are snapped positions and varyings, if the shader has any, in the mesh's order (paper section 3, vertex
// shader).

#include <voxelpipe/device/scene/scene.cuh>

#include <type_traits>

namespace voxelpipe::device {

template <class Mesh, class VertexShader, class Varyings>
__global__ void vertex_shade_kernel(const __grid_constant__ Mesh mesh, const __grid_constant__ VertexShader shader,
                                    const __grid_constant__ core::snap_transform snap, std::uint32_t draw,
                                    core::snapped_position* positions, int32_position* int32_positions,
                                    Varyings* varyings, std::uint32_t first_instance, bool only_wide) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= mesh.num_vertices()) return;
    const std::uint64_t each = mesh.positions.size(), instance = i < each ? 0 : i / each;
    const auto v = core::fetch_vertex(mesh, static_cast<std::uint32_t>(i - instance * each), draw,
                                      first_instance + static_cast<std::uint32_t>(instance));
    const auto result = shader(v);
    const auto& o = core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result);
    const core::snapped_position p = core::snap(snap, o.position.x, o.position.y, o.position.z);
    const int32_position narrow = int32_position::of(p);
    int32_positions[i] = narrow;
    if (!only_wide || narrow.fits_int32 == 0) positions[i] = p;
    if constexpr (!std::is_empty_v<Varyings>) varyings[i] = o.varyings;
}

// positions and varyings have one element per vertex of each instance; varyings may be null if the type is empty. The
// shader sees the instances numbered from first_instance on. only_wide: exact positions are written only where 32 bits
// do not hold them, which is all that stored_source reads, and two fifths of the bytes.
template <class Mesh, class VertexShader, class Varyings>
void vertex_shade(const Mesh& mesh, const VertexShader& shader, const core::snap_transform& snap, std::uint32_t draw,
                  const vertex_positions& positions, Varyings* varyings, cudaStream_t stream,
                  std::uint32_t first_instance = 0, bool only_wide = false) {
    if (mesh.num_vertices() == 0) return;
    vertex_shade_kernel<Mesh, VertexShader, Varyings>
        <<<num_blocks(mesh.num_vertices()), threads_per_block, 0, stream>>>(
            mesh, shader, snap, draw, positions.exact, positions.int32, varyings, first_instance, only_wide);
    check(cudaGetLastError(), stage::vertex_shade);
}

} // namespace voxelpipe::device
