// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <voxelpipe/cells/links.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

// The links of all parts of the mesh, each part a draw: (voxels, q, primitives, draws, directions, counters), a row of
// the first four for each voxel of which a link is crossed. 2^32 - 1 where nothing is crossed.
nb::tuple list_links(const position_array& positions, const triangle_array& triangles,
                     const std::vector<std::uint64_t>& first_triangles, const grid& g, int neighbours,
                     unsigned threads) {
    using link_draw = draw<mesh_view<>, passthrough, none>;
    const auto draws = draws_of_parts<link_draw>(view_of(positions, triangles), first_triangles, none{});
    std::vector<glm::ivec3> voxels;
    std::vector<float> q;
    std::vector<std::uint32_t> primitives, of_draws;
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        link_list<cpu_backend> links(backend);
        s = voxelize_links(backend, draws, g, links, link_options{neighbours});
        voxels = links.voxels.to_host(backend);
        q = links.q.to_host(backend);
        primitives = links.primitives.to_host(backend);
        of_draws = links.draws.to_host(backend);
    }
    nb::dict counts = report(s);
    const std::size_t records = voxels.size(), columns = static_cast<std::size_t>(neighbours);
    std::vector<std::int32_t> places, directions;
    places.reserve(3 * records);
    for (const glm::ivec3& p : voxels) places.insert(places.end(), {p.x, p.y, p.z});
    for (int k = 0; k < neighbours; ++k) {
        const glm::ivec3 d = link_direction(k);
        directions.insert(directions.end(), {d.x, d.y, d.z});
    }
    return nb::make_tuple(to_numpy(std::move(places), {records, 3}), to_numpy(std::move(q), {records, columns}),
                          to_numpy(std::move(primitives), {records, columns}),
                          to_numpy(std::move(of_draws), {records, columns}),
                          to_numpy(std::move(directions), {columns, 3}), counts);
}

} // namespace

void bind_links(nb::module_& m) {
    m.def("links", &list_links, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"), nb::arg("grid"),
          nb::arg("neighbours"), nb::arg("threads"));
}

} // namespace voxelpipe::python
