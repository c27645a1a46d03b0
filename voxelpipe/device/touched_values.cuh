// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Values of targets from bits that say which voxels are touched (touched_grid.cuh).

#include <voxelpipe/device/clear_target.cuh>
#include <voxelpipe/device/tracked_clear.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace voxelpipe::device {

// What fragments of a value make of a voxel that holds another.
template <class Target>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE typename Target::value_type
blended_once(const typename Target::value_type& old, const typename Target::value_type& value) {
    auto a = Target::traits::begin(old);
    Target::traits::apply(a, value);
    return typename Target::value_type(Target::traits::end(a));
}

// How the values of a target are ended: `touched` gives bit x of a row of words, `made` is what the fragments' value
// makes of a cleared voxel. By all threads of a grid.
template <class Target>
struct value_writer {
    using map = typename Target::map;
    using value_type = typename Target::value_type;
    static constexpr bool goes_wide =
        !map::bricks && !map::planes && sizeof(value_type) <= 16 && 16 % sizeof(value_type) == 0;
    static constexpr unsigned batch = 4; // loads that go out together

    const word* touched;
    const target_view<Target>& t;
    const value_type& value;
    std::uint32_t nx = static_cast<std::uint32_t>(t.extent.x), ny = static_cast<std::uint32_t>(t.extent.y);
    std::uint32_t words_x = (nx + 31) / 32, rows = ny * static_cast<std::uint32_t>(t.extent.z);

    // A cleared target of rows whose values fill 16 bytes, in order.
    __device__ VOXELPIPE_INLINE void fill_wide() const {
        constexpr unsigned per_store = 16 / sizeof(value_type);
        const value_type made = blended_once<Target>(t.clear_value, value);
        auto* const to = reinterpret_cast<uint4*>(t.elements);
        const std::uint64_t stores = std::uint64_t{rows} * nx / per_store,
                            per_block = std::uint64_t{batch} * blockDim.x;
        for (std::uint64_t first = blockIdx.x * per_block; first < stores; first += gridDim.x * per_block) {
            word bits[batch];
            for (unsigned b = 0; b < batch; ++b) {
                const std::uint64_t i = first + b * blockDim.x + threadIdx.x, at = i * per_store;
                if (i >= stores) break;
                if (nx % 32 == 0) {
                    bits[b] = touched[at / 32] >> at % 32;
                } else {
                    const auto row = static_cast<std::uint32_t>(at / nx);
                    const auto x = static_cast<std::uint32_t>(at - std::uint64_t{row} * nx);
                    bits[b] = touched[std::uint64_t{row} * words_x + x / 32] >> x % 32;
                }
            }
            for (unsigned b = 0; b < batch; ++b) {
                const std::uint64_t i = first + b * blockDim.x + threadIdx.x;
                if (i >= stores) break;
                value_type values[per_store];
                for (unsigned k = 0; k < per_store; ++k) values[k] = (bits[b] >> k & 1u) != 0 ? made : t.clear_value;
                uint4 wide;
                memcpy(&wide, values, 16);
                to[i] = wide;
            }
        }
    }
    // Any other: with `fill`, voxels that are not touched get the clear value. A warp takes 32 words at once. Where
    // there are marks, what is touched is marked.
    __device__ VOXELPIPE_INLINE void write(bool fill, const chunk_marks& marks) const {
        const std::uint64_t words = std::uint64_t{rows} * words_x, threads = std::uint64_t{gridDim.x} * blockDim.x;
        const std::uint32_t lane = threadIdx.x % 32;
        const bool is_cleared = t.load == load_operation::clear;
        for (std::uint64_t first = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x - lane; first < words;
             first += threads) {
            const word mine = first + lane < words ? touched[first + lane] : 0;
            const unsigned wanted = __ballot_sync(0xffffffffu, fill ? first + lane < words : mine != 0);
            for (unsigned rest = wanted; rest != 0; rest &= rest - 1) {
                const int from = __ffs(static_cast<int>(rest)) - 1;
                const word bits = __shfl_sync(0xffffffffu, mine, from);
                const std::uint64_t at = first + static_cast<unsigned>(from);
                const auto row = static_cast<std::uint32_t>(at / words_x);
                const auto x = static_cast<std::uint32_t>(at - std::uint64_t{row} * words_x) * 32 + lane;
                if (x >= nx) continue;
                const auto y = static_cast<int>(row % ny), z = static_cast<int>(row / ny);
                static_assert(chunk_x == 32);
                if (marks.words != nullptr && bits != 0 && x % 32 == 0)
                    marks.mark_row(static_cast<int>(x), static_cast<int>(x), y, z);
                if ((bits >> lane & 1u) != 0)
                    t.store(static_cast<int>(x), y, z,
                            blended_once<Target>(is_cleared ? t.clear_value : t(static_cast<int>(x), y, z), value));
                else if (fill)
                    t.store(static_cast<int>(x), y, z, t.clear_value);
            }
        }
    }
};

template <class Target>
__global__ __launch_bounds__(threads_per_block) void end_values_kernel(
    const word* touched, const __grid_constant__ target_view<Target> t,
    const __grid_constant__ typename Target::value_type value, const __grid_constant__ chunk_marks marks,
    bool is_filled, const pipeline_state* state, capacities limits) {
    using writer = value_writer<Target>;
    await_stream();
    if (state->index_error != 0 || misses_triangles(*state, limits)) return;
    const writer w{touched, t, value};
    if constexpr (writer::goes_wide) {
        if (is_filled && static_cast<unsigned>(t.extent.x) * sizeof(value) % 16 == 0 &&
            reinterpret_cast<std::uintptr_t>(t.elements) % 16 == 0) {
            w.fill_wide();
            return;
        }
    }
    w.write(is_filled, marks);
}
// Of a target that is not cleared by chunks; bricks that are cleared have been, with their padding.
template <class Target, class Tracking>
void end_values(const word* touched, const target_view<Target>& t, const typename Target::value_type& value,
                const Tracking& tracking, const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    // By blocks that end, as in clear_target.
    const std::uint64_t bytes = Target::map::elements(t.extent) * sizeof(typename Target::element_type),
                        blocks = std::min(bytes / (16 * fill_stores * threads_per_block) + 1, core::most_blocks);
    // Where other targets are cleared by chunks, the log will know nothing of this one.
    const bool fills = t.load == load_operation::clear && !Target::map::bricks,
               marks = !fills && !tracking.changes_known;
    launch_behind(end_values_kernel<Target>, static_cast<unsigned>(blocks), threads_per_block, stream,
                  stage::tile_resolve, touched, t, value, marks ? tracking.marks() : chunk_marks{}, fills, state,
                  limits);
}

// ---- of chunks alone ------------------------------------------------------------------------------------------------

// What voxels hold that are not touched, and what those do that are.
template <class Element>
struct cleared_and_drawn {
    Element cleared, drawn;
};

// What a clear and the fragments leave, each element written once: in chunks that are marked or touched where the log
// knows that the target holds what it is cleared to, otherwise in all. A block takes a word of marks, a warp what lies
// at one z of it. The elements are those of one plane, or of all; with keeps_marks, what is touched is marked from then
// on, and nothing else.
template <class Element>
__global__ __launch_bounds__(threads_per_block) void end_chunks_kernel(
    const word* touched, Element* to, cleared_and_drawn<Element> values, const __grid_constant__ chunk_marks marks,
    const word* known, const __grid_constant__ core::change_log::known wanted, bool keeps_marks,
    const pipeline_state* state, capacities limits) {
    constexpr int warps = chunk_yz, rows = chunk_yz; // of a warp
    static_assert(threads_per_block == 32 * warps && chunk_x == 32);
    __shared__ word bits[warps][rows][32];
    __shared__ word touched_by[warps], old; // chunks
    await_stream();
    if (state->index_error != 0 || misses_triangles(*state, limits)) return;
    const bool is_known = is_known_as(known, wanted);
    const int lane = static_cast<int>(threadIdx.x) % 32, warp = static_cast<int>(threadIdx.x) / 32;
    // As numbers, of which the touched bits choose by arithmetic.
    using number = std::conditional_t<sizeof(Element) % 4 == 0, std::uint32_t,
                                      std::conditional_t<sizeof(Element) % 2 == 0, std::uint16_t, std::uint8_t>>;
    constexpr int numbers = sizeof(Element) / sizeof(number);
    number cleared[numbers], changed[numbers]; // what the fragments change of it
    memcpy(cleared, &values.cleared, sizeof(cleared));
    memcpy(changed, &values.drawn, sizeof(changed));
    for (int k = 0; k < numbers; ++k) changed[k] = static_cast<number>(changed[k] ^ cleared[k]);
    const int ny = marks.extent.y, nz = marks.extent.z;
    const auto words_x = static_cast<unsigned>((marks.extent.x + 31) / 32),
               parts = static_cast<unsigned>(marks.rows.words);
    for (std::size_t i = blockIdx.x; i < marks.rows.num_words(); i += gridDim.x) {
        const auto row_of_chunks = static_cast<unsigned>(i / parts), rows_y = static_cast<unsigned>(marks.rows.y);
        const auto w = static_cast<int>(i % parts), y0 = static_cast<int>(row_of_chunks % rows_y) * chunk_yz,
                   z = static_cast<int>(row_of_chunks / rows_y) * chunk_yz + warp;
        const auto x_word = static_cast<unsigned>(w * 32 + lane);
        word any = 0;
        for (int row = 0; row < rows; ++row) {
            const int y = y0 + row;
            word mine = 0;
            if (z < nz && y < ny && x_word < words_x)
                mine = touched[(static_cast<std::size_t>(z) * static_cast<unsigned>(ny) + static_cast<unsigned>(y)) *
                                   words_x +
                               x_word];
            bits[warp][row][lane] = mine;
            any |= mine;
        }
        const word of_warp = __ballot_sync(0xffffffffu, any != 0);
        if (lane == 0) touched_by[warp] = of_warp;
        if (threadIdx.x == 0) old = is_known ? marks.words[i] : ~0u;
        __syncthreads();
        const word fresh = __reduce_or_sync(0xffffffffu, lane < warps ? touched_by[lane] : 0u), marked = old | fresh;
        if (keeps_marks && threadIdx.x == 0) marks.words[i] = fresh;
        if (z < nz)
            with_chunk_filler(
                to, marks, [&]<class Place>(const chunk_filler<Element, Place>& filler) VOXELPIPE_INLINE_LAMBDA {
                    filler.fill(w * 32 * chunk_x, y0, z, marked, [&](int x, int row) VOXELPIPE_INLINE_LAMBDA {
                        constexpr int count = sizeof(Place) / sizeof(Element);
                        const word of_place = bits[warp][row][x / 32 % 32] >> x % 32;
                        number lanes[count * numbers];
                        for (int k = 0; k < count * numbers; ++k)
                            lanes[k] = static_cast<number>(
                                cleared[k % numbers] ^ (changed[k % numbers] & (0u - (of_place >> k / numbers & 1u))));
                        Place place;
                        memcpy(&place, lanes, sizeof(place));
                        return place;
                    });
                });
        __syncthreads(); // before shared memory is written to again
    }
}
// Of target K, which is cleared by chunks.
template <std::size_t K, class Target, class Tracking>
void end_chunks(const word* touched, const target_view<Target>& t, const typename Target::value_type& value,
                const Tracking& tracking, const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    using map = typename Target::map;
    using element = typename Target::element_type;
    const chunk_marks marks = tracking.marks();
    const std::size_t blocks = std::min<std::size_t>(marks.rows.num_words(), core::most_blocks);
    const auto end = [&](element* to, const element& cleared, const element& drawn, bool is_last) {
        launch_behind(end_chunks_kernel<element>, static_cast<unsigned>(blocks), threads_per_block, stream,
                      stage::tile_resolve, touched, to, cleared_and_drawn<element>{cleared, drawn}, marks,
                      tracking.known_of(K), tracking.after[K],
                      is_last && tracking.last_by_chunks == static_cast<int>(K), state, limits);
    };
    const typename Target::value_type drawn = blended_once<Target>(t.clear_value, value);
    if constexpr (map::planes) {
        for (int c = 0; c < map::components; ++c)
            end(t.elements + static_cast<std::size_t>(c) * map::cells(t.extent), t.clear_value[c], drawn[c],
                c + 1 == map::components);
    } else {
        end(t.elements, t.clear_value, drawn, true);
    }
}

} // namespace voxelpipe::device
