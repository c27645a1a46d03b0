// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The snapped triangles of all draws of a call, and the cones that close their holes, in a backend's memory.

#include <voxelpipe/grid.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/surfaces/passes/cross_mesh.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

namespace voxelpipe::core {

template <class Backend>
class gathered_mesh {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    // cones: of each body. Throws as a buffer of the backend, and std::length_error for more vertices than 32 bits
    // number.
    template <class Mesh, class VertexShader, class Shader>
    gathered_mesh(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& samples,
                  const std::vector<hole_cones>& cones, bodies each)
        : positions_(backend, count_vertices(draws, cones)), triangles_(backend, count_triangles(draws, cones)),
          primitives_(backend, triangles_.size()), first_(backend, 0), body_(backend, 0) {
        std::vector<std::uint64_t> first;
        std::vector<std::uint32_t> body;
        std::uint64_t vertices = 0, triangles = 0;
        std::uint32_t primitives = 0;
        const snap_transform snapping = make_snap_transform(samples);
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const Mesh& m = draws[d].mesh;
            first.push_back(triangles);
            body.push_back(each == bodies::draw ? static_cast<std::uint32_t>(d) : 0);
            backend.for_each(m.num_vertices(), passes::snap_vertices<Mesh, VertexShader>{
                                                   m, draws[d].vertex_shader, static_cast<std::uint32_t>(d), snapping,
                                                   positions_.data() + vertices});
            backend.for_each(m.num_triangles(),
                             passes::copy_triangles{triangles_of(m), static_cast<std::uint32_t>(vertices),
                                                    triangles_.data() + triangles});
            const bool is_part = m.part.whole != 0;
            const auto whole = static_cast<std::uint32_t>(is_part ? m.part.whole : m.triangles.size());
            backend.for_each(m.num_triangles(),
                             passes::name_primitives{is_part ? m.part.numbers.data() : nullptr,
                                                     static_cast<std::uint32_t>(m.triangles.size()), whole, primitives,
                                                     primitives_.data() + triangles});
            vertices += m.num_vertices();
            triangles += m.num_triangles();
            primitives += static_cast<std::uint32_t>(m.num_primitives());
        }
        drawn_ = triangles;
        for (std::size_t b = 0; b < cones.size(); ++b) {
            const buffer<snapped_position> p(backend, array_view<const snapped_position>(cones[b].positions));
            const buffer<glm::uvec3> t(backend, array_view<const glm::uvec3>(cones[b].triangles));
            first.push_back(triangles);
            body.push_back(each == bodies::draw ? static_cast<std::uint32_t>(b) : 0);
            backend.for_each(p.size(), passes::copy_items<snapped_position>{p.data(), positions_.data() + vertices});
            const instanced_triangles all{t.data(), static_cast<std::uint32_t>(t.size()),
                                          static_cast<std::uint32_t>(p.size())};
            backend.for_each(t.size(), passes::copy_triangles{all, static_cast<std::uint32_t>(vertices),
                                                              triangles_.data() + triangles});
            vertices += p.size();
            triangles += t.size();
        }
        first_ = buffer<std::uint64_t>(backend, array_view<const std::uint64_t>(first));
        body_ = buffer<std::uint32_t>(backend, array_view<const std::uint32_t>(body));
    }

    // Refers to the object.
    [[nodiscard]] passes::mesh_triangles view() const {
        return {positions_.data(),
                triangles_.data(),
                primitives_.data(),
                triangles_.size(),
                drawn_,
                first_.data(),
                body_.data(),
                static_cast<std::uint32_t>(first_.size())};
    }

private:
    static std::size_t checked(std::uint64_t n) {
        if (n > std::numeric_limits<std::uint32_t>::max())
            throw std::length_error("voxelpipe: more vertices or triangles than 32 bits number");
        return n;
    }
    template <class Draws>
    static std::size_t count_vertices(const Draws& draws, const std::vector<hole_cones>& cones) {
        std::uint64_t n = 0;
        for (const auto& d : draws) n += d.mesh.num_vertices();
        for (const hole_cones& c : cones) n += c.positions.size();
        return checked(n);
    }
    template <class Draws>
    static std::size_t count_triangles(const Draws& draws, const std::vector<hole_cones>& cones) {
        std::uint64_t n = 0;
        for (const auto& d : draws) n += d.mesh.num_triangles();
        for (const hole_cones& c : cones) n += c.triangles.size();
        return checked(n);
    }

    buffer<snapped_position> positions_;
    buffer<glm::uvec3> triangles_;
    buffer<std::uint32_t> primitives_;
    buffer<std::uint64_t> first_;
    buffer<std::uint32_t> body_;
    std::uint64_t drawn_ = 0;
};

} // namespace voxelpipe::core
