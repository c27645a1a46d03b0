// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// solid_calls on any backend.

#include "backend_calls.hpp"
#include "memory.hpp"

#include <bindings/parts.hpp>
#include <bindings/sparse_values.hpp>

namespace voxelpipe::capi {

// A Session runs calls on its backend.
template <class Session>
class solid_calls_on final : public solid_calls {
public:
    using backend_type = typename Session::backend_type;
    using bits = target<bit, blend::bit_or>;
    using draw_type = draw<mesh_view<>, passthrough, decltype(constant(true))>;

    explicit solid_calls_on(const Session& session) : session_(session) {}

    [[nodiscard]] status solid(const vp_mesh& m, const grid& g, const solid_options& o,
                               std::uint32_t* words) const override {
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            const std::size_t count = bindings::words_per_row(g.extent) * static_cast<std::size_t>(g.extent.y) *
                                      static_cast<std::size_t>(g.extent.z);
            const output_array<Session, std::uint32_t> out(backend, words, count);
            return out.take(backend,
                            voxelize_solid(backend,
                                           bindings::draws_of_parts<draw_type>(mesh.view(), m.parts, constant(true)), g,
                                           framebuffer_view<bits>::on(g.extent, out.data()), o));
        });
    }

    [[nodiscard]] status list(const vp_mesh& m, const grid& g, const solid_options& o, vp_list& out) const override {
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            sparse_framebuffer<backend_type, bits> fb{backend, g.extent};
            const status s = voxelize_solid(
                backend, bindings::draws_of_parts<draw_type>(mesh.view(), m.parts, constant(true)), g, fb, o);
            if (s.ok()) out.coordinates = bindings::coordinates_of(fb, backend);
            return s;
        });
    }

private:
    Session session_;
};

} // namespace voxelpipe::capi
