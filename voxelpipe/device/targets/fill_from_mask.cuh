// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Last passes of the occupancy mask. It serves framebuffers that depend only on which voxels are touched: all draws
// have one constant value, and a second fragment in a voxel changes nothing (bits, replace, min and max). The raster
// sets touched voxels in bits of the call's own memory. The passes here write every target's values from these bits,
// each element once, count the voxels, and zero the bits for the next call. No target is written before all triangles
// have been read, so indices are checked on the way: a separate pass over them took a fifth of the time of a mesh of 7
// million triangles.

#include <voxelpipe/device/targets/clear_target.cuh>
#include <voxelpipe/device/targets/target_traits.cuh>
#include <voxelpipe/device/targets/tracked_clear.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace voxelpipe::device {

// The value of a voxel that held `old`, after fragments of `value`.
template <class Target>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE typename Target::value_type
blended_once(const typename Target::value_type& old, const typename Target::value_type& value) {
    auto a = Target::traits::begin(old);
    Target::traits::apply(a, value);
    return typename Target::value_type(Target::traits::end(a));
}

// Writes the values of a target. Bit x of a row of `touched` says whether voxel x has a fragment of `value`. All
// threads of the launch call it.
template <class Target>
struct value_writer {
    using map = typename Target::map;
    using value_type = typename Target::value_type;
    static constexpr bool goes_wide =
        !map::bricks && !map::planes && sizeof(value_type) <= 16 && 16 % sizeof(value_type) == 0;
    static constexpr unsigned batch = tuning::last_pass_loads;

    const word* touched;
    const target_view<Target>& t;
    const value_type& value;
    std::uint32_t nx = static_cast<std::uint32_t>(t.extent.x), ny = static_cast<std::uint32_t>(t.extent.y);
    std::uint32_t words_x = (nx + 31) / 32, rows = ny * static_cast<std::uint32_t>(t.extent.z);

    // Writes a cleared target whose rows are multiples of 16 bytes, in the order of memory.
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
    // Writes any other target; with `fill`, voxels that are not touched get the clear value. A warp takes 32 words at a
    // time. Marks what is touched if there are marks.
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
__global__ __launch_bounds__(threads_per_block) void fill_values_kernel(
    const word* touched, const __grid_constant__ target_view<Target> t,
    const __grid_constant__ typename Target::value_type value, const __grid_constant__ chunk_marks marks,
    bool is_filled, const pipeline_state* state, capacities limits) {
    using writer = value_writer<Target>;
    await_stream();
    if (state->index_error != 0 || misses_deferred(*state, limits)) return;
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
// Fills a target that is not cleared by chunks. Bricks that are to be cleared have been, with their padding.
template <class Target, class Tracking>
void fill_values(const word* touched, const target_view<Target>& t, const typename Target::value_type& value,
                 const Tracking& tracking, const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    // Blocks write a fixed part and end, as in clear_target.
    const std::uint64_t bytes = Target::map::elements(t.extent) * sizeof(typename Target::element_type),
                        blocks = std::min(bytes / (16 * tuning::fill_stores * threads_per_block) + 1, core::max_blocks);
    // If other targets are cleared by chunks, the log will not know this one.
    const bool fills = t.load == load_operation::clear && !Target::map::bricks,
               marks = !fills && !tracking.changes_known;
    launch_behind(fill_values_kernel<Target>, static_cast<unsigned>(blocks), threads_per_block, stream,
                  stage::tile_resolve, touched, t, value, marks ? tracking.marks() : chunk_marks{}, fills, state,
                  limits);
}

// ---- by chunks ------------------------------------------------------------------------------------------------------

// The values of voxels that are not touched, and of those that are.
template <class Element>
struct cleared_and_drawn {
    Element cleared, drawn;
};

// Writes what a clear and the fragments leave, each element once. If the log knows that the target holds its clear
// value, only chunks that are marked or touched are written, otherwise all. A block takes one word of marks, a warp its
// chunks at one z. The elements are those of one plane, or of all planes. keeps_marks: afterwards exactly the touched
// chunks are marked.
template <class Element>
__global__ __launch_bounds__(threads_per_block) void fill_chunks_kernel(
    const word* touched, Element* to, cleared_and_drawn<Element> values, const __grid_constant__ chunk_marks marks,
    const word* known, const __grid_constant__ core::change_log::known wanted, bool keeps_marks,
    const pipeline_state* state, capacities limits) {
    constexpr int warps = chunk_yz, rows = chunk_yz; // rows per warp
    static_assert(threads_per_block == 32 * warps && chunk_x == 32);
    __shared__ word bits[warps][rows][32];
    __shared__ word touched_by[warps], old; // touched chunks
    await_stream();
    if (state->index_error != 0 || misses_deferred(*state, limits)) return;
    const bool is_known = is_known_as(known, wanted);
    const int lane = static_cast<int>(threadIdx.x) % 32, warp = static_cast<int>(threadIdx.x) / 32;
    // Elements as unsigned numbers, selected by the touched bits with arithmetic.
    using number = std::conditional_t<sizeof(Element) % 4 == 0, std::uint32_t,
                                      std::conditional_t<sizeof(Element) % 2 == 0, std::uint16_t, std::uint8_t>>;
    constexpr int numbers = sizeof(Element) / sizeof(number);
    number cleared[numbers], changed[numbers]; // bits in which drawn and cleared differ
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
                to, marks, [&]<class Unit>(const chunk_filler<Element, Unit>& filler) VOXELPIPE_INLINE_LAMBDA {
                    filler.fill(w * 32 * chunk_x, y0, z, marked, [&](int x, int row) VOXELPIPE_INLINE_LAMBDA {
                        constexpr int count = sizeof(Unit) / sizeof(Element);
                        const word of_unit = bits[warp][row][x / 32 % 32] >> x % 32;
                        number lanes[count * numbers];
                        for (int k = 0; k < count * numbers; ++k)
                            lanes[k] = static_cast<number>(
                                cleared[k % numbers] ^ (changed[k % numbers] & (0u - (of_unit >> k / numbers & 1u))));
                        Unit unit;
                        memcpy(&unit, lanes, sizeof(unit));
                        return unit;
                    });
                });
        __syncthreads(); // before shared memory is written again
    }
}
// Fills target K, which is cleared by chunks.
template <std::size_t K, class Target, class Tracking>
void fill_chunks(const word* touched, const target_view<Target>& t, const typename Target::value_type& value,
                 const Tracking& tracking, const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    using map = typename Target::map;
    using element = typename Target::element_type;
    const chunk_marks marks = tracking.marks();
    const std::size_t blocks = std::min<std::size_t>(marks.rows.num_words(), core::max_blocks);
    const auto end = [&](element* to, const element& cleared, const element& drawn, bool is_last) {
        launch_behind(fill_chunks_kernel<element>, static_cast<unsigned>(blocks), threads_per_block, stream,
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

// ---- the last passes ------------------------------------------------------------------------------------------------

// True if a second fragment of the same value changes nothing.
template <class Target>
inline constexpr bool is_blended_once = std::is_same_v<typename Target::blend_type, blend::replace> ||
                                        (Target::map::is_bit ? bit_blend<typename Target::blend_type>::sets ||
                                                                   bit_blend<typename Target::blend_type>::clears
                                                             : core::is_repeated_once<typename Target::blend_type>);
template <class Framebuffer>
inline constexpr bool depends_on_mask = false;
template <class... Targets>
inline constexpr bool depends_on_mask<framebuffer_view<Targets...>> = (is_blended_once<Targets> && ...);

// True if some target of values is cleared, and so written from end to end anyway.
template <class... Targets>
[[nodiscard]] bool clears_values(const framebuffer_view<Targets...>& fb) {
    bool any = false;
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        any = any || (!core::pack_element<K, Targets...>::type::map::is_bit &&
                      voxelpipe::get<K>(fb.targets).load == load_operation::clear);
    });
    return any;
}

// The new word of a target whose bits `touched` have fragments of this value.
template <class Target>
__device__ VOXELPIPE_INLINE word fill_word(word old, word touched, bool value) {
    using blend_type = bit_blend<typename Target::blend_type>;
    if (value) return blend_type::clears ? old : old | touched;
    return blend_type::sets ? old : old & ~touched;
}

// Writes the words of a target of bits at words first to first + 3 of the mask, which has `num`.
template <class Target>
__device__ VOXELPIPE_INLINE void fill_words(const target_view<Target>& t, std::uint64_t first, std::uint64_t num,
                                            const uint4& touched, bool value) {
    using map = typename Target::map;
    const word bits[4] = {touched.x, touched.y, touched.z, touched.w};
    const bool is_cleared = t.load == load_operation::clear && !map::bricks; // bricks have been cleared
    if (!is_cleared && (touched.x | touched.y | touched.z | touched.w) == 0) return;
    if constexpr (!map::bricks) {
        if (is_cleared && !t.clear_value && first + 4 <= num &&
            reinterpret_cast<std::uintptr_t>(t.elements) % 16 == 0) {
            uint4 made;
            made.x = fill_word<Target>(0, bits[0], value);
            made.y = fill_word<Target>(0, bits[1], value);
            made.z = fill_word<Target>(0, bits[2], value);
            made.w = fill_word<Target>(0, bits[3], value);
            *reinterpret_cast<uint4*>(t.elements + first) = made;
            return;
        }
    }
    const auto words_x = static_cast<std::uint32_t>((t.extent.x + 31) / 32);
    for (unsigned k = 0; k < 4 && first + k < num; ++k) {
        if (!is_cleared && bits[k] == 0) continue;
        const auto row = static_cast<std::uint32_t>((first + k) / words_x);
        const int x = static_cast<int>(static_cast<std::uint32_t>(first + k) - row * words_x) * 32;
        std::size_t at = first + k;
        if constexpr (map::bricks) {
            const auto ny = static_cast<std::uint32_t>(t.extent.y);
            at = map::cell(t.extent, x, static_cast<int>(row % ny), static_cast<int>(row / ny));
        }
        const int left = t.extent.x - x;
        const word cleared = !t.clear_value ? 0 : left >= 32 ? ~0u : (1u << left) - 1;
        t.elements[at] = fill_word<Target>(is_cleared ? cleared : t.elements[at], bits[k], value);
    }
}

template <class Framebuffer, class Values>
__global__ __launch_bounds__(threads_per_block) void fill_bits_kernel(uint4* touched, std::uint64_t num_words,
                                                                      const __grid_constant__ Framebuffer fb,
                                                                      const __grid_constant__ Values values,
                                                                      bool count_voxels, pipeline_state* state,
                                                                      capacities limits) {
    constexpr unsigned batch = tuning::last_pass_loads;
    await_stream();
    const bool failed = state->index_error != 0 || misses_deferred(*state, limits);
    const std::uint64_t num = (num_words + 3) / 4, threads = std::uint64_t{gridDim.x} * blockDim.x;
    unsigned found = 0;
    for (std::uint64_t first = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; first < num;
         first += batch * threads) {
        uint4 loaded[batch];
        for (unsigned b = 0; b < batch; ++b)
            loaded[b] = first + b * threads < num ? touched[first + b * threads] : uint4{0, 0, 0, 0};
        for (unsigned b = 0; b < batch; ++b) {
            const std::uint64_t i = first + b * threads;
            const uint4& t = loaded[b];
            if (i >= num) break;
            if ((t.x | t.y | t.z | t.w) != 0) {
                touched[i] = uint4{0, 0, 0, 0};
                found += static_cast<unsigned>(__popc(t.x) + __popc(t.y) + __popc(t.z) + __popc(t.w));
            }
            if (failed) continue;
            core::for_each_index<targets_of<Framebuffer>::count>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
                if constexpr (targets_of<Framebuffer>::template at<K>::map::is_bit) {
                    const auto& target = voxelpipe::get<K>(fb.targets);
                    if (target.load != load_operation::off)
                        fill_words(target, 4 * i, num_words, t, voxelpipe::get<K>(values));
                }
            });
        }
    }
    if (!count_voxels) return;
    const unsigned long long sum = block_sum(found);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->voxels, sum);
}

// The last passes of a call: writes the targets from the mask, and zeros the mask.
template <class... Targets, class Values>
void fill_from_mask(word* touched, const framebuffer_view<Targets...>& fb,
                    const change_tracking<framebuffer_view<Targets...>>& tracking, const Values& values,
                    bool count_voxels, pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        using map = typename target::map;
        const auto& t = voxelpipe::get<K>(fb.targets);
        if constexpr (map::bricks) // padding of bricks has no position in rows
            if (t.load == load_operation::clear) clear_target(t, state, limits, stream);
        if constexpr (!map::is_bit) {
            const auto value = static_cast<typename target::value_type>(voxelpipe::get<K>(values));
            if constexpr (!map::bricks)
                if (tracking.by_chunks[K]) fill_chunks<K>(touched, t, value, tracking, state, limits, stream);
            if (t.load != load_operation::off && !tracking.by_chunks[K])
                fill_values(touched, t, value, tracking, state, limits, stream);
        }
    });
    note_clears(tracking, false, state, limits, stream);
    const std::uint64_t num = mask_target::map::elements(fb.extent);
    launch_behind(fill_bits_kernel<framebuffer_view<Targets...>, Values>, fill_device(num / 16 + 1), threads_per_block,
                  stream, stage::tile_resolve, reinterpret_cast<uint4*>(touched), num, fb, values, count_voxels, state,
                  limits);
}

} // namespace voxelpipe::device
