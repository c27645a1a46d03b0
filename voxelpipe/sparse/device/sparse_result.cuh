// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// sparse_result: what calls that never wait make of bricks, in memory of the caller, and what such a call goes on from.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/sparse/device/bounded_bricks.cuh>
#include <voxelpipe/sparse/sparse.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelpipe {

// The result of an earlier call, which a call can go on from. Refers to memory of the device that is not part of the
// call's workspace; the stream has passed what writes it when it reaches the call.
template <class... Targets>
struct sparse_start {
    // Bricks, tiles and values; what absent voxels read as.
    sparse_view<Targets...> view{{}, {}, core::make_pack(Targets::traits::identity()...)};
    grid where; // of the earlier call
};

// Bricks and values in device memory, as those of a sparse framebuffer. voxelize_async sets counts, view and where:
// pointers into its workspace, which stay valid as long as that serves the same call, and may be read once the stream
// has passed the call.
template <class... Targets>
struct sparse_result {
    static constexpr std::size_t num_targets = sizeof...(Targets); // render targets

    // To be set before the call. What voxels of cleared targets start from, and absent ones read as.
    core::pack<typename Targets::value_type...> clear_values = core::make_pack(Targets::traits::identity()...);
    // The operation on each target: clear, the default, or load or off, which go on from `start`. If any target is not
    // cleared, the voxels of `start` stay.
    std::array<load_operation, num_targets> loads{};
    sparse_start<Targets...> start; // What the call goes on from; nothing by default.

    // True if the call keeps the sums of voxels in `sums`, as sparse_framebuffer::keep_sums; only targets that sum
    // floats or saturate signed integers have any. `load` leaves it as it is.
    template <std::size_t I>
    void keep_sums(bool keep = true) {
        static_assert(core::has_wide_sums<typename core::pack_element<I, Targets...>::type>,
                      "voxelpipe: this target's blend keeps no sums");
        keeps_sums_[I] = keep;
    }

    const sparse_counts* counts = nullptr; // numbers of bricks, voxels and tiles
    // For device code. Its table has room: behind the last brick its keys are ~0, which no voxel has, and behind the
    // last tile it has brick_tile::none().
    sparse_view<Targets...> view{};
    core::pack<const core::kept_sum<Targets>*...> sums{}; // by rank, where they are kept; set by the call
    grid where;                                           // of the call
    bool is_tiled = false;                                // as host_sparse's; set by the call

    // Makes the next call go on from what an earlier one left: every target loads. It must be given another workspace.
    void load(const sparse_result& earlier) {
        start = {earlier.view, earlier.where};
        loads.fill(load_operation::load);
    }
    // Makes the next call go on from a sparse framebuffer, which no call may change until the stream has passed this
    // one. A target that it keeps no values of has to be cleared.
    void load(const sparse_framebuffer<cuda_backend, Targets...>& earlier) {
        start = {earlier.view(), earlier.where()};
        loads.fill(load_operation::load);
    }
    // True if voxels of `start` stay, where it has any.
    [[nodiscard]] bool keeps_voxels() const {
        bool keeps = false;
        for (const load_operation l : loads) keeps = keeps || l != load_operation::clear;
        return keeps && (start.view.table.count != 0 || start.view.table.num_tiles != 0);
    }
    // True if the call keeps the sums of this target.
    [[nodiscard]] bool keeps_sums(std::size_t target) const { return keeps_sums_[target]; }
    // True if it keeps those of any.
    [[nodiscard]] bool keeps_any_sums() const {
        bool keeps = false;
        for (const bool k : keeps_sums_) keeps = keeps || k;
        return keeps;
    }
    // The values that absent voxels read as after the call.
    [[nodiscard]] core::pack<typename Targets::value_type...> next_background() const {
        auto values = start.view.clear_values;
        core::for_each_index<num_targets>([&]<std::size_t I>() {
            if (loads[I] == load_operation::clear) get<I>(values) = get<I>(clear_values);
        });
        return values;
    }

    // Copies to the host and waits. Throws std::runtime_error with the CUDA error.
    [[nodiscard]] host_sparse<Targets...> to_host(cuda_backend& backend) const {
        host_sparse<Targets...> h;
        h.where = where;
        h.is_tiled = is_tiled;
        h.clear_values = counts == nullptr ? next_background() : view.clear_values;
        if (counts == nullptr) return h;
        const auto copy = [&](auto& to, const auto* from, std::uint64_t count) {
            to.resize(count);
            if (count != 0)
                device::check(
                    cudaMemcpyAsync(to.data(), from, count * sizeof(*from), cudaMemcpyDeviceToHost, backend.stream));
        };
        device::with_runtime_errors([&] {
            std::vector<sparse_counts> n;
            copy(n, counts, 1);
            device::check(cudaStreamSynchronize(backend.stream));
            copy(h.keys, view.table.keys, n[0].bricks);
            copy(h.masks, view.table.masks, n[0].bricks);
            copy(h.offsets, view.table.offsets, n[0].bricks == 0 ? 0 : n[0].bricks + 1);
            copy(h.tiles, view.table.tiles, n[0].tiles);
            core::for_each_index<num_targets>([&]<std::size_t I>() {
                using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
                const std::uint64_t ranks = n[0].voxels + n[0].tiles;
                copy(get<I>(h.values), get<I>(view.values), map::elements(ranks));
                if (get<I>(sums) != nullptr) copy(get<I>(h.sums), get<I>(sums), ranks);
            });
            device::check(cudaStreamSynchronize(backend.stream));
        });
        return h;
    }

private:
    std::array<bool, num_targets> keeps_sums_{};
};

namespace core {

// True if a call in this grid can go on from what the result says, as validate_sparse.
template <class... Targets>
[[nodiscard]] status validate_start(const sparse_result<Targets...>& result, const grid& g) {
    if (!result.keeps_voxels()) return {};
    const grid& before = result.start.where;
    if (before.extent != g.extent || before.offset != g.offset || before.whole_extent() != g.whole_extent())
        return failure(status_code::extent_mismatch);
    bool has_memory = true;
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        if (result.loads[I] != load_operation::clear)
            has_memory = has_memory && get<I>(result.start.view.values) != nullptr;
    });
    return has_memory ? status{} : failure(status_code::null_view);
}

} // namespace core
} // namespace voxelpipe
