// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Programs: instances, tessellation, points and lines, geometry programs, textures of a field.

#include "cases.hpp"

#include <voxelpipe/programs/field.hpp>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cmath>
#include <utility>

namespace golden {

struct facing {
    glm::vec3 normal;
    glm::vec2 uv;
};
using facing_vertex = vp::vertex_output<facing>;

// Copies are moved apart. The normal is no unit vector.
struct place_copies {
    VOXELPIPE_HD facing_vertex operator()(const vp::vertex<>& v) const {
        const auto copy = static_cast<float>(v.instance), i = static_cast<float>(v.index % 9u) - 4.0f;
        return {{vp::exact::fma(1.25f, copy, v.position.x), vp::exact::fma(-0.75f, copy, v.position.y), v.position.z},
                {{vp::exact::div(i, 5.0f), 0.25f, vp::exact::div(copy, 3.0f)}, {v.position.x, v.position.z}}};
    }
};
// Edges of at most 1.5, displaced along the normal by a saw of the position.
struct saw {
    static constexpr int max_level = 32;
    VOXELPIPE_HD int edge_level(const facing_vertex& a, const facing_vertex& b) const {
        return vp::level_by_length(a.position, b.position, 1.5f, max_level);
    }
    VOXELPIPE_HD facing_vertex operator()(const vp::patch_point<facing>& p) const {
        const glm::vec3 at = p.position();
        const float x = vp::exact::mul(0.5f, at.x);
        return {vp::exact::along(at, p.mix(&facing::normal), vp::exact::sub(x, std::floor(x))), p.varyings()};
    }
};
// A triangle, and its back moved along the first normal where its number is even.
struct doubled {
    VOXELPIPE_HD auto operator()(const vp::triangle<facing>& t) const {
        vp::triangles<2, facing> out;
        out.add(t.vertices[0], t.vertices[1], t.vertices[2]);
        if (t.number % 2u == 0) {
            facing_vertex moved[3];
            for (int i = 0; i < 3; ++i)
                moved[i] = {vp::exact::along(t.vertices[i].position, t.vertices[0].varyings.normal, 0.625f),
                            t.vertices[i].varyings};
            out.add(moved[0], moved[2], moved[1]);
        }
        if (t.number % 7u == 3u) out.count = 0;
        return out;
    }
};
// A segment becomes a strip of two triangles.
struct ribbon {
    VOXELPIPE_HD auto operator()(const vp::line<facing>& l) const {
        vp::triangles<2, facing> out;
        const facing_vertex &a = l.vertices[0], &b = l.vertices[1];
        const facing_vertex c{vp::exact::along(a.position, {0.0f, 0.6f, 0.8f}, 0.5f), a.varyings},
            e{vp::exact::along(b.position, {0.0f, 0.6f, 0.8f}, 0.5f), b.varyings};
        out.add(a, b, c);
        out.add(b, e, c);
        return out;
    }
};
// A point becomes a triangle.
struct splat {
    VOXELPIPE_HD auto operator()(const vp::point<facing>& p) const {
        vp::triangles<1, facing> out;
        const facing_vertex& a = p.vertices[0];
        out.add(a, {vp::exact::along(a.position, {1.0f, 0.25f, 0.0f}, 0.75f), a.varyings},
                {vp::exact::along(a.position, {0.0f, 0.5f, 1.0f}, 0.75f), a.varyings});
        return out;
    }
};

struct show_program {
    VOXELPIPE_HD auto operator()(const vp::fragment<facing>& f) const {
        return vp::outputs(glm::uvec4(f.instance, f.triangle, f.primitive, f.draw), f.varyings.uv.x, f.normal)
            .discard_if(f.primitive % 9u == 4u);
    }
};
struct show_program_in_list {
    VOXELPIPE_HD auto operator()(const vp::fragment<facing>& f) const {
        return vp::outputs(glm::vec4(f.varyings.uv, f.barycentric.x, static_cast<float>(f.triangle % 4096u)));
    }
};
// Colour of a texture at the clamped coordinates.
struct show_field {
    vp::field2d<glm::vec3> texture;
    VOXELPIPE_HD auto operator()(const vp::fragment<facing>& f) const {
        const glm::vec2 uv = f.clamped_varyings().uv;
        const glm::vec3 color = texture({vp::exact::mul(uv.x, 0.125f), vp::exact::mul(uv.y, 0.25f)});
        return vp::outputs(glm::uvec4(0u), color.x, color);
    }
};

template <class Backend>
using program_targets = vp::framebuffer<Backend, vp::target<glm::uvec4, vp::blend::replace>,
                                        vp::target<float, vp::blend::add>, vp::target<glm::vec3, vp::blend::add>>;

template <class Backend>
void add_program_targets(Backend& backend, digest& d, program_targets<Backend>& fb) {
    d.add(vp::get<0>(fb).to_host(backend));
    d.add(vp::get<1>(fb).to_host(backend));
    d.add(vp::get<2>(fb).to_host(backend));
}
// A case in targets and one in lists. draw(backend, shader, output, options) calls voxelize.
template <class Backend, class Draw>
void add_program(case_table<Backend>& cases, const std::string& name, vp::coverage rule, const Draw& draw) {
    cases.push_back({"program." + name, [=](Backend& backend, digest& d) {
                         program_targets<Backend> fb{backend, odd_grid().extent};
                         add_counts(d, draw(backend, show_program{}, fb, rule));
                         add_program_targets(backend, d, fb);
                     }});
    cases.push_back({"program." + name + ".list", [=](Backend& backend, digest& d) {
                         vp::abuffer<Backend, glm::vec4> lists{backend};
                         add_counts(d, draw(backend, show_program_in_list{}, lists, rule));
                         add_list(d, lists.to_host(backend));
                     }});
}

template <class Backend>
void add_programs(case_table<Backend>& cases) {
    for (const named_coverage& c : {coverages[0], coverages[1]}) {
        const std::string rule = std::string(".") + c.name;
        add_program(
            cases, "instances" + rule, c.rule, [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                const auto m = upload(backend, hashed_mesh("soup"));
                return vp::voxelize(backend, m.view(vp::instances{5}), odd_grid(), place_copies{}, shader, out, known);
            });
        add_program(cases, "tessellation" + rule, c.rule,
                    [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                        const auto m = upload(backend, hashed_mesh("open"));
                        return vp::voxelize(backend, m, odd_grid(), place_copies{}, vp::tessellate{saw{}}, shader, out,
                                            vp::program_options(known));
                    });
        add_program(cases, "geometry" + rule, c.rule,
                    [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                        const auto m = upload(backend, hashed_mesh("torus"));
                        return vp::voxelize(backend, m.view(vp::instances{2}), odd_grid(), place_copies{},
                                            vp::geometry{doubled{}}, shader, out, vp::program_options(known));
                    });
        add_program(cases, "tessellation_and_geometry" + rule, c.rule,
                    [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                        const auto m = upload(backend, hashed_mesh("sphere"));
                        return vp::voxelize(backend, m, odd_grid(), place_copies{},
                                            vp::tessellate{saw{}} | vp::geometry{doubled{}}, shader, out,
                                            vp::program_options(known));
                    });
        add_program(cases, "ribbons" + rule, c.rule,
                    [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                        const auto m = upload(backend, hashed_mesh("soup"));
                        const vp::lines_view<> lines{m.view().positions, {}, vp::line_topology::strip};
                        return vp::voxelize(backend, lines, odd_grid(), place_copies{}, vp::geometry{ribbon{}}, shader,
                                            out, vp::program_options(known));
                    });
        add_program(cases, "splats" + rule, c.rule,
                    [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                        const auto m = upload(backend, hashed_mesh("torus"));
                        const vp::points_view<> points{m.view().positions, {}, vp::instances{3}};
                        return vp::voxelize(backend, points, odd_grid(), place_copies{}, vp::geometry{splat{}}, shader,
                                            out, vp::program_options(known));
                    });
        add_program(cases, "points" + rule, c.rule,
                    [](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                        const auto m = upload(backend, hashed_mesh("sphere"));
                        const vp::points_view<> points{m.view().positions, {}, vp::instances{2}};
                        return vp::voxelize(backend, points, odd_grid(), place_copies{}, shader, out,
                                            vp::program_options(known));
                    });
        for (const auto& [name, topology] :
             {std::pair{"list", vp::line_topology::list}, std::pair{"strip", vp::line_topology::strip},
              std::pair{"loop", vp::line_topology::loop}})
            add_program(cases, std::string("lines.") + name + rule, c.rule,
                        [kind = topology](Backend& backend, const auto& shader, auto& out, vp::coverage known) {
                            const auto m = upload(backend, hashed_mesh("soup"));
                            const vp::lines_view<> lines{m.view().positions, {}, kind};
                            return vp::voxelize(backend, lines, odd_grid(), place_copies{}, shader, out,
                                                vp::program_options(known));
                        });
    }
    for (const auto& [name, wrap] :
         {std::pair{"repeat", vp::wrap_mode::repeat}, std::pair{"mirror", vp::wrap_mode::mirror},
          std::pair{"clamp", vp::wrap_mode::clamp}})
        for (const bool linear : {false, true})
            cases.push_back(
                {std::string("program.field.") + name + (linear ? ".linear" : ".nearest"),
                 [mode = wrap, linear](Backend& backend, digest& d) {
                     std::vector<glm::vec3> texels;
                     for (std::uint32_t i = 0; i < 13u * 7u; ++i)
                         texels.push_back({static_cast<float>(mixed(i, 1u) >> 8) * 0x1p-24f,
                                           static_cast<float>(mixed(i, 2u) >> 8) * 0x1p-24f, static_cast<float>(i)});
                     const typename Backend::template buffer<glm::vec3> there(
                         backend, vp::array_view<const glm::vec3>(texels.data(), texels.size()));
                     vp::field2d<glm::vec3> texture;
                     texture.texels = there.data();
                     texture.width = 13;
                     texture.height = 7;
                     texture.filter = linear ? vp::filter_mode::linear : vp::filter_mode::nearest;
                     texture.wrap_x = mode;
                     texture.wrap_y = mode;
                     const auto m = upload(backend, hashed_mesh("torus"));
                     program_targets<Backend> fb{backend, odd_grid().extent};
                     add_counts(d, vp::voxelize(backend, m, odd_grid(), place_copies{}, show_field{texture}, fb));
                     add_program_targets(backend, d, fb);
                 }});
}

} // namespace golden
