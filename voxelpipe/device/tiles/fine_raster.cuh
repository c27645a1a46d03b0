// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fine raster: persistent blocks take work items (a tile and a run of its triangles), hold the tile in shared memory,
// shade and blend atomically, and store it, or leave an image of it if the tile is split (paper section 4, fine
// raster). Small triangles put their fragments in a queue, from which every thread shades one at a time; larger ones
// are divided into units of about equal cost, one per thread. So one triangle that fills the tile and a thousand in one
// voxel keep the block equally busy.

#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/tiles/tile_image.cuh>
#include <voxelpipe/device/tiles/tile_split.cuh>
#include <voxelpipe/tuning/tuning_fine_raster.hpp>
#include <voxelpipe/tuning/tuning_fragments.hpp>

namespace voxelpipe::device {

// The part of a triangle within a tile, divided into units: rows of columns in the plane of u and v. A small part is
// one unit, the whole tile box.
struct unit_list {
    static constexpr int whole = 3; // as axis: not divided
    std::uint32_t packed;           // bits: axis 2, u 5, v 5, columns - 1 5, rows - 1 5, rows per unit - 1 5

    [[nodiscard]] VOXELPIPE_HD int axis() const { return static_cast<int>(packed & 3); }
    [[nodiscard]] VOXELPIPE_HD int field(int i) const { return static_cast<int>(packed >> (2 + 5 * i) & 31); }

    // `box`: the triangle's reach within `tile`, not empty.
    [[nodiscard]] VOXELPIPE_HD static unit_list make(const loaded_triangle& t, int fraction,
                                                     const core::voxel_box& tile, const core::voxel_box& box,
                                                     int& num_units) {
        const std::int64_t x = box.hi[0] - box.lo[0] + 1, y = box.hi[1] - box.lo[1] + 1, z = box.hi[2] - box.lo[2] + 1;
        num_units = 1;
        if (core::max3(x * y, y * z, z * x) <= tuning::unit_columns) return {static_cast<std::uint32_t>(whole)};
        const int w = core::dominant_axis(t.a, t.b, t.c, fraction);
        const auto first = core::to_uvw(w, box.lo[0] - tile.lo[0], box.lo[1] - tile.lo[1], box.lo[2] - tile.lo[2]);
        const auto size = core::to_uvw(w, x, y, z);
        const auto columns = static_cast<std::uint32_t>(size[0]), rows = static_cast<std::uint32_t>(size[1]);
        const std::uint32_t rows_a_unit = tuning::unit_columns / columns < 1 ? 1 : tuning::unit_columns / columns;
        num_units = static_cast<int>((rows + rows_a_unit - 1) / rows_a_unit);
        return {static_cast<std::uint32_t>(w) | static_cast<std::uint32_t>(first[0]) << 2 |
                static_cast<std::uint32_t>(first[1]) << 7 | (columns - 1) << 12 | (rows - 1) << 17 |
                (rows_a_unit - 1) << 22};
    }

    // Unit i as a box of voxels.
    [[nodiscard]] VOXELPIPE_HD core::voxel_box unit(const core::voxel_box& tile, int i) const {
        if (axis() == whole) return tile;
        auto lo = core::to_uvw(axis(), tile.lo[0], tile.lo[1], tile.lo[2]);
        auto hi = core::to_uvw(axis(), tile.hi[0], tile.hi[1], tile.hi[2]);
        const int rows = field(3) + 1, rows_a_unit = field(4) + 1;
        lo[0] += field(0);
        hi[0] = lo[0] + field(2);
        const int begin = i * rows_a_unit, end = begin + rows_a_unit < rows ? begin + rows_a_unit : rows;
        const std::int64_t v = lo[1] + field(1);
        lo[1] = v + begin;
        hi[1] = v + end - 1;
        return {core::to_xyz(axis(), lo[0], lo[1], lo[2]), core::to_xyz(axis(), hi[0], hi[1], hi[2])};
    }
};

// Inclusive prefix sum over the block into `sums`, which all threads may read afterwards.
template <int Threads>
__device__ void block_prefix(int value, int* sums) {
    __shared__ int warp_sums[32];
    const int lane = static_cast<int>(threadIdx.x) % 32, warp = static_cast<int>(threadIdx.x) / 32;
    for (int step = 1; step < 32; step *= 2) {
        const int other = __shfl_up_sync(0xffffffffu, value, step);
        if (lane >= step) value += other;
    }
    if (lane == 31) warp_sums[warp] = value;
    __syncthreads();
    int before = 0;
    for (int w = 0; w < Threads / 32; ++w)
        if (w < warp) before += warp_sums[w];
    sums[threadIdx.x] = value + before;
    __syncthreads();
}

// ---- small triangles ------------------------------------------------------------------------------------------------

// A triangle's bounding box, and its part within a tile.
template <coverage Rule>
struct small_part {
    raster_input<stored_source> in;
    int32_triangle t;
    core::small_box box; // the part
    bool is_small;

    __device__ VOXELPIPE_INLINE small_part(const geometry& geo, const core::voxel_box& tile, std::uint32_t id)
        : in{{geo.draw(geo.find_draw(id))}, 0, geo.snap.fraction, geo.extent} {
        const draw_geometry& d = in.source.geometry;
        t = load_int32(in, d.triangles[id - d.first_primitive]);
        is_small =
            t.fits_int32 && geo.arms == core::arm_set::none && t.longest_side() <= core::small_voxels(in.fraction);
        box = t.part(geo.extent);
        int cells = 1;
        for (int k = 0; k < 3; ++k) {
            const int lo = static_cast<int>(tile.lo[k]) - t.lo[k], hi = static_cast<int>(tile.hi[k]) - t.lo[k];
            if (lo > box.lo[k]) box.lo[k] = lo;
            if (hi < box.hi[k]) box.hi[k] = hi;
            cells *= box.hi[k] - box.lo[k] + 1;
        }
        is_small = is_small && cells <= tuning::max_queue_cells;
    }

    // Calls row(x, y, z, bits) for the rows of fragments in the tile.
    template <class Row>
    __device__ VOXELPIPE_INLINE void rows(const core::voxel_box& tile, Row&& row) const {
        if constexpr (Rule == coverage::thin) {
            struct sink {
                const core::voxel_box& tile;
                Row& to;
                // The columns are the tile's, but a thin fragment's depth may lie outside.
                __device__ VOXELPIPE_INLINE void row(int x, int y, int z, word bits) {
                    if (x >= tile.lo[0] && x <= tile.hi[0] && y >= tile.lo[1] && y <= tile.hi[1] && z >= tile.lo[2] &&
                        z <= tile.hi[2])
                        to(x, y, z, bits);
                }
                [[nodiscard]] __device__ VOXELPIPE_INLINE static glm::ivec3 position(int x, int y, int z) {
                    return {x, y, z};
                }
                __device__ VOXELPIPE_INLINE void emit(const glm::ivec3& at, bool wanted) {
                    if (wanted) row(at.x, at.y, at.z, 1u);
                }
            } within{tile, row};
            struct kept_in_thread {
                word words[core::small_max_voxels];
                __device__ VOXELPIPE_INLINE void set(int i, word w) { words[i] = w; }
                [[nodiscard]] __device__ VOXELPIPE_INLINE word get(int i) const { return words[i]; }
            } kept;
            (void)raster_thin(in, t.relative(in.fraction), t.lo, box, 0, 1, kept,
                              within); // triangles of zero area are in no tile
        } else {
            if (box.empty()) return;
            const core::small_conservative s(t.relative(in.fraction), in.fraction);
            const auto emit = [&](int y, int z, word bits) VOXELPIPE_INLINE_LAMBDA {
                if (bits != 0) row(t.lo[0] + box.lo[0], t.lo[1] + y, t.lo[2] + z, bits);
            };
            if (box.hi[0] - box.lo[0] < 8)
                s.template rows<false>(box, emit);
            else
                s.long_rows(box, emit);
        }
    }
};

// ---- all triangles of a work item -----------------------------------------------------------------------------------

// Shared memory of a block, for a batch of as many triangles as it has threads.
template <int Threads>
struct batch_memory {
    int sums[Threads];
    std::uint32_t ids[Threads];
    unit_list lists[Threads];
    std::uint32_t
        fragments[tuning::queue_capacity]; // voxel of the tile, 15 bits, and the triangle's index in the batch
    std::uint8_t in_units[Threads];        // 1: the triangle's fragments come from its units
    int num_fragments;
};
static_assert(sizeof(batch_memory<256>) + 1024 <= tuning::batch_bytes);

// Calls visit(i, primitive, output) for every fragment of the item's triangles in the tile; i is the voxel's number in
// the tile. All threads of the block call it.
template <coverage Rule, int Log2Size, int Threads, class Scene, class Visit>
__device__ void for_each_fragment(const Scene& s, const core::voxel_box& tile, const std::uint32_t* primitives,
                                  std::uint32_t count, Visit&& visit) {
    __shared__ batch_memory<Threads> m;
    constexpr int size = 1 << Log2Size;
    const int fraction = s.geo.snap.fraction;
    const int x0 = static_cast<int>(tile.lo[0]), y0 = static_cast<int>(tile.lo[1]), z0 = static_cast<int>(tile.lo[2]);
    const auto voxel_of = [&](int x, int y, int z) { return ((z - z0) * size + (y - y0)) * size + (x - x0); };
    for (std::uint32_t first = 0; first < count; first += Threads) {
        const std::uint32_t mine = first + threadIdx.x;
        if (threadIdx.x == 0) m.num_fragments = 0;
        __syncthreads();
        int units = 0;
        if (mine < count) {
            const std::uint32_t id = primitives[mine];
            const small_part<Rule> part(s.geo, tile, id);
            bool whole = part.is_small; // all of its fragments are in the queue
            if (whole)
                part.rows(tile, [&](int x, int y, int z, word bits) VOXELPIPE_INLINE_LAMBDA {
                    const auto from = static_cast<std::uint32_t>(voxel_of(x, y, z)) | threadIdx.x << 15;
                    int at = atomicAdd(&m.num_fragments, __popc(bits));
                    for (; bits != 0 && at < tuning::queue_capacity; bits &= bits - 1)
                        m.fragments[at++] = from + static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
                    whole = whole && bits == 0;
                });
            m.ids[threadIdx.x] = id;
            m.in_units[threadIdx.x] = static_cast<std::uint8_t>(!whole);
            if (!whole) {
                const loaded_triangle t = s.geo.load(id);
                core::voxel_box reach{};
                (void)core::classify<Rule>(t.a, t.b, t.c, fraction, tile, reach);
                if (!reach.empty()) m.lists[threadIdx.x] = unit_list::make(t, fraction, tile, reach, units);
            }
        }
        block_prefix<Threads>(units, m.sums); // also makes all queued fragments visible
        const int waiting = m.num_fragments < tuning::queue_capacity ? m.num_fragments : tuning::queue_capacity;
        for (int f = static_cast<int>(threadIdx.x); f < waiting; f += Threads) {
            const std::uint32_t packed = m.fragments[f];
            if (m.in_units[packed >> 15] != 0) continue;
            const std::uint32_t triangle = m.ids[packed >> 15];
            const auto i = static_cast<int>(packed & 0x7fffu);
            visit(i, triangle,
                  shade_small_fragment<true>(s, triangle, x0 + i % size, y0 + i / size % size, z0 + i / (size * size)));
        }
        const int all = m.sums[Threads - 1];
        for (int u = static_cast<int>(threadIdx.x); u < all; u += Threads) {
            int lo = 0, hi = Threads - 1; // the first triangle whose sum is beyond u
            while (lo < hi) {
                const int middle = (lo + hi) / 2;
                if (m.sums[middle] > u)
                    hi = middle;
                else
                    lo = middle + 1;
            }
            const int unit = u - (lo == 0 ? 0 : m.sums[lo - 1]);
            const std::uint32_t triangle = m.ids[lo];
            const loaded_triangle t = s.geo.load(triangle);
            shade_fragments<Rule>(
                s, t, triangle, m.lists[lo].unit(tile, unit),
                [&](int x, int y, int z, const auto& out) { visit(voxel_of(x, y, z), triangle, out); });
        }
        __syncthreads();
    }
}

struct fine_raster_input {
    const std::uint32_t* primitives; // of the sorted pairs
    const work_item* items;
    word* images; // of split tiles
    core::tile_grid tiles;
    bool track;           // keep the touched bits
    bool count_fragments; // add to the fragment counters; one pass of a call does
    bool count_voxels;
};

template <coverage Rule, class Image, int Threads, int MinBlocks, class Scene, class Framebuffer>
__global__ __launch_bounds__(Threads, MinBlocks) void fine_raster_kernel(const __grid_constant__ Scene s,
                                                                         const __grid_constant__ Framebuffer fb,
                                                                         const __grid_constant__ fine_raster_input in,
                                                                         pipeline_state* state, capacities limits) {
    extern __shared__ __align__(16) word tile_words[];
    __shared__ unsigned int next;
    if (has_failed(*state, limits)) return;
    const unsigned num_items = state->num_items;
    std::uint64_t fragments = 0, discarded = 0, touched = 0;
    for (;;) {
        if (threadIdx.x == 0) next = atomicAdd(&state->next_item, 1u);
        __syncthreads();
        const unsigned index = next;
        if (index >= num_items) break;
        const work_item item = in.items[index];
        Image::clear(tile_words);
        __syncthreads();
        const core::voxel_box box = core::tile_box(in.tiles, item.tile, s.geo.extent);
        for_each_fragment<Rule, Image::log2_size, Threads>(s, box, in.primitives + item.first, item.count,
                                                           [&](int i, std::uint32_t id, const auto& out) {
                                                               if (!out.keep) {
                                                                   ++discarded;
                                                                   return;
                                                               }
                                                               ++fragments;
                                                               Image::blend(tile_words, i, id, out.values, in.track);
                                                           });
        __syncthreads();
        if (item.image == no_image) {
            touched += store_tile<Image>(s, fb, box, tile_words, in.track);
        } else {
            word* const image = in.images + std::size_t{item.image} * Image::words;
            for (int i = static_cast<int>(threadIdx.x); i < Image::words; i += Threads) image[i] = tile_words[i];
        }
        __syncthreads();
    }
    if (in.count_fragments) {
        const unsigned long long kept = block_sum(fragments), thrown = block_sum(discarded);
        if (threadIdx.x == 0 && kept != 0) atomicAdd(&state->fragments, kept);
        if (threadIdx.x == 0 && thrown != 0) atomicAdd(&state->discarded, thrown);
    }
    if (in.count_voxels) {
        const unsigned long long sum = block_sum(touched);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->voxels, sum);
    }
}

} // namespace voxelpipe::device
