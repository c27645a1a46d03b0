// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Levels of dense grids, samples of light and rays through bits, for both backends.

#include <voxelpipe/levels/brick_bits.hpp>
#include <voxelpipe/levels/dense_bits.hpp>
#include <voxelpipe/levels/dense_levels.hpp>

#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace levels {

namespace vp = voxelpipe;

inline const glm::ivec3 extent{37, 21, 30}; // halves are rounded up on every axis

VOXELPIPE_HD inline std::uint32_t hash(std::uint64_t n) {
    n = (n + 1) * 0x9e3779b97f4a7c15u;
    n = (n ^ n >> 31) * 0xbf58476d1ce4e5b9u;
    return static_cast<std::uint32_t>(n >> 32);
}
VOXELPIPE_HD inline float fraction(std::uint64_t n) { // in [0, 1)
    return vp::exact::mul(static_cast<float>(hash(n) >> 8), 0x1p-24f);
}

// A third of the voxels exist.
struct voxels {
    VOXELPIPE_HD auto operator()(const glm::ivec3& v) const {
        const auto n = static_cast<std::uint64_t>((v.z * 64 + v.y) * 64 + v.x);
        const bool exists = hash(n) % 3 == 0 && v.x + v.y > 9;
        return vp::level_voxel<glm::vec2>{
            exists,
            exists ? glm::vec2(vp::exact::sub(fraction(n + 1000000), 0.5f), fraction(n + 2000000)) : glm::vec2(),
            hash(n + 3) % 5 + 1};
    }
};
// A reducer of the caller's: what the first and the last child differ by.
struct spread {
    VOXELPIPE_HD glm::vec2 operator()(std::span<const glm::vec2> children) const {
        return {vp::exact::sub(children[children.size() - 1].x, children[0].x),
                vp::exact::sub(children[children.size() - 1].y, children[0].y)};
    }
};

template <class T>
void append(std::vector<std::byte>& to, const std::vector<T>& from) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span<const T>(from));
    to.insert(to.end(), bytes.begin(), bytes.end());
}

template <class Backend, class Reducer>
[[nodiscard]] std::vector<std::byte> reduced(Backend& backend, const Reducer& reducer) {
    const auto made = vp::reduce_levels(backend, extent, voxels{}, reducer);
    std::vector<std::byte> bytes;
    for (int l = 0; l < made.num_levels(); ++l) {
        append(bytes, made.values[static_cast<std::size_t>(l)].to_host(backend));
        append(bytes, made.exists[static_cast<std::size_t>(l)].to_host(backend));
    }
    return bytes;
}
template <class Backend>
[[nodiscard]] std::vector<std::vector<std::byte>> all_reduced(Backend& backend) {
    namespace r = vp::reduce;
    return {reduced(backend, r::sum{}),
            reduced(backend, r::mean<0>{}),
            reduced(backend, r::mean_of_voxels{}),
            reduced(backend, r::mean_of_volume{}),
            reduced(backend, r::min{}),
            reduced(backend, r::max{}),
            reduced(backend, r::majority{}),
            reduced(backend, spread{})};
}

// ---- light ----------------------------------------------------------------------------------------------------------

struct set_light {
    vp::packed_light* finest;
    std::uint32_t* facings; // or null
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const float opacity = hash(i) % 3 == 0 ? fraction(i + 7) : 0.0f;
        finest[i] = vp::pack_light({vp::exact::mul(opacity, fraction(3 * i)), vp::exact::mul(opacity, fraction(5 * i)),
                                    vp::exact::mul(opacity, 0.25f), opacity});
        if (facings == nullptr) return;
        glm::vec3 normal(0.0f);
        normal[static_cast<int>(i % 3)] = i % 2 == 0 ? 0.6f : -0.6f;
        normal[static_cast<int>((i + 1) % 3)] = 0.8f;
        facings[i] = i % 5 == 0 ? 0 : vp::pack_facing(normal);
    }
};
inline constexpr std::uint64_t num_samples = 4000;
struct sample_light {
    vp::direction_mips_view mips;
    glm::vec4* out;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto at = [&](int a) { // from a little outside on one side to as far on the other
            return vp::exact::fma(fraction(7 * i + static_cast<std::uint64_t>(a)),
                                  static_cast<float>(mips.extent[a] + 6), -3.0f);
        };
        glm::vec3 along(0.0f);
        along[static_cast<int>(i % 3)] = 0.6f;
        along[static_cast<int>((i + 1) % 3)] = i % 2 == 0 ? 0.8f : -0.8f;
        out[i] = mips.sample(vp::exact::fma(fraction(11 * i), 8.0f, -1.0f), {at(0), at(1), at(2)}, along);
    }
};
template <class Backend>
[[nodiscard]] std::vector<std::byte> all_light(Backend& backend) {
    vp::direction_mips<Backend> mips(backend, extent, true);
    backend.for_each(mips.view().num_voxels(0), set_light{mips.finest(), mips.facings()});
    mips.build(backend);
    typename Backend::template buffer<glm::vec4> out(backend, std::size_t{num_samples});
    backend.for_each(num_samples, sample_light{mips.view(), out.data()});
    std::vector<std::byte> bytes;
    append(bytes, mips.coarse_to_host(backend));
    append(bytes, out.to_host(backend));
    return bytes;
}

// ---- bits -----------------------------------------------------------------------------------------------------------

inline std::vector<std::uint32_t> some_bits() {
    std::vector<std::uint32_t> words(vp::core::storage_map<vp::bit, vp::layout::linear>::elements(extent));
    for (std::size_t i = 0; i < words.size(); ++i)
        words[i] = hash(i) & hash(i + 50000) & hash(i + 100000) & hash(i + 150000) & hash(i + 200000);
    return words;
}
struct ray_result {
    double distance;
    std::uint64_t rank;
    glm::ivec3 voxel;
    std::int32_t face;      // axis, 8 from above, -1 no voxel
    std::uint32_t blocked;  // in float: 1 by bits, 2 by bricks
    std::uint32_t children; // of a voxel
};
struct cast_rays {
    vp::dense_bits bits;
    vp::brick_bits_view bricks;
    ray_result* out;
    [[nodiscard]] VOXELPIPE_HD static glm::dvec3 origin_of(std::uint64_t i) {
        glm::dvec3 o;
        for (int a = 0; a < 3; ++a)
            o[a] = vp::exact::fma(static_cast<double>(fraction(9 * i + static_cast<std::uint64_t>(a))), 60.0, -15.0);
        return o;
    }
    [[nodiscard]] VOXELPIPE_HD static glm::dvec3 direction_of(std::uint64_t i) {
        glm::dvec3 d;
        for (int a = 0; a < 3; ++a)
            d[a] = static_cast<double>(fraction(9 * i + 3 + static_cast<std::uint64_t>(a))) - 0.5;
        if (i % 7 == 0) d[static_cast<int>(i % 3)] = 0;
        if (i % 11 == 0) d[static_cast<int>((i + 1) % 3)] = 0;
        return d;
    }
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const vp::voxel_hit hit = bits.first_hit(origin_of(i), direction_of(i), 100.0);
        const glm::dvec3 o = origin_of(i), d = direction_of(i);
        const glm::vec3 of(vp::exact::to_float(o.x), vp::exact::to_float(o.y), vp::exact::to_float(o.z));
        const glm::vec3 df(vp::exact::to_float(d.x), vp::exact::to_float(d.y), vp::exact::to_float(d.z));
        const std::uint32_t h = hash(i);
        out[i] = {
            hit.distance,
            hit.rank,
            hit.voxel,
            hit.found ? hit.axis + (hit.from_above ? 8 : 0) : -1,
            (bits.blocks(of, df, 100.0f) ? 1u : 0u) + (bricks.blocks(of, df, 100.0f) ? 2u : 0u),
            bits.children({static_cast<int>(h % 19), static_cast<int>(h / 19 % 11), static_cast<int>(h / 209 % 15)})};
    }
};
inline constexpr std::uint64_t num_rays = 3000;
template <class Backend>
[[nodiscard]] std::vector<ray_result> all_rays(Backend& backend) {
    const std::vector<std::uint32_t> words = some_bits();
    const typename Backend::template buffer<std::uint32_t> there(
        backend, vp::array_view<const std::uint32_t>(words.data(), words.size()));
    typename Backend::template buffer<ray_result> out(backend, std::size_t{num_rays});
    const vp::dense_bits bits(there.data(), extent);
    vp::brick_bits<Backend> bricks(backend, extent);
    bricks.build(backend, vp::bit_rows{bits});
    backend.for_each(num_rays, cast_rays{bits, bricks.view(), out.data()});
    return out.to_host(backend);
}

inline std::uint64_t digest(std::span<const std::byte> bytes) {
    std::uint64_t h = 0xcbf29ce484222325u;
    for (const std::byte b : bytes) h = (h ^ static_cast<std::uint64_t>(b)) * 0x100000001b3u;
    return h;
}

inline constexpr std::uint64_t golden_light = 16839960021420615407u;

} // namespace levels
