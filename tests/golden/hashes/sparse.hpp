// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse framebuffers, octrees over them with their levels, graphs and rays, and NanoVDB files.

#include "cases.hpp"

#include <voxelpipe/sparse/backend_octree_dag.hpp>
#include <voxelpipe/sparse/io/nanovdb.hpp>

#include <glm/vec2.hpp>

#include <bit>
#include <utility>

namespace golden {

struct sparse_values {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(vp::exact::div(f.normal.x, 3.0f), 1u, static_cast<std::int32_t>(f.primitive % 4001u) - 2000)
            .discard_if(f.primitive % 13u == 6u);
    }
};
// Not constant, so that a solid's bricks are no tiles.
struct solid_values_of_bricks {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
        return vp::outputs(static_cast<float>(f.voxel.x % 5), 1u, static_cast<std::int32_t>(f.winding));
    }
};

template <class Backend>
using sparse_targets =
    vp::sparse_framebuffer<Backend, vp::target<float, vp::blend::add>, vp::target<std::uint32_t, vp::blend::count>,
                           vp::target<std::int32_t, vp::blend::max>>;

template <class Backend>
void draw_sparse(Backend& backend, digest& d, sparse_targets<Backend>& fb, const mesh_data& m, const vp::grid& grid,
                 vp::coverage rule = vp::coverage::conservative) {
    const auto drawn = upload(backend, m);
    add_counts(d, vp::voxelize(backend, drawn, grid, vp::passthrough{}, sparse_values{}, fb, rule));
}

struct octree_ray {
    glm::dvec3 origin, direction;
};
// The rays of number i: from around the grid, some along axes.
[[nodiscard]] VOXELPIPE_HD inline octree_ray ray_of(std::uint32_t i) {
    octree_ray r{};
    for (int a = 0; a < 3; ++a) {
        r.origin[a] = static_cast<double>(mixed(i, static_cast<std::uint32_t>(a)) % 81920u) * 0x1p-10 - 15.0;
        r.direction[a] = static_cast<double>(mixed(i, static_cast<std::uint32_t>(a) + 3u) % 2049u) * 0x1p-10 - 1.0;
        if (i % 6u == static_cast<std::uint32_t>(a)) r.direction[a] = 0;
    }
    return r;
}
struct cast_octree_ray {
    vp::octree_view tree;
    glm::ivec4* hits;     // the voxel, and the side; -1 where there is none
    double* distances;    // 0 where there is none
    std::uint64_t* ranks; // of the voxels
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const octree_ray r = ray_of(static_cast<std::uint32_t>(i));
        const vp::voxel_hit hit = tree.first_hit(r.origin, r.direction);
        hits[i] = hit.found ? glm::ivec4(hit.voxel, hit.axis + (hit.from_above ? 8 : 0)) : glm::ivec4(-1);
        distances[i] = hit.found ? hit.distance : 0;
        ranks[i] = hit.found ? hit.rank : 0;
    }
};

template <class Backend>
void add_octree_nodes(Backend& backend, digest& d, const vp::backend_octree<Backend>& tree) {
    const vp::octree host = tree.to_host(backend);
    for (int l = 1; l <= host.num_levels(); ++l) {
        std::vector<glm::ivec3> places;
        std::vector<std::uint64_t> numbers, masks;
        host.for_each_node(l, [&](const glm::ivec3& place, std::uint64_t n) {
            places.push_back(place);
            numbers.push_back(n);
            masks.push_back(host.level(l).mask(n));
        });
        d.add(places);
        d.add(numbers);
        d.add(masks);
    }
}
template <class Backend>
void add_octree_graph(Backend& backend, digest& d, const vp::backend_octree<Backend>& tree) {
    const vp::backend_octree_dag<Backend> graph(backend, tree);
    const vp::octree_dag host = graph.to_host(backend);
    const vp::octree_dag_view view = host.view();
    for (int l = 1; l <= host.num_levels(); ++l) {
        const auto at = static_cast<std::size_t>(l) - 1;
        const auto n = static_cast<std::size_t>(host.num_nodes(l));
        std::size_t children = 0;
        for (std::size_t i = 0; i < n; ++i) children += static_cast<std::size_t>(std::popcount(view.masks[at][i]));
        d.add(std::span<const std::uint8_t>(view.masks[at], n));
        if (l == 1) continue;
        d.add(std::span<const std::uint32_t>(view.first[at], n));
        d.add(std::span<const std::uint32_t>(view.children[at], children));
    }
}
template <class Backend>
void add_octree_rays(Backend& backend, digest& d, const vp::backend_octree<Backend>& tree) {
    constexpr std::size_t n = 2000;
    typename Backend::template buffer<glm::ivec4> hits(backend, n);
    typename Backend::template buffer<double> distances(backend, n);
    typename Backend::template buffer<std::uint64_t> ranks(backend, n);
    backend.for_each(n, cast_octree_ray{tree.view(), hits.data(), distances.data(), ranks.data()});
    d.add(hits.to_host(backend));
    d.add(distances.to_host(backend));
    d.add(ranks.to_host(backend));
}
template <std::size_t I, class Reducer, class Backend>
void add_octree_levels(case_table<Backend>& cases, const std::string& name, const Reducer& reducer) {
    for (const bool keeps : {false, true})
        cases.push_back(
            {"octree.levels." + name + (keeps ? ".kept_sums" : ""), [reducer, keeps](Backend& backend, digest& d) {
                 sparse_targets<Backend> fb(backend, odd_grid().extent);
                 fb.template keep_sums<0>(keeps);
                 draw_sparse(backend, d, fb, hashed_mesh("soup"), odd_grid());
                 const vp::backend_octree<Backend> tree(backend, fb);
                 const auto levels = vp::reduce_levels<I>(backend, tree, fb, reducer);
                 for (int l = 1; l <= levels.num_levels(); ++l) d.add(levels.at(l).to_host(backend));
             }});
}

// The bytes of a file with one grid a target.
template <class Backend>
void add_nanovdb(Backend& backend, digest& d, const sparse_targets<Backend>& fb) {
    const auto host = fb.to_host(backend);
    vp::io::nanovdb_file file;
    file.add_target<0>("sums", host);
    file.add_target<1>("count", host);
    file.add_target<2>("most", host);
    file.add_mask("mask", host);
    std::vector<std::byte> bytes;
    file.write([&](const void* from, std::size_t count) {
        const auto* const first = static_cast<const std::byte*>(from);
        bytes.insert(bytes.end(), first, first + count);
    });
    d.add(bytes);
}

template <class Backend>
void add_sparse(case_table<Backend>& cases) {
    using framebuffer = sparse_targets<Backend>;
    for (const named_mesh& m : hashed_meshes()) {
        for (const named_coverage& c : {coverages[0], coverages[1]})
            cases.push_back({std::string("sparse.") + c.name + '.' + m.name,
                             [mesh = &m.data, rule = c.rule](Backend& backend, digest& d) {
                                 framebuffer fb(backend, odd_grid().extent);
                                 draw_sparse(backend, d, fb, *mesh, odd_grid(), rule);
                                 add_sparse_contents(d, fb.to_host(backend));
                             }});
        cases.push_back({"sparse.kept_sums." + m.name, [mesh = &m.data](Backend& backend, digest& d) {
                             framebuffer fb(backend, odd_grid().extent);
                             fb.template keep_sums<0>();
                             draw_sparse(backend, d, fb, *mesh, odd_grid());
                             add_sparse_contents(d, fb.to_host(backend));
                         }});
    }
    cases.push_back({"sparse.crop", [](Backend& backend, digest& d) {
                         framebuffer fb(backend, crop_of_odd_grid().extent);
                         draw_sparse(backend, d, fb, hashed_mesh("torus"), crop_of_odd_grid());
                         add_sparse_contents(d, fb.to_host(backend));
                     }});
    cases.push_back({"sparse.load", [](Backend& backend, digest& d) {
                         framebuffer fb(backend, odd_grid().extent);
                         draw_sparse(backend, d, fb, hashed_mesh("torus"), odd_grid());
                         vp::get<0>(fb).load();
                         vp::get<1>(fb).load();
                         vp::get<2>(fb).off();
                         draw_sparse(backend, d, fb, hashed_mesh("soup"), odd_grid());
                         add_sparse_contents(d, fb.to_host(backend));
                     }});
    cases.push_back({"sparse.dense", [](Backend& backend, digest& d) {
                         framebuffer fb(backend, odd_grid().extent);
                         draw_sparse(backend, d, fb, hashed_mesh("open"), odd_grid());
                         const auto host = fb.to_host(backend);
                         d.add(vp::get<0>(host).to_dense().elements);
                         d.add(vp::get<2>(host).to_dense().elements);
                     }});
    for (const char* const mesh : {"sphere", "torus", "shells"}) {
        cases.push_back({std::string("sparse.solid.tiles.") + mesh, [mesh](Backend& backend, digest& d) {
                             framebuffer fb(backend, grid_of({96, 64, 80}).extent);
                             const auto drawn = upload(backend, hashed_mesh(mesh));
                             add_solid_counts(d,
                                              vp::voxelize_solid(backend, drawn, grid_of({96, 64, 80}),
                                                                 vp::passthrough{}, vp::constant(0.75f, 1u, -5), fb));
                             add_sparse_contents(d, fb.to_host(backend));
                         }});
        cases.push_back({std::string("sparse.solid.values.") + mesh, [mesh](Backend& backend, digest& d) {
                             framebuffer fb(backend, odd_grid().extent);
                             const auto drawn = upload(backend, hashed_mesh(mesh));
                             vp::solid_options options;
                             options.extent = vp::solid_extent::outer;
                             add_solid_counts(d, vp::voxelize_solid(backend, drawn, odd_grid(), vp::passthrough{},
                                                                    solid_values_of_bricks{}, fb, options));
                             add_sparse_contents(d, fb.to_host(backend));
                         }});
    }
    cases.push_back({"sparse.merge", [](Backend& backend, digest& d) {
                         const vp::grid all = odd_grid();
                         std::vector<decltype(std::declval<const framebuffer&>().to_host(backend))> parts;
                         for (const int z : {0, 21}) {
                             const int layers = z == 0 ? 21 : all.extent.z - 21;
                             const vp::grid part = all.crop({0, 0, z}, {all.extent.x, all.extent.y, layers});
                             framebuffer fb(backend, part.extent);
                             draw_sparse(backend, d, fb, hashed_mesh("soup"), part);
                             parts.push_back(fb.to_host(backend));
                         }
                         add_sparse_contents(d, vp::merge(parts[0], parts[1]));
                     }});

    for (const char* const mesh : {"soup", "shells"}) {
        const auto add = [&](const char* what, auto run) {
            cases.push_back({std::string("octree.") + what + '.' + mesh, [mesh, run](Backend& backend, digest& d) {
                                 framebuffer fb(backend, odd_grid().extent);
                                 draw_sparse(backend, d, fb, hashed_mesh(mesh), odd_grid());
                                 run(backend, d, vp::backend_octree<Backend>(backend, fb));
                             }});
        };
        add("nodes", add_octree_nodes<Backend>);
        add("graph", add_octree_graph<Backend>);
        add("rays", add_octree_rays<Backend>);
    }
    cases.push_back({"octree.nodes.tiles", [](Backend& backend, digest& d) {
                         framebuffer fb(backend, grid_of({96, 64, 80}).extent);
                         const auto drawn = upload(backend, hashed_mesh("sphere"));
                         add_solid_counts(d, vp::voxelize_solid(backend, drawn, grid_of({96, 64, 80}),
                                                                vp::passthrough{}, vp::constant(0.75f, 1u, -5), fb));
                         add_octree_nodes(backend, d, vp::backend_octree<Backend>(backend, fb));
                     }});
    add_octree_levels<0>(cases, "sum", vp::reduce::sum{});
    add_octree_levels<0>(cases, "mean", vp::reduce::mean<1>{});
    add_octree_levels<0>(cases, "mean_of_voxels", vp::reduce::mean_of_voxels{});
    add_octree_levels<0>(cases, "min", vp::reduce::min{});
    add_octree_levels<2>(cases, "mean_of_volume", vp::reduce::mean_of_volume{});
    add_octree_levels<2>(cases, "max", vp::reduce::max{});
    add_octree_levels<2>(cases, "majority", vp::reduce::majority{});
    add_octree_levels<1>(cases, "bit_or", vp::reduce::bit_or{});

    for (const char* const mesh : {"torus", "soup"})
        cases.push_back({std::string("nanovdb.") + mesh, [mesh](Backend& backend, digest& d) {
                             framebuffer fb(backend, odd_grid().extent);
                             draw_sparse(backend, d, fb, hashed_mesh(mesh), odd_grid());
                             add_nanovdb(backend, d, fb);
                         }});
}

} // namespace golden
