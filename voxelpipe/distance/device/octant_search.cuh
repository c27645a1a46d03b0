// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The nearest triangles of the 4^3 samples of an octant of a brick, two a lane of a warp. Triangles come 32 at a time.
// First each lane bounds the distance of its triangle from the octant's centre: the least bound says how far any
// triangle of a sample may be. Then the triangles that are near enough are measured in float from all samples, and
// (sample, triangle) is queued where the distance may be the least so far. Of those that may still be the least when
// the queue is full, and at the end, the formula decides: a minimum, so no order shows.

#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/distance/device/distance_input.cuh>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr unsigned octant_queue = 256; // at least 128: a triangle adds up to 64, and 64 must be left
inline constexpr int octant_side = 4;
inline constexpr unsigned octant_samples = 64;

// Shared memory of a warp.
struct octant_memory {
    unsigned long long square[octant_samples]; // bits of the least double: the order of doubles that are not negative
    std::uint32_t primitive[octant_samples];   // the lowest that has it
    float bound[octant_samples];               // not less than the least square, in units
    std::uint32_t triangle[octant_queue];
    float least[octant_queue]; // not more than the square
    std::uint8_t sample[octant_queue];
};

__device__ constexpr unsigned long long infinite_square = 0x7ff0000000000000ull;

// Result of a first look at a triangle, by one lane: bounds of the centre's distance, and where the centre lies.
struct octant_look {
    float low, high, error;
    frame_point at;
};

struct octant_search {
    const distance_input& in;
    octant_memory& m;
    glm::ivec3 first;       // lowest sample
    std::int32_t centre[3]; // snapped
    float offset[3];        // of the lane's first sample from the centre; the second one is two samples above
    float limit;            // Distances beyond it do not matter.
    float best[2];          // bounds of the squares of the lane's samples
    unsigned queued;
    static constexpr float infinity = __builtin_inff();

    __device__ octant_search(const distance_input& in_, octant_memory& m_, const glm::ivec3& first_)
        : in(in_), m(m_), first(first_), queued(0) {
        const unsigned lane = threadIdx.x % 32;
        const int place[3] = {static_cast<int>(lane & 3), static_cast<int>(lane >> 2 & 3), static_cast<int>(lane >> 4)};
        for (int k = 0; k < 3; ++k) {
            centre[k] = (first[k] + octant_side / 2) << in.geo.snap.fraction;
            offset[k] = (static_cast<float>(place[k]) - 1.5f) * in.units.voxel[k];
        }
        for (unsigned i = lane; i < octant_samples; i += 32) {
            m.square[i] = infinite_square;
            m.primitive[i] = no_primitive;
        }
        __syncwarp();
    }

    // The lane's triangle.
    [[nodiscard]] __device__ octant_look look(std::uint32_t primitive) const {
        const triangle_frame& f = in.frames[primitive];
        if (f.is_wide != 0) return {-infinity, infinity, infinity, {0.0f, 0.0f, 0.0f}};
        octant_look r{};
        r.at = to_frame(f, in.units, centre[0], centre[1], centre[2]);
        r.error = error_at(f, r.at, in.octant_radius);
        const float distance = sqrtf(measure(f, r.at));
        r.low = distance - r.error;
        r.high = distance + r.error;
        return r;
    }
    // nearest: an upper bound of the centre's distance, the same for all lanes of all warps of the octant.
    __device__ void begin(float nearest) {
        const float most = nearest + in.octant_radius;
        limit = (most < in.band_units ? most : in.band_units) * (1.0f + 0x1p-20f);
        best[0] = best[1] = limit * limit * (1.0f + 0x1p-20f);
    }
    // Measures the lanes' triangles from all samples. All lanes call it.
    __device__ void visit(bool has_one, std::uint32_t primitive) {
        octant_look own{infinity, infinity, 0.0f, {0.0f, 0.0f, 0.0f}};
        if (has_one) own = look(primitive);
        // (d + E)^2 is at most d^2 + S for d up to the limit, and (d - E)^2 at least d^2 - S.
        const float own_slack = own.error * (2.0f * limit + own.error) * (1.0f + 0x1p-20f);
        unsigned near = __ballot_sync(0xffffffffu, has_one && own.low <= limit + in.octant_radius);
        for (; near != 0; near &= near - 1) {
            const int from = __ffs(static_cast<int>(near)) - 1;
            const std::uint32_t t = __shfl_sync(0xffffffffu, primitive, from);
            const float slack = __shfl_sync(0xffffffffu, own_slack, from);
            frame_point p{__shfl_sync(0xffffffffu, own.at.x, from), __shfl_sync(0xffffffffu, own.at.y, from),
                          __shfl_sync(0xffffffffu, own.at.z, from)};
            const triangle_frame& f = in.frames[t];
            p.x += f.x_axis[0] * offset[0] + f.x_axis[1] * offset[1] + f.x_axis[2] * offset[2];
            p.y += f.y_axis[0] * offset[0] + f.y_axis[1] * offset[1] + f.y_axis[2] * offset[2];
            p.z += f.z_axis[0] * offset[0] + f.z_axis[1] * offset[1] + f.z_axis[2] * offset[2];
            const float up = 2.0f * in.units.voxel[2];
            push(t, measure(f, p), slack, 0);
            p.x += f.x_axis[2] * up;
            p.y += f.y_axis[2] * up;
            p.z += f.z_axis[2] * up;
            push(t, measure(f, p), slack, 1);
            if (queued > octant_queue - 64) decide();
        }
    }
    // Empties the queue. All lanes call it.
    __device__ void decide() {
        const unsigned lane = threadIdx.x % 32;
        m.bound[lane] = best[0];
        m.bound[lane + 32] = best[1];
        __syncwarp();
        unsigned kept = 0;
        for (unsigned i = lane; i - lane < queued; i += 32) {
            const bool has_one = i < queued;
            const std::uint32_t t = has_one ? m.triangle[i] : 0;
            const std::uint8_t s = has_one ? m.sample[i] : std::uint8_t{0};
            const bool stays = has_one && m.least[i] <= m.bound[s];
            const unsigned all = __ballot_sync(0xffffffffu, stays);
            const unsigned to = kept + static_cast<unsigned>(__popc(all & ((1u << lane) - 1)));
            __syncwarp();
            if (stays) {
                m.triangle[to] = t;
                m.sample[to] = s;
            }
            kept += static_cast<unsigned>(__popc(all));
            __syncwarp();
        }
        for (unsigned i = lane; i - lane < kept; i += 32) {
            const bool has_one = i < kept;
            const std::uint32_t t = has_one ? m.triangle[i] : 0;
            const unsigned s = has_one ? m.sample[i] : 0;
            unsigned long long square = infinite_square;
            if (has_one) square = core::bit_cast<unsigned long long>(find_square(in, t, in.position(sample(s)), true));
            take(has_one, s, square, t);
        }
        queued = 0;
        __syncwarp();
    }
    // Takes what a lane has found into the least of a sample. All lanes call it.
    __device__ void take(bool has_one, unsigned s, unsigned long long square, std::uint32_t primitive) {
        const unsigned long long before = m.square[s];
        __syncwarp();
        if (has_one && square < before) atomicMin(&m.square[s], square);
        __syncwarp();
        const unsigned long long now = m.square[s];
        if (has_one && now < before) m.primitive[s] = no_primitive;
        __syncwarp();
        if (has_one && square == now) atomicMin(&m.primitive[s], primitive);
        __syncwarp();
    }
    [[nodiscard]] __device__ glm::ivec3 sample(unsigned s) const {
        return first + glm::ivec3(static_cast<int>(s & 3), static_cast<int>(s >> 2 & 3), static_cast<int>(s >> 4));
    }

private:
    __device__ VOXELPIPE_INLINE void push(std::uint32_t t, float square, float slack, int which) {
        const unsigned lane = threadIdx.x % 32;
        const float least = square - slack, most = square + slack;
        const bool wanted = least <= best[which];
        best[which] = most < best[which] ? most : best[which];
        const unsigned all = __ballot_sync(0xffffffffu, wanted);
        if (wanted) {
            const unsigned to = queued + static_cast<unsigned>(__popc(all & ((1u << lane) - 1)));
            m.triangle[to] = t;
            m.least[to] = least;
            m.sample[to] = static_cast<std::uint8_t>(lane + 32 * static_cast<unsigned>(which));
        }
        queued += static_cast<unsigned>(__popc(all));
    }
};

[[nodiscard]] __device__ VOXELPIPE_INLINE float least_of_warp(float value) {
    for (int step = 16; step > 0; step /= 2) {
        const float other = __shfl_xor_sync(0xffffffffu, value, step);
        value = other < value ? other : value;
    }
    return value;
}

} // namespace voxelpipe::device
