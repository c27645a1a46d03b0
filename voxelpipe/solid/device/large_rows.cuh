// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crossings of triangles that the first pass (solid/device/small_rows.cuh) leaves: those of many rows, and those beyond
// 32 bits. They are cut into work items of 32 lines of rows, a line a lane of a warp, which all warps share.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/solid/device/crossing_sinks.cuh>
#include <voxelpipe/tuning/tuning_solid.hpp>

#include <cstdint>

namespace voxelpipe::device {

// ---- triangles of many rows -----------------------------------------------------------------------------------------

// Numbers of triangles, each with the number of its first work item, by which a warp finds an item's triangle.
struct row_triangles {
    static constexpr int item_bits = 36;
    static constexpr unsigned long long item_mask = (1ull << item_bits) - 1;
    std::uint32_t* triangles;
    unsigned long long* first_items;
    std::uint32_t capacity;
    unsigned long long* next_large; // packs how many there are and their items, so that one atomic places both

    [[nodiscard]] static row_triangles take(arena& memory, std::uint32_t num_triangles) {
        row_triangles l{};
        l.capacity = num_triangles;
        l.triangles = memory.take<std::uint32_t>(num_triangles);
        l.first_items = memory.take<unsigned long long>(num_triangles);
        return l;
    }
    [[nodiscard]] row_triangles with(pipeline_state* state) const {
        row_triangles l = *this;
        l.next_large = &state->solid.next_large;
        return l;
    }
    // True if the numbers of a call fit, with the most items that a triangle can have.
    [[nodiscard]] static bool holds(std::uint64_t num_triangles, const glm::ivec3& extent) {
        const auto parts = [](int n, int part) { return static_cast<std::uint64_t>((n + part - 1) / part); };
        return num_triangles < (std::uint64_t{1} << (64 - item_bits)) &&
               num_triangles * parts(extent.z, tuning::lines_per_item) * parts(extent.y, tuning::rows_per_line) <
                   (std::uint64_t{1} << item_bits);
    }
};

// The work items of a triangle.
struct item_grid {
    std::uint32_t by_z, by_y;
    __device__ VOXELPIPE_INLINE explicit item_grid(const core::row_box& rows)
        : by_z(static_cast<std::uint32_t>((rows.v.hi - rows.v.lo) / tuning::lines_per_item + 1)),
          by_y(static_cast<std::uint32_t>((rows.u.hi - rows.u.lo) / tuning::rows_per_line + 1)) {}
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long count() const {
        return static_cast<unsigned long long>(by_z) * by_y;
    }
};

// One line of a triangle's rows, those of one z.
struct crossing_line {
    std::int64_t z;
    core::index_span y;
};

// The crossings of a line, in the 128-bit path: out of line, as in scene/int128_coverage.cuh. Returns which rows of the
// line they are, and of the first 8 at most the voxels.
[[nodiscard]] __device__ __noinline__ inline core::index_span
wide_line(const core::snapped_position* p, int fraction, const crossing_line& line, int& winding,
          std::int64_t (&first)[tuning::wide_line_batch]) {
    const auto t = core::setup_crossings<0, core::centre_offset<>, int128>(p[0], p[1], p[2], fraction, true);
    winding = t.winding;
    core::index_span found{0, -1};
    if (t.winding == 0) return found;
    std::int64_t lo = line.y.lo - t.origin[0], hi = line.y.hi - t.origin[0];
    core::narrow_row(t.edge, static_cast<int128>(line.z - t.origin[1]), lo, hi);
    if (lo > hi) return found;
    found = {lo + t.origin[0], hi + t.origin[0]};
    const core::index_span some{
        found.lo, found.hi - found.lo < tuning::wide_line_batch ? found.hi : found.lo + tuning::wide_line_batch - 1};
    core::for_each_crossing_in_row(t, line.z, some, [&](std::int64_t y, std::int64_t w) { first[y - found.lo] = w; });
    return found;
}

// A triangle of which a lane has a line: how many crossings that has, and what they are.
struct line_of_triangle {
    const core::snapped_position (&p)[3];
    int fraction;
    crossing_line line;
    bool is_narrow;
    core::crossing_setup<std::int64_t> narrow;

    __device__ VOXELPIPE_INLINE line_of_triangle(const core::snapped_position (&p_)[3], int fraction_,
                                                 const crossing_line& line_)
        : p(p_), fraction(fraction_), line(line_), is_narrow(true) {
        narrow.winding = 0;
        if (line.y.empty()) return; // and no triangle, maybe
        is_narrow = core::fits_narrow(p[0], p[1], p[2], fraction);
        if (is_narrow)
            narrow = core::setup_crossings<0, core::centre_offset<>, std::int64_t>(p[0], p[1], p[2], fraction,
                                                                                   line.y.lo != line.y.hi);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t count() const {
        core::index_span found{0, -1};
        if (!is_narrow) {
            int winding;
            std::int64_t first[tuning::wide_line_batch];
            found = wide_line(p, fraction, line, winding, first);
        } else if (narrow.winding != 0) {
            found = {line.y.lo - narrow.origin[0], line.y.hi - narrow.origin[0]};
            core::narrow_row(narrow.edge, line.z - narrow.origin[1], found.lo, found.hi);
        }
        return found.empty() ? 0 : static_cast<std::uint32_t>(found.hi - found.lo + 1);
    }
    // emit(y, z, first voxel behind, winding)
    template <class Emit>
    __device__ VOXELPIPE_INLINE void for_each(Emit&& emit) const {
        if (is_narrow) {
            if (narrow.winding == 0) return;
            core::for_each_crossing_in_row(narrow, line.z, line.y,
                                           [&](std::int64_t y, std::int64_t first)
                                               VOXELPIPE_INLINE_LAMBDA { emit(y, line.z, first, narrow.winding); });
            return;
        }
        crossing_line rest = line;
        int winding = 0;
        std::int64_t first[tuning::wide_line_batch];
        for (;;) {
            const core::index_span found = wide_line(p, fraction, rest, winding, first);
            if (found.empty()) return;
            for (int k = 0; k < tuning::wide_line_batch && found.lo + k <= found.hi; ++k)
                emit(found.lo + k, rest.z, first[k], winding);
            rest.y = {found.lo + tuning::wide_line_batch, found.hi};
            if (rest.y.empty()) return;
        }
    }
};

// ---- the pass over work items ---------------------------------------------------------------------------------------

// The crossings of a work item, by a warp. All threads of the block take part, maybe without an item.
template <class Source, class Sink>
__device__ VOXELPIPE_INLINE std::uint32_t emit_item(const Source& source, const row_grid& grid, const Sink& sink,
                                                    const row_triangles& kept, bool valid, unsigned long long item,
                                                    std::uint32_t num_triangles, pipeline_state* state) {
    core::snapped_position p[3]{};
    crossing_line line{0, {0, -1}};
    std::uint32_t draw = 0;
    if (valid) {
        const std::uint32_t triangle =
            core::bisect_last(0u, num_triangles, [&](std::uint32_t i) { return kept.first_items[i] <= item; });
        const auto at = source.locate(kept.triangles[triangle]);
        draw = at.draw;
        p[0] = source.exact(at, at.index.x);
        p[1] = source.exact(at, at.index.y);
        p[2] = source.exact(at, at.index.z);
        const core::row_box rows = core::rows_within<0>(p[0], p[1], p[2], grid.fraction, grid.whole_box());
        const item_grid parts(rows);
        const auto part = static_cast<std::uint32_t>(item - kept.first_items[triangle]);
        line.z = rows.v.lo + std::int64_t{part % parts.by_z} * tuning::lines_per_item + threadIdx.x % 32;
        line.y.lo = rows.u.lo + std::int64_t{part / parts.by_z} * tuning::rows_per_line;
        line.y.hi =
            line.y.lo + tuning::rows_per_line - 1 < rows.u.hi ? line.y.lo + tuning::rows_per_line - 1 : rows.u.hi;
        if (line.z > rows.v.hi) line.y.hi = line.y.lo - 1;
    }
    const line_of_triangle crossings(p, grid.fraction, line);
    std::uint32_t n = 0;
    unsigned long long at = 0;
    if constexpr (Sink::is_listing) {
        n = line.y.empty() ? 0 : crossings.count();
        at = reserve_for_block(n, &state->list_fragments);
    }
    if (!line.y.empty())
        crossings.for_each([&](std::int64_t y, std::int64_t z, std::int64_t first, int winding)
                               VOXELPIPE_INLINE_LAMBDA {
                                   sink.emit(grid, at++, draw, grid.row(y, z), first, winding);
                                   if constexpr (!Sink::is_listing) ++n;
                               });
    return n;
}

template <class Source, class Sink>
__global__ __launch_bounds__(threads_per_block, tuning::large_row_blocks) void large_rows_kernel(
    const __grid_constant__ Source source, const __grid_constant__ row_grid grid, const __grid_constant__ Sink sink,
    const __grid_constant__ row_triangles kept, pipeline_state* state) {
    constexpr unsigned warps = threads_per_block / 32;
    await_stream();
    const unsigned long long items = *kept.next_large & row_triangles::item_mask;
    const auto num_large = static_cast<std::uint32_t>(*kept.next_large >> row_triangles::item_bits);
    unsigned long long n = 0;
    for (unsigned long long start = std::uint64_t{blockIdx.x} * warps; start < items;
         start += std::uint64_t{gridDim.x} * warps) {
        const unsigned long long item = start + warp_in_block();
        n += emit_item(source, grid, sink, kept, item < items, item, num_large, state);
    }
    if constexpr (!Sink::is_listing) {
        const unsigned long long sum = block_sum(n);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->solid.crossings, sum);
    }
}

} // namespace voxelpipe::device
