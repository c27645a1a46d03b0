// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fine raster: persistent blocks take work items (a tile and a run of its triangles), hold the tile in shared memory,
// shade and blend atomically, and store it, or leave an image of it if the tile is split (paper section 4, fine
// raster). Triangles put their fragments in a queue, from which every thread shades one at a time, in rounds if it is
// full; what 32 bits do not serve is divided into units of about equal cost, one per thread. So one triangle that fills
// the tile and a thousand in one voxel keep the block equally busy.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/tiles/tile_image.cuh>
#include <voxelpipe/device/tiles/tile_part.cuh>
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

// ---- all triangles of a work item -----------------------------------------------------------------------------------

// Shared memory of a block, for a batch of as many triangles as it has threads, up to 256. ByRows: there is no queue.
template <int Threads, bool ByRows>
struct batch_memory {
    static constexpr int size = Threads < 256 ? Threads : 256, capacity = ByRows ? 1 : tuning::queue_capacity;
    int sums[Threads];
    std::uint32_t ids[size];
    tile_setup setups[ByRows ? 1 : size];
    unit_list lists[size];
    // Voxel of the tile, 15 bits, and the triangle's index in the batch; or no_fragment.
    std::uint32_t fragments[capacity];
    std::uint16_t by_lanes[size]; // triangles that group_lanes lanes draw
    int num_fragments, num_by_lanes;
};
static_assert(sizeof(batch_memory<256, false>) + 1024 <= tuning::batch_bytes);
inline constexpr std::uint32_t no_fragment = ~0u;

// Appends the rows of a triangle to a batch's queue. If one does not fit, it and all behind it are left for a further
// round, in which the same rows come again.
template <int Threads>
struct queue_writer {
    static constexpr bool splits_long_rows = false; // for raster_lanes
    batch_memory<Threads, false>& m;
    std::uint32_t first; // number of the tile's first voxel, modulo 2^32, and the triangle's index
    int log2_size;
    int queued = 0; // rows of all rounds
    int row_number = 0;
    bool is_full = false;

    __device__ VOXELPIPE_INLINE void begin_round(const core::voxel_box& tile, std::uint32_t index) {
        const std::int64_t before = ((tile.lo[2] << log2_size) + tile.lo[1]) * (1 << log2_size) + tile.lo[0];
        first = (index << 15) - static_cast<std::uint32_t>(before);
        row_number = 0;
        is_full = false;
    }
    __device__ VOXELPIPE_INLINE void row(int x, int y, int z, word bits) {
        if (bits == 0 || is_full || row_number++ < queued) return;
        int at = atomicAdd(&m.num_fragments, __popc(bits));
        if (at + __popc(bits) > m.capacity) {
            is_full = true;
            for (; at < m.capacity; ++at) m.fragments[at] = no_fragment;
            return;
        }
        const std::uint32_t from = first + static_cast<std::uint32_t>((((z << log2_size) + y) << log2_size) + x);
        for (; bits != 0; bits &= bits - 1)
            m.fragments[at++] = from + static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
        ++queued;
    }
};

// Passes each row on at once.
template <class VisitRow>
struct row_passer {
    static constexpr bool splits_long_rows = false;
    static constexpr bool is_full = false;
    const VisitRow& visit_row;
    int first, log2_size;
    std::uint32_t primitive;
    int queued = 0;

    __device__ VOXELPIPE_INLINE void begin_round(const core::voxel_box& tile, std::uint32_t primitive_) {
        first = static_cast<int>(((tile.lo[2] << log2_size) + tile.lo[1]) * (1 << log2_size) + tile.lo[0]);
        primitive = primitive_;
    }
    __device__ VOXELPIPE_INLINE void row(int x, int y, int z, word bits) {
        if (bits != 0) visit_row((((z << log2_size) + y) << log2_size) + x - first, primitive, bits);
    }
};

// Calls visit(i, primitive, output) for every fragment of the item's triangles in the tile; i is the voxel's number in
// the tile. Constant shaders: visit_row(i, primitive, bits) for most rows along x instead. All threads of the block
// call it.
template <coverage Rule, bool ByRows, int Log2Size, int Threads, class Scene, class Visit, class VisitRow>
__device__ void for_each_fragment(const Scene& s, const core::voxel_box& tile, const std::uint32_t* primitives,
                                  std::uint32_t count, Visit&& visit, const VisitRow& visit_row) {
    __shared__ batch_memory<Threads, ByRows> m;
    using part_type = tile_part<Rule, Log2Size>;
    constexpr int size = 1 << Log2Size, groups = Threads / tuning::group_lanes;
    constexpr unsigned batch = batch_memory<Threads, ByRows>::size;
    const int fraction = s.geo.snap.fraction;
    const int x0 = static_cast<int>(tile.lo[0]), y0 = static_cast<int>(tile.lo[1]), z0 = static_cast<int>(tile.lo[2]);
    const auto voxel_of = [&](int x, int y, int z) { return ((z - z0) * size + (y - y0)) * size + (x - x0); };
    for (std::uint32_t first = 0; first < count; first += batch) {
        const std::uint32_t mine = first + threadIdx.x;
        if (threadIdx.x == 0) m.num_fragments = m.num_by_lanes = 0;
        __syncthreads();
        const bool are_few = Rule == coverage::conservative && count - first <= groups;
        bool is_waiting = threadIdx.x < batch && mine < count; // for a round of the thread's triangle
        int units = 0;
        auto of_thread = [&] {
            if constexpr (ByRows)
                return row_passer<VisitRow>{visit_row, 0, Log2Size, 0};
            else
                return queue_writer<Threads>{m, 0, Log2Size};
        }();
        auto of_lane = of_thread;
        int group = static_cast<int>(threadIdx.x) / tuning::group_lanes; // the next triangle of the lanes, in by_lanes
        for (bool is_first = true;; is_first = false) {
            if (is_waiting) {
                const std::uint32_t id = primitives[mine];
                const part_type part(s.geo, tile, id);
                is_waiting = part.cover == part_cover::by_thread && !are_few;
                if constexpr (!ByRows)
                    if (is_first && part.cover != part_cover::by_units) part.set_up(tile, m.setups[threadIdx.x]);
                if (is_waiting) {
                    of_thread.begin_round(tile, ByRows ? id : threadIdx.x);
                    part.rows(tile, [&](int x, int y, int z, word bits)
                                        VOXELPIPE_INLINE_LAMBDA { of_thread.row(x, y, z, bits); });
                    is_waiting = of_thread.is_full;
                } else if (part.cover != part_cover::by_units) {
                    m.by_lanes[atomicAdd(&m.num_by_lanes, 1)] = static_cast<std::uint16_t>(threadIdx.x);
                } else {
                    const loaded_triangle t = s.geo.load(id);
                    core::voxel_box reach{};
                    (void)core::classify<Rule>(t.a, t.b, t.c, fraction, tile, reach);
                    if (!reach.empty()) m.lists[threadIdx.x] = unit_list::make(t, fraction, tile, reach, units);
                }
                m.ids[threadIdx.x] = id;
            }
            if (is_first)
                block_prefix<Threads>(units, m.sums);
            else
                __syncthreads();
            if constexpr (Rule == coverage::conservative) {
                const unsigned lanes = ((1u << tuning::group_lanes) - 1)
                                       << threadIdx.x % 32 / tuning::group_lanes * tuning::group_lanes;
                while (group < m.num_by_lanes) {
                    const std::uint32_t index = m.by_lanes[group];
                    const part_type part(s.geo, tile, m.ids[index]);
                    of_lane.begin_round(tile, ByRows ? m.ids[index] : index);
                    raster_lanes(part.coverage_of_box(), part.origin, part.box, of_lane);
                    if (__any_sync(lanes, of_lane.is_full)) break;
                    of_lane.queued = 0;
                    group += groups;
                }
                __syncthreads();
            }
            if constexpr (ByRows) break;
            const int waiting = m.num_fragments < m.capacity ? m.num_fragments : m.capacity;
            for (int f = static_cast<int>(threadIdx.x); f < waiting; f += Threads) {
                const std::uint32_t packed = m.fragments[f];
                if (packed == no_fragment) continue;
                const std::uint32_t triangle = m.ids[packed >> 15];
                const auto i = static_cast<int>(packed & 0x7fffu);
                const int x = i % size, y = i / size % size, z = i / (size * size);
                visit(i, triangle, shade_in_tile(s, m.setups[packed >> 15], triangle, x, y, z, x0 + x, y0 + y, z0 + z));
            }
            if (__syncthreads_or(static_cast<int>(is_waiting || group < m.num_by_lanes)) == 0) break;
            if (threadIdx.x == 0) m.num_fragments = 0;
            __syncthreads();
        }
        const int all = m.sums[Threads - 1];
        for (int u = static_cast<int>(threadIdx.x); u < all; u += Threads) {
            // The first one whose sum is beyond u.
            const unsigned at = core::bisect(Threads - 1u, [&](unsigned i) { return m.sums[i] <= u; });
            const int unit = u - (at == 0 ? 0 : m.sums[at - 1]);
            const std::uint32_t triangle = m.ids[at];
            const loaded_triangle t = s.geo.load(triangle);
            shade_fragments<Rule>(
                s, t, triangle, m.lists[at].unit(tile, unit),
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
    constexpr bool by_rows = core::is_constant<decltype(Scene::shading::fragment_shader)> && Image::has_only_bits;
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
        for_each_fragment<Rule, by_rows, Image::log2_size, Threads>(
            s, box, in.primitives + item.first, item.count,
            [&](int i, std::uint32_t id, const auto& out) {
                if (!out.keep) {
                    ++discarded;
                    return;
                }
                ++fragments;
                Image::blend(tile_words, i, id, out.values, in.track);
            },
            [&](int i, std::uint32_t id, word bits) {
                fragments += static_cast<unsigned>(__popc(bits));
                const auto out = s.draw(s.geo.find_draw(id)).fragment_shader(fragment<typename Scene::varyings>{});
                Image::blend_row(tile_words, i, bits, out.values, in.track);
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
