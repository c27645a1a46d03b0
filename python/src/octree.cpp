// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bricks.hpp"

#include <voxelpipe/sparse/octree.hpp>

#include <cpu_ref/parallel.hpp>

#include <cmath>
#include <thread>

namespace voxelpipe::python {
namespace {

using ray_array = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

struct voxel_octree {
    octree tree;
    grid where;
    std::vector<std::uint64_t> row_of;
};

voxel_octree make_octree(const voxel_array& voxels, const grid& g) {
    const nb::gil_scoped_release released;
    listed_bricks b = bricks_of(voxels, g, g.offset);
    const brick_table table{b.keys.data(), b.masks.data(), b.offsets.data(), b.keys.size(), g.extent, g.offset};
    return {octree(table, g.whole_extent()), g, std::move(b.row_of)};
}

// For each ray the row of its voxel, or -1; where along the ray it is met, or infinity; and the side, as axis + 1,
// negative where the ray enters through the lower side.
void first_hits(const voxel_octree& o, const ray_array& origins, const ray_array& directions, double limit,
                const array<std::int64_t, 1>& rows, const array<double, 1>& distances,
                const array<std::int8_t, 1>& sides, unsigned threads) {
    const std::size_t n = origins.shape(0);
    if (directions.shape(0) != n || rows.shape(0) != n || distances.shape(0) != n || sides.shape(0) != n)
        throw nb::value_error("rays need one direction for each origin");
    const nb::gil_scoped_release released;
    const octree_view view = o.tree.view();
    const grid whole = o.where.uncropped();
    constexpr std::size_t block = 1024;
    const unsigned workers = threads != 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
    cpu::parallel_for(workers, (n + block - 1) / block, [&](unsigned, std::size_t b) {
        for (std::size_t i = b * block; i < std::min(n, (b + 1) * block); ++i) {
            const double *p = origins.data() + 3 * i, *d = directions.data() + 3 * i;
            const glm::dvec3 from = whole.to_voxels({p[0], p[1], p[2]}),
                             along = glm::dvec3(d[0], d[1], d[2]) / whole.voxel_size;
            const voxel_hit hit = view.first_hit(from, along, limit);
            rows.data()[i] = hit.found ? static_cast<std::int64_t>(o.row_of[hit.rank]) : -1;
            distances.data()[i] = hit.found ? hit.distance : std::numeric_limits<double>::infinity();
            const int side = hit.axis + 1;
            sides.data()[i] = static_cast<std::int8_t>(!hit.found ? 0 : hit.from_above ? side : -side);
        }
    });
}

// The places of a level's nodes, (n, 3).
nb::object nodes_of(const voxel_octree& o, int level) {
    if (level < 1 || level > o.tree.num_levels())
        throw nb::value_error(
            ("level is 1 to " + std::to_string(o.tree.num_levels()) + ", not " + std::to_string(level)).c_str());
    std::vector<std::int32_t> places;
    o.tree.for_each_node(level, [&](const glm::ivec3& p, std::uint64_t) {
        places.insert(places.end(), {p.x, p.y, p.z});
    });
    const std::size_t n = places.size() / 3;
    return to_numpy(std::move(places), {n, 3});
}

} // namespace

void bind_octree(nb::module_& m) {
    nb::class_<voxel_octree>(m, "Octree", "See voxelpipe/_octree.py.")
        .def_static("of", &make_octree, nb::arg("voxels"), nb::arg("grid"))
        .def_prop_ro("num_levels", [](const voxel_octree& o) { return o.tree.num_levels(); })
        .def_prop_ro("num_bytes", [](const voxel_octree& o) { return o.tree.num_bytes(); })
        .def("first_hits", &first_hits, nb::arg("origins"), nb::arg("directions"), nb::arg("limit"), nb::arg("rows"),
             nb::arg("distances"), nb::arg("sides"), nb::arg("threads"))
        .def("nodes", &nodes_of, nb::arg("level"));
}

} // namespace voxelpipe::python
