// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces with values: up to four times `Fours` columns of floats, and `Integers` of integers.

#include "kept_surface.cuh"

namespace voxelpipe::python {

// Up to four columns, from `first` on.
struct put_floats {
    const glm::vec4* from;
    float* to;
    std::size_t columns, first;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const glm::vec4 v = from[i];
        float* const row = to + i * columns + first;
        const std::size_t left = columns - first;
        row[0] = v.x;
        if (left > 1) row[1] = v.y;
        if (left > 2) row[2] = v.z;
        if (left > 3) row[3] = v.w;
    }
};
struct put_integers {
    const std::int64_t* from;
    std::int64_t* to;
    std::size_t columns, column;
    VOXELPIPE_HD void operator()(std::size_t i) const { to[i * columns + column] = from[i]; }
};

// Surfaces with the values of column_shader.
template <class Fours, class Integers>
struct column_surface;
template <std::size_t... F, std::size_t... I>
struct column_surface<std::index_sequence<F...>, std::index_sequence<I...>> {
    // Structures: nvcc takes the pack out of an alias that ignores it.
    template <std::size_t>
    struct four {
        using type = glm::vec4;
    };
    template <std::size_t>
    struct integer {
        using type = std::int64_t;
    };
    using type = surface<cuda_backend, typename four<F>::type..., typename integer<I>::type...>;

    // Queues the copies of the columns that were asked for.
    static void put(const device_stream& on, const type& made, const surface_arrays& to) {
        const std::size_t n = made.vertices.size();
        const auto put_four = [&]<std::size_t K>() {
            if (4 * K < to.num_floats)
                for_each(on, n, put_floats{get<K>(made).data(), to.floats, to.num_floats, 4 * K});
        };
        const auto put_integer = [&]<std::size_t K>() {
            if (K < to.num_integers)
                for_each(on, n, put_integers{get<sizeof...(F) + K>(made).data(), to.integers, to.num_integers, K});
        };
        (put_four.template operator()<F>(), ...);
        (put_integer.template operator()<I>(), ...);
    }
};

template <std::size_t Fours, std::size_t Integers>
[[nodiscard]] surface_result
remesh_columns(const device_stream& on, const mesh_view<>& mesh, const std::vector<std::uint64_t>& first_triangles,
               const grid& g, const remesh_options& options, const grid& world, const surface_columns& values) {
    using columns = column_surface<std::make_index_sequence<Fours>, std::make_index_sequence<Integers>>;
    using shader = column_shader<Fours, Integers>;
    const current_device current(on);
    const auto kept = std::make_shared<kept_surface<typename columns::type>>(on);
    const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, shader>>(
        mesh, first_triangles, shader{mesh.triangles.data(), values.floats, values.integers});
    const status s = remesh_by_level(kept->own.backend, draws, g, kept->made, options);
    return result_of(on, kept, world, s, [on](const typename columns::type& made, const surface_arrays& to) {
        columns::put(on, made, to);
    });
}

} // namespace voxelpipe::python
