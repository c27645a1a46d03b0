// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One fragment a sample, from what the search has found, into the targets of a framebuffer. The 32 samples of a warp
// are a word of a target of bits, which no other warp writes.

#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/core/numbering.hpp>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/distance/device/band_search.cuh>
#include <voxelpipe/solid/device/fill_rows.cuh>
#include <voxelpipe/solid/device/solid_cones.cuh>

#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe::device {

// The draws' shaders and varyings.
template <class Shader, class Varyings>
struct distance_shading {
    using shader_type = Shader;
    using varyings = Varyings;
    draw_shading<Shader, Varyings> one;
    const draw_shading<Shader, Varyings>* many;
    core::triple<double> normal_factors;
    glm::ivec3 offset; // of the computed part in the whole grid

    [[nodiscard]] __device__ const draw_shading<Shader, Varyings>& draw(std::uint32_t d) const {
        return many != nullptr ? many[d] : one;
    }
};

// Device memory for the draws of a call, and for further parts of its geometry.
template <class Mesh, class VertexShader, class Shader>
struct distance_draws {
    using memory_type = scene_memory<Mesh, VertexShader, Shader>;
    using varyings = typename memory_type::varyings;
    using shading_type = distance_shading<Shader, varyings>;
    using draw_type = draw<Mesh, VertexShader, Shader>;

    memory_type memory;
    draw_geometry* geometries; // of the draws and the further parts; null if there are no such parts

    // num_more: number of further parts.
    distance_draws(arena& arena_of_call, std::span<const draw_type> draws, std::size_t num_more = 0)
        : memory(arena_of_call, draws),
          geometries(arena_of_call.take<draw_geometry>(num_more != 0 ? draws.size() + num_more : 0)) {}

    // Runs the vertex shaders. `more`: parts of the geometry behind the draws, without shaders.
    void shade(std::span<const draw_type> draws, const grid& g, geometry& geo, shading_type& s, cudaStream_t stream,
               std::span<const cone_part> more = {}) const {
        const auto shaded = memory.shade(draws, g, stream);
        geo = shaded.geo;
        s = {shaded.one, shaded.many, shaded.normal_factors, shaded.offset};
        if (more.empty()) return;
        if (geo.many != nullptr)
            check(cudaMemcpyAsync(geometries, geo.many, draws.size() * sizeof(draw_geometry), cudaMemcpyDeviceToDevice,
                                  stream));
        else
            upload(
                geometries, 1, [&](std::size_t) { return geo.one; }, stream);
        upload(
            geometries + draws.size(), more.size(),
            [&](std::size_t i) {
                draw_geometry part = more[i].geometry;
                part.first_primitive = geo.num_primitives;
                geo.num_primitives += more[i].num_triangles;
                return part;
            },
            stream);
        geo.many = geometries;
        geo.num_draws += static_cast<std::uint32_t>(more.size());
    }
};

// Rows of bits that say which samples are inside: a target of bits without bricks. Null: none is.
struct inside_rows {
    const word* words;
    glm::ivec3 extent;
    [[nodiscard]] __device__ VOXELPIPE_INLINE word row(int x, int y, int z) const {
        if (words == nullptr) return 0;
        const std::int64_t each = (extent.x + 31) / 32;
        return words[(std::int64_t{z} * extent.y + y) * each + x / 32];
    }
};

// Everything of a fragment but the distance and what lies in front of it.
template <class Shading, class Fragment>
__device__ VOXELPIPE_INLINE void fill_fragment(const distance_input& in, const Shading& s, std::uint32_t id,
                                               const glm::ivec3& at, const typename Shading::varyings& none,
                                               Fragment& f) {
    using varyings = typename Shading::varyings;
    f.draw = in.geo.find_draw(id);
    loaded_triangle tri;
    in.geo.draw(f.draw).locate(id, tri);
    const auto& d = s.draw(f.draw);
    f.triangle = tri.triangle;
    f.instance = tri.instance;
    f.primitive = id;
    if (d.numbers.whole != 0) {
        const core::visible_numbers seen = d.numbers.of(tri.triangle, tri.instance);
        f.triangle = seen.triangle;
        f.primitive = seen.primitive;
    }
    const core::seen_triangle seen = see_exactly(in, id, in.position(at), true);
    const core::closest_region region = core::find_distance(seen, in.scale).region;
    const core::triple<double> weights = core::closest_weights(seen, in.scale, region);
    const core::triple<double> offset = core::to_closest(seen, in.scale, region);
    f.side = core::side_of(seen);
    f.barycentric = {exact::to_float(weights[0]), exact::to_float(weights[1]), exact::to_float(weights[2])};
    f.to_closest = {exact::to_float(offset[0]), exact::to_float(offset[1]), exact::to_float(offset[2])};
    f.normal = core::unit_normal(seen, s.normal_factors);
    for (int i = 0; i < 3; ++i) {
        if constexpr (std::is_empty_v<varyings>)
            f.vertex_varyings[i] = &none;
        else
            f.vertex_varyings[i] = d.varyings + tri.index[i];
    }
    if constexpr (!std::is_empty_v<varyings>)
        f.varyings = core::mix(*f.vertex_varyings[0], *f.vertex_varyings[1], *f.vertex_varyings[2], f.barycentric.y,
                               f.barycentric.z);
}

// The shader's output for a sample. primitive: the nearest, or no_primitive. length: its distance, or the band's.
template <class Shading>
[[nodiscard]] __device__ VOXELPIPE_INLINE auto shade_sample(const distance_input& in, const Shading& s,
                                                            const glm::ivec3& at, std::uint32_t primitive, float length,
                                                            bool is_inside) {
    using varyings = typename Shading::varyings;
    const varyings none{};
    distance_fragment<varyings> f{};
    f.primitive = distance_fragment<varyings>::none;
    f.in_band = primitive != no_primitive;
    f.inside = is_inside;
    f.voxel = s.offset + at;
    f.distance = is_inside && length > 0.0f ? -length : length;
    if constexpr (!std::is_same_v<typename Shading::shader_type, distance>)
        if (f.in_band) fill_fragment(in, s, primitive, at, none, f);
    return s.draw(f.draw).fragment_shader(f);
}

// A run of a row of samples along x: 32 bricks, of which each lane has one. A warp takes it, 32 samples at a time.
struct sample_run {
    static constexpr int bricks = 32, samples = bricks * distance_brick;
    std::uint64_t slot; // of the lane's brick
    unsigned placed;    // bits of the bricks that have a place

    // run: number of the run in its row.
    [[nodiscard]] __device__ static sample_run of(const distance_input& in, const found_samples& found, int run, int y,
                                                  int z) {
        const int brick = run * bricks + static_cast<int>(threadIdx.x % 32);
        sample_run r{found_samples::nowhere, 0};
        if (brick < in.bricks.x) r.slot = found.slot_of(in.brick_number(brick, y / distance_brick, z / distance_brick));
        r.placed = __ballot_sync(0xffffffffu, r.slot != found_samples::nowhere);
        return r;
    }
    // True if a brick of samples 32 part to 32 part + 31 has a place.
    [[nodiscard]] __device__ bool has_any(int part) const { return (placed >> 4 * part & 0xfu) != 0; }
    // Place of the lane's sample of a part. All lanes call it.
    [[nodiscard]] __device__ std::uint64_t slot_of(int part) const {
        return __shfl_sync(0xffffffffu, slot, 4 * part + static_cast<int>(threadIdx.x % 32) / distance_brick);
    }
    [[nodiscard]] VOXELPIPE_HD static int count(int samples_of_row) { return (samples_of_row + samples - 1) / samples; }
};
static_assert(32 % distance_brick == 0);

struct sample_totals {
    unsigned long long fragments = 0, discarded = 0, in_band = 0;
    // All threads of the block call it.
    __device__ void add_up(bool count_voxels, pipeline_state* state) const {
        const unsigned long long f = block_sum(fragments), d = block_sum(discarded), b = block_sum(in_band);
        if (threadIdx.x != 0) return;
        if (f != 0) atomicAdd(&state->fragments, f);
        if (f != 0 && count_voxels) atomicAdd(&state->voxels, f);
        if (d != 0) atomicAdd(&state->discarded, d);
        if (b != 0) atomicAdd(&state->kept, b);
    }
};

template <class Shading, class Framebuffer>
__global__ __launch_bounds__(threads_per_block) void shade_samples_kernel(
    const __grid_constant__ distance_input in, const __grid_constant__ Shading s,
    const __grid_constant__ found_samples found, const __grid_constant__ inside_rows inside,
    const __grid_constant__ Framebuffer fb, bool count_voxels, pipeline_state* state, capacities limits) {
    using fold = voxel_fold<Framebuffer>;
    if (has_failed(*state, limits)) return;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const auto runs_x = static_cast<std::uint64_t>(sample_run::count(in.extent.x));
    const std::uint64_t num =
        runs_x * static_cast<std::uint64_t>(in.extent.y) * static_cast<std::uint64_t>(in.extent.z);
    const std::uint64_t warps = std::uint64_t{gridDim.x} * blockDim.x / 32;
    sample_totals totals;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x / 32 + warp_in_block(); i < num; i += warps) {
        const int first = static_cast<int>(i % runs_x),
                  y = static_cast<int>(i / runs_x % static_cast<std::uint64_t>(in.extent.y)),
                  z = static_cast<int>(i / runs_x / static_cast<std::uint64_t>(in.extent.y));
        const sample_run run = sample_run::of(in, found, first, y, z);
        for (int part = 0; part < sample_run::samples / 32; ++part) {
            const int x0 = first * sample_run::samples + 32 * part, x = x0 + lane;
            if (x0 >= in.extent.x) break;
            const std::uint64_t slot = run.slot_of(part);
            const bool is_valid = x < in.extent.x;
            const word row = inside.row(x0, y, z);
            auto a = fold::begin(fb, is_valid, x, y, z);
            bool has_any = false;
            if (is_valid) {
                std::uint32_t primitive = no_primitive;
                float length = in.band;
                if (slot != found_samples::nowhere) {
                    const std::uint64_t from = found_samples::place(slot, x, y, z);
                    primitive = found.primitives[from];
                    length = found.distances[from];
                }
                const auto out = shade_sample(in, s, {x, y, z}, primitive, length, (row >> lane & 1u) != 0);
                has_any = out.keep;
                ++(out.keep ? totals.fragments : totals.discarded);
                totals.in_band += static_cast<unsigned>(primitive != no_primitive);
                if (out.keep) fold::apply(a, out.values);
            }
            __syncwarp();
            if (__any_sync(0xffffffffu, static_cast<int>(has_any)) != 0) fold::store(fb, a, has_any, x0, y, z);
        }
    }
    totals.add_up(count_voxels, state);
}

// Stores the distances of the ready shader into one target of floats that are replaced, aligned to 16 bytes: a lane
// writes four samples, so that memory is what limits a large grid.
template <int = 0>
__global__ __launch_bounds__(threads_per_block) void store_field_kernel(const __grid_constant__ distance_input in,
                                                                        const __grid_constant__ found_samples found,
                                                                        const __grid_constant__ inside_rows inside,
                                                                        float* to, bool count_voxels,
                                                                        pipeline_state* state, capacities limits) {
    if (has_failed(*state, limits)) return;
    constexpr int each = 4, step = 32 * each, bricks = step / distance_brick;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const auto runs_x = static_cast<std::uint64_t>(sample_run::count(in.extent.x)),
               ny = static_cast<std::uint64_t>(in.extent.y);
    const std::uint64_t num = runs_x * ny * static_cast<std::uint64_t>(in.extent.z),
                        warps = std::uint64_t{gridDim.x} * blockDim.x / 32;
    sample_totals totals;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x / 32 + warp_in_block(); i < num; i += warps) {
        const std::uint64_t row = i / runs_x;
        const int first = static_cast<int>(i % runs_x) * sample_run::samples, y = static_cast<int>(row % ny),
                  z = static_cast<int>(row / ny);
        const sample_run run = sample_run::of(in, found, first / sample_run::samples, y, z);
        for (int part = 0; part < sample_run::samples / step; ++part) {
            const int x = first + part * step + each * lane;
            const std::uint64_t slot = __shfl_sync(0xffffffffu, run.slot, part * bricks + each * lane / distance_brick);
            if (x >= in.extent.x) continue;
            float4 length{in.band, in.band, in.band, in.band};
            if (slot != found_samples::nowhere) {
                const std::uint64_t from = found_samples::place(slot, x, y, z);
                length = *reinterpret_cast<const float4*>(found.distances + from);
                const uint4 nearest = *reinterpret_cast<const uint4*>(found.primitives + from);
                totals.in_band += static_cast<unsigned>(nearest.x != no_primitive) +
                                  static_cast<unsigned>(nearest.y != no_primitive) +
                                  static_cast<unsigned>(nearest.z != no_primitive) +
                                  static_cast<unsigned>(nearest.w != no_primitive);
            }
            const word inner = inside.row(x, y, z) >> x % 32;
            const auto value = [&](float distance, int k) VOXELPIPE_INLINE_LAMBDA {
                return (inner >> k & 1u) != 0 && distance > 0.0f ? -distance : distance;
            };
            totals.fragments += each;
            *reinterpret_cast<float4*>(to + row * static_cast<std::uint64_t>(in.extent.x) + x) = {
                value(length.x, 0), value(length.y, 1), value(length.z, 2), value(length.w, 3)};
        }
    }
    totals.add_up(count_voxels, state);
}

template <class Shading, class Framebuffer>
void shade_samples(const distance_input& in, const Shading& s, const found_samples& found, const inside_rows& inside,
                   const Framebuffer& fb, bool count_voxels, pipeline_state* state, const capacities& limits,
                   cudaStream_t stream) {
    const std::uint64_t runs = static_cast<std::uint64_t>(sample_run::count(in.extent.x)) *
                               static_cast<std::uint64_t>(in.extent.y) * static_cast<std::uint64_t>(in.extent.z);
    using field = framebuffer_view<target<float, blend::replace>>;
    if constexpr (std::is_same_v<typename Shading::shader_type, distance> && std::is_same_v<Framebuffer, field>) {
        const auto& t = voxelpipe::get<0>(fb.targets);
        if (t.load != load_operation::off && in.extent.x % 4 == 0 &&
            reinterpret_cast<std::uintptr_t>(t.elements) % sizeof(float4) == 0) {
            store_field_kernel<0><<<fill_device(runs * 32), threads_per_block, 0, stream>>>(
                in, found, inside, t.elements, count_voxels, state, limits);
            check(cudaGetLastError(), stage::tile_resolve);
            return;
        }
    }
    shade_samples_kernel<Shading, Framebuffer><<<fill_device(runs * 32), threads_per_block, 0, stream>>>(
        in, s, found, inside, fb, count_voxels, state, limits);
    check(cudaGetLastError(), stage::tile_resolve);
}

} // namespace voxelpipe::device
