// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a whole field in a tree of boxes: runs of 32 in the order of their places, 32 children a node, a
// lane a child. Boxes are rounded outwards: they only reject. A warp visits it for the 4^3 samples of an octant: down
// to one near run for a first bound, then every run that may be nearer to the centre, then every run that may hold the
// nearest triangle of a sample.

#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/distance/device/band_search.cuh>

#include <cstdint>

namespace voxelpipe::device {

struct tree_box {
    float low[3], high[3]; // units from the first sample's voxel; of no triangle: infinity and -infinity
};

inline constexpr int max_tree_levels = 7; // 32^7 > 2^32

struct distance_tree {
    const std::uint32_t* order;       // primitives, in runs of 32
    tree_box* boxes[max_tree_levels]; // of runs, of 32 runs each, and so on
    std::uint32_t counts[max_tree_levels];
    int num_levels; // the last one has at most 32 boxes
    std::uint32_t num_primitives;
};

struct tree_memory {
    std::uint32_t *keys[2], *values[2];
    void* storage;
    std::size_t storage_bytes;
    distance_tree tree;
    static constexpr int bits = 31; // 30 of a place, and one that puts dropped triangles last

    [[nodiscard]] static tree_memory take(arena& a, std::uint32_t num_primitives) {
        tree_memory m{};
        for (int i = 0; i < 2; ++i) {
            m.keys[i] = a.take<std::uint32_t>(num_primitives);
            m.values[i] = a.take<std::uint32_t>(num_primitives);
        }
        m.storage_bytes = sort_bytes<std::uint32_t>(num_primitives, bits);
        m.storage = a.take<std::byte>(m.storage_bytes);
        m.tree.num_primitives = num_primitives;
        std::uint32_t count = num_primitives;
        do {
            count = count / 32 + static_cast<std::uint32_t>(count % 32 != 0);
            m.tree.counts[m.tree.num_levels] = count;
            m.tree.boxes[m.tree.num_levels] = a.take<tree_box>(count);
            ++m.tree.num_levels;
        } while (count > 32);
        return m;
    }
};

// Lowest and highest coordinate of a triangle, in units, rounded outwards; and of what is dropped nothing.
[[nodiscard]] __device__ inline tree_box box_of(const distance_input& in, std::uint32_t primitive) {
    tree_box b{};
    const std::uint32_t is_wide = in.frames[primitive].is_wide;
    if (is_wide == 2) {
        for (int k = 0; k < 3; ++k) {
            b.low[k] = octant_search::infinity;
            b.high[k] = -octant_search::infinity;
        }
        return b;
    }
    std::int64_t v[3][3];
    if (is_wide == 0) {
        const kept_triangle& t = in.triangles[primitive];
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) v[i][k] = t.vertex[i][k];
    } else {
        const loaded_triangle t = in.geo.load(primitive);
        const core::snapped_position* const p[3] = {&t.a, &t.b, &t.c};
        for (int i = 0; i < 3; ++i) {
            v[i][0] = p[i]->x;
            v[i][1] = p[i]->y;
            v[i][2] = p[i]->z;
        }
    }
    for (int k = 0; k < 3; ++k) {
        const auto low = static_cast<float>(static_cast<double>(core::min3(v[0][k], v[1][k], v[2][k])) *
                                            in.units.exact[k]),
                   high = static_cast<float>(static_cast<double>(core::max3(v[0][k], v[1][k], v[2][k])) *
                                             in.units.exact[k]);
        b.low[k] = low - 0x1p-22f * magnitude(low);
        b.high[k] = high + 0x1p-22f * magnitude(high);
    }
    return b;
}

template <int = 0>
__global__ __launch_bounds__(threads_per_block) void make_tree_keys(const __grid_constant__ distance_input in,
                                                                    std::uint32_t* keys, std::uint32_t* values) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= in.geo.num_primitives) return;
    const auto id = static_cast<std::uint32_t>(i);
    std::uint32_t key = 1u << 30;
    if (in.frames[id].is_wide != 2) {
        const tree_box b = box_of(in, id);
        key = 0;
        for (int k = 0; k < 3; ++k) {
            // Places up to an extent outside of the grid are told apart.
            const float size = static_cast<float>(in.extent[k]) * in.units.voxel[k];
            float place = ((0.5f * b.low[k] + 0.5f * b.high[k]) / size + 1.0f) * (1023.0f / 3.0f);
            place = place > 0.0f ? place < 1023.0f ? place : 1023.0f : 0.0f;
            auto v = static_cast<std::uint32_t>(place);
            v = (v | v << 16) & 0x030000ffu;
            v = (v | v << 8) & 0x0300f00fu;
            v = (v | v << 4) & 0x030c30c3u;
            v = (v | v << 2) & 0x09249249u;
            key |= v << k;
        }
    }
    keys[id] = key;
    values[id] = id;
}

// A warp a box: of 32 triangles on level 0, of 32 boxes above.
template <int = 0>
__global__ __launch_bounds__(threads_per_block) void make_tree_boxes(const __grid_constant__ distance_input in,
                                                                     const __grid_constant__ distance_tree t,
                                                                     int level) {
    const std::uint64_t warps = std::uint64_t{gridDim.x} * blockDim.x / 32;
    const unsigned lane = threadIdx.x % 32;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x / 32 + warp_in_block(); i < t.counts[level];
         i += warps) {
        const std::uint64_t child = i * 32 + lane;
        tree_box b{};
        for (int k = 0; k < 3; ++k) {
            b.low[k] = octant_search::infinity;
            b.high[k] = -octant_search::infinity;
        }
        if (child < (level == 0 ? t.num_primitives : t.counts[level - 1]))
            b = level == 0 ? box_of(in, t.order[child]) : t.boxes[level - 1][child];
        for (int k = 0; k < 3; ++k)
            for (int step = 16; step > 0; step /= 2) {
                const float low = __shfl_xor_sync(0xffffffffu, b.low[k], step),
                            high = __shfl_xor_sync(0xffffffffu, b.high[k], step);
                b.low[k] = low < b.low[k] ? low : b.low[k];
                b.high[k] = high > b.high[k] ? high : b.high[k];
            }
        if (lane == 0) t.boxes[level][i] = b;
        __syncwarp();
    }
}

// Returns the tree; its triangles are kept and in frames.
template <int = 0>
[[nodiscard]] distance_tree make_tree(const distance_input& in, const tree_memory& m, cudaStream_t stream) {
    constexpr stage where = stage::tile_sort;
    make_tree_keys<0><<<num_blocks(in.geo.num_primitives), threads_per_block, 0, stream>>>(in, m.keys[0], m.values[0]);
    check(cudaGetLastError(), where);
    const int at = sort_by_cell<std::uint32_t>(m.keys, m.values, in.geo.num_primitives, tree_memory::bits, m.storage,
                                               m.storage_bytes, where, stream);
    distance_tree t = m.tree;
    t.order = m.values[at];
    for (int level = 0; level < t.num_levels; ++level) {
        make_tree_boxes<0>
            <<<fill_device(std::uint64_t{t.counts[level]} * 32), threads_per_block, 0, stream>>>(in, t, level);
        check(cudaGetLastError(), where);
    }
    return t;
}

// Nodes that a warp has still to visit. Each of at most 7 levels leaves 31 at most.
struct tree_stack {
    static constexpr unsigned room = 32 * max_tree_levels;
    std::uint32_t node[room]; // level in the highest 4 bits; 0: a run
    float distance[room];
};

// A point of the tree: a place in units, and what its distances from boxes may be off by.
struct tree_point {
    float c[3], slack;

    [[nodiscard]] __device__ VOXELPIPE_INLINE float distance_from(const tree_box& b) const {
        float square = 0.0f;
        for (int k = 0; k < 3; ++k) {
            const float below = b.low[k] - c[k], above = c[k] - b.high[k];
            float d = below > above ? below : above;
            d = d > 0.0f ? d : 0.0f;
            square += d * d;
        }
        return sqrtf(square) * (1.0f - 0x1p-20f) - slack;
    }
};

// Rounding of the point is 2^-23 of a coordinate with its scale, and of a difference 2^-24.
[[nodiscard]] __device__ inline tree_point make_tree_point(const distance_input& in, const std::int64_t (&at)[3]) {
    tree_point p{};
    for (int k = 0; k < 3; ++k) {
        p.c[k] = static_cast<float>(static_cast<double>(at[k]) * in.units.exact[k]);
        p.slack += 0x1p-20f * magnitude(p.c[k]);
    }
    return p;
}

// The same place as the centre of an octant that has a reference: boxes none of whose triangles can win are infinitely
// far.
struct tree_octant {
    const tree_point& p;
    const octant_search& search;

    [[nodiscard]] __device__ VOXELPIPE_INLINE float distance_from(const tree_box& b) const {
        float from[3], square = 0.0f;
        for (int k = 0; k < 3; ++k) {
            const float below = p.c[k] - b.low[k], above = p.c[k] - b.high[k];
            from[k] = below < 0.0f ? below : above > 0.0f ? above : 0.0f;
            square += from[k] * from[k];
        }
        const float root = sqrtf(square), distance = root * (1.0f - 0x1p-20f) - p.slack;
        if (!(distance > 0.0f)) return distance;
        // The plane through the box's closest point has the box below it.
        float rise[3];
        for (int k = 0; k < 3; ++k) rise[k] = from[k] / root * search.in.units.voxel[k];
        const float height = distance - 0x1p-20f * search.in.octant_radius;
        return search.is_below_corner(height, rise) ? distance : octant_search::infinity;
    }
};

// Calls run(number) for the run of triangles at the end of the way down along the nearest boxes.
template <class Run>
__device__ VOXELPIPE_INLINE void visit_one_run(const distance_tree& t, const tree_point& p, const Run& run) {
    const unsigned lane = threadIdx.x % 32;
    std::uint32_t node = 0;
    for (int level = t.num_levels; level > 0; --level) {
        const std::uint64_t child = std::uint64_t{node} * 32 + lane;
        const float own =
            child < t.counts[level - 1] ? p.distance_from(t.boxes[level - 1][child]) : octant_search::infinity;
        float least = own;
        for (int step = 16; step > 0; step /= 2) {
            const float other = __shfl_xor_sync(0xffffffffu, least, step);
            least = other < least ? other : least;
        }
        const unsigned which = __ballot_sync(0xffffffffu, own == least);
        node = node * 32 + static_cast<std::uint32_t>(__ffs(static_cast<int>(which)) - 1);
        if (node >= t.counts[level - 1]) return; // nothing is drawn
    }
    run(node);
}

// Calls run(number) for the runs whose boxes have a distance, p.distance_from(box), of at most bound(), which may fall
// meanwhile. All lanes call it.
template <class Point, class Bound, class Run>
__device__ VOXELPIPE_INLINE void visit_runs(const distance_tree& t, const Point& p, tree_stack& stack,
                                            const Bound& bound, const Run& run) {
    const unsigned lane = threadIdx.x % 32;
    unsigned size = 1;
    __syncwarp();
    if (lane == 0) {
        stack.node[0] = static_cast<std::uint32_t>(t.num_levels) << 28;
        stack.distance[0] = -octant_search::infinity;
    }
    __syncwarp();
    while (size != 0) {
        --size;
        const std::uint32_t entry = stack.node[size];
        const float distance = stack.distance[size];
        __syncwarp();
        if (distance > bound()) continue;
        const std::uint32_t level = entry >> 28, node = entry & 0x0fffffffu;
        if (level == 0) {
            run(node);
            continue;
        }
        const std::uint64_t child = std::uint64_t{node} * 32 + lane;
        const bool exists = child < t.counts[level - 1];
        const float own = exists ? p.distance_from(t.boxes[level - 1][child]) : octant_search::infinity;
        const bool is_near = exists && own <= bound();
        const unsigned all = __ballot_sync(0xffffffffu, is_near);
        if (is_near) {
            const unsigned to = size + static_cast<unsigned>(__popc(all & ((1u << lane) - 1)));
            stack.node[to] = (level - 1) << 28 | static_cast<std::uint32_t>(child);
            stack.distance[to] = own;
        }
        size += static_cast<unsigned>(__popc(all));
        __syncwarp();
    }
}

// The nearest triangles of all samples. A block takes a brick, a warp an octant.
template <int = 0>
__global__ __launch_bounds__(threads_per_block, 2) void search_tree(const __grid_constant__ distance_input in,
                                                                    const __grid_constant__ distance_tree t,
                                                                    const __grid_constant__ found_samples to,
                                                                    pipeline_state* state, capacities limits) {
    __shared__ octant_memory memory[warps_of_search];
    __shared__ tree_stack stacks[warps_of_search];
    __shared__ unsigned next;
    if (has_failed(*state, limits)) return;
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    for (;;) {
        __syncthreads();
        if (threadIdx.x == 0) next = atomicAdd(&state->next_item, 1u);
        __syncthreads();
        const unsigned brick = uniform(next);
        if (brick >= in.num_bricks()) return;
        octant_search search(in, memory[warp], first_of_octant(in.first_sample(brick), warp));
        const tree_point p = make_tree_point(in, {search.centre[0], search.centre[1], search.centre[2]});
        near_triangle nearest = near_triangle::none();
        const auto look_at = [&](std::uint32_t run) {
            const std::uint64_t i = std::uint64_t{run} * 32 + lane;
            near_triangle own = near_triangle::none();
            if (i < t.num_primitives && in.frames[t.order[i]].is_wide != 2)
                own = {search.look(t.order[i]).high, t.order[i]};
            nearest.take(own.of_warp());
        };
        visit_one_run(t, p, look_at);
        visit_runs(
            t, p, stacks[warp], [&] { return nearest.distance; }, look_at);
        search.begin(nearest);
        const float far = search.limit + in.octant_radius;
        visit_runs(
            t, tree_octant{p, search}, stacks[warp], [&] { return far; },
            [&](std::uint32_t run) {
                const std::uint64_t i = std::uint64_t{run} * 32 + lane;
                const std::uint32_t id = i < t.num_primitives ? t.order[i] : 0;
                search.visit(i < t.num_primitives && in.frames[id].is_wide != 2, id);
            });
        search.decide();
        to.write(search, brick);
    }
}
template <int = 0>
void search_whole(const distance_input& in, const distance_tree& t, const found_samples& to, pipeline_state* state,
                  const capacities& limits, cudaStream_t stream) {
    search_tree<0>
        <<<fill_device(std::uint64_t{in.num_bricks()} * threads_per_block, 4), threads_per_block, 0, stream>>>(
            in, t, to, state, limits);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
