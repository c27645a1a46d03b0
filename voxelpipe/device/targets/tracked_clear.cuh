// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Clears of targets whose framebuffer tracks its changes (framebuffer::track_changes). If a target is known to hold its
// clear value except in some chunks (core/change_log.hpp), only those are written. This knowledge lies on the device,
// so it stays right if a call fails, or is captured in a graph and launched again.

#include <voxelpipe/device/targets/clear_target.cuh>
#include <voxelpipe/device/targets/finalize_counts.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace voxelpipe::device {

// True if a log may know the value of such a target. Smaller ones are cleared sooner than chunks are found.
template <class Target>
[[nodiscard]] bool can_be_known(const target_view<Target>& t) {
    using map = typename Target::map;
    if constexpr (map::is_bit || map::bricks || sizeof(typename Target::value_type) > core::change_log::max_bytes)
        return false;
    else
        return map::elements(t.extent) * sizeof(typename Target::element_type) >= tuning::marked_bytes;
}

// True if a log can know some target of the framebuffer.
template <class... Targets>
[[nodiscard]] bool can_be_known(const framebuffer_view<Targets...>& fb) {
    bool any = false;
    core::for_each_index<sizeof...(Targets)>(
        [&]<std::size_t K>() { any = any || can_be_known(voxelpipe::get<K>(fb.targets)); });
    return fb.changes != nullptr && any;
}

// How a call uses the log of its framebuffer.
template <class Framebuffer>
struct change_tracking;
template <class... Targets>
struct change_tracking<framebuffer_view<Targets...>> {
    static constexpr std::size_t count = sizeof...(Targets);
    using known = core::change_log::known;

    word* log = nullptr; // null: nothing is tracked
    glm::ivec3 extent{};
    bool by_chunks[count] = {}; // targets that are cleared by chunks
    int last_by_chunks = -1;
    bool changes_known = false; // some cleared target may be known to the log
    known after[count];         // what is known of each target when all are cleared

    change_tracking() = default; // for a call that does not mark what it draws
    // For a call that marks all that it draws, if is_tracked. may_end(t, k): true if voxels that the call does not draw
    // end with the bits of target k's clear value.
    template <class MayEnd>
    change_tracking(const framebuffer_view<Targets...>& fb, bool is_tracked, const MayEnd& may_end)
        : log(is_tracked ? fb.changes : nullptr), extent(fb.extent) {
        if (log == nullptr) return;
        core::for_each_index<count>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(fb.targets);
            if (t.load != load_operation::clear || !can_be_known(t)) return;
            changes_known = true;
            if (!may_end(t, K)) return;
            if constexpr (sizeof(t.clear_value) <= core::change_log::max_bytes) {
                by_chunks[K] = true;
                last_by_chunks = static_cast<int>(K);
                after[K] = known(t.clear_value);
            }
        });
    }
    // Has words only if the call must mark what it draws.
    [[nodiscard]] chunk_marks marks() const {
        return log == nullptr ? chunk_marks{} : chunk_marks{log + core::change_log::header_words, extent};
    }
    [[nodiscard]] word* known_of(std::size_t k) const { return log + k * core::change_log::known_words; }
};

// True if the log knows exactly `wanted`. All lanes of a warp call it.
[[nodiscard]] __device__ VOXELPIPE_INLINE bool is_known_as(const word* known, const core::change_log::known& wanted) {
    constexpr int known_words = core::change_log::known_words;
    static_assert(known_words <= 32);
    const int lane = static_cast<int>(threadIdx.x) % 32;
    return __all_sync(0xffffffffu,
                      lane >= known_words || known[lane % known_words] == wanted.words[lane % known_words]);
}

// Writes chunks of a target in rows along x. `Unit`: one element, or as many as fill 16 bytes.
template <class Element, class Unit>
struct chunk_filler {
    static constexpr int per_unit = static_cast<int>(sizeof(Unit) / sizeof(Element));
    static constexpr int lanes_of_row = chunk_x / per_unit, rows_at_once = 32 / lanes_of_row; // of a chunk
    static_assert(per_unit <= chunk_x && 32 % lanes_of_row == 0);

    Unit* to;
    glm::ivec3 extent;

    // Writes the part at this z of the chunks that are marked in one word; a warp calls it, and each lane writes one
    // Unit at a time. (x0, y0): the lowest voxel of the word's first chunk. unit_at(x, row): the elements from x on
    // in row y0 + row.
    template <class UnitAt>
    __device__ VOXELPIPE_INLINE void fill(int x0, int y0, int z, word marked, UnitAt&& unit_at) const {
        const int lane = static_cast<int>(threadIdx.x) % 32, rows = min(chunk_yz, extent.y - y0);
        const std::size_t first_row =
            static_cast<std::size_t>(z) * static_cast<unsigned>(extent.y) + static_cast<unsigned>(y0);
        const auto store = [&](int x, int row) VOXELPIPE_INLINE_LAMBDA {
            to[((first_row + static_cast<unsigned>(row)) * static_cast<unsigned>(extent.x) + static_cast<unsigned>(x)) /
               per_unit] = unit_at(x, row);
        };
        if (marked == ~0u) { // in the order of memory
            const int end = min(x0 + 32 * chunk_x, extent.x);
            for (int row = 0; row < rows; ++row)
                for (int x = x0 + lane * per_unit; x < end; x += 32 * per_unit) store(x, row);
            return;
        }
        for (; marked != 0; marked &= marked - 1) {
            const int x = x0 + (__ffs(static_cast<int>(marked)) - 1) * chunk_x + lane % lanes_of_row * per_unit;
            if (x >= extent.x) continue;
            for (int row = lane / lanes_of_row; row < rows; row += rows_at_once) store(x, row);
        }
    }
};
// Calls f(filler), with a filler of 16 bytes if rows allow it.
template <class Element, class F>
__device__ VOXELPIPE_INLINE void with_chunk_filler(Element* elements, const chunk_marks& marks, F&& f) {
    if constexpr (sizeof(Element) <= 16 && 16 % sizeof(Element) == 0) {
        if (has_wide_rows(elements, marks)) {
            f(chunk_filler<Element, uint4>{reinterpret_cast<uint4*>(elements), marks.extent});
            return;
        }
    }
    f(chunk_filler<Element, Element>{elements, marks.extent});
}

// Clears one target to the value that the log may know.
template <class Element>
__global__ __launch_bounds__(threads_per_block) void clear_chunks_kernel(
    Element* elements, const __grid_constant__ chunk_marks marks, const word* known,
    const __grid_constant__ core::change_log::known wanted, const __grid_constant__ fill_pattern<Element> pattern,
    const pipeline_state* state, capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const bool is_known = is_known_as(known, wanted);
    with_chunk_filler(
        elements, marks, [&]<class Unit>(const chunk_filler<Element, Unit>& filler) VOXELPIPE_INLINE_LAMBDA {
            Element lanes[sizeof(Unit) / sizeof(Element)];
            for (Element& e : lanes) e = pattern.value;
            Unit unit;
            memcpy(&unit, lanes, sizeof(unit));
            // A warp takes one z of a row of chunks.
            const unsigned warps = gridDim.x * (blockDim.x / 32);
            const auto rows_y = static_cast<unsigned>(marks.rows.y);
            const std::size_t slices = std::size_t{rows_y} * static_cast<unsigned>(marks.extent.z);
            for (std::size_t i = blockIdx.x * (blockDim.x / 32) + threadIdx.x / 32; i < slices; i += warps) {
                const auto y = static_cast<int>(i % rows_y), z = static_cast<int>(i / rows_y);
                const word* const row = marks.row(y, z >> log2_chunk_yz);
                for (int w = 0; w < marks.rows.words; ++w)
                    filler.fill(w * 32 * chunk_x, y * chunk_yz, z, is_known ? row[w] : ~0u,
                                [&](int, int) VOXELPIPE_INLINE_LAMBDA { return unit; });
            }
        });
}

// Clears the marked part of a plane of a target, or all of it if the log does not know it as `wanted`.
template <class Element>
void clear_chunks(Element* to, const chunk_marks& marks, const word* known, const core::change_log::known& wanted,
                  const fill_pattern<Element>& pattern, const pipeline_state* state, const capacities& limits,
                  cudaStream_t stream) {
    const std::size_t slices = static_cast<std::size_t>(marks.rows.y) * static_cast<unsigned>(marks.extent.z);
    const std::size_t blocks = std::min<std::size_t>(slices / (threads_per_block / 32) + 1, core::max_blocks);
    launch_behind(clear_chunks_kernel<Element>, static_cast<unsigned>(blocks), threads_per_block, stream,
                  stage::fine_raster, to, marks, known, wanted, pattern, state, limits);
}

// Records the targets' state after the call. `wipes`: no chunk stays marked.
template <std::size_t N>
struct known_targets {
    core::change_log::known of[N];
};
template <std::size_t N>
__global__ void note_clears_kernel(word* log, const __grid_constant__ known_targets<N> after,
                                   const __grid_constant__ chunk_marks marks, bool wipes, const pipeline_state* state,
                                   capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const std::size_t first = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x,
                      threads = std::size_t{gridDim.x} * blockDim.x;
    for (std::size_t i = first; i < N * core::change_log::known_words; i += threads)
        log[i] = after.of[i / core::change_log::known_words].words[i % core::change_log::known_words];
    if (!wipes) return;
    for (std::size_t i = first; i < marks.rows.num_words(); i += threads) marks.words[i] = 0;
}
template <std::size_t N>
void note_known(word* log, const known_targets<N>& after, const chunk_marks& marks, bool wipes,
                const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(note_clears_kernel<N>, wipes ? fill_device(marks.rows.num_words()) : 1, threads_per_block, stream,
                  stage::fine_raster, log, after, marks, wipes, state, limits);
}
// Updates the log when all targets are cleared. It knows nothing of targets that the call does not clear by chunks,
// because all targets share the marks.
template <class... Targets>
void note_clears(const change_tracking<framebuffer_view<Targets...>>& tracking, bool wipes, const pipeline_state* state,
                 const capacities& limits, cudaStream_t stream) {
    constexpr std::size_t count = sizeof...(Targets);
    if (!tracking.changes_known) return;
    known_targets<count> after{};
    for (std::size_t k = 0; k < count; ++k) after.of[k] = tracking.after[k];
    const chunk_marks marks = tracking.marks();
    note_known(tracking.log, after, marks, wipes, state, limits, stream);
}

// Clears by chunks the targets that `tracking` names, and updates the log.
template <class... Targets>
void clear_by_chunks(const change_tracking<framebuffer_view<Targets...>>& tracking,
                     const framebuffer_view<Targets...>& fb, const pipeline_state* state, const capacities& limits,
                     cudaStream_t stream) {
    if (!tracking.changes_known) return;
    const chunk_marks marks = tracking.marks();
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        using map = typename target::map;
        using element = typename target::element_type;
        if (!tracking.by_chunks[K]) return;
        const auto& t = voxelpipe::get<K>(fb.targets);
        const auto clear = [&](element* to, const element& value) {
            clear_chunks(to, marks, tracking.known_of(K), tracking.after[K], fill_pattern<element>{value}, state,
                         limits, stream);
        };
        if constexpr (map::planes) {
            for (int c = 0; c < map::components; ++c)
                clear(t.elements + static_cast<std::size_t>(c) * map::cells(t.extent), t.clear_value[c]);
        } else if constexpr (!map::is_bit && !map::bricks) {
            clear(t.elements, t.clear_value);
        }
    });
    note_clears(tracking, true, state, limits, stream);
}

// Marks the chunks of listed voxels; neighbours in the list mostly share one.
template <class Voxel>
__global__
__launch_bounds__(threads_per_block) void mark_voxels_kernel(const Voxel* voxels, const unsigned long long* num,
                                                             const __grid_constant__ chunk_marks marks,
                                                             const pipeline_state* state, capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const std::uint64_t n = *num, threads = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < n; i += threads) {
        const Voxel voxel = voxels[i];
        if (i != 0 && voxels[i - 1] == voxel) continue;
        const voxel_position at = position_of(voxel, marks.extent);
        marks.mark_row(at.x, at.x, at.y, at.z);
    }
}
template <class Voxel>
void mark_listed(const Voxel* voxels, const unsigned long long* num, std::uint64_t capacity, const chunk_marks& marks,
                 const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(mark_voxels_kernel<Voxel>, fill_device(capacity), threads_per_block, stream, stage::tile_resolve,
                  voxels, num, marks, state, limits);
}
// Marks listed voxels if the call must. *num: how many there are, at most `capacity`.
template <class Tracking, class Voxel>
void mark_voxels(const Tracking& tracking, const Voxel* voxels, const unsigned long long* num, std::uint64_t capacity,
                 const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    if (tracking.log != nullptr) mark_listed(voxels, num, capacity, tracking.marks(), state, limits, stream);
}

} // namespace voxelpipe::device
