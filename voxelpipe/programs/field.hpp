// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// field2d and field3d: textures in plain memory, for shaders and programs of every stage, with the same bits on every
// backend. (A cudaTextureObject_t filters with weights of 9 bits, and other bits on other machines; a shader for the
// device only may hold one.)
//
// Coordinates run from 0 to 1 along each axis and are wrapped first: repeat takes the fraction, mirror folds at every
// integer, clamp cuts off; NaN is 0. Texel i of n has its centre at (i + 1/2) / n. Nearest takes texel floor(c n).
// Linear computes x = c n - 1/2 with one rounding. Its weight is x - floor(x): exact from x = 0 on, a multiple of the
// float's last place, and rounded once before the first texel's centre. Values are mixed along x, then y, then z, by a
// + t (b - a) in two roundings each (exact::lerp).

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/value_traits.hpp>
#include <voxelpipe/mesh_source.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace voxelpipe {

// What a field is beyond its border: repeat starts again, mirror runs back, clamp keeps the last texel.
enum class wrap_mode : std::uint8_t { repeat, mirror, clamp };
// How texels become values: nearest takes one, linear mixes two along each axis.
enum class filter_mode : std::uint8_t { nearest, linear };

namespace core {

// A coordinate brought into [0, 1]; NaN gives 0.
[[nodiscard]] VOXELPIPE_HD inline float wrap_coordinate(wrap_mode mode, float c) {
    if (mode == wrap_mode::repeat) {
        c = exact::sub(c, std::floor(c));
    } else if (mode == wrap_mode::mirror) {
        c = exact::fma(-2.0f, std::floor(c * 0.5f), c);
        if (c > 1.0f) c = exact::sub(2.0f, c);
    }
    return c > 0.0f ? (c < 1.0f ? c : 1.0f) : 0.0f;
}
// A texel number from -1 to size brought into the field.
[[nodiscard]] VOXELPIPE_HD inline int wrap_texel(wrap_mode mode, int i, int size) {
    if (mode == wrap_mode::repeat) return i < 0 ? i + size : i >= size ? i - size : i;
    return i < 0 ? 0 : i >= size ? size - 1 : i;
}
// The texels of one axis that a coordinate takes, and the second one's weight.
struct axis_texels {
    int first, second;
    float weight;
};
[[nodiscard]] VOXELPIPE_HD inline axis_texels find_texels(wrap_mode wrap, filter_mode filter, float coordinate,
                                                          int size) {
    const float c = wrap_coordinate(wrap, coordinate);
    const auto n = static_cast<float>(size);
    if (filter == filter_mode::nearest) {
        const int i = wrap_texel(wrap, static_cast<int>(std::floor(exact::mul(c, n))), size);
        return {i, i, 0.0f};
    }
    const float x = exact::fma(c, n, -0.5f);
    const float low = std::floor(x);
    return {wrap_texel(wrap, static_cast<int>(low), size), wrap_texel(wrap, static_cast<int>(low) + 1, size),
            exact::sub(x, low)};
}

template <class T>
[[nodiscard]] VOXELPIPE_HD T mix_texels(const T& a, const T& b, float t) {
    if constexpr (std::is_same_v<T, float>) {
        return exact::lerp(a, b, t);
    } else {
        T r;
        for (glm::length_t i = 0; i < T::length(); ++i) r[i] = exact::lerp(a[i], b[i], t);
        return r;
    }
}

template <class T>
inline constexpr bool is_field_value = std::is_same_v<T, float>;
template <glm::length_t N, glm::qualifier Q>
inline constexpr bool is_field_value<glm::vec<N, float, Q>> = true;

} // namespace core

// How stored texels become values: unchanged. Another decoder has a type `texel` and a call that turns one into the
// value.
template <class T>
struct as_stored {
    using texel = T;                                                 // what memory holds
    VOXELPIPE_HD const T& operator()(const T& t) const { return t; } // The texel itself.
};

// A field over a plane. T: float, or a glm vector of floats. Does not own its texels: rows of `width`, `height` of
// them, then the rows of the next level, of half the size, rounded down but at least 1. Sizes are 1 to 2^22.
template <class T, class Decode = as_stored<T>>
struct field2d {
    static_assert(core::is_field_value<T>, "voxelpipe: a field holds float or a glm vector of floats");
    using texel_type = typename Decode::texel; // what memory holds

    const texel_type* texels = nullptr;       // all levels, in the memory of the backend that draws
    int width = 0, height = 0;                // texels of level 0
    int levels = 1;                           // 1: level 0 alone
    filter_mode filter = filter_mode::linear; // between texels; levels are not mixed
    wrap_mode wrap_x = wrap_mode::repeat, wrap_y = wrap_mode::repeat; // beyond the border
    Decode decode{};                                                  // turns a texel into a value

    // The value at (0, 0) to (1, 1); the first row lies at y = 0.
    [[nodiscard]] VOXELPIPE_HD T operator()(const glm::vec2& at) const {
        const core::axis_texels x = core::find_texels(wrap_x, filter, at.x, width),
                                y = core::find_texels(wrap_y, filter, at.y, height);
        if (filter == filter_mode::nearest) return fetch(x.first, y.first);
        return core::mix_texels(core::mix_texels(fetch(x.first, y.first), fetch(x.second, y.first), x.weight),
                                core::mix_texels(fetch(x.first, y.second), fetch(x.second, y.second), x.weight),
                                y.weight);
    }
    // The same on a level, from 0 to levels - 1.
    [[nodiscard]] VOXELPIPE_HD T operator()(const glm::vec2& at, int level) const { return on_level(level)(at); }
    // A texel of level 0: 0 <= x < width, 0 <= y < height.
    [[nodiscard]] VOXELPIPE_HD T fetch(int x, int y) const {
        return decode(
            texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]);
    }
    // A level, and those after it, as a field of its own.
    [[nodiscard]] VOXELPIPE_HD field2d on_level(int level) const {
        field2d f = *this;
        for (; level > 0; --level) {
            f.texels += static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height);
            f.width = f.width > 1 ? f.width / 2 : 1;
            f.height = f.height > 1 ? f.height / 2 : 1;
            --f.levels;
        }
        return f;
    }
};

// A field over a box: `depth` slices of rows.
template <class T, class Decode = as_stored<T>>
struct field3d {
    static_assert(core::is_field_value<T>, "voxelpipe: a field holds float or a glm vector of floats");
    using texel_type = typename Decode::texel; // what memory holds

    const texel_type* texels = nullptr;       // all levels, in the memory of the backend that draws
    int width = 0, height = 0, depth = 0;     // texels of level 0
    int levels = 1;                           // 1: level 0 alone
    filter_mode filter = filter_mode::linear; // between texels; levels are not mixed
    // Beyond the border.
    wrap_mode wrap_x = wrap_mode::repeat, wrap_y = wrap_mode::repeat, wrap_z = wrap_mode::repeat;
    Decode decode{}; // turns a texel into a value

    // The value at (0, 0, 0) to (1, 1, 1).
    [[nodiscard]] VOXELPIPE_HD T operator()(const glm::vec3& at) const {
        const core::axis_texels x = core::find_texels(wrap_x, filter, at.x, width),
                                y = core::find_texels(wrap_y, filter, at.y, height),
                                z = core::find_texels(wrap_z, filter, at.z, depth);
        if (filter == filter_mode::nearest) return fetch(x.first, y.first, z.first);
        T slice[2];
        for (int k = 0; k < 2; ++k) {
            const int at_z = k == 0 ? z.first : z.second;
            slice[k] = core::mix_texels(
                core::mix_texels(fetch(x.first, y.first, at_z), fetch(x.second, y.first, at_z), x.weight),
                core::mix_texels(fetch(x.first, y.second, at_z), fetch(x.second, y.second, at_z), x.weight), y.weight);
        }
        return core::mix_texels(slice[0], slice[1], z.weight);
    }
    [[nodiscard]] VOXELPIPE_HD T operator()(const glm::vec3& at, int level) const { return on_level(level)(at); }
    // A texel of level 0; x, y and z within it.
    [[nodiscard]] VOXELPIPE_HD T fetch(int x, int y, int z) const {
        const auto wide = [](int n) { return static_cast<std::size_t>(n); };
        return decode(texels[(wide(z) * wide(height) + wide(y)) * wide(width) + wide(x)]);
    }
    // A level as a field of its own, 0 <= level < levels.
    [[nodiscard]] VOXELPIPE_HD field3d on_level(int level) const {
        field3d f = *this;
        for (; level > 0; --level) {
            f.texels += static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height) *
                        static_cast<std::size_t>(f.depth);
            f.width = f.width > 1 ? f.width / 2 : 1;
            f.height = f.height > 1 ? f.height / 2 : 1;
            f.depth = f.depth > 1 ? f.depth / 2 : 1;
            --f.levels;
        }
        return f;
    }
};

// ---- levels ---------------------------------------------------------------------------------------------------------

namespace core {

// The texels of one axis that a texel of the next level covers, in units of 1 / (that level's size) texels.
struct box_cover {
    std::int64_t begin, end, size;
    box_cover(int i, int from, int to) : begin(std::int64_t{i} * from), end((std::int64_t{i} + 1) * from), size(to) {}
    [[nodiscard]] int first() const { return static_cast<int>(begin / size); }
    [[nodiscard]] int last() const { return static_cast<int>((end - 1) / size); }
    [[nodiscard]] double weight(int texel) const {
        return static_cast<double>(std::min(end, (texel + std::int64_t{1}) * size) - std::max(begin, texel * size));
    }
};
template <class T>
[[nodiscard]] float& component(T& value, glm::length_t i) {
    if constexpr (std::is_same_v<T, float>)
        return value;
    else
        return value[i];
}

} // namespace core

// The number of levels of a field of that size, down to one texel.
[[nodiscard]] inline int num_levels(int width, int height, int depth = 1) {
    int levels = 1;
    for (int side = std::max({width, height, depth}); side > 1; side /= 2) ++levels;
    return levels;
}

// A field's texels with all of its levels, for field2d (depth 1) or field3d. A texel of a level is the mean of the box
// of the level before that it covers: a sum in double, x fastest, by one fused step a texel, divided, and rounded to
// float. On the host. Throws std::invalid_argument if the number of texels is not width * height * depth.
template <class T>
[[nodiscard]] std::vector<T> with_levels(array_view<const T> texels, int width, int height, int depth = 1) {
    const auto wide = [](int n) { return static_cast<std::size_t>(n); };
    if (width < 1 || height < 1 || depth < 1 || texels.size() != wide(width) * wide(height) * wide(depth))
        throw std::invalid_argument("voxelpipe: the number of a field's texels is not its size");
    glm::length_t components = 1;
    if constexpr (!std::is_same_v<T, float>) components = T::length();
    std::vector<T> all(texels.begin(), texels.end());
    std::size_t from = 0;
    while (width > 1 || height > 1 || depth > 1) {
        const int w = std::max(width / 2, 1), h = std::max(height / 2, 1), d = std::max(depth / 2, 1);
        const double area = static_cast<double>(width) * height * depth; // of the covers' weights
        const std::size_t to = all.size();
        all.resize(to + wide(w) * wide(h) * wide(d));
        std::size_t next = to;
        for (int z = 0; z < d; ++z)
            for (int y = 0; y < h; ++y)
                for (int x = 0; x < w; ++x, ++next) {
                    const core::box_cover cx(x, width, w), cy(y, height, h), cz(z, depth, d);
                    for (glm::length_t i = 0; i < components; ++i) {
                        double sum = 0.0;
                        for (int sz = cz.first(); sz <= cz.last(); ++sz)
                            for (int sy = cy.first(); sy <= cy.last(); ++sy)
                                for (int sx = cx.first(); sx <= cx.last(); ++sx) {
                                    const std::size_t at =
                                        from + (wide(sz) * wide(height) + wide(sy)) * wide(width) + wide(sx);
                                    const double weight =
                                        exact::mul(exact::mul(cx.weight(sx), cy.weight(sy)), cz.weight(sz));
                                    sum = exact::fma(weight, exact::to_double(core::component(all[at], i)), sum);
                                }
                        core::component(all[next], i) = exact::to_float(exact::div(sum, area));
                    }
                }
        from = to;
        width = w;
        height = h;
        depth = d;
    }
    return all;
}

} // namespace voxelpipe
