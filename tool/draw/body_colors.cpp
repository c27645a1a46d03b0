// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "body_colors.hpp"

#include "mip_levels.hpp"
#include "model/finite.hpp"
#include "model/parallel.hpp"
#include "write/preview.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace voxelize {

namespace {

// Twice the area. Every product goes into a fused operation, so that no compiler's choice shows.
double double_area(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const glm::dvec3 u = glm::dvec3(b) - glm::dvec3(a), v = glm::dvec3(c) - glm::dvec3(a);
    const double x = std::fma(u.y, v.z, -(u.z * v.y)), y = std::fma(u.z, v.x, -(u.x * v.z)),
                 z = std::fma(u.x, v.y, -(u.y * v.x));
    return std::sqrt(std::fma(x, x, std::fma(y, y, z * z)));
}

// The longest edge of a triangle in texels of the whole picture.
float longest_edge(const glm::vec2* uv, const sampled_texture& t) {
    float longest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::vec2 &a = uv[i], &b = uv[(i + 1) % 3];
        const float s = vp::exact::mul(vp::exact::sub(b.x, a.x), static_cast<float>(t.width));
        const float r = vp::exact::mul(vp::exact::sub(b.y, a.y), static_cast<float>(t.height));
        const float squared = vp::exact::fma(s, s, vp::exact::mul(r, r));
        if (squared > longest) longest = squared;
    }
    return vp::exact::sqrt(longest);
}

} // namespace

material_colors::material_colors(const std::vector<material>& materials, const std::vector<texture>& textures,
                                 const std::vector<picture>& images, const voxelize_request& request)
    : materials_(materials), request_(request), textures_(materials.size()) {
    std::vector<std::array<const glm::u8vec4*, 2>> texels(images.size());
    made_.reserve(2 * images.size());
    for (std::size_t i = 0; i < materials.size(); ++i) {
        if (materials[i].texture == material::no_texture) continue;
        const texture& shown = textures[static_cast<std::size_t>(materials[i].texture)];
        const picture& image = images[shown.image];
        const std::size_t by_alpha = alpha_of(materials[i], request.alpha) != alpha_mode::opaque ? 1 : 0;
        const glm::u8vec4*& found = texels[shown.image][by_alpha];
        if (found == nullptr && image.levels[by_alpha]) found = image.levels[by_alpha]->data();
        if (found == nullptr && !image.rgba.empty())
            found = made_.emplace_back(with_mip_levels(image, by_alpha != 0, thread_count(request.threads))).data();
        sampled_texture& to = textures_[i];
        to.texels = found;
        to.width = static_cast<int>(image.width);
        to.height = static_cast<int>(image.height);
        to.wrap_s = shown.wrap_s;
        to.wrap_t = shown.wrap_t;
        to.filter = shown.filter;
        to.levels = mip_level_count(image.width, image.height);
        to.first_level = image.first_level;
    }
}

material_colors::sum::sum(const material_colors& of, std::uint32_t number, bool has_texcoords)
    : of_(of), material_(of.materials_[number]), alpha_(alpha_of(material_, of.request_.alpha)) {
    if (has_texcoords) texture_ = of.textures_[number];
    varies_ = texture_.texels != nullptr;
}

void material_colors::sum::add(std::span<const glm::vec3> corners, std::span<const glm::vec2> texcoords,
                               std::span<const glm::vec4> colors) {
    for (std::size_t i = 0; i + 3 <= corners.size(); i += 3)
        add(corners.data() + i, texcoords.empty() ? nullptr : texcoords.data() + i,
            colors.empty() ? nullptr : colors.data() + i);
}

void material_colors::sum::add(const glm::vec3* corners, const glm::vec2* texcoords, const glm::vec4* colors) {
    const double area = double_area(corners[0], corners[1], corners[2]);
    if (!(area > 0) || !std::isfinite(area)) return;
    glm::vec4 of_vertices(1.0F);
    if (colors != nullptr) {
        if (!std::exchange(has_first_, true)) first_color_ = colors[0];
        bool is_same = true;
        for (std::size_t i = 0; i < 3; ++i) is_same = is_same && colors[i] == first_color_;
        varies_ = varies_ || !is_same;
        if (is_same)
            of_vertices = first_color_;
        else
            for (int a = 0; a < 4; ++a)
                of_vertices[a] =
                    vp::exact::to_float((vp::exact::to_double(colors[0][a]) + colors[1][a] + colors[2][a]) / 3.0);
    }
    glm::vec4 texel(1.0F), at_point(1.0F);
    if (texture_.texels != nullptr && texcoords != nullptr) {
        glm::vec2 middle;
        for (int a = 0; a < 2; ++a)
            middle[a] =
                vp::exact::to_float((vp::exact::to_double(texcoords[0][a]) + texcoords[1][a] + texcoords[2][a]) / 3.0);
        // Levels before the first are not there; no triangle that is drawn samples them.
        const float least = static_cast<float>(1U << static_cast<unsigned>(texture_.first_level));
        const float edge = longest_edge(texcoords, texture_);
        const float footprint = texture_.first_level > 0 && !(edge > least) ? least : edge;
        texel = sample_footprint(texture_, of_.tables_, middle, footprint);
        if (alpha_ == alpha_mode::mask && texture_.first_level == 0) at_point = sample(texture_, of_.tables_, middle);
    }
    glm::vec4 color;
    for (int a = 0; a < 4; ++a) {
        const float value = vp::exact::mul(vp::exact::mul(material_.base_color[a], texel[a]), of_vertices[a]);
        color[a] = value > 0.0F ? (value < 1.0F ? value : 1.0F) : 0.0F; // NaN gives 0
    }
    double weight = area;
    if (alpha_ == alpha_mode::mask) {
        const float cutoff = material_.alpha == alpha_mode::blend ? 0.5F : material_.alpha_cutoff;
        if (vp::exact::mul(vp::exact::mul(material_.base_color.a, at_point.a), of_vertices.a) < cutoff) return;
    } else if (alpha_ == alpha_mode::blend) {
        weight = area * vp::exact::to_double(std::max(color.a, surface_fragment_shader::least_weight));
    }
    for (int a = 0; a < 3; ++a)
        sums_[static_cast<std::size_t>(a)] =
            std::fma(weight, vp::exact::to_double(color[a]), sums_[static_cast<std::size_t>(a)]);
    sums_[3] = std::fma(weight, 1.0, sums_[3]);
}

body_color material_colors::sum::plain() const {
    sum of_one = *this;
    const std::array<glm::vec3, 3> any{glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0)};
    of_one.add(any, {}, {});
    return of_one.color();
}

body_color material_colors::sum::color() const {
    if (!(sums_[3] > 0)) return {clay[0], clay[1], clay[2], 255};
    body_color made{0, 0, 0, 255};
    for (std::size_t a = 0; a < 3; ++a) made[a] = encode_srgb(of_.tables_, static_cast<float>(sums_[a] / sums_[3]));
    return made;
}

std::vector<body_color> colors_of(std::span<const primitive> primitives, const scene& model,
                                  const voxelize_request& request) {
    std::vector<body_color> colors(primitives.size());
    const material_colors materials(model.materials, model.textures, model.images, request);
    parallel_for(primitives.size(), thread_count(request.threads), [&](std::size_t p) {
        const primitive& of = primitives[p];
        material_colors::sum sum(materials, of.material, !of.texcoords.empty());
        if (of.colors.empty() && !sum.varies()) {
            colors[p] = sum.plain();
            return;
        }
        for (const glm::uvec3& t : of.triangles) {
            std::array<glm::vec3, 3> corners;
            std::array<glm::vec2, 3> texcoords{};
            std::array<glm::vec4, 3> own{};
            for (std::size_t i = 0; i < 3; ++i) {
                const std::uint32_t v = t[static_cast<glm::length_t>(i)];
                corners[i] = of.positions[v];
                if (!of.texcoords.empty()) texcoords[i] = of.texcoords[v];
                if (!of.colors.empty()) own[i] = of.colors[v];
            }
            sum.add(corners, of.texcoords.empty() ? std::span<const glm::vec2>() : texcoords,
                    of.colors.empty() ? std::span<const glm::vec4>() : own);
        }
        colors[p] = sum.color();
    });
    return colors;
}

std::vector<body_color> colors_of(const scene& model, const voxelize_request& request) {
    return colors_of(model.primitives, model, request);
}

stream_colors colors_of(triangle_stream& model, const voxelize_request& request) {
    stream_colors made;
    const material_colors materials(model.materials(), model.textures(), model.images(), request);
    for (std::size_t p = 0; p < model.parts().size(); ++p) {
        const triangle_stream::part& part = model.parts()[p];
        material_colors::sum sum(materials, part.material, part.has_texcoords);
        if (!model.has_colors() && !sum.varies()) {
            made.of_parts.push_back(sum.plain());
            continue;
        }
        model.read_part(p, [&](const triangle_stream::block& b) { sum.add(b.corners, b.texcoords, b.colors); });
        made.of_parts.push_back(sum.color());
        made.varies = made.varies || sum.varies();
    }
    return made;
}

std::vector<primitive> connected_parts(const primitive& whole) {
    const auto count = static_cast<std::uint32_t>(whole.positions.size());
    // Vertices at one place are one: the first of them.
    std::vector<std::uint32_t> order(count), root(count);
    std::iota(order.begin(), order.end(), 0U);
    std::iota(root.begin(), root.end(), 0U);
    const auto place = [&](std::uint32_t v) {
        const glm::vec3& p = whole.positions[v];
        return std::make_tuple(p.x, p.y, p.z);
    };
    std::erase_if(order, [&](std::uint32_t v) { return !is_finite(whole.positions[v]); });
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return place(a) != place(b) ? place(a) < place(b) : a < b; });
    for (std::size_t i = 1; i < order.size(); ++i)
        if (place(order[i]) == place(order[i - 1])) root[order[i]] = root[order[i - 1]];
    const auto find = [&](std::uint32_t v) {
        while (root[v] != v) v = root[v] = root[root[v]];
        return v;
    };
    const auto is_drawn = [&](const glm::uvec3& t) {
        return is_finite(whole.positions[t.x]) && is_finite(whole.positions[t.y]) && is_finite(whole.positions[t.z]);
    };
    for (const glm::uvec3& t : whole.triangles) {
        if (!is_drawn(t)) continue;
        for (int i = 1; i < 3; ++i) { // the least vertex stays the root
            const std::uint32_t a = find(t[0]), b = find(t[i]);
            root[std::max(a, b)] = std::min(a, b);
        }
    }
    // Roots in their order, which is that of the least vertices.
    constexpr std::uint32_t none = UINT32_MAX;
    std::vector<std::uint32_t> part_of(count, none), vertex_in(count, none);
    for (const glm::uvec3& t : whole.triangles)
        if (is_drawn(t)) part_of[find(t[0])] = 0;
    std::vector<primitive> parts;
    for (std::uint32_t v = 0; v < count; ++v)
        if (part_of[v] != none) {
            part_of[v] = static_cast<std::uint32_t>(parts.size());
            parts.emplace_back().material = whole.material;
        }
    // Lists of their length, and none that grows: all parts together are as large as the whole.
    std::vector<std::array<std::size_t, 2>> lengths(parts.size()); // vertices, triangles
    for (const glm::uvec3& t : whole.triangles) {
        if (!is_drawn(t)) continue;
        std::array<std::size_t, 2>& length = lengths[part_of[find(t[0])]];
        ++length[1];
        for (int i = 0; i < 3; ++i)
            if (std::exchange(vertex_in[t[i]], 0U) == none) ++length[0];
    }
    for (std::size_t p = 0; p < parts.size(); ++p) {
        parts[p].triangles.reserve(lengths[p][1]);
        parts[p].positions.reserve(lengths[p][0]);
        if (!whole.texcoords.empty()) parts[p].texcoords.reserve(lengths[p][0]);
        if (!whole.colors.empty()) parts[p].colors.reserve(lengths[p][0]);
    }
    std::fill(vertex_in.begin(), vertex_in.end(), none);
    for (const glm::uvec3& t : whole.triangles) {
        if (!is_drawn(t)) continue;
        primitive& to = parts[part_of[find(t[0])]];
        glm::uvec3& made = to.triangles.emplace_back();
        for (int i = 0; i < 3; ++i) {
            std::uint32_t& v = vertex_in[t[i]];
            if (v == none) {
                v = static_cast<std::uint32_t>(to.positions.size());
                to.positions.push_back(whole.positions[t[i]]);
                if (!whole.texcoords.empty()) to.texcoords.push_back(whole.texcoords[t[i]]);
                if (!whole.colors.empty()) to.colors.push_back(whole.colors[t[i]]);
            }
            made[i] = v;
        }
    }
    return parts;
}

} // namespace voxelize
