// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The tool's pipeline into a sparse framebuffer: the draws, targets and values of pipeline.hpp, resolved voxel by voxel
// that exists. The whole grid in one call, for a backend in host memory. A solid is drawn after its surface.

#include "../pipeline.hpp"
#include "sparse_solid.hpp"
#include "sparse_volume.hpp"

#include <cstddef>
#include <string>
#include <utility>

namespace voxelize {

template <class Backend>
class sparse_pipeline : pipeline<Backend> {
    using base = pipeline<Backend>;
    static_assert(memory_access<Backend>::on_host);

public:
    using base::base;

    // `padding` layers of `whole`, which the request's grid is a part of, hold nothing.
    [[nodiscard]] sparse_volume run(const voxelpipe::grid& whole) {
        if (this->wants(target::color_outer))
            throw std::logic_error("color-outer needs a dense grid"); // the caller's to refuse
        sparse_volume result;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<glm::length_t>(axis);
            result.shape.extent[axis] = whole.extent[a];
            result.shape.origin[axis] = whole.part_origin()[a];
            result.shape.voxel_size[axis] = whole.voxel_size[a];
        }
        const int passes = (this->draws_surface_ ? 1 : 0) + (this->request_.solid ? 1 : 0);
        const auto report_from = [this, passes](int pass) {
            this->report_ = [this, passes, pass](double done) {
                if (this->request_.progress) this->request_.progress((pass + done) / passes);
            };
        };
        report_from(0);
        this->stats_.slabs = 1;
        if (this->draws_surface_) {
            if (this->only_bits_)
                draw_bits(result);
            else
                draw_surface(result);
        }
        if (!this->request_.solid) return result;
        report_from(passes - 1);
        return draw_solid(std::move(result));
    }

private:
    template <class Framebuffer>
    struct twin;
    template <class... Targets>
    struct twin<vp::framebuffer<Backend, Targets...>> {
        using type = vp::sparse_framebuffer<Backend, Targets...>;
    };
    using surface = typename twin<typename base::surface_framebuffer>::type;
    using bits = typename twin<typename base::bits_framebuffer>::type;

    void draw_bits(sparse_volume& result) {
        std::bitset<2> enabled;
        enabled[0] = !this->counts_fragments(); // one target there has to be
        enabled[1] = this->counts_fragments();
        bits framebuffer(this->backend_, this->relative_grid_.extent, enabled);
        this->draw_reporting(this->bits_draws_, this->relative_grid_, framebuffer);
        const typename base::stage_timer timer{*this, "resolve"};
        take_bricks(result, framebuffer);
        for (const target wanted : this->request_.targets) {
            if (wanted == target::occupancy) add_occupancy(result);
            if (wanted == target::count && this->counts_fragments())
                copy<1, std::uint32_t>(result, wanted, framebuffer);
        }
    }

    void draw_surface(sparse_volume& result) {
        auto enabled = this->enabled_targets();
        if (enabled.count() > 1) enabled[base::occupancy] = false;
        surface framebuffer(this->backend_, this->relative_grid_.extent, enabled);
        if (enabled[base::triangle]) vp::get<base::triangle>(framebuffer).clear(UINT32_MAX); // as int32: -1
        this->draw_reporting(this->draws_, this->relative_grid_, framebuffer);
        const typename base::stage_timer timer{*this, "resolve"};
        take_bricks(result, framebuffer);
        for (const target wanted : this->request_.targets) {
            switch (wanted) {
            case target::occupancy:
                add_occupancy(result);
                break;
            case target::count:
                if (!this->counts_fragments()) break;
                copy<base::count, std::uint32_t>(result, wanted, framebuffer);
                break;
            case target::color:
                resolve<glm::u8vec4>(result, wanted,
                                     mean_color{values_of<base::color_sum>(framebuffer),
                                                values_of<base::count>(framebuffer), this->tables_.front().data()});
                break;
            case target::color_max:
                copy<base::color_max, glm::u8vec4>(result, wanted, framebuffer);
                break;
            case target::color_replace:
                copy<base::color_last, glm::u8vec4>(result, wanted, framebuffer);
                break;
            case target::color_outer:
                break;
            case target::normal:
                resolve<glm::vec3>(result, wanted, unit_normal{values_of<base::normal_sum>(framebuffer)});
                break;
            case target::material:
                resolve<std::int32_t>(result, wanted,
                                      material_of_triangle{values_of<base::triangle>(framebuffer),
                                                           this->draw_table_.front().data(),
                                                           this->draw_table_.front().size()});
                break;
            case target::triangle:
                copy<base::triangle, std::uint32_t>(result, wanted, framebuffer);
                break;
            case target::depth:
                copy<base::depth, float>(result, wanted, framebuffer);
                break;
            }
        }
        if (this->wants(target::normal)) count_cancelled(result);
    }

    // The solid's bricks, and the values of the surface where that lies in them.
    [[nodiscard]] sparse_volume draw_solid(sparse_volume&& surface_of) {
        // What is outside follows from the whole grid: a flood is drawn there, with the padding.
        const bool is_flood = this->request_.solid->rule == solid_rule::exterior;
        const voxelpipe::grid part = is_flood ? this->relative_grid_.uncropped() : this->relative_grid_;
        std::bitset<2> enabled;
        enabled[0] = !this->counts_bodies();
        enabled[1] = this->counts_bodies();
        bits framebuffer(this->backend_, part.extent, enabled);
        vp::status status;
        {
            const typename base::stage_timer timer{*this, "voxelize"};
            this->backend_.progress = [this](std::uint64_t done, std::uint64_t total) {
                this->report_(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
            status = vp::voxelize_solid(this->backend_, this->bits_draws_, part, framebuffer, this->solid_options());
        }
        this->add_solid_counts(status, part);
        const typename base::stage_timer timer{*this, "fill"};
        sparse_volume result;
        result.shape = surface_of.shape;
        take_bricks(result, framebuffer);
        if (is_flood) keep_part(result, this->relative_grid_.offset, this->relative_grid_.extent);
        this->warn_of_solid(result.num_voxels(), surface_of.num_voxels());
        for (const target wanted : this->request_.targets) {
            if (wanted == target::occupancy)
                add_occupancy(result);
            else if (wanted != target::count)
                add_filled(result, surface_of, info_of(wanted).name, *this->request_.solid);
            else if (this->counts_bodies())
                copy<1, std::uint32_t>(result, wanted, framebuffer);
            else
                resolve<std::uint32_t>(result, wanted, [](std::size_t) { return 1U; });
        }
        return result;
    }

    template <class Framebuffer>
    void take_bricks(sparse_volume& result, const Framebuffer& framebuffer) {
        const auto& from = framebuffer.contents();
        const auto list = [](const auto& b) { return std::vector(b.data(), b.data() + b.size()); };
        result.keys = list(from.keys);
        result.masks = list(from.masks);
        result.offsets = list(from.offsets);
    }
    template <std::size_t I, class Framebuffer>
    [[nodiscard]] static const auto* values_of(const Framebuffer& framebuffer) {
        return get<I>(framebuffer.contents().values).data();
    }
    static void add_occupancy(sparse_volume& result) { result.channels.push_back({"occupancy", scalar::bit, 1, {}}); }

    template <class T, class Value>
    void resolve(sparse_volume& result, target id, const Value& value) {
        const target_info& info = info_of(id);
        channel c{std::string(info.name), info.type, info.components, {}};
        const auto voxels = static_cast<std::size_t>(result.num_voxels());
        c.data.resize(voxels * sizeof(T));
        memory_access<Backend>::read(this->backend_, reinterpret_cast<T*>(c.data.data()), voxels, value,
                                     thread_count(this->request_.threads));
        result.channels.push_back(std::move(c));
    }
    template <std::size_t I, class T, class Framebuffer>
    void copy(sparse_volume& result, target id, const Framebuffer& framebuffer) {
        resolve<T>(result, id, as_it_is<T>{values_of<I>(framebuffer)});
    }

    void count_cancelled(const sparse_volume& result) {
        const auto* const normals = reinterpret_cast<const glm::vec3*>(result.find("normal")->data.data());
        std::uint64_t cancelled = 0;
        for (std::uint64_t i = 0; i < result.num_voxels(); ++i) cancelled += normals[i] == glm::vec3(0) ? 1 : 0;
        this->report_cancelled_normals(cancelled);
    }
};

} // namespace voxelize
