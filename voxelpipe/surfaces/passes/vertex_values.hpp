// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Values of a surface's vertices by the draws' fragment shaders (docs/design.md, "Surfaces"). Of crossings of the mesh:
// each is shaded once, at its exact place on its triangle, and a vertex combines those of its sheet. A vertex without
// any, as all vertices of a level, takes the value of the nearest triangle at its closest point. Functors for a
// backend's for_each, and the calls that run them.

#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/surfaces/core/vertex_value.hpp>
#include <voxelpipe/surfaces/passes/build.hpp>
#include <voxelpipe/surfaces/passes/mesh_shading.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

namespace voxelpipe::core {

namespace passes {

// What a shader says at a crossing.
template <class... Values>
struct crossing_value {
    pack<Values...> values;
    bool is_known; // false: there is no triangle, or the shader has discarded it
};

// Where a row along an axis meets a triangle.
struct row_weights {
    glm::vec3 weights; // of its vertices; none is negative
    bool looks_up;     // its normal's component along the axis is positive
};
// The weights at the sample's row along `axis`, which meets the triangle a b c: quotients of exact integers, below
// 2^84, each rounded to double, and the quotient to float. The row's offset is no distance.
[[nodiscard]] VOXELPIPE_HD inline row_weights weights_on_row(const snapped_position& a, const snapped_position& b,
                                                             const snapped_position& c, int axis,
                                                             const snapped_position& sample) {
    const auto flat = [&](const snapped_position& p) {
        return to_uvw<std::int64_t>(axis, p.x - sample.x, p.y - sample.y, p.z - sample.z);
    };
    const triple<std::int64_t> v[3] = {flat(a), flat(b), flat(c)};
    const auto area = [&](int i, int j) {
        return static_cast<int128>(v[i][0]) * v[j][1] - static_cast<int128>(v[i][1]) * v[j][0];
    };
    const int128 of_a = area(1, 2), of_b = area(2, 0), of_c = area(0, 1), all = of_a + of_b + of_c;
    const auto weight = [&](int128 part) {
        return exact::to_float(exact::div(exact::to_double(part), exact::to_double(all)));
    };
    return {{weight(of_a), weight(of_b), weight(of_c)}, all > 0};
}

// Shades the crossing of an edge. For edges_of_cell.
template <class Shading, class... Values>
struct shade_crossings {
    const edge_crossing* crossings;
    Shading shading;
    crossing_value<Values...>* values;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t number, int axis, const glm::ivec3& low, bool goes_out) const {
        values[number] = shade(crossings[number].triangle, axis, low, goes_out);
    }

private:
    VOXELPIPE_ANY_CALLABLE
    [[nodiscard]] VOXELPIPE_HD crossing_value<Values...> shade(std::uint32_t triangle, int axis,
                                                               const glm::ivec3& first, bool goes_out) const {
        if (triangle >= shading.mesh.drawn) return {};
        const std::int64_t half = std::int64_t{1} << (shading.fraction - 1);
        const auto centre = [&](int v) { return static_cast<std::int64_t>(v) * 2 * half + half; };
        const snapped_position sample{centre(first.x), centre(first.y), centre(first.z)};
        const glm::uvec3 t = shading.mesh.triangles[triangle];
        const row_weights w = weights_on_row(shading.mesh.positions[t.x], shading.mesh.positions[t.y],
                                             shading.mesh.positions[t.z], axis, sample);
        const auto out = shading.shade(triangle, w.weights, first, w.looks_up != goes_out);
        return {out.values, out.keep};
    }
};

// Array I of the surface's values, of type T.
template <class... Values>
using value_arrays = pack<Values*...>;

// Combines the values of the crossings of vertex i. missing[count] becomes 0, for a sum.
template <class Cells, class... Values>
struct combine_values {
    Cells cells;
    const surface_vertex* vertices;
    const crossing_value<Values...>* crossings;
    std::uint64_t count;
    value_arrays<Values...> out;
    std::uint32_t* missing;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count) {
            missing[i] = 0;
            return;
        }
        const surface_vertex v = vertices[i];
        const cell_key at = cell_key::of(v.cell.x + 1, v.cell.y + 1, v.cell.z + 1);
        const cell_sheets sheets = cells.sheets(cells.find(at.x(), at.y(), at.z()));
        std::uint64_t known[sheet_points::most]{};
        int n = 0;
        for (int e = 0; e < 12; ++e) {
            if (sheets.of_edge(e) != v.sheet) continue;
            const std::uint64_t c = cells.crossing(at, e);
            if (crossings[c].is_known) known[n++] = c;
        }
        missing[i] = n == 0 ? 1 : 0;
        if (n == 0) return;
        for_each_index<sizeof...(Values)>([&]<std::size_t I>() {
            using T = std::remove_pointer_t<std::remove_cvref_t<decltype(voxelpipe::get<I>(out))>>;
            T values[sheet_points::most]{};
            for (int k = 0; k < n; ++k) values[k] = voxelpipe::get<I>(crossings[known[k]].values);
            voxelpipe::get<I>(out)[i] = vertex_value<T>::combine(values, n);
        });
    }
};

// All are missing, but for the sum's last.
struct miss_all {
    std::uint64_t count;
    std::uint32_t* missing;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { missing[i] = i != count ? 1 : 0; }
};
// The vertices without a value, and their positions.
struct list_missing {
    const std::uint32_t* missing;
    const std::uint64_t* places;
    const surface_vertex* vertices;
    grid samples;
    std::uint32_t* listed;
    glm::vec3* points;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (missing[i] == 0) return;
        const glm::dvec3 p = position(samples, vertices[i]);
        listed[places[i]] = static_cast<std::uint32_t>(i);
        points[places[i]] = {exact::to_float(p.x), exact::to_float(p.y), exact::to_float(p.z)};
    }
};

// Shades the nearest triangle of point i where it is closest. Without a triangle, or discarded: zeros.
template <class Shading, class... Values>
struct shade_nearest {
    Shading shading;
    snap_transform snapping;
    distance_scale scale;
    const std::uint32_t* listed;
    const glm::vec3* points;
    const std::int64_t* nearest;
    const surface_vertex* vertices;
    int outside; // 1: the outside is where the vertices lie, seen from the triangles; -1: beyond
    value_arrays<Values...> out;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint32_t v = listed[i];
        pack<Values...> values{};
        if (nearest[i] >= 0) {
            const std::uint32_t t = shading.triangle_of(static_cast<std::uint32_t>(nearest[i]));
            const glm::uvec3 c = shading.mesh.triangles[t];
            const glm::vec3 p = points[i];
            const seen_triangle seen = see_wide(shading.mesh.positions[c.x], shading.mesh.positions[c.y],
                                                shading.mesh.positions[c.z], snap(snapping, p.x, p.y, p.z));
            const triple<double> w = closest_weights(seen, scale, find_distance(seen, scale).region);
            const auto shaded = shading.shade(t, {exact::to_float(w[0]), exact::to_float(w[1]), exact::to_float(w[2])},
                                              vertices[v].cell, side_of(seen) * outside < 0);
            if (shaded.keep) values = shaded.values;
        }
        for_each_index<sizeof...(Values)>(
            [&]<std::size_t I>() { voxelpipe::get<I>(out)[v] = voxelpipe::get<I>(values); });
    }
};

} // namespace passes

// The values of a surface that has been made. `asked` are the draws with their fragment shaders, `g` the grid of the
// call. cells and crossings: null for a level other than 0, whose vertices all take the nearest triangle's value.
template <class Backend, class Mesh, class VertexShader, class Shader, class Cells, class... Values>
[[nodiscard]] status shade_surface(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> asked,
                                   const grid& g, const passes::mesh_triangles& mesh, const Cells* cells,
                                   const edge_crossing* crossings, double level, surface<Backend, Values...>& made,
                                   surface_counters& counts) {
    using shading_type = gathered_shading<Backend, Mesh, VertexShader, Shader>;
    using view_type = typename shading_type::view_type;
    using words = typename Backend::template buffer<std::uint32_t>;
    const std::uint64_t vertices = made.vertices.size();
    for_each_index<sizeof...(Values)>([&]<std::size_t I>() {
        auto& values = voxelpipe::get<I>(made.values);
        values = std::remove_cvref_t<decltype(values)>(backend, vertices);
    });
    if (vertices == 0) return {};
    const auto out = [&]<std::size_t... I>(std::index_sequence<I...>) {
        return passes::value_arrays<Values...>{make_pack(voxelpipe::get<I>(made.values).data()...)};
    }
    (std::index_sequence_for<Values...>{});
    const shading_type shading(backend, asked, made.samples, mesh);
    words missing(backend, vertices + 1);
    if (cells != nullptr) {
        typename Backend::template buffer<passes::crossing_value<Values...>> values(backend, cells->num_edges());
        using cells_type = typename Cells::list_type;
        for_each_edge<passes::all_axes>(
            backend, *cells, passes::shade_crossings<view_type, Values...>{crossings, shading.view(), values.data()});
        backend.for_each(vertices + 1,
                         passes::combine_values<cells_type, Values...>{cells->list(), made.vertices.data(),
                                                                       values.data(), vertices, out, missing.data()});
    } else {
        backend.for_each(vertices + 1, passes::miss_all{vertices, missing.data()});
    }
    typename Backend::template buffer<std::uint64_t> places(backend, vertices + 1);
    counts.nearest_values = backend.sum(missing, places);
    if (counts.nearest_values == 0) return {};
    words listed(backend, counts.nearest_values);
    typename Backend::template buffer<glm::vec3> points(backend, counts.nearest_values);
    typename Backend::template buffer<std::int64_t> nearest(backend, counts.nearest_values);
    backend.for_each(vertices, passes::list_missing{missing.data(), places.data(), made.vertices.data(), made.samples,
                                                    listed.data(), points.data()});
    distance_arrays wanted; // no names of members in braces: nvcc writes them in a form that clang++ warns of
    wanted.nearest = nearest.data();
    distance_options unsigned_ones;
    unsigned_ones.sign = distance_sign::none;
    const status found =
        distance_at(backend, asked, g, backend_view<const glm::vec3>(points.view()), wanted, unsigned_ones);
    if (!found.ok()) return found;
    backend.for_each(counts.nearest_values,
                     passes::shade_nearest<view_type, Values...>{
                         shading.view(), make_snap_transform(made.samples),
                         make_distance_scale(made.samples.voxel_size, made.samples.fraction()), listed.data(),
                         points.data(), nearest.data(), made.vertices.data(), level < 0.0 ? -1 : 1, out});
    return {};
}

} // namespace voxelpipe::core
