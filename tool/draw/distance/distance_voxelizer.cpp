// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "distance_voxelizer.hpp"

#include "distance_shader.hpp"
#include "draw/solid_options.hpp"
#include "draw/uploaded_scene.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "model/resolve.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

using backend = vp::cpu_backend;
using distance_target = vp::target<float, vp::blend::replace>;
using number_target = vp::target<std::uint32_t, vp::blend::replace>;
using color_target = vp::target<glm::u8vec4, vp::blend::replace>;
using normal_target = vp::target<glm::vec3, vp::blend::replace>;
using nearest_view = vp::framebuffer_view<distance_target, number_target, color_target, normal_target, distance_target>;

// The grid whose centres or corners the samples are.
voxelpipe::grid grid_of_voxels(const voxelpipe::grid& samples, const distance_request& distance) {
    voxelpipe::grid g = samples;
    if (!distance.at_corners) return g;
    g.corners = false;
    g.extent -= 1;
    g.whole = glm::ivec3(0);
    return g;
}

vp::distance_options options_of(const distance_request& request) {
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

// The values of a channel; null where the volume does not have it.
template <class T>
T* values_of(volume& v, std::string_view name) {
    channel* const c = v.find(name);
    return c != nullptr ? reinterpret_cast<T*>(c->data.data()) : nullptr;
}

class drawer {
public:
    drawer(backend& on, scene& model, const voxelize_request& request, voxelize_stats& stats)
        : backend_{on}, request_{request}, stats_{stats} {
        for (const target id : request.targets) wanted_[static_cast<std::size_t>(id)] = true;
        uploaded_ = std::make_unique<uploaded_scene<backend>>(on, model, request, wanted_, false);
    }

    [[nodiscard]] volume run() {
        const distance_request& distance = *request_.distance;
        volume result = volume_of(request_.grid);
        for (const target id : request_.targets)
            result.add_unset(std::string(info_of(id).name), info_of(id).type, info_of(id).components);
        // The shader's numbers of triangles are a channel of their own until all is resolved.
        const bool numbers = wants(target::nearest) || wants(target::triangle) || wants(target::material);
        if (numbers) result.add_unset(numbers_name, scalar::u32);
        const voxelpipe::grid voxels = grid_of_voxels(uploaded_->relative_grid(), distance);
        result.distances =
            distance_field{vp::core::band_distance(options_of(distance).band, voxels), distance.is_signed};
        const bool is_plain = request_.targets.size() == 1 && wants(target::distance);
        if (is_plain)
            draw_plain(result, voxels);
        else
            draw_nearest(result, voxels);
        if (numbers) {
            resolve_numbers(result);
            result.channels.pop_back();
        }
        return result;
    }

private:
    static constexpr const char* numbers_name = "numbers";
    [[nodiscard]] bool wants(target id) const { return wanted_[static_cast<std::size_t>(id)]; }

    // The distance alone, from triangles without attributes.
    void draw_plain(volume& result, const voxelpipe::grid& voxels) {
        using draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, vp::distance>;
        std::vector<draw> draws;
        for (const auto& d : uploaded_->bits_draws()) draws.push_back({d.mesh, d.vertex_shader, {}});
        const auto view =
            vp::framebuffer_view<distance_target>::on(request_.grid.extent, values_of<float>(result, "distance"));
        check(vp::voxelize_distance(backend_, draws, voxels, view, options_of(*request_.distance)), result);
    }
    void draw_nearest(volume& result, const voxelpipe::grid& voxels) {
        using draw = vp::draw<vp::mesh_view<>, surface_vertex_shader, nearest_shader>;
        std::vector<draw> draws;
        for (const auto& d : uploaded_->draws())
            draws.push_back({d.mesh, d.vertex_shader, {d.fragment_shader, wants(target::color)}});
        const nearest_view view =
            nearest_view::on(request_.grid.extent, values_of<float>(result, "distance"),
                             values_of<std::uint32_t>(result, numbers_name), values_of<glm::u8vec4>(result, "color"),
                             values_of<glm::vec3>(result, "normal"), values_of<float>(result, "depth"));
        check(vp::voxelize_distance(backend_, draws, voxels, view, options_of(*request_.distance)), result);
    }

    void check(const vp::status& status, volume& result) {
        if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
        status.or_throw();
        stats_.triangles_dropped = status.counts.triangles_dropped();
        stats_.triangles_drawn = status.counts.triangles_drawn;
        stats_.triangles_flat = status.counts.triangles_zero_area;
        stats_.fragments = status.counts.fragments;
        stats_.voxels = status.distance.band_samples;
        if (stats_.triangles == 0 || stats_.triangles_dropped == stats_.triangles) set_empty(result);
        if (!request_.distance->is_signed) return;
        solid_counts& counts = stats_.solid.emplace();
        counts.rows =
            static_cast<std::uint64_t>(request_.grid.extent.y) * static_cast<std::uint64_t>(request_.grid.extent.z);
        counts.open_rows = status.solid.open_rows;
        counts.crossings = status.solid.crossings;
        counts.max_winding = status.solid.max_winding;
        counts.hole_edges = status.solid.hole_edges;
        counts.holes = status.solid.holes;
        counts.closed_holes = status.solid.cones;
        if (std::string warning = open_warning(request_.distance->sign, counts); !warning.empty())
            stats_.warnings.push_back("the sign of --distance: " + warning);
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
        stats_.warnings.push_back(
            "there is no triangle to measure from: every sample is " +
            (std::isfinite(result.distances->band) ? "the band's distance away" : std::string("infinitely far away")));
    }

    void resolve_numbers(volume& result) {
        const auto* const numbers = reinterpret_cast<const std::uint32_t*>(result.find(numbers_name)->data.data());
        const auto samples = static_cast<std::size_t>(result.num_voxels());
        const int threads = thread_count(request_.threads);
        const auto fill = [&](const char* name, auto value) {
            channel* const c = result.find(name);
            if (c == nullptr) return;
            using type = decltype(value(std::size_t{0}));
            memory_access<backend>::read(backend_, reinterpret_cast<type*>(c->data.data()), samples, value, threads);
        };
        fill("nearest", [numbers](std::size_t i) {
            return numbers[i] == UINT32_MAX ? std::int64_t{-1} : std::int64_t{numbers[i]};
        });
        fill("triangle", [numbers](std::size_t i) { return static_cast<std::int32_t>(numbers[i]); });
        fill("material", material_of_triangle{numbers, uploaded_->draw_table(), uploaded_->num_draws()});
    }

    backend& backend_;
    const voxelize_request& request_;
    voxelize_stats& stats_;
    wanted_targets wanted_;
    std::unique_ptr<uploaded_scene<backend>> uploaded_;
};

} // namespace

bool is_of_nearest(target id) {
    return id == target::distance || id == target::nearest || id == target::color || id == target::normal ||
           id == target::material || id == target::triangle || id == target::depth;
}

double distance_need(const scene& model, const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z;
    bool numbers = false, shaded = false;
    for (const target id : request.targets) {
        numbers = numbers || id == target::nearest || id == target::triangle || id == target::material;
        shaded = shaded || id != target::distance;
    }
    // A vertex as it is snapped, with what shaders hand on; a triangle's box, number and part of the tree.
    constexpr double vertex_bytes = 24, triangle_bytes = 160, crossing_bytes = 16, thread_bytes = 1 << 20;
    const double triangles = static_cast<double>(model.triangle_count());
    double bytes = volume_bytes(request) + (numbers ? 4 * samples : 0);
    bytes += static_cast<double>(model.vertex_count()) * (vertex_bytes + (shaded ? sizeof(surface_varyings) : 0.0));
    bytes += triangles * triangle_bytes + thread_count(request.threads) * thread_bytes;
    if (request.distance->is_signed) bytes += samples / 8 + triangles * crossing_bytes;
    if (request.write_bytes) {
        // The band of a surface as large as the grid's.
        const double band =
            request.distance->is_whole
                ? samples
                : std::min(samples, 2 * (n.x * n.y + n.y * n.z + n.z * n.x) * 2 * request.distance->band);
        constexpr double brick_voxels = 512, filled = 0.5;
        bytes = std::max(bytes, volume_bytes(request) +
                                    request.write_bytes(std::min(band / filled, samples) / brick_voxels, band, 0));
    }
    return bytes;
}

volume run_distance_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    require_cpu(request, "distances are drawn on the CPU alone", stats);
    const double need = distance_need(model, request);
    const glm::ivec3 extent = request.grid.extent;
    memory::expect(need);
    memory::require(need,
                    std::string(request.distance->is_whole ? "a whole distance field of " : "a distance field of ") +
                        std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " + std::to_string(extent.z) +
                        " samples",
                    memory::fewer_voxels_hint, need);
    if (const std::uint64_t lines = model.line_count(); lines != 0)
        stats.warnings.push_back(std::to_string(lines) +
                                 " line(s) and point(s) have no distances: --distance leaves them out");
    try {
        const int threads = thread_count(request.threads);
        backend on{static_cast<unsigned>(threads)};
        if (request.progress)
            on.progress = [&request](std::uint64_t done, std::uint64_t total) {
                request.progress(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
        stats.backend = "cpu";
        stats.threads = threads;
        stats.slabs = 1;
        stats.triangles = model.triangle_count();
        const auto start = std::chrono::steady_clock::now();
        drawer draws{on, model, request, stats};
        volume result = draws.run();
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
        stats.milliseconds.emplace_back("distance", time.count());
        return result;
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
