// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Decides the samples of a body by their generalized winding numbers, where these may differ from the winding numbers
// of rows (solid/core/winding_bricks.hpp). A thread takes a box of bricks, then a smaller box of those that are left,
// then a brick of those; a warp takes the samples of a brick that its verdict does not decide as a whole; and a thread
// takes one of the few samples that are left.

#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/solid/core/winding_bricks.hpp>
#include <voxelpipe/solid/device/bit_sweeps.cuh>
#include <voxelpipe/solid/device/solid_source.cuh>

#include <algorithm>
#include <cstdint>

namespace voxelpipe::device {

using core::winding_brick;

// A grid of boxes or bricks of samples, `side` along each axis, numbered along x, then y, then z.
struct winding_boxes {
    glm::ivec3 extent; // samples
    int side;

    [[nodiscard]] VOXELPIPE_HD std::uint64_t along(int samples) const {
        return static_cast<std::uint64_t>(samples + side - 1) / static_cast<std::uint64_t>(side);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t count() const {
        return along(extent.x) * along(extent.y) * along(extent.z);
    }
    // Index of the first sample.
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 first(std::uint64_t box) const {
        const std::uint64_t nx = along(extent.x), row = box / nx, ny = along(extent.y);
        return glm::ivec3(static_cast<int>(box - row * nx), static_cast<int>(row % ny), static_cast<int>(row / ny)) *
               side;
    }
    [[nodiscard]] VOXELPIPE_HD bool contains(const glm::ivec3& sample) const {
        return sample.x < extent.x && sample.y < extent.y && sample.z < extent.z;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t number(const glm::ivec3& sample) const {
        const auto at = [&](int s) { return static_cast<std::uint64_t>(s / side); };
        return (at(sample.z) * along(extent.y) + at(sample.y)) * along(extent.x) + at(sample.x);
    }
    [[nodiscard]] VOXELPIPE_HD core::winding_samples samples(const glm::ivec3& first, int fraction) const {
        return core::winding_samples::of_box({first.x, first.y, first.z}, side, {extent.x, extent.y, extent.z},
                                             fraction);
    }
};
// The half of a box that has this number: 0 to 7.
[[nodiscard]] VOXELPIPE_HD inline glm::ivec3 octant(std::uint64_t number, int side) {
    return {static_cast<int>(number & 1) * side, static_cast<int>(number >> 1 & 1) * side,
            static_cast<int>(number >> 2 & 1) * side};
}
static_assert(core::large_winding_box == 2 * core::small_winding_box && core::small_winding_box == 2 * winding_brick);

// A brick whose samples are decided one by one.
struct winding_record {
    std::uint64_t brick;
    std::uint64_t first_near; // in the list of near holes
    core::winding_verdict known;
};
// How many of each are left; may exceed the room for them.
struct winding_counts {
    unsigned long long large_boxes, small_boxes, bricks, near_holes, samples;
};
struct winding_work {
    winding_counts* counts = nullptr;
    std::uint32_t *large_boxes = nullptr, *small_boxes = nullptr; // numbers; room for all
    winding_record* bricks = nullptr;
    std::uint32_t* near_holes = nullptr; // of each listed brick
    std::uint64_t* samples = nullptr;    // bits: x, y and z, 21 each, and whether bounds of areas may decide
    std::uint64_t room_bricks = 0, room_near_holes = 0, room_samples = 0;

    [[nodiscard]] static winding_work take(arena& memory, const glm::ivec3& extent) {
        const std::uint64_t bricks = winding_boxes{extent, winding_brick}.count();
        winding_work w;
        w.counts = memory.take<winding_counts>(1);
        w.large_boxes = memory.take<std::uint32_t>(winding_boxes{extent, core::large_winding_box}.count());
        w.small_boxes = memory.take<std::uint32_t>(winding_boxes{extent, core::small_winding_box}.count());
        const std::uint64_t few = std::min<std::uint64_t>(bricks, 4096);
        w.room_bricks = std::max(bricks / 4, few);
        w.room_near_holes = std::max(w.room_bricks * 64, few * core::near_holes::most);
        w.room_samples = bricks;
        w.bricks = memory.take<winding_record>(w.room_bricks);
        w.near_holes = memory.take<std::uint32_t>(w.room_near_holes);
        w.samples = memory.take<std::uint64_t>(w.room_samples);
        return w;
    }
};

// What is known of the samples of one body.
struct winding_input {
    const std::int32_t* windings;
    const std::int32_t* of_cones; // null: cones are the only lids of all holes, and do not count apart
    const word* on_cones;
    const std::uint32_t* marks;
    row_grid grid;
    fill_rule rule;

    [[nodiscard]] VOXELPIPE_HD core::winding_sample sample(const glm::ivec3& v, std::uint32_t mark) const {
        const std::uint64_t i = place(v);
        return {windings[i], of_cones == nullptr ? 0 : of_cones[i],
                (mark & core::has_samples_on_cones) != 0 && is_on_cone(v)};
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint64_t place(const glm::ivec3& v) const {
        return grid.row(v.y, v.z) * (static_cast<std::uint64_t>(grid.extent.x) + 1) + static_cast<std::uint64_t>(v.x);
    }
    [[nodiscard]] VOXELPIPE_HD bool is_on_cone(const glm::ivec3& v) const {
        return (on_cones[bit_box{grid.extent}.first_word(v.y, v.z) + static_cast<std::uint64_t>(v.x / 32)] >> v.x % 32 &
                1) != 0;
    }
};
// The byte of the bits that a brick's row is.
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t brick_byte(const row_grid& grid, int x0, int y, int z) {
    return bit_box{grid.extent}.first_word(y, z) * sizeof(word) + static_cast<std::uint64_t>(x0 / 8);
}

// Lists the large boxes that rows do not decide, or the small ones of those.
// `tree` is no __grid_constant__ here: nvcc 13.0 makes wrong code of references to it (scripts/check_ptx.py).
template <class State>
__global__ void list_large_boxes_kernel(const core::winding_view tree, const __grid_constant__ row_grid grid,
                                        const __grid_constant__ winding_work work, const State* state) {
    if (state->index_error != 0) return;
    const winding_boxes boxes{grid.extent, core::large_winding_box};
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < boxes.count();
         i += std::uint64_t{gridDim.x} * blockDim.x)
        if (!core::is_below_half(tree, boxes.samples(boxes.first(i), grid.fraction)))
            work.large_boxes[atomicAdd(&work.counts->large_boxes, 1ull)] = static_cast<std::uint32_t>(i);
}
template <class State>
__global__ void list_small_boxes_kernel(const core::winding_view tree, const __grid_constant__ row_grid grid,
                                        const __grid_constant__ winding_work work, const State*) {
    const winding_boxes large{grid.extent, core::large_winding_box}, small{grid.extent, core::small_winding_box};
    const std::uint64_t count = work.counts->large_boxes * 8;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        const glm::ivec3 first = large.first(work.large_boxes[i / 8]) + octant(i, core::small_winding_box);
        if (small.contains(first) && !core::is_below_half(tree, small.samples(first, grid.fraction)))
            work.small_boxes[atomicAdd(&work.counts->small_boxes, 1ull)] =
                static_cast<std::uint32_t>(small.number(first));
    }
}

// Judges the bricks of the small boxes that are left, and writes or lists those that differ from the rows.
template <class State>
__global__ __launch_bounds__(64) void judge_bricks_kernel(const core::winding_view tree,
                                                          const __grid_constant__ winding_input in,
                                                          const __grid_constant__ winding_work work,
                                                          std::uint8_t* inside, const State*) {
    const winding_boxes small{in.grid.extent, core::small_winding_box}, bricks{in.grid.extent, winding_brick};
    const std::uint64_t count = work.counts->small_boxes * 8;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        const glm::ivec3 first = small.first(work.small_boxes[i / 8]) + octant(i, winding_brick);
        if (!bricks.contains(first)) continue;
        const std::uint64_t brick = bricks.number(first);
        const std::uint32_t mark = in.marks[brick];
        const core::winding_samples samples = bricks.samples(first, in.grid.fraction);
        const core::winding_sample middle =
            in.sample(first + glm::ivec3(samples.middle(0), samples.middle(1), samples.middle(2)), mark);
        std::uint32_t near[core::near_holes::most];
        core::winding_verdict known = core::judge_brick(tree, samples, middle.k, middle.k_cones, mark, in.rule, near);
        if (known.kind == core::winding_verdict::beyond && known.whole == 0) continue; // as the bits are
        const bool is_whole =
            (known.kind == core::winding_verdict::outside || known.kind == core::winding_verdict::inside) &&
            (mark & core::has_samples_on_cones) == 0;
        const unsigned long long slot = is_whole ? work.room_bricks : atomicAdd(&work.counts->bricks, 1ull);
        if (slot < work.room_bricks) {
            unsigned long long to = 0;
            if (known.near.count <= core::near_holes::most && known.near.count != 0) {
                to = atomicAdd(&work.counts->near_holes, static_cast<unsigned long long>(known.near.count));
                if (to + known.near.count > work.room_near_holes)
                    known.near.count = core::near_holes::most + 1;
                else
                    for (std::uint32_t n = 0; n < known.near.count; ++n) work.near_holes[to + n] = near[n];
            }
            work.bricks[slot] = {brick, to, known};
            continue;
        }
        for (int z = 0; z < samples.count[2]; ++z)
            for (int y = 0; y < samples.count[1]; ++y) {
                unsigned bits = 0;
                for (int x = 0; x < samples.count[0]; ++x)
                    if (is_whole ? known.kind == core::winding_verdict::inside
                                 : core::judge_sample(tree, samples, known, near, x, y, z,
                                                      in.sample(first + glm::ivec3(x, y, z), mark), in.rule))
                        bits |= 1u << x;
                inside[brick_byte(in.grid, first.x, first.y + y, first.z + z)] = static_cast<std::uint8_t>(bits);
            }
    }
}

// Decides the samples of the listed bricks, and lists those that take long, which are outside until then. A warp takes
// a brick, whose rows are bytes of the bits.
template <class State>
__global__ __launch_bounds__(threads_per_block) void decide_bricks_kernel(const core::winding_view tree,
                                                                          const __grid_constant__ winding_input in,
                                                                          const __grid_constant__ winding_work work,
                                                                          std::uint8_t* inside, const State*) {
    const int lane = static_cast<int>(threadIdx.x % 32);
    const winding_boxes bricks{in.grid.extent, winding_brick};
    const std::uint64_t count = work.counts->bricks < work.room_bricks ? work.counts->bricks : work.room_bricks;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(); i < count;
         i += std::uint64_t{gridDim.x} * (threads_per_block / 32)) {
        const winding_record& record = work.bricks[i];
        const glm::ivec3 first = bricks.first(record.brick);
        const core::winding_samples samples = bricks.samples(first, in.grid.fraction);
        const std::uint32_t mark = in.marks[record.brick];
        const bool tries_bound = record.known.near.count > core::near_holes::most;
        for (int step = 0; step < 2 * winding_brick; ++step) {
            const int x = lane % 8, y = lane / 8 + 4 * (step % 2), z = step / 2;
            const bool exists = x < samples.count[0] && y < samples.count[1] && z < samples.count[2];
            int verdict = 0;
            if (exists) {
                const glm::ivec3 v = first + glm::ivec3(x, y, z);
                const core::winding_sample of = in.sample(v, mark);
                verdict = core::try_sample(tree, samples, record.known, work.near_holes + record.first_near, x, y, z,
                                           of, in.rule);
                if (verdict < 0) {
                    const unsigned long long slot = atomicAdd(&work.counts->samples, 1ull);
                    if (slot < work.room_samples)
                        work.samples[slot] = static_cast<std::uint64_t>(v.x) | static_cast<std::uint64_t>(v.y) << 21 |
                                             static_cast<std::uint64_t>(v.z) << 42 |
                                             std::uint64_t{tries_bound ? 1u : 0u} << 63;
                    else
                        verdict =
                            core::is_inside_by_winding(tree, samples.at(x, y, z), of, in.rule, tries_bound) ? 1 : 0;
                }
            }
            const word bits = __ballot_sync(0xffffffffu, static_cast<int>(verdict > 0));
            if (exists && lane % 8 == 0)
                inside[brick_byte(in.grid, first.x, first.y + y, first.z + z)] =
                    static_cast<std::uint8_t>(bits >> (lane / 8 * 8));
        }
    }
}

// Decides the listed samples. None of them lies on a cone.
template <class State>
__global__ __launch_bounds__(64) void decide_samples_kernel(const core::winding_view tree,
                                                            const __grid_constant__ winding_input in,
                                                            const __grid_constant__ winding_work work, word* inside,
                                                            const State*) {
    const winding_boxes single{in.grid.extent, 1};
    const std::uint64_t count = work.counts->samples < work.room_samples ? work.counts->samples : work.room_samples;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        const std::uint64_t of = work.samples[i];
        const auto part = [&](int k) { return static_cast<int>(of >> 21 * k & 0x1fffffu); };
        const glm::ivec3 v(part(0), part(1), part(2));
        const core::winding_samples sample = single.samples(v, in.grid.fraction);
        if (core::is_inside_by_winding(tree, sample.first, in.sample(v, 0), in.rule, of >> 63 != 0))
            atomicOr(inside + bit_box{in.grid.extent}.first_word(v.y, v.z) + v.x / 32, word{1} << v.x % 32);
    }
}

// Changes the bits of `inside` from the verdicts of rows to those of generalized winding numbers.
template <int = 0>
void decide_windings(const core::winding_view& tree, const winding_input& in, const winding_work& work, word* inside,
                     const pipeline_state* state, cudaStream_t stream) {
    constexpr unsigned threads = 64; // they take long, so that the device is filled by few
    const auto blocks = [](std::uint64_t items) {
        return static_cast<unsigned>(std::clamp<std::uint64_t>((items + threads - 1) / threads, 1, 1u << 14));
    };
    const auto checked = [] { check(cudaGetLastError(), stage::fine_raster); };
    auto* const bytes = reinterpret_cast<std::uint8_t*>(inside);
    check(cudaMemsetAsync(work.counts, 0, sizeof(winding_counts), stream), stage::fine_raster);
    const std::uint64_t large = winding_boxes{in.grid.extent, core::large_winding_box}.count();
    list_large_boxes_kernel<pipeline_state><<<blocks(large), threads, 0, stream>>>(tree, in.grid, work, state);
    checked();
    const std::uint64_t small = winding_boxes{in.grid.extent, core::small_winding_box}.count();
    list_small_boxes_kernel<pipeline_state><<<blocks(small), threads, 0, stream>>>(tree, in.grid, work, state);
    checked();
    judge_bricks_kernel<pipeline_state><<<blocks(small * 8), threads, 0, stream>>>(tree, in, work, bytes, state);
    checked();
    decide_bricks_kernel<pipeline_state>
        <<<fill_device(work.room_bricks * 32, 16), threads_per_block, 0, stream>>>(tree, in, work, bytes, state);
    checked();
    decide_samples_kernel<pipeline_state>
        <<<blocks(work.room_samples), threads, 0, stream>>>(tree, in, work, inside, state);
    checked();
}

} // namespace voxelpipe::device
