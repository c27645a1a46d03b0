// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment shade: runs the fragment shader on every fragment of one primitive within a box (paper section 3, fragment
// shader), or on a single fragment, for targets that need only the last one.

#include <voxelpipe/device/scene/int128_coverage.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>

#include <type_traits>

namespace voxelpipe::device {

// The fragment's fields that depend on its triangle, and the shader to call.
template <class Scene>
struct fragment_source {
    using varyings = typename Scene::varyings;

    const Scene& s;
    const typename Scene::shading& d;
    varyings none{};
    fragment<varyings> f{};

    __device__ fragment_source(const Scene& s_, const loaded_triangle& t, std::uint32_t id)
        : s(s_), d(s_.draw(t.draw)) {
        f.triangle = t.triangle;
        f.draw = t.draw;
        f.instance = t.instance;
        f.primitive = id;
        if (d.numbers.whole != 0) {
            const core::visible_numbers seen = d.numbers.of(t.triangle, t.instance);
            f.triangle = seen.triangle;
            f.primitive = seen.primitive;
        }
        for (int i = 0; i < 3; ++i) {
            if constexpr (std::is_empty_v<varyings>)
                f.vertex_varyings[i] = &none;
            else
                f.vertex_varyings[i] = d.varyings + t.index[i];
        }
    }
    template <class Frame>
    __device__ VOXELPIPE_INLINE void begin_triangle(const Frame& t) {
        f.axis = t.zero_area ? 0 : t.axis;
        f.front_facing = t.normal[2] >= 0;
        f.normal = core::unit_normal(t, s.normal_factors);
    }
    __device__ VOXELPIPE_INLINE void begin_triangle(const wide_triangle& t) {
        f.axis = t.zero_area ? 0 : t.axis;
        f.front_facing = t.front_facing;
        f.normal = t.normal;
    }
    __device__ VOXELPIPE_INLINE void begin_column(const glm::vec3& barycentric) {
        f.barycentric = barycentric;
        if constexpr (!std::is_empty_v<varyings>)
            f.varyings = core::mix(*f.vertex_varyings[0], *f.vertex_varyings[1], *f.vertex_varyings[2], f.barycentric.y,
                                   f.barycentric.z);
    }
    __device__ VOXELPIPE_INLINE auto shade(int x, int y, int z) {
        f.voxel = glm::ivec3(s.offset.x + x, s.offset.y + y, s.offset.z + z);
        return d.fragment_shader(f);
    }
};

// Calls visit(x, y, z, fragment shader's output) for every fragment of the primitive within `box`, in voxels of the
// computed part. Everything is inlined, so fields that the shader does not read cost nothing.
template <coverage Rule, class Scene, class Visit>
__device__ VOXELPIPE_INLINE void shade_fragments(const Scene& s, const loaded_triangle& tri, std::uint32_t id,
                                                 const core::voxel_box& box, Visit&& visit) {
    constexpr auto rule = core::to_rule(Rule);
    fragment_source<Scene> source(s, tri, id);
    const int fraction = s.geo.snap.fraction;
    const auto column = [&](int axis, int u, int v, int w0, int w1) {
        for (int w = w0; w <= w1; ++w) {
            const auto p = core::to_xyz(axis, u, v, w);
            visit(p[0], p[1], p[2], source.shade(p[0], p[1], p[2]));
        }
    };
    if constexpr (Rule == coverage::conservative) {
        if (s.geo.arms != core::arm_set::none) {
            const wide_triangle t = set_up_either_width(tri.a, tri.b, tri.c, fraction, s.normal_factors);
            source.begin_triangle(t);
            for_each_arm_span(tri.a, tri.b, tri.c, fraction, s.geo.arms, box, [&](const wide_span& span) {
                source.begin_column(span.barycentric);
                column(t.axis, span.u, span.v, span.w_first, span.w_last);
            });
            return;
        }
    }
    if (core::fits_narrow(tri.a, tri.b, tri.c, fraction)) {
        const auto t = core::setup_triangle<rule, std::int64_t>(tri.a, tri.b, tri.c, fraction);
        source.begin_triangle(t);
        core::for_each_span<rule>(t, box, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
            source.begin_column(core::barycentric(t, u, v));
            column(t.axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(w0), static_cast<int>(w1));
        });
    } else {
        const wide_triangle t = set_up_wide(tri.a, tri.b, tri.c, fraction, s.normal_factors);
        source.begin_triangle(t);
        for_each_wide_span<rule>(tri.a, tri.b, tri.c, fraction, box, [&](const wide_span& span) {
            source.begin_column(span.barycentric);
            column(t.axis, span.u, span.v, span.w_first, span.w_last);
        });
    }
}

// The shader's output for the primitive's fragment in voxel (x, y, z), which it covers.
template <class Scene>
__device__ auto shade_fragment(const Scene& s, std::uint32_t id, int x, int y, int z) {
    const loaded_triangle tri = s.geo.load(id);
    fragment_source<Scene> source(s, tri, id);
    const int fraction = s.geo.snap.fraction;
    if (core::fits_narrow(tri.a, tri.b, tri.c, fraction)) {
        const auto t = core::make_frame<std::int64_t>(tri.a, tri.b, tri.c, fraction);
        const auto p = core::to_uvw(t.axis, x, y, z);
        source.begin_triangle(t);
        source.begin_column(core::barycentric(t, p[0], p[1]));
    } else {
        const wide_triangle t = set_up_wide(tri.a, tri.b, tri.c, fraction, s.normal_factors);
        const auto p = core::to_uvw(t.axis, x, y, z);
        source.begin_triangle(t);
        source.begin_column(wide_barycentric(tri.a, tri.b, tri.c, fraction, p[0], p[1]));
    }
    return source.shade(x, y, z);
}
template <class Scene>
__device__ __noinline__ auto shade_fragment_apart(const Scene& s, std::uint32_t id, int x, int y, int z) {
    return shade_fragment(s, id, x, y, z);
}

// The same, faster for triangles that fit 32 bits. AllSmall: all do, and the code for others is left out.
template <bool AllSmall, class Scene>
__device__ VOXELPIPE_INLINE auto shade_small_fragment(const Scene& s, std::uint32_t id, int x, int y, int z) {
    loaded_triangle tri; // positions are not set
    tri.draw = s.geo.find_draw(id);
    const draw_geometry& d = s.geo.draw(tri.draw);
    d.locate(id, tri);
    const int fraction = s.geo.snap.fraction;
    const int32_triangle r = load_int32(raster_input<stored_source>{{d}, 0, fraction, s.geo.extent}, tri.index);
    if (!AllSmall && (!r.fits_int32 || r.longest_side() > core::small_voxels(fraction)))
        return shade_fragment_apart(s, id, x, y, z);
    const core::small_frame frame(r.relative(fraction), fraction);
    const auto p = core::to_uvw(frame.axis, x - r.lo[0], y - r.lo[1], z - r.lo[2]);
    fragment_source<Scene> source(s, tri, id);
    source.begin_triangle(frame);
    source.begin_column(core::barycentric(frame, p[0], p[1]));
    return source.shade(x, y, z);
}

} // namespace voxelpipe::device
