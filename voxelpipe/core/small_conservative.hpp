// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a small triangle (small_triangle.hpp), as rows of bits along x.

#include <voxelpipe/core/small_triangle.hpp>

#include <cstdint>

namespace voxelpipe::core {

// The plane of a small triangle, clipping rows of voxels in floats. With S = |n.x| + |n.y| + |n.z|, voxels that meet
// the plane are within S / 2 of `middle`. Up to 32 voxels from the corner every term of a sum, with five roundings,
// stays below 66 S: the error is less than 2^-15.3 S, and the tests leave a margin of 2^-15 S on both sides.
struct near_plane {
    float n[3], middle;  // along x from x0 on; negated if rows are to be clipped and n[0] < 0
    float half, inverse; // S / 2; 1 / (64 n[0])

    near_plane() = default;
    VOXELPIPE_HD VOXELPIPE_INLINE near_plane(const std::int64_t (&normal)[3], std::int64_t below, std::int64_t above,
                                             int x0, bool clips)
        : n{static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])},
          middle(exact::fma(-n[0], static_cast<float>(x0), exact::mul(0.5f, static_cast<float>(above - below)))),
          half(exact::mul(0.5f, static_cast<float>(above + below))), inverse(0) {
        if (clips && normal[0] < 0) {
            for (float& k : n) k = -k;
            middle = -middle;
        }
        inverse = exact::near_inverse(exact::mul(64.0f, n[0]));
    }
    // True if the voxels `from` and `to` of a row, counted from x0, and so all between them, certainly meet the plane.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets(int from, int to, int y, int z) const {
        const float row = row_at(y, z), in = exact::mul(half, 1.0f - 0x1p-14f);
        const float a = exact::fma(n[0], small_to_float(from), row), b = exact::fma(n[0], small_to_float(to), row);
        return a < in && -a < in && b < in && -b < in;
    }
    // The voxels from..to of a row, counted from x0, that meet the plane; `sure` is false if rounding may matter. The
    // plane leaves an interval along x, whose ends are rounded inwards and then tested: the first voxel inside must be
    // certainly in, and the one before it certainly out.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t clip(int from_x, int to_x, int y, int z,
                                                                   bool& sure) const {
        const float row = row_at(y, z);
        const auto from = static_cast<float>(from_x), to = static_cast<float>(to_x);
        const float in = exact::mul(half, 1.0f - 0x1p-14f), out = exact::mul(half, 1.0f + 0x1p-14f);
        const float enters = exact::fma_saturated(-exact::add(half, row), inverse, 0.25f),
                    leaves = exact::fma_saturated(exact::sub(half, row), inverse, 0.25f); // (x + 16) / 64
        const float k = exact::min(exact::max(exact::fma_up(enters, 64.0f, -16.0f), from), exact::add(to, 1.0f)),
                    l = exact::max(exact::min(exact::fma_down(leaves, 64.0f, -16.0f), to), exact::sub(from, 1.0f));
        const float at_k = exact::fma(n[0], k, row), at_l = exact::fma(n[0], l, row);
        const bool begins = (k == from) | (exact::sub(at_k, n[0]) < -out),
                   ends = (l == to) | (exact::add(at_l, n[0]) > out);
        const bool is_in = (k > to) | (at_k > -in), stays_in = (l < from) | (at_l < in);
        sure = begins & ends & is_in & stays_in;
        const std::uint32_t bits = ((2u << (exact::to_integer(l) & 31)) - 1) & (~0u << (exact::to_integer(k) & 31));
        return k > l ? 0 : bits;
    }

private:
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float row_at(int y, int z) const {
        return exact::fma(n[1], small_to_float(y), exact::fma(n[2], small_to_float(z), -middle));
    }
};

struct small_conservative {
    small_half_plane xy[3], yz[3], zx[3];
    std::int64_t n[3]; // normal
    // A voxel with lowest corner c meets the plane iff n . c + below >= 0 and above - n . c >= 0.
    std::int64_t below, above;

    small_conservative() = default; // brick_triangle sets the members
    VOXELPIPE_HD VOXELPIPE_INLINE small_conservative(const small_triangle& t, int fraction) {
        const triple<std::int64_t> normal = small_normal(t);
        small_projection<0, 1>(t, normal[2] < 0, fraction, xy);
        small_projection<1, 2>(t, normal[0] < 0, fraction, yz);
        small_projection<2, 0>(t, normal[1] < 0, fraction, zx);
        std::int64_t at_plane = 0, positive = 0, negative = 0;
        for (int i = 0; i < 3; ++i) {
            n[i] = normal[i];
            at_plane += n[i] * t.p[0][i];
            positive += positive_part(n[i]);
            negative += negative_part(n[i]);
        }
        below = positive - exact::ceil_shift(at_plane, fraction);
        above = exact::floor_shift(at_plane, fraction) - negative;
    }

    // The covered voxels (x0 .. x1, y, z), bit 0 for x0; at most 32.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t row(int x0, int x1, int y, int z) const {
        if ((yz[0].at(y, z) | yz[1].at(y, z) | yz[2].at(y, z)) < 0) return 0;
        std::int32_t e[6];
        for (int i = 0; i < 3; ++i) {
            e[i] = xy[i].at(x0, y);
            e[3 + i] = zx[i].at(z, x0);
        }
        const std::int64_t depth = n[0] * x0 + n[1] * y + n[2] * z;
        std::int64_t lower = depth + below, upper = above - depth;
        std::uint32_t bits = 0;
        for (int x = 0; x <= x1 - x0; ++x) {
            const std::int32_t outside =
                e[0] | e[1] | e[2] | e[3] | e[4] | e[5] | static_cast<std::int32_t>((lower | upper) >> 32); // signs
            bits |= (static_cast<std::uint32_t>(~outside) >> 31) << x;
            for (int i = 0; i < 3; ++i) {
                e[i] += xy[i].a;
                e[3 + i] += zx[i].b;
            }
            lower += n[0];
            upper -= n[0];
        }
        return bits;
    }

    // Parts of a row's coverage, which is the conjunction of all: voxels x0 .. x1 within the xy projection at y, those
    // within the zx projection at z, whether the row (y, z) is within the yz projection, and the voxels of `limit` that
    // meet the plane.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limit_at_y(int x0, int x1, int y) const {
        return line(xy[0].at(x0, y), xy[1].at(x0, y), xy[2].at(x0, y), xy[0].a, xy[1].a, xy[2].a, x1 - x0);
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limit_at_z(int x0, int x1, int z) const {
        return line(zx[0].at(z, x0), zx[1].at(z, x0), zx[2].at(z, x0), zx[0].b, zx[1].b, zx[2].b, x1 - x0);
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets_row(int y, int z) const {
        return (yz[0].at(y, z) | yz[1].at(y, z) | yz[2].at(y, z)) >= 0;
    }
    // `limit` is one run of bits, as projections give, and the result is one too: usually only its ends are tested.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t plane_bits(int x0, int y, int z,
                                                                         std::uint32_t limit) const {
        if (limit == 0) return 0;
        int first = exact::lowest_one(limit), last = exact::bit_width(std::uint64_t{limit}) - 1;
        const std::int64_t depth = times(n[0], x0 + first) + times(n[1], y) + times(n[2], z);
        std::int64_t lower = depth + below, upper = above - depth;
        const std::int64_t across = times(n[0], last - first);
        for (std::int64_t a = lower + across, b = upper - across; (a | b) < 0 && last >= first; --last) {
            a -= n[0];
            b += n[0];
        }
        for (; (lower | upper) < 0 && first <= last; ++first) {
            lower += n[0];
            upper -= n[0];
        }
        return first <= last ? ((2u << last) - 1) & ~((1u << first) - 1) : 0;
    }

    // Calls emit(y, z, bits) for the rows of a box of at most 8 voxels along x in which two projections and the plane
    // leave something; bit 0 is box.lo[0]. Coverage by the xy and the zx projection depends on y or on z alone, so it
    // is computed once instead of once per row, and the yz projection selects rows: threads with a triangle each visit
    // as many rows as they emit, not their whole boxes. Takes 8 x 8 rows of 8 bits at a time. Clips: see plane_bits.
    template <bool Clips, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void rows(const small_box& box, Emit&& emit) const {
        if (box.hi[0] < box.lo[0]) return;
        row_walk_8 r(*this, box, Clips);
        for (int y0 = box.lo[1]; y0 <= box.hi[1]; y0 += 8) {
            r.find_y(*this, y0, box.hi[1]);
            for (int z0 = box.lo[2]; z0 <= box.hi[2]; z0 += 8)
                for (r.find_z(*this, z0, box.hi[2]); !r.is_done();) r.template next<Clips>(*this, emit);
        }
    }
    // The same, row by row, for a box of at most 8 voxels a side.
    class row_walk_8 {
    public:
        VOXELPIPE_HD VOXELPIPE_INLINE static row_walk_8 of(const small_conservative& s, const small_box& box,
                                                           bool clips) {
            row_walk_8 r(s, box, clips);
            if (box.empty()) return r;
            r.find_y(s, box.lo[1], box.hi[1]);
            r.find_z(s, box.lo[2], box.hi[2]);
            return r;
        }
        [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_done() const { return met_ == 0; }
        // Emits the next row, unless it is empty.
        template <bool Clips, class Emit>
        VOXELPIPE_HD VOXELPIPE_INLINE void next(const small_conservative& s, Emit&& emit) {
            const int at = exact::lowest_one(met_), y = at % 8, z = at / 8;
            met_ &= met_ - 1;
            const std::uint32_t limit =
                static_cast<std::uint32_t>(by_y_ >> 8 * y) & static_cast<std::uint32_t>(by_z_ >> 8 * z) & along_;
            if (limit != 0) emit(y0_ + y, z0_ + z, s.plane_bits<Clips>(plane_, x0_, y0_ + y, z0_ + z, limit));
        }

    private:
        friend small_conservative;
        near_plane plane_;
        int x0_, y0_ = 0, z0_ = 0;
        std::uint32_t along_, across_ = 0;
        std::uint64_t by_y_ = 0, by_z_ = 0, met_ = 0; // rows, bit y + 8 z

        VOXELPIPE_HD VOXELPIPE_INLINE row_walk_8(const small_conservative& s, const small_box& box, bool clips)
            : plane_(s.n, s.below, s.above, box.lo[0], clips), x0_(box.lo[0]),
              along_(box.hi[0] < box.lo[0] ? 0 : (2u << (box.hi[0] - box.lo[0])) - 1) {}
        VOXELPIPE_HD VOXELPIPE_INLINE void find_y(const small_conservative& s, int y0, int last) {
            const int y1 = last < y0 + 7 ? last : y0 + 7;
            y0_ = y0;
            across_ = (2u << (y1 - y0)) - 1;
            by_y_ = 0;
            for (int y = y1; y >= y0; --y) by_y_ = by_y_ << 8 | (along_ & s.limits_at_y<8>(x0_ + 7, y));
        }
        VOXELPIPE_HD VOXELPIPE_INLINE void find_z(const small_conservative& s, int z0, int last) {
            const int z1 = last < z0 + 7 ? last : z0 + 7;
            z0_ = z0;
            by_z_ = met_ = 0;
            for (int z = z1; z >= z0; --z) {
                by_z_ = by_z_ << 8 | (along_ & s.limits_at_z<8>(x0_ + 7, z));
                met_ = met_ << 8 | (across_ & s.rows_at_z<8>(y0_ + 7, z));
            }
        }
    };

    // Emits the rows of a box of at most 16 voxels a side, found all at once. `limits` holds 16 words: get(i), set(i,
    // word).
    template <bool Clips, class Limits, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void rows_of_16(const small_box& box, Limits&& limits, Emit&& emit) const {
        if (box.empty()) return;
        row_walk_16 r(*this, box, Clips, limits);
        for (;;) {
            if (r.is_here())
                r.template next<Clips>(*this, limits, emit);
            else if (!r.advance())
                break;
        }
    }
    // The same, row by row.
    class row_walk_16 {
    public:
        template <class Limits>
        VOXELPIPE_HD VOXELPIPE_INLINE row_walk_16(const small_conservative& s, const small_box& box, bool clips,
                                                  Limits&& limits)
            : plane_(s.n, s.below, s.above, box.lo[0], clips), x0_(box.lo[0]), y0_(box.lo[1]), z0_(box.lo[2]) {
            if (box.empty()) return;
            const int last_x = box.hi[0] - x0_, last_y = box.hi[1] - y0_, last_z = box.hi[2] - z0_;
            {
                small_row_ends by_y(s.xy, false, x0_, y0_, 1);
                for (int y = 0; y <= last_y; ++y) limits.set(y, by_y.next(last_x));
            }
            {
                small_row_ends by_z(s.zx, true, x0_, z0_, 1);
                for (int z = 0; z <= last_z; ++z)
                    limits.set(z, (z <= last_y ? limits.get(z) : 0) | by_z.next(last_x) << 16);
            }
            {
                small_row_ends by_z(s.yz, false, y0_, z0_ + last_z, -1);
                for (int z = last_z; z >= 0; --z) {
                    for (int k = 3; k > 0; --k) met_[k] = met_[k] << 16 | met_[k - 1] >> 48;
                    met_[0] = met_[0] << 16 | by_z.next(last_y);
                }
            }
        }
        // True if the current four z have a row left.
        [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_here() const { return met_[0] != 0; }
        // Advances to the next four z; false if no row is left.
        VOXELPIPE_HD VOXELPIPE_INLINE bool advance() {
            if ((met_[1] | met_[2] | met_[3]) == 0) return false;
            for (int k = 1; k < 4; ++k) met_[k - 1] = met_[k];
            met_[3] = 0;
            first_z_ += 4;
            return true;
        }
        // Advances to the next row; true after the last one.
        [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_done() {
            while (!is_here())
                if (!advance()) return true;
            return false;
        }
        // Emits the next row, as row_walk_8 does, if is_here().
        template <bool Clips, class Limits, class Emit>
        VOXELPIPE_HD VOXELPIPE_INLINE void next(const small_conservative& s, Limits&& limits, Emit&& emit) {
            const int at = exact::lowest_one(met_[0]), y = at % 16, z = first_z_ + at / 16;
            met_[0] &= met_[0] - 1;
            const std::uint32_t limit = limits.get(y) & limits.get(z) >> 16;
            if (limit != 0) emit(y0_ + y, z0_ + z, s.plane_bits<Clips>(plane_, x0_, y0_ + y, z0_ + z, limit));
        }

    private:
        near_plane plane_;
        int x0_, y0_, z0_, first_z_ = 0;
        std::uint64_t met_[4] = {}; // rows, bit y + 16 z, from first_z on
    };

    // Emits the rows of a box of up to 32 voxels a side.
    template <class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void long_rows(const small_box& box, Emit&& emit) const {
        const int x0 = box.lo[0], x1 = box.hi[0];
        for (int y = box.lo[1]; y <= box.hi[1]; ++y) {
            const std::uint32_t at_y = limit_at_y(x0, x1, y);
            if (at_y == 0) continue;
            for (int z = box.lo[2]; z <= box.hi[2]; ++z) {
                if (!meets_row(y, z)) continue;
                const std::uint32_t limit = at_y & limit_at_z(x0, x1, z);
                if (limit != 0) emit(y, z, plane_bits(x0, y, z, limit));
            }
        }
    }

    // plane_bits by floats, if they are sure. Clips: they clip; otherwise they only test whether the plane leaves
    // everything, which takes fewer registers.
    template <bool Clips>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t plane_bits(const near_plane& plane, int x0, int y, int z,
                                                                         std::uint32_t limit) const {
        const int first = exact::lowest_one(limit), last = exact::highest_one(limit);
        bool sure = false;
        std::uint32_t bits = limit;
        if constexpr (Clips)
            bits = plane.clip(first, last, y, z, sure);
        else
            sure = plane.meets(first, last, y, z);
        return sure ? bits : plane_bits(x0, y, z, limit);
    }
    // Coverage by one projection: xy for the voxels x - Length + 1 to x at y; zx for these at z; yz for the rows y -
    // Length + 1 to y at z.
    template <int Length>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limits_at_y(int x, int y) const {
        return small_line<Length>(xy[0].at(x, y), xy[1].at(x, y), xy[2].at(x, y), xy[0].a, xy[1].a, xy[2].a);
    }
    template <int Length>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limits_at_z(int x, int z) const {
        return small_line<Length>(zx[0].at(z, x), zx[1].at(z, x), zx[2].at(z, x), zx[0].b, zx[1].b, zx[2].b);
    }
    template <int Length>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t rows_at_z(int y, int z) const {
        return small_line<Length>(yz[0].at(y, z), yz[1].at(y, z), yz[2].at(y, z), yz[0].a, yz[1].a, yz[2].a);
    }

private:
    // Bit x is set if three values, stepped x times, are all >= 0; x = 0 .. last.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE static std::uint32_t line(std::int32_t e0, std::int32_t e1,
                                                                          std::int32_t e2, std::int32_t s0,
                                                                          std::int32_t s1, std::int32_t s2, int last) {
        std::uint32_t bits = 0;
        for (int x = 0; x <= last; ++x) {
            bits |= (static_cast<std::uint32_t>(~(e0 | e1 | e2)) >> 31) << x;
            e0 += s0;
            e1 += s1;
            e2 += s2;
        }
        return bits;
    }
};

} // namespace voxelpipe::core
