// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The terms of a row's voxels, their sums, and what a fragment has of them. A row is one of a body: rows by ascending
// y, then z, each with the bodies in order. In a row, slot 0 stands for all that lies before the grid, slot i + 1 for
// voxel i, and the last slot for all behind.

#include <voxelpipe/cells/passes/cell_source.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::core::passes {

struct cell_keys {
    std::uint64_t slots; // of a row: its voxels and two more
    std::uint64_t rows_y;
    std::uint64_t bodies; // 1, or the number of draws

    [[nodiscard]] VOXELPIPE_HD std::uint64_t key(std::uint64_t y, std::uint64_t z, std::uint64_t body,
                                                 std::uint64_t slot) const {
        return ((z * rows_y + y) * bodies + body) * slots + slot;
    }
};

// The sorted terms.
template <class Terms>
struct record_list {
    cell_keys keys_of;
    const std::uint64_t* keys;
    std::uint32_t* order; // of a voxel in any order, which its row may change
    const Terms* terms;
    std::uint64_t count;

    // The first term whose key is not less.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find(std::uint64_t key) const {
        std::uint64_t lo = 0, hi = count;
        while (lo < hi) {
            const std::uint64_t middle = lo + (hi - lo) / 2;
            if (keys[middle] < key)
                lo = middle + 1;
            else
                hi = middle;
        }
        return lo;
    }
};

// Sums of a voxel's terms, and of its row up to it, in two's complement: they may wrap on their way.
template <int>
struct no_sums {};
struct face_totals {
    std::uint64_t y, z; // moments of a face's part inside, about the face's centre
};
struct moment_totals {
    std::uint64_t x, y, z;
};
struct area_totals {
    int128 area, x, y, z;
};

// Goes along a row of a body, slot by slot.
template <class Terms>
struct cell_cursor {
    std::uint64_t at;       // the next term
    std::uint64_t next_key; // of the next slot
    std::int64_t aperture;  // s: the sum of covers before the voxel
    std::uint64_t y, z;     // the sums of their moments

    // The sums of a slot.
    struct slot_sums {
        std::uint64_t first; // of the slot's terms, which end at the cursor
        std::uint64_t cover, volume;
        bool has_any;
        std::conditional_t<has_cover_moments<Terms>, face_totals, no_sums<0>> before; // of the voxel's lower face
        std::conditional_t<has_cover_moments<Terms>, face_totals, no_sums<1>> behind; // of its upper face
        std::conditional_t<has_moments<Terms>, moment_totals, no_sums<2>> moments;    // of the terms alone
        std::conditional_t<has_areas<Terms>, area_totals, no_sums<3>> areas;
    };
    // Adds up the terms of the next slot.
    [[nodiscard]] VOXELPIPE_HD slot_sums take(const record_list<Terms>& list) {
        slot_sums s{};
        s.first = at;
        if constexpr (has_cover_moments<Terms>) s.before = {y, z};
        for (; at < list.count && list.keys[at] == next_key; ++at) {
            const Terms& t = list.terms[list.order[at]];
            s.cover += static_cast<std::uint64_t>(t.cover);
            s.volume += static_cast<std::uint64_t>(t.volume);
            s.has_any = true;
            if constexpr (has_moments<Terms>) {
                s.moments.x += static_cast<std::uint64_t>(t.volume_x);
                s.moments.y += static_cast<std::uint64_t>(t.volume_y);
                s.moments.z += static_cast<std::uint64_t>(t.volume_z);
            }
            if constexpr (has_cover_moments<Terms>) {
                y += static_cast<std::uint64_t>(t.cover_y);
                z += static_cast<std::uint64_t>(t.cover_z);
            }
            if constexpr (has_areas<Terms>) {
                s.areas.area += t.area;
                s.areas.x += t.area_x;
                s.areas.y += t.area_y;
                s.areas.z += t.area_z;
            }
        }
        if constexpr (has_cover_moments<Terms>) s.behind = {y, z};
        ++next_key;
        return s;
    }
};

// (x, y, z) of what lies along the rows and the two other axes.
[[nodiscard]] VOXELPIPE_HD inline glm::vec3 turn_back(float w, float u, float v, int axis) {
    return axis == 0 ? glm::vec3(w, u, v) : axis == 1 ? glm::vec3(v, w, u) : glm::vec3(u, v, w);
}

// True if the triangles of a voxel's terms, `order` from first to end, are more than one sheet (measured_cell). Puts
// those of the first sheet in front, each compared once with those that are not yet reached. corner: the voxel's
// lowest, snapped.
template <class Terms>
[[nodiscard]] VOXELPIPE_HD bool has_many_sheets(const cell_mesh& mesh, const record_list<Terms>& list,
                                                std::uint64_t first, std::uint64_t end,
                                                const std::int64_t (&corner)[3]) {
    const auto same = [](const snapped_position& a, const snapped_position& b) { return is_same_place(a, b); };
    std::uint64_t reached = first + 1;
    for (std::uint64_t at = first; at < reached && reached < end; ++at) {
        const std::uint32_t t = list.terms[list.order[at]].triangle;
        for (int i = 0; i < 3; ++i) {
            const snapped_position a = mesh.corner(t, i), b = mesh.corner(t, i == 2 ? 0 : i + 1);
            if (!edge_meets_voxel(a, b, corner, mesh.fraction)) continue;
            for (std::uint64_t other = reached; other < end; ++other) {
                const std::uint32_t o = list.terms[list.order[other]].triangle;
                bool shares = false;
                for (int j = 0; j < 3; ++j) {
                    const snapped_position c = mesh.corner(o, j), d = mesh.corner(o, j == 2 ? 0 : j + 1);
                    shares = shares || (same(a, c) && same(b, d)) || (same(a, d) && same(b, c));
                }
                if (!shares) continue;
                const std::uint32_t was = list.order[reached];
                list.order[reached++] = list.order[other];
                list.order[other] = was;
            }
        }
    }
    return reached < end;
}

// Sets the centroid of a part of this size, from its moments about a centre: quotients, clamped to half a voxel. False,
// and 0, if the part is less than 2^-20, or a quotient lies further than 2^-10 beyond that.
template <int Count>
[[nodiscard]] VOXELPIPE_HD bool find_centroid(const std::uint64_t (&moments)[Count], std::int64_t units,
                                              float (&c)[Count]) {
    bool is_found = (units < 0 ? -units : units) >= std::int64_t{1} << (cell_unit_bits - 20);
    for (int i = 0; i < Count && is_found; ++i) {
        const double q = exact::div(exact::to_double(static_cast<std::int64_t>(moments[i])), exact::to_double(units));
        c[i] = exact::to_float(q < -0.5 ? -0.5 : q > 0.5 ? 0.5 : q);
        is_found = q >= -0.5 - 0x1p-10 && q <= 0.5 + 0x1p-10;
    }
    for (int i = 0; i < Count && !is_found; ++i) c[i] = 0.0f;
    return is_found;
}

// Sets what a fragment has beside a cell_fragment's members. at: the voxel along the rows and the two other axes; end:
// of its terms. False if its centroid is lost.
template <class Terms, class Fragment>
[[nodiscard]] VOXELPIPE_HD bool measure_cell(const cell_mesh& mesh, const record_list<Terms>& list, int axis,
                                             const glm::ivec3& at, std::uint64_t end,
                                             const typename cell_cursor<Terms>::slot_sums& sums, Fragment& f) {
    bool is_found = true;
    if constexpr (std::is_base_of_v<value_of_cell<cell_value::centroid>, Fragment>) {
        const std::uint64_t moments[3] = {sums.moments.x, sums.before.y + sums.moments.y,
                                          sums.before.z + sums.moments.z};
        float c[3];
        is_found = find_centroid(moments, f.units, c);
        f.centroid = turn_back(c[0], c[1], c[2], axis);
    }
    if constexpr (std::is_base_of_v<value_of_cell<cell_value::faces>, Fragment>) {
        const auto centroid_of = [&](const face_totals& face, std::int64_t aperture) {
            const std::uint64_t moments[2] = {face.y, face.z};
            float c[2];
            (void)find_centroid(moments, aperture, c);
            return turn_back(0.0f, c[0], c[1], axis);
        };
        f.aperture_centroid = centroid_of(sums.before, f.aperture);
        f.next_aperture_centroid = centroid_of(sums.behind, f.next_aperture);
    }
    if constexpr (has_areas<Terms>) {
        const area_totals& a = sums.areas;
        const auto quotient = [&](int128 moment) {
            return a.area == 0 ? 0.0f : exact::to_float(exact::div(exact::to_double(moment), exact::to_double(a.area)));
        };
        const double side = mesh.areas.side;
        f.area = exact::mul(exact::mul(exact::mul(exact::to_double(a.area), 0x1p-40), side), side);
        f.area_centroid = turn_back(quotient(a.x), quotient(a.y), quotient(a.z), axis);
    }
    if constexpr (has_sheets<Terms>) {
        const std::int64_t corner[3] = {static_cast<std::int64_t>(at.x) << mesh.fraction,
                                        static_cast<std::int64_t>(at.y) << mesh.fraction,
                                        static_cast<std::int64_t>(at.z) << mesh.fraction};
        f.is_multi_cut = sums.has_any && has_many_sheets(mesh, list, sums.first, end, corner);
    }
    return is_found;
}

} // namespace voxelpipe::core::passes
