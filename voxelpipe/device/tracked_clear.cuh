// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Clears of targets whose framebuffer tracks its changes (framebuffer::track_changes): where a target is known to hold
// the value that it is cleared to but for some chunks (core/change_log.hpp), those alone are written. What is known
// lies on the device, so that a call that failed, or was captured in a graph and launched again, leaves it right.

#include <voxelpipe/device/clear_target.cuh>
#include <voxelpipe/device/counted_target.cuh>

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace voxelpipe::device {

// Whether a log says of such a target what it was cleared to. Smaller ones are cleared sooner than chunks are found.
template <class Target>
[[nodiscard]] bool can_be_known(const target_view<Target>& t) {
    using map = typename Target::map;
    if constexpr (map::is_bit || map::bricks || sizeof(typename Target::value_type) > core::change_log::most_bytes)
        return false;
    else
        return map::elements(t.extent) * sizeof(typename Target::element_type) >= marked_bytes;
}

// Whether a log can say anything of a framebuffer.
template <class... Targets>
[[nodiscard]] bool can_be_known(const framebuffer_view<Targets...>& fb) {
    bool any = false;
    core::for_each_index<sizeof...(Targets)>(
        [&]<std::size_t K>() { any = any || can_be_known(voxelpipe::get<K>(fb.targets)); });
    return fb.changes != nullptr && any;
}

// What a call does with the log of its framebuffer.
template <class Framebuffer>
struct change_tracking;
template <class... Targets>
struct change_tracking<framebuffer_view<Targets...>> {
    static constexpr std::size_t count = sizeof...(Targets);
    using known = core::change_log::known;

    word* log = nullptr; // null: nothing
    glm::ivec3 extent{};
    bool by_chunks[count] = {}; // which targets are cleared so
    int last_by_chunks = -1;
    bool changes_known = false; // whether any target is cleared of which the log may know what it was
    known after[count];         // what is known of each target when all are cleared

    // Of a call that marks all that it draws. may_end(t, k): whether what the call does not draw ends with the bits
    // that target k is cleared to.
    template <class MayEnd>
    change_tracking(const framebuffer_view<Targets...>& fb, bool is_tracked, const MayEnd& may_end)
        : log(is_tracked ? fb.changes : nullptr), extent(fb.extent) {
        if (log == nullptr) return;
        core::for_each_index<count>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(fb.targets);
            if (t.load != load_operation::clear || !can_be_known(t)) return;
            changes_known = true;
            if (!may_end(t, K)) return;
            if constexpr (sizeof(t.clear_value) <= core::change_log::most_bytes) {
                by_chunks[K] = true;
                last_by_chunks = static_cast<int>(K);
                after[K] = known(t.clear_value);
            }
        });
    }
    // With words where the call has to mark what it draws.
    [[nodiscard]] chunk_marks marks() const {
        return log == nullptr ? chunk_marks{} : chunk_marks{log + core::change_log::header_words, extent};
    }
    [[nodiscard]] word* known_of(std::size_t k) const { return log + k * core::change_log::known_words; }
};

// A word of marks in a row of chunks: by one warp, whose lanes write a place of `value` each. `Place`: one element, or
// as many as fill 16 bytes.
template <class Element, class Place>
struct chunk_filler {
    static constexpr int per_place = static_cast<int>(sizeof(Place) / sizeof(Element));
    static constexpr int lanes_of_row = chunk_x / per_place, rows_at_once = 32 / lanes_of_row; // of a chunk
    static_assert(per_place <= chunk_x && 32 % lanes_of_row == 0);

    Place* to;
    glm::ivec3 extent;
    Place value;

    __device__ VOXELPIPE_INLINE void put(int x, int y, int z) const {
        const std::size_t row =
            static_cast<std::size_t>(z) * static_cast<unsigned>(extent.y) + static_cast<unsigned>(y);
        to[(row * static_cast<unsigned>(extent.x) + static_cast<unsigned>(x)) / per_place] = value;
    }
    // The lowest voxel of the word's first chunk.
    __device__ VOXELPIPE_INLINE void fill(int x0, int y0, int z0, word marked) const {
        const int lane = static_cast<int>(threadIdx.x) % 32;
        const int rows_y = min(chunk_yz, extent.y - y0), rows = rows_y * min(chunk_yz, extent.z - z0);
        if (marked == ~0u) { // in the order of memory
            const int end = min(x0 + 32 * chunk_x, extent.x);
            for (int i = 0; i < rows; ++i)
                for (int x = x0 + lane * per_place; x < end; x += 32 * per_place)
                    put(x, y0 + i % rows_y, z0 + i / rows_y);
            return;
        }
        for (; marked != 0; marked &= marked - 1) {
            const int x = x0 + (__ffs(static_cast<int>(marked)) - 1) * chunk_x + lane % lanes_of_row * per_place;
            if (x >= extent.x) continue;
            for (int i = lane / lanes_of_row; i < rows; i += rows_at_once) put(x, y0 + i % rows_y, z0 + i / rows_y);
        }
    }
};

// One target. A warp takes a row of chunks, and wipes its marks where no other target is to be cleared by them.
template <class Element>
__global__ __launch_bounds__(threads_per_block) void clear_chunks_kernel(
    Element* elements, const __grid_constant__ chunk_marks marks, const word* known,
    const __grid_constant__ core::change_log::known wanted, const __grid_constant__ fill_pattern<Element> pattern,
    bool wipes, const pipeline_state* state, capacities limits) {
    constexpr int known_words = core::change_log::known_words;
    static_assert(known_words <= 32);
    await_stream();
    if (has_failed(*state, limits)) return;
    const int lane = static_cast<int>(threadIdx.x) % 32;
    const bool is_known =
        __all_sync(0xffffffffu, lane >= known_words || known[lane % known_words] == wanted.words[lane % known_words]);
    const auto clear_all = [&](const auto& filler) {
        const unsigned warps = gridDim.x * (blockDim.x / 32), rows_y = static_cast<unsigned>(marks.rows.y);
        const auto num_rows = static_cast<unsigned>(marks.rows.count());
        for (unsigned i = blockIdx.x * (blockDim.x / 32) + threadIdx.x / 32; i < num_rows; i += warps) {
            const auto y = static_cast<int>(i % rows_y), z = static_cast<int>(i / rows_y);
            word* const row = marks.row(y, z);
            for (int w = 0; w < marks.rows.words; ++w) {
                const word marked = is_known ? row[w] : ~0u;
                __syncwarp();
                if (wipes && lane == 0) row[w] = 0;
                filler.fill(w * 32 * chunk_x, y * chunk_yz, z * chunk_yz, marked);
            }
        }
    };
    if constexpr (16 % sizeof(Element) == 0) {
        if (has_wide_rows(elements, marks)) {
            Element lanes[16 / sizeof(Element)];
            for (Element& e : lanes) e = pattern.value;
            chunk_filler<Element, uint4> filler{reinterpret_cast<uint4*>(elements), marks.extent, {}};
            memcpy(&filler.value, lanes, 16);
            clear_all(filler);
            return;
        }
    }
    clear_all(chunk_filler<Element, Element>{elements, marks.extent, pattern.value});
}

// What is known from now on. One block.
template <std::size_t N>
struct known_targets {
    core::change_log::known of[N];
};
template <std::size_t N>
__global__ void note_clears_kernel(word* log, const __grid_constant__ known_targets<N> after,
                                   const pipeline_state* state, capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    for (unsigned i = threadIdx.x; i < N * core::change_log::known_words; i += blockDim.x)
        log[i] = after.of[i / core::change_log::known_words].words[i % core::change_log::known_words];
}

// Clears what the tracking says, by chunks. Then the log knows that, and nothing of the other targets: the marks are
// those of all.
template <class... Targets>
void clear_by_chunks(const change_tracking<framebuffer_view<Targets...>>& tracking,
                     const framebuffer_view<Targets...>& fb, const pipeline_state* state, const capacities& limits,
                     cudaStream_t stream) {
    constexpr std::size_t count = sizeof...(Targets);
    if (!tracking.changes_known) return;
    const chunk_marks marks = tracking.marks();
    const auto blocks = static_cast<unsigned>(marks.rows.count() / (threads_per_block / 32) + 1);
    core::for_each_index<count>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        using map = typename target::map;
        using element = typename target::element_type;
        if (!tracking.by_chunks[K]) return;
        const auto& t = voxelpipe::get<K>(fb.targets);
        const auto clear = [&](element* to, const element& value, bool is_last) {
            launch_behind(clear_chunks_kernel<element>, blocks, threads_per_block, stream, stage::fine_raster, to,
                          marks, tracking.known_of(K), tracking.after[K], fill_pattern<element>{value},
                          is_last && tracking.last_by_chunks == static_cast<int>(K), state, limits);
        };
        if constexpr (map::planes) {
            for (int c = 0; c < map::components; ++c)
                clear(t.elements + static_cast<std::size_t>(c) * map::cells(t.extent), t.clear_value[c],
                      c + 1 == map::components);
        } else if constexpr (!map::is_bit && !map::bricks) {
            clear(t.elements, t.clear_value, true);
        }
    });
    known_targets<count> after;
    std::copy_n(tracking.after, count, after.of);
    launch_behind(note_clears_kernel<count>, 1, 32, stream, stage::fine_raster, tracking.log, after, state, limits);
}

// Marks the chunks of voxels that are listed, neighbours mostly in one.
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
        const voxel_place at = place_of(voxel, marks.extent);
        marks.mark_row(at.x, at.x, at.y, at.z);
    }
}
// Where the call has to: `num` of the state's counters says how many there are, room is no less.
template <class Tracking, class Voxel>
void mark_voxels(const Tracking& tracking, const Voxel* voxels, const unsigned long long* num, std::uint64_t room,
                 const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    if (tracking.log == nullptr) return;
    launch_behind(mark_voxels_kernel<Voxel>, fill_device(room), threads_per_block, stream, stage::tile_resolve, voxels,
                  num, tracking.marks(), state, limits);
}

} // namespace voxelpipe::device
