// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One frame, from triangles to pixels, on a backend: the whole algorithm in the order in which it runs.

#include "pixels.hpp"
#include "renderer.hpp"
#include "stopwatch.hpp"
#include "voxels.hpp"

#include <voxelpipe/levels/direction_mips.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>

namespace gi {

// Vertices of this frame, in grid coordinates.
struct place_vertices {
    const glm::vec3* from;
    glm::vec3* to;
    glm::vec3 low, moved; // world; `moved` is added to the vertices that move
    float scale;          // voxels a unit
    std::uint64_t first_moving, end_moving;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const bool moves = i >= first_moving && i < end_moving;
        to[i] = ((moves ? from[i] + moved : from[i]) - low) * scale;
    }
};

// Runs a functor that traces rays or cones. A backend may have its own way for these (cuda.cu).
template <class Backend>
struct tracer {
    template <class F>
    static void run(Backend& backend, std::uint64_t count, const F& f) {
        backend.for_each(count, f);
    }
};

template <class Backend>
class frame_renderer : public renderer {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    frame_renderer(Backend backend, scene s, const settings& how)
        : backend_(std::move(backend)), watch_(backend_), scene_(std::move(s)), how_(how),
          fine_(fit(scene_, how.resolution, 2)), coarse_(fit(scene_, how.resolution, 1)),
          rest_(upload(scene_.positions)), placed_(backend_, scene_.positions.size()), normals_(upload(scene_.normals)),
          colors_(upload(scene_.colors)), texcoords_(upload(scene_.texcoords)), triangles_(upload(scene_.triangles)),
          triangle_materials_(upload(scene_.triangle_materials)), materials_(upload(scene_.materials)),
          textures_(backend_, std::size_t{0}), tables_(upload(std::vector{voxelize::make_color_tables()})),
          bits_(backend_, fine_.extent), blockers_(backend_, fine_.extent), mips_(backend_, coarse_.extent, true),
          last_(backend_, coarse_.extent, true), lists_(backend_), slots_(backend_, mips_.view().num_voxels(0)),
          filled_(backend_, coarse_.extent), irradiances_(backend_, std::size_t{0}), lit_(backend_, std::size_t{0}),
          gathered_(backend_, std::size_t{0}), seen_(backend_, num_rays(how)), near_(backend_, num_rays(how)),
          received_(backend_, num_rays(how)), mirrored_(backend_, num_rays(how)),
          moved_(backend_, how.thorough ? num_rays(how) : 0), voxels_moved_(backend_, std::size_t{0}),
          pixels_(backend_, static_cast<std::size_t>(how.width) * static_cast<std::size_t>(how.height)) {
        upload_textures();
        checked_ = vp::check_indices(backend_, triangles_.view());
        how_.level = std::min(how_.level, mips_.view().last_level);
        if (how_.thorough) {
            voxel_cones_ = make_cone_set(8, 1);
            pixel_cones_ = make_cone_set(64, eye_rays::num_phases);
        }
    }

    [[nodiscard]] frame render(double time) override {
        const world w = make_world();
        watch_.start();
        backend_.for_each(placed_.size(), place_vertices{rest_.data(), placed_.data(), glm::vec3(origin_),
                                                         glm::vec3(scene_.motion(time)), static_cast<float>(per_unit_),
                                                         scene_.first_moving, scene_.end_moving});
        watch_.end("vertices");
        draw_bits();
        watch_.end("bits");
        draw_lists();
        watch_.end("lists");
        light_voxels(w);
        watch_.end("light");
        // The first frame has no last one: light bounces a few times within it.
        const int rounds = has_last_ ? 1 : how_.thorough ? 6 : 4;
        for (int i = 0; i < rounds; ++i) {
            bounce(w);
            watch_.end("bounce");
            mips_.build(backend_);
            watch_.end("mips");
            has_last_ = true;
        }
        draw(w, make_eye(time));
        watch_.end("pixels");
        frame made;
        made.pixels = pixels_.to_host(backend_);
        watch_.end("copy");
        made.milliseconds = watch_.times();
        return made;
    }
    [[nodiscard]] std::string device() const override;

private:
    // A grid of the scene with a layer of empty voxels around it; `finer` times as many voxels a side.
    vp::grid fit(const scene& s, int resolution, int finer) {
        const glm::dvec3 size = s.high - s.low;
        per_unit_ = (resolution - 2) / std::max({size.x, size.y, size.z});
        origin_ = s.low - 1.0 / per_unit_;
        vp::grid g;
        for (int a = 0; a < 3; ++a) {
            g.extent[a] = finer * static_cast<int>(std::ceil(size[a] * per_unit_ - 1e-6) + 2);
            g.voxel_size[a] = 1.0 / finer;
        }
        return g;
    }
    template <class T>
    buffer<T> upload(const std::vector<T>& from) {
        return buffer<T>(backend_, vp::array_view<const T>(from.data(), from.size()));
    }
    void upload_textures() {
        std::vector<voxelize::sampled_texture> all;
        std::vector<std::size_t> of_picture;
        for (const voxelize::picture& p : scene_.pictures) {
            std::vector<glm::u8vec4> texels(p.rgba.size() / 4);
            if (!texels.empty()) std::memcpy(texels.data(), p.rgba.data(), p.rgba.size());
            of_picture.push_back(texels_.size());
            texels_.push_back(upload(texels));
        }
        for (const voxelize::texture& t : scene_.textures) {
            const voxelize::picture& p = scene_.pictures[t.image];
            voxelize::sampled_texture entry;
            entry.texels = texels_[of_picture[t.image]].data();
            entry.width = static_cast<int>(p.width);
            entry.height = static_cast<int>(p.height);
            entry.wrap_s = t.wrap_s;
            entry.wrap_t = t.wrap_t;
            entry.filter = t.filter;
            all.push_back(entry);
        }
        textures_ = upload(all);
        scene_.pictures.clear();
    }

    [[nodiscard]] vp::mesh_view<> mesh() const {
        vp::mesh_view<> m{.positions = placed_.view(), .triangles = triangles_.view()};
        m.checked = checked_;
        return m;
    }
    // Insides of closed parts, and every voxel that a triangle touches.
    void draw_bits() {
        vp::mesh_view<> closed = mesh(), all = mesh();
        closed.triangles = vp::backend_view<const glm::uvec3>{triangles_.data(), scene_.num_closed};
        const vp::solid_options filled{
            .rule = vp::fill_rule::nonzero, .extent = vp::solid_extent::centre, .count_voxels = false};
        vp::get<0>(bits_).clear(false);
        check(vp::voxelize_solid(backend_, closed, fine_, vp::passthrough{}, vp::constant(true), bits_, filled));
        vp::get<0>(bits_).load();
        check(vp::voxelize<vp::coverage::conservative>(backend_, all, fine_, vp::passthrough{}, vp::constant(true),
                                                       bits_));
    }
    void draw_lists() {
        check(vp::voxelize<vp::coverage::conservative>(backend_, mesh(), coarse_, vp::passthrough{}, list_fragments{},
                                                       lists_));
        backend_.for_each(slots_.size(), clear_slots{slots_.data()});
        backend_.for_each(lists_.num_voxels(), number_slots{lists_.voxels.data(), slots_.data()});
        filled_.build(backend_, slot_rows{slots_.data(), coarse_.extent});
    }
    void light_voxels(const world& w) {
        const std::size_t n = lists_.num_voxels();
        if (lit_.size() < n) {
            lit_ = buffer<lit_voxel>(backend_, n + n / 8);
            gathered_ = buffer<gathered>(backend_, n + n / 8);
        }
        if (irradiances_.size() < lists_.num_fragments())
            irradiances_ = buffer<float>(backend_, lists_.num_fragments() + lists_.num_fragments() / 8);
        blockers_.build(backend_, vp::bit_rows{bits()});
        tracer<Backend>::run(backend_, lists_.num_fragments(),
                             light_fragments{w, lists_view(), blockers_.view(), irradiances_.data()});
        backend_.for_each(n, fold_fragments{w, lists_view(), bits(), irradiances_.data(), lit_.data()});
        if (!how_.thorough) return;
        if (voxels_moved_.size() < n) voxels_moved_ = buffer<glm::vec3>(backend_, n + n / 8);
        tracer<Backend>::run(backend_, n, find_voxel_walls{w, lists_view(), lit_.data(), voxels_moved_.data()});
    }
    // Light of this frame's voxels, with what the last frame's send there.
    void bounce(const world& w) {
        std::swap(mips_, last_);
        const triangle_lists lists = lists_view();
        const std::size_t n = lists_.num_voxels();
        if (has_last_)
            tracer<Backend>::run(backend_, n,
                                 gather_voxels{w, lists, last_.view(), voxel_cones_, lit_.data(),
                                               how_.thorough ? voxels_moved_.data() : nullptr, gathered_.data()});
        backend_.for_each(n, light_surfaces{lists, bits(), lit_.data(), has_last_ ? gathered_.data() : nullptr,
                                            mips_.finest(), mips_.facings()});
        backend_.for_each(mips_.view().num_voxels(0),
                          light_insides{lists, bits(), lit_.data(), mips_.finest(), mips_.facings()});
    }
    void draw(const world& w, const eye_rays& rays) {
        if (how_.view == view_choice::level) {
            eye_rays one_a_pixel = rays;
            one_a_pixel.width = how_.width;
            one_a_pixel.height = how_.height;
            backend_.for_each(pixels_.size(),
                              draw_level{w, mips_.view(), one_a_pixel, how_.level, scene_.exposure, pixels_.data()});
            return;
        }
        const triangle_lists lists = lists_view();
        const ray_order order(rays);
        const ray_data data{seen_.data(), near_.data(), received_.data(), mirrored_.data(),
                            how_.thorough ? moved_.data() : nullptr};
        const auto trace = [&](const auto& pass) { tracer<Backend>::run(backend_, order.count(), pass); };
        const view_choice view = how_.view;
        trace(see_points{w, lists, rays, order, data});
        if (view == view_choice::final || view == view_choice::direct)
            trace(see_light{w, lists, order, how_.thorough ? 4u : 1u, data});
        watch_.end("rays");
        if (how_.thorough && view != view_choice::direct) trace(find_walls{w, lists, order, data});
        if (view != view_choice::direct)
            trace(receive_light{w, mips_.view(), order, view == view_choice::ao, pixel_cones_, data});
        world shiny = w; // reflections have one cone, whose samples overlap more
        shiny.shape = cone_shape{};
        if (view == view_choice::final || view == view_choice::indirect)
            trace(receive_mirrored{shiny, mips_.view(), rays, order, data});
        watch_.end("cones");
        backend_.for_each(pixels_.size(),
                          draw_pixels{w, rays, view, how_.samples, scene_.exposure, order, data, pixels_.data()});
    }
    [[nodiscard]] vp::dense_bits bits() const { return vp::dense_bits(vp::get<0>(bits_).view()); }
    [[nodiscard]] triangle_lists lists_view() const {
        return {slots_.data(),          lists_.voxels.data(), lists_.offsets.data(), lists_.primitives.data(),
                lists_.payloads.data(), filled_.view(),       coarse_.extent};
    }
    [[nodiscard]] static std::size_t num_rays(const settings& s) {
        return static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height) *
               static_cast<std::size_t>(s.samples * s.samples);
    }
    [[nodiscard]] world make_world() const {
        world w;
        w.positions = placed_.data();
        w.normals = normals_.data();
        w.colors = colors_.data();
        w.texcoords = texcoords_.data();
        w.triangles = triangles_.data();
        w.triangle_materials = triangle_materials_.data();
        w.materials = materials_.data();
        w.textures = textures_.data();
        w.tables = tables_.data();
        w.light = scene_.light;
        const auto scale = static_cast<float>(per_unit_);
        if (w.light.position.w != 0.0f) {
            w.light.position = glm::vec4((glm::vec3(w.light.position) - glm::vec3(origin_)) * scale, 1.0f);
            w.light.side_u *= scale;
            w.light.side_v *= scale;
        }
        if (scene_.wall > 0) w.shape.widest = std::max(4.0f, static_cast<float>(2.0 * scene_.wall * per_unit_));
        if (how_.thorough) { // what lies between narrow cones is closed by the others, so each may close less
            w.shape.overlap = 1.5f;
            w.shape.weight = 0.9f;
        }
        w.sky_above = scene_.sky_above;
        w.sky_level = scene_.sky_level;
        return w;
    }
    [[nodiscard]] eye_rays make_eye(double time) const {
        const camera c = scene_.view(time);
        const glm::dvec3 forward = glm::normalize(c.target - c.eye);
        const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0, 1, 0)));
        const double tall = std::tan(c.field_of_view * std::numbers::pi / 360);
        return {glm::vec3((c.eye - origin_) * per_unit_),
                glm::vec3(forward),
                glm::vec3(right * (tall * how_.width / how_.height)),
                glm::vec3(glm::cross(right, forward) * tall),
                how_.width * how_.samples,
                how_.height * how_.samples};
    }
    static void check(const vp::status& s) {
        if (!s.ok()) throw std::runtime_error(s.message());
    }

    double per_unit_ = 1;    // voxels a unit of the world
    glm::dvec3 origin_{0.0}; // of the grid, world
    bool has_last_ = false;
    Backend backend_;
    stopwatch<Backend> watch_;
    scene scene_;
    settings how_;
    vp::grid fine_, coarse_;
    buffer<glm::vec3> rest_, placed_, normals_, colors_;
    buffer<glm::vec2> texcoords_;
    buffer<glm::uvec3> triangles_;
    buffer<std::uint32_t> triangle_materials_;
    buffer<material> materials_;
    buffer<voxelize::sampled_texture> textures_;
    buffer<voxelize::color_tables> tables_;
    std::vector<buffer<glm::u8vec4>> texels_;
    vp::checked_indices checked_;
    vp::framebuffer<Backend, bits_target> bits_;
    vp::brick_bits<Backend> blockers_; // of bits_
    vp::direction_mips<Backend> mips_, last_;
    vp::abuffer<Backend, glm::vec2> lists_;
    buffer<std::uint32_t> slots_;
    vp::brick_bits<Backend> filled_; // voxels with triangles
    buffer<float> irradiances_;      // of the lists' fragments, and a little more
    buffer<lit_voxel> lit_;          // of those voxels, and a little more
    buffer<gathered> gathered_;
    cone_set voxel_cones_ = make_cone_set(8, 8), pixel_cones_ = make_cone_set(16, eye_rays::num_phases);
    buffer<seen_point> seen_; // one of these for each ray
    buffer<near_point> near_;
    buffer<received_light> received_;
    buffer<glm::vec3> mirrored_;
    buffer<glm::vec3> moved_, voxels_moved_; // of settings::thorough
    buffer<glm::u8vec4> pixels_;
};

} // namespace gi
