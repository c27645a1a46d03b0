// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The part of solids in voxelpipe::cuda_kernels, as call/kernel_instances.cuh: all whose kernels depend on no type of
// the program, and meshes without attributes that are drawn as they are.

#include <voxelpipe/solid/device/solid_call.cuh>

#define VOXELPIPE_EMIT_CROSSINGS(HOW, SINK, ...)                                                                       \
    HOW void emit_crossings(const __VA_ARGS__&, const row_grid&, const SINK&, const row_triangles&, pipeline_state*,   \
                            cudaStream_t);
#define VOXELPIPE_SOLIDS(HOW)                                                                                          \
    VOXELPIPE_EMIT_CROSSINGS(HOW, crossing_appender, stored_triangles)                                                 \
    VOXELPIPE_EMIT_CROSSINGS(HOW, crossing_toggler, stored_triangles)                                                  \
    VOXELPIPE_EMIT_CROSSINGS(HOW, winding_adder, stored_triangles)                                                     \
    VOXELPIPE_EMIT_CROSSINGS(HOW, crossing_appender, shaded_triangles<mesh_view<>, passthrough>)                       \
    VOXELPIPE_EMIT_CROSSINGS(HOW, crossing_toggler, shaded_triangles<mesh_view<>, passthrough>)                        \
    HOW void find_row_codes(const shaded_triangles<mesh_view<>, passthrough>&, const row_grid&, const zeroed_memory&,  \
                            pipeline_state*, cudaStream_t);                                                            \
    HOW crossing_list sort_crossings<0>(const crossing_memory&, pipeline_state*, const capacities&, cudaStream_t);     \
    HOW void group_by_row<0>(const row_groups&, std::uint64_t, pipeline_state*, const capacities&, cudaStream_t);      \
    HOW void end_parities<0>(word*, const row_marks&, const row_grid&, bool, pipeline_state*, cudaStream_t);           \
    HOW void raster_cover<0>(const cover_memory&, const draw_geometry&, std::uint32_t, const geometry&, const grid&,   \
                             pipeline_state*, cudaStream_t);                                                           \
    HOW void list_cover<0>(const cover_memory&, const row_grid&, const crossing_list&, std::uint32_t, pipeline_state*, \
                           cudaStream_t);                                                                              \
    HOW void take_counts<0>(const cover_memory&, pipeline_state*, cudaStream_t);                                       \
    HOW void fill_to_exterior<0>(const exterior_memory&, word*, cudaStream_t);                                         \
    HOW void add_votes<0>(const vote_memory&, const stored_triangles&, std::uint32_t, std::uint32_t, const row_grid&,  \
                          const solid_slab*, word*, pipeline_state*, cudaStream_t);                                    \
    HOW void add_windings<0>(const winding_memory&, const core::winding_view&, const geometry&,                        \
                             const winding_triangles&, const row_grid&, fill_rule, solid_extent, std::uint32_t, word*, \
                             pipeline_state*, cudaStream_t);

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
namespace voxelpipe::device {
VOXELPIPE_SOLIDS(extern template)
} // namespace voxelpipe::device
#endif
