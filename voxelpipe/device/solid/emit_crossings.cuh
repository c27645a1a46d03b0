// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Every crossing of the draws' triangles with rows, into a list or straight into bits. The first kernel looks at all
// triangles: most small ones lie between the centres of all rows and end there. The second one takes what is left, so
// that its lanes are all busy: a triangle of few rows a thread, and larger ones cut into work items of 32 lines of
// rows, a line a lane of a warp, which all warps share.

#include <voxelpipe/device/solid/crossing_list.cuh>
#include <voxelpipe/device/solid/solid_source.cuh>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr int small_lines = 8;     // rows of one z, which one thread takes of a triangle
inline constexpr int small_line = 32;     // and rows in each
inline constexpr int lines_per_item = 32; // one a lane
inline constexpr int rows_per_line = 256; // of an item

// ---- where crossings go ---------------------------------------------------------------------------------------------

// Into the list, behind what is there. Order does not show.
struct crossing_appender {
    static constexpr bool is_listing = true;
    crossing_list list;
    bool is_split;           // a body a draw
    std::uint32_t num_draws; // the cones of body k are draw num_draws + k

    __device__ VOXELPIPE_INLINE void emit(const row_grid& grid, unsigned long long at, std::uint32_t draw,
                                          std::int64_t y, std::int64_t z, std::int64_t first, int winding) const {
        list.store(at, grid.row(y, z),
                   !is_split          ? 0
                   : draw < num_draws ? draw
                                      : draw - num_draws,
                   entry_value::of(grid.position(first), winding > 0 ? entry_kind::enter : entry_kind::leave));
    }
};

// Of bits in rows, the first one behind the crossing changes; what lies further is for a later pass
// (solid/parity_rows.cuh). Rows that are crossed are marked, each by a bit, and those that are crossed behind the
// part an odd number of times.
struct crossing_toggler {
    static constexpr bool is_listing = false;
    word *bits, *marked, *odd_behind;
    std::uint32_t words_x;

    __device__ VOXELPIPE_INLINE void emit(const row_grid& grid, unsigned long long, std::uint32_t, std::int64_t y,
                                          std::int64_t z, std::int64_t first, int) const {
        const std::uint64_t row = grid.row(y, z);
        const std::uint32_t x = grid.position(first);
        const word bit = 1u << (row & 31);
        if ((__ldcg(marked + row / 32) & bit) == 0) atomicOr(marked + row / 32, bit); // maybe an old word
        if (x < static_cast<std::uint32_t>(grid.extent.x))
            atomicXor(bits + row * words_x + x / 32, 1u << (x & 31));
        else
            atomicXor(odd_behind + row / 32, bit);
    }
};

// ---- triangles that have rows ---------------------------------------------------------------------------------------

// Numbers of triangles in one array: those of few rows from its start on, those that are cut from its end. These have
// the number of their first work item, by which a warp finds an item's triangle.
struct row_triangles {
    static constexpr int item_bits = 36;
    static constexpr unsigned long long item_mask = (1ull << item_bits) - 1;
    std::uint32_t* triangles;
    unsigned long long* first_items;
    std::uint32_t capacity;
    unsigned long long* num_small;  // in the state, as what follows
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
        l.num_small = &state->deferred.lengths[0];
        l.next_large = &state->deferred.split;
        return l;
    }
    // Whether the numbers of a call fit: at most so many items a triangle.
    [[nodiscard]] static bool holds(std::uint64_t num_triangles, const glm::ivec3& extent) {
        const auto parts = [](int n, int part) { return static_cast<std::uint64_t>((n + part - 1) / part); };
        return num_triangles < (std::uint64_t{1} << (64 - item_bits)) &&
               num_triangles * parts(extent.z, lines_per_item) * parts(extent.y, rows_per_line) <
                   (std::uint64_t{1} << item_bits);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t& large(unsigned long long i) const {
        return triangles[capacity - 1 - i];
    }
};

// The work items of a triangle.
struct item_grid {
    std::uint32_t by_z, by_y;
    __device__ VOXELPIPE_INLINE explicit item_grid(const core::row_box& rows)
        : by_z(static_cast<std::uint32_t>((rows.v.hi - rows.v.lo) / lines_per_item + 1)),
          by_y(static_cast<std::uint32_t>((rows.u.hi - rows.u.lo) / rows_per_line + 1)) {}
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
inline constexpr int wide_line_batch = 8;
[[nodiscard]] __device__ __noinline__ inline core::index_span wide_line(const core::snapped_position* p, int fraction,
                                                                        const crossing_line& line, int& winding,
                                                                        std::int64_t (&first)[wide_line_batch]) {
    const auto t = core::setup_crossings<0, core::centre_offset<>, int128>(p[0], p[1], p[2], fraction, true);
    winding = t.winding;
    core::index_span found{0, -1};
    if (t.winding == 0) return found;
    std::int64_t lo = line.y.lo - t.origin[0], hi = line.y.hi - t.origin[0];
    core::narrow_row(t.edge, static_cast<int128>(line.z - t.origin[1]), lo, hi);
    if (lo > hi) return found;
    found = {lo + t.origin[0], hi + t.origin[0]};
    const core::index_span some{found.lo,
                                found.hi - found.lo < wide_line_batch ? found.hi : found.lo + wide_line_batch - 1};
    core::for_each_crossing_in_row(t, line.z, some, [&](std::int64_t y, std::int64_t w) { first[y - found.lo] = w; });
    return found;
}

// A triangle of which a lane has a line: how many crossings that has, and what they are.
struct line_of_triangle {
    const solid_triangle& t;
    int fraction;
    crossing_line line;
    bool is_narrow;
    core::crossing_setup<std::int64_t> narrow;

    __device__ VOXELPIPE_INLINE line_of_triangle(const solid_triangle& t_, int fraction_, const crossing_line& line_)
        : t(t_), fraction(fraction_), line(line_), is_narrow(true) {
        narrow.winding = 0;
        if (line.y.empty()) return; // and no triangle, maybe
        is_narrow = core::fits_narrow(t.p[0], t.p[1], t.p[2], fraction);
        if (is_narrow)
            narrow = core::setup_crossings<0, core::centre_offset<>, std::int64_t>(t.p[0], t.p[1], t.p[2], fraction,
                                                                                   line.y.lo != line.y.hi);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t count() const {
        core::index_span found{0, -1};
        if (!is_narrow) {
            int winding;
            std::int64_t first[wide_line_batch];
            found = wide_line(t.p, fraction, line, winding, first);
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
        std::int64_t first[wide_line_batch];
        for (;;) {
            const core::index_span found = wide_line(t.p, fraction, rest, winding, first);
            if (found.empty()) return;
            for (int k = 0; k < wide_line_batch && found.lo + k <= found.hi; ++k)
                emit(found.lo + k, rest.z, first[k], winding);
            rest.y = {found.lo + wide_line_batch, found.hi};
            if (rest.y.empty()) return;
        }
    }
};

// ---- kernels --------------------------------------------------------------------------------------------------------

// Adds up the classes of a block's triangles. All threads take part.
__device__ inline void count_classes(bool valid, bool index_ok, core::triangle_class kind, pipeline_state* state) {
    using core::triangle_class;
    const bool is_dropped = valid && index_ok && kind != triangle_class::drawn;
    const int drawn = __syncthreads_count(static_cast<int>(valid && index_ok && !is_dropped));
    if (threadIdx.x == 0 && drawn != 0) atomicAdd(&state->drawn, static_cast<unsigned long long>(drawn));
    if (__syncthreads_or(static_cast<int>(is_dropped || (valid && !index_ok))) == 0) return;
    const auto add = [&](triangle_class which, unsigned long long* total) {
        const int count = __syncthreads_count(static_cast<int>(is_dropped && kind == which));
        if (threadIdx.x == 0 && count != 0) atomicAdd(total, static_cast<unsigned long long>(count));
    };
    add(triangle_class::nonfinite, &state->nonfinite);
    add(triangle_class::too_far, &state->too_far);
    add(triangle_class::outside, &state->outside);
    if (valid && !index_ok) atomicOr(&state->index_error, 1u);
}

// Memory that is to be zero before crossings come: whole uint4s, or none.
struct zeroed_memory {
    uint4* to = nullptr;
    std::uint64_t count = 0;
};

// Counts all triangles by class and keeps the numbers of those that have rows. Meanwhile it writes zeros, which takes
// no kernel then.
template <class Source>
__global__ __launch_bounds__(threads_per_block) void find_rows_kernel(const __grid_constant__ Source source,
                                                                      const __grid_constant__ row_grid grid,
                                                                      const __grid_constant__ row_triangles kept,
                                                                      const __grid_constant__ zeroed_memory zeros,
                                                                      pipeline_state* state) {
    await_stream();
    if (zeros.count != 0 && state->index_error == 0) // of a check in front, which no block here changes then
        for (std::uint64_t k = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; k < zeros.count;
             k += std::uint64_t{gridDim.x} * blockDim.x)
            zeros.to[k] = uint4{0, 0, 0, 0};
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const bool valid = i < source.num_triangles;
    solid_triangle t;
    if (valid) t = load_solid_triangle(source, grid, static_cast<std::uint32_t>(i));
    const bool has_rows = !t.rows.empty();
    const bool is_large =
        has_rows && (t.rows.v.hi - t.rows.v.lo >= small_lines || t.rows.u.hi - t.rows.u.lo >= small_line ||
                     !core::fits_narrow(t.p[0], t.p[1], t.p[2], grid.fraction));
    count_classes(valid && source.is_counted(i), t.index_ok, t.kind, state);
    if (__syncthreads_or(static_cast<int>(has_rows)) == 0) return;
    const unsigned long long at = reserve_for_block(has_rows && !is_large ? 1 : 0, kept.num_small);
    if (has_rows && !is_large) kept.triangles[at] = static_cast<std::uint32_t>(i);
    if (__syncthreads_or(static_cast<int>(is_large)) == 0) return;
    const unsigned long long items = is_large ? item_grid(t.rows).count() : 0;
    const unsigned long long large =
        reserve_for_block(is_large ? 1ull << row_triangles::item_bits | items : 0, kept.next_large);
    if (!is_large) return;
    kept.large(large >> row_triangles::item_bits) = static_cast<std::uint32_t>(i);
    kept.first_items[large >> row_triangles::item_bits] = large & row_triangles::item_mask;
}

// The crossings of a triangle of few rows, by one thread. Counted before they are listed. All threads of the block
// take part, maybe without a triangle.
template <class Source, class Sink>
__device__ VOXELPIPE_INLINE std::uint32_t emit_small(const Source& source, const row_grid& grid, const Sink& sink,
                                                     bool valid, std::uint32_t triangle, pipeline_state* state) {
    solid_triangle t;
    core::crossing_setup<std::int64_t> setup;
    setup.winding = 0;
    if (valid) {
        t = load_solid_triangle(source, grid, triangle);
        setup = core::setup_crossings<0, core::centre_offset<>, std::int64_t>(t.p[0], t.p[1], t.p[2], grid.fraction,
                                                                              t.rows.u.lo != t.rows.u.hi);
    }
    const std::int64_t end = setup.winding != 0 ? t.rows.v.hi + 1 : t.rows.v.lo;
    std::uint32_t n = 0;
    unsigned long long at = 0;
    if constexpr (Sink::is_listing) {
        for (std::int64_t z = t.rows.v.lo; z < end; ++z) {
            std::int64_t lo = t.rows.u.lo - setup.origin[0], hi = t.rows.u.hi - setup.origin[0];
            core::narrow_row(setup.edge, z - setup.origin[1], lo, hi);
            n += lo <= hi ? static_cast<std::uint32_t>(hi - lo + 1) : 0;
        }
        at = reserve_for_block(n, &state->list_fragments);
        if (n == 0) return 0;
    }
    for (std::int64_t z = t.rows.v.lo; z < end; ++z)
        core::for_each_crossing_in_row(setup, z, t.rows.u,
                                       [&](std::int64_t y, std::int64_t first) VOXELPIPE_INLINE_LAMBDA {
                                           sink.emit(grid, at++, t.draw, y, z, first, setup.winding);
                                           if constexpr (!Sink::is_listing) ++n;
                                       });
    return n;
}

// The crossings of a work item, by a warp. All threads of the block take part, maybe without an item.
template <class Source, class Sink>
__device__ VOXELPIPE_INLINE std::uint32_t emit_item(const Source& source, const row_grid& grid, const Sink& sink,
                                                    const row_triangles& kept, bool valid, unsigned long long item,
                                                    std::uint32_t num_triangles, pipeline_state* state) {
    solid_triangle t;
    crossing_line line{0, {0, -1}};
    if (valid) {
        std::uint32_t lo = 0, hi = num_triangles; // the last one that begins at or before the item
        while (hi - lo > 1) {
            const std::uint32_t middle = lo + (hi - lo) / 2;
            if (kept.first_items[middle] <= item)
                lo = middle;
            else
                hi = middle;
        }
        t = load_solid_triangle(source, grid, kept.large(lo));
        const item_grid parts(t.rows);
        const auto part = static_cast<std::uint32_t>(item - kept.first_items[lo]);
        line.z = t.rows.v.lo + std::int64_t{part % parts.by_z} * lines_per_item + threadIdx.x % 32;
        line.y.lo = t.rows.u.lo + std::int64_t{part / parts.by_z} * rows_per_line;
        line.y.hi = line.y.lo + rows_per_line - 1 < t.rows.u.hi ? line.y.lo + rows_per_line - 1 : t.rows.u.hi;
        if (line.z > t.rows.v.hi) line.y.hi = line.y.lo - 1;
    }
    const line_of_triangle crossings(t, grid.fraction, line);
    std::uint32_t n = 0;
    unsigned long long at = 0;
    if constexpr (Sink::is_listing) {
        n = line.y.empty() ? 0 : crossings.count();
        at = reserve_for_block(n, &state->list_fragments);
    }
    if (!line.y.empty())
        crossings.for_each([&](std::int64_t y, std::int64_t z, std::int64_t first, int winding)
                               VOXELPIPE_INLINE_LAMBDA {
                                   sink.emit(grid, at++, t.draw, y, z, first, winding);
                                   if constexpr (!Sink::is_listing) ++n;
                               });
    return n;
}

// What find_rows_kernel has kept.
template <class Source, class Sink>
__global__ __launch_bounds__(threads_per_block, 2) void emit_crossings_kernel(
    const __grid_constant__ Source source, const __grid_constant__ row_grid grid, const __grid_constant__ Sink sink,
    const __grid_constant__ row_triangles kept, pipeline_state* state) {
    constexpr unsigned warps = threads_per_block / 32;
    await_stream();
    if (state->index_error != 0) return;
    const unsigned long long num_small = *kept.num_small, items = *kept.next_large & row_triangles::item_mask;
    const auto num_large = static_cast<std::uint32_t>(*kept.next_large >> row_triangles::item_bits);
    unsigned long long n = 0;
    for (unsigned long long start = std::uint64_t{blockIdx.x} * threads_per_block; start < num_small;
         start += std::uint64_t{gridDim.x} * threads_per_block) {
        const unsigned long long i = start + threadIdx.x;
        n += emit_small(source, grid, sink, i < num_small, i < num_small ? kept.triangles[i] : 0, state);
    }
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

// Every crossing of the source's triangles. kept: with(state).
template <class Source, class Sink>
void emit_crossings(const Source& source, const row_grid& grid, const Sink& sink, const row_triangles& kept,
                    const zeroed_memory& zeros, pipeline_state* state, cudaStream_t stream) {
    launch_behind(find_rows_kernel<Source>, num_blocks(source.num_triangles), threads_per_block, stream,
                  stage::coarse_raster, source, grid, kept, zeros, state);
    launch_behind(emit_crossings_kernel<Source, Sink>, static_cast<unsigned>(num_multiprocessors()) * 2,
                  threads_per_block, stream, stage::coarse_raster, source, grid, sink, kept, state);
}

} // namespace voxelpipe::device
