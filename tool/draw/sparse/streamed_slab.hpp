// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A slab of a streamed model: the records of its triangles, and the scene that they are drawn as.

#include "brick_need.hpp"
#include "draw/surface.hpp"
#include "draw/voxelizer.hpp"
#include "model/placement.hpp"
#include "model/scene.hpp"
#include "read/triangle_stream.hpp"

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

// Attributes of a vertex beside its position.
struct vertex_color {
    glm::vec4 color;
};
struct vertex_texcoord {
    glm::vec2 texcoord;
};
struct vertex_texcoord_color {
    glm::vec2 texcoord;
    glm::vec4 color;
};
template <class Varyings>
constexpr bool has_color = requires(Varyings v) {
    v.color;
};
template <class Varyings>
constexpr bool has_texcoord = requires(Varyings v) {
    v.texcoord;
};

// Positions as the file has them, with what else the vertices have.
template <class Varyings>
using corner_record = slabs::record<Varyings>;

// For each triangle of a slab, at least: record, scene, snapped vertices, pairs with tiles.
template <class Varyings>
constexpr double draw_bytes = std::is_empty_v<Varyings> ? 220 : 220 + 6 * sizeof(Varyings);
constexpr int brick = 8;

template <class Varyings>
corner_record<Varyings> record_of(const triangle_stream::block& from, std::size_t triangle) {
    const std::size_t i = 3 * triangle;
    const auto number = static_cast<std::uint32_t>(from.first_number + triangle);
    corner_record<Varyings> made{};
    made.number = number;
    for (std::size_t k = 0; k < 3; ++k) {
        made.positions[k] = from.corners[i + k];
        if constexpr (has_color<Varyings>)
            made.varyings[k].color = from.colors.empty() ? glm::vec4(1) : from.colors[i + k];
        if constexpr (has_texcoord<Varyings>)
            made.varyings[k].texcoord = from.texcoords.empty() ? glm::vec2(0) : from.texcoords[i + k];
    }
    return made;
}

// The corners as the pipeline places them, in the request's grid.
class corner_placer {
public:
    corner_placer(const voxelize_request& request, const triangle_stream& model)
        : how_{request.coverage, request.solid.has_value(), repair_of(request), halo_of(request)} {
        for (const triangle_stream::part& p : model.parts())
            places_.emplace_back(p.to_world, reference_point(request.grid));
        grid_ = request.grid;
        grid_.origin -= reference_point(request.grid);
        snap_ = vp::core::make_snap_transform(grid_);
    }
    [[nodiscard]] slabs::classified operator()(std::size_t part, const glm::vec3* corners) const {
        const placed_vertex_shader& place = places_[part];
        const glm::vec3 placed[3] = {place(corners[0]), place(corners[1]), place(corners[2])};
        slabs::classified c = how_(snap_, grid_.extent, placed);
        if (c.reach.empty() && c.kind == vp::core::triangle_class::drawn) c.kind = vp::core::triangle_class::outside;
        return c;
    }
    // True if a slab that such a triangle reaches needs it.
    [[nodiscard]] bool takes(const slabs::classified& c) const { return how_.takes(c.kind) && !c.reach.empty(); }
    // The grid that surface_layers are of.
    [[nodiscard]] const voxelpipe::grid& grid() const { return grid_; }
    void add_to(surface_layers& surface, std::size_t part, const glm::vec3* corners) const {
        const auto in_voxels = [&](const glm::vec3& corner) {
            return (glm::dvec3(places_[part](corner)) - grid_.part_origin()) / grid_.voxel_size;
        };
        surface.add_triangle(in_voxels(corners[0]), in_voxels(corners[1]), in_voxels(corners[2]));
    }

private:
    [[nodiscard]] static vp::repair repair_of(const voxelize_request& request) {
        if (!request.solid) return vp::repair::none;
        if (request.solid->rule == solid_rule::exterior) return vp::repair::exterior;
        return request.solid->vote ? vp::repair::vote : vp::repair::none; // lids lie where the triangles do
    }
    // Layers that the band of --distance reaches beyond a triangle; below 0 without it.
    [[nodiscard]] static glm::ivec3 halo_of(const voxelize_request& request) {
        if (!request.distance) return glm::ivec3(-1);
        const distance_request& distance = *request.distance;
        return vp::core::band_halo(distance.is_whole ? vp::band::whole : vp::band(distance.band), request.grid);
    }

    std::vector<placed_vertex_shader> places_; // by part
    slabs::binning how_;
    voxelpipe::grid grid_;
    vp::core::snap_transform snap_{};
};

// The number of a part's triangles in a slab.
struct part_count {
    std::size_t part;
    std::size_t triangles;
};

// A slab that is drawn at once: layers of one range.
template <class Varyings>
struct streamed_slab {
    slabs::layer_range layers;
    std::size_t range = 0;
    slabs::bin<corner_record<Varyings>> triangles;
    std::vector<part_count> parts; // of its triangles, in their order
};

// Gives each slab the triangles that it needs. room: bytes that the run may take, an eighth of which the triangles may
// have; the others go to temporary files in `folder`. layers: of the grid. also(block): is called with all triangles,
// too. Throws as triangle_stream::read_part, and std::system_error of files.
template <class Varyings, class Also>
void bin_triangles(triangle_stream& model, const corner_placer& classify, const std::string& folder, double room,
                   int layers, std::vector<streamed_slab<Varyings>>& parts, const Also& also) {
    // The first slab that ends behind a layer.
    std::vector<std::size_t> first_slab(static_cast<std::size_t>(layers) + 1, parts.size());
    for (std::size_t s = parts.size(); s-- > 0;) std::fill_n(first_slab.begin(), parts[s].layers.end, s);
    std::vector<slabs::bin<corner_record<Varyings>>> bins(parts.size());
    {
        slabs::bin_memory<corner_record<Varyings>> spilled(static_cast<std::uint64_t>(room / 8), bins.size(), folder);
        model.for_each_block([&](const triangle_stream::block& block) {
            also(block);
            for (std::size_t i = 0; 3 * i < block.corners.size(); ++i) {
                const slabs::classified c = classify(block.part, block.corners.data() + 3 * i);
                if (!classify.takes(c)) continue;
                const corner_record<Varyings> r = record_of<Varyings>(block, i);
                for (std::size_t s = first_slab[static_cast<std::size_t>(c.reach.lo[2])];
                     s < parts.size() && parts[s].layers.begin <= c.reach.hi[2]; ++s) {
                    spilled.push(bins, s, r);
                    std::vector<part_count>& counts = parts[s].parts;
                    if (counts.empty() || counts.back().part != block.part) counts.push_back({block.part, 0});
                    ++counts.back().triangles;
                }
            }
        });
    }
    for (std::size_t s = 0; s < parts.size(); ++s) parts[s].triangles = std::move(bins[s]);
}

// Calls f(a vertex's varyings) with the type of those that the model has.
template <class F>
void with_varyings(const triangle_stream& model, const F& f) {
    if (model.has_colors() && model.has_texcoords())
        f(vertex_texcoord_color{});
    else if (model.has_colors())
        f(vertex_color{});
    else if (model.has_texcoords())
        f(vertex_texcoord{});
    else
        f(vp::no_varyings{});
}

// A slab's triangles as a scene of the parts that are there. A primitive's triangles have the numbers of the whole
// model: `whole` counts those of parts that are left out before it, too.
template <class Varyings>
scene scene_of(const streamed_slab<Varyings>& slab, const triangle_stream& model) {
    scene made;
    made.materials = model.materials();
    made.textures = model.textures();
    made.images = model.images();
    std::uint64_t before = 0; // triangles of the model before the primitive's `whole`
    for (const part_count& count : slab.parts) {
        const triangle_stream::part& source = model.parts()[count.part];
        const std::uint64_t end = source.first_number + source.num_triangles;
        made.instances.push_back({static_cast<std::uint32_t>(made.primitives.size()), source.to_world});
        primitive& part = made.primitives.emplace_back();
        part.material = source.material;
        part.whole = end - std::exchange(before, end);
        part.positions.reserve(3 * count.triangles);
        part.triangles.reserve(count.triangles);
        part.numbers.reserve(count.triangles);
        if constexpr (has_color<Varyings>) part.colors.reserve(3 * count.triangles);
        if constexpr (has_texcoord<Varyings>)
            if (source.has_texcoords) part.texcoords.reserve(3 * count.triangles);
    }
    std::size_t at = 0; // the primitive
    slab.triangles.for_each_block([&](std::span<const corner_record<Varyings>> block) {
        for (const corner_record<Varyings>& r : block) {
            while (made.primitives[at].triangles.size() == slab.parts[at].triangles) ++at;
            primitive& part = made.primitives[at];
            const triangle_stream::part& source = model.parts()[slab.parts[at].part];
            const auto first = static_cast<std::uint32_t>(part.positions.size());
            part.positions.insert(part.positions.end(), r.positions, r.positions + 3);
            part.triangles.emplace_back(first, first + 1, first + 2);
            const std::uint64_t skipped = source.first_number + source.num_triangles - part.whole;
            part.numbers.push_back(static_cast<std::uint32_t>(r.number - skipped));
            if constexpr (has_color<Varyings>)
                for (const Varyings& v : r.varyings) part.colors.push_back(v.color);
            if constexpr (has_texcoord<Varyings>)
                if (source.has_texcoords)
                    for (const Varyings& v : r.varyings) part.texcoords.push_back(v.texcoord);
        }
    });
    // Lids need a triangle in their body's draw, and so does an inside that is known.
    constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
    for (primitive& part : made.primitives)
        if (part.triangles.empty()) {
            part.positions.emplace_back(nowhere, nowhere, nowhere);
            part.triangles.emplace_back(0U, 0U, 0U);
            part.numbers.push_back(0);
        }
    return made;
}

// Adds parts without triangles to a slab's.
inline void add_parts(std::vector<part_count>& to, const std::vector<std::size_t>& parts) {
    for (const std::size_t part : parts) {
        const auto at =
            std::lower_bound(to.begin(), to.end(), part, [](const part_count& c, std::size_t p) { return c.part < p; });
        if (at == to.end() || at->part != part) to.insert(at, {part, 0});
    }
}

} // namespace voxelize
