// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Function templates that voxelpipe::cuda_kernels instantiates for types that the library names itself: rasters into a
// list or a mask of voxels, clears of common elements, whole calls of constants. Each macro is a list of explicit
// instantiations. HOW is `extern template` in a program that links the library, and `template` in the library's own
// file (voxelpipe/cuda_kernels/). The functions run on the host and are not inline: a program compiles neither them nor
// their kernels, and does not link without the library.

#include <voxelpipe/device/call/abuffer_call.cuh>
#include <voxelpipe/device/call/framebuffer_call.cuh>
#include <voxelpipe/voxelize.hpp>

#include <cstdint>

// In namespace voxelpipe::device, up to the calls. Vertex shades by a kernel, for the library's vertex shaders.
#define VOXELPIPE_VERTEX_SHADES(HOW)                                                                                   \
    HOW void vertex_shade(const mesh_view<>&, const passthrough&, const core::snap_transform&, std::uint32_t,          \
                          const vertex_positions&, no_varyings*, cudaStream_t, std::uint32_t, bool);                   \
    HOW void vertex_shade(const mesh_view<>&, const transform&, const core::snap_transform&, std::uint32_t,            \
                          const vertex_positions&, no_varyings*, cudaStream_t, std::uint32_t, bool);                   \
    HOW void write_arguments(draw_geometry*, const argument_chunk<draw_geometry, 3072 / sizeof(draw_geometry)>&, int,  \
                             cudaStream_t);

#define VOXELPIPE_LIST_RASTER(HOW, RULE, ...)                                                                          \
    HOW void list_raster<RULE>(const raster_input<__VA_ARGS__>&, std::uint32_t, std::uint32_t,                         \
                               const deferred_triangles&, std::uint32_t*, std::uint32_t*, const sort_preparation&,     \
                               pipeline_state*, const capacities&, cudaStream_t);
#define VOXELPIPE_LIST_RASTERS(HOW)                                                                                    \
    VOXELPIPE_LIST_RASTER(HOW, coverage::conservative, stored_source)                                                  \
    VOXELPIPE_LIST_RASTER(HOW, coverage::thin, stored_source)

#define VOXELPIPE_MASK_RASTER(HOW, RULE, ...)                                                                          \
    HOW void launch_raster(const raster_call<RULE, __VA_ARGS__, mask_output>&, pipeline_state*, stage, cudaStream_t,   \
                           bool, deferral);
#define VOXELPIPE_MASK_RASTERS(HOW)                                                                                    \
    VOXELPIPE_MASK_RASTER(HOW, coverage::conservative, stored_source)                                                  \
    VOXELPIPE_MASK_RASTER(HOW, coverage::thin, stored_source)                                                          \
    VOXELPIPE_MASK_RASTER(HOW, coverage::conservative, shading_source<mesh_view<>, passthrough>)                       \
    VOXELPIPE_MASK_RASTER(HOW, coverage::thin, shading_source<mesh_view<>, passthrough>)

#define VOXELPIPE_CLEARS_OF(HOW, ELEMENT)                                                                              \
    HOW void fill_elements<false>(ELEMENT*, std::uint64_t, const fill_pattern<ELEMENT>&, const pipeline_state*,        \
                                  const capacities&, cudaStream_t);                                                    \
    HOW void clear_chunks(ELEMENT*, const chunk_marks&, const word*, const core::change_log::known&,                   \
                          const fill_pattern<ELEMENT>&, const pipeline_state*, const capacities&, cudaStream_t);
#define VOXELPIPE_KNOWN_TARGETS(HOW, N)                                                                                \
    HOW void note_known(word*, const known_targets<N>&, const chunk_marks&, bool, const pipeline_state*,               \
                        const capacities&, cudaStream_t);
#define VOXELPIPE_CLEARS(HOW)                                                                                          \
    HOW void clear_target(const target_view<target<bit, blend::bit_or>>&, const pipeline_state*, const capacities&,    \
                          cudaStream_t);                                                                               \
    HOW void fill_elements<true>(word*, std::uint64_t, const fill_pattern<word>&, const pipeline_state*,               \
                                 const capacities&, cudaStream_t);                                                     \
    VOXELPIPE_CLEARS_OF(HOW, std::uint8_t)                                                                             \
    VOXELPIPE_CLEARS_OF(HOW, std::uint16_t)                                                                            \
    VOXELPIPE_CLEARS_OF(HOW, std::uint32_t)                                                                            \
    VOXELPIPE_CLEARS_OF(HOW, std::int32_t)                                                                             \
    VOXELPIPE_CLEARS_OF(HOW, std::uint64_t)                                                                            \
    VOXELPIPE_CLEARS_OF(HOW, float)                                                                                    \
    VOXELPIPE_KNOWN_TARGETS(HOW, 1)                                                                                    \
    VOXELPIPE_KNOWN_TARGETS(HOW, 2)                                                                                    \
    VOXELPIPE_KNOWN_TARGETS(HOW, 3)                                                                                    \
    HOW void mark_listed(const std::uint32_t*, const unsigned long long*, std::uint64_t, const chunk_marks&,           \
                         const pipeline_state*, const capacities&, cudaStream_t);

// In namespace voxelpipe: calls of voxelize and voxelize_async whose types are all the library's: bits of a surface,
// sums of a number, and the primitives of each voxel. A call of voxelize with a known coverage takes no kernels of its
// own.
#define VOXELPIPE_DRAWS(VALUE) std::span<const draw<mesh_view<>, passthrough, constant_output<VALUE>>>
#define VOXELPIPE_CALL(HOW, VALUE, COVERAGE, ...)                                                                      \
    HOW status cuda_backend::run(VOXELPIPE_DRAWS(VALUE), const grid&, __VA_ARGS__&, const voxelize_options&,           \
                                 std::uint64_t, COVERAGE);
#define VOXELPIPE_CALLS(HOW, VALUE, ...)                                                                               \
    VOXELPIPE_CALL(HOW, VALUE, core::known_coverage<>, __VA_ARGS__)                                                    \
    VOXELPIPE_CALL(HOW, VALUE, core::known_coverage<coverage::conservative>, __VA_ARGS__)                              \
    VOXELPIPE_CALL(HOW, VALUE, core::known_coverage<coverage::thin>, __VA_ARGS__)
#define VOXELPIPE_ASYNC_CALLS(HOW, VALUE, ...)                                                                         \
    HOW std::size_t workspace_bytes(VOXELPIPE_DRAWS(VALUE), const grid&, const __VA_ARGS__&, const voxelize_options&,  \
                                    const workspace_limits&);                                                          \
    HOW status voxelize_async<>(cuda_backend&, VOXELPIPE_DRAWS(VALUE), const grid&, const __VA_ARGS__&,                \
                                voxelize_options, const workspace_view&);

#define VOXELPIPE_BITS framebuffer_view<target<bit, blend::bit_or>>
#define VOXELPIPE_SUMS framebuffer_view<target<float, blend::add>>
#define VOXELPIPE_LISTS abuffer<cuda_backend, void>
#define VOXELPIPE_BIT_CALLS(HOW) VOXELPIPE_CALLS(HOW, bool, const VOXELPIPE_BITS)
#define VOXELPIPE_SUM_CALLS(HOW) VOXELPIPE_CALLS(HOW, float, const VOXELPIPE_SUMS)
#define VOXELPIPE_LIST_CALLS(HOW) VOXELPIPE_CALLS(HOW, bool, VOXELPIPE_LISTS)
#define VOXELPIPE_BIT_ASYNC_CALLS(HOW) VOXELPIPE_ASYNC_CALLS(HOW, bool, VOXELPIPE_BITS)
#define VOXELPIPE_SUM_ASYNC_CALLS(HOW) VOXELPIPE_ASYNC_CALLS(HOW, float, VOXELPIPE_SUMS)

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
namespace voxelpipe::device {
VOXELPIPE_VERTEX_SHADES(extern template)
VOXELPIPE_LIST_RASTERS(extern template)
VOXELPIPE_MASK_RASTERS(extern template)
VOXELPIPE_CLEARS(extern template)
} // namespace voxelpipe::device
#endif
