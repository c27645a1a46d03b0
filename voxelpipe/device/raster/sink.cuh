// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The interface between raster and sinks, and one draw of the raster. A sink takes the fragments of triangles: it
// blends them into targets (raster/blend_sink.cuh), sets bits of a mask (raster/mask_sink.cuh) or lists them
// (fragments/list_sink.cuh). A new kind of output is a new sink; nothing else in raster/ changes.

#include <voxelpipe/core/slim_box.hpp>
#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>

#include <concepts>
#include <cstdint>

namespace voxelpipe::device {

// Each thread has a sink of its own. Voxels are (x, y, z) of the grid; `mask` has a bit for each voxel of a row along
// x, lowest first. Some sinks have more members: commit() if fragments are staged; one(x, y, z), mark_boxes and
// mark_brick if equal voxels are merged; row_by_all(lanes, x, y, z, mask) if long rows are split; rounds, share and
// row_rounds if rounds are taken; emit_line(position, step, count), fragments one step apart, if they are staged or
// only bits are set.
template <class Sink>
concept fragment_sink = requires(Sink sink, const glm::uvec3& indices, std::uint32_t triangle, int x, int y, int z,
                                 word mask, pipeline_state* state) {
    // ---- properties, at compile time ----
    // commit() takes part in every triangle: fragments are staged in shared memory of the warp (emit_with_retry).
    { Sink::stages_in_shared } -> std::convertible_to<bool>;
    // one(x, y, z) merges equal voxels of neighbouring lanes; otherwise it is a row of one voxel.
    { Sink::merges_equal_voxels } -> std::convertible_to<bool>;
    // A row costs by its voxels, so group_lanes lanes share a long one: row_by_all.
    { Sink::splits_long_rows } -> std::convertible_to<bool>;
    // Lanes pass their fragments in rounds, one each: rounds, distribute and row_rounds.
    { Sink::takes_warp_rounds } -> std::convertible_to<bool>;

    // ---- triangles ----
    { sink.check(indices) } -> std::same_as<bool>; // true if the indices name vertices; otherwise notes the error
    sink.begin(triangle);                          // the next fragments belong to this triangle
    sink.drop(core::triangle_class{});             // counts a triangle that is not drawn

    // ---- fragments ----
    // Position of a voxel, linear in x, y and z: ivec3, or a number modulo 2^32. emit(position, wanted) takes one
    // fragment.
    sink.position(x, y, z);
    sink.row(x, y, z, mask);               // a row from (x, y, z) on
    sink.cube(x, y, z, mask);              // 2 x 2 x 2 voxels from (x, y, z) on, x first: 8 bits
    sink.slim(x, y, z, core::slim_rows{}); // rows of a box that is one voxel wide along two axes or three long

    // ---- voxels that a triangle may touch, before its fragments come ----
    sink.mark_row(x, x, y, z); // a part of a row of a split triangle

    // ---- the end ----
    sink.take_over(sink.end()); // moves counts from one sink of a thread to another
    sink.finish(state);         // adds up the counts of a block; all of its threads call it
};

// One draw. Output says where its fragments go, and names the sinks of the first pass and of the deferred pass. Its
// compile-time members:
//   defers                  the first pass leaves larger triangles to the deferred pass; otherwise block_pass.cuh
//   may_draw_few            blocks of the first pass can draw what they would defer, if it is little (deferral)
//   only_blends             all targets are in use and blended in place, and no chunk is marked
//   only_sets               all targets are in use and blended in place, and all values are true
template <coverage Rule, class Source, class Output>
struct raster_call {
    static constexpr coverage rule = Rule;
    using source_type = Source;
    using output = Output;
    using sink = typename Output::template sink<raster_call>;
    using deferred_sink = typename Output::template deferred_sink<raster_call>;
    raster_input<Source> in;
    Output out;
    deferred_triangles lists;
};

// Base of every sink of a raster_call: counts triangles that are not drawn; marks nothing.
template <class Call>
struct sink_base {
    static constexpr bool takes_warp_rounds = false;
    const Call& call;
    unsigned* dropped; // the block's counts, by triangle_class

    __device__ VOXELPIPE_INLINE void drop(core::triangle_class kind) {
        atomicAdd(&dropped[static_cast<int>(kind)], 1u);
    }
    __device__ VOXELPIPE_INLINE static void mark_row(int, int, int, int) {}
    __device__ VOXELPIPE_INLINE static void mark_brick(const std::int32_t (&)[3], unsigned) {}
};

// Runs f, which passes the fragments of one triangle to a sink, on all lanes of a warp; again, as long as the sink's
// staging memory was too small for them.
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
