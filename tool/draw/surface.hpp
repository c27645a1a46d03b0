// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tool's shaders: triangles of a mesh and its transform in, one value for each of the tool's render
// targets out. Base colour = factor * texture * vertex colour, in linear light. Plain functors over pointers, for every
// backend; floats follow the rule of voxelpipe/core/exact.hpp, so the CPU and a GPU give the same bits.

#include "model/scene.hpp"
#include "model/srgb.hpp"
#include "outside.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <glm/gtc/type_precision.hpp>

#include <cmath>
#include <cstdint>

namespace voxelize {

namespace vp = voxelpipe;

// A texture as the shaders see it. Memory of the backend, not owned.
struct sampled_texture {
    const glm::u8vec4* texels = nullptr; // of first_level, rows from the top; null: no texture
    int width = 0;                       // of level 0
    int height = 0;
    wrap_mode wrap_s = wrap_mode::repeat;
    wrap_mode wrap_t = wrap_mode::repeat;
    filter_mode filter = filter_mode::linear;
    int levels = 1;      // of the picture; see mip_levels.hpp
    int first_level = 0; // the first that is in texels, where the others follow. No fragment samples one before it
};

// Linear colour and alpha of a texel's bytes, looked up.
struct texel_decoder {
    using texel = glm::u8vec4;
    const color_tables* tables;
    [[nodiscard]] VOXELPIPE_HD glm::vec4 operator()(const glm::u8vec4& t) const {
        return {tables->linear[t.r], tables->linear[t.g], tables->linear[t.b], tables->fraction[t.a]};
    }
};

// Texels that are no colours: all four channels are linear.
struct linear_texel_decoder {
    using texel = glm::u8vec4;
    const color_tables* tables;
    [[nodiscard]] VOXELPIPE_HD glm::vec4 operator()(const glm::u8vec4& t) const {
        return {tables->fraction[t.r], tables->fraction[t.g], tables->fraction[t.b], tables->fraction[t.a]};
    }
};

[[nodiscard]] VOXELPIPE_HD inline vp::wrap_mode field_wrap(wrap_mode mode) {
    return mode == wrap_mode::repeat            ? vp::wrap_mode::repeat
           : mode == wrap_mode::mirrored_repeat ? vp::wrap_mode::mirror
                                                : vp::wrap_mode::clamp;
}

// The texture at UV: (0, 0) is the top left corner of the picture, texel centres lie at halves.
template <class Decoder = texel_decoder>
[[nodiscard]] VOXELPIPE_HD glm::vec4 sample(const sampled_texture& t, const color_tables& tables, glm::vec2 uv) {
    vp::field2d<glm::vec4, Decoder> field{t.texels, t.width, t.height};
    if (t.filter == filter_mode::nearest) field.filter = vp::filter_mode::nearest;
    field.wrap_x = field_wrap(t.wrap_s);
    field.wrap_y = field_wrap(t.wrap_t);
    field.decode = {&tables};
    return field(uv);
}

// Level of a texture as a texture of its own, from first_level on; levels above 0 are always filtered linearly.
[[nodiscard]] VOXELPIPE_HD inline sampled_texture level_of(sampled_texture t, int level) {
    for (int i = 0; i < level; ++i) {
        if (i >= t.first_level) t.texels += static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height);
        t.width = t.width > 1 ? t.width / 2 : 1;
        t.height = t.height > 1 ? t.height / 2 : 1;
    }
    if (level > 0) t.filter = filter_mode::linear;
    t.first_level = 0;
    return t;
}

// The finest of a texture's levels that a footprint samples, in texels of level 0 a side.
[[nodiscard]] VOXELPIPE_HD inline int finest_level(float footprint, int levels) {
    if (levels <= 1 || !(footprint > 1.0f)) return 0;
    const int level = static_cast<int>(vp::core::bit_cast<std::uint32_t>(footprint) >> 23) - 127; // floor of log2
    return level < levels - 1 ? level : levels - 1;
}

// The mean of the texture around UV over FOOTPRINT texels of level 0 a side. Up to one texel that is the texture as
// its sampler says. From there on it lies between the two levels whose texels are at most and more than that large, in
// proportion to the footprint, so that no logarithm has to be the same on every machine.
[[nodiscard]] VOXELPIPE_HD inline glm::vec4 sample_footprint(const sampled_texture& t, const color_tables& tables,
                                                             glm::vec2 uv, float footprint) {
    if (t.levels <= 1 || !(footprint > 1.0f)) return sample(t, tables, uv);
    const int level = finest_level(footprint, t.levels);
    if (level == t.levels - 1) return sample(level_of(t, level), tables, uv);
    const auto bits = vp::core::bit_cast<std::uint32_t>(footprint);
    const float above = vp::exact::sub(vp::core::bit_cast<float>((bits & 0x7fffffU) | 0x3f800000U), 1.0f);
    const sampled_texture fine = level_of(t, level);
    const glm::vec4 a = sample(fine, tables, uv);
    if (above == 0.0f) return a;
    const glm::vec4 b = sample(level_of(fine, 1), tables, uv);
    glm::vec4 result;
    for (int i = 0; i < 4; ++i) result[i] = vp::exact::lerp(a[i], b[i], above);
    return result;
}

struct surface_varyings {
    glm::vec2 texcoord;
    glm::vec4 color;
    glm::vec3 position; // world, relative to the reference point
};

// Voxel centres in the coordinates of surface_varyings::position, for nearest_on_triangle.
struct voxel_centers {
    glm::dvec3 origin{0.0};
    glm::dvec3 voxel_size{1.0};

    [[nodiscard]] VOXELPIPE_HD double operator()(int axis, int voxel) const {
        return vp::exact::fma(voxel + 0.5, voxel_size[axis], origin[axis]);
    }
};

// The varyings at the point of the triangle that is nearest to the centre of the fragment's column, seen along the
// dominant axis. Fragments interpolate at that centre, which lies outside of the triangle in many voxels that it only
// touches; extrapolated there, a texture shows what belongs to other triangles, and weights cut off at zero jump along
// a sliver to its far end.
[[nodiscard]] VOXELPIPE_HD inline surface_varyings nearest_on_triangle(const vp::fragment<surface_varyings>& f,
                                                                       const voxel_centers& centers) {
    if (f.barycentric.x >= 0.0f && f.barycentric.y >= 0.0f && f.barycentric.z >= 0.0f) return f.varyings;
    const int u = f.axis == 0 ? 1 : 0;
    const int v = f.axis == 2 ? 1 : 2;
    const double center_u = centers(u, f.voxel[u]);
    const double center_v = centers(v, f.voxel[v]);
    surface_varyings nearest = f.varyings;
    float least = 0.0f;
    bool found = false;
    for (int opposite = 0; opposite < 3; ++opposite) { // the edge across from this vertex
        if (f.barycentric[opposite] >= 0.0f) continue;
        const surface_varyings& a = *f.vertex_varyings[(opposite + 1) % 3];
        const surface_varyings& b = *f.vertex_varyings[(opposite + 2) % 3];
        const float edge_u = vp::exact::sub(b.position[u], a.position[u]);
        const float edge_v = vp::exact::sub(b.position[v], a.position[v]);
        const auto to_u = static_cast<float>(center_u - static_cast<double>(a.position[u]));
        const auto to_v = static_cast<float>(center_v - static_cast<double>(a.position[v]));
        const float length = vp::exact::fma(edge_u, edge_u, vp::exact::mul(edge_v, edge_v));
        const float along = vp::exact::fma(to_u, edge_u, vp::exact::mul(to_v, edge_v));
        float t = length > 0.0f ? vp::exact::div(along, length) : 0.0f;
        t = t > 0.0f ? (t < 1.0f ? t : 1.0f) : 0.0f;
        const float rest_u = vp::exact::fma(-t, edge_u, to_u);
        const float rest_v = vp::exact::fma(-t, edge_v, to_v);
        const float distance = vp::exact::fma(rest_u, rest_u, vp::exact::mul(rest_v, rest_v));
        if (found && !(distance < least)) continue;
        found = true;
        least = distance;
        for (int i = 0; i < 2; ++i) nearest.texcoord[i] = vp::exact::lerp(a.texcoord[i], b.texcoord[i], t);
        for (int i = 0; i < 4; ++i) nearest.color[i] = vp::exact::lerp(a.color[i], b.color[i], t);
        for (int i = 0; i < 3; ++i) nearest.position[i] = vp::exact::lerp(a.position[i], b.position[i], t);
    }
    return nearest;
}

// Side of a voxel in texels of the triangle's texture: the longer of its two sides seen along the dominant axis, but no
// more than the triangle's longest edge, since texels beyond it belong to other triangles. At most 1 where the texture
// is magnified, and for triangles without area there.
[[nodiscard]] VOXELPIPE_HD inline float texture_footprint(const vp::fragment<surface_varyings>& f,
                                                          const voxel_centers& centers, const sampled_texture& t) {
    const surface_varyings& a = *f.vertex_varyings[0];
    const surface_varyings& b = *f.vertex_varyings[1];
    const surface_varyings& c = *f.vertex_varyings[2];
    const auto width = static_cast<float>(t.width);
    const auto height = static_cast<float>(t.height);
    const float s1 = vp::exact::mul(vp::exact::sub(b.texcoord.x, a.texcoord.x), width);
    const float t1 = vp::exact::mul(vp::exact::sub(b.texcoord.y, a.texcoord.y), height);
    const float s2 = vp::exact::mul(vp::exact::sub(c.texcoord.x, a.texcoord.x), width);
    const float t2 = vp::exact::mul(vp::exact::sub(c.texcoord.y, a.texcoord.y), height);
    const float s3 = vp::exact::mul(vp::exact::sub(c.texcoord.x, b.texcoord.x), width);
    const float t3 = vp::exact::mul(vp::exact::sub(c.texcoord.y, b.texcoord.y), height);
    const float length1 = vp::exact::fma(s1, s1, vp::exact::mul(t1, t1));
    const float length2 = vp::exact::fma(s2, s2, vp::exact::mul(t2, t2));
    const float length3 = vp::exact::fma(s3, s3, vp::exact::mul(t3, t3));
    const float longest = length1 > length2 ? (length1 > length3 ? length1 : length3)
                                            : (length2 > length3 ? length2 : length3); // squared, as all of these
    if (!(longest > 1.0f)) return 1.0f;
    const int u = f.axis == 0 ? 1 : 0;
    const int v = f.axis == 2 ? 1 : 2;
    const float u1 = vp::exact::sub(b.position[u], a.position[u]);
    const float v1 = vp::exact::sub(b.position[v], a.position[v]);
    const float u2 = vp::exact::sub(c.position[u], a.position[u]);
    const float v2 = vp::exact::sub(c.position[v], a.position[v]);
    const float area = vp::exact::fma(u1, v2, -vp::exact::mul(u2, v1));
    if (area == 0.0f) return 1.0f;
    // One step of a voxel along u, and along v, in texels.
    const float along_u = vp::exact::div(vp::exact::to_float(centers.voxel_size[u]), area);
    const float along_v = vp::exact::div(vp::exact::to_float(centers.voxel_size[v]), area);
    const float su = vp::exact::mul(vp::exact::fma(s1, v2, -vp::exact::mul(s2, v1)), along_u);
    const float tu = vp::exact::mul(vp::exact::fma(t1, v2, -vp::exact::mul(t2, v1)), along_u);
    const float sv = vp::exact::mul(vp::exact::fma(s2, u1, -vp::exact::mul(s1, u2)), along_v);
    const float tv = vp::exact::mul(vp::exact::fma(t2, u1, -vp::exact::mul(t1, u2)), along_v);
    const float step_u = vp::exact::fma(su, su, vp::exact::mul(tu, tu));
    const float step_v = vp::exact::fma(sv, sv, vp::exact::mul(tv, tv));
    const float step = step_u > step_v ? step_u : step_v;
    return vp::exact::sqrt(step < longest ? step : longest); // a step that is not a number gives the edge
}

// From a mesh's own coordinates to the world's, relative to the reference point: in double, rounded to float once.
struct placed_vertex_shader {
    double m[3][4]; // as affine has it

    placed_vertex_shader() : placed_vertex_shader(affine{}, glm::dvec3(0)) {}
    placed_vertex_shader(const affine& to_world, const glm::dvec3& reference) {
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = 0; c < 3; ++c) m[r][c] = to_world.m[r][c];
            m[r][3] = to_world.m[r][3] - reference[static_cast<glm::length_t>(r)];
        }
    }

    [[nodiscard]] VOXELPIPE_HD glm::vec3 operator()(const glm::vec3& p) const {
        const double x = vp::exact::to_double(p.x);
        const double y = vp::exact::to_double(p.y);
        const double z = vp::exact::to_double(p.z);
        glm::vec3 result;
        for (int r = 0; r < 3; ++r)
            result[r] = vp::exact::to_float(
                vp::exact::fma(m[r][0], x, vp::exact::fma(m[r][1], y, vp::exact::fma(m[r][2], z, m[r][3]))));
        return result;
    }
    VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const { return (*this)(v.position); }
};

// One of these for each copy of an instanced mesh, in memory of the backend.
struct instanced_vertex_shader {
    const placed_vertex_shader* places = nullptr;

    [[nodiscard]] VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
        return places[v.instance](v.position);
    }
};

// Attributes by pointer, so that a primitive without them needs no array of ones.
struct surface_vertex_shader {
    instanced_vertex_shader place;
    const glm::vec2* texcoords = nullptr; // null: 0
    const glm::vec4* colors = nullptr;    // null: white

    VOXELPIPE_HD vp::vertex_output<surface_varyings> operator()(const vp::vertex<>& v) const {
        const glm::vec3 position = place(v);
        return {position,
                {texcoords != nullptr ? texcoords[v.index] : glm::vec2(0.0f),
                 colors != nullptr ? colors[v.index] : glm::vec4(1.0f), position}};
    }
};

// The outputs that the fragment shader computes; the others are placeholders for targets that are off.
struct surface_outputs {
    bool linear_color = false;  // for the average
    bool encoded_color = false; // for max and replace
    bool depth = false;
};

// Values and order of the tool's render targets:
//   occupancy, count, sum of linear colours by their weight and of the weights, encoded colour (max), encoded colour
//   (last), sum of normals, triangle number, depth
struct surface_fragment_shader {
    // The least that a fragment weighs, so that voxels with nothing but invisible fragments have a colour too. Beside a
    // visible fragment it is less than a tenth of a byte even where black meets white.
    static constexpr float least_weight = 0x1p-16f;

    sampled_texture texture;
    const color_tables* tables = nullptr;
    glm::vec4 base_color{1.0f};
    alpha_mode alpha = alpha_mode::opaque;
    float alpha_cutoff = 0.5f;
    voxel_centers centers;
    int depth_axis = 2;
    double depth_reference = 0; // of the reference point, along depth_axis
    surface_outputs wanted;

    VOXELPIPE_HD auto operator()(const vp::fragment<surface_varyings>& f) const {
        const bool shaded = wanted.linear_color || wanted.encoded_color;
        const bool masked = alpha == alpha_mode::mask;
        const surface_varyings at = shaded || masked || wanted.depth ? nearest_on_triangle(f, centers) : f.varyings;
        const bool discarded = masked && is_cut_off(at);
        glm::vec4 color(1.0f);
        if (shaded) color = shade(f, at);
        glm::u8vec4 encoded(0);
        if (wanted.encoded_color) encoded = encode(*tables, color);
        if (alpha == alpha_mode::blend) {
            color.a = color.a > least_weight ? color.a : least_weight;
            for (int i = 0; i < 3; ++i) color[i] = vp::exact::mul(color[i], color.a);
        }
        const float depth = vp::exact::to_float(vp::exact::to_double(at.position[depth_axis]) + depth_reference);
        return vp::outputs(true, 1u, color, encoded, encoded, f.normal, f.primitive, depth).discard_if(discarded);
    }

    // The colour of a fragment, filtered over its voxel. Linear, every component in [0, 1]; alpha is 1 but where the
    // material blends.
    [[nodiscard]] VOXELPIPE_HD glm::vec4 shade(const vp::fragment<surface_varyings>& f,
                                               const surface_varyings& at) const {
        glm::vec4 color(1.0f);
        if (texture.texels != nullptr)
            color = sample_footprint(texture, *tables, at.texcoord,
                                     texture.levels > 1 ? texture_footprint(f, centers, texture) : 0.0f);
        color = with_factors(color, at);
        if (alpha != alpha_mode::blend) color.a = 1.0f;
        return color;
    }

    // True if a mask discards the fragment. Sampled at the point itself: a mean over the voxel would let fine leaves
    // vanish.
    [[nodiscard]] VOXELPIPE_HD bool is_cut_off(const surface_varyings& at) const {
        glm::vec4 color(1.0f);
        if (texture.texels != nullptr) color = sample(texture, *tables, at.texcoord);
        return with_factors(color, at).a < alpha_cutoff;
    }

private:
    [[nodiscard]] VOXELPIPE_HD glm::vec4 with_factors(const glm::vec4& texel, const surface_varyings& at) const {
        glm::vec4 color;
        for (int i = 0; i < 4; ++i) {
            const float c = vp::exact::mul(vp::exact::mul(base_color[i], texel[i]), at.color[i]);
            color[i] = c > 0.0f ? (c < 1.0f ? c : 1.0f) : 0.0f; // NaN gives 0
        }
        return color;
    }
};

// The shader of triangles for the fragments of lines and points, whose numbers follow those of the triangles. A line's
// fragment may interpolate beyond its ends; it takes the nearer end's values there. In color-outer a line, which has no
// normal, comes after every triangle.
template <class Shader>
struct line_fragment_shader {
    Shader of_triangles;
    std::uint32_t first_number = 0;

    VOXELPIPE_HD auto operator()(vp::fragment<surface_varyings> f) const {
        for (int end = 0; end < 2; ++end) {
            if (!(f.barycentric[1 - end] < 0.0f)) continue;
            f.varyings = *f.vertex_varyings[end];
            f.barycentric = glm::vec3(end == 0 ? 1.0f : 0.0f, end == 0 ? 0.0f : 1.0f, 0.0f);
        }
        f.primitive += first_number;
        return of_triangles(f);
    }
};

// For --target color-outer: the fragment's colour as a number that is greater the farther out the fragment lies, so
// that the greatest of a voxel wins in any order. From high bits to low: whether the fragment turns its front (either
// side, if its material is double-sided) to a side of the grid that sees the voxel; how far the triangle's plane lies
// from the voxel's centre towards such a side, the most over those sides; the colour.
struct outer_fragment_shader {
    // The least component of a unit normal along an axis for which the side of that axis counts: others see it edge-on.
    static constexpr float least_slope = 0x1p-6f;
    static constexpr float lowest = -0x1p100f;

    surface_fragment_shader surface;
    bool double_sided = false;
    column_view columns{}; // of a box in which the part of the grid lies that is drawn

    VOXELPIPE_HD auto operator()(const vp::fragment<surface_varyings>& f) const {
        const surface_varyings at = nearest_on_triangle(f, surface.centers);
        bool discarded = surface.alpha == alpha_mode::mask && surface.is_cut_off(at);
        const glm::u8vec4 color = encode(*surface.tables, surface.shade(f, at));
        discarded = discarded || color.a == 0; // nothing is seen there
        const std::uint64_t value = std::uint64_t{rank(f, at)} << 32 | std::uint32_t{color.r} << 24 |
                                    std::uint32_t{color.g} << 16 | std::uint32_t{color.b} << 8 | std::uint32_t{color.a};
        return vp::outputs(value).discard_if(discarded);
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t rank(const vp::fragment<surface_varyings>& f,
                                                  const surface_varyings& at) const {
        const unsigned sides = columns.sides_that_see(f.voxel);
        const unsigned seen_from = sides != 0 ? sides : 63U;
        float along = 0.0f; // of the normal, from the centre to the plane
        for (int a = 0; a < 3; ++a) {
            const double from_center = vp::exact::to_double(at.position[a]) - surface.centers(a, f.voxel[a]);
            along = vp::exact::fma(f.normal[a], vp::exact::to_float(from_center), along);
        }
        bool in_front = false, behind = false; // some side sees the triangle's front, its back
        for (int side = 0; side < 6; ++side) {
            if ((seen_from >> side & 1U) == 0) continue;
            const float slope = side % 2 != 0 ? f.normal[side / 2] : -f.normal[side / 2]; // towards the side
            in_front = in_front || slope > least_slope;
            behind = behind || slope < -least_slope;
        }
        if (double_sided && in_front && behind) return ordered(along > 0.0f ? along : -along) >> 1 | 0x80000000U;
        const bool shown = in_front || (double_sided && behind);
        const float height = in_front ? along : behind ? -along : lowest;
        return ordered(height) >> 1 | (shown ? 0x80000000U : 0U);
    }

    // Floats as integers in the same order.
    [[nodiscard]] VOXELPIPE_HD static std::uint32_t ordered(float value) {
        const auto bits = vp::core::bit_cast<std::uint32_t>(value);
        return (bits >> 31) != 0 ? ~bits : bits | 0x80000000U;
    }
};

} // namespace voxelize
