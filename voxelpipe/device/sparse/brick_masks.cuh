// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse framebuffers of constant shaders. A raster at the size of bricks (and of nodes, in large grids) marks those
// that triangles may touch, in the index; the bits before each give the bricks' numbers; the raster at the size of
// voxels sets bits in the masks. Values follow from the masks, or from the number of fragments of each voxel. Nothing
// is sorted, and beside the result memory is in proportion to the bricks and the triangles.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/call/attempt.cuh>
#include <voxelpipe/device/call/strategy.hpp>
#include <voxelpipe/device/fragments/list_sink.cuh>
#include <voxelpipe/device/raster/raster_draws.cuh>
#include <voxelpipe/device/sparse/brick_sinks.cuh>
#include <voxelpipe/device/sparse/mask_counts.cuh>
#include <voxelpipe/device/targets/fill_from_mask.cuh>
#include <voxelpipe/device/targets/repeated_fold.hpp>
#include <voxelpipe/sparse.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

namespace voxelpipe::device {

// ---- which calls ----------------------------------------------------------------------------------------------------

// Whether a target's value is known from the number of a voxel's fragments, all of one value.
template <class Target>
inline constexpr bool follows_from_count =
    is_blended_once<Target> || core::repeated_fold<typename Target::blend_type, typename Target::value_type>::available;
template <class FragmentShader, class... Targets>
inline constexpr bool may_follow_from_masks = core::is_constant<FragmentShader> && (follows_from_count<Targets> && ...);

template <class Draw, class Backend, class... Targets>
[[nodiscard]] bool follows_from_masks(std::span<const Draw> draws, const grid& g, coverage rule,
                                      std::uint64_t triangles_in, const sparse_framebuffer<Backend, Targets...>& fb) {
    const glm::ivec3 whole = g.whole_extent();
    if (core::arms_of(rule) != core::arm_set::none || core::keeps_voxels(fb) ||
        std::max({whole.x, whole.y, whole.z}) > brick_index<>::max_extent || draws.size() > tuning::max_raster_draws ||
        !is_rastered(triangles_in, core::make_snap_transform(g).fraction, g.extent,
                     rule == coverage::thin ? split_pieces<coverage::thin>::max_work_items(g.extent)
                                            : split_pieces<coverage::conservative>::max_work_items(g.extent)))
        return false;
    bool keeps_sums = false;
    core::for_each_index<sizeof...(Targets)>(
        [&]<std::size_t I>() { keeps_sums = keeps_sums || get<I>(fb.targets()).keeps_sums; });
    return !keeps_sums && std::all_of(draws.begin(), draws.end(), [&](const Draw& d) {
        return std::memcmp(&draws[0].fragment_shader.values, &d.fragment_shader.values,
                           sizeof(d.fragment_shader.values)) == 0;
    });
}

// ---- kernels --------------------------------------------------------------------------------------------------------

// What the host reads when the masks are complete.
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

// The same value for every voxel; of bits, `elements` words.
template <class Element>
__global__ void fill_values(Element* values, std::uint64_t elements, Element value) {
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < elements;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        values[i] = value;
}
template <class Target>
__global__ void fold_counts(typename Target::value_type* values, std::uint64_t voxels, const std::uint32_t* counts,
                            core::repeated_fold<typename Target::blend_type, typename Target::value_type> fold) {
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < voxels;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        values[i] = fold(counts[i]);
}
// Of a target of bits: a word a thread.
template <class Target>
__global__ void fold_bit_counts(word* values, std::uint64_t voxels, const std::uint32_t* counts,
                                core::repeated_fold<typename Target::blend_type, typename Target::value_type> fold) {
    for (std::uint64_t w = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; w < (voxels + 31) / 32;
         w += std::uint64_t{gridDim.x} * blockDim.x) {
        word bits = 0;
        for (unsigned k = 0; k < 32 && 32 * w + k < voxels; ++k)
            bits |= static_cast<word>(static_cast<bool>(fold(counts[32 * w + k]))) << k;
        values[w] = bits;
    }
}

// ---- the call -------------------------------------------------------------------------------------------------------

// Backend is cuda_backend, which includes what is below it and is not known here.
template <class Draw, class Backend, class... Targets>
class mask_call;
template <class Mesh, class VertexShader, class FragmentShader, class Backend, class... Targets>
class mask_call<draw<Mesh, VertexShader, FragmentShader>, Backend, Targets...> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    using framebuffer = sparse_framebuffer<Backend, Targets...>;
    static constexpr bool shades_in_raster = is_cheap<VertexShader>;

public:
    // Throws cuda_failure, std::bad_alloc or std::runtime_error.
    mask_call(Backend& backend, std::span<const draw_type> draws, const grid& g, stage_clock* clock)
        : backend_(backend), stream_(backend.stream), draws_(draws), g_(g), snap_(core::make_snap_transform(g)),
          clock_(clock), totals_(backend, std::size_t{1}), coarse_state_(backend, std::size_t{1}),
          index_(backend, g.whole_extent()), memory_(backend, plan_memory()) {
        arena carved(memory_.data());
        positions_ = vertex_positions::take(carved, shades_in_raster ? 0 : max_vertices());
        deferred_ = deferred_triangles::take(carved, max_triangles());
        clear(totals_.data(), sizeof(mask_call_state));
        if (clock_ != nullptr) clock_->start();
    }

    template <coverage Rule>
    [[nodiscard]] status run(framebuffer& fb, bool count_voxels, std::uint64_t triangles_in) {
        if (index_.has_nodes()) {
            mark<Rule>(index_.nodes(), 7);
            index_.make_words();
        }
        mark<Rule>(index_.bricks(), 3);
        const std::uint64_t bricks = index_.make_numbers();
        end_stage(clock_, &stage_times::tile_sort);
        if (bricks > core::max_numbered) return core::failure(status_code::size_overflow, stage::coarse_raster);

        sparse_contents<Backend, Targets...> made(backend_);
        made.keys = device_buffer<std::uint64_t>(backend_, bricks);
        made.masks = device_buffer<brick_mask>(backend_, bricks);
        made.offsets = device_buffer<std::uint64_t>(backend_, bricks == 0 ? 0 : bricks + 1);
        if (bricks != 0) {
            index_.write_keys(made.keys.data());
            clear(made.masks.data(), bricks * sizeof(brick_mask));
        }
        pipeline_state* const state = &totals_.data()->state;
        raster<Rule>(snap_.fraction, g_.extent, state, stage::fine_raster, [&](const auto& base) {
            masking_output out{base, index_.bricks(), nullptr};
            out.lead = g_.offset;
            out.masks = reinterpret_cast<unsigned long long*>(made.masks.data());
            return out;
        });
        device_buffer<std::uint32_t> counts(backend_, bricks);
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
    [[nodiscard]] std::size_t max_triangles() const {
        std::size_t most = 0;
        for (const draw_type& d : draws_) most = std::max<std::size_t>(most, d.mesh.num_triangles());
        return most;
    }
    [[nodiscard]] std::size_t max_vertices() const {
        std::size_t most = 0;
        for (const draw_type& d : draws_) most = std::max<std::size_t>(most, d.mesh.num_vertices());
        return most;
    }
    [[nodiscard]] std::size_t plan_memory() const {
        arena plan;
        (void)vertex_positions::take(plan, shades_in_raster ? 0 : max_vertices());
        (void)deferred_triangles::take(plan, max_triangles());
        return plan.used();
    }
    void clear(void* memory, std::size_t bytes) { check(cudaMemsetAsync(memory, 0, bytes, stream_)); }

    // The raster into the output that output(base) makes.
    template <coverage Rule, class Output>
    void raster(int fraction, const glm::ivec3& extent, pipeline_state* state, stage where, const Output& output) {
        raster_each_draw<shades_in_raster>(
            draws_, snap_, positions_, state, clock_, stream_,
            [&](const draw_type& d, const auto& source, bool is_first) {
                using source_type = std::remove_cvref_t<decltype(source)>;
                const auto vertices =
                    static_cast<std::uint32_t>(shades_in_raster ? d.mesh.positions.size() : d.mesh.num_vertices());
                const auto triangles = static_cast<std::uint32_t>(d.mesh.num_triangles());
                const output_base base{glm::ivec3(0), vertices, state, d.mesh.has_checked_indices()};
                const auto out = output(base);
                const raster_call<Rule, source_type, std::remove_cvref_t<decltype(out)>> call{
                    {source, triangles, fraction, extent}, out, deferred_.with(state)};
                launch_raster(call, state, where, stream_, is_first && is_first_pass_);
                is_first_pass_ = false;
            });
    }
    // Marks the cells of 2^log2_cell voxels a side that triangles may touch. Conservative coverage has a raster of that
    // size; cells that lie otherwise, and thin fragments, which may lie beyond their triangle, are marked voxel by
    // voxel.
    template <coverage Rule>
    void mark(const index_level& level, int log2_cell) {
        clear(coarse_state_.data(), sizeof(pipeline_state));
        const int cell = 1 << log2_cell;
        const bool is_aligned = g_.offset % cell == glm::ivec3(0);
        const bool is_coarse =
            Rule == coverage::conservative && is_aligned && snap_.fraction + log2_cell < core::small_edge_bits;
        const int fraction = snap_.fraction + (is_coarse ? log2_cell : 0);
        const glm::ivec3 extent = is_coarse ? (g_.extent + (cell - 1)) / cell : g_.extent;
        raster<Rule>(fraction, extent, coarse_state_.data(), stage::coarse_raster, [&](const auto& base) {
            marking_output out{base, level, is_coarse ? 0 : log2_cell};
            out.lead = is_coarse ? g_.offset / cell : g_.offset;
            return out;
        });
        end_stage(clock_, &stage_times::coarse_raster);
    }
    template <coverage Rule, class Contents>
    void make_values(const framebuffer& fb, Contents& made) {
        const std::uint64_t voxels = made.num_voxels;
        if (voxels == 0) return;
        device_buffer<std::uint32_t> counts(backend_, std::size_t{0});
        const auto background = fb.next_background();
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            using map = core::rank_map<target>;
            using value_type = typename target::value_type;
            const auto& t = get<I>(fb.targets());
            if (!t.enabled) return;
            auto& values = get<I>(made.values);
            values = device_buffer<typename map::element>(backend_, map::elements(voxels));
            value_type drawn{};
            if constexpr (!std::is_same_v<typename target::blend_type, blend::count>)
                drawn = get<I>(draws_[0].fragment_shader.values);
            const value_type start = get<I>(background);
            if (t.load == load_operation::off) {
                fill<target>(values, start, voxels);
            } else if constexpr (is_blended_once<target>) {
                fill<target>(values, blended_once<target>(start, drawn), voxels);
            } else {
                if (counts.size() == 0) count_fragments<Rule>(made, counts);
                const core::repeated_fold<typename target::blend_type, value_type> fold(start, drawn);
                const auto launch = [&](auto* kernel, std::uint64_t items) {
                    launch_kernel(false, kernel, fill_device(items), threads_per_block, 0, stream_, stage::tile_resolve,
                                  values.data(), voxels, static_cast<const std::uint32_t*>(counts.data()), fold);
                };
                if constexpr (map::is_bit)
                    launch(fold_bit_counts<target>, values.size());
                else
                    launch(fold_counts<target>, voxels);
            }
        });
    }
    template <class Target, class Values>
    void fill(Values& values, const typename Target::value_type& value, std::uint64_t voxels) {
        using element = typename core::rank_map<Target>::element;
        const auto launch = [&](std::uint64_t first, std::uint64_t count, const element& e) {
            if (count != 0)
                launch_kernel(false, fill_values<element>, fill_device(count), threads_per_block, 0, stream_,
                              stage::tile_resolve, values.data() + first, count, e);
        };
        if constexpr (core::rank_map<Target>::is_bit) {
            const std::uint64_t words = voxels / 32;
            launch(0, words, value ? ~0u : 0u);
            launch(words, values.size() - words, value ? (1u << voxels % 32) - 1 : 0u);
        } else {
            launch(0, voxels, value);
        }
    }
    template <coverage Rule, class Contents>
    void count_fragments(const Contents& made, device_buffer<std::uint32_t>& counts) {
        counts = device_buffer<std::uint32_t>(backend_, made.num_voxels);
        clear(counts.data(), made.num_voxels * sizeof(std::uint32_t));
        clear(coarse_state_.data(), sizeof(pipeline_state));
        raster<Rule>(snap_.fraction, g_.extent, coarse_state_.data(), stage::fine_raster, [&](const auto& base) {
            counting_output out{base, index_.bricks(), made.masks.data(),
                                reinterpret_cast<const unsigned long long*>(made.offsets.data()), counts.data()};
            out.lead = g_.offset;
            return out;
        });
    }
    // Bricks at a crop's border may have voxels beyond it alone.
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
    core::snap_transform snap_;
    stage_clock* clock_;
    device_buffer<mask_call_state> totals_;
    device_buffer<pipeline_state> coarse_state_;
    brick_index<> index_;
    device_buffer<std::byte> memory_; // of the raster
    vertex_positions positions_{};
    deferred_triangles deferred_{};
    bool is_first_pass_ = true;
};

} // namespace voxelpipe::device
