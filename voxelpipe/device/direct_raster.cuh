// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Direct raster: fragments go straight from their triangle into the render targets, without tiles, where the shader is
// constant and every target takes a fragment by one atomic (direct_target.cuh). Coarse raster, sort and tile images
// cost a small triangle more than the few voxels that it touches.
//
// One kernel reads the mesh once and sorts triangles by what they cost: those of up to 2 x 2 x 1 voxels are written at
// once; small ones wait in shared memory until there is a full block of them, the smallest a thread each, larger ones
// eight lanes each; what 32-bit coverage cannot hold goes to a list in global memory, which a second kernel shares out.

#include <voxelpipe/core/brick_triangle.hpp>
#include <voxelpipe/device/direct_target.cuh>
#include <voxelpipe/device/scene.cuh>
#include <voxelpipe/device/tile_image.cuh>
#include <voxelpipe/device/wide_path.cuh>
#include <voxelpipe/device/work_share.cuh>

namespace voxelpipe::device {

// ---- triangles ------------------------------------------------------------------------------------------------------

// Snapped vertices of one draw: made by its vertex shader on the spot, where that is cheap and makes no varyings.
template <class Mesh, class VertexShader>
struct shading_source {
    Mesh mesh;
    VertexShader shader;
    core::snap_transform snap;
    std::uint32_t draw;

    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::vec3 shade(std::uint32_t vertex) const {
        const auto result = shader(core::fetch_vertex(mesh, vertex, draw));
        return core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool near_position(std::uint32_t vertex, std::int32_t (&q)[3]) const {
        const glm::vec3 p = shade(vertex);
        return core::snap_near(snap, p.x, p.y, p.z, q);
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        const glm::vec3 p = shade(vertex);
        return core::snap(snap, p.x, p.y, p.z);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const { return mesh.triangles[i]; }
};

// The same from the positions that vertex_shade left.
struct stored_source {
    draw_geometry geometry;

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool near_position(std::uint32_t vertex, std::int32_t (&q)[3]) const {
        const core::snapped_position p = geometry.positions[vertex];
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        q[0] = static_cast<std::int32_t>(p.x);
        q[1] = static_cast<std::int32_t>(p.y);
        q[2] = static_cast<std::int32_t>(p.z);
        return p.x <= limit && p.x >= -limit && p.y <= limit && p.y >= -limit && p.z <= limit && p.z >= -limit;
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        return geometry.positions[vertex];
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const {
        return geometry.triangles[i];
    }
};

// Triangles that the small path cannot take, in order of arrival, each with the number of its first record of 32
// chunks: a warp finds the triangle of a record by bisection. `next` packs how many triangles and records there are, so
// that one atomic places both.
struct large_list {
    static constexpr int record_bits = 36;
    std::uint32_t* triangles;
    unsigned long long* first_records;
    unsigned long long* next;

    [[nodiscard]] static constexpr bool holds(std::uint64_t triangles, std::uint64_t records_each) {
        return triangles < (std::uint64_t{1} << (64 - record_bits)) &&
               triangles * records_each < (std::uint64_t{1} << record_bits);
    }
    __device__ void push(std::uint32_t triangle, unsigned long long records) const {
        const unsigned long long at = atomicAdd(next, (1ull << record_bits) + records);
        triangles[at >> record_bits] = triangle;
        first_records[at >> record_bits] = at & ((1ull << record_bits) - 1);
    }
};

template <coverage Rule, class Source, class Framebuffer, class Values>
struct direct_call {
    static constexpr coverage rule = Rule;
    Source source;
    std::uint32_t num_triangles;
    int fraction;
    glm::ivec3 extent;
    Framebuffer fb;
    Values values;
    int counting_target; // which target tells first touches, for the voxel counter; -1: none is wanted
    large_list large;
};

// Fragments and first touches of one thread.
struct direct_counts {
    unsigned fragments = 0, voxels = 0; // a thread cannot write 2^32 before the largest list ends
};

// Fragments in the voxels x0 + i of a row, for the bits i of the mask, into every target.
template <class Call>
__device__ VOXELPIPE_INLINE void blend_into_all(const Call& call, int x0, int y, int z, word mask,
                                                direct_counts& counts) {
    if (mask == 0) return;
    counts.fragments += static_cast<unsigned>(__popc(mask));
    core::for_each_index<targets_of<decltype(call.fb)>::count>([&]<std::size_t K>() {
        const auto& t = voxelpipe::get<K>(call.fb.targets);
        if (t.load == load_operation::off) return;
        counts.voxels +=
            blend_row(t, x0, y, z, mask, voxelpipe::get<K>(call.values), call.counting_target == static_cast<int>(K));
    });
}

template <class Call>
__device__ VOXELPIPE_INLINE void blend_four_into_all(const Call& call, int x, int y, int z, const word (&mask)[4],
                                                     bool along_y, direct_counts& counts) {
    counts.fragments += static_cast<unsigned>(__popc(mask[0] | mask[1] << 2 | mask[2] << 4 | mask[3] << 6));
    core::for_each_index<targets_of<decltype(call.fb)>::count>([&]<std::size_t K>() {
        const auto& t = voxelpipe::get<K>(call.fb.targets);
        if (t.load == load_operation::off) return;
        counts.voxels += blend_four(t, x, y, z, mask, along_y, voxelpipe::get<K>(call.values),
                                    call.counting_target == static_cast<int>(K));
    });
}

// ---- small triangles ------------------------------------------------------------------------------------------------

inline constexpr int direct_threads = 128;
#ifndef DMB
#define DMB 6
#endif
inline constexpr int direct_min_blocks = DMB; // per multiprocessor: registers for that many
inline constexpr int most_side = 8;           // a bounding box of so many voxels a side is one thread's work
inline constexpr int small_cells = 27;        // one of so many voxels waits apart from the larger ones
inline constexpr int small_columns = 12;      // the same for thin coverage, in columns of voxels
inline constexpr int most_columns = 64;       // thin: one thread's work
inline constexpr int medium_lanes = 8;        // of a warp, for one larger triangle

// Triangles that wait for a full warp of them. Every warp has its own queues: no thread waits for another warp, and the
// number that wait is a register that all lanes agree on.
inline constexpr int queue_places = 64; // up to 31 wait when a warp brings up to 32 more

// Triangles relative to their bounding boxes, each in a column of words.
struct triangle_queue {
    std::int32_t p[9][queue_places];
    std::int32_t origin[3][queue_places]; // lowest voxel of the bounding box
    std::uint32_t part[queue_places];     // small_box, packed
};

// 5 bits for each of the six numbers of a box.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t pack_box(const core::small_box& box) {
    std::uint32_t packed = 0;
    for (int i = 0; i < 3; ++i)
        packed |= static_cast<std::uint32_t>(box.lo[i]) << (10 * i) | static_cast<std::uint32_t>(box.hi[i])
                                                                          << (10 * i + 5);
    return packed;
}
[[nodiscard]] VOXELPIPE_HD inline core::small_box unpack_box(std::uint32_t packed) {
    core::small_box box{};
    for (int i = 0; i < 3; ++i) {
        box.lo[i] = static_cast<int>(packed >> (10 * i) & 31);
        box.hi[i] = static_cast<int>(packed >> (10 * i + 5) & 31);
    }
    return box;
}

// The place of a lane that wants one behind the `count` that wait; adds the newcomers. All lanes take part.
__device__ VOXELPIPE_INLINE int take_place(bool wanted, int& count) {
    const unsigned who = __ballot_sync(0xffffffffu, wanted);
    const int place = count + __popc(who & ((1u << threadIdx.x % 32) - 1));
    count += __popc(who);
    return place;
}

// A triangle relative to its bounding box, and what of that box lies in the grid.
struct near_triangle {
    core::small_triangle t;
    std::int32_t lo[3];  // lowest voxel of the bounding box
    int cells[3];        // its size
    core::small_box box; // 1 > 0 along an axis where nothing lies in the grid
    bool is_near;        // otherwise nothing above holds
    bool is_out;         // no voxel in the grid can be covered
};

template <class Call>
__device__ VOXELPIPE_INLINE near_triangle load_near(const Call& call, const glm::uvec3& index) {
    near_triangle r;
    r.is_near = call.source.near_position(index.x, r.t.p[0]) & call.source.near_position(index.y, r.t.p[1]) &
                call.source.near_position(index.z, r.t.p[2]);
    r.is_out = false;
    for (int k = 0; k < 3; ++k) {
        const int extent = k == 0 ? call.extent.x : k == 1 ? call.extent.y : call.extent.z;
        const std::int32_t low = core::min3(r.t.p[0][k], r.t.p[1][k], r.t.p[2][k]);
        const std::int32_t high = core::max3(r.t.p[0][k], r.t.p[1][k], r.t.p[2][k]);
        r.lo[k] = -(-low >> call.fraction) - 1; // ceil - 1: a face touches both sides
        const std::int32_t last = (high >> call.fraction) - r.lo[k];
        // A thin fragment may lie one voxel beyond the triangle's own depths.
        constexpr int beyond = Call::rule == coverage::thin ? 1 : 0;
        r.is_out = r.is_out || r.lo[k] - beyond >= extent || r.lo[k] + last + beyond < 0;
        r.box.lo[k] = r.lo[k] < 0 ? -r.lo[k] : 0;
        r.box.hi[k] = r.lo[k] + last < extent ? last : extent - 1 - r.lo[k];
        if (r.box.lo[k] > r.box.hi[k]) {
            r.box.lo[k] = 1;
            r.box.hi[k] = 0;
        }
        r.cells[k] = last + 1;
        for (int v = 0; v < 3; ++v) r.t.p[v][k] -= r.lo[k] << call.fraction;
    }
    return r;
}

// Thin fragments of the columns in rows first, first + step, ... of a small triangle; false where it has no area.
template <class Call>
__device__ VOXELPIPE_INLINE bool raster_thin(const Call& call, const core::small_triangle& t,
                                             const std::int32_t (&lo)[3], const core::small_box& box, int first,
                                             int step, direct_counts& counts) {
    const core::triple<std::int64_t> normal = core::small_normal(t);
    const std::int64_t mx = core::magnitude(normal[0]), my = core::magnitude(normal[1]),
                       mz = core::magnitude(normal[2]);
    if ((mx | my | mz) == 0) return false;
    const int axis = mx >= my && mx >= mz ? 0 : my >= mz ? 1 : 2;
    const core::small_thin s(t, normal, axis, call.fraction);
    const auto begin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
    const auto end = core::to_uvw(axis, box.hi[0], box.hi[1], box.hi[2]);
    const int depth = axis == 0 ? call.extent.x : axis == 1 ? call.extent.y : call.extent.z;
    const int lowest = axis == 0 ? lo[0] : axis == 1 ? lo[1] : lo[2];
    for (int v = begin[1] + first; v <= end[1]; v += step)
        s.row(begin[0], end[0], v, [&](int u, int w) {
            if (lowest + w < 0 || lowest + w >= depth) return;
            const auto at = core::to_xyz(axis, u, v, w);
            blend_into_all(call, lo[0] + at[0], lo[1] + at[1], lo[2] + at[2], 1u, counts);
        });
    return true;
}

// Conservative fragments within a box of at most 32 voxels a side, by medium_lanes neighbouring lanes that all take
// part: each has rows of its own y, and what the z of a row cuts off is found by one of them for all.
template <class Call>
__device__ VOXELPIPE_INLINE void raster_lanes(const Call& call, const core::small_conservative& s,
                                              const std::int32_t (&lo)[3], const core::small_box& box,
                                              direct_counts& counts) {
    const int lane = static_cast<int>(threadIdx.x) % medium_lanes;
    const unsigned group = ((1u << medium_lanes) - 1) << (threadIdx.x % 32 / medium_lanes * medium_lanes);
    const int x0 = box.lo[0], x1 = box.hi[0];
    for (int first_y = box.lo[1]; first_y <= box.hi[1]; first_y += medium_lanes) {
        const int y = first_y + lane;
        const word at_y = y <= box.hi[1] ? s.limit_at_y(x0, x1, y) : 0;
        for (int first_z = box.lo[2]; first_z <= box.hi[2]; first_z += medium_lanes) {
            const word mine = first_z + lane <= box.hi[2] ? s.limit_at_z(x0, x1, first_z + lane) : 0;
            const int end = box.hi[2] - first_z + 1 < medium_lanes ? box.hi[2] - first_z + 1 : medium_lanes;
            for (int k = 0; k < end; ++k) {
                const word limit = __shfl_sync(group, mine, k, medium_lanes) & at_y;
                if (limit == 0 || !s.meets_row(y, first_z + k)) continue;
                blend_into_all(call, lo[0] + x0, lo[1] + y, lo[2] + first_z + k,
                               s.plane_bits(x0, y, first_z + k, limit), counts);
            }
        }
    }
}

// A bounding box of at most two voxels along two axes and one along the third: written at once. Most triangles of a
// fine mesh are of this kind.
template <class Call>
__device__ VOXELPIPE_INLINE void raster_quad(const Call& call, const core::small_triangle& t,
                                             const std::int32_t (&lo)[3], const int (&cells)[3],
                                             const core::small_box& box, direct_counts& counts) {
    const int thick = cells[2] == 1 ? 2 : cells[1] == 1 ? 1 : 0;
    word bits = 0; // p + 2 q, along the other two axes
    if ((cells[0] > 1) + (cells[1] > 1) + (cells[2] > 1) == 2) {
        std::int32_t p[3][2];
        for (int v = 0; v < 3; ++v) {
            p[v][0] = thick == 0 ? t.p[v][1] : t.p[v][0];
            p[v][1] = thick == 2 ? t.p[v][1] : t.p[v][2];
        }
        bits = core::small_flat(p, call.fraction).quad_bits();
    } else { // a line of voxels is covered whole
        const int np = thick == 0 ? cells[1] : cells[0], nq = thick == 2 ? cells[1] : cells[2];
        bits = np == 2 ? 3u : nq == 2 ? 5u : 1u;
    }
    // What lies in the grid.
    const int p0 = thick == 0 ? box.lo[1] : box.lo[0], p1 = thick == 0 ? box.hi[1] : box.hi[0];
    const int q0 = thick == 2 ? box.lo[1] : box.lo[2], q1 = thick == 2 ? box.hi[1] : box.hi[2];
    bits &= (p0 == 0 ? 15u : 10u) & (p1 == 1 ? 15u : 5u) & (q0 == 0 ? 15u : 12u) & (q1 == 1 ? 15u : 3u);
    // Rows along x: of y and z where the thin axis is x, otherwise one row for each q.
    const bool rows_of_one = thick == 0;
    const word mask[4] = {rows_of_one ? bits & 1u : bits & 3u, rows_of_one ? bits >> 1 & 1u : 0u,
                          rows_of_one ? bits >> 2 & 1u : bits >> 2, rows_of_one ? bits >> 3 : 0u};
    blend_four_into_all(call, lo[0], lo[1], lo[2], mask, thick == 2, counts);
}

// ---- large triangles ------------------------------------------------------------------------------------------------

// How a large triangle's box of voxels is cut into pieces, a lane each, 32 to a record. Conservative: columns of bricks
// along the dominant axis. Thin: rows of 16 columns of voxels.
template <coverage Rule>
struct large_pieces {
    static constexpr int across = Rule == coverage::thin ? 1 : core::brick_size; // voxels along v
    int axis;
    core::triple<std::int64_t> lo, hi; // uvw, the box
    std::int64_t first_u, first_v, per_row, rows;

    VOXELPIPE_HD large_pieces(const core::voxel_box& box, int axis_)
        : axis(axis_), lo(core::to_uvw(axis_, box.lo[0], box.lo[1], box.lo[2])),
          hi(core::to_uvw(axis_, box.hi[0], box.hi[1], box.hi[2])), first_u(lo[0] >> core::log2_brick),
          first_v(lo[1] / across), per_row((hi[0] >> core::log2_brick) - first_u + 1),
          rows(hi[1] / across - first_v + 1) {}
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * rows; }
    [[nodiscard]] VOXELPIPE_HD std::int64_t records() const {
        return (count() + chunks_per_record - 1) / chunks_per_record;
    }
    // The lowest voxel of piece i along u and v, maybe outside the box.
    [[nodiscard]] VOXELPIPE_HD std::int64_t u(std::int64_t i) const {
        return (first_u + i % per_row) << core::log2_brick;
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t v(std::int64_t i) const { return (first_v + i / per_row) * across; }
    // Piece i as a box of voxels.
    [[nodiscard]] VOXELPIPE_HD core::voxel_box piece(std::int64_t i) const {
        const std::int64_t u0 = u(i), v0 = v(i), u1 = u0 + core::brick_size - 1, v1 = v0 + across - 1;
        const auto inside = [&](std::int64_t at, int k) { return at < lo[k] ? lo[k] : at > hi[k] ? hi[k] : at; };
        return {core::to_xyz(axis, inside(u0, 0), inside(v0, 1), lo[2]),
                core::to_xyz(axis, inside(u1, 0), inside(v1, 1), hi[2])};
    }
    // The most records that a triangle can have in a grid.
    [[nodiscard]] static std::uint64_t most_records(glm::ivec3 extent) {
        const auto of = [](std::int64_t along, std::int64_t rest) {
            const std::int64_t pieces = (along / core::brick_size + 1) * (rest / across + 1);
            return static_cast<std::uint64_t>((pieces + chunks_per_record - 1) / chunks_per_record);
        };
        return core::max3(of(extent.y, extent.z), of(extent.z, extent.x), of(extent.x, extent.y));
    }
};

// Decides about a triangle in full width; one that is drawn goes to the list.
template <class Call>
__device__ __noinline__ core::triangle_class push_large(const Call& call, std::uint32_t triangle, glm::uvec3 index) {
    const core::snapped_position a = call.source.position(index.x), b = call.source.position(index.y),
                                 c = call.source.position(index.z);
    const core::voxel_box whole{{{0, 0, 0}}, {{call.extent.x - 1, call.extent.y - 1, call.extent.z - 1}}};
    core::voxel_box reach{};
    core::triangle_class kind = core::classify<Call::rule>(a, b, c, call.fraction, whole, reach);
    if (kind != core::triangle_class::drawn) return kind;
    if (Call::rule == coverage::thin && core::has_zero_area(a, b, c)) return core::triangle_class::zero_area;
    const large_pieces<Call::rule> pieces(reach, core::dominant_axis(a, b, c, call.fraction));
    call.large.push(triangle, static_cast<unsigned long long>(pieces.records()));
    return kind;
}

// Rows of bits along x from spans of columns: columns next to each other with one voxel at the same depth become one.
template <class Call>
struct span_writer {
    const Call& call;
    direct_counts& counts;
    int x = 0, y = 0, z = 0; // of the row that waits
    word mask = 0;

    __device__ VOXELPIPE_INLINE void flush() {
        blend_into_all(call, x, y, z, mask, counts);
        mask = 0;
    }
    __device__ VOXELPIPE_INLINE void span(int axis, int u, int v, int w0, int w1) {
        if (axis == 0) {
            for (int at = w0; at <= w1; at += 32) {
                const int n = w1 - at + 1;
                blend_into_all(call, at, u, v, n >= 32 ? ~0u : (1u << n) - 1, counts);
            }
            return;
        }
        for (int w = w0; w <= w1; ++w) {
            const auto p = core::to_xyz(axis, u, v, w);
            if (mask != 0 && p[1] == y && p[2] == z && p[0] - x < 32) {
                mask |= 1u << (p[0] - x);
            } else {
                flush();
                x = p[0];
                y = p[1];
                z = p[2];
                mask = 1;
            }
        }
    }
};

// ---- kernels --------------------------------------------------------------------------------------------------------

// Before anything is written: whether every index is one of a vertex.
template <class Index>
__global__ void check_indices_kernel(const Index* indices, std::uint64_t count, Index num_vertices,
                                     pipeline_state* state) {
    bool bad = false;
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    std::uint64_t done = 0;
    if (reinterpret_cast<std::uintptr_t>(indices) % 16 == 0) {
        for (std::uint64_t i = thread; i < count / 4; i += threads) {
            const uint4 v = __ldg(reinterpret_cast<const uint4*>(indices) + i);
            bad = bad || v.x >= num_vertices || v.y >= num_vertices || v.z >= num_vertices || v.w >= num_vertices;
        }
        done = count / 4 * 4;
    }
    for (std::uint64_t i = done + thread; i < count; i += threads) bad = bad || indices[i] >= num_vertices;
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(&state->index_error, 1u);
}

// What one warp keeps in shared memory.
struct warp_queues {
    triangle_queue cubes, smalls;                              // bounding boxes of 2 x 2 x 2 voxels; other small ones
    std::uint32_t larges[queue_places], mediums[queue_places]; // numbers of triangles that are loaded again
};

// The work of a warp, from the mesh to the targets.
template <class Call>
struct direct_warp {
    static constexpr bool thin = Call::rule == coverage::thin;
    using triangle_class = core::triangle_class;

    const Call& call;
    warp_queues& queues;
    unsigned* dropped; // by triangle_class, of the block
    int lane = static_cast<int>(threadIdx.x) % 32;
    int num_cubes = 0, num_smalls = 0, num_larges = 0, num_mediums = 0;
    direct_counts counts{};

    __device__ VOXELPIPE_INLINE void drop(triangle_class kind) { atomicAdd(&dropped[static_cast<int>(kind)], 1u); }

    __device__ VOXELPIPE_INLINE static void put(triangle_queue& queue, int at, const near_triangle& r) {
        for (int k = 0; k < 9; ++k) queue.p[k][at] = r.t.p[k / 3][k % 3];
        for (int k = 0; k < 3; ++k) queue.origin[k][at] = r.lo[k];
        queue.part[at] = pack_box(r.box);
    }
    __device__ VOXELPIPE_INLINE static core::small_box get(const triangle_queue& queue, int at, core::small_triangle& t,
                                                           std::int32_t (&lo)[3]) {
        for (int k = 0; k < 9; ++k) t.p[k / 3][k % 3] = queue.p[k][at];
        for (int k = 0; k < 3; ++k) lo[k] = queue.origin[k][at];
        return unpack_box(queue.part[at]);
    }

    // The last 32 that wait, one a lane; all lanes take part.
    template <class Raster>
    __device__ VOXELPIPE_INLINE static void drain(const warp_queues& from, int& count, Raster&& raster) {
        __syncwarp();
        raster(from, count - 32 + static_cast<int>(threadIdx.x % 32));
        __syncwarp();
        count -= 32;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE auto raster_cube() {
        return [this](const warp_queues& from, int at) VOXELPIPE_INLINE_LAMBDA {
            core::small_triangle t;
            std::int32_t lo[3];
            const core::small_box box = get(from.cubes, at, t, lo);
            word bits = core::cube_bits(core::small_conservative(t, call.fraction));
            bits &= (box.lo[0] == 0 ? 0xffu : 0xaau) & (box.hi[0] == 1 ? 0xffu : 0x55u) &
                    (box.lo[1] == 0 ? 0xffu : 0xccu) & (box.hi[1] == 1 ? 0xffu : 0x33u) &
                    (box.lo[2] == 0 ? 0xffu : 0xf0u) & (box.hi[2] == 1 ? 0xffu : 0x0fu);
            const word mask[4] = {bits & 3u, bits >> 2 & 3u, bits >> 4 & 3u, bits >> 6};
            blend_four_into_all(call, lo[0], lo[1], lo[2], mask, false, counts);
        };
    }
    __device__ VOXELPIPE_INLINE void raster(const core::small_triangle& t, const std::int32_t (&lo)[3],
                                            const core::small_box& box) {
        if constexpr (thin) {
            if (!raster_thin(call, t, lo, box, 0, 1, counts)) drop(triangle_class::zero_area);
        } else {
            const core::small_conservative s(t, call.fraction);
            s.rows(box, [&](int y, int z, word bits) {
                blend_into_all(call, lo[0] + box.lo[0], lo[1] + y, lo[2] + z, bits, counts);
            });
        }
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE auto raster_small() {
        return [this](const warp_queues& from, int at) VOXELPIPE_INLINE_LAMBDA {
            core::small_triangle t;
            std::int32_t lo[3];
            const core::small_box box = get(from.smalls, at, t, lo);
            raster(t, lo, box);
        };
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE auto raster_large() {
        return [this](const warp_queues& from, int at) VOXELPIPE_INLINE_LAMBDA {
            const near_triangle r = load_near(call, call.source.triangle(from.larges[at]));
            raster(r.t, r.lo, r.box);
        };
    }
    // All that wait, medium_lanes a triangle.
    __device__ void drain_mediums() {
        __syncwarp();
        for (int first = 0; first < num_mediums; first += 32 / medium_lanes) {
            const int at = first + lane / medium_lanes;
            if (at >= num_mediums) continue;
            const near_triangle r = load_near(call, call.source.triangle(queues.mediums[at]));
            if constexpr (thin) {
                const int part = lane % medium_lanes;
                if (!raster_thin(call, r.t, r.lo, r.box, part, medium_lanes, counts) && part == 0)
                    drop(triangle_class::zero_area);
            } else {
                raster_lanes(call, core::small_conservative(r.t, call.fraction), r.lo, r.box, counts);
            }
        }
        __syncwarp();
        num_mediums = 0;
    }

    // The lane's triangle i, with its indices, where there is one.
    __device__ VOXELPIPE_INLINE void batch(std::uint32_t i, const glm::uvec3& index) {
        const bool valid = i < call.num_triangles;
        near_triangle r;
        int most = 0;
        bool is_quad = false, to_cubes = false, to_smalls = false, to_larges = false, to_mediums = false,
             is_big = false;
        if (valid) {
            r = load_near(call, index);
            most = core::max3(r.cells[0], r.cells[1], r.cells[2]);
            is_big = !r.is_near || most > core::small_voxels(call.fraction);
            if (!is_big && r.is_out) drop(triangle_class::outside);
            if (!is_big && !r.is_out) {
                if constexpr (thin) {
                    const int columns =
                        core::max3(r.cells[0] * r.cells[1], r.cells[1] * r.cells[2], r.cells[2] * r.cells[0]);
                    to_smalls = columns <= small_columns;
                    to_larges = !to_smalls && columns <= most_columns;
                } else {
                    is_quad = most <= 2 && core::min3(r.cells[0], r.cells[1], r.cells[2]) == 1;
                    to_cubes = !is_quad && most == 2;
                    to_smalls = most > 2 && most <= most_side && r.cells[0] * r.cells[1] * r.cells[2] <= small_cells;
                    to_larges = most > 2 && !to_smalls && most <= most_side;
                }
                to_mediums = !(is_quad || to_cubes || to_smalls || to_larges);
            }
        }
        if constexpr (!thin) {
            const int at = take_place(to_cubes, num_cubes);
            if (to_cubes) put(queues.cubes, at, r);
        }
        const int small_at = take_place(to_smalls, num_smalls);
        if (to_smalls) put(queues.smalls, small_at, r);
        const int large_at = take_place(to_larges, num_larges);
        if (to_larges) queues.larges[large_at] = i;
        const int medium_at = take_place(to_mediums, num_mediums);
        if (to_mediums) queues.mediums[medium_at] = i;
        if constexpr (!thin) {
            if (is_quad) raster_quad(call, r.t, r.lo, r.cells, r.box, counts);
        }
        if (is_big) {
            const triangle_class kind = push_large(call, i, index);
            if (kind != triangle_class::drawn) drop(kind);
        }
        __syncwarp();
    }
};

// Whether a triangle's fragments are found and written, or why it has none, is decided here for each of them.
template <class Call>
__global__ __launch_bounds__(direct_threads,
                             direct_min_blocks) void direct_raster_kernel(const __grid_constant__ Call call,
                                                                          pipeline_state* state) {
    using core::triangle_class;
    __shared__ warp_queues queues[direct_threads / 32];
    __shared__ unsigned dropped[5];
    if (state->index_error != 0) return;
    if (threadIdx.x < 5) dropped[threadIdx.x] = 0;
    __syncthreads();
    direct_warp<Call> warp{call, queues[threadIdx.x / 32], dropped};
    // The indices of a batch are loaded while the batch before it is worked on.
    const auto load_index = [&](std::uint32_t i) {
        return i < call.num_triangles ? call.source.triangle(i) : glm::uvec3(0);
    };
    const std::uint32_t step = gridDim.x * direct_threads;
    std::uint32_t looked_at = 0, first = blockIdx.x * direct_threads + threadIdx.x / 32 * 32;
    glm::uvec3 index = load_index(first + static_cast<unsigned>(warp.lane));
    for (; first < call.num_triangles; first += step) {
        const glm::uvec3 next = load_index(first + step + static_cast<unsigned>(warp.lane));
        looked_at += call.num_triangles - first < 32 ? call.num_triangles - first : 32;
        warp.batch(first + static_cast<unsigned>(warp.lane), index);
        index = next;
        if constexpr (Call::rule == coverage::conservative)
            if (warp.num_cubes >= 32) warp.drain(warp.queues, warp.num_cubes, warp.raster_cube());
        if (warp.num_smalls >= 32) warp.drain(warp.queues, warp.num_smalls, warp.raster_small());
        if (warp.num_larges >= 32) warp.drain(warp.queues, warp.num_larges, warp.raster_large());
        if (warp.num_mediums >= 32) warp.drain_mediums();
    }
    if (warp.num_mediums > 0) warp.drain_mediums();
    // What is left in the block's queues, together.
    constexpr int warps = direct_threads / 32;
    __shared__ int left[3][warps];
    if (threadIdx.x % 32 == 0) {
        left[0][threadIdx.x / 32] = warp.num_cubes;
        left[1][threadIdx.x / 32] = warp.num_smalls;
        left[2][threadIdx.x / 32] = warp.num_larges;
    }
    __syncthreads();
    const auto rest = [&](const int(&counts)[warps], auto&& raster) {
        int at = static_cast<int>(threadIdx.x), w = 0; // fewer than 32 a warp are left
        while (w < warps && at >= counts[w]) at -= counts[w++];
        if (w < warps) raster(queues[w], at);
    };
    if constexpr (Call::rule == coverage::conservative) rest(left[0], warp.raster_cube());
    rest(left[1], warp.raster_small());
    rest(left[2], warp.raster_large());

    const auto add = [&](std::uint64_t mine, unsigned long long* total) {
        const unsigned long long sum = block_sum(mine);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
    };
    add(warp.counts.fragments, &state->fragments);
    if (call.counting_target >= 0) add(warp.counts.voxels, &state->voxels);
    const unsigned long long all = block_sum(threadIdx.x % 32 == 0 ? looked_at : 0);
    if (threadIdx.x == 0) {
        const auto number = [&](triangle_class kind, unsigned long long* total) {
            const unsigned n = dropped[static_cast<int>(kind)];
            if (n != 0) atomicAdd(total, static_cast<unsigned long long>(n));
            return n;
        };
        const unsigned none =
            number(triangle_class::nonfinite, &state->nonfinite) + number(triangle_class::too_far, &state->too_far) +
            number(triangle_class::zero_area, &state->zero_area) + number(triangle_class::outside, &state->outside);
        if (all != none) atomicAdd(&state->drawn, all - none);
    }
}

inline constexpr int large_warps = 4; // of a block
inline constexpr int most_bricks = 64;

// What one warp keeps in shared memory for a large triangle.
struct large_memory {
    core::brick_triangle triangle;
    std::int16_t bricks[3][most_bricks]; // that wait, in bricks of the grid
};

// A warp takes a record: 32 pieces of a triangle, a lane each. Conservative: the lanes find the bricks that the
// triangle meets in their columns, and medium_lanes of them then take a brick each.
template <class Call>
__global__ __launch_bounds__(32 * large_warps, 4) void direct_large_kernel(const __grid_constant__ Call call,
                                                                           pipeline_state* state) {
    constexpr bool thin = Call::rule == coverage::thin;
    constexpr auto rule = core::to_rule(Call::rule);
    __shared__ large_memory memories[thin ? 1 : large_warps];
    if (state->index_error != 0) return;
    const unsigned long long packed = *call.large.next;
    const unsigned long long records = packed & ((1ull << large_list::record_bits) - 1);
    const unsigned long long num = packed >> large_list::record_bits;
    const unsigned long long warps = std::uint64_t{gridDim.x} * large_warps;
    const unsigned lane = threadIdx.x % 32;
    const core::voxel_box whole{{{0, 0, 0}}, {{call.extent.x - 1, call.extent.y - 1, call.extent.z - 1}}};
    direct_counts counts;
    for (unsigned long long r = (std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x) / 32; r < records; r += warps) {
        unsigned long long lo = 0, hi = num; // the last triangle whose records begin at or before r
        while (hi - lo > 1) {
            const unsigned long long middle = lo + (hi - lo) / 2;
            if (call.large.first_records[middle] <= r)
                lo = middle;
            else
                hi = middle;
        }
        const auto piece = static_cast<std::int64_t>((r - call.large.first_records[lo]) * chunks_per_record + lane);
        const glm::uvec3 index = call.source.triangle(call.large.triangles[lo]);
        const core::snapped_position a = call.source.position(index.x), b = call.source.position(index.y),
                                     c = call.source.position(index.z);
        core::voxel_box reach{};
        (void)core::classify<Call::rule>(a, b, c, call.fraction, whole, reach);
        const int axis = core::dominant_axis(a, b, c, call.fraction);
        const large_pieces<Call::rule> pieces(reach, axis);
        const bool valid = piece < pieces.count();
        if (!core::fits_narrow(a, b, c, call.fraction)) {
            if (valid) {
                span_writer<Call> writer{call, counts};
                for_each_wide_span<rule>(a, b, c, call.fraction, pieces.piece(piece),
                                         [&](const wide_span& s) { writer.span(axis, s.u, s.v, s.w_first, s.w_last); });
                writer.flush();
            }
            continue;
        }
        const core::voxel_box box = core::bounds(a, b, c, call.fraction);
        if constexpr (thin) {
            if (!valid) continue;
            const core::brick_thin t(a, b, c, box, axis, call.fraction);
            const auto origin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
            const auto last = core::to_uvw(axis, box.hi[0], box.hi[1], box.hi[2]);
            const std::int64_t u0 = pieces.u(piece), v = pieces.v(piece);
            if (v < origin[1] || v > last[1]) continue; // reach is a voxel wider
            const auto u = static_cast<int>(u0 - origin[0]), at_v = static_cast<int>(v - origin[1]);
            if (!t.meets_row(u, at_v)) continue;
            // Columns of the bounding box, within the grid.
            const std::int64_t from = u0 > origin[0] ? u0 : origin[0], to = u0 + core::brick_size - 1;
            const std::int64_t begin = from > pieces.lo[0] ? from : pieces.lo[0];
            const std::int64_t end = core::min3(to, last[0], pieces.hi[0]);
            span_writer<Call> writer{call, counts};
            t.from(u, at_v).template row<true>(static_cast<int>(begin - u0), static_cast<int>(end - u0), 0,
                                               [&](int column, int depth) {
                                                   const std::int64_t w = origin[2] + depth;
                                                   if (w < pieces.lo[2] || w > pieces.hi[2]) return;
                                                   writer.span(axis, static_cast<int>(u0) + column, static_cast<int>(v),
                                                               static_cast<int>(w), static_cast<int>(w));
                                               });
            writer.flush();
        } else {
            large_memory& memory = memories[threadIdx.x / 32];
            __syncwarp(); // the last triangle's bricks are done
            {
                const core::brick_triangle t(a, b, c, box, call.fraction);
                if (lane == 0) memory.triangle = t;
            }
            __syncwarp();
            const core::brick_triangle& t = memory.triangle;
            const auto raster_bricks = [&](int n) {
                __syncwarp();
                for (int first = 0; first < n; first += 32 / medium_lanes) {
                    const int at = first + static_cast<int>(lane) / medium_lanes;
                    if (at >= n) continue;
                    std::int32_t corner[3]; // in the grid
                    int from[3];            // the same from the bounding box
                    core::small_box part;
                    for (int k = 0; k < 3; ++k) {
                        corner[k] = memory.bricks[k][at] * core::brick_size;
                        from[k] = corner[k] - static_cast<int>(box.lo[k]);
                        part.lo[k] = reach.lo[k] > corner[k] ? static_cast<int>(reach.lo[k]) - corner[k] : 0;
                        part.hi[k] = reach.hi[k] - corner[k] < core::brick_size - 1
                                         ? static_cast<int>(reach.hi[k]) - corner[k]
                                         : core::brick_size - 1;
                    }
                    raster_lanes(call, t.at(from[0], from[1], from[2]), corner, part, counts);
                }
                __syncwarp();
            };
            int w = 0, w_end = -1; // bricks
            const std::int64_t u0 = pieces.u(piece), v0 = pieces.v(piece);
            if (valid) {
                const auto origin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
                double first = 0, last = 0;
                t.depths(axis, static_cast<int>(u0 - origin[0]), static_cast<int>(v0 - origin[1]), first, last);
                const auto low = static_cast<double>(pieces.lo[2]), high = static_cast<double>(pieces.hi[2]);
                first += static_cast<double>(origin[2]);
                last += static_cast<double>(origin[2]);
                if (first <= high && last >= low) {
                    w = static_cast<int>(first > low ? first : low) >> core::log2_brick;
                    w_end = static_cast<int>(last < high ? last : high) >> core::log2_brick;
                }
            }
            int waiting = 0;
            while (__any_sync(0xffffffffu, w <= w_end)) {
                bool hit = false;
                core::triple<int> brick{};
                if (w <= w_end) {
                    brick = core::to_xyz(axis, static_cast<int>(u0 >> core::log2_brick),
                                         static_cast<int>(v0 >> core::log2_brick), w);
                    hit = t.meets(brick[0] * core::brick_size - static_cast<int>(box.lo[0]),
                                  brick[1] * core::brick_size - static_cast<int>(box.lo[1]),
                                  brick[2] * core::brick_size - static_cast<int>(box.lo[2]));
                }
                ++w;
                const int place = take_place(hit, waiting);
                if (hit)
                    for (int k = 0; k < 3; ++k) memory.bricks[k][place] = static_cast<std::int16_t>(brick[k]);
                if (waiting > most_bricks - 32) {
                    raster_bricks(waiting);
                    waiting = 0;
                }
            }
            raster_bricks(waiting);
        }
    }
    const unsigned long long fragments = block_sum(counts.fragments);
    if (threadIdx.x == 0 && fragments != 0) atomicAdd(&state->fragments, fragments);
    if (call.counting_target >= 0) {
        const unsigned long long voxels = block_sum(counts.voxels);
        if (threadIdx.x == 0 && voxels != 0) atomicAdd(&state->voxels, voxels);
    }
}

inline void check_indices(const glm::uvec3* triangles, std::uint64_t num_triangles, std::uint64_t num_vertices,
                          pipeline_state* state, cudaStream_t stream) {
    check_indices_kernel<std::uint32_t><<<fill_device(num_triangles), threads_per_block, 0, stream>>>(
        reinterpret_cast<const std::uint32_t*>(triangles), 3 * num_triangles, static_cast<std::uint32_t>(num_vertices),
        state);
    check(cudaGetLastError(), stage::coarse_raster);
}

template <class Call>
void direct_raster(const Call& call, pipeline_state* state, cudaStream_t stream) {
    const auto batches =
        static_cast<unsigned>((std::uint64_t{call.num_triangles} + direct_threads - 1) / direct_threads);
    const unsigned most = static_cast<unsigned>(num_multiprocessors()) * direct_min_blocks;
    const unsigned blocks = batches < most ? batches : most;
    direct_raster_kernel<Call><<<blocks, direct_threads, 0, stream>>>(call, state);
    check(cudaGetLastError(), stage::fine_raster);
    direct_large_kernel<Call>
        <<<static_cast<unsigned>(num_multiprocessors()) * 4, 32 * large_warps, 0, stream>>>(call, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
