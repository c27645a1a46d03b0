// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage out of line, so that other triangles pay neither its registers nor its code: in 128 bits, for the few
// triangles that are too large for 64, and crosshairs and diagonals in either width. Spans come in batches.

#include <voxelpipe/core/arms.hpp>
#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/tuning/tuning_raster.hpp>

namespace voxelpipe::device {

struct wide_span {
    int u, v, w_first, w_last;
    glm::vec3 barycentric; // at the centre of the column
};

struct wide_triangle {
    int axis;
    bool zero_area, front_facing;
    glm::vec3 normal;
};

// Receives spans in order, keeps those from number `skip` on, as many as a batch has.
struct span_batch {
    wide_span (&out)[tuning::wide_batch];
    int skip, seen = 0, size = 0;

    __device__ void add(std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
        if (seen++ < skip || size == tuning::wide_batch) return;
        out[size++] = {static_cast<int>(u), static_cast<int>(v), static_cast<int>(w0), static_cast<int>(w1), {}};
    }
    // Call once, at the end. A loop and not part of add(), of which the compiler makes copies.
    template <class Int>
    __device__ int finish(const core::triangle_frame<Int>& t) {
#pragma unroll 1
        for (int i = 0; i < size; ++i) out[i].barycentric = core::barycentric(t, out[i].u, out[i].v);
        return size;
    }
};

// Writes the spans within `box` from number `skip` on. Returns how many; fewer than wide_batch at the end.
template <core::span_rule Rule>
__device__ __noinline__ int wide_spans(core::snapped_position a, core::snapped_position b, core::snapped_position c,
                                       int fraction, const core::voxel_box& box, int skip,
                                       wide_span (&out)[tuning::wide_batch]) {
    const auto t = core::setup_triangle<Rule, int128>(a, b, c, fraction);
    span_batch batch{out, skip};
    core::for_each_span<Rule>(
        t, box, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) { batch.add(u, v, w0, w1); });
    return batch.finish(t);
}

template <class Factors>
__device__ __noinline__ wide_triangle set_up_wide(core::snapped_position a, core::snapped_position b,
                                                  core::snapped_position c, int fraction, Factors factors) {
    const auto t = core::make_frame<int128>(a, b, c, fraction);
    return {t.axis, t.zero_area, t.normal[2] >= 0, core::unit_normal(t, factors)};
}

template <class Position>
__device__ __noinline__ glm::vec3 wide_barycentric(Position a, Position b, Position c, int fraction, std::int64_t u,
                                                   std::int64_t v) {
    return core::barycentric(core::make_frame<int128>(a, b, c, fraction), u, v);
}

// As wide_spans, for coverage by arms; Int as core::setup_arms has it.
template <class Int>
__device__ __noinline__ int arm_spans(core::snapped_position a, core::snapped_position b, core::snapped_position c,
                                      int fraction, core::arm_set arms, const core::voxel_box& box, int skip,
                                      wide_span (&out)[tuning::wide_batch]) {
    const auto t = core::setup_arms<Int>(a, b, c, fraction, arms);
    span_batch batch{out, skip};
    core::for_each_arm_span(
        t, box, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) { batch.add(u, v, w0, w1); });
    return batch.finish(t);
}
// As set_up_wide, for triangles of any size.
template <class Factors>
__device__ __noinline__ wide_triangle set_up_either_width(core::snapped_position a, core::snapped_position b,
                                                          core::snapped_position c, int fraction, Factors factors) {
    if (!core::fits_narrow(a, b, c, fraction)) return set_up_wide(a, b, c, fraction, factors);
    const auto t = core::make_frame<std::int64_t>(a, b, c, fraction);
    return {t.axis, t.zero_area, t.normal[2] >= 0, core::unit_normal(t, factors)};
}
template <class Visit>
__device__ void for_each_arm_span(core::snapped_position a, core::snapped_position b, core::snapped_position c,
                                  int fraction, core::arm_set arms, const core::voxel_box& box, Visit&& visit) {
    wide_span spans[tuning::wide_batch];
    for (int skip = 0;; skip += tuning::wide_batch) {
        const int n = core::fits_narrow(a, b, c, fraction)
                          ? arm_spans<std::int64_t>(a, b, c, fraction, arms, box, skip, spans)
                          : arm_spans<int128>(a, b, c, fraction, arms, box, skip, spans);
        for (int i = 0; i < n; ++i) visit(spans[i]);
        if (n < tuning::wide_batch) break;
    }
}

// Calls visit(span) for every span of a triangle that fits_narrow refuses.
template <core::span_rule Rule, class Visit>
__device__ void for_each_wide_span(core::snapped_position a, core::snapped_position b, core::snapped_position c,
                                   int fraction, const core::voxel_box& box, Visit&& visit) {
    wide_span spans[tuning::wide_batch];
    for (int skip = 0;; skip += tuning::wide_batch) {
        const int n = wide_spans<Rule>(a, b, c, fraction, box, skip, spans);
        for (int i = 0; i < n; ++i) visit(spans[i]);
        if (n < tuning::wide_batch) break;
    }
}

} // namespace voxelpipe::device
