// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Segmented reduce: shades fragments that are listed and sorted by voxel (fragments/list_sink.cuh,
// fragments/radix_sort.cuh) and blends those of each voxel, for shaders that compute and blends that allow any order. A
// lane has a fragment; partial results (cells of targets/shared_blend.cuh) are merged by a segmented prefix sum over
// the lanes. A warp takes runs of fragments. A second kernel merges a run's part of a voxel that begins before it or
// continues behind it, so that many warps share a voxel of a million fragments.

#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/fragment_shade.cuh>
#include <voxelpipe/device/targets/target_traits.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace voxelpipe::device {

// ---- cells ----------------------------------------------------------------------------------------------------------

// The bit of a voxel as a cell.
template <class Blend>
struct bit_cell {
    using cell = word;
    template <class Value>
    __device__ static cell cell_of(const Value& v) {
        if constexpr (std::is_same_v<Blend, blend::count>)
            return 1;
        else
            return v ? 1 : 0;
    }
    __device__ static void merge(cell& a, cell b) { bit_blend<Blend>::merge(a, b); }
};
// For targets whose last fragment wins: voxel_cells holds the winner.
struct no_cell {
    struct cell {};
    template <class Value>
    __device__ static cell cell_of(const Value&) {
        return {};
    }
    __device__ static void merge(cell&, cell) {}
};

template <class Target, blend_method Method = method_of<Target>()>
struct target_cell;
template <class Target>
struct target_cell<Target, blend_method::atomic>
    : value_blend<typename Target::blend_type, typename Target::value_type> {};
template <class Target>
struct target_cell<Target, blend_method::bits> : bit_cell<typename Target::blend_type> {};
template <class Target>
struct target_cell<Target, blend_method::winner> : no_cell {};

// The combined fragments of one voxel, or some of them: the cell of each target, and the last primitive + 1.
// Order-free.
template <class Framebuffer>
struct voxel_cells;
template <class... Targets>
struct voxel_cells<framebuffer_view<Targets...>> {
    template <std::size_t K>
    using target = typename core::pack_element<K, Targets...>::type;
    static constexpr bool has_winner = ((method_of<Targets>() == blend_method::winner) || ...);

    core::pack<typename target_cell<Targets>::cell...> of;
    word winner;

    template <class Values>
    [[nodiscard]] __device__ VOXELPIPE_INLINE static voxel_cells make(const Values& values, std::uint32_t primitive) {
        voxel_cells c{};
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
            voxelpipe::get<K>(c.of) = target_cell<target<K>>::cell_of(voxelpipe::get<K>(values));
        });
        if constexpr (has_winner) c.winner = primitive + 1;
        return c;
    }
    __device__ VOXELPIPE_INLINE void merge(const voxel_cells& other) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
            target_cell<target<K>>::merge(voxelpipe::get<K>(of), voxelpipe::get<K>(other.of));
        });
        if constexpr (has_winner) winner = other.winner > winner ? other.winner : winner;
    }
    // Stores the cells to the voxel's targets.
    template <class Scene>
    __device__ VOXELPIPE_INLINE void store(const Scene& s, const framebuffer_view<Targets...>& fb,
                                           const voxel_position& at) const {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
            const auto& view = voxelpipe::get<K>(fb.targets);
            const auto& cell = voxelpipe::get<K>(of);
            if constexpr (method_of<target<K>>() == blend_method::atomic) {
                store_cell(view, at, cell);
            } else if constexpr (method_of<target<K>>() == blend_method::bits) {
                using blend_type = bit_blend<typename target<K>::blend_type>;
                if (view.load == load_operation::off || (cell != 0) == blend_type::clears) return;
                word* const w = view.elements + target<K>::map::cell(view.extent, at.x, at.y, at.z);
                const word mask = 1u << (at.x & 31);
                if constexpr (blend_type::clears)
                    atomicAnd(w, ~mask);
                else if constexpr (blend_type::sets)
                    atomicOr(w, mask);
                else
                    atomicXor(w, mask);
            }
        });
        if constexpr (has_winner) {
            const auto out = shade_fragment(s, winner - 1, at.x, at.y, at.z);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
                if constexpr (method_of<target<K>>() == blend_method::winner)
                    store_winner(voxelpipe::get<K>(fb.targets), at, voxelpipe::get<K>(out.values));
            });
        }
    }
};

// True if the fragments of such a framebuffer can be reduced here.
template <class Framebuffer>
inline constexpr bool is_resolvable = false;
template <class... Targets>
requires((method_of<Targets>() != blend_method::ordered) &&
         ...) inline constexpr bool is_resolvable<framebuffer_view<Targets...>> =
    sizeof(voxel_cells<framebuffer_view<Targets...>>) <= tuning::max_cell_bytes;

// Cells of a lane, or none if no fragment was kept.
template <class Cells>
struct some_cells {
    Cells cells;
    word any; // 0: none

    __device__ VOXELPIPE_INLINE void merge(const some_cells& other) {
        if (other.any == 0) return;
        if (any != 0)
            cells.merge(other.cells);
        else
            cells = other.cells;
        any = 1;
    }
    // The cells of another lane, transferred word by word with `shuffle`. All lanes call it.
    template <class Shuffle>
    [[nodiscard]] __device__ VOXELPIPE_INLINE some_cells from(const Shuffle& shuffle) const {
        constexpr std::size_t num = (sizeof(Cells) + sizeof(word) - 1) / sizeof(word);
        word words[num]{};
        memcpy(words, &cells, sizeof(Cells));
#pragma unroll
        for (std::size_t k = 0; k < num; ++k) words[k] = shuffle(words[k]);
        some_cells other{};
        memcpy(&other.cells, words, sizeof(Cells));
        other.any = shuffle(any);
        return other;
    }
};

// ---- runs of fragments ----------------------------------------------------------------------------------------------

// Parts of voxels that runs share: a run's cells of its first voxel if that began before the run, and of its last voxel
// if that continues behind it.
template <class Cells>
struct run_ends {
    static constexpr std::uint32_t goes_on = 1; // the last voxel continues behind the run
    static constexpr std::uint32_t through = 2; // and it is also the first one, and began before
    some_cells<Cells>*heads, *tails;
    std::uint32_t* flags; // of each run

    [[nodiscard]] static std::uint64_t num(std::uint64_t fragments) {
        return (fragments + tuning::resolve_run - 1) / tuning::resolve_run;
    }
    [[nodiscard]] static run_ends take(arena& memory, std::uint64_t capacity) {
        run_ends e{};
        e.heads = memory.take<some_cells<Cells>>(num(capacity));
        e.tails = memory.take<some_cells<Cells>>(num(capacity));
        e.flags = memory.take<std::uint32_t>(num(capacity));
        return e;
    }
};

// Fragments by ascending voxel, in any order within one.
struct sorted_fragments {
    const std::uint32_t *voxels, *primitives;
};

template <class Scene, class Framebuffer>
__global__ __launch_bounds__(threads_per_block, 4) void resolve_runs_kernel(
    const __grid_constant__ Scene s, const __grid_constant__ Framebuffer fb, const __grid_constant__ sorted_fragments f,
    const __grid_constant__ run_ends<voxel_cells<Framebuffer>> ends, pipeline_state* state, capacities limits,
    bool count_voxels) {
    using cells = voxel_cells<Framebuffer>;
    constexpr unsigned whole_warp = 0xffffffffu;
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments); // see core::max_numbered
    const std::uint32_t lane = threadIdx.x % 32, warps = gridDim.x * (threads_per_block / 32);
    const std::uint32_t runs = (n + tuning::resolve_run - 1) / tuning::resolve_run;
    std::uint32_t kept = 0, discarded = 0, touched = 0;
    for (std::uint32_t run = blockIdx.x * (threads_per_block / 32) + warp_in_block(); run < runs; run += warps) {
        const std::uint32_t begin = run * tuning::resolve_run,
                            end = n - begin < tuning::resolve_run ? n : begin + tuning::resolve_run;
        std::uint32_t before = begin == 0 ? ~0u : f.voxels[begin - 1]; // voxel of the fragment before
        const std::uint32_t behind = end < n ? f.voxels[end] : ~0u;    // voxel of the fragment behind the run
        some_cells<cells> carried{};                                   // of the last voxel, in this run
        bool has_begun = false;                                        // a voxel has begun in this run
        std::uint32_t flags = 0;
        // A lane's next fragment is loaded while it works on the current one.
        std::uint32_t next_voxel = begin + lane < end ? f.voxels[begin + lane] : ~0u; // ~0 is no voxel
        std::uint32_t next_primitive = begin + lane < end ? f.primitives[begin + lane] : 0;
        for (std::uint32_t first = begin; first < end; first += 32) {
            const std::uint32_t i = first + lane;
            const bool valid = i < end;
            const std::uint32_t voxel = next_voxel, primitive = next_primitive;
            next_voxel = i + 32 < end ? f.voxels[i + 32] : ~0u;
            if (i + 32 < end) next_primitive = f.primitives[i + 32];
            std::uint32_t previous = __shfl_up_sync(whole_warp, voxel, 1),
                          next = __shfl_down_sync(whole_warp, voxel, 1);
            if (lane == 0) previous = before;
            const std::uint32_t ahead = __shfl_sync(whole_warp, next_voxel, 0);
            if (lane == 31) next = ahead;
            if (i + 1 == end) next = behind;
            before = __shfl_sync(whole_warp, voxel, 31);
            const unsigned starts = __ballot_sync(whole_warp, valid && voxel != previous);
            const unsigned upto = starts & ((2u << lane) - 1);
            some_cells<cells> mine{};
            const voxel_position at = position_of(voxel, fb.extent);
            if (valid) {
                const auto out = shade_small_fragment<false>(s, primitive, at.x, at.y, at.z);
                mine.any = static_cast<word>(out.keep);
                if (out.keep) mine.cells = cells::make(out.values, primitive);
                kept += static_cast<std::uint32_t>(out.keep);
                discarded += static_cast<std::uint32_t>(!out.keep);
            }
            __syncwarp();
            if (lane == 0 && upto == 0) mine.merge(carried);
            // Lanes from the first of the voxel to this one.
            const std::uint32_t apart =
                upto == 0 ? lane : lane - (31 - static_cast<std::uint32_t>(__clz(static_cast<int>(upto))));
            const std::uint32_t max_apart = __reduce_max_sync(whole_warp, apart);
            for (std::uint32_t step = 1; step <= max_apart; step *= 2) {
                const auto other = mine.from([&](word w) { return __shfl_up_sync(whole_warp, w, step); });
                if (apart >= step) mine.merge(other);
            }
            const bool began_here = has_begun || upto != 0, is_last = valid && voxel != next;
            if (is_last) {
                if (began_here) {
                    if (mine.any != 0) mine.cells.store(s, fb, at);
                    touched += mine.any;
                } else {
                    ends.heads[run] = mine;
                }
            } else if (valid && i + 1 == end) {
                flags = began_here ? run_ends<cells>::goes_on : run_ends<cells>::goes_on | run_ends<cells>::through;
                (began_here ? ends.tails : ends.heads)[run] = mine;
            }
            __syncwarp();
            carried = mine.from([&](word w) { return __shfl_sync(whole_warp, w, 31); });
            has_begun = has_begun || starts != 0;
        }
        flags = __reduce_or_sync(whole_warp, flags);
        if (lane == 0) ends.flags[run] = flags;
    }
    const unsigned long long all_kept = block_sum(kept), all_discarded = block_sum(discarded);
    const unsigned long long all_touched = block_sum(touched);
    if (threadIdx.x != 0) return;
    if (all_kept != 0) atomicAdd(&state->fragments, all_kept);
    if (all_discarded != 0) atomicAdd(&state->discarded, all_discarded);
    if (count_voxels && all_touched != 0) atomicAdd(&state->voxels, all_touched);
}

// Merges the voxels that lie in more than one run. A lane has the run in which such a voxel begins; if it covers whole
// runs, all lanes of the warp merge those.
template <class Scene, class Framebuffer>
__global__ __launch_bounds__(threads_per_block) void resolve_ends_kernel(
    const __grid_constant__ Scene s, const __grid_constant__ Framebuffer fb, const __grid_constant__ sorted_fragments f,
    const __grid_constant__ run_ends<voxel_cells<Framebuffer>> ends, pipeline_state* state, capacities limits,
    bool count_voxels) {
    using cells = voxel_cells<Framebuffer>;
    using run_ends_type = run_ends<cells>;
    constexpr unsigned whole_warp = 0xffffffffu;
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments);
    const std::uint32_t lane = threadIdx.x % 32, runs = (n + tuning::resolve_run - 1) / tuning::resolve_run;
    const std::uint32_t step = gridDim.x * threads_per_block;
    std::uint32_t touched = 0;
    for (std::uint32_t first = (blockIdx.x * (threads_per_block / 32) + warp_in_block()) * 32; first < runs;
         first += step) {
        const std::uint32_t run = first + lane;
        const bool goes_on = run < runs && ends.flags[run] == run_ends_type::goes_on;
        some_cells<cells> mine{};
        bool is_long = false;
        if (goes_on) {
            mine = ends.tails[run];
            is_long = (ends.flags[run + 1] & run_ends_type::through) != 0;
            if (!is_long) mine.merge(ends.heads[run + 1]);
        }
        for (unsigned rest = __ballot_sync(whole_warp, is_long); rest != 0; rest &= rest - 1) {
            const std::uint32_t owner = static_cast<std::uint32_t>(__ffs(static_cast<int>(rest))) - 1;
            some_cells<cells> part{};
            for (std::uint32_t at = first + owner + 1;; at += 32) {
                const std::uint32_t one = at + lane;
                const bool is_end = one >= runs || (ends.flags[one] & run_ends_type::through) == 0;
                const unsigned last = __ballot_sync(whole_warp, is_end);
                const std::uint32_t num = last == 0 ? 32 : static_cast<std::uint32_t>(__ffs(static_cast<int>(last)));
                if (lane < num && one < runs) part.merge(ends.heads[one]);
                if (last != 0) break;
            }
            __syncwarp();
            for (unsigned across = 16; across > 0; across /= 2)
                part.merge(part.from([&](word w) { return __shfl_xor_sync(whole_warp, w, across); }));
            if (lane == owner) mine.merge(part);
        }
        if (mine.any != 0) {
            const std::uint32_t voxel = f.voxels[(run + 1) * tuning::resolve_run - 1];
            mine.cells.store(s, fb, position_of(voxel, fb.extent));
            ++touched;
        }
        __syncwarp();
    }
    if (!count_voxels) return;
    const unsigned long long all_touched = block_sum(touched);
    if (threadIdx.x == 0 && all_touched != 0) atomicAdd(&state->voxels, all_touched);
}

// Shades and blends the fragments of a call into its targets, which already hold their clear values. Counts fragments
// and, if wanted, voxels. Uses limits.fragments.
template <class Scene, class Framebuffer>
void resolve_fragments(const Scene& s, const Framebuffer& fb, const sorted_fragments& f,
                       const run_ends<voxel_cells<Framebuffer>>& ends, bool count_voxels, pipeline_state* state,
                       const capacities& limits, cudaStream_t stream) {
    constexpr std::uint64_t warps_of_block = threads_per_block / 32;
    const std::uint64_t runs = run_ends<voxel_cells<Framebuffer>>::num(limits.fragments);
    const auto most = static_cast<std::uint64_t>(num_multiprocessors()) * 8;
    launch_behind(resolve_runs_kernel<Scene, Framebuffer>,
                  static_cast<unsigned>(std::clamp<std::uint64_t>(runs / warps_of_block, 1, most)), threads_per_block,
                  stream, stage::tile_resolve, s, fb, f, ends, state, limits, count_voxels);
    launch_behind(resolve_ends_kernel<Scene, Framebuffer>, fill_device(runs), threads_per_block, stream,
                  stage::tile_resolve, s, fb, f, ends, state, limits, count_voxels);
}

} // namespace voxelpipe::device
