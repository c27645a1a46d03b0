// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Octrees over sparse framebuffers on a GPU, beside those of the host: the build, the mean of a target on every level,
// the graph of different subtrees, and rays of a picture. What is timed is compared with the host's before.

#include "session.hpp"
#include "timer.hpp"

#include <voxelpipe/sparse/backend_octree_dag.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstring>
#include <stdexcept>
#include <vector>

namespace bench::gpu {

struct octree_times {
    std::uint64_t nodes = 0, bytes = 0, dag_nodes = 0, dag_bytes = 0, hits = 0;
    double build = 0, mean = 0, dag = 0, rays = 0;                     // ms
    double host_build = 0, host_mean = 0, host_dag = 0, host_rays = 0; // ms, one thread
};

// Parallel rays along -z, a picture of side * side, from above a grid of `extent`.
struct cast_rays {
    static constexpr int side = 1024;

    voxelpipe::octree_view tree;
    glm::ivec3 extent;
    voxelpipe::voxel_hit* hits;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto x = static_cast<int>(i % side), y = static_cast<int>(i / side);
        const glm::dvec3 from((x + 0.5) * extent.x / side, (y + 0.5) * extent.y / side, extent.z + 1.0);
        hits[i] = tree.first_hit(from, {0.1, 0.05, -1});
    }
};

inline void expect(bool is_equal, const char* what) {
    if (!is_equal) throw std::runtime_error(std::string("not the host's: ") + what);
}

// For a framebuffer whose target 0 is summed and whose target 1 counts.
template <class Framebuffer>
octree_times time_octree(session& s, voxelpipe::cuda_backend& backend, const Framebuffer& fb, const repetition& how) {
    namespace vp = voxelpipe;
    const auto host_ms = [](const auto& work) { return bench::measure({0, 1, 1, 0}, work).wall_ms; };
    octree_times t;
    const auto host = fb.to_host(backend);
    vp::octree host_tree;
    t.host_build = host_ms([&] { host_tree = vp::octree(host); });
    const vp::backend_octree<vp::cuda_backend> tree(backend, fb);
    expect(tree.to_host(backend) == host_tree, "nodes");
    for (int l = 1; l <= tree.num_levels(); ++l) t.nodes += tree.num_nodes(l);
    t.bytes = tree.num_bytes();
    t.build = time_calls(s, how, [&] { const vp::backend_octree<vp::cuda_backend> again(backend, fb); }).median;

    using mean = vp::reduce::mean<1>;
    {
        const auto wanted = vp::reduce_levels<0>(host_tree, host, mean{});
        const auto made = vp::reduce_levels<0>(backend, tree, fb, mean{});
        for (int l = 1; l <= tree.num_levels(); ++l) {
            const auto values = made.at(l).to_host(backend);
            expect(std::memcmp(values.data(), wanted.at(l).data(), wanted.at(l).size_bytes()) == 0, "means");
        }
    }
    t.host_mean = host_ms([&] { static_cast<void>(vp::reduce_levels<0>(host_tree, host, mean{})); });
    t.mean = time_calls(s, how, [&] { static_cast<void>(vp::reduce_levels<0>(backend, tree, fb, mean{})); }).median;

    vp::octree_dag host_dag;
    t.host_dag = host_ms([&] { host_dag = vp::octree_dag(host_tree); });
    {
        const vp::backend_octree_dag<vp::cuda_backend> dag(backend, tree);
        expect(dag.to_host(backend) == host_dag, "graph");
        for (int l = 1; l <= dag.num_levels(); ++l) t.dag_nodes += dag.num_nodes(l);
        t.dag_bytes = dag.num_bytes();
    }
    t.dag = time_calls(s, how, [&] { const vp::backend_octree_dag<vp::cuda_backend> again(backend, tree); }).median;

    constexpr std::size_t rays = std::size_t{cast_rays::side} * cast_rays::side;
    vp::cuda_backend::buffer<vp::voxel_hit> hits(backend, rays);
    t.rays = time_calls(s, how, [&] {
                 backend.for_each(rays, cast_rays{tree.view(), fb.extent(), hits.data()});
             }).median;
    std::vector<vp::voxel_hit> wanted(rays);
    const cast_rays on_host{host_tree.view(), fb.extent(), wanted.data()};
    t.host_rays = host_ms([&] {
        for (std::size_t i = 0; i < rays; ++i) on_host(i);
    });
    const std::vector<vp::voxel_hit> met = hits.to_host(backend);
    for (std::size_t i = 0; i < rays; ++i) {
        expect(met[i].found == wanted[i].found && met[i].distance == wanted[i].distance &&
                   met[i].rank == wanted[i].rank && met[i].axis == wanted[i].axis,
               "rays");
        t.hits += met[i].found ? 1 : 0;
    }
    return t;
}

} // namespace bench::gpu
