// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse framebuffers of constant shaders. A raster at the size of bricks (and of nodes, in large grids) marks those
// that triangles may touch, in the index; the bits before each give the bricks' numbers; the raster at the size of
// voxels sets bits in the masks. Values follow from the masks, or from the number of fragments of each voxel. Nothing
// is sorted, and beside the result memory is in proportion to the bricks and the triangles.

#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/call/attempt.cuh>
#include <voxelpipe/device/call/strategy.hpp>
#include <voxelpipe/device/fragments/list_sink.cuh>
#include <voxelpipe/sparse/device/brick_raster.cuh>
#include <voxelpipe/sparse/device/mask_counts.cuh>
#include <voxelpipe/sparse/device/mask_values.cuh>
#include <voxelpipe/sparse/sparse.hpp>

#include <cstdint>
#include <span>

namespace voxelpipe::device {

// ---- which calls ----------------------------------------------------------------------------------------------------

template <class FragmentShader, class... Targets>
inline constexpr bool may_follow_from_masks = core::is_constant<FragmentShader> && (follows_from_count<Targets> && ...);

// True if the rasters of masks serve the draws: one constant.
template <class Draw>
[[nodiscard]] bool can_raster_masks(std::span<const Draw> draws, const grid& g, coverage rule,
                                    std::uint64_t triangles_in) {
    return core::arms_of(rule) == core::arm_set::none && draws.size() <= tuning::max_raster_draws &&
           is_rastered(triangles_in, core::make_snap_transform(g).fraction, g.extent,
                       rule == coverage::thin ? split_pieces<coverage::thin>::max_work_items(g.extent)
                                              : split_pieces<coverage::conservative>::max_work_items(g.extent)) &&
           core::have_same_values(draws);
}
template <class Draw, class Backend, class... Targets>
[[nodiscard]] bool follows_from_masks(std::span<const Draw> draws, const grid& g, coverage rule,
                                      std::uint64_t triangles_in, const sparse_framebuffer<Backend, Targets...>& fb) {
    bool keeps_sums = false;
    core::for_each_index<sizeof...(Targets)>(
        [&]<std::size_t I>() { keeps_sums = keeps_sums || get<I>(fb.targets()).keeps_sums; });
    return !keeps_sums && !core::keeps_voxels(fb) && can_raster_masks(draws, g, rule, triangles_in);
}

// ---- kernels --------------------------------------------------------------------------------------------------------

// Numbers that the host reads when the masks are complete.
struct mask_call_state {
    pipeline_state state;
    mask_totals masks;
};

template <int = 0> // compiled where it is called
__global__ void flag_bricks(const std::uint32_t* counts, std::uint32_t count, std::uint32_t* flags) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i < count) flags[i] = counts[i] != 0 ? 1 : 0;
}
template <int = 0> // compiled where it is called
__global__ void keep_bricks(const std::uint32_t* counts, std::uint32_t count, const unsigned long long* places,
                            const std::uint64_t* keys, const brick_mask* masks, const std::uint64_t* offsets,
                            std::uint64_t* to_keys, brick_mask* to_masks, std::uint64_t* to_offsets) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count || counts[i] == 0) return;
    const std::uint64_t at = places[i];
    to_keys[at] = keys[i];
    to_masks[at] = masks[i];
    to_offsets[at] = offsets[i];
}

// ---- the call -------------------------------------------------------------------------------------------------------

// Backend is cuda_backend, which includes what is below it and is not known here.
template <class Draw, class Backend, class... Targets>
class mask_call;
template <class Mesh, class VertexShader, class FragmentShader, class Backend, class... Targets>
class mask_call<draw<Mesh, VertexShader, FragmentShader>, Backend, Targets...> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    using framebuffer = sparse_framebuffer<Backend, Targets...>;

public:
    // Throws cuda_failure, std::bad_alloc or std::runtime_error.
    mask_call(Backend& backend, std::span<const draw_type> draws, const grid& g, stage_clock* clock)
        : backend_(backend), stream_(backend.stream), draws_(draws), g_(g), clock_(clock),
          totals_(backend, std::size_t{1}), index_(backend, g.whole_extent()), memory_(backend, plan_memory()),
          raster_(carve_raster()) {
        clear(totals_.data(), sizeof(mask_call_state));
        if (clock_ != nullptr) clock_->start();
    }

    template <coverage Rule>
    [[nodiscard]] status run(framebuffer& fb, bool count_voxels, std::uint64_t triangles_in) {
        constexpr bool is_coarse = brick_raster<draw_type>::template has_coarse<Rule>;
        // Until the end, because the pool of cudaMallocAsync gives back at each wait what is free, and mapping many MiB
        // again takes a call longer than drawing.
        const lists of_raster(*this, raster_.template reads_setups<Rule>() || !(is_blended_once<Targets> && ...));
        index_.mark_above(
            [&](const index_level& level, int log2_cell) { raster_.template mark<Rule>(level, log2_cell, is_coarse); });
        raster_.template mark<Rule>(index_.bricks(), index_level::log2_brick, is_coarse);
        const std::uint64_t bricks = index_.make_numbers();
        end_stage(clock_, &stage_times::tile_sort);
        if (bricks > core::max_numbered) return core::failure(status_code::size_overflow, stage::coarse_raster);

        sparse_contents<Backend, Targets...> made(backend_);
        made.masks = device_buffer<brick_mask>(backend_, bricks);
        if (bricks != 0) clear(made.masks.data(), bricks * sizeof(brick_mask));
        raster_.template set_masks<Rule>(index_.bricks(), made.masks.data(), &totals_.data()->state);
        made.keys = device_buffer<std::uint64_t>(backend_, bricks);
        made.offsets = device_buffer<std::uint64_t>(backend_, bricks == 0 ? 0 : bricks + 1);
        device_buffer<std::uint32_t> counts(backend_, bricks);
        if (bricks != 0) index_.write_keys(made.keys.data());
        if (bricks != 0)
            rank_bricks(backend_, made.masks.data(), static_cast<std::uint32_t>(bricks), counts.data(),
                        made.offsets.data(), &totals_.data()->masks, stage::fine_raster);
        end_stage(clock_, &stage_times::fine_raster);
        mask_call_state totals{};
        check(cudaMemcpyAsync(&totals, totals_.data(), sizeof(totals), cudaMemcpyDeviceToHost, stream_));
        check(cudaStreamSynchronize(stream_), stage::fine_raster);
        if (totals.state.index_error != 0) return core::failure(status_code::index_out_of_range, stage::coarse_raster);
        made.num_voxels = totals.masks.voxels;
        const std::uint64_t kept = bricks - totals.masks.empty_bricks;
        if (kept > fb.limits().bricks || totals.masks.voxels > fb.limits().voxels) {
            status limited = core::failure(status_code::capacity_exceeded, stage::tile_resolve);
            limited.required.bricks = kept;
            limited.required.voxels = totals.masks.voxels;
            return limited;
        }
        make_values<Rule>(fb, made);
        if (kept != bricks) drop_empty_bricks(made, counts, kept);
        end_stage(clock_, &stage_times::tile_resolve);
        check(cudaStreamSynchronize(stream_), stage::tile_resolve);
        fb.take(std::move(made), g_);
        status s = to_status(totals.state);
        s.counts.triangles_in = triangles_in;
        s.counts.voxels = count_voxels ? totals.masks.voxels : 0;
        return s;
    }

private:
    // The raster's lists while it draws.
    class lists {
    public:
        lists(mask_call& call, bool has_setups) : memory_(call.backend_, take(call, has_setups, nullptr)) {
            (void)take(call, has_setups, memory_.data());
        }

    private:
        static std::size_t take(mask_call& call, bool has_setups, void* memory) {
            arena at(memory);
            call.raster_.take_lists(at, has_setups);
            return at.used();
        }
        device_buffer<std::byte> memory_;
    };
    [[nodiscard]] std::size_t plan_memory() const {
        arena plan;
        (void)brick_raster<draw_type>(draws_, g_, stream_, clock_, plan);
        return plan.used();
    }
    [[nodiscard]] brick_raster<draw_type> carve_raster() {
        arena carved(memory_.data());
        return {draws_, g_, stream_, clock_, carved};
    }
    void clear(void* memory, std::size_t bytes) { check(cudaMemsetAsync(memory, 0, bytes, stream_)); }
    template <coverage Rule, class Contents>
    void make_values(const framebuffer& fb, Contents& made) {
        const std::uint64_t voxels = made.num_voxels;
        if (voxels == 0) return;
        device_buffer<std::uint32_t> counts(backend_, std::size_t{0});
        const auto counted = [&]() -> const std::uint32_t* {
            if (counts.size() == 0) {
                counts = device_buffer<std::uint32_t>(backend_, voxels);
                clear(counts.data(), voxels * sizeof(std::uint32_t));
                raster_.template count_fragments<Rule>(index_.bricks(), made.masks.data(), made.offsets.data(),
                                                       counts.data());
            }
            return counts.data();
        };
        const auto background = fb.next_background();
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            using map = core::rank_map<target>;
            const auto& t = get<I>(fb.targets());
            if (!t.enabled) return;
            auto& values = get<I>(made.values);
            values = device_buffer<typename map::element>(backend_, map::elements(voxels));
            write_mask_values<I, target>(values.data(), voxels, &totals_.data()->masks.voxels,
                                         draws_[0].fragment_shader, get<I>(background), t.load == load_operation::off,
                                         counted, stream_);
        });
    }
    // Bricks at the border of the grid's part may have been marked because of what lies beyond it.
    template <class Contents>
    void drop_empty_bricks(Contents& made, const device_buffer<std::uint32_t>& counts, std::uint64_t kept) {
        const auto bricks = static_cast<std::uint32_t>(counts.size());
        constexpr stage where = stage::tile_resolve;
        device_buffer<std::uint32_t> flags(backend_, bricks);
        device_buffer<unsigned long long> places(backend_, bricks);
        device_buffer<std::byte> storage(backend_, cell_scan_bytes(bricks));
        launch_kernel(false, flag_bricks<0>, num_blocks(bricks), threads_per_block, 0, stream_, where, counts.data(),
                      bricks, flags.data());
        sum_counts(flags.data(), places.data(), bricks, storage.data(), storage.size(), where, stream_);
        device_buffer<std::uint64_t> keys(backend_, kept), offsets(backend_, kept == 0 ? 0 : kept + 1);
        device_buffer<brick_mask> masks(backend_, kept);
        if (kept != 0) {
            launch_kernel(
                false, keep_bricks<0>, num_blocks(bricks), threads_per_block, 0, stream_, where, counts.data(), bricks,
                static_cast<const unsigned long long*>(places.data()),
                static_cast<const std::uint64_t*>(made.keys.data()), static_cast<const brick_mask*>(made.masks.data()),
                static_cast<const std::uint64_t*>(made.offsets.data()), keys.data(), masks.data(), offsets.data());
            check(cudaMemcpyAsync(offsets.data() + kept, made.offsets.data() + bricks, sizeof(std::uint64_t),
                                  cudaMemcpyDeviceToDevice, stream_),
                  where);
        }
        made.keys = std::move(keys);
        made.masks = std::move(masks);
        made.offsets = std::move(offsets);
    }

    Backend& backend_;
    cudaStream_t stream_;
    std::span<const draw_type> draws_;
    const grid& g_;
    stage_clock* clock_;
    device_buffer<mask_call_state> totals_;
    brick_index<> index_;
    device_buffer<std::byte> memory_; // of the raster
    brick_raster<draw_type> raster_;
};

} // namespace voxelpipe::device
