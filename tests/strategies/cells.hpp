// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shaders that give every render target values of its type, including extremes, negative zero, NaN and infinities, and
// the grids and meshes on which every cell of (coverage x type x blend x targets) is compared.

#include "device_test.hpp"

#include <limits>

namespace device_test {

[[nodiscard]] VOXELPIPE_HD inline std::uint32_t mix_bits(std::uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

inline constexpr float nan =
    std::numeric_limits<float>::quiet_NaN(); // device code may read it, but not call quiet_NaN()
inline constexpr float infinity = std::numeric_limits<float>::infinity();

template <class T>
struct any_value {
    VOXELPIPE_HD static T make(std::uint32_t h, float f) {
        if constexpr (std::is_same_v<T, bool>) {
            return h % 3 == 0;
        } else if constexpr (std::is_integral_v<T>) {
            const std::uint64_t wide = (static_cast<std::uint64_t>(mix_bits(h + 1)) << 32) | h;
            switch (h % 5) {
            case 0:
                return static_cast<T>(wide);
            case 1:
                return vp::core::greatest<T>;
            case 2:
                return vp::core::lowest<T>;
            default:
                return static_cast<T>(wide % 100);
            }
        } else {
            const float sign = (h & 64u) != 0 ? -1.0f : 1.0f;
            switch (h % 29) {
            case 0:
                return static_cast<T>(nan);
            case 1:
                return static_cast<T>(sign * infinity);
            case 2:
                return static_cast<T>(sign * 0.0f);
            case 3:
                return static_cast<T>(vp::exact::mul(sign, 3e9f)); // beyond the exact range of a sum of floats
            case 4:
                return static_cast<T>(vp::exact::mul(sign, 1e-20f));
            case 5:
                return static_cast<T>(vp::exact::mul(sign, 6e4f));
            default:
                return static_cast<T>(vp::exact::fma(f, 3.0f, sign));
            }
        }
    }
};
template <glm::length_t N, class S, glm::qualifier Q>
struct any_value<glm::vec<N, S, Q>> {
    VOXELPIPE_HD static glm::vec<N, S, Q> make(std::uint32_t h, float f) {
        glm::vec<N, S, Q> v;
        for (glm::length_t i = 0; i < N; ++i) v[i] = any_value<S>::make(mix_bits(h + static_cast<std::uint32_t>(i)), f);
        return v;
    }
};
// Of packed formats: any pattern, or a packed vector of floats.
template <class T>
requires vp::core::is_packed<T>
struct any_value<T> {
    VOXELPIPE_HD static T make(std::uint32_t h, float f) {
        if (h % 3 != 0) return T(any_value<typename T::wide_type>::make(h, f));
        const std::uint64_t pattern = std::uint64_t{mix_bits(h + 3)} << 32 | mix_bits(h + 5);
        return T::from_bits(static_cast<typename T::word_type>(pattern));
    }
};

// One value per target, computed from the fragment's inputs. A fifth of the fragments is discarded.
template <class... Targets>
struct any_values {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h =
            mix_bits(f.primitive * 31u + static_cast<std::uint32_t>(f.voxel.x + 1009 * f.voxel.y + 20011 * f.voxel.z) +
                     static_cast<std::uint32_t>(f.front_facing) + static_cast<std::uint32_t>(f.axis) * 7u);
        const float value = (h & 1u) != 0 ? f.barycentric.y : f.normal.x;
        return make(h, value, std::make_index_sequence<sizeof...(Targets)>{}).discard_if(h % 5 == 4);
    }

private:
    template <std::size_t... I>
    VOXELPIPE_HD static auto make(std::uint32_t h, float f, std::index_sequence<I...>) {
        return vp::outputs(any_value<typename Targets::value_type>::make(mix_bits(h + I), f)...);
    }
};

// A user's blend that is order-free and too large for an atomic.
struct extent_of {
    std::int32_t lo[3], hi[3];
};
struct join {
    static constexpr bool order_free = true;
    VOXELPIPE_HD extent_of identity() const { return {{1 << 30, 1 << 30, 1 << 30}, {-1, -1, -1}}; }
    VOXELPIPE_HD extent_of combine(extent_of a, extent_of b) const {
        for (int i = 0; i < 3; ++i) {
            a.lo[i] = b.lo[i] < a.lo[i] ? b.lo[i] : a.lo[i];
            a.hi[i] = b.hi[i] > a.hi[i] ? b.hi[i] : a.hi[i];
        }
        return a;
    }
};

// A user's blend that depends on the order: a chain of hashes.
struct chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint32_t identity() const { return 1; }
    VOXELPIPE_HD std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return mix_bits(a * 3 + b); }
};

// Both blends, beside two targets that are drawn in tiles, and values for them.
using folded_targets = target_list<vp::target<std::uint32_t, chain>, vp::target<extent_of, join>,
                                   vp::target<std::uint64_t, vp::blend::add_saturate>,
                                   vp::target<vp::bit, vp::blend::bit_and, vp::layout::tiled>>;
struct folded_values {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = mix_bits(f.primitive + static_cast<std::uint32_t>(f.voxel.x + 64 * f.voxel.y));
        const auto low = static_cast<std::int32_t>(h >> 8), high = static_cast<std::int32_t>(f.primitive);
        const extent_of extent{{low, f.voxel.x, f.axis}, {high, f.voxel.y, -low}};
        return vp::outputs(h, extent, std::uint64_t{h} << (h % 32), h % 3 != 0).discard_if(h % 7 == 0);
    }
};

// Bits, exact sums, counts and the last primitive, in tiles. One fragment in `discards` is discarded; 0: none.
using tile_targets =
    target_list<vp::target<vp::bit, vp::blend::bit_xor>, vp::target<float, vp::blend::add>,
                vp::target<std::uint32_t, vp::blend::count>, vp::target<std::uint32_t, vp::blend::replace>>;
struct tile_values {
    std::uint32_t discards = 0;

    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = f.primitive + static_cast<std::uint32_t>(f.voxel.x);
        return vp::outputs(f.primitive % 3 == 0, f.barycentric.x, 0u, f.primitive)
            .discard_if(discards != 0 && h % discards == 0);
    }
};

// Bits in both layouts for a constant shader, without tiles.
using bit_targets = target_list<vp::target<vp::bit, vp::blend::bit_or, vp::layout::tiled>,
                                vp::target<vp::bit, vp::blend::min, vp::layout::tiled>,
                                vp::target<std::uint32_t, vp::blend::count, vp::layout::tiled>,
                                vp::target<vp::bit, vp::blend::bit_or>, vp::target<vp::bit, vp::blend::bit_and>,
                                vp::target<vp::bit, vp::blend::bit_xor>, vp::target<vp::bit, vp::blend::count>>;
[[nodiscard]] inline auto same_bits(bool value) {
    return vp::constant(value, value, value, value, value, value, value);
}

// Exact sums in both layouts. They are counted if the partial sums of a constant may be inexact.
using sum_targets = target_list<vp::target<float, vp::blend::add>, vp::target<double, vp::blend::add>,
                                vp::target<float, vp::blend::add, vp::layout::tiled>,
                                vp::target<double, vp::blend::add, vp::layout::tiled>>;
[[nodiscard]] inline auto same_sums(float value, double wide) { return vp::constant(value, wide, value, wide); }

// Triangles within one voxel.
inline mesh_data triangles_in_voxel(int count, glm::vec3 corner, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> inside(0.1f, 0.9f);
    mesh_data m;
    const auto point = [&] { return corner + glm::vec3(inside(random), inside(random), inside(random)); };
    for (int i = 0; i < count; ++i) add_triangle(m, point(), point(), point());
    return m;
}

// Targets that are drawn in tiles, and one that is folded in order.
template <template <class...> class Pipeline, class... First>
using small_kinds = Pipeline<First..., vp::target<vp::bit, vp::blend::bit_or>, vp::target<float, vp::blend::add>,
                             vp::target<double, vp::blend::max>, vp::target<std::uint32_t, vp::blend::replace>,
                             vp::target<std::uint32_t, chain>>;

// A payload for fragment lists.
using any_double = any_values<vp::target<double, vp::blend::replace>>;

// Every cell of the targets, all coverages, cleared and loaded.
template <class... Targets>
void compare_cells() {
    const any_values<Targets...> shader;
    for (const vp::coverage rule : every_coverage) {
        expect_same<Targets...>(mixed_triangles(1500, 40.0f, 1), box_grid({40, 33, 47}), vp::passthrough{}, shader,
                                rule);
        expect_same<Targets...>(mixed_triangles(600, 30.0f, 2), box_grid({97, 9, 31}), vp::passthrough{}, shader, rule,
                                start::load);
        expect_same<Targets...>(mixed_triangles(200, 1.0f, 3), box_grid({1, 1, 1}), vp::passthrough{}, shader,
                                vp::voxelize_options{rule, false}, start::load);
        // Enough triangles in a few tiles that they are split.
        expect_same<Targets...>(mixed_triangles(6000, 8.0f, 4), box_grid({8, 8, 8}), vp::passthrough{}, shader, rule);
    }
}

} // namespace device_test
