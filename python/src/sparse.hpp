// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Baking into sparse framebuffers: the values of the voxels that have a fragment, in the Morton order of the voxels,
// which is the same for every attribute of a mesh.

#include "values.hpp"

#include <voxelpipe/sparse/sparse.hpp>

namespace voxelpipe::python {

// Indices (x, y, z) of the voxels of a table, three for each.
[[nodiscard]] inline std::vector<std::int32_t> coordinates_of(const brick_table& table) {
    std::vector<std::int32_t> coordinates;
    coordinates.reserve(3 * table.num_voxels());
    for (std::uint64_t b = 0; b < table.count; ++b)
        for_each_voxel_in(table, b, [&](const glm::ivec3& p, std::uint64_t) {
            coordinates.insert(coordinates.end(), {p.x, p.y, p.z});
        });
    return coordinates;
}

// Components values for each voxel, and as many voxels.
template <class T>
struct sparse_values {
    std::vector<T> values;
    std::size_t num_voxels = 0;
    status result;
};

template <class T, int Components, class Blend>
[[nodiscard]] sparse_values<T> draw_sparse_values(const bake_call<T>& call, bool is_mean) {
    using value = value_of<T, Components>;
    static_assert(sizeof(value) == Components * sizeof(T));
    cpu_backend backend{call.threads};
    sparse_framebuffer<cpu_backend, target<value, Blend>, number_of_fragments> fb{backend, call.where.extent};
    sparse_values<T> drawn;
    drawn.result = voxelize(backend, call.mesh, call.where, passthrough{},
                            counted_value_shader<T, Components>{call.rows}, fb, voxelize_options{call.rule});
    if (!drawn.result.ok()) return drawn;
    drawn.num_voxels = fb.num_voxels();
    const auto& values = get<0>(fb.contents().values);
    const auto& counts = get<1>(fb.contents().values);
    drawn.values.resize(drawn.num_voxels * Components);
    if (drawn.num_voxels != 0) std::memcpy(drawn.values.data(), values.data(), drawn.num_voxels * sizeof(value));
    finish(drawn.values.data(), counts.data(), drawn.num_voxels, Components, is_mean, T{0}, call.threads);
    return drawn;
}

} // namespace voxelpipe::python
