// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A scene in a backend's memory, and the draws that show it: instances of one primitive that follow each other are one
// draw.

#include "backend_memory.hpp"
#include "mip_levels.hpp"
#include "model/placement.hpp"
#include "model/resolve.hpp"
#include "surface.hpp"
#include "voxelizer.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace voxelize {

using wanted_targets = std::bitset<target_count>;

template <class Backend>
class uploaded_scene {
public:
    using mesh_view = vp::mesh_view<>;
    using lines_view = vp::lines_view<>;
    using surface_draw = vp::draw<mesh_view, surface_vertex_shader, surface_fragment_shader>;
    using line_draw = vp::draw<lines_view, surface_vertex_shader, line_fragment_shader<surface_fragment_shader>>;
    using bits_draw = vp::draw<mesh_view, instanced_vertex_shader, vp::constant_output<bool, std::uint32_t>>;

    // A backend in host memory takes the scene's arrays over one by one, so that they are not held twice. Another one
    // leaves the scene as it is. Lines have draws if `with_lines`.
    uploaded_scene(Backend& backend, scene& model, const voxelize_request& request, const wanted_targets& wanted,
                   bool with_lines)
        : backend_{backend}, request_{request}, wanted_{wanted},
          reference_{reference_point(request.grid)}, tables_{backend, std::vector<color_tables>{make_color_tables()}} {
        upload_pictures(model);
        // A solid, and the sign of distances and of a remesh, may be decided draw by draw.
        const bool by_draws = request.solid ||
                              (request.distance && request.distance->sign.rule == solid_rule::each_draw) ||
                              (request.remesh && request.remesh->sign.rule == solid_rule::each_draw);
        const std::uint64_t most_copies = by_draws ? 1 : UINT32_MAX;
        const std::vector<run> triangle_runs = runs_of(model, &primitive::triangles, most_copies);
        const std::vector<run> line_runs =
            with_lines ? runs_of(model, &primitive::lines, most_copies) : std::vector<run>();
        upload_places(model, triangle_runs, line_runs);
        upload_primitives(model);
        make_draws(triangle_runs, line_runs);
    }
    uploaded_scene(const uploaded_scene&) = delete; // draws point into it
    uploaded_scene& operator=(const uploaded_scene&) = delete;

    // In the order of the scene's instances.
    [[nodiscard]] const std::vector<surface_draw>& draws() const { return draws_; }
    // The same triangles without their attributes.
    [[nodiscard]] const std::vector<bits_draw>& bits_draws() const { return bits_draws_; }
    // For each of draws(): whether its material is double-sided.
    [[nodiscard]] const std::vector<char>& double_sided() const { return double_sided_; }
    // Primitives are numbered from 0 here, too: the shader adds the number of triangles.
    [[nodiscard]] const std::vector<line_draw>& line_draws() const { return line_draws_; }
    // In the backend's memory: of draws(), then of line_draws().
    [[nodiscard]] const numbered_draw* draw_table() const { return draw_table_.front().data(); }
    [[nodiscard]] std::size_t num_draws() const { return draw_table_.front().size(); }
    [[nodiscard]] const color_tables* tables() const { return tables_.data(); }
    // True if a material discards fragments.
    [[nodiscard]] bool has_masks() const { return has_masks_; }
    // Positions are relative to this point; see reference_point.
    [[nodiscard]] const glm::dvec3& reference() const { return reference_; }
    // The request's grid, its origin taken from there. The request may go on to another crop of the whole grid.
    [[nodiscard]] voxelpipe::grid relative_grid() const {
        voxelpipe::grid relative = request_.grid;
        relative.origin -= reference_;
        return relative;
    }

private:
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // Instances of one primitive, one after the other, all mirrored or none.
    struct run {
        std::uint32_t primitive;
        bool mirrors;
        std::vector<std::size_t> instances; // in the scene
    };
    template <class Element>
    [[nodiscard]] static std::vector<run> runs_of(const scene& model, std::vector<Element> primitive::*elements,
                                                  std::uint64_t most_copies) {
        std::vector<run> runs;
        for (std::size_t i = 0; i < model.instances.size(); ++i) {
            const instance& shown = model.instances[i];
            const primitive& part = model.primitives[shown.primitive];
            if ((part.*elements).empty()) continue;
            const bool mirrors = shown.to_world.mirrors();
            // A draw numbers its vertices and elements with 32 bits.
            const std::uint64_t each = std::max(part.positions.size(), (part.*elements).size());
            const std::uint64_t most = std::min<std::uint64_t>(most_copies, UINT32_MAX / each);
            if (runs.empty() || runs.back().primitive != shown.primitive || runs.back().mirrors != mirrors ||
                runs.back().instances.size() >= most)
                runs.push_back({shown.primitive, mirrors, {}});
            runs.back().instances.push_back(i);
        }
        return runs;
    }
    void upload_places(const scene& model, const std::vector<run>& triangle_runs, const std::vector<run>& line_runs) {
        std::vector<placed_vertex_shader> places;
        for (const std::vector<run>* runs : {&triangle_runs, &line_runs})
            for (const run& r : *runs)
                for (const std::size_t i : r.instances) places.emplace_back(model.instances[i].to_world, reference_);
        places_.push_back({backend_, places});
        is_mirrored_.resize(model.primitives.size());
        for (const run& r : triangle_runs)
            if (r.mirrors) is_mirrored_[r.primitive] = 1;
    }
    void make_draws(const std::vector<run>& triangle_runs, const std::vector<run>& line_runs) {
        std::vector<numbered_draw> numbered;
        const placed_vertex_shader* place = places_.front().data();
        std::uint64_t number = 0;
        const auto shader_of = [&](const uploaded_primitive& part) {
            surface_vertex_shader shader = part.vertex_shader;
            shader.place.places = place;
            return shader;
        };
        const auto count = [&](const run& r, std::uint64_t elements) {
            numbered.push_back({number, primitives_[r.primitive].material});
            place += r.instances.size();
            number += r.instances.size() * elements;
        };
        for (const run& r : triangle_runs) {
            const uploaded_primitive& part = primitives_[r.primitive];
            const auto& triangles = r.mirrors ? part.mirrored_triangles.front() : part.triangles;
            mesh_view mesh{part.positions.view(), triangles.view()};
            // The scene's indices are in range.
            mesh.checked = {mesh.triangles.data(), mesh.triangles.size(), mesh.positions.size()};
            mesh.copies.count = r.instances.size();
            if (part.whole != 0) mesh.part = {part.numbers.view(), part.whole};
            draws_.push_back({mesh, shader_of(part), part.fragment_shader});
            bits_draws_.push_back({mesh, {place}, vp::constant(true, 1U)});
            double_sided_.push_back(part.double_sided ? 1 : 0);
            count(r, part.whole != 0 ? part.whole : triangles.size());
        }
        const auto first_line = static_cast<std::uint32_t>(number);
        for (const run& r : line_runs) {
            const uploaded_primitive& part = primitives_[r.primitive];
            lines_view lines{.positions = part.positions.view()};
            lines.indices = {reinterpret_cast<const std::uint32_t*>(part.lines.data()), 2 * part.lines.size()};
            lines.copies.count = r.instances.size();
            line_draws_.push_back({lines, shader_of(part), {part.fragment_shader, first_line}});
            count(r, part.lines.size());
        }
        draw_table_.push_back({backend_, numbered});
    }

    [[nodiscard]] bool wants(target id) const { return wanted_[static_cast<std::size_t>(id)]; }
    [[nodiscard]] bool shades() const {
        return wants(target::color) || wants(target::color_max) || wants(target::color_replace) ||
               wants(target::color_outer);
    }

    // Each picture as its materials need it: colours by alpha where that counts, alone where none of them is opaque.
    // Levels that the loader has made are taken as they are.
    void upload_pictures(scene& model) {
        const auto texels_for = [&](picture& source, bool by_alpha) {
            std::vector<stored<Backend, glm::u8vec4>> texels;
            if (const auto& levels = source.levels[by_alpha ? 1 : 0]) {
                texels.push_back({backend_, levels});
                return texels;
            }
            std::vector<glm::u8vec4> made;
            if (shades()) {
                made = with_mip_levels(source, by_alpha, thread_count(request_.threads));
            } else {
                made.resize(source.rgba.size() / 4);
                std::memcpy(made.data(), source.rgba.data(), source.rgba.size());
            }
            texels.push_back({backend_, made});
            return texels;
        };
        std::vector<std::array<bool, 2>> needed(model.images.size()); // without and with the weight of alpha
        for (const material& m : model.materials)
            if (m.texture != material::no_texture)
                needed[model.textures[static_cast<std::size_t>(m.texture)].image]
                      [alpha_of(m, request_.alpha) != alpha_mode::opaque ? 1 : 0] = true;
        pictures_.resize(model.images.size());
        for (std::size_t image = 0; image < model.images.size(); ++image) {
            picture& source = model.images[image];
            for (const bool by_alpha : {false, true})
                if (needed[image][by_alpha ? 1 : 0])
                    pictures_[image].texels[by_alpha ? 1 : 0] = texels_for(source, by_alpha);
            if constexpr (memory_access<Backend>::on_host)
                source.rgba = std::vector<std::uint8_t>(); // = {} would keep the memory
        }
    }

    [[nodiscard]] sampled_texture texture_of(const material& m, const scene& model) {
        sampled_texture result;
        if (m.texture == material::no_texture) return result;
        const texture& source = model.textures[static_cast<std::size_t>(m.texture)];
        const std::size_t by_alpha = alpha_of(m, request_.alpha) != alpha_mode::opaque ? 1 : 0;
        result.texels = pictures_[source.image].texels[by_alpha].front().data();
        const picture& image = model.images[source.image];
        if (shades()) result.levels = mip_level_count(image.width, image.height);
        result.first_level = image.first_level;
        result.width = static_cast<int>(image.width);
        result.height = static_cast<int>(image.height);
        result.wrap_s = source.wrap_s;
        result.wrap_t = source.wrap_t;
        result.filter = source.filter;
        return result;
    }

    // Every primitive once.
    void upload_primitives(scene& model) {
        for (std::size_t i = 0; i < model.primitives.size(); ++i) {
            primitive& part = model.primitives[i];
            const bool has_texcoords = !part.texcoords.empty();
            const bool has_colors = !part.colors.empty();
            std::vector<glm::uvec3> turned;
            if (is_mirrored_[i] != 0) {
                turned = part.triangles;
                for (glm::uvec3& corners : turned) std::swap(corners.y, corners.z);
            }
            uploaded_primitive& done =
                primitives_.emplace_back(uploaded_primitive{{backend_, part.positions},
                                                            {backend_, part.triangles},
                                                            {backend_, part.lines},
                                                            {},
                                                            {backend_, part.texcoords},
                                                            {backend_, part.colors},
                                                            {},
                                                            {},
                                                            static_cast<std::int32_t>(part.material),
                                                            model.materials[part.material].double_sided,
                                                            {backend_, part.numbers},
                                                            part.whole});
            if (is_mirrored_[i] != 0) done.mirrored_triangles.push_back({backend_, turned});
            const material& m = model.materials[part.material];
            if (has_texcoords) done.vertex_shader.texcoords = done.texcoords.data();
            if (has_colors) done.vertex_shader.colors = done.colors.data();
            done.fragment_shader = fragment_shader_of(m, model, has_texcoords);
            has_masks_ = has_masks_ || done.fragment_shader.alpha == alpha_mode::mask;
            if constexpr (memory_access<Backend>::on_host) part = {};
        }
    }

    [[nodiscard]] surface_fragment_shader fragment_shader_of(const material& m, const scene& model, bool textured) {
        surface_fragment_shader shader;
        if (textured) shader.texture = texture_of(m, model);
        shader.tables = tables_.data();
        shader.base_color = m.base_color;
        shader.alpha = alpha_of(m, request_.alpha);
        shader.alpha_cutoff = m.alpha == alpha_mode::blend ? 0.5F : m.alpha_cutoff;
        shader.centers = {request_.grid.origin - reference_, request_.grid.voxel_size};
        shader.depth_axis = request_.depth_axis;
        shader.depth_reference = reference_[request_.depth_axis];
        shader.wanted = {wants(target::color), wants(target::color_max) || wants(target::color_replace),
                         wants(target::depth)};
        return shader;
    }

    Backend& backend_;
    const voxelize_request& request_;
    wanted_targets wanted_;
    glm::dvec3 reference_;
    bool has_masks_ = false;

    buffer<color_tables> tables_;
    struct uploaded_picture {
        std::vector<stored<Backend, glm::u8vec4>> texels[2]; // none or one: colours alike, colours by alpha
    };
    std::vector<uploaded_picture> pictures_;
    struct uploaded_primitive {
        stored<Backend, glm::vec3> positions;
        stored<Backend, glm::uvec3> triangles;
        stored<Backend, glm::uvec2> lines;
        std::vector<stored<Backend, glm::uvec3>> mirrored_triangles; // one, where an instance mirrors
        stored<Backend, glm::vec2> texcoords;
        stored<Backend, glm::vec4> colors;
        surface_vertex_shader vertex_shader; // all but its place
        surface_fragment_shader fragment_shader;
        std::int32_t material;
        bool double_sided;
        stored<Backend, std::uint32_t> numbers; // in the whole mesh; see primitive
        std::uint64_t whole;
    };
    std::vector<uploaded_primitive> primitives_;
    std::vector<char> is_mirrored_; // of the scene's primitives: whether an instance of it mirrors
    std::vector<buffer<placed_vertex_shader>> places_;
    std::vector<surface_draw> draws_;
    std::vector<bits_draw> bits_draws_;
    std::vector<line_draw> line_draws_;
    std::vector<char> double_sided_;
    std::vector<buffer<numbered_draw>> draw_table_;
};

} // namespace voxelize
