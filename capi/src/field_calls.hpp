// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// field_calls on any backend.

#include "backend_calls.hpp"
#include "memory.hpp"

#include <bindings/nearest.hpp>
#include <bindings/parts.hpp>
#include <voxelpipe/cells/cells.hpp>
#include <voxelpipe/cells/links.hpp>

namespace voxelpipe::capi {

// A Session runs calls on its backend.
template <class Session>
class field_calls_on final : public field_calls {
public:
    using backend_type = typename Session::backend_type;
    using distance_draw = draw<mesh_view<>, passthrough, distance>;

    explicit field_calls_on(const Session& session) : session_(session) {}

    [[nodiscard]] status distance_field(const vp_mesh& m, const grid& g, const glm::ivec3& samples,
                                        const distance_options& o, float* distances,
                                        std::int64_t* nearest) const override {
        using bindings::numbers, bindings::distance_and_nearest;
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            const output_array<Session, float> d(backend, distances, count_of(samples));
            if (nearest == nullptr)
                return d.take(backend,
                              voxelize_distance(
                                  backend, bindings::draws_of_parts<distance_draw>(mesh.view(), m.parts, distance{}), g,
                                  framebuffer_view<bindings::distances>::on(samples, d.data()), o));
            const output_array<Session, std::int64_t> n(backend, nearest, count_of(samples));
            using both = draw<mesh_view<>, passthrough, distance_and_nearest>;
            const status s = voxelize_distance(
                backend, bindings::draws_of_parts<both>(mesh.view(), m.parts, distance_and_nearest{}), g,
                framebuffer_view<bindings::distances, numbers>::on(samples, d.data(), n.data()), o);
            return n.take(backend, d.take(backend, s));
        });
    }

    [[nodiscard]] status distances_at(const vp_mesh& m, const grid& g, const distance_options& o,
                                      const std::vector<glm::vec3>& points, float* distances,
                                      std::int64_t* nearest) const override {
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            const input_array<backend_type, glm::vec3> at(backend, points.data(), points.size());
            const output_array<Session, float> d(backend, distances, points.size());
            const output_array<Session, std::int64_t> n(backend, nearest, points.size());
            const auto draws = bindings::draws_of_parts<distance_draw>(mesh.view(), m.parts, distance{});
            const status s =
                distance_at(backend, std::span<const distance_draw>(draws), g, at.view(), {d.data(), n.data()}, o);
            return n.take(backend, d.take(backend, s));
        });
    }

    [[nodiscard]] status fractions(const vp_mesh& m, const grid& g, int axis, float* out) const override {
        using parts = target<float, blend::replace>;
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            const output_array<Session, float> f(backend, out, count_of(g.extent));
            cell_options o;
            o.axis = axis;
            return f.take(backend, voxelize_cells(backend, mesh.view(), g, passthrough{}, fraction{},
                                                  framebuffer_view<parts>::on(g.extent, f.data()), o));
        });
    }

    [[nodiscard]] status links(const vp_mesh& m, const grid& g, vp_links& out) const override {
        using link_draw = draw<mesh_view<>, passthrough, none>;
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            link_list<backend_type> found(backend);
            const status s = voxelize_links(backend, bindings::draws_of_parts<link_draw>(mesh.view(), m.parts, none{}),
                                            g, found, link_options{static_cast<int>(out.neighbours)});
            if (!s.ok()) return s;
            out.voxels = found.voxels.to_host(backend);
            out.q = found.q.to_host(backend);
            out.triangles = found.primitives.to_host(backend);
            out.parts = found.draws.to_host(backend);
            return s;
        });
    }

private:
    Session session_;
};

} // namespace voxelpipe::capi
