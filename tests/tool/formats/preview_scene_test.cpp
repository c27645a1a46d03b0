// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "write/preview_scene.hpp"

#include "../../test_scale.hpp"
#include "test_volumes.hpp"

#include <cmath>
#include <limits>
#include <random>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// The nearest occupied voxel that a ray enters, by trying all of them.
ray_hit first_hit_of_all(const volume& v, const vec3& origin, const vec3& direction, double limit) {
    ray_hit best;
    best.distance = infinity;
    std::array<std::int32_t, 3> p{};
    for (p[2] = 0; p[2] < v.extent[2]; ++p[2])
        for (p[1] = 0; p[1] < v.extent[1]; ++p[1])
            for (p[0] = 0; p[0] < v.extent[0]; ++p[0]) {
                if (!v.occupied(p[0], p[1], p[2])) continue;
                double near = 0, far = limit;
                int axis = -1;
                for (std::size_t a = 0; a < 3; ++a) {
                    if (direction[a] == 0) {
                        if (origin[a] < p[a] || origin[a] >= p[a] + 1) far = -1;
                        continue;
                    }
                    const double low = (p[a] - origin[a]) / direction[a], high = (p[a] + 1 - origin[a]) / direction[a];
                    if (std::min(low, high) > near) {
                        near = std::min(low, high);
                        axis = static_cast<int>(a);
                    }
                    far = std::min(far, std::max(low, high));
                }
                if (near <= far && near < best.distance) best = {near, p, axis, false};
            }
    return best;
}

} // namespace

TEST(PreviewScene, FindsWhatTryingEveryVoxelFinds) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    const int rays = tests::is_slow_build() ? 60 : 300;
    int hits = 0;
    using extent = std::array<std::int64_t, 3>;
    for (const extent& e : {extent{9, 8, 7}, extent{33, 5, 17}, extent{1, 1, 1}, extent{70, 3, 65}, extent{16, 16, 16}})
        for (const std::uint32_t density : {2u, 30u, 400u}) {
            const volume v = make_occupancy(e, density);
            if (v.popcount() == 0) continue;
            const preview_scene scene(v, 1);
            for (int n = 0; n < rays; ++n) {
                vec3 origin{}, direction{};
                for (std::size_t a = 0; a < 3; ++a) {
                    origin[a] = (unit(random) * 2 - 0.5) * static_cast<double>(e[a]);
                    direction[a] = unit(random) * static_cast<double>(e[a]) - origin[a]; // at a point of the grid
                    if (n % 5 == 0 && unit(random) < 0.4) direction[a] = 0;
                }
                if (dot(direction, direction) == 0) direction[1] = 1;
                const double limit = n % 3 == 0 ? 20.0 : infinity;
                const ray_hit want = first_hit_of_all(v, origin, direction, limit);
                const ray_hit got = scene.first_hit(origin, direction, limit);
                ASSERT_EQ(got.axis >= 0, want.distance < infinity) << n;
                if (got.axis < 0) continue;
                ++hits;
                ASSERT_NEAR(got.distance, want.distance, 1e-9 * (1 + want.distance)) << n;
                ASSERT_EQ(got.voxel, want.voxel) << n;
                if (want.axis >= 0) {
                    ASSERT_EQ(got.axis, want.axis) << n;
                    ASSERT_EQ(got.high, direction[static_cast<std::size_t>(got.axis)] < 0);
                }
            }
        }
    EXPECT_GT(hits, 10 * rays / 3);
}

TEST(PreviewScene, KnowsTheBounds) {
    volume v = make_volume({100, 90, 80});
    channel& bits = v.add("occupancy", scalar::bit);
    EXPECT_TRUE(preview_scene(v, 2).empty());
    v.set_bit(bits, 33, 20, 70);
    v.set_bit(bits, 64, 9, 71);
    const preview_scene scene(v, 2);
    EXPECT_FALSE(scene.empty());
    EXPECT_EQ(scene.low(), (std::array<std::int32_t, 3>{33, 9, 70}));
    EXPECT_EQ(scene.high(), (std::array<std::int32_t, 3>{65, 21, 72}));
    std::vector<std::pair<vec3, vec3>> rows;
    scene.for_each_row([&](const vec3& low, const vec3& high) { rows.emplace_back(low, high); });
    EXPECT_EQ(rows, (std::vector<std::pair<vec3, vec3>>{{{33, 20, 70}, {34, 21, 71}}, {{64, 9, 71}, {65, 10, 72}}}));
}

TEST(PreviewScene, SurfaceNormalIsTheAreaVector) {
    volume v = make_volume({40, 40, 40});
    channel& bits = v.add("occupancy", scalar::bit);
    for (std::int64_t k = 0; k < 40; ++k)
        for (std::int64_t j = 0; j < 40; ++j)
            for (std::int64_t i = 0; i < 40; ++i)
                if (i + j == 40) v.set_bit(bits, i, j, k); // a sheet one voxel thick, at 45 degrees
    const preview_scene scene(v, 1);
    const vec3 n = scene.surface_normal({20, 20, 20}, {1, 0.9, 0.3}, {1, 1, 1});
    EXPECT_EQ(n[0], n[1]);
    EXPECT_GT(n[0], 0);
    const vec3 back = scene.surface_normal({20, 20, 20}, {-1, -0.9, -0.3}, {1, 1, 1});
    EXPECT_EQ(back[0], -n[0]);
    EXPECT_EQ(back[1], -n[1]);
    // Voxels twice as high: the side faces double, the top faces stay.
    const vec3 tall = scene.surface_normal({20, 20, 20}, {1, 0.9, 0.3}, {1, 2, 1});
    EXPECT_EQ(tall[0], 2 * n[0]);
    EXPECT_EQ(tall[1], n[1]);
    // At the corner of the grid nothing outside is read, and a lone voxel has a normal from any side.
    volume one = make_volume({1, 1, 1});
    one.set_bit(one.add("occupancy", scalar::bit), 0, 0, 0);
    const vec3 lone = preview_scene(one, 1).surface_normal({0, 0, 0}, {-1, 1, 1}, {1, 1, 1});
    EXPECT_EQ(lone, (vec3{-1, 1, 1}));
}
