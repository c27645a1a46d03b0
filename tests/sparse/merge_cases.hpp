// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids drawn in slabs and merged, against one call in the whole: bricks and tiles, byte for byte.

#include "api_model.hpp"
#include "box_mesh.hpp"

#include <voxelpipe/sparse/sparse.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

namespace merge_cases {

namespace vp = voxelpipe;

using inside = vp::target<vp::bit, vp::blend::bit_or>;
using label = vp::target<std::uint32_t, vp::blend::replace>;
using host = vp::host_sparse<inside, label>;
template <class Backend>
using framebuffer = vp::sparse_framebuffer<Backend, inside, label>;

// One value, but for no call that makes tiles.
struct same_everywhere {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment&) const { return vp::outputs(true, 7u); }
};

// A solid in one part of a grid; then `loaded` onto it, if it has triangles.
template <class Backend, class Shader>
host draw(Backend& backend, const unit::small_mesh& mesh, const unit::small_mesh& loaded, const vp::grid& part,
          const Shader& shader) {
    framebuffer<Backend> fb{backend, part.extent};
    const vp::mesh<Backend> on_backend{backend, mesh.positions, mesh.triangles};
    vp::status s = vp::voxelize_solid(backend, on_backend, part, vp::passthrough{}, shader, fb);
    EXPECT_TRUE(s.ok()) << s.message();
    if (loaded.triangles.empty()) return fb.to_host(backend);
    vp::get<0>(fb).load();
    vp::get<1>(fb).load();
    const vp::mesh<Backend> second{backend, loaded.positions, loaded.triangles};
    s = vp::voxelize_solid(backend, second, part, vp::passthrough{}, vp::constant(true, 9u), fb);
    EXPECT_TRUE(s.ok()) << s.message();
    return fb.to_host(backend);
}

// Returns by how many values the parts have more than what they are merged to.
template <class Backend, class Shader>
std::uint64_t compare(Backend& backend, const unit::small_mesh& mesh, const unit::small_mesh& loaded,
                      const vp::grid& whole, int axis, const std::vector<int>& borders, const Shader& shader) {
    const host expected = draw(backend, mesh, loaded, whole, shader);
    std::vector<host> parts;
    std::uint64_t values = 0;
    for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
        glm::ivec3 begin(0), size = whole.extent;
        begin[axis] = borders[i];
        size[axis] = borders[i + 1] - borders[i];
        parts.push_back(draw(backend, mesh, loaded, whole.crop(begin, size), shader));
        values += parts.back().num_values();
    }
    for (int order = 0; order < 2; ++order) {
        const host merged = vp::merge(std::span<const host>(parts));
        EXPECT_TRUE(vp::same_contents(merged, expected))
            << "axis " << axis << ", " << parts.size() << " slabs: " << merged.num_tiles() << " tiles and "
            << merged.num_bricks() << " bricks, not " << expected.num_tiles() << " and " << expected.num_bricks();
        EXPECT_EQ(merged.where.extent, expected.where.extent);
        EXPECT_EQ(merged.where.offset, expected.where.offset);
        EXPECT_EQ(merged.is_tiled, expected.is_tiled);
        std::reverse(parts.begin(), parts.end());
    }
    return values - expected.num_values();
}

// 1, 2, 3 and 7 slabs along every axis, whose borders lie on, beside and in bricks; of these 18 ways one in `step`.
template <class Backend>
void slabs_are_the_whole(Backend& backend, int step) {
    const glm::ivec3 extent{32, 48, 40};
    const vp::grid whole = unit::unit_grid(extent);
    unit::small_mesh all, some, loaded;
    add_box(all, glm::vec3(-3), glm::vec3(60));
    add_box(some, {0.6f, 2, 0}, {29, 43.5f, 39});
    add_box(some, {9, 30, 12}, {14, 60, 21});
    add_box(loaded, {11, 3, 8}, {25, 21, 19});
    const std::vector<int> inner[] = {{}, {16}, {13}, {8, 24}, {9, 10}, {3, 8, 13, 15, 16, 29}};
    int number = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (const std::vector<int>& at : inner) {
            if (number++ % step != 0) continue;
            std::vector<int> borders{0};
            borders.insert(borders.end(), at.begin(), at.end());
            borders.push_back(extent[axis]);
            const auto constant = vp::constant(true, 7u);
            const std::uint64_t joined = compare(backend, all, {}, whole, axis, borders, constant);
            EXPECT_EQ(joined != 0, !at.empty());
            compare(backend, some, {}, whole, axis, borders, constant);
            EXPECT_EQ(compare(backend, some, {}, whole, axis, borders, same_everywhere{}), 0u);
            const bool on_bricks = std::all_of(at.begin(), at.end(), [](int b) { return b % 8 == 0; });
            if (on_bricks) compare(backend, some, loaded, whole, axis, borders, constant);
        }
}

// Siblings of different values stay apart, and so do those that are not all there.
template <class Backend>
void other_tiles_stay(Backend& backend) {
    const vp::grid whole = unit::unit_grid(glm::ivec3(16));
    unit::small_mesh all;
    add_box(all, glm::vec3(-3), glm::vec3(60));
    const vp::grid below = whole.crop({0, 0, 0}, {16, 16, 8}), above = whole.crop({0, 0, 8}, {16, 16, 8});
    const host a = draw(backend, all, {}, below, vp::constant(true, 7u));
    const host b = draw(backend, all, {}, above, vp::constant(true, 8u));
    const host both = vp::merge(b, a);
    EXPECT_EQ(both.num_tiles(), 8u);
    EXPECT_EQ(vp::get<1>(both)(3, 3, 7), 7u);
    EXPECT_EQ(vp::get<1>(both)(3, 3, 8), 8u);
    EXPECT_EQ(vp::merge(a, draw(backend, all, {}, above, vp::constant(true, 7u))).num_tiles(), 1u);
    const vp::grid most = whole.crop({0, 0, 8}, {16, 16, 7});
    const host c = vp::merge(a, draw(backend, all, {}, most, vp::constant(true, 7u)));
    EXPECT_EQ(c.num_tiles(), 4u);
    EXPECT_EQ(c.num_bricks(), 4u);
    // A border through bricks, with another value behind it.
    const vp::grid low = whole.crop({0, 0, 0}, {16, 16, 5}), high = whole.crop({0, 0, 5}, {16, 16, 11});
    const host mixed = vp::merge(draw(backend, all, {}, low, vp::constant(true, 7u)),
                                 draw(backend, all, {}, high, vp::constant(true, 8u)));
    EXPECT_EQ(mixed.num_tiles(), 4u);
    EXPECT_EQ(mixed.num_bricks(), 4u);
    EXPECT_EQ(mixed.masks[0].count(), 512u);
    EXPECT_EQ(vp::get<1>(mixed)(3, 3, 4), 7u);
    EXPECT_EQ(vp::get<1>(mixed)(3, 3, 5), 8u);
}

} // namespace merge_cases
