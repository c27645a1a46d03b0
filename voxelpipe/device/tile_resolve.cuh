// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile resolve: merges the images of every split tile, before any rounding, and stores the tile. A tile's voxels are
// shared out over blocks, since its images may be many.

#include <voxelpipe/device/fine_raster.cuh>

namespace voxelpipe::device {

// Many images of one tile, merged as they are read, eight reads in flight.
template <class Image>
struct merged_source {
    const word* images;
    std::uint32_t count;

    template <class Blend>
    __device__ typename Blend::cell cell(int offset, int i) const {
        auto c = Blend::load(images + offset, i, Image::voxels);
#pragma unroll 8
        for (std::uint32_t k = 1; k < count; ++k) Blend::merge(c, Blend::load(image(k) + offset, i, Image::voxels));
        return c;
    }
    template <class BitBlend>
    __device__ word bits(int offset, int w) const {
        word c = images[offset + w];
#pragma unroll 8
        for (std::uint32_t k = 1; k < count; ++k) BitBlend::merge(c, image(k)[offset + w]);
        return c;
    }
    __device__ std::uint32_t winner(int i) const {
        std::uint32_t c = 0;
#pragma unroll 8
        for (std::uint32_t k = 0; k < count; ++k) {
            const std::uint32_t other = image(k)[Image::winner_at + i];
            c = other > c ? other : c;
        }
        return c;
    }
    __device__ word touched(int w) const {
        word c = 0;
#pragma unroll 8
        for (std::uint32_t k = 0; k < count; ++k) c |= image(k)[Image::touched_at + w];
        return c;
    }

private:
    __device__ const word* image(std::uint32_t k) const { return images + std::size_t{k} * Image::words; }
};

inline constexpr int resolve_parts = 8; // blocks that share a split tile

template <class Image, class Scene, class Framebuffer>
__global__ __launch_bounds__(threads_per_block) void tile_resolve_kernel(const __grid_constant__ Scene s,
                                                                         const __grid_constant__ Framebuffer fb,
                                                                         const __grid_constant__ fine_raster_input in,
                                                                         const split_tile* splits,
                                                                         pipeline_state* state, capacities limits) {
    if (has_failed(*state, limits)) return;
    const unsigned work = state->num_splits * resolve_parts;
    std::uint64_t touched = 0;
    for (unsigned i = blockIdx.x; i < work; i += gridDim.x) {
        const split_tile split = splits[i / resolve_parts];
        const core::voxel_box box = core::tile_box(in.tiles, split.tile, s.geo.extent);
        const merged_source<Image> source{in.images + std::size_t{split.first_image} * Image::words, split.num_images};
        touched += store_tile<Image>(s, fb, box, source, static_cast<int>(i % resolve_parts * blockDim.x + threadIdx.x),
                                     resolve_parts * static_cast<int>(blockDim.x), in.track);
    }
    if (in.count_voxels) {
        const unsigned long long sum = block_sum(touched);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->voxels, sum);
    }
}

// Makes the fine raster of another group of targets start again.
template <class State>
__global__ void restart_items(State* state) {
    state->next_item = 0;
}

// One fine pass over the work items for the targets of one image type. blocks_per_sm: see fine_raster_policy.
template <coverage Rule, class Image, int Threads, int MinBlocks, class Scene, class Framebuffer>
void draw_tiles(const Scene& s, const Framebuffer& fb, const fine_raster_input& in, const split_tile* splits,
                pipeline_state* state, const capacities& limits, int blocks_per_sm, cudaStream_t stream) {
    const auto kernel = fine_raster_kernel<Rule, Image, Threads, MinBlocks, Scene, Framebuffer>;
    if (Image::bytes > 32 * 1024) // static shared memory counts too
        check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(Image::bytes)),
              stage::fine_raster);
    int blocks = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, Threads, Image::bytes), stage::fine_raster);
    if (blocks_per_sm != 0 && blocks_per_sm < blocks) blocks = blocks_per_sm;
    restart_items<<<1, 1, 0, stream>>>(state);
    check(cudaGetLastError(), stage::fine_raster);
    kernel<<<static_cast<unsigned>((blocks < 1 ? 1 : blocks) * num_multiprocessors()), Threads, Image::bytes, stream>>>(
        s, fb, in, state, limits);
    check(cudaGetLastError(), stage::fine_raster);
    tile_resolve_kernel<Image, Scene, Framebuffer>
        <<<fill_device(std::uint64_t{1} << 40, 4), threads_per_block, 0, stream>>>(s, fb, in, splits, state, limits);
    check(cudaGetLastError(), stage::tile_resolve);
}

} // namespace voxelpipe::device
