// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// merge_async: joins the results of sparse calls in parts of one grid, on this GPU or on others, to the bytes of one
// call in the whole. Never waits, never allocates. The parts are copied as far as they have room, since the host does
// not know how much of it they use; then their bricks are numbered by an index, as those of any call, and each voxel's
// values go to its rank. Tiles are not joined here: a brick that a border cuts may become a tile, and eight equal tiles
// of several parts become one, level by level, so that voxels move behind the bricks, and how many ranks there are is
// known last. merge() of sparse_merge.hpp does that on the host.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/sparse/device/sparse_async.cuh>

#include <glm/common.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe {
namespace device {

template <class... Targets>
using rank_elements = core::pack<typename core::rank_map<Targets>::element*...>;
template <class... Targets>
using rank_sums = core::pack<core::kept_sum<Targets>*...>;

// A part's copy on the merging GPU.
template <class... Targets>
struct copied_part {
    const sparse_result<Targets...>& from;
    const workspace_view& workspace; // of the part
    pipeline_state* state;
    std::uint64_t* keys;
    brick_mask* masks;
    std::uint64_t* offsets;
    rank_elements<Targets...> values{};
    rank_sums<Targets...> sums{};

    copied_part(const sparse_result<Targets...>& result, const workspace_view& w, arena& memory)
        : from(result), workspace(w), state(memory.take<pipeline_state>(1)),
          keys(memory.take<std::uint64_t>(num_bricks())), masks(memory.take<brick_mask>(num_bricks())),
          offsets(memory.take<std::uint64_t>(num_bricks() + 1)) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            using map = core::rank_map<target>;
            get<I>(values) = memory.take<typename map::element>(map::elements(w.limits.voxels));
            if (result.keeps_sums(I)) get<I>(sums) = memory.take<core::kept_sum<target>>(w.limits.voxels);
        });
    }
    [[nodiscard]] std::uint64_t num_bricks() const { return from.view.table.count; }
    [[nodiscard]] brick_table table() const { return {keys, masks, offsets, num_bricks()}; }
    void copy(cudaStream_t stream) const {
        const auto one = [&](auto* to, const void* source, std::uint64_t count) {
            if (to != nullptr && count != 0)
                check(cudaMemcpyAsync(to, source, count * sizeof(*to), cudaMemcpyDefault, stream));
        };
        const brick_table& t = from.view.table;
        one(state, workspace.memory, 1); // which a call's memory begins with
        one(keys, t.keys, num_bricks());
        one(masks, t.masks, num_bricks());
        one(offsets, t.offsets, num_bricks() + 1);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
            one(get<I>(values), get<I>(from.view.values), map::elements(workspace.limits.voxels));
            one(get<I>(sums), get<I>(from.sums), workspace.limits.voxels);
        });
    }
};

// Stops the merge if a part has failed, as read_status finds it.
struct stop_after_part {
    const pipeline_state* part;
    capacities limits;
    brick_room room;
    pipeline_state* state;
    __device__ void operator()(std::uint64_t) const {
        if (has_failed(*part, limits) || part->sparse.nodes > room.nodes || part->sparse.bricks > room.bricks ||
            part->sparse.voxels > room.voxels)
            state->index_error = stopped;
    }
};

// Copies the values of a part's voxels, a word of a mask a call. Words of bits are zero before.
template <class... Targets>
struct copy_part_values {
    brick_table from;
    index_level bricks; // of the whole
    const brick_mask* masks;
    const std::uint64_t* offsets;
    const sparse_counts* made;
    rank_elements<Targets...> values, to;
    rank_sums<Targets...> sums, to_sums; // null where they are not kept

    __device__ void operator()(std::uint64_t i) const {
        if (made->bricks == 0 || from.keys[i / 8] == brick_table::none) return;
        const auto w = static_cast<unsigned>(i % 8);
        std::uint64_t word = from.masks[i / 8].words[w];
        if (word == 0) return;
        std::uint64_t old = from.offsets[i / 8] + from.masks[i / 8].before(64 * w);
        const std::uint32_t brick = bricks.number_of(from.keys[i / 8]);
        const std::uint64_t first = offsets[brick] + masks[brick].before(64 * w);
        for (; word != 0; word &= word - 1, ++old) {
            const std::uint64_t below = (word & (~word + 1)) - 1;
            const std::uint64_t rank = first + core::count_ones(masks[brick].words[w] & below);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
                if constexpr (map::is_bit) {
                    if (map::load(get<I>(values), old)) atomicOr(get<I>(to) + rank / 32, 1u << (rank % 32));
                } else {
                    map::store(get<I>(to), rank, map::load(get<I>(values), old));
                }
                if (get<I>(to_sums) != nullptr) get<I>(to_sums)[rank] = get<I>(sums)[old];
            });
        }
    }
};

// One merge in the caller's memory.
template <class... Targets>
struct bounded_merge {
    std::span<const sparse_result<Targets...>> parts;
    std::span<const workspace_view> workspaces; // of the parts
    const grid& g;                              // around them
    workspace_view workspace;                   // its limits
    cudaStream_t stream;

    template <bool Run>
    [[nodiscard]] bool operator()(arena& memory, sparse_result<Targets...>& result) const {
        if (!are_numbered_bricks(workspace.limits)) return false;
        auto* const state = memory.take<pipeline_state>(1);
        const bounded_result<bounded_bricks<>, Targets...> made({g.whole_extent(), to_room(workspace.limits), memory},
                                                                workspace.limits, parts[0], memory);
        std::vector<copied_part<Targets...>> copies;
        for (std::size_t p = 0; p < parts.size(); ++p) copies.emplace_back(parts[p], workspaces[p], memory);
        if constexpr (Run) {
            constexpr stage where = stage::tile_resolve;
            const bounded_bricks<>& bricks = made.bricks;
            check(cudaMemsetAsync(state, 0, sizeof(pipeline_state), stream));
            take_stop(workspace, state, stream);
            bricks.clear(stream);
            for (const copied_part<Targets...>& c : copies) {
                c.copy(stream);
                const workspace_limits& l = c.workspace.limits;
                for_each(1, stop_after_part{c.state, to_capacities(l), to_room(l), state}, where, stream);
            }
            const auto by_parts = [&](auto* kernel, std::uint64_t threads_each, const auto&... rest) {
                for (const copied_part<Targets...>& c : copies)
                    if (c.num_bricks() != 0)
                        launch_kernel(false, kernel, num_blocks(c.num_bricks() * threads_each), threads_per_block, 0,
                                      stream, where, c.table(), rest...);
            };
            const auto mark = [&](const index_level& level, int log2_cell) {
                by_parts(mark_kept_bricks<0>, 1, level, log2_cell);
            };
            bricks.index.mark_above(mark, &state->sparse.nodes, stream);
            mark(bricks.index.bricks(), index_level::log2_brick);
            bricks.number(stream);
            by_parts(mask_kept_voxels<0>, 8, bricks.index.bricks(), bricks.masks);
            made.publish(state, nullptr, &bricks.totals->voxels, stream);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
                if constexpr (map::is_bit)
                    check(cudaMemsetAsync(get<I>(made.values), 0,
                                          map::elements(workspace.limits.voxels) * sizeof(*get<I>(made.values)),
                                          stream));
            });
            for (const copied_part<Targets...>& c : copies)
                for_each(c.num_bricks() * 8,
                         copy_part_values<Targets...>{c.table(), bricks.index.bricks(), bricks.masks, bricks.offsets,
                                                      bricks.counts, c.values, made.values, c.sums, made.sums},
                         where, stream);
            made.set(result, g, nullptr, 0);
        }
        return true;
    }
};

// The box around the parts, or why they cannot be joined.
template <class... Targets>
[[nodiscard]] status validate_parts(std::span<const sparse_result<Targets...>> parts, std::size_t num_workspaces,
                                    grid& around) {
    if (parts.empty() || num_workspaces != parts.size()) return core::failure(status_code::extent_mismatch);
    glm::ivec3 low = parts[0].where.offset, high = low;
    for (const sparse_result<Targets...>& part : parts) {
        if (part.counts == nullptr) return core::failure(status_code::null_view);
        if (part.where.uncropped() != parts[0].where.uncropped()) return core::failure(status_code::extent_mismatch);
        if (part.view.table.num_tiles != 0) return core::failure(status_code::strategy_unavailable);
        for (std::size_t i = 0; i < sizeof...(Targets); ++i)
            if (part.keeps_sums(i) != parts[0].keeps_sums(i)) return core::failure(status_code::null_view);
        low = glm::min(low, part.where.offset);
        high = glm::max(high, part.where.offset + part.where.extent);
    }
    around = parts[0].where.uncropped().crop(low, high - low);
    return {};
}

} // namespace device

// Bytes that merge_async needs for these parts on the current device; 0 if they cannot be joined. Of the limits it uses
// `bricks`, `voxels` and `nodes`.
template <class... Targets>
[[nodiscard]] std::size_t merge_workspace_bytes(std::span<const sparse_result<Targets...>> parts,
                                                std::span<const workspace_view> workspaces,
                                                const workspace_limits& limits) {
    grid around;
    if (!device::validate_parts(parts, workspaces.size(), around).ok()) return 0;
    return device::bytes_or_none([&] {
        return device::bounded_bytes(
            parts[0], device::bounded_merge<Targets...>{parts, workspaces, around, {nullptr, 0, limits}, nullptr});
    });
}

// Puts the merge of parts without a common voxel on the backend's stream, sets `whole` to where its bricks and values
// will be, and returns. workspaces: of the parts' calls, made with a workspace_view. A part may lie on another GPU; its
// call must have ended when the stream reaches the merge, and its memory must stay as it is until the stream has passed
// it. `whole` reads as the first part where voxels are absent. If a part's call failed, or something does not fit, it
// is empty, and read_status(backend, workspace) says other_rank_failed or capacity_exceeded.
// A status other than ok means that nothing was launched, or that a launch failed. extent_mismatch: no parts, not one
// workspace a part, or parts of several grids. null_view: a part was not drawn, or keeps other sums than the first.
// strategy_unavailable: a part may have tiles, which merge() joins on the host. size_overflow: limits beyond what is
// numbered.
template <class... Targets>
[[nodiscard]] status merge_async(cuda_backend& backend,
                                 std::type_identity_t<std::span<const sparse_result<Targets...>>> parts,
                                 std::span<const workspace_view> workspaces, sparse_result<Targets...>& whole,
                                 const workspace_view& workspace) {
    grid around;
    if (const status s = device::validate_parts(parts, workspaces.size(), around); !s.ok()) return s;
    sparse_result<Targets...> made = parts[0];
    made.start = {};
    made.loads = {};
    made.clear_values = parts[0].view.clear_values;
    const status s =
        device::launch_bounded(workspace, status{}, made,
                               device::bounded_merge<Targets...>{parts, workspaces, around, workspace, backend.stream});
    if (s.ok()) whole = made;
    return s;
}

} // namespace voxelpipe
