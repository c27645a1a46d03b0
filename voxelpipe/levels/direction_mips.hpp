// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Levels of a dense grid of light, one value for each of six directions from level 1 on (anisotropic voxels, Crassin et
// al. 2011), and their samples: what cone tracing reads. A value is a glm::vec4: colour multiplied by opacity, and
// opacity. A voxel's value in a direction is what one sees who looks along it: in each of its four columns the nearer
// child lies over the farther one, and the columns are averaged. So a wall that is lit on one side keeps its two sides
// apart, and a layer that fills a voxel's cross-section is opaque on every level. Values are stored in 8 bytes, with 11
// significant bits each, so that their products with weights are exact and samples need few fused steps, which are slow
// on a plain x86-64.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// Extent of a level: half of the one before, rounded up.
[[nodiscard]] VOXELPIPE_HD inline glm::ivec3 mip_extent(const glm::ivec3& extent, int level) {
    return {((extent.x - 1) >> level) + 1, ((extent.y - 1) >> level) + 1, ((extent.z - 1) >> level) + 1};
}
// The last level, of one voxel.
[[nodiscard]] VOXELPIPE_HD inline int last_mip_level(const glm::ivec3& extent) {
    int level = 0;
    for (glm::ivec3 e = extent; e.x > 1 || e.y > 1 || e.z > 1; e = mip_extent(extent, level)) ++level;
    return level;
}

// Numbers of directions of view: 2 * axis for the look towards +axis, 2 * axis + 1 for the look towards -axis.
inline constexpr int num_directions = 6;

// `front` over `back`.
[[nodiscard]] VOXELPIPE_HD inline glm::vec4 over(const glm::vec4& front, const glm::vec4& back) {
    const float through = exact::sub(1.0f, front.w);
    return {exact::fma(through, back.x, front.x), exact::fma(through, back.y, front.y),
            exact::fma(through, back.z, front.z), exact::fma(through, back.w, front.w)};
}

// A parent's value in a direction from those of its 8 children, in Morton order.
[[nodiscard]] VOXELPIPE_HD inline glm::vec4 fold_along(const glm::vec4 (&children)[8], int direction) {
    const int axis = direction >> 1, step = 1 << axis, near = direction & 1 ? step : 0;
    glm::vec4 sum(0.0f);
    for (int c = 0; c < 8; ++c) {
        if ((c & step) != 0) continue; // one child of each column
        const glm::vec4 v = over(children[c + near], children[c + step - near]);
        for (int k = 0; k < 4; ++k) sum[k] = exact::add(sum[k], v[k]);
    }
    for (int k = 0; k < 4; ++k) sum[k] = exact::mul(sum[k], 0.25f);
    return sum;
}

namespace core {

// The nearest value of 11 significant bits, of float's range; ties to even.
[[nodiscard]] VOXELPIPE_HD inline float to_11_bits(float v) {
    const auto bits = bit_cast<std::uint32_t>(v);
    return bit_cast<float>((bits + 0xfffu + (bits >> 13 & 1u)) & ~0x1fffu);
}

} // namespace core

// Light and opacity in 8 bytes: four halves, x lowest, of values from 0 to 65504. Smaller ones become 0 where they are
// below 2^-14.
struct alignas(8) packed_light {
    std::uint32_t xy = 0; // y above x
    std::uint32_t zw = 0; // w above z
    friend bool operator==(const packed_light&, const packed_light&) = default;
};
// To the nearest, ties to even; what is larger than 65504 becomes that, and what is not a number 0.
[[nodiscard]] VOXELPIPE_HD inline packed_light pack_light(const glm::vec4& v) {
    std::uint32_t h[4];
    for (int k = 0; k < 4; ++k) {
        const float bounded = v[k] < 65504.0f ? v[k] : 65504.0f;
        const auto bits = core::bit_cast<std::uint32_t>(bounded);
        h[k] = v[k] >= 0x1p-14f ? (bits + 0xfffu + (bits >> 13 & 1u) - (112u << 23)) >> 13 : 0u;
    }
    return {h[0] | h[1] << 16, h[2] | h[3] << 16};
}
namespace core {
// 2^-112 times the values: a shift away, since halves and floats differ in the exponent's bias.
[[nodiscard]] VOXELPIPE_HD inline glm::vec4 unpack_scaled(const packed_light& p) {
    return {bit_cast<float>(p.xy << 13 & 0x0fffe000u), bit_cast<float>(p.xy >> 3 & 0x0fffe000u),
            bit_cast<float>(p.zw << 13 & 0x0fffe000u), bit_cast<float>(p.zw >> 3 & 0x0fffe000u)};
}
} // namespace core
// Exact.
[[nodiscard]] VOXELPIPE_HD inline glm::vec4 unpack_light(const packed_light& p) {
    const glm::vec4 v = core::unpack_scaled(p);
    return {exact::mul(v.x, 0x1p112f), exact::mul(v.y, 0x1p112f), exact::mul(v.z, 0x1p112f), exact::mul(v.w, 0x1p112f)};
}

// The way that a voxel's surface faces, in 24 bits: a unit vector's parts as signed bytes, x lowest. 0 faces all ways.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t pack_facing(const glm::vec3& normal) {
    std::uint32_t packed = 0;
    for (int a = 0; a < 3; ++a) {
        const float scaled = exact::fma(normal[a], 127.0f, 128.5f); // positive, so that the conversion is a floor
        packed |= (static_cast<std::uint32_t>(static_cast<int>(scaled) - 128) & 0xffu) << (8 * a);
    }
    return packed;
}
// The part of a voxel's light that leaves it against a look along the unit vector `along`: none on its back and across,
// all from 20 degrees on.
[[nodiscard]] VOXELPIPE_HD inline float facing_part(std::uint32_t packed, const glm::vec3& along) {
    if (packed == 0) return 1.0f;
    float towards = 0.0f;
    for (int a = 0; a < 3; ++a) {
        const auto part = static_cast<float>(static_cast<std::int8_t>(packed >> (8 * a) & 0xffu));
        towards = exact::fma(-along[a], part, towards);
    }
    const float shown = exact::mul(towards, 3.0f / 127.0f);
    return shown > 0.0f ? (shown < 1.0f ? shown : 1.0f) : 0.0f;
}

// Refers to the levels. finest: one value a voxel, level 0. coarse: the levels from 1 on, one after the other, each as
// six arrays, one a direction. x fastest, then y, then z.
struct direction_mips_view {
    const packed_light* finest = nullptr;   // level 0
    const packed_light* coarse = nullptr;   // levels 1 to last_level
    const std::uint32_t* facings = nullptr; // of level 0; null: all voxels face all ways
    glm::ivec3 extent{0};                   // of level 0
    int last_level = 0;                     // the level of one voxel
    std::uint64_t first[22] = {}; // number of values of `coarse` before a level; the last entry is that of them all

    // Number of voxels of a level.
    [[nodiscard]] VOXELPIPE_HD std::size_t num_voxels(int level) const {
        const glm::ivec3 e = mip_extent(extent, level);
        return static_cast<std::size_t>(e.x) * static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z);
    }
    // The array of a level and direction; level 0 has one for all directions.
    [[nodiscard]] VOXELPIPE_HD const packed_light* values(int level, int direction) const {
        if (level == 0) return finest;
        return coarse + first[level] + static_cast<std::size_t>(direction) * num_voxels(level);
    }
    // A voxel of a level; zero outside.
    [[nodiscard]] VOXELPIPE_HD glm::vec4 fetch(int level, int direction, const glm::ivec3& v) const {
        const glm::ivec3 e = mip_extent(extent, level);
        if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= e.x || v.y >= e.y || v.z >= e.z) return glm::vec4(0.0f);
        const std::size_t i = index(e, v);
        return level != 0 ? unpack_light(values(level, direction)[i]) : seen(i, axis_of(direction));
    }

    // The value of a level around `position`, in voxels of level 0, for a look along the unit vector `along`: linear
    // between the eight nearest voxels (zero outside), the three directions that `along` has a part in weighted by its
    // squares. Zero where the voxels have no opacity in the first of these.
    [[nodiscard]] VOXELPIPE_HD glm::vec4 sample(int level, const glm::vec3& position, const glm::vec3& along) const {
        const glm::ivec3 e = mip_extent(extent, level);
        const float scale = core::bit_cast<float>(static_cast<std::uint32_t>(127 - level) << 23); // 2^-level
        int low[3];
        float high_part[3];
        for (int a = 0; a < 3; ++a) {
            const float p = exact::fma(position[a], scale, -0.5f);
            // Far outside nothing is near; the bound keeps the conversion within an int.
            if (!(p > -1.0f && p < static_cast<float>(e[a]))) return glm::vec4(0.0f);
            low[a] = static_cast<int>(exact::add(p, 1.0f)) - 1; // floor
            high_part[a] = exact::sub(p, static_cast<float>(low[a]));
        }
        // The eight voxels as steps from the lowest. Those outside are read at the edge, with a weight of 0.
        int begin[3], step[3];
        bool inside[3][2];
        for (int a = 0; a < 3; ++a) {
            inside[a][0] = low[a] >= 0;
            inside[a][1] = low[a] + 1 < e[a];
            begin[a] = inside[a][0] ? low[a] : 0;
            step[a] = inside[a][0] && inside[a][1] ? 1 : 0;
        }
        const std::size_t lowest = index(e, {begin[0], begin[1], begin[2]});
        const int step_y = step[1] * e.x, step_z = step[2] * (e.x * e.y);
        const auto slot = [&](int c) {
            return lowest + static_cast<std::size_t>(((c & 1) != 0 ? step[0] : 0) + ((c & 2) != 0 ? step_y : 0) +
                                                     ((c & 4) != 0 ? step_z : 0));
        };
        const std::size_t n = num_voxels(level);
        const packed_light* const from = level == 0 ? finest : coarse + first[level];
        const packed_light* side = level == 0 || along.x >= 0.0f ? from : from + n;
        packed_light light[8];
        std::uint32_t opacity = 0;
        for (int c = 0; c < 8; ++c) {
            light[c] = side[slot(c)];
            opacity |= light[c].zw >> 16;
        }
        if (opacity == 0) return glm::vec4(0.0f);

        // Weights in multiples of 2^-13, which add up to 1: the largest takes what the others' rounding left.
        float part[8], left = 1.0f;
        int largest = 0;
        for (int c = 0; c < 8; ++c) {
            const auto along_axis = [&](int a) {
                return (c >> a & 1) != 0 ? high_part[a] : exact::sub(1.0f, high_part[a]);
            };
            part[c] = exact::sub(exact::fma(exact::mul(along_axis(0), along_axis(1)), along_axis(2), 1024.0f), 1024.0f);
            left = exact::sub(left, part[c]);
        }
        float most = part[0];
        for (int c = 1; c < 8; ++c) {
            largest = part[c] > most ? c : largest;
            most = part[c] > most ? part[c] : most;
        }
        for (int c = 0; c < 8; ++c) {
            part[c] = c == largest ? exact::add(part[c], left) : part[c];
            if (!(inside[0][c & 1] && inside[1][c >> 1 & 1] && inside[2][c >> 2])) part[c] = 0.0f;
        }
        // A weight of 13 bits times a value of 11 is exact: contracted or not, a sum of them rounds once a term.
        glm::vec4 sum(0.0f);
        if (level == 0) {
            for (int c = 0; c < 8; ++c) {
                const glm::vec4 value = shown(light[c], slot(c), along);
                for (int k = 0; k < 4; ++k) sum[k] = add_product(part[c], value[k], sum[k]);
            }
            return sum;
        }
        for (int c = 0; c < 8; ++c) part[c] = exact::mul(part[c], 0x1p112f); // of unpack_scaled
        for (int a = 0; a < 3; ++a) {
            if (a != 0) {
                side = from + static_cast<std::size_t>(2 * a + (along[a] < 0.0f ? 1 : 0)) * n;
                for (int c = 0; c < 8; ++c) light[c] = side[slot(c)];
            }
            glm::vec4 mean(0.0f);
            for (int c = 0; c < 8; ++c) {
                const glm::vec4 value = core::unpack_scaled(light[c]);
                for (int k = 0; k < 4; ++k) mean[k] = add_product(part[c], value[k], mean[k]);
            }
            const float weight = exact::mul(along[a], along[a]);
            for (int k = 0; k < 4; ++k) sum[k] = exact::fma(weight, mean[k], sum[k]);
        }
        return sum;
    }
    // The same between two levels: `level` is from 0 to last_level, and what lies beyond counts as its end. Zero where
    // the higher one is.
    [[nodiscard]] VOXELPIPE_HD glm::vec4 sample(float level, const glm::vec3& position, const glm::vec3& along) const {
        if (!(level > 0.0f)) return sample(0, position, along);
        if (level >= static_cast<float>(last_level)) return sample(last_level, position, along);
        const int below = static_cast<int>(level);
        const float above = exact::sub(level, static_cast<float>(below));
        if (above == 0.0f) return sample(below, position, along);
        const glm::vec4 b = sample(below + 1, position, along); // covers what the lower one looks at
        if (b.w == 0.0f) return glm::vec4(0.0f);
        const glm::vec4 a = sample(below, position, along);
        glm::vec4 mixed;
        for (int k = 0; k < 4; ++k) mixed[k] = exact::lerp(a[k], b[k], above);
        return mixed;
    }

    // Voxel i of level 0 for a look along a unit vector.
    [[nodiscard]] VOXELPIPE_HD glm::vec4 seen(std::size_t i, const glm::vec3& along) const {
        return shown(finest[i], i, along);
    }
    // The same, of what stands there.
    [[nodiscard]] VOXELPIPE_HD glm::vec4 shown(const packed_light& light, std::size_t i, const glm::vec3& along) const {
        glm::vec4 v = unpack_light(light);
        if (facings == nullptr) return v;
        const float part = facing_part(facings[i], along);
        for (int k = 0; k < 3; ++k) v[k] = core::to_11_bits(exact::mul(v[k], part));
        return v;
    }
    // The unit vector of a number of a direction.
    [[nodiscard]] VOXELPIPE_HD static glm::vec3 axis_of(int direction) {
        glm::vec3 along(0.0f);
        along[direction >> 1] = (direction & 1) != 0 ? -1.0f : 1.0f;
        return along;
    }
    // Where voxel v of an array of extent e stands.
    [[nodiscard]] VOXELPIPE_HD static std::size_t index(const glm::ivec3& e, const glm::ivec3& v) {
        const auto wide = [](int n) { return static_cast<std::size_t>(n); };
        return (wide(v.z) * wide(e.y) + wide(v.y)) * wide(e.x) + wide(v.x);
    }

private:
    // a * b + c where a * b is exact: one rounding, fused or not.
    [[nodiscard]] VOXELPIPE_HD static float add_product(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
        return exact::fma(a, b, c);
#else
        return exact::add(exact::mul(a, b), c);
#endif
    }
};

namespace core {

// Makes voxel i of a level, for all six directions.
struct fold_mip_level {
    direction_mips_view mips;
    packed_light* out; // the level's first array
    int level;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::ivec3 e = mip_extent(mips.extent, level), below = mip_extent(mips.extent, level - 1);
        const auto nx = static_cast<std::uint64_t>(e.x), ny = static_cast<std::uint64_t>(e.y);
        const glm::ivec3 corner(2 * static_cast<int>(i % nx), 2 * static_cast<int>(i / nx % ny),
                                2 * static_cast<int>(i / (nx * ny)));
        const std::size_t n = mips.num_voxels(level);
        packed_light light[8];
        std::size_t slot[8];
        bool inside[8];
        std::uint32_t opacity = 0;
        for (int c = 0; c < 8; ++c) {
            const glm::ivec3 v = corner + glm::ivec3(c & 1, c >> 1 & 1, c >> 2);
            inside[c] = v.x < below.x && v.y < below.y && v.z < below.z;
            slot[c] = inside[c] ? direction_mips_view::index(below, v) : 0;
            light[c] = inside[c] ? mips.values(level - 1, 0)[slot[c]] : packed_light{};
            opacity |= light[c].zw >> 16;
        }
        for (int d = 0; d < num_directions; ++d) {
            packed_light& to = out[static_cast<std::size_t>(d) * n + i];
            if (opacity == 0) { // most of a scene is empty
                to = {};
                continue;
            }
            const packed_light* const from = mips.values(level - 1, d);
            glm::vec4 children[8];
            for (int c = 0; c < 8; ++c)
                children[c] = !inside[c]   ? glm::vec4(0.0f)
                              : level == 1 ? mips.shown(light[c], slot[c], direction_mips_view::axis_of(d))
                                           : unpack_light(d == 0 ? light[c] : from[slot[c]]);
            to = pack_light(fold_along(children, d));
        }
    }
};

} // namespace core

// Owns the levels, on Backend: 8 bytes a voxel for level 0, 6/7 of that for all others, and 4 bytes a voxel with
// facings. The constructor allocates and does not initialise. Throws what Backend::buffer throws.
template <class Backend>
class direction_mips {
public:
    // For level 0 of that extent.
    direction_mips(Backend& backend, const glm::ivec3& extent, bool with_facings = false)
        : view_(sizes(extent)), finest_(backend, view_.num_voxels(0)),
          coarse_(backend, view_.first[view_.last_level + 1]),
          facings_(backend, with_facings ? view_.num_voxels(0) : 0) {
        view_.finest = finest_.data();
        view_.coarse = coarse_.data();
        if (with_facings) view_.facings = facings_.data();
    }
    // Level 0, to be written by the caller on the backend: x fastest, then y, then z.
    [[nodiscard]] packed_light* finest() { return finest_.data(); }
    // Where each voxel of level 0 faces, to be written likewise: pack_facing. The two sides of a wall then keep apart
    // on levels whose voxels are wider than it. Null without facings.
    [[nodiscard]] std::uint32_t* facings() { return view_.facings != nullptr ? facings_.data() : nullptr; }
    // For samples, on the backend. Valid as long as this object.
    [[nodiscard]] const direction_mips_view& view() const { return view_; }

    // Makes the other levels. In the order of the backend's stream.
    void build(Backend& backend) {
        for (int level = 1; level <= view_.last_level; ++level)
            backend.for_each(view_.num_voxels(level),
                             core::fold_mip_level{view_, coarse_.data() + view_.first[level], level});
    }
    // A copy of the levels from 1 on.
    [[nodiscard]] auto coarse_to_host(Backend& backend) const { return coarse_.to_host(backend); }

private:
    [[nodiscard]] static direction_mips_view sizes(const glm::ivec3& extent) {
        direction_mips_view v;
        v.extent = extent;
        v.last_level = last_mip_level(extent);
        for (int l = 1; l <= v.last_level; ++l) v.first[l + 1] = v.first[l] + num_directions * v.num_voxels(l);
        return v;
    }
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    direction_mips_view view_;
    buffer<packed_light> finest_, coarse_;
    buffer<std::uint32_t> facings_;
};

} // namespace voxelpipe
