// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// --distance on a backend: the volume of a request. Instantiated for cpu_backend in distance_voxelizer.cpp and for
// cuda_backend by cuda_pipeline.cuh.

#include "distance_shader.hpp"
#include "draw/solid_options.hpp"
#include "draw/uploaded_scene.hpp"
#include "model/parallel.hpp"
#include "model/resolve.hpp"

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {

// The grid whose centres or corners the samples are.
[[nodiscard]] inline voxelpipe::grid grid_of_voxels(const voxelpipe::grid& samples, const distance_request& distance) {
    voxelpipe::grid g = samples;
    if (!distance.at_corners) return g;
    g.corners = false;
    g.extent -= 1;
    g.whole = glm::ivec3(0);
    return g;
}

[[nodiscard]] inline vp::distance_options options_of(const distance_request& request) {
    vp::distance_options options;
    options.band = request.is_whole ? vp::band::whole : vp::band(request.band);
    options.sample = request.at_corners ? vp::sample::corner : vp::sample::centre;
    if (!request.is_signed) {
        options.sign = vp::distance_sign::none;
        return options;
    }
    const vp::solid_options solid = solid_options_of(request.sign);
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    return options;
}

// False where no triangle of the model can be measured from; of stats that count them.
[[nodiscard]] inline bool has_triangles_to_measure(const voxelize_stats& stats) {
    return stats.triangles != 0 && stats.triangles_dropped != stats.triangles;
}

// The number of a nearest triangle for people.
template <class T>
struct nearest_number {
    const std::uint32_t* numbers; // 2^32 - 1: none

    [[nodiscard]] VOXELPIPE_HD T operator()(std::size_t i) const {
        return numbers[i] == UINT32_MAX ? T{-1} : static_cast<T>(numbers[i]);
    }
};

// Draws the field of the request's grid, as often as it is asked to. Between two fields the request may go on to
// another crop of the whole grid. Adds the counts.
template <class Backend>
class distance_drawer {
public:
    distance_drawer(Backend& on, scene& model, const voxelize_request& request, voxelize_stats& stats)
        : backend_{on}, request_{request}, stats_{stats} {
        for (const target id : request.targets) wanted_[static_cast<std::size_t>(id)] = true;
        uploaded_ = std::make_unique<uploaded_scene<Backend>>(on, model, request, wanted_, false);
    }

    [[nodiscard]] volume run() {
        const distance_request& distance = *request_.distance;
        volume result = volume_of(request_.grid);
        for (const target id : request_.targets)
            result.add_unset(std::string(info_of(id).name), info_of(id).type, info_of(id).components);
        const bool numbers = wants(target::nearest) || wants(target::triangle) || wants(target::material);
        if (numbers) numbers_.emplace(backend_, static_cast<std::size_t>(result.num_voxels()));
        const voxelpipe::grid voxels = grid_of_voxels(uploaded_->relative_grid(), distance);
        result.distances =
            distance_field{vp::core::band_distance(options_of(distance).band, voxels), distance.is_signed};
        const bool is_plain = request_.targets.size() == 1 && wants(target::distance);
        if (is_plain)
            draw_plain(result, voxels);
        else
            draw_nearest(result, voxels);
        if (!uploaded_->draws().empty()) {
            read_back();
            if (numbers) resolve_numbers(result);
        } else {
            set_empty(result);
        }
        return result;
    }

private:
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using distance_target = vp::target<float, vp::blend::replace>;
    using nearest_view = vp::framebuffer_view<distance_target, vp::target<std::uint32_t, vp::blend::replace>,
                                              vp::target<glm::u8vec4, vp::blend::replace>,
                                              vp::target<glm::vec3, vp::blend::replace>, distance_target>;

    [[nodiscard]] bool wants(target id) const { return wanted_[static_cast<std::size_t>(id)]; }

    // Where a channel's values are drawn: the channel itself in host memory, otherwise a buffer that read_back()
    // copies. Null where the volume does not have the channel.
    template <class T>
    [[nodiscard]] T* target_of(volume& v, std::string_view name) {
        channel* const c = v.find(name);
        if (c == nullptr) return nullptr;
        T* const values = reinterpret_cast<T*>(c->data.data());
        if constexpr (memory_access<Backend>::on_host) {
            return values;
        } else {
            const auto samples = static_cast<std::size_t>(v.num_voxels());
            const auto drawn = std::make_shared<buffer<T>>(backend_, samples);
            copies_.push_back([this, values, samples, drawn] {
                memory_access<Backend>::read(backend_, values, samples, as_it_is<T>{drawn->data()},
                                             thread_count(request_.threads));
            });
            return drawn->data();
        }
    }
    void read_back() {
        for (const std::function<void()>& copy : copies_) copy();
        copies_.clear();
    }

    // The distance alone, from triangles without attributes.
    void draw_plain(volume& result, const voxelpipe::grid& voxels) {
        using draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, vp::distance>;
        std::vector<draw> draws;
        for (const auto& d : uploaded_->bits_draws()) draws.push_back({d.mesh, d.vertex_shader, {}});
        const auto view =
            vp::framebuffer_view<distance_target>::on(request_.grid.extent, target_of<float>(result, "distance"));
        check(vp::voxelize_distance(backend_, draws, voxels, view, options_of(*request_.distance)));
    }
    void draw_nearest(volume& result, const voxelpipe::grid& voxels) {
        using draw = vp::draw<vp::mesh_view<>, surface_vertex_shader, nearest_shader>;
        std::vector<draw> draws;
        for (const auto& d : uploaded_->draws())
            draws.push_back({d.mesh, d.vertex_shader, {d.fragment_shader, wants(target::color)}});
        const nearest_view view =
            nearest_view::on(request_.grid.extent, target_of<float>(result, "distance"),
                             numbers_ ? numbers_->data() : nullptr, target_of<glm::u8vec4>(result, "color"),
                             target_of<glm::vec3>(result, "normal"), target_of<float>(result, "depth"));
        check(vp::voxelize_distance(backend_, draws, voxels, view, options_of(*request_.distance)));
    }

    void check(const vp::status& status) {
        if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
        status.or_throw();
        stats_.triangles_dropped = status.counts.triangles_dropped();
        stats_.triangles_drawn += status.counts.triangles_drawn;
        stats_.triangles_flat = status.counts.triangles_zero_area;
        stats_.fragments += status.counts.fragments;
        stats_.voxels += status.distance.band_samples;
        if (!request_.distance->is_signed) return;
        if (!stats_.solid) stats_.solid.emplace();
        solid_counts& counts = *stats_.solid;
        counts.rows +=
            static_cast<std::uint64_t>(request_.grid.extent.y) * static_cast<std::uint64_t>(request_.grid.extent.z);
        counts.open_rows += status.solid.open_rows;
        counts.crossings += status.solid.crossings;
        counts.max_winding = std::max(counts.max_winding, status.solid.max_winding);
        counts.hole_edges = status.solid.hole_edges;
        counts.holes = status.solid.holes;
        counts.closed_holes = status.solid.cones;
    }

    // The values of samples that have no triangle. Without draws the library clears, which is not the band's distance.
    void set_empty(volume& result) {
        for (channel& c : result.channels) {
            std::uint32_t value = UINT32_MAX; // no number
            if (c.name == "distance")
                value = vp::core::bit_cast<std::uint32_t>(result.distances->band);
            else if (const auto id = target_named(c.name); id)
                value = info_of(*id).empty;
            for (std::size_t at = 0; at < c.data.size(); at += sizeof(value))
                std::memcpy(c.data.data() + at, &value, sizeof(value));
        }
    }

    void resolve_numbers(volume& result) {
        const std::uint32_t* const numbers = numbers_->data();
        const auto samples = static_cast<std::size_t>(result.num_voxels());
        const auto fill = [&](const char* name, const auto& value) {
            channel* const c = result.find(name);
            if (c == nullptr) return;
            using type = decltype(value(std::size_t{0}));
            memory_access<Backend>::read(backend_, reinterpret_cast<type*>(c->data.data()), samples, value,
                                         thread_count(request_.threads));
        };
        fill("nearest", nearest_number<std::int64_t>{numbers});
        fill("triangle", nearest_number<std::int32_t>{numbers});
        fill("material", material_of_triangle{numbers, uploaded_->draw_table(), uploaded_->num_draws()});
    }

    Backend& backend_;
    const voxelize_request& request_;
    voxelize_stats& stats_;
    wanted_targets wanted_;
    std::unique_ptr<uploaded_scene<Backend>> uploaded_;
    std::optional<buffer<std::uint32_t>> numbers_; // of the nearest triangles, for other channels
    std::vector<std::function<void()>> copies_;
};

// The field that the request asks for. Adds the counts and the time. Throws std::bad_alloc, and std::runtime_error for
// what the library refuses.
template <class Backend>
volume draw_distances(Backend& on, scene& model, const voxelize_request& request, voxelize_stats& stats) {
    stats.slabs = 1;
    const auto start = std::chrono::steady_clock::now();
    volume result = distance_drawer<Backend>{on, model, request, stats}.run();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    stats.milliseconds.emplace_back("distance", time.count());
    return result;
}

} // namespace voxelize
