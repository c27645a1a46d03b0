// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A record is a triangle by itself, on its way to the slabs that it reaches: positions and varyings as the vertex
// shader gave them, and its number in the whole mesh. Records are made of meshes in host memory, and become the mesh of
// a slab.

#include <voxelpipe/cells/links.hpp>
#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

namespace voxelpipe::slabs {

// 40 bytes, and the varyings.
template <class Varyings>
struct record {
    glm::vec3 positions[3]; // world space
    std::uint32_t number;   // of the triangle in the whole mesh
    Varyings varyings[3];   // of its vertices
};
#if !defined(DOXYGEN) // which takes it for a second record
template <class Varyings>
requires(std::is_empty_v<Varyings>) struct record<Varyings> {
    glm::vec3 positions[3];
    std::uint32_t number;
};
#endif

namespace detail {

// The vertex shader of a slab: gives back what the stream's vertex shader gave.
template <class Varyings>
struct stored_vertices {
    template <class Vertex>
    VOXELPIPE_HD vertex_output<Varyings> operator()(const Vertex& v) const {
        return {v.position, voxelpipe::get<0>(v)};
    }
};

// The fragment shader of a slab: the user's, with the numbers of the whole mesh. Constants need none.
template <class Shader>
struct numbered_shader {
    Shader shader;
    const std::uint32_t* numbers; // by triangle of the slab, in the backend's memory

    VOXELPIPE_ANY_CALLABLE
    template <class V>
    VOXELPIPE_HD auto operator()(const fragment<V>& drawn) const {
        fragment<V> f = drawn;
        f.triangle = f.primitive = numbers[drawn.triangle];
        return shader(f);
    }
};
// A distance's shader, likewise.
template <class Shader>
struct numbered_distance {
    Shader shader;
    const std::uint32_t* numbers;

    VOXELPIPE_ANY_CALLABLE
    template <class V>
    VOXELPIPE_HD auto operator()(const distance_fragment<V>& nearest) const {
        distance_fragment<V> f = nearest;
        if (f.in_band) f.triangle = f.primitive = numbers[nearest.triangle];
        return shader(f);
    }
};
// Gives the lists of a slab the numbers of the whole mesh. Triangles keep their order, so that lists stay sorted.
struct renumber_list {
    std::uint32_t* primitives;
    const std::uint32_t* numbers;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { primitives[i] = numbers[primitives[i]]; }
};
// Likewise the links of a slab, most of which name no primitive.
struct renumber_links {
    std::uint32_t* primitives;
    const std::uint32_t* numbers;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (primitives[i] != no_crossing) primitives[i] = numbers[primitives[i]];
    }
};

} // namespace detail

// The calls that slabs will be drawn by, as far as it decides which triangles they need.
struct binning {
    coverage rule = coverage::conservative;             // of surfaces
    bool is_solid = false;                              // for voxelize_solid
    voxelpipe::repair repair = voxelpipe::repair::none; // of solids
    glm::ivec3 halo = glm::ivec3(-1);                   // for voxelize_distance: core::band_halo; below 0: another call
    bool is_links = false;                              // for voxelize_links

    // As classify(), for a triangle's three corners. `drawn` with an empty reach: counted as drawn, but no slab needs
    // it.
    [[nodiscard]] VOXELPIPE_HD classified operator()(const core::snap_transform& snap, const glm::ivec3& extent,
                                                     const glm::vec3 (&at)[3]) const {
        if (is_links) return classify_for_links(snap, extent, at[0], at[1], at[2]);
        if (is_distance()) return classify_for_distance(snap, extent, halo, at[0], at[1], at[2]);
        if (is_solid && repair == repair::vote) return classify_for_vote(snap, extent, at[0], at[1], at[2]);
        if (is_solid && repair == repair::exterior) // a cover is all that counts
            return classify(snap, extent, coverage::conservative, at[0], at[1], at[2]);
        return classify(snap, extent, rule, at[0], at[1], at[2], is_solid);
    }
    // True for voxelize_distance.
    [[nodiscard]] VOXELPIPE_HD bool is_distance() const { return halo.x >= 0; }
    // True if slabs may need a triangle of this class.
    [[nodiscard]] VOXELPIPE_HD bool takes(core::triangle_class kind) const {
        return kind == core::triangle_class::drawn || (is_distance() && kind == core::triangle_class::outside);
    }
};

// The triangles of a chunk as records. Shades its vertices when it is made; refers to the chunk.
template <class Varyings, class Mesh>
class chunk_records {
public:
    // Triangle i has the number first_number + i, or + part.numbers[i] of a subset.
    template <class VertexShader>
    chunk_records(const Mesh& chunk, const VertexShader& shader, const grid& g, const binning& how,
                  std::uint64_t first_number, unsigned threads = 1)
        : chunk_(chunk), snap_(core::make_snap_transform(g)), extent_(g.extent), how_(how),
          first_number_(first_number) {
        using plain = voxelpipe::draw<Mesh, VertexShader, constant_output<bool>>;
        const plain d{chunk, shader, {}};
        valid_ = core::validate_draws(std::span<const plain>(&d, 1));
        if (valid_.ok() && chunk.copies.count != 1) valid_ = core::failure(status_code::bad_subset);
        if (!valid_.ok()) return;
        constexpr std::size_t block = 16384;
        vertices_ = core::raw_array<vertex_output<Varyings>>(chunk.positions.size());
        core::parallel_for(threads, (vertices_.size() + block - 1) / block, [&](unsigned, std::size_t b) {
            for (std::size_t i = b * block; i < std::min(vertices_.size(), (b + 1) * block); ++i) {
                const auto result = shader(core::fetch_vertex(chunk, static_cast<std::uint32_t>(i), 0, 0));
                vertices_[i] = core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result);
            }
        });
    }
    // True if the chunk can be drawn.
    [[nodiscard]] const status& valid() const { return valid_; }

    // Calls visit(record, reach) for each of the triangles [first, last) that may touch the grid, in order, and adds
    // all of them to `counts`. Fails at an index that names no vertex. Several threads may visit parts.
    template <class Visit>
    [[nodiscard]] status visit(std::size_t first, std::size_t last, counters& counts, Visit&& visit) const {
        for (std::size_t i = first; i < last; ++i) {
            if (status s = check(i); !s.ok()) return s;
            const glm::uvec3 t = chunk_.triangles[i];
            record<Varyings> r;
            for (int k = 0; k < 3; ++k) {
                const vertex_output<Varyings>& v = vertices_[t[k]];
                r.positions[k] = v.position;
                if constexpr (!std::is_empty_v<Varyings>) r.varyings[k] = v.varyings;
            }
            r.number = static_cast<std::uint32_t>(number(i));
            const classified c = how_(snap_, extent_, r.positions);
            core::count_class(counts, c.kind);
            if (how_.takes(c.kind) && !c.reach.empty()) visit(std::as_const(r), c.reach);
        }
        return {};
    }
    // Calls visit(a, b, c) for the snapped corners of every triangle, wherever it lies, up to the first bad one.
    template <class Visit>
    void visit_snapped(Visit&& visit) const {
        for (std::size_t i = 0; i < chunk_.triangles.size() && check(i).ok(); ++i) {
            const glm::uvec3 t = chunk_.triangles[i];
            const auto at = [&](std::uint32_t v) {
                const glm::vec3& p = vertices_[v].position;
                return core::snap(snap_, p.x, p.y, p.z);
            };
            visit(at(t.x), at(t.y), at(t.z));
        }
    }

private:
    [[nodiscard]] std::uint64_t number(std::size_t i) const {
        return first_number_ + (chunk_.part.whole != 0 ? chunk_.part.numbers[i] : i);
    }
    [[nodiscard]] status check(std::size_t i) const {
        const glm::uvec3 t = chunk_.triangles[i];
        if (t.x >= vertices_.size() || t.y >= vertices_.size() || t.z >= vertices_.size()) {
            status s = core::failure(status_code::index_out_of_range);
            s.draw = 0;
            s.triangle = static_cast<std::uint32_t>(i);
            return s;
        }
        if (number(i) >= std::numeric_limits<std::uint32_t>::max())
            return core::failure(status_code::too_many_triangles);
        return {};
    }

    const Mesh& chunk_;
    core::snap_transform snap_;
    glm::ivec3 extent_;
    binning how_;
    std::uint64_t first_number_;
    status valid_;
    core::raw_array<vertex_output<Varyings>> vertices_;
};

} // namespace voxelpipe::slabs
