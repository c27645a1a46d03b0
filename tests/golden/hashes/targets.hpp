// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Render targets: every type with every blend that it has, every layout, and what fragments carry. Each case draws its
// group of eight targets and hashes one of them.

#include "cases.hpp"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <utility>

namespace golden {

// ---- values ---------------------------------------------------------------------------------------------------------

// A struct of the program's, for blend::replace.
struct tagged {
    std::uint32_t tag;
    std::int32_t place;
};
// A blend of the program's: keeps the nearer, of equals the lower.
struct nearer {
    static constexpr bool order_free = true;
    VOXELPIPE_HD glm::uvec2 identity() const { return {0xffffffffu, 0xffffffffu}; }
    VOXELPIPE_HD glm::uvec2 combine(const glm::uvec2& a, const glm::uvec2& b) const {
        return b.x < a.x || (b.x == a.x && b.y < a.y) ? b : a;
    }
};
// A blend of the program's that goes by the order of triangles.
struct chained {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint32_t identity() const { return 17u; }
    VOXELPIPE_HD std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return a * 31u + b; }
};

// A value of any type from 32 bits; floats lie on both sides of 0, and are now and then infinite or not a number.
template <class T>
[[nodiscard]] VOXELPIPE_HD T value_from(std::uint32_t h) {
    namespace core = vp::core;
    if constexpr (std::is_same_v<T, bool>) {
        return (h & 1u) != 0;
    } else if constexpr (std::is_same_v<T, tagged>) {
        return tagged{h, static_cast<std::int32_t>(h % 1000u) - 500};
    } else if constexpr (core::is_packed<T>) { // any pattern, or a vector of floats that is packed
        if (h % 3u == 0) return T::from_bits(static_cast<typename T::word_type>(value_from<std::uint64_t>(h)));
        return T(value_from<typename T::wide_type>(h));
    } else if constexpr (core::vector_traits<T>::components > 1) {
        T v;
        for (int i = 0; i < core::vector_traits<T>::components; ++i)
            v[i] = value_from<typename core::vector_traits<T>::element>(mixed(h, static_cast<std::uint32_t>(i)));
        return v;
    } else if constexpr (core::is_floating<T>) {
        using bits = typename core::float_bits<T>::type;
        if (h % 251u == 1) return core::bit_cast<T>(static_cast<bits>(core::float_bits<T>::infinity | (h >> 20 & 1u)));
        const int whole = static_cast<int>(h >> 8) - (1 << 23);
        if constexpr (std::is_same_v<T, double>)
            return vp::exact::mul(static_cast<double>(whole), 0x1.8p-31);
        else if constexpr (std::is_same_v<T, vp::half> || std::is_same_v<T, vp::bfloat16>)
            return T(vp::exact::mul(static_cast<float>(whole), 0x1p-18f));
        else
            return vp::exact::mul(static_cast<float>(whole), 0x1.8p-15f);
    } else if constexpr (sizeof(T) == 8) {
        return static_cast<T>(std::uint64_t{h} * 0x100000001u + (std::uint64_t{h} << 13));
    } else {
        return static_cast<T>(h); // large, so that sums saturate
    }
}

template <class... Targets>
struct value_shader {
    template <std::size_t... I>
    [[nodiscard]] VOXELPIPE_HD static auto values(std::uint32_t salt, std::index_sequence<I...>) {
        return vp::outputs(value_from<typename Targets::value_type>(mixed(salt, static_cast<std::uint32_t>(I)))...);
    }
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const auto place = static_cast<std::uint32_t>((f.voxel.z * 64 + f.voxel.y) * 64 + f.voxel.x);
        return values(mixed(f.primitive, place), std::index_sequence_for<Targets...>{})
            .discard_if(f.primitive % 11u == 5u);
    }
};

// ---- groups ---------------------------------------------------------------------------------------------------------

template <std::size_t I, class Backend, class Framebuffer>
void add_target(Backend& backend, digest& d, Framebuffer& fb) {
    const auto elements = vp::get<I>(fb).to_host(backend);
    if constexpr (std::is_same_v<typename std::remove_cvref_t<decltype(elements)>::value_type, tagged>) {
        for (const tagged& t : elements) d.add(std::uint64_t{t.tag} << 32 | static_cast<std::uint32_t>(t.place));
    } else {
        d.add(elements);
    }
}

// Cases of one group of targets, with a name for each.
template <class... Targets>
struct target_group {
    template <class Backend>
    static void add(case_table<Backend>& cases, const std::array<const char*, sizeof...(Targets)>& names,
                    const char* suffix, const vp::grid& grid) {
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            cases.push_back(
                {std::string("target.") + names[I] + suffix, [grid](Backend& backend, digest& d) {
                     vp::framebuffer<Backend, Targets...> fb{backend, grid.extent};
                     const auto drawn = upload(backend, hashed_mesh("soup"));
                     add_counts(d, vp::voxelize<vp::coverage::conservative>(backend, drawn, grid, vp::passthrough{},
                                                                            value_shader<Targets...>{}, fb));
                     add_target<I>(backend, d, fb);
                 }});
        });
    }
};

// Small, so that many fragments meet.
inline vp::grid grid_of_targets() { return grid_of({19, 13, 22}); }

template <class T, class Backend>
void add_integer_type(case_table<Backend>& cases, const std::string& type) {
    namespace blend = vp::blend;
    std::array<std::string, 8> names{"replace", "add", "add_saturate", "min", "max", "bit_and", "bit_or", "bit_xor"};
    std::array<const char*, 8> pointers{};
    for (std::size_t i = 0; i < names.size(); ++i) {
        names[i] = type + '.' + names[i];
        pointers[i] = names[i].c_str();
    }
    target_group<vp::target<T, blend::replace>, vp::target<T, blend::add>, vp::target<T, blend::add_saturate>,
                 vp::target<T, blend::min>, vp::target<T, blend::max>, vp::target<T, blend::bit_and>,
                 vp::target<T, blend::bit_or>, vp::target<T, blend::bit_xor>>::template add<Backend>(cases, pointers,
                                                                                                     "",
                                                                                                     grid_of_targets());
}

template <class Backend>
void add_integer_targets(case_table<Backend>& cases) {
    add_integer_type<vp::bit>(cases, "bit");
    add_integer_type<std::uint8_t>(cases, "uint8");
    add_integer_type<std::int8_t>(cases, "int8");
    add_integer_type<std::uint16_t>(cases, "uint16");
    add_integer_type<std::int16_t>(cases, "int16");
    add_integer_type<std::uint32_t>(cases, "uint32");
    add_integer_type<std::int32_t>(cases, "int32");
    add_integer_type<std::uint64_t>(cases, "uint64");
    add_integer_type<std::int64_t>(cases, "int64");
}

// ---- what fragments carry -------------------------------------------------------------------------------------------

struct carried {
    glm::vec4 color;
    glm::vec2 uv;
    vp::flat<std::uint32_t> first;
};
struct carry {
    VOXELPIPE_HD auto operator()(const vp::vertex<glm::vec4, glm::vec2>& v) const {
        return vp::vertex_output<carried>{v.position, {vp::get<0>(v), vp::get<1>(v), {v.index * 5u + 2u}}};
    }
};
struct show_carried {
    VOXELPIPE_HD auto operator()(const vp::fragment<carried>& f) const {
        const carried clamped = f.clamped_varyings();
        return vp::outputs(f.normal, f.barycentric, f.clamped_barycentric(), f.varyings.color, clamped.color,
                           clamped.uv,
                           glm::uvec4(f.triangle, static_cast<std::uint32_t>(f.axis), f.front_facing ? 1u : 0u,
                                      f.varyings.first.value),
                           f.voxel);
    }
};
template <class Backend>
void add_fragments(case_table<Backend>& cases) {
    namespace blend = vp::blend;
    using framebuffer = vp::framebuffer<Backend, vp::target<glm::vec3, blend::add>, vp::target<glm::vec3, blend::max>,
                                        vp::target<glm::vec3, blend::add>, vp::target<glm::vec4, blend::add>,
                                        vp::target<glm::vec4, blend::replace>, vp::target<glm::vec2, blend::add>,
                                        vp::target<glm::uvec4, blend::replace>, vp::target<glm::ivec3, blend::add>>;
    constexpr std::array<const char*, 8> names{
        "normal", "barycentric", "clamped_barycentric", "varying", "clamped_varying", "uv", "numbers", "voxel"};
    for (const char* const mesh : {"soup", "torus"})
        for (const named_coverage& c : {coverages[0], coverages[1]})
            vp::core::for_each_index<8>([&]<std::size_t I>() {
                cases.push_back(
                    {std::string("fragment.") + names[I] + '.' + c.name + '.' + mesh,
                     [rule = c.rule, m = &hashed_mesh(mesh)](Backend& backend, digest& d) {
                         const vp::mesh<Backend, glm::vec4, glm::vec2> drawn(backend, m->positions, m->triangles,
                                                                             m->colors, m->texcoords);
                         framebuffer fb{backend, odd_grid().extent};
                         add_counts(d, vp::voxelize(backend, drawn, odd_grid(), carry{}, show_carried{}, fb, rule));
                         d.add(vp::get<I>(fb).to_host(backend));
                     }});
            });
}

template <class Backend>
void add_targets(case_table<Backend>& cases) {
    namespace blend = vp::blend;
    namespace layout = vp::layout;
    using vp::target;
    const vp::grid grid = grid_of_targets();
    target_group<target<float, blend::replace>, target<float, blend::add>, target<float, blend::add_unordered>,
                 target<float, blend::min>, target<float, blend::max>, target<float, blend::add_quantum<-20>>,
                 target<double, blend::add_unordered>,
                 target<vp::half, blend::add_unordered>>::template add<Backend>(cases,
                                                                                {"float.replace", "float.add",
                                                                                 "float.add_unordered", "float.min",
                                                                                 "float.max", "float.add_quantum",
                                                                                 "double.add_unordered",
                                                                                 "half.add_unordered"},
                                                                                "", grid);
    target_group<target<double, blend::replace>, target<double, blend::add>, target<double, blend::min>,
                 target<double, blend::max>, target<vp::half, blend::replace>, target<vp::half, blend::add>,
                 target<vp::half, blend::min>,
                 target<vp::half, blend::max>>::template add<Backend>(cases,
                                                                      {"double.replace", "double.add", "double.min",
                                                                       "double.max", "half.replace", "half.add",
                                                                       "half.min", "half.max"},
                                                                      "", grid);
    target_group<target<vp::bit, blend::count>, target<std::uint8_t, blend::count>, target<std::uint32_t, blend::count>,
                 target<std::int64_t, blend::count>, target<glm::uvec2, nearer>, target<std::uint32_t, chained>,
                 target<tagged, blend::replace>,
                 target<glm::dvec3, blend::add>>::template add<Backend>(cases,
                                                                        {"bit.count", "uint8.count", "uint32.count",
                                                                         "int64.count", "uvec2.own_blend",
                                                                         "uint32.own_ordered_blend", "struct.replace",
                                                                         "dvec3.add"},
                                                                        "", grid);
    target_group<target<glm::vec2, blend::add>, target<glm::vec3, blend::min>, target<glm::vec4, blend::max>,
                 target<glm::uvec4, blend::bit_xor>, target<glm::ivec3, blend::add_saturate>,
                 target<glm::u8vec4, blend::max>, target<glm::vec<3, vp::half>, blend::add>,
                 target<glm::i16vec2, blend::add>>::template add<Backend>(cases,
                                                                          {"vec2.add", "vec3.min", "vec4.max",
                                                                           "uvec4.bit_xor", "ivec3.add_saturate",
                                                                           "u8vec4.max", "halfvec3.add", "i16vec2.add"},
                                                                          "", grid);
    const auto add_packed = [&]<class Blend>(const Blend&, const std::array<const char*, 8>& names) {
        target_group<target<vp::unorm8x4, Blend>, target<vp::unorm10_10_10_2, Blend>, target<vp::snorm8x4, Blend>,
                     target<vp::snorm16x2, Blend>, target<vp::snorm16x4, Blend>, target<vp::float11_11_10, Blend>,
                     target<vp::rgb9e5, Blend>, target<vp::bfloat16, Blend>>::template add<Backend>(cases, names, "",
                                                                                                    grid);
    };
    add_packed(blend::add{}, {"unorm8x4.add", "unorm10_10_10_2.add", "snorm8x4.add", "snorm16x2.add", "snorm16x4.add",
                              "float11_11_10.add", "rgb9e5.add", "bfloat16.add"});
    add_packed(blend::min{}, {"unorm8x4.min", "unorm10_10_10_2.min", "snorm8x4.min", "snorm16x2.min", "snorm16x4.min",
                              "float11_11_10.min", "rgb9e5.min", "bfloat16.min"});
    add_packed(blend::mean{}, {"unorm8x4.mean", "unorm10_10_10_2.mean", "snorm8x4.mean", "snorm16x2.mean",
                               "snorm16x4.mean", "float11_11_10.mean", "rgb9e5.mean", "bfloat16.mean"});
    for (const bool crop : {false, true})
        target_group<target<vp::bit, blend::bit_or, layout::tiled>, target<std::uint32_t, blend::max, layout::tiled>,
                     target<glm::vec3, blend::add, layout::tiled>, target<vp::half, blend::min, layout::tiled>,
                     target<glm::vec3, blend::max, layout::planar>, target<glm::uvec2, blend::replace, layout::planar>,
                     target<glm::u8vec4, blend::add, layout::planar>, target<float, blend::add, layout::planar>>::
            template add<Backend>(cases,
                                  {"tiled.bit", "tiled.uint32", "tiled.vec3", "tiled.half", "planar.vec3",
                                   "planar.uvec2", "planar.u8vec4", "planar.float"},
                                  crop ? ".crop" : "", crop ? crop_of_odd_grid() : grid);
    add_fragments(cases);
}

} // namespace golden
