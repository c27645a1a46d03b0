// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Octrees in the memory of a backend against octrees of the host: nodes, graphs, values, rays.

#include "test_support.hpp"

#include <voxelpipe/sparse/backend_octree_dag.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <vector>

namespace octree_cases {

namespace vp = voxelpipe;

struct ray {
    glm::dvec3 origin, direction;
    double limit;
};
struct trace {
    vp::octree_view tree;
    const ray* rays;
    vp::voxel_hit* hits;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        hits[i] = tree.first_hit(rays[i].origin, rays[i].direction, rays[i].limit);
    }
};
struct look_up {
    vp::octree_dag_view dag;
    const glm::ivec3* voxels;
    std::uint8_t* found;

    VOXELPIPE_HD void operator()(std::uint64_t i) const { found[i] = dag.contains(voxels[i]) ? 1 : 0; }
};
// A reducer of the caller's.
struct middle {
    template <class T>
    VOXELPIPE_HD T operator()(std::span<const T> children) const {
        return children[children.size() / 2];
    }
};

// Rays at a box, some along axes, some that end early.
inline std::vector<ray> rays_at(const glm::ivec3& low, const glm::ivec3& size) {
    unit::splitmix64 random(7);
    std::vector<ray> rays;
    for (int i = 0; i < 2000; ++i) {
        ray r{};
        for (int a = 0; a < 3; ++a) {
            r.origin[a] = low[a] + random.uniform(-20.0, size[a] + 20.0);
            r.direction[a] = low[a] + random.uniform(0.0, size[a]) - r.origin[a];
        }
        if (i % 5 == 0) r.direction = {0, i % 2 == 0 ? 1.0 : -2.0, 0};
        r.limit = i % 3 == 0 ? 0.5 : 1e300;
        rays.push_back(r);
    }
    return rays;
}

// `host` is a copy of `fb`. Returns the octree on the backend.
template <class Backend, class Framebuffer, class Host>
[[nodiscard]] vp::backend_octree<Backend> compare_nodes(Backend& backend, const Framebuffer& fb, const Host& host) {
    vp::backend_octree<Backend> tree(backend, fb);
    const vp::octree expected(host);
    EXPECT_TRUE(tree.to_host(backend) == expected);
    EXPECT_EQ(tree.num_levels(), expected.num_levels());
    EXPECT_EQ(tree.num_bytes(), expected.num_bytes());
    EXPECT_EQ(tree.num_nodes(0), host.num_values());

    const vp::backend_octree_dag<Backend> dag(backend, tree);
    const vp::octree_dag expected_dag(expected);
    EXPECT_TRUE(dag.to_host(backend) == expected_dag);
    EXPECT_EQ(dag.num_bytes(), expected_dag.num_bytes());
    std::vector<glm::ivec3> voxels;
    host.for_each_voxel([&](const glm::ivec3& v, std::uint64_t) {
        voxels.push_back(v + host.where.offset);
        voxels.push_back(v + host.where.offset + glm::ivec3(1, 0, -1));
    });
    const typename Backend::template buffer<glm::ivec3> asked(backend, vp::array_view<const glm::ivec3>(voxels));
    typename Backend::template buffer<std::uint8_t> answers(backend, voxels.size());
    backend.for_each(voxels.size(), look_up{dag.view(), asked.data(), answers.data()});
    const std::vector<std::uint8_t> found = answers.to_host(backend);
    for (std::size_t i = 0; i < voxels.size(); ++i)
        if ((found[i] != 0) != host.contains(voxels[i] - host.where.offset)) {
            ADD_FAILURE() << "voxel " << i;
            break;
        }

    const std::vector<ray> rays = rays_at(host.where.offset, host.where.extent);
    const typename Backend::template buffer<ray> cast(backend, vp::array_view<const ray>(rays));
    // Written before, so that no padding between members is copied back that nobody has written.
    const std::vector<vp::voxel_hit> none(rays.size());
    typename Backend::template buffer<vp::voxel_hit> hits(backend, vp::array_view<const vp::voxel_hit>(none));
    backend.for_each(rays.size(), trace{tree.view(), cast.data(), hits.data()});
    const std::vector<vp::voxel_hit> met = hits.to_host(backend);
    std::size_t some = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const vp::voxel_hit hit = expected.first_hit(rays[i].origin, rays[i].direction, rays[i].limit);
        some += hit.found ? 1 : 0;
        EXPECT_TRUE(met[i].found == hit.found && met[i].distance == hit.distance && met[i].voxel == hit.voxel &&
                    met[i].rank == hit.rank && met[i].axis == hit.axis && met[i].from_above == hit.from_above)
            << "ray " << i;
    }
    EXPECT_EQ(some != 0, host.num_voxels() != 0);
    return tree;
}

// Values of target I on every level.
template <std::size_t I, class Backend, class Framebuffer, class Host, class Reducer>
void compare_levels(Backend& backend, const vp::backend_octree<Backend>& tree, const Framebuffer& fb, const Host& host,
                    const Reducer& reducer, const char* what) {
    const auto made = vp::reduce_levels<I>(backend, tree, fb, reducer);
    const auto expected = vp::reduce_levels<I>(vp::octree(host), host, reducer);
    ASSERT_EQ(made.num_levels(), expected.num_levels());
    for (int l = 1; l <= expected.num_levels(); ++l) {
        const auto values = made.at(l).to_host(backend);
        const auto wanted = expected.at(l);
        ASSERT_EQ(values.size(), wanted.size());
        EXPECT_EQ(0, std::memcmp(values.data(), wanted.data(), wanted.size_bytes())) << what << ", level " << l;
    }
}

} // namespace octree_cases
