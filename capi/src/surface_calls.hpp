// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// surface_calls on any backend.

#include "backend_calls.hpp"
#include "memory.hpp"

#include <bindings/sparse_values.hpp>

#include <algorithm>
#include <utility>

namespace voxelpipe::capi {

// A Session runs calls on its backend. `threads` of the host divide sums.
template <class Session>
class surface_calls_on final : public surface_calls {
public:
    using backend_type = typename Session::backend_type;
    using bits = target<bit, blend::bit_or>;

    surface_calls_on(const Session& session, unsigned threads) : session_(session), threads_(threads) {}

    [[nodiscard]] status surface(const vp_mesh& m, const grid& g, coverage rule, std::uint32_t* words) const override {
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            const std::size_t count = bindings::words_per_row(g.extent) * static_cast<std::size_t>(g.extent.y) *
                                      static_cast<std::size_t>(g.extent.z);
            const output_array<Session, std::uint32_t> out(backend, words, count);
            return out.take(backend,
                            voxelize(backend, mesh.view(), g, passthrough{}, constant(true),
                                     framebuffer_view<bits>::on(g.extent, out.data()), voxelize_options{rule}));
        });
    }

    [[nodiscard]] status list(const vp_mesh& m, const grid& g, coverage rule, vp_list& out) const override {
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            sparse_framebuffer<backend_type, bits> fb{backend, g.extent};
            const status s =
                voxelize(backend, mesh.view(), g, passthrough{}, constant(true), fb, voxelize_options{rule});
            if (s.ok()) out.coordinates = bindings::coordinates_of(fb, backend);
            return s;
        });
    }

    // Three columns a pass.
    [[nodiscard]] status list(const vp_mesh& m, const grid& g, coverage rule, const checked_rows& rows,
                              vp_list& out) const override {
        return session_.run([&](backend_type& backend) {
            const mesh_on mesh(backend, m);
            const std::size_t floats = rows.num_rows == 0 ? 0 : (rows.num_rows - 1) * rows.stride + rows.columns;
            const input_array<backend_type, float> values(backend, rows.values, floats);
            status s;
            out.columns = rows.columns;
            for (std::uint32_t first = 0; first < rows.columns; first += 3) {
                const std::uint32_t n = std::min(rows.columns - first, 3u);
                const bindings::bake_call<float> call{mesh.view(),
                                                      g,
                                                      rule,
                                                      {values.data() + first, rows.stride, static_cast<int>(n),
                                                       rows.per_triangle ? nullptr : mesh.view().triangles.data()},
                                                      threads_};
                auto drawn = draw(backend, call, rows.blend, first == 0, n);
                s = drawn.result;
                if (!s.ok()) return s;
                if (first == 0) out.coordinates = std::move(drawn.coordinates);
                if (rows.columns <= 3) {
                    out.values = std::move(drawn.values);
                    break;
                }
                out.values.resize(drawn.num_voxels * rows.columns);
                for (std::size_t i = 0; i < drawn.num_voxels; ++i)
                    for (std::uint32_t c = 0; c < n; ++c)
                        out.values[i * rows.columns + first + c] = drawn.values[i * n + c];
            }
            return s;
        });
    }

private:
    static bindings::sparse_values<float> draw(backend_type& backend, const bindings::bake_call<float>& call,
                                               std::int32_t how, bool with_voxels, std::uint32_t columns) {
        const auto with = [&]<class Blend>() {
            return bindings::first_columns(
                bindings::draw_sparse_values<float, 3, Blend>(backend, call, how == VP_BLEND_MEAN, with_voxels),
                columns);
        };
        return how == VP_BLEND_MIN    ? with.template operator()<blend::min>()
               : how == VP_BLEND_MAX  ? with.template operator()<blend::max>()
               : how == VP_BLEND_LAST ? with.template operator()<blend::replace>()
                                      : with.template operator()<blend::add>();
    }

    Session session_;
    unsigned threads_;
};

} // namespace voxelpipe::capi
