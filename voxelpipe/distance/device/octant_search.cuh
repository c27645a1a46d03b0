// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The nearest triangles of the 4^3 samples of an octant of a brick, two a lane of a warp. Triangles come 32 at a time.
// First each lane bounds the distance of its triangle from the octant's centre: the nearest one is the reference, and
// its distances from the octant's corner samples are bounds. A triangle can only be the nearest of a sample if some
// corner is no farther above a plane below which the triangle lies than it is from the reference: the height above a
// plane minus a distance from a triangle is concave, so it is least at a corner. Triangles that can are measured in
// float from all samples, and (sample, triangle) is queued where the distance may be the least so far. Of those that
// may still be the least when the queue is full, and at the end, the formula decides: a minimum, so no order shows.

#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/distance/device/distance_input.cuh>

#include <cstdint>
#include <limits>

namespace voxelpipe::device {

inline constexpr unsigned octant_queue = 256; // at least 128: a triangle adds up to 64, and 64 must be left

// Shared memory of a warp.
struct octant_memory {
    unsigned long long square[octant_samples]; // bits of the least double: the order of doubles that are not negative
    std::uint32_t primitive[octant_samples];   // the lowest that has it
    float bound[octant_samples];               // not less than the least square, in units
    float corner[8];                           // not less than the distance of the corner sample, in units; x fastest
    std::uint32_t triangle[octant_queue];
    float least[octant_queue]; // not more than the square
    std::uint8_t sample[octant_queue];
};

__device__ constexpr unsigned long long infinite_square = 0x7ff0000000000000ull;

// Result of a first look at a triangle, by one lane: bounds of the centre's distance, where the centre lies, and the
// vector to it from the closest point.
struct octant_look {
    float low, high, error, distance;
    frame_point at, from;
};
// The triangle nearest to a point so far, the lowest of equal ones, so that all threads know the same.
struct near_triangle {
    float distance; // not less than the point's
    std::uint32_t primitive;

    [[nodiscard]] __device__ static near_triangle none() {
        constexpr float infinity = std::numeric_limits<float>::infinity();
        return {infinity, no_primitive};
    }
    __device__ VOXELPIPE_INLINE void take(const near_triangle& other) {
        if (other.distance < distance || (other.distance == distance && other.primitive < primitive)) *this = other;
    }
    // The nearest of all lanes, in each of them.
    [[nodiscard]] __device__ VOXELPIPE_INLINE near_triangle of_warp() const {
        near_triangle r = *this;
        for (int step = 16; step > 0; step /= 2)
            r.take({__shfl_xor_sync(0xffffffffu, r.distance, step), __shfl_xor_sync(0xffffffffu, r.primitive, step)});
        return r;
    }
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
    static constexpr float infinity = std::numeric_limits<float>::infinity();

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
        if (f.is_wide != 0) return {-infinity, infinity, infinity, 0.0f, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
        octant_look r{};
        r.at = to_frame(f, in.units, centre[0], centre[1], centre[2]);
        r.from = from_closest(f, r.at);
        r.error = error_at(f, r.at, in.octant_radius);
        r.distance = sqrtf(r.from.x * r.from.x + r.from.y * r.from.y + r.from.z * r.from.z);
        r.low = r.distance - r.error;
        r.high = r.distance + r.error;
        return r;
    }
    // False if no sample has the triangle, which the lane has looked at, within the band and no farther than the
    // reference.
    [[nodiscard]] __device__ bool can_win(std::uint32_t primitive, const octant_look& own) const {
        if (own.low > limit + in.octant_radius) return false;
        if (!(own.distance > own.error)) return true; // no direction; or a wide triangle
        const frame_plane plane = make_plane(in.frames[primitive], in.units, own.at, own.from, own.distance);
        return is_below_corner(plane.height - own.error, plane.rise);
    }
    // True if some corner sample is no higher than its distance from the reference, and some no higher than the band.
    // height: of the centre; rise: by a step of one voxel.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_below_corner(float height, const float (&rise)[3]) const {
        const float x = 1.5f * rise[0], y = 1.5f * rise[1], z = 1.5f * rise[2];
        if (height - (magnitude(x) + magnitude(y) + magnitude(z)) > in.band_units) return false;
        bool is_below = false;
        for (int k = 0; k < 8; ++k)
            is_below |=
                height + ((k & 1) != 0 ? x : -x) + ((k & 2) != 0 ? y : -y) + ((k & 4) != 0 ? z : -z) <= m.corner[k];
        return is_below;
    }
    // reference: the same for all lanes of all warps of the octant. A sample's distance is at most the centre's plus
    // that between them. All lanes call it.
    __device__ void begin(const near_triangle& reference) {
        const unsigned lane = threadIdx.x % 32;
        if (lane < 8) m.corner[lane] = corner_bound(reference.primitive, lane);
        __syncwarp();
        const auto bound = [&](float radius) {
            const float most = reference.distance + radius;
            return (most < in.band_units ? most : in.band_units) * (1.0f + 0x1p-20f);
        };
        limit = bound(in.octant_radius);
        for (int which = 0; which < 2; ++which) {
            const float z = offset[2] + static_cast<float>(2 * which) * in.units.voxel[2];
            const float most = bound(sqrtf(offset[0] * offset[0] + offset[1] * offset[1] + z * z) * (1.0f + 0x1p-20f));
            best[which] = most * most * (1.0f + 0x1p-20f);
        }
        if (reference.primitive == no_primitive || in.frames[reference.primitive].is_wide != 0) return;
        const triangle_frame& f = in.frames[reference.primitive];
        const frame_point at = to_frame(f, in.units, centre[0], centre[1], centre[2]);
        const float slack = slack_of(error_at(f, at, in.octant_radius));
        const two_squares square = measure_samples(f, at);
        best[0] = square.first + slack < best[0] ? square.first + slack : best[0];
        best[1] = square.second + slack < best[1] ? square.second + slack : best[1];
    }
    // Measures the lanes' triangles from all samples. All lanes call it.
    __device__ void visit(bool has_one, std::uint32_t primitive) {
        octant_look own{infinity, infinity, 0.0f, 0.0f, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
        if (has_one) own = look(primitive);
        const float own_slack = slack_of(own.error);
        unsigned near = __ballot_sync(0xffffffffu, has_one && can_win(primitive, own));
        for (; near != 0; near &= near - 1) {
            const int from = __ffs(static_cast<int>(near)) - 1;
            const std::uint32_t t = __shfl_sync(0xffffffffu, primitive, from);
            const float slack = __shfl_sync(0xffffffffu, own_slack, from);
            frame_point p{__shfl_sync(0xffffffffu, own.at.x, from), __shfl_sync(0xffffffffu, own.at.y, from),
                          __shfl_sync(0xffffffffu, own.at.z, from)};
            const two_squares square = measure_samples(in.frames[t], p);
            // A bound only falls where the triangle is wanted.
            if (__any_sync(0xffffffffu,
                           static_cast<int>(square.first - slack <= best[0] || square.second - slack <= best[1])) == 0)
                continue;
            push(t, square.first, slack, 0);
            push(t, square.second, slack, 1);
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
    struct two_squares {
        float first, second;
    };
    // Squares of the distances of the lane's samples. at: the centre.
    [[nodiscard]] __device__ VOXELPIPE_INLINE two_squares measure_samples(const triangle_frame& f,
                                                                          const frame_point& at) const {
        frame_point p{at.x + (f.x_axis[0] * offset[0] + f.x_axis[1] * offset[1] + f.x_axis[2] * offset[2]),
                      at.y + (f.y_axis[0] * offset[0] + f.y_axis[1] * offset[1] + f.y_axis[2] * offset[2]),
                      at.z + (f.z_axis[0] * offset[0] + f.z_axis[1] * offset[1] + f.z_axis[2] * offset[2])};
        const float first_square = measure(f, p), up = 2.0f * in.units.voxel[2];
        p.x += f.x_axis[2] * up;
        p.y += f.y_axis[2] * up;
        p.z += f.z_axis[2] * up;
        return {first_square, measure(f, p)};
    }
    // S of the error E: (d + E)^2 is at most d^2 + S for d up to the limit, and (d - E)^2 at least d^2 - S.
    [[nodiscard]] __device__ VOXELPIPE_INLINE float slack_of(float error) const {
        return error * (2.0f * limit + error) * (1.0f + 0x1p-20f);
    }
    // Not less than the distance of corner sample k, x fastest, from the triangle.
    [[nodiscard]] __device__ float corner_bound(std::uint32_t primitive, unsigned k) const {
        if (primitive == no_primitive || in.frames[primitive].is_wide != 0) return infinity;
        const triangle_frame& f = in.frames[primitive];
        frame_point p = to_frame(f, in.units, centre[0], centre[1], centre[2]);
        const float error = error_at(f, p, in.octant_radius);
        for (unsigned a = 0; a < 3; ++a) {
            const float step = ((k >> a & 1) != 0 ? 1.5f : -1.5f) * in.units.voxel[a];
            p.x += f.x_axis[a] * step;
            p.y += f.y_axis[a] * step;
            p.z += f.z_axis[a] * step;
        }
        return sqrtf(measure(f, p)) + error;
    }
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

} // namespace voxelpipe::device
