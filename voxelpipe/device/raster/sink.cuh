// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One draw of the raster, and the sink that takes its fragments: blending (raster/blend_sink.cuh), a mask of voxels
// (raster/mask_sink.cuh) or lists (fragments/list_sink.cuh). A sink has
//   stages_in_shared         whether settle(), which all lanes call between triangles, is wanted (feed)
//   place(x, y, z)    where a voxel lies, as something linear: ivec3, or numbers modulo 2^32
//   begin(triangle), row(x0, y, z, mask), cube(x, y, z, bits), voxels(bits, place), emit(place, wanted):
//                     the fragments of one triangle, as a row of bits along x, as 2 x 2 x 2 (blend_cube) or one by one
//   shares            whether one(x, y, z), a fragment of a triangle that has no other, is more than a row of one
//   emit_line(place, step, count): count fragments from a place on, step apart
//   spreads           whether a row costs by its voxels, so that lanes had better share long ones:
//   row_by_all(group, x0, y, z, mask): a row by group_lanes neighbours, all with the same arguments
//   mark_boxes(wanted, triangle), mark_row(x0, x1, y, z), mark_brick(corner, lane): told of what a triangle may touch
//                     before it comes, of a brick by each of group_lanes lanes
//   drop(class)       counts a triangle that is not drawn
//   takes_warp_rounds        whether a warp had better give it fragments by
//   rounds(count, is_done, next): thin ones of all lanes, one of each lane at a time: next() is the place of the next
//                     of this lane's `count`
//   share(count, of): thin ones of all lanes, 32 at a time whoever's they are: of(lane, i) is the place of a lane's i
//   row_rounds(is_done, next): rows of all lanes, one of each lane at a time, of at most 16 voxels: next(emit) calls
//                     emit(x0, y, z, bits), unless nothing is left of it; bits are one run

#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>

#include <cstdint>

namespace voxelpipe::device {

// One draw. Output says where its fragments go, and has the sink that takes them there: framebuffer_output, or
// list_output (fragments/list_sink.cuh).
template <coverage Rule, class Source, class Output>
struct raster_call {
    static constexpr coverage rule = Rule;
    using source_type = Source;
    using output = Output;
    using sink = typename Output::template sink<raster_call>;
    using deferred_sink = typename Output::template deferred_sink<raster_call>; // of the second kernel
    raster_input<Source> in;
    Output out;
    deferred_triangles lists;
};

// What every sink of a direct call does with triangles that are not drawn.
template <class Call>
struct sink_base {
    static constexpr bool takes_warp_rounds = false;
    const Call& call;
    unsigned* dropped; // by triangle_class, of the block

    __device__ VOXELPIPE_INLINE void drop(core::triangle_class kind) {
        atomicAdd(&dropped[static_cast<int>(kind)], 1u);
    }
    __device__ VOXELPIPE_INLINE static void mark_row(int, int, int, int) {}
    __device__ VOXELPIPE_INLINE static void mark_brick(const std::int32_t (&)[3], unsigned) {}
};

// Runs f, which gives a sink fragments, on all lanes of a warp. A sink that buffers them may find that there were too
// many, and then wants them once more.
template <class Sink, class F>
__device__ VOXELPIPE_INLINE void emit_with_retry(Sink& sink, F&& f) {
    if constexpr (Sink::stages_in_shared) {
        do {
            f();
            __syncwarp();
        } while (sink.commit());
    } else {
        f();
    }
}

} // namespace voxelpipe::device
