// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of all languages: attributes that are baked into sparse framebuffers, which gives the values
// of the voxels that have a fragment in the Morton order of the voxels, the same for every attribute of a mesh.

#include <bindings/bits.hpp>
#include <bindings/value_rows.hpp>

#include <cpu_ref/backend.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace voxelpipe::bindings {

// A call's mesh, grid and values. The arrays are the caller's, in the memory of the backend that draws.
template <class T>
struct bake_call {
    mesh_view<> mesh;
    grid where;
    coverage rule = coverage::conservative;
    value_rows<T> rows;
    unsigned threads = 0;
};

// Divides the sums of a mean by the numbers of fragments, each quotient rounded once. `values` has `components` for
// each of the counts, none of which is 0.
template <class T>
void divide(T* values, const std::uint32_t* counts, std::size_t n, std::size_t components, unsigned threads) {
    constexpr std::size_t block = std::size_t{1} << 16;
    cpu::parallel_for(workers_of(threads), (n + block - 1) / block, [&](unsigned, std::size_t b) {
        for (std::size_t i = b * block; i < std::min(n, (b + 1) * block); ++i)
            for (std::size_t c = 0; c < components; ++c) values[i * components + c] /= static_cast<T>(counts[i]);
    });
}

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

// The same of a framebuffer that may lie on a device.
template <class Backend, class... Targets>
[[nodiscard]] std::vector<std::int32_t> coordinates_of(const sparse_framebuffer<Backend, Targets...>& fb,
                                                       Backend& backend) {
    if constexpr (requires { Backend::runs_on_host; })
        return coordinates_of(fb.view().table);
    else
        return coordinates_of(fb.to_host(backend).table());
}

// The tiles of a table, four numbers for each: its first voxel (x, y, z), and its side in voxels.
[[nodiscard]] inline std::vector<std::int32_t> cubes_of(const brick_table& table) {
    std::vector<std::int32_t> cubes;
    cubes.reserve(4 * static_cast<std::size_t>(table.num_tiles));
    for (std::uint64_t t = 0; t < table.num_tiles; ++t) {
        const glm::ivec3 first = table.tiles[t].origin() - table.offset;
        cubes.insert(cubes.end(), {first.x, first.y, first.z, table.tiles[t].side()});
    }
    return cubes;
}

// Components values for each voxel, and the voxels' indices where they are asked for.
template <class T>
struct sparse_values {
    std::vector<T> values;
    std::vector<std::int32_t> coordinates;
    std::size_t num_voxels = 0;
    status result;
};

// Draws on any backend. Sums are divided on the host by call.threads threads: a device's quotient of NaN has other
// bits.
template <class T, int Components, class Blend, class Backend>
[[nodiscard]] sparse_values<T> draw_sparse_values(Backend& backend, const bake_call<T>& call, bool is_mean,
                                                  bool with_voxels) {
    using value = value_of<T, Components>;
    static_assert(sizeof(value) == Components * sizeof(T));
    sparse_framebuffer<Backend, target<value, Blend>, number_of_fragments> fb{backend, call.where.extent};
    sparse_values<T> drawn;
    drawn.result = voxelize(backend, call.mesh, call.where, passthrough{},
                            counted_value_shader<T, Components>{call.rows}, fb, voxelize_options{call.rule});
    if (!drawn.result.ok()) return drawn;
    drawn.num_voxels = fb.num_voxels();
    drawn.values.resize(drawn.num_voxels * Components);
    const auto take = [&](const brick_table& table, const value* values, const std::uint32_t* counts) {
        if (with_voxels) drawn.coordinates = coordinates_of(table);
        if (drawn.num_voxels != 0) std::memcpy(drawn.values.data(), values, drawn.num_voxels * sizeof(value));
        if (is_mean) divide(drawn.values.data(), counts, drawn.num_voxels, Components, call.threads);
    };
    if constexpr (requires { Backend::runs_on_host; }) {
        const auto& lists = fb.contents().values;
        take(fb.view().table, get<0>(lists).data(), get<1>(lists).data());
    } else {
        const auto copied = fb.to_host(backend);
        take(copied.table(), get<0>(copied.values).data(), get<1>(copied.values).data());
    }
    return drawn;
}

template <class T, int Components, class Blend>
[[nodiscard]] sparse_values<T> draw_sparse_values(const bake_call<T>& call, bool is_mean, bool with_voxels) {
    cpu_backend backend{call.threads};
    return draw_sparse_values<T, Components, Blend>(backend, call, is_mean, with_voxels);
}

// Of three columns the first ones: a lone column is drawn as one of three where that is rare, a third of the time to
// compile.
[[nodiscard]] inline sparse_values<float> first_columns(sparse_values<float>&& drawn, std::size_t columns) {
    if (columns == 3) return std::move(drawn);
    for (std::size_t i = 0; i < drawn.num_voxels; ++i)
        for (std::size_t c = 0; c < columns; ++c) drawn.values[i * columns + c] = drawn.values[3 * i + c];
    drawn.values.resize(drawn.num_voxels * columns);
    return std::move(drawn);
}

} // namespace voxelpipe::bindings
