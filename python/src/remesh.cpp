// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bricks.hpp"
#include "surface_options.hpp"
#include "surface_values.hpp"

#include <bindings/parts.hpp>
#include <voxelpipe/surfaces/remesh_sparse.hpp>

#include <nanobind/stl/optional.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

// (vertices, faces, cell, sheet, source, counters); source is empty where the surface has none. `world`: the grid of
// the samples, as vertices are to be placed.
nb::tuple arrays_of(cpu_backend& backend, const surface<cpu_backend>& made, const grid& world, const status& s) {
    std::vector<double> vertices;
    std::vector<std::int32_t> cells;
    std::vector<std::uint8_t> sheets;
    std::vector<std::uint32_t> faces;
    std::vector<std::int64_t> sources;
    const std::size_t n = made.vertices.size();
    const std::size_t corners = made.quads.size() != 0 ? 4 : 3,
                      m = made.quads.size() != 0 ? made.quads.size() : made.triangles.size();
    {
        const nb::gil_scoped_release released;
        vertices.reserve(3 * n);
        for (const surface_vertex& v : made.vertices.to_host(backend)) {
            const glm::dvec3 p = position(world, v);
            vertices.insert(vertices.end(), {p.x, p.y, p.z});
            cells.insert(cells.end(), {v.cell.x, v.cell.y, v.cell.z});
            sheets.push_back(static_cast<std::uint8_t>(v.sheet));
        }
        for (const glm::uvec3& t : made.triangles.to_host(backend)) faces.insert(faces.end(), {t.x, t.y, t.z});
        for (const glm::uvec4& q : made.quads.to_host(backend)) faces.insert(faces.end(), {q.x, q.y, q.z, q.w});
        for (const std::uint32_t from : made.sources.to_host(backend))
            sources.push_back(from == UINT32_MAX ? std::int64_t{-1} : std::int64_t{from});
    }
    const std::size_t with_source = sources.size();
    return nb::make_tuple(to_numpy(std::move(vertices), {n, 3}), to_numpy(std::move(faces), {m, corners}),
                          to_numpy(std::move(cells), {n, 3}), to_numpy(std::move(sheets), {n}),
                          to_numpy(std::move(sources), {with_source}), report_surface(s));
}

// make(backend, surface) makes the surface, without Python's lock.
template <class Make>
nb::tuple made_surface(const grid& world, unsigned threads, const Make& make) {
    cpu_backend backend{threads};
    surface<cpu_backend> made(backend);
    status s;
    {
        const nb::gil_scoped_release released;
        s = make(backend, made);
    }
    return arrays_of(backend, made, world, s);
}

// Rows of values for the vertices and the triangles of a mesh.
template <class T>
using value_array = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class T>
value_columns<T> columns_of(const value_array<T>& vertices, const value_array<T>& triangles) {
    return {vertices.data(), triangles.data(), vertices.shape(1), triangles.shape(1)};
}

// Surfaces with the values of column_shader.
template <class Fours, class Integers>
struct column_surface;
template <std::size_t... F, std::size_t... I>
struct column_surface<std::index_sequence<F...>, std::index_sequence<I...>> {
    template <class T, std::size_t>
    using repeated = T;
    using type = surface<cpu_backend, repeated<glm::vec4, F>..., repeated<std::int64_t, I>...>;

    // (n, columns) of floats, and of integers.
    static std::pair<nb::object, nb::object> arrays(cpu_backend& backend, const type& made, std::size_t floats,
                                                    std::size_t integers) {
        const std::size_t n = made.vertices.size();
        std::vector<float> rows(n * floats);
        std::vector<std::int64_t> whole(n * integers);
        const auto put_four = [&]<std::size_t K>() {
            const std::vector<glm::vec4> values = get<K>(made).to_host(backend);
            for (std::size_t v = 0; v < n; ++v)
                for (std::size_t c = 4 * K; c < std::min(floats, 4 * K + 4); ++c)
                    rows[v * floats + c] = values[v][static_cast<glm::length_t>(c - 4 * K)];
        };
        const auto put_integer = [&]<std::size_t K>() {
            if (K >= integers) return;
            const std::vector<std::int64_t> values = get<sizeof...(F) + K>(made).to_host(backend);
            for (std::size_t v = 0; v < n; ++v) whole[v * integers + K] = values[v];
        };
        (put_four.template operator()<F>(), ...);
        (put_integer.template operator()<I>(), ...);
        return {to_numpy(std::move(rows), {n, floats}), to_numpy(std::move(whole), {n, integers})};
    }
};

// Samples lie in bricks, which take no longer and less memory; those of a level in a grid, whose band may be wide.
template <class Draws, class Surface>
status remesh_by_level(cpu_backend& backend, const Draws& draws, const grid& g, Surface& made,
                       const remesh_options& options) {
    return options.level == 0 ? remesh_sparse(backend, draws, g, made, options)
                              : remesh(backend, draws, g, made, options);
}

// As voxelpipe/_remesh.py has them: at most 16 columns of floats and 4 of integers. The arrays of the surface, then
// (n, columns) of floats and of integers. Throws ValueError.
nb::tuple remesh_parts(const position_array& positions, const triangle_array& triangles,
                       const std::vector<std::uint64_t>& first_triangles, const grid& g, const grid& world,
                       const std::string& sign, const std::string& repair_name, const std::string& bodies_name,
                       std::optional<std::uint64_t> max_hole_edges, int closing, const std::string& place_name,
                       double level, bool corners, bool open, bool quads, std::uint32_t min_component, bool embedded,
                       const value_array<float>& vertex_floats, const value_array<float>& triangle_floats,
                       const value_array<std::int64_t>& vertex_integers,
                       const value_array<std::int64_t>& triangle_integers, unsigned threads) {
    const remesh_options options =
        remesh_options_named(sign, repair_name, bodies_name, max_hole_edges, closing, place_name, level, corners, open,
                             quads, min_component, embedded);
    const mesh_view<> mesh = view_of(positions, triangles);
    const value_columns<float> floats = columns_of(vertex_floats, triangle_floats);
    const value_columns<std::int64_t> integers = columns_of(vertex_integers, triangle_integers);
    const auto run = [&]<std::size_t Fours, std::size_t Integers>() -> nb::tuple {
        using columns = column_surface<std::make_index_sequence<Fours>, std::make_index_sequence<Integers>>;
        using shader = column_shader<Fours, Integers>;
        cpu_backend backend{threads};
        typename columns::type made(backend);
        status s;
        {
            const nb::gil_scoped_release released;
            const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, shader>>(
                mesh, first_triangles, shader{mesh.triangles.data(), floats, integers});
            s = remesh_by_level(backend, draws, g, made, options);
        }
        const nb::tuple arrays = arrays_of(backend, made, world, s);
        const auto [rows, whole] = columns::arrays(backend, made, floats.count(), integers.count());
        return nb::make_tuple(arrays, rows, whole);
    };
    if (integers.count() == 0 && floats.count() == 0)
        return nb::make_tuple(made_surface(world, threads,
                                           [&](cpu_backend& backend, surface<cpu_backend>& made) {
                                               const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, none>>(
                                                   mesh, first_triangles, none{});
                                               return remesh_by_level(backend, draws, g, made, options);
                                           }),
                              nb::none(), nb::none());
    if (integers.count() == 0 && floats.count() <= 4) return run.template operator()<1, 0>();
    return run.template operator()<4, 4>();
}

// (nz, ny, nx) bytes that are 0 or not.
nb::tuple extract_bits(const array<const std::uint8_t, 3>& values, const grid& g, const std::string& place_name,
                       bool open, bool quads, std::uint32_t min_component, bool embedded, unsigned threads) {
    expect_shape(values, g, "the array");
    using bits = target<bit, blend::replace>;
    const extract_options options = extract_options_named(place_name, 0.0, open, quads, min_component, embedded);
    return made_surface(g, threads, [&](cpu_backend& backend, surface<cpu_backend>& made) {
        framebuffer<cpu_backend, bits> inside(backend, g.extent);
        const target_view<bits>& view = get<0>(inside.view().targets);
        const std::uint8_t* const from = values.data();
        std::size_t i = 0;
        for (int z = 0; z < g.extent.z; ++z)
            for (int y = 0; y < g.extent.y; ++y)
                for (int x = 0; x < g.extent.x; ++x) view.store(x, y, z, from[i++] != 0);
        return extract(backend, view, g, made, options);
    });
}

nb::tuple extract_field(const array<const float, 3>& values, const grid& g, const std::string& place_name, double level,
                        bool open, bool quads, std::uint32_t min_component, bool embedded, unsigned threads) {
    expect_shape(values, g, "the array");
    using field = target<float, blend::replace>;
    const extract_options options = extract_options_named(place_name, level, open, quads, min_component, embedded);
    return made_surface(g, threads, [&](cpu_backend& backend, surface<cpu_backend>& made) {
        // The view is of a target that could be written; extract reads it.
        const target_view<field> view{const_cast<float*>(values.data()), g.extent}; // NOLINT(*-const-cast)
        return extract(backend, view, g, made, options);
    });
}

// Cubes of voxels (m, 4): the first voxel and the side, as tiles() has them.
using cube_array = nb::ndarray<const std::int32_t, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

// In ascending order. Throws IndexError for a cube that leaves the grid, and ValueError for one that is none of bricks,
// or has voxels of another one or of the list.
std::vector<brick_tile> tiles_of(const cube_array& cubes, const grid& g, const listed_bricks& listed) {
    std::vector<brick_tile> tiles;
    for (std::size_t i = 0; i < cubes.shape(0); ++i) {
        const std::int32_t* const c = cubes.data() + 4 * i;
        const std::int64_t side = c[3];
        int level = 0;
        while (std::int64_t{8} << level < side) ++level;
        bool is_aligned = std::int64_t{8} << level == side, is_within = true;
        for (int a = 0; a < 3; ++a) {
            is_aligned = is_aligned && (c[a] + std::int64_t{g.offset[a]}) % side == 0;
            is_within = is_within && c[a] >= 0 && c[a] + side <= g.extent[a];
        }
        const std::string name =
            "cube " + std::to_string(i) + " of side " + std::to_string(side) + " at " + voxel_text(c);
        if (!is_aligned)
            throw std::invalid_argument(name + " is none of 8, 16, 32 ... voxels that begins at a multiple");
        if (!is_within) throw std::out_of_range(name + " leaves the grid");
        const glm::ivec3 first(c[0] + g.offset.x, c[1] + g.offset.y, c[2] + g.offset.z);
        tiles.push_back(brick_tile::of(core::morton_key(first) >> 9, level));
    }
    std::sort(tiles.begin(), tiles.end(), [](const brick_tile& a, const brick_tile& b) { return a.bits < b.bits; });
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const auto next = std::lower_bound(listed.keys.begin(), listed.keys.end(), tiles[i].first());
        const bool has_listed = next != listed.keys.end() && *next < tiles[i].end();
        if (has_listed || (i + 1 < tiles.size() && tiles[i].end() > tiles[i + 1].first()))
            throw std::invalid_argument("two cubes, or a cube and a voxel of the list, are in one place");
    }
    return tiles;
}

// What is listed is inside.
nb::tuple extract_list(const voxel_array& voxels, const cube_array& cubes, const grid& g, const std::string& place_name,
                       bool open, bool quads, std::uint32_t min_component, bool embedded, unsigned threads) {
    const extract_options options = extract_options_named(place_name, 0.0, open, quads, min_component, embedded);
    return made_surface(g, threads, [&](cpu_backend& backend, surface<cpu_backend>& made) {
        using bits = target<bit, blend::replace>;
        sparse_framebuffer<cpu_backend, bits> inside(backend, g.extent);
        {
            const listed_bricks listed = bricks_of(voxels, g, g.offset);
            const std::vector<brick_tile> tiles = tiles_of(cubes, g, listed);
            sparse_contents<cpu_backend, bits> contents(backend);
            const auto hold = [&]<class T>(const std::vector<T>& from) {
                return cpu_backend::buffer<T>(backend, array_view<const T>(from));
            };
            contents.keys = hold(listed.keys);
            contents.masks = hold(listed.masks);
            contents.offsets = hold(listed.offsets);
            contents.tiles = hold(tiles);
            contents.num_voxels = voxels.shape(0);
            for (const brick_tile& t : tiles) contents.tile_voxels += t.num_voxels();
            get<0>(contents.values) = hold(
                std::vector<std::uint32_t>(core::rank_map<bits>::elements(contents.num_values()), ~std::uint32_t{0}));
            inside.take(std::move(contents), g);
        }
        return extract(backend, inside, g, made, options);
    });
}

} // namespace

void bind_remesh(nb::module_& m) {
    m.def(
        "at_corners", [](const grid& g) { return g.at_corners(); }, nb::arg("grid"));
    m.def("remesh", &remesh_parts, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("world"), nb::arg("sign"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("place"), nb::arg("level"), nb::arg("corners"),
          nb::arg("open"), nb::arg("quads"), nb::arg("min_component"), nb::arg("embedded"), nb::arg("vertex_floats"),
          nb::arg("triangle_floats"), nb::arg("vertex_integers"), nb::arg("triangle_integers"), nb::arg("threads"));
    m.def("extract_bits", &extract_bits, nb::arg("values"), nb::arg("grid"), nb::arg("place"), nb::arg("open"),
          nb::arg("quads"), nb::arg("min_component"), nb::arg("embedded"), nb::arg("threads"));
    m.def("extract_list", &extract_list, nb::arg("voxels"), nb::arg("cubes"), nb::arg("grid"), nb::arg("place"),
          nb::arg("open"), nb::arg("quads"), nb::arg("min_component"), nb::arg("embedded"), nb::arg("threads"));
    m.def("extract_field", &extract_field, nb::arg("values"), nb::arg("grid"), nb::arg("place"), nb::arg("level"),
          nb::arg("open"), nb::arg("quads"), nb::arg("min_component"), nb::arg("embedded"), nb::arg("threads"));
}

} // namespace voxelpipe::python
