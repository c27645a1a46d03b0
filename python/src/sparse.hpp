// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Baking into sparse framebuffers: the values of the voxels that have a fragment, in the Morton order of the voxels,
// which is the same for every attribute of a mesh.

#include "values.hpp"

#include <voxelpipe/sparse/sparse.hpp>

namespace voxelpipe::python {

// Indices (x, y, z) of the voxels of a table, three for each, in Morton order; without those of tiles where they are
// not wanted.
[[nodiscard]] inline std::vector<std::int32_t> coordinates_of(const brick_table& table, bool with_tiles = true) {
    std::vector<std::int32_t> coordinates;
    coordinates.reserve(3 * (with_tiles ? table.num_voxels() : table.num_in_bricks()));
    const auto add = [&](const glm::ivec3& p, std::uint64_t) {
        coordinates.insert(coordinates.end(), {p.x, p.y, p.z});
    };
    for_each_brick_and_tile(
        table, [&](std::uint64_t b) { for_each_voxel_in(table, b, add); },
        [&](std::uint64_t t) {
            if (with_tiles) for_each_voxel_in_tile(table, t, add);
        });
    return coordinates;
}

// Components values for each voxel, and the voxels' indices where they are asked for.
template <class T>
struct sparse_values {
    std::vector<T> values;
    std::vector<std::int32_t> coordinates;
    std::size_t num_voxels = 0;
    status result;
};

template <class T, int Components, class Blend>
[[nodiscard]] sparse_values<T> draw_sparse_values(const bake_call<T>& call, bool is_mean, bool with_voxels) {
    using value = value_of<T, Components>;
    static_assert(sizeof(value) == Components * sizeof(T));
    cpu_backend backend{call.threads};
    sparse_framebuffer<cpu_backend, target<value, Blend>, number_of_fragments> fb{backend, call.where.extent};
    sparse_values<T> drawn;
    drawn.result = voxelize(backend, call.mesh, call.where, passthrough{},
                            counted_value_shader<T, Components>{call.rows}, fb, voxelize_options{call.rule});
    if (!drawn.result.ok()) return drawn;
    drawn.num_voxels = fb.num_voxels();
    if (with_voxels) drawn.coordinates = coordinates_of(fb.view().table);
    const auto& values = get<0>(fb.contents().values);
    const auto& counts = get<1>(fb.contents().values);
    drawn.values.resize(drawn.num_voxels * Components);
    if (drawn.num_voxels != 0) std::memcpy(drawn.values.data(), values.data(), drawn.num_voxels * sizeof(value));
    if (is_mean) divide(drawn.values.data(), counts.data(), drawn.num_voxels, Components, call.threads);
    return drawn;
}

// (values, voxels or None, counters).
template <class T>
[[nodiscard]] nb::tuple give(sparse_values<T>&& drawn, std::initializer_list<std::size_t> shape, bool with_voxels) {
    nb::dict counts = report(drawn.result);
    nb::object voxels = with_voxels ? to_numpy(std::move(drawn.coordinates), {drawn.num_voxels, 3}) : nb::none();
    return nb::make_tuple(to_numpy(std::move(drawn.values), shape), voxels, counts);
}

} // namespace voxelpipe::python
