// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of solids in slabs: meshes with holes that leave the grid, and the comparison with one call.

#include "slab_scene.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>

namespace slab_scene {

inline void add_quad(unit::small_mesh& m, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                     const glm::vec3& d) {
    const auto first = static_cast<std::uint32_t>(m.positions.size());
    for (const glm::vec3& p : {a, b, c, d}) m.positions.push_back(p);
    m.triangles.emplace_back(first, first + 1, first + 2);
    m.triangles.emplace_back(first, first + 2, first + 3);
}

// Boxes of random size and place, a third of them beyond the grid, some inside out, most without some of their
// triangles; triangles that are not finite, of no area, and wholly above, below and beside the grid.
inline unit::small_mesh broken_scene(const glm::ivec3& size) {
    unit::small_mesh m;
    unit::splitmix64 random(31);
    const auto within = [&](float low, float high) { return static_cast<float>(random.uniform(low, high)); };
    for (int i = 0; i < 14; ++i) {
        glm::vec3 lo, hi;
        for (int a = 0; a < 3; ++a) {
            const auto n = static_cast<float>(size[a]);
            lo[a] = within(-0.4f * n, 0.8f * n);
            hi[a] = lo[a] + within(0.1f * n, 0.7f * n);
            if (i % 5 == 0) { // on borders of voxels, and on their centres
                lo[a] = std::round(2 * lo[a]) / 2;
                hi[a] = std::round(2 * hi[a]) / 2;
            }
        }
        const auto corner = [&](int k) {
            return glm::vec3((k & 1) != 0 ? hi.x : lo.x, (k & 2) != 0 ? hi.y : lo.y, (k & 4) != 0 ? hi.z : lo.z);
        };
        const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
        const std::size_t first = m.triangles.size();
        for (const auto& f : faces) {
            const bool turned = i % 4 == 3;
            add_quad(m, corner(f[0]), corner(f[turned ? 3 : 1]), corner(f[2]), corner(f[turned ? 1 : 3]));
        }
        for (int left_out = 0; left_out < i % 4; ++left_out)
            m.triangles.erase(m.triangles.begin() +
                              static_cast<std::ptrdiff_t>(first + static_cast<std::size_t>(within(0, 8))));
    }
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto x = static_cast<float>(size.x), y = static_cast<float>(size.y), z = static_cast<float>(size.z);
    const auto add = [&](const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
        const auto first = static_cast<std::uint32_t>(m.positions.size());
        m.positions.insert(m.positions.end(), {a, b, c});
        m.triangles.emplace_back(first, first + 1, first + 2);
    };
    add({nan, 1, 2}, {3, 1, 2}, {3, 2, 2});
    add({1, 1, 1}, {2, 2, 2}, {4, 4, 4});
    add({1e30f, 1, 1}, {2, 2, 2}, {4, 4, 4});
    for (const float at : {-3.3f, z + 2.1f}) add({0.1f, 0.2f, at}, {x, 0.3f, at + 0.2f}, {0.4f, y, at});
    for (const float at : {-3.3f, y + 2.1f}) add({0.1f, at, 0.2f}, {x, at + 0.2f, 0.3f}, {0.4f, at, z});
    for (const float at : {-3.3f, x + 2.1f}) add({at, 0.1f, 0.2f}, {at + 0.2f, y, 0.3f}, {at, 0.4f, z});
    add({-9, -9, z + 4}, {-8, -9, z + 4}, {-9, -8, z + 4});
    return m;
}

// Plates across z, where rows along x and y are open, so that columns decide. Some lie above the middle of their layer,
// so that their crossings belong to the layer behind it, which they do not reach; some beyond the grid.
inline unit::small_mesh plates(const glm::ivec3& size) {
    unit::small_mesh m;
    const auto x = static_cast<float>(size.x), y = static_cast<float>(size.y), z = static_cast<float>(size.z);
    for (const float at : {-2.5f, 6.75f, 12.25f, 13.0f, 20.5f, z - 6.25f, z + 1.5f, z + 2.5f})
        add_quad(m, {0, 0, at}, {x, 0, at}, {x, y, at}, {0, y, at});
    add_quad(m, {1, 0, 0}, {1, y, 0}, {1, y, z}, {1, 0, z});
    add_quad(m, {0, 1, 0}, {x, 1, 0}, {x, 1, z}, {0, 1, z});
    return m;
}

// Differs from voxel to voxel, so that a misplaced slab shows.
struct winding {
    auto operator()(const vp::solid_fragment& f) const {
        return vp::outputs(static_cast<std::int32_t>(f.winding + std::int64_t{3} * f.voxel.z + 100));
    }
};
using solid_target = vp::target<std::int32_t, vp::blend::add>;
using solid_targets = vp::framebuffer<backend_type, solid_target>;

// A solid in one call.
struct whole_solid {
    unit::small_mesh mesh;
    vp::grid grid;
    vp::solid_options how;
    unsigned threads = 2;
    backend_type backend = unit::make_backend(threads);
    solid_targets whole{backend, grid.extent};
    vp::status one = vp::voxelize_solid(backend, mesh.view(), grid, vp::passthrough{}, winding{}, whole, how);
    vp::host_target<solid_target> expected = vp::get<0>(whole).to_host_target(backend);

    [[nodiscard]] auto make() {
        return [this](const glm::ivec3& size) { return solid_targets{backend, size}; };
    }
    // Draws a stream that has got all triangles into what `of_slab` makes, and expects voxels and counts of the call.
    struct compared {
        int slabs = 0;
        std::uint64_t voxels = 0; // of these slabs
    };
    template <class Stream, class Make>
    compared expect_slabs(Stream& stream, const Make& of_slab) {
        EXPECT_TRUE(one.ok()) << one.message();
        compared all;
        std::uint64_t wrong = 0;
        const vp::status s = stream.draw_solid(
            winding{}, of_slab,
            [&](const slabs::slab& slab, const solid_targets& fb) {
                const auto part = vp::get<0>(fb).to_host_target(backend);
                const glm::ivec3 o = slab.where.offset - grid.offset;
                unit::for_each_voxel(slab.where.extent, [&](int x, int y, int z) {
                    wrong += part(x, y, z) != expected(o.x + x, o.y + y, o.z + z) ? 1 : 0;
                    ++all.voxels;
                });
                ++all.slabs;
            },
            how);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts, one.counts);
        EXPECT_EQ(s.solid, one.solid);
        EXPECT_EQ(wrong, 0u);
        return all;
    }
    [[nodiscard]] std::uint64_t num_voxels() const {
        return static_cast<std::uint64_t>(grid.extent.x) * static_cast<std::uint64_t>(grid.extent.y) *
               static_cast<std::uint64_t>(grid.extent.z);
    }
};

// Of a stream of solids.
inline slabs::stream_options options_for(const vp::solid_options& solid, int num_slabs,
                                         std::uint64_t memory = std::uint64_t{1} << 30) {
    slabs::stream_options o;
    o.num_slabs = num_slabs;
    o.memory = memory;
    o.folder = ::testing::TempDir();
    o.is_solid = true;
    o.repair = solid.repair;
    return o;
}

} // namespace slab_scene
