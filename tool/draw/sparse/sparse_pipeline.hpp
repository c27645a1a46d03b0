// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The tool's pipeline into a sparse framebuffer: the draws, targets and values of pipeline.hpp, resolved voxel by voxel
// that exists. Slab by slab, so that the sums of colours are held for one slab at a time. A solid is drawn after its
// surface, the whole grid in one call. The request may be changed between calls to another crop of its grid, with what
// that needs. Instantiated for cpu_backend in sparse_voxelizer.cpp and for cuda_backend by cuda_pipeline.cuh; a file
// that instantiates the parts that draw includes sparse_parts.hpp.

#include "brick_count.hpp"
#include "brick_drawer.hpp"
#include "brick_need.hpp"
#include "draw/pipeline_solid.hpp"
#include "draw/pipeline_surface.hpp"
#include "model/memory.hpp"
#include "model/sparse_volume.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

template <class Backend>
class sparse_pipeline : pipeline<Backend>, public brick_drawer {
    using base = pipeline<Backend>;

public:
    // As pipeline has it. A backend that is not in host memory leaves the scene as it is, which this reads, too.
    sparse_pipeline(Backend& backend, scene& model, const voxelize_request& request, voxelize_stats& stats)
        : base(backend, model, request, stats), model_{model} {}

    [[nodiscard]] sparse_volume run(const voxelpipe::grid& whole) override {
        if constexpr (memory_access<Backend>::on_host) {
            if (this->request_.wants_links()) return draw_links(whole);
            if (this->request_.wants_cells()) return draw_cells(whole);
        }
        require_part();
        sparse_volume result = surface_in(whole, this->num_passes());
        if (!this->request_.solid) return result;
        report_from(this->num_passes() - 1, this->num_passes(), 0, 1);
        return draw_solid(std::move(result));
    }
    [[nodiscard]] sparse_volume surface(const voxelpipe::grid& whole) override {
        return surface_in(whole, this->num_passes() - (this->request_.solid ? 1 : 0));
    }
    [[nodiscard]] sparse_volume occupied(const voxelpipe::grid& whole) override {
        if (!this->uploaded_->has_masks() && !this->draws_lines_) return walls(whole);
        return bricks_of(whole, [this](sparse_volume& part, const voxelpipe::grid& slab,
                                       const vp::sparse_limits& most) { return draw_occupied(part, slab, most); });
    }
    [[nodiscard]] sparse_volume walls(const voxelpipe::grid& whole) override {
        return bricks_of(whole, [this](sparse_volume& part, const voxelpipe::grid& slab,
                                       const vp::sparse_limits& most) { return draw_walls(part, slab, most); });
    }

private:
    template <class Framebuffer>
    struct twin;
    template <class... Targets>
    struct twin<vp::framebuffer<Backend, Targets...>> {
        using type = vp::sparse_framebuffer<Backend, Targets...>;
    };
    using surface_bricks = typename twin<typename base::surface_framebuffer>::type;
    using outer_bricks = typename twin<typename base::outer_framebuffer>::type;
    using bits = typename twin<typename base::bits_framebuffer>::type;

    // The bar shows a pass from `begin` to `end` of its work from here on.
    void report_from(int pass, int passes, double begin, double end) {
        this->report_ = [=, this](double done) {
            if (this->request_.progress) this->request_.progress((pass + begin + done * (end - begin)) / passes);
        };
    }
    // The surface, which is drawn by the first of `passes` passes.
    [[nodiscard]] sparse_volume surface_in(const voxelpipe::grid& whole, int passes) {
        sparse_volume result;
        result.shape = volume_of(whole);
        this->stats_.slabs = 1;
        if (this->draws_surface_) draw_slabs(result, passes);
        if (this->wants(target::color_outer)) draw_outer(result, passes);
        return result;
    }

    // ---- slabs of the surface --------------------------------------------------------------------------------------

    // Bytes of a voxel while its bit alone is drawn.
    static constexpr double bit_bytes = 0.375;
    // Bytes of a voxel while a slab is drawn: the targets, once more while they are packed, and the channels.
    [[nodiscard]] double voxel_bytes() const {
        double bytes = 0.25;
        if (this->only_bits_)
            bytes += this->counts_fragments() ? 8 : 0;
        else
            bytes += 2 * this->surface_voxel_bytes();
        for (const target wanted : this->request_.targets)
            bytes += static_cast<double>(size_of(info_of(wanted).type)) * info_of(wanted).components;
        return bytes;
    }
    // Throws memory_error where the request's part cannot fit, before any of it is drawn.
    void require_part() {
        const typename base::stage_timer timer{*this, "estimate"};
        const voxelize_request& request = this->request_;
        const surface_layers& surface = surface_here();
        value_sizes bytes =
            value_sizes_of(request, this->only_bits_ ? (this->counts_fragments() ? 4 : 0.125)
                                                     : static_cast<double>(this->surface_voxel_bytes()));
        if (this->bodies_ && !this->bodies_->is_everywhere()) bytes.bodies = body_map::brick_bytes;
        require_counted(surface, request.solid ? voxelpipe::coverage::conservative : request.coverage,
                        [&](const brick_counts& counts) { return needed_bytes(request, surface, counts, bytes); });
    }
    // As require_part(), for cut cells and for links.
    void require_cells() {
        const typename base::stage_timer timer{*this, "estimate"};
        const surface_layers& surface = surface_here();
        double vertices = 0;
        for (const auto& d : this->uploaded_->bits_draws())
            vertices += static_cast<double>(d.mesh.positions.size()) * static_cast<double>(d.mesh.copies.count);
        require_counted(surface, voxelpipe::coverage::conservative, [&](const brick_counts& counts) {
            return needed_for_cells(this->request_, surface, counts, vertices);
        });
    }
    // need(counts): the bytes that these counts come to. They are counted where twice the most that they can be does
    // not fit.
    template <class Need>
    void require_counted(const surface_layers& surface, voxelpipe::coverage rule, const Need& need) {
        if (2 * need(at_most(surface)) < static_cast<double>(memory::room())) return;
        const int side = counted_side(surface);
        const std::optional<brick_counts> counted = count_touched(counted_grid(this->uploaded_->relative_grid(), side),
                                                                  side == 1 ? rule : voxelpipe::coverage::conservative);
        if (counted) require_bricks(this->request_, need(counts_of(surface, *counted, side)));
    }
    // The surface in the request's part of the grid, which is looked at once for each part.
    [[nodiscard]] const surface_layers& surface_here() {
        const voxelpipe::grid part = this->uploaded_->relative_grid();
        if (surface_ && part.offset == surface_part_.offset && part.extent == surface_part_.extent) return *surface_;
        surface_part_ = part;
        const int threads = thread_count(this->request_.threads);
        if constexpr (memory_access<Backend>::on_host)
            return surface_.emplace(surface_of(*this->uploaded_, threads));
        else
            return surface_.emplace(
                surface_of(model_, part, this->uploaded_->reference(), this->draws_lines_, threads));
    }
    // As many slabs as keep within the working memory at `bytes_of_voxel` a voxel; a slab that does not is halved, down
    // to a tile's height. Their borders are borders of bricks. draw(slab, most) returns false, without having done
    // anything, if it has more than `most`. Returns the number of slabs.
    template <class Draw>
    int draw_within(double bytes_of_voxel, int pass, int passes, const Draw& draw) {
        const voxelpipe::grid all = this->uploaded_->relative_grid();
        // The share of the memory that earlier slabs have left.
        const auto work = [this] {
            return this->request_.work_memory != 0 ? static_cast<double>(this->request_.work_memory)
                                                   : static_cast<double>(memory::room()) / 4;
        };
        constexpr int tile = 32, brick_area = 64;
        const double slabs =
            std::ceil(surface_here().voxels() * (bytes_of_voxel + drawn_brick_bytes / brick_area) / work());
        const auto whole_tiles = [](double depth) { return std::max(1, static_cast<int>(depth / tile)) * tile; };
        int depth = slabs <= 1 ? all.extent.z + tile : whole_tiles(all.extent.z / slabs);
        int drawn = 0;
        for (int begin = 0; begin < all.extent.z;) {
            const int border = (all.offset.z + begin) / tile * tile + depth - all.offset.z;
            const int end = std::min(border, all.extent.z);
            const voxelpipe::grid slab = all.crop({0, 0, begin}, {all.extent.x, all.extent.y, end - begin});
            report_from(pass, passes, static_cast<double>(begin) / all.extent.z,
                        static_cast<double>(end) / all.extent.z);
            vp::sparse_limits most;
            if (end - begin > tile) {
                most.bricks = static_cast<std::uint64_t>(work() / drawn_brick_bytes);
                most.voxels = static_cast<std::uint64_t>(work() / bytes_of_voxel);
            }
            if (draw(slab, most)) {
                begin = end;
                ++drawn;
            } else {
                depth = whole_tiles((end - begin) / 2.0);
            }
        }
        return drawn;
    }
    // The bricks of the request's part. draw(part, slab, most) as draw_within() has it.
    template <class Draw>
    [[nodiscard]] sparse_volume bricks_of(const voxelpipe::grid& whole, const Draw& draw) {
        std::vector<sparse_volume> parts;
        draw_within(bit_bytes, 0, 1, [&](const voxelpipe::grid& slab, const vp::sparse_limits& most) {
            sparse_volume part;
            part.shape = volume_of(whole);
            if (!draw(part, slab, most)) return false;
            parts.push_back(std::move(part));
            return true;
        });
        return join_slabs(std::move(parts));
    }
    void draw_slabs(sparse_volume& result, int passes) {
        std::vector<sparse_volume> parts;
        this->stats_.slabs =
            draw_within(voxel_bytes(), 0, passes, [&](const voxelpipe::grid& slab, const vp::sparse_limits& most) {
                sparse_volume part;
                part.shape = result.shape;
                if (!(this->only_bits_ ? draw_bits(part, slab, most) : draw_surface(part, slab, most))) return false;
                parts.push_back(std::move(part));
                return true;
            });
        const typename base::stage_timer timer{*this, "resolve"};
        result = join_slabs(std::move(parts));
        if (this->draws_lines_) this->stats_.voxels = result.num_voxels(); // a voxel may have been drawn twice
        if (this->wants(target::normal)) count_cancelled(result);
    }
    // False if there is more than `most`; nothing is drawn then.
    template <class Draw, class Framebuffer>
    [[nodiscard]] bool draw_part(const std::vector<Draw>& draws, const voxelpipe::grid& slab, Framebuffer& framebuffer,
                                 const vp::sparse_limits& most) {
        framebuffer.limit(most);
        return this->draw_reporting(draws, slab, framebuffer);
    }

    // ---- parts that draw (sparse_parts.hpp) ------------------------------------------------------------------------

    // These return false as draw_part().
    [[nodiscard]] bool draw_walls(sparse_volume& result, const voxelpipe::grid& slab, const vp::sparse_limits& most);
    [[nodiscard]] bool draw_bits(sparse_volume& result, const voxelpipe::grid& slab, const vp::sparse_limits& most);
    [[nodiscard]] bool draw_occupied(sparse_volume& result, const voxelpipe::grid& slab, const vp::sparse_limits& most);
    [[nodiscard]] bool draw_surface(sparse_volume& result, const voxelpipe::grid& slab, const vp::sparse_limits& most);
    [[nodiscard]] bool draw_surface_in(const voxelpipe::grid& slab, surface_bricks& framebuffer,
                                       std::bitset<base::num_targets> enabled, const vp::sparse_limits& most) {
        return draw_part(this->uploaded_->draws(), slab, framebuffer, most) &&
               this->draw_lines(this->uploaded_->line_draws(), slab, framebuffer, enabled);
    }
    // The bricks and voxels that triangles touch of a grid, counted without keeping them; none if that did not work.
    [[nodiscard]] std::optional<brick_counts> count_touched(const voxelpipe::grid& g, voxelpipe::coverage rule);
    // Fills the channel of color-outer, once all voxels of the request's part are known.
    void draw_outer(sparse_volume& result, int passes);
    [[nodiscard]] bool draw_outer_in(const voxelpipe::grid& slab, const vp::sparse_limits& most, sparse_volume& part);
    // The solid's bits in a part of the grid, with the counts of bodies where these are asked for.
    [[nodiscard]] vp::status draw_solid_bits(const voxelpipe::grid& part, sparse_volume& result, channel& counts);
    // The solid's bricks and tiles, and the values of the surface where that lies in them: in bricks.
    [[nodiscard]] sparse_volume draw_solid(sparse_volume&& surface_of);
    // What is cut or inside, in one call for the whole grid; on the CPU alone.
    [[nodiscard]] sparse_volume draw_cells(const voxelpipe::grid& whole);
    // The voxels of which links are crossed, those of the padding too; on the CPU alone.
    [[nodiscard]] sparse_volume draw_links(const voxelpipe::grid& whole);

    template <class Framebuffer>
    void take_bricks(sparse_volume& result, const Framebuffer& framebuffer) {
        const auto& from = framebuffer.contents();
        const auto list = [this](const auto& b) {
            return memory_access<Backend>::list(this->backend_, b.data(), b.size());
        };
        result.keys = list(from.keys);
        result.masks = list(from.masks);
        result.offsets = list(from.offsets);
        result.tiles = list(from.tiles);
    }
    template <std::size_t I, class Framebuffer>
    [[nodiscard]] static const auto* values_of(const Framebuffer& framebuffer) {
        return get<I>(framebuffer.contents().values).data();
    }
    // A channel whose values come later.
    void add_unset(sparse_volume& result, target id) {
        channel& c = add_channel(result, id);
        fill_channel(c, result.num_values(), 0);
    }
    static void add_occupancy(sparse_volume& result) { result.channels.push_back({"occupancy", scalar::bit, 1, {}}); }

    template <class T, class Value>
    void resolve(sparse_volume& result, target id, const Value& value) {
        channel& c = add_channel(result, id);
        const auto values = static_cast<std::size_t>(result.num_values());
        c.data.resize(values * sizeof(T));
        memory_access<Backend>::read(this->backend_, reinterpret_cast<T*>(c.data.data()), values, value,
                                     thread_count(this->request_.threads));
    }
    // A channel without data.
    static channel& add_channel(sparse_volume& result, target id) {
        const target_info& info = info_of(id);
        return result.channels.emplace_back(channel{std::string(info.name), info.type, info.components, {}});
    }
    // A target's values as the data of a channel.
    template <std::size_t I, class T, class Framebuffer>
    void copy(channel& to, const Framebuffer& framebuffer, std::uint64_t num_values) {
        to.data.resize(static_cast<std::size_t>(num_values) * sizeof(T));
        memory_access<Backend>::read(this->backend_, reinterpret_cast<T*>(to.data.data()),
                                     static_cast<std::size_t>(num_values), as_it_is<T>{values_of<I>(framebuffer)},
                                     thread_count(this->request_.threads));
    }
    static void fill_channel(channel& to, std::uint64_t num_values, std::uint32_t value) {
        to.data.resize(static_cast<std::size_t>(num_values) * sizeof(value));
        std::fill_n(reinterpret_cast<std::uint32_t*>(to.data.data()), num_values, value);
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

    const scene& model_;
    std::optional<surface_layers> surface_; // in surface_part_
    voxelpipe::grid surface_part_;
};

} // namespace voxelize
