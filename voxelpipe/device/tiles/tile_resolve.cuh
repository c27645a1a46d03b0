// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile resolve: merges the images of every split tile, before any rounding, and stores the tile. A warp takes 32 voxels
// of a tile with few images, and waits for no other. Of a tile with more a block takes 32 voxels; its warps share the
// images, so a tile of a thousand images costs a thread only a few reads.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/tiles/fine_raster.cuh>
#include <voxelpipe/device/tiles/tile_split.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

namespace voxelpipe::device {

// The images of one split tile, restricted to 32 voxels: one word of the touched bits.
template <class Image>
struct image_column {
    const word* images;
    std::uint32_t count;
    int group; // voxels 32 * group and on

    [[nodiscard]] __device__ const word* image(std::uint32_t k) const { return images + std::size_t{k} * Image::words; }

    // Merges the lane's voxel over the images first, first + step, ... that touched it; returns false if none did.
    template <class Blend>
    __device__ bool cell(int offset, unsigned first, unsigned step, typename Blend::cell& merged) const {
        const int i = 32 * group + static_cast<int>(threadIdx.x % 32);
        bool found = false;
#pragma unroll 4
        for (std::uint32_t k = first; k < count; k += step) {
            if ((image(k)[Image::touched_at + group] >> (threadIdx.x % 32) & 1u) == 0) continue;
            const auto other = Blend::load(image(k) + offset, i, Image::voxels);
            if (found)
                Blend::merge(merged, other);
            else
                merged = other;
            found = true;
        }
        return found;
    }
};

inline constexpr int resolve_warps = threads_per_block / 32;

// Combines one word of every thread of the block; all threads get the result.
template <class Combine>
__device__ word combine_block(word v, const Combine& combine) {
    __shared__ word partial[resolve_warps];
    for (unsigned step = 16; step > 0; step /= 2) combine(v, __shfl_xor_sync(0xffffffffu, v, step));
    __syncthreads(); // the previous use of `partial` is over
    if (threadIdx.x % 32 == 0) partial[threadIdx.x / 32] = v;
    __syncthreads();
    v = partial[0];
    for (int w = 1; w < resolve_warps; ++w) combine(v, partial[w]);
    return v;
}

// Merges the 32 voxels over all images, and calls `store` in warp 0 with the merged cell of each touched voxel. All
// threads of the block call it.
template <class Blend, class Image, class Store>
__device__ void merge_cells(const image_column<Image>& column, int offset, unsigned char* memory, Store&& store) {
    using cell = typename Blend::cell;
    constexpr int fit = tuning::resolve_bytes / static_cast<int>(32 * sizeof(cell));
    static_assert(fit >= 1);
    constexpr unsigned ways = fit < resolve_warps ? fit : resolve_warps; // warps that read
    __shared__ unsigned founds[resolve_warps];
    cell* const cells = reinterpret_cast<cell*>(memory);
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    __syncthreads(); // the previous use of the memory is over
    cell merged{};
    if (warp < ways) {
        const bool found = column.template cell<Blend>(offset, warp, ways, merged);
        const unsigned all = __ballot_sync(0xffffffffu, found);
        if (found) cells[warp * 32 + lane] = merged;
        if (lane == 0) founds[warp] = all;
    }
    __syncthreads();
    if (warp != 0) return;
    bool found = (founds[0] >> lane & 1u) != 0;
    for (unsigned w = 1; w < ways; ++w) {
        if ((founds[w] >> lane & 1u) == 0) continue;
        if (found)
            Blend::merge(merged, cells[w * 32 + lane]);
        else
            merged = cells[w * 32 + lane];
        found = true;
    }
    if (found) store(merged);
}

// Merges winners: the highest primitive + 1 of a voxel among a tile's images.
struct winner_merge {
    using cell = word;
    __device__ static cell load(const word* plane, int i, int) { return plane[i]; }
    __device__ static void merge(cell& a, cell b) { a = b > a ? b : a; }
};

// A group of 32 voxels of a split tile of at most 32 images, by one warp, which waits for nobody. Returns the number of
// voxels that were touched, in every lane.
template <class Image, class Scene, class Framebuffer>
__device__ unsigned resolve_narrow(const Scene& s, const Framebuffer& fb, const fine_raster_input& in,
                                   const split_tile& split, int group) {
    const unsigned lane = threadIdx.x % 32;
    const core::voxel_box box = core::tile_box(in.tiles, split.tile, s.geo.extent);
    const image_column<Image> column{in.images + std::size_t{split.first_image} * Image::words, split.num_images,
                                     group};
    unsigned touched = 0;
    if (in.track) {
        const word mine = lane < split.num_images ? column.image(lane)[Image::touched_at + group] : 0;
        const word all = __reduce_or_sync(0xffffffffu, mine);
        if (all == 0) return 0;
        touched = static_cast<unsigned>(__popc(all));
    }
    if constexpr (Image::has_bits) {
        Image::for_each_target([&]<std::size_t K>() {
            using t = typename Image::template target<K>;
            if constexpr (method_of<t>() == blend_method::bits) {
                using blend_type = bit_blend<typename t::blend_type>;
                word mine = blend_type::neutral;
                if (lane < split.num_images) mine = column.image(lane)[Image::template offset<K>() + group];
                for (unsigned step = 16; step > 0; step /= 2)
                    blend_type::merge(mine, __shfl_xor_sync(0xffffffffu, mine, step));
                if (static_cast<int>(lane) < rows_per_word<Image>)
                    store_bit_row<Image, K>(fb, box, group * rows_per_word<Image> + static_cast<int>(lane), mine);
            }
        });
    }
    const voxel_position at = voxel_in_tile<Image>(box, 32 * group + static_cast<int>(lane));
    if constexpr (Image::has_atomic) {
        Image::for_each_target([&]<std::size_t K>() {
            using t = typename Image::template target<K>;
            if constexpr (method_of<t>() == blend_method::atomic) {
                using blend_type = value_blend<typename t::blend_type, typename t::value_type>;
                typename blend_type::cell merged{};
                if (column.template cell<blend_type>(Image::template offset<K>(), 0, 1, merged))
                    store_cell(voxelpipe::get<K>(fb.targets), at, merged);
            }
        });
    }
    if constexpr (Image::has_winner) {
        word winner = 0;
        if (column.template cell<winner_merge>(Image::winner_at, 0, 1, winner)) store_winners<Image>(s, fb, at, winner);
    }
    return touched;
}

template <class Image, class Scene, class Framebuffer>
__global__ __launch_bounds__(threads_per_block) void tile_resolve_kernel(const __grid_constant__ Scene s,
                                                                         const __grid_constant__ Framebuffer fb,
                                                                         const __grid_constant__ fine_raster_input in,
                                                                         const split_tile* splits,
                                                                         pipeline_state* state, capacities limits) {
    if (has_failed(*state, limits)) return;
    constexpr unsigned groups = Image::voxels / 32;
    __shared__ __align__(16) unsigned char memory[tuning::resolve_bytes];
    const unsigned lane = threadIdx.x % 32;
    const std::uint64_t work = std::uint64_t{state->num_splits} * groups;
    std::uint64_t touched = 0; // in the first thread of a warp
    for (std::uint64_t job = std::uint64_t{blockIdx.x} * resolve_warps + warp_in_block(); job < work;
         job += std::uint64_t{gridDim.x} * resolve_warps) {
        const split_tile split = splits[job / groups];
        if (split.num_images > max_narrow_split) continue;
        const unsigned n = resolve_narrow<Image>(s, fb, in, split, static_cast<int>(job % groups));
        if (lane == 0) touched += n;
    }
    const std::uint64_t wide_work = state->has_wide_splits != 0 ? work : 0;
    for (std::uint64_t job = blockIdx.x; job < wide_work; job += gridDim.x) {
        const split_tile split = splits[job / groups];
        if (split.num_images <= max_narrow_split) continue;
        const auto group = static_cast<int>(job % groups);
        const core::voxel_box box = core::tile_box(in.tiles, split.tile, s.geo.extent);
        const image_column<Image> column{in.images + std::size_t{split.first_image} * Image::words, split.num_images,
                                         group};
        if (in.track) {
            word mine = 0;
            for (std::uint32_t k = threadIdx.x; k < split.num_images; k += blockDim.x)
                mine |= column.image(k)[Image::touched_at + group];
            mine = combine_block(mine, [](word& a, word b) { a |= b; });
            if (mine == 0) continue;
            if (threadIdx.x == 0) touched += static_cast<unsigned>(__popc(mine));
        }
        if constexpr (Image::has_bits) {
            Image::for_each_target([&]<std::size_t K>() {
                using t = typename Image::template target<K>;
                if constexpr (method_of<t>() == blend_method::bits) {
                    using blend_type = bit_blend<typename t::blend_type>;
                    word mine = blend_type::neutral;
                    for (std::uint32_t k = threadIdx.x; k < split.num_images; k += blockDim.x)
                        blend_type::merge(mine, column.image(k)[Image::template offset<K>() + group]);
                    mine = combine_block(mine, [](word& a, word b) { blend_type::merge(a, b); });
                    if (static_cast<int>(threadIdx.x) < rows_per_word<Image>)
                        store_bit_row<Image, K>(fb, box, group * rows_per_word<Image> + static_cast<int>(threadIdx.x),
                                                mine);
                }
            });
        }
        const int i = 32 * group + static_cast<int>(lane);
        const voxel_position at = voxel_in_tile<Image>(box, i);
        if constexpr (Image::has_atomic) {
            Image::for_each_target([&]<std::size_t K>() {
                using t = typename Image::template target<K>;
                if constexpr (method_of<t>() == blend_method::atomic) {
                    using blend_type = value_blend<typename t::blend_type, typename t::value_type>;
                    merge_cells<blend_type>(column, Image::template offset<K>(), memory, [&](const auto& cell) {
                        store_cell(voxelpipe::get<K>(fb.targets), at, cell);
                    });
                }
            });
        }
        if constexpr (Image::has_winner)
            merge_cells<winner_merge>(column, Image::winner_at, memory,
                                      [&](word winner) { store_winners<Image>(s, fb, at, winner); });
    }
    if (in.count_voxels) {
        const unsigned long long sum = block_sum(touched);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->voxels, sum);
    }
}

// One fine pass over the work items for the targets of one image type. blocks_per_sm: see fine_raster_policy.
template <coverage Rule, class Image, int Threads, int MinBlocks, class Scene, class Framebuffer>
void draw_tiles(const Scene& s, const Framebuffer& fb, const fine_raster_input& in, const split_tile* splits,
                pipeline_state* state, const capacities& limits, int blocks_per_sm, cudaStream_t stream,
                stage_clock* clock = nullptr) {
    const auto kernel = fine_raster_kernel<Rule, Image, Threads, MinBlocks, Scene, Framebuffer>;
    if (Image::bytes > 8 * 1024) // 48 KB need no attribute, but static shared memory counts too
        check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(Image::bytes)),
              stage::fine_raster);
    int blocks = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, Threads, Image::bytes), stage::fine_raster);
    if (blocks_per_sm != 0 && blocks_per_sm < blocks) blocks = blocks_per_sm;
    restart_items(state, stream);
    kernel<<<static_cast<unsigned>((blocks < 1 ? 1 : blocks) * num_multiprocessors()), Threads, Image::bytes, stream>>>(
        s, fb, in, state, limits);
    check(cudaGetLastError(), stage::fine_raster);
    end_stage(clock, &stage_times::fine_raster);
    tile_resolve_kernel<Image, Scene, Framebuffer>
        <<<fill_device(std::uint64_t{1} << 40, 4), threads_per_block, 0, stream>>>(s, fb, in, splits, state, limits);
    check(cudaGetLastError(), stage::tile_resolve);
    end_stage(clock, &stage_times::tile_resolve);
}

} // namespace voxelpipe::device
