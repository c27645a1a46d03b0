// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One primitive in one tile: its shaded fragments or, if the shader gives every fragment the same values, its coverage
// alone as rows and columns of bits. Positions are relative to the tile's lowest voxel. A row of a tile is y +
// tile_size * z, its bits run along x.

#include <cpu_ref/pipeline.hpp>
#include <cpu_ref/small_box.hpp>
#include <cpu_ref/tile_arms.hpp>
#include <cpu_ref/tile_columns.hpp>

namespace voxelpipe::cpu {

// The number of ones of an interval of bits.
[[nodiscard]] inline int interval_width(std::uint32_t bits) {
    return std::countr_zero(~(std::uint64_t{bits} >> std::countr_zero(bits)));
}

struct gathered_triangle {
    geometry::primitive where;
    const core::snapped_position &a, &b, &c;

    gathered_triangle(const geometry& s, std::uint32_t id) : gathered_triangle(s.find(id), s) {}

private:
    gathered_triangle(const geometry::primitive& p, const geometry& s)
        : where(p), a(s.parts[p.draw].positions[p.index.x]), b(s.parts[p.draw].positions[p.index.y]),
          c(s.parts[p.draw].positions[p.index.z]) {}
};

// Visits the voxels of one triangle in the tile, each once: calls along_x(row, bits) with an interval of bits, or
// across(row, stride, x, bits), which means bit x of the rows row + i * stride for the ones i of an interval of bits.
// An interval may be empty. arms: see geometry.
template <coverage Rule, class AlongX, class Across>
VOXELPIPE_INLINE void cover_in_tile(const gathered_triangle& tri, int fraction, core::arm_set arms,
                                    const core::voxel_box& tile, AlongX&& along_x, Across&& across) {
    constexpr auto rule = core::to_rule(Rule);
    const auto column = [&](int axis, int u, int v, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
        if (axis == 0)
            along_x(v * tile_size + u, bits);
        else if (axis == 1)
            across(u * tile_size, 1, v, bits);
        else
            across(v, tile_size, u, bits);
    };
    if constexpr (Rule == coverage::conservative) {
        if (arms != core::arm_set::none) {
            tile_columns columns;
            find_arm_columns(tri.a, tri.b, tri.c, fraction, arms, tile, columns);
            for (const auto& c : columns) column(columns.axis, c.u, c.v, c.bits);
            return;
        }
        const core::voxel_box all = core::bounds(tri.a, tri.b, tri.c, fraction);
        const core::voxel_box here = core::intersect(all, tile);
        if (core::is_line_of_voxels(all)) { // all of it is covered
            if (here.empty()) return;
            const auto at = [&](int a) { return static_cast<int>(here.lo[a] - tile.lo[a]); };
            const auto bits = [&](int a) { return core::low_bits(static_cast<int>(here.hi[a] - here.lo[a]) + 1); };
            const int row = at(2) * tile_size + at(1);
            if (here.lo[1] != here.hi[1])
                across(row, 1, at(0), bits(1));
            else if (here.lo[2] != here.hi[2])
                across(row, tile_size, at(0), bits(2));
            else
                along_x(row, bits(0) << at(0));
            return;
        }
        const auto small_row = [&](int y, int z, std::uint32_t bits)
                                   VOXELPIPE_INLINE_LAMBDA { along_x(z * tile_size + y, bits); };
        if (core::is_within(all, 4)) {
            if (core::for_each_small_row<4>(tri.a, tri.b, tri.c, fraction, all, tile, small_row)) return;
        } else if (core::is_within(all, 8)) {
            if (core::for_each_small_row<8>(tri.a, tri.b, tri.c, fraction, all, tile, small_row)) return;
        }
        const int axis = core::slab_axis(all);
        if (axis >= 0 && core::fits_narrow(tri.a, tri.b, tri.c, fraction)) { // needs no plane test
            if (here.empty()) return;
            const auto level = static_cast<int>(here.lo[axis] - tile.lo[axis]);
            core::for_each_slab_row<std::int64_t>(tri.a, tri.b, tri.c, fraction, axis, all, tile,
                                                  [&](int q, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
                                                      if (axis == 0)
                                                          across(q * tile_size, 1, level, bits);
                                                      else if (axis == 1)
                                                          along_x(q * tile_size + level, bits);
                                                      else
                                                          along_x(level * tile_size + q, bits);
                                                  });
            return;
        }
    }
    const auto run = [&](const auto& t) VOXELPIPE_INLINE_LAMBDA {
        core::for_each_column<rule>(
            t, tile, [&](int u, int v, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA { column(t.axis, u, v, bits); });
    };
    if (core::fits_narrow(tri.a, tri.b, tri.c, fraction))
        run(core::setup_triangle<rule, std::int64_t>(tri.a, tri.b, tri.c, fraction));
    else
        run(core::setup_triangle<rule, int128>(tri.a, tri.b, tri.c, fraction));
}

// Calls visit(x, y, z, fragment shader's output) for every fragment of one primitive in the tile. Everything is forced
// inline, so fields of the fragment that the shader does not read cost nothing.
template <coverage Rule, class Scene, class Visit>
VOXELPIPE_INLINE void shade_in_tile(const Scene& s, std::uint32_t id, const core::voxel_box& tile, Visit&& visit) {
    const gathered_triangle tri(s, id);
    const auto& d = s.draws[tri.where.draw];
    if constexpr (core::is_constant<typename Scene::fragment_shader>) {
        const auto out = d.fragment_shader(tri); // a constant shader ignores its argument
        cover_in_tile<Rule>(
            tri, s.snap.fraction, s.arms, tile,
            [&](int row, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
                for (; bits != 0; bits &= bits - 1)
                    visit(std::countr_zero(bits), row % tile_size, row / tile_size, out);
            },
            [&](int row, int stride, int x, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
                for (; bits != 0; bits &= bits - 1) {
                    const int at = row + std::countr_zero(bits) * stride;
                    visit(x, at % tile_size, at / tile_size, out);
                }
            });
    } else {
        using varyings = typename Scene::varyings;
        static constexpr varyings none{};
        fragment<varyings> f{};
        const auto visible = s.numbers_of(tri.where, id);
        f.triangle = visible.triangle;
        f.draw = tri.where.draw;
        f.instance = tri.where.instance;
        f.primitive = visible.primitive;
        for (int i = 0; i < 3; ++i) {
            if constexpr (std::is_empty_v<varyings>)
                f.vertex_varyings[i] = &none;
            else
                f.vertex_varyings[i] = &s.vertices[tri.where.draw].varyings[tri.where.index[i]];
        }
        const glm::ivec3 corner(static_cast<int>(tile.lo[0]), static_cast<int>(tile.lo[1]),
                                static_cast<int>(tile.lo[2]));
        constexpr auto rule = core::to_rule(Rule);
        const auto run = [&](const auto& t) VOXELPIPE_INLINE_LAMBDA {
            f.axis = t.zero_area ? 0 : t.axis;
            f.front_facing = t.normal[2] >= 0;
            f.normal = core::unit_normal(t, s.normal_factors);
            const auto first = core::to_uvw(t.axis, tile.lo[0], tile.lo[1], tile.lo[2]);
            const auto column = [&](int u, int v, std::uint32_t bits) VOXELPIPE_INLINE_LAMBDA {
                f.barycentric = core::barycentric(t, first[0] + u, first[1] + v);
                if constexpr (!std::is_empty_v<varyings>)
                    f.varyings = core::mix(*f.vertex_varyings[0], *f.vertex_varyings[1], *f.vertex_varyings[2],
                                           f.barycentric.y, f.barycentric.z);
                for (; bits != 0; bits &= bits - 1) {
                    const auto p = core::to_xyz(t.axis, u, v, std::countr_zero(bits));
                    f.voxel = s.where.offset + corner + glm::ivec3(p[0], p[1], p[2]);
                    visit(p[0], p[1], p[2], d.fragment_shader(f));
                }
            };
            if constexpr (Rule == coverage::conservative) {
                if (s.arms != core::arm_set::none) {
                    tile_columns columns;
                    find_arm_columns(tri.a, tri.b, tri.c, s.snap.fraction, s.arms, tile, columns);
                    for (const auto& c : columns) column(c.u, c.v, c.bits);
                    return;
                }
            }
            core::for_each_column<rule>(t, tile, column);
        };
        if (core::fits_narrow(tri.a, tri.b, tri.c, s.snap.fraction))
            run(core::setup_triangle<rule, std::int64_t>(tri.a, tri.b, tri.c, s.snap.fraction));
        else
            run(core::setup_triangle<rule, int128>(tri.a, tri.b, tri.c, s.snap.fraction));
    }
}

} // namespace voxelpipe::cpu
