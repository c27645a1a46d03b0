// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Pictures of samples/gi: the same bytes for any number of threads and in every run, no light through walls, no jumps
// where something moves, no flicker where nothing does.

#include "closed_parts.hpp"
#include "parts.hpp"
#include "picture.hpp"
#include "renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include <unistd.h>

namespace {

using gi::scene;
using gi::settings;
using pixels = std::vector<glm::u8vec4>;

settings small(int width, int height, int resolution, unsigned threads = 2) {
    settings s;
    s.width = width;
    s.height = height;
    s.resolution = resolution;
    s.threads = threads;
    return s;
}

std::uint64_t digest(const pixels& p) {
    std::uint64_t h = 0xcbf29ce484222325u;
    for (const glm::u8vec4& c : p)
        for (int k = 0; k < 4; ++k) h = (h ^ c[k]) * 0x100000001b3u;
    return h;
}

// Mean of all channels, and the largest channel.
double mean_of(const pixels& p) {
    double sum = 0;
    for (const glm::u8vec4& c : p) sum += c.r + c.g + c.b;
    return sum / (3.0 * static_cast<double>(p.size()));
}
int largest_of(const pixels& p) {
    int most = 0;
    for (const glm::u8vec4& c : p) most = std::max({most, int{c.r}, int{c.g}, int{c.b}});
    return most;
}
double difference(const pixels& a, const pixels& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        for (int k = 0; k < 3; ++k) sum += std::abs(int{a[i][k]} - int{b[i][k]});
    return sum / (3.0 * static_cast<double>(a.size()));
}

TEST(Gi, PicturesAreGolden) {
    struct golden {
        scene (*make)();
        settings how;
        std::uint64_t digest;
    };
    const golden pictures[] = {{gi::make_cornell, small(320, 180, 48), 17633299832720501733u},
                               {gi::make_atrium, small(320, 180, 64), 1983957688055747729u}};
    for (const golden& g : pictures) {
        const std::unique_ptr<gi::renderer> two = gi::make_cpu_renderer(g.make(), g.how);
        settings one_thread = g.how;
        one_thread.threads = 1;
        const std::unique_ptr<gi::renderer> one = gi::make_cpu_renderer(g.make(), one_thread);
        const pixels shown = two->render(0.0).pixels;
        EXPECT_EQ(digest(shown), g.digest);
        EXPECT_GT(mean_of(shown), 40.0);
        EXPECT_LT(mean_of(shown), 200.0);
        EXPECT_EQ(shown, one->render(0.0).pixels);
        EXPECT_EQ(two->render(0.01).pixels, one->render(0.01).pixels); // with the first one's light
    }
}

// Closed parts are found by places, not by indices, and whichever way they turn; what has a hole or no volume is none.
TEST(Gi, ClosedPartsAreFound) {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    const auto add_box = [&](const glm::vec3& at, const glm::vec3& size, int num_triangles, bool turned) {
        gi::mesh m;
        m.add_box({0, 0, 0}, {1, 1, 1});
        for (int i = 0; i < num_triangles; ++i) {
            const auto first = static_cast<std::uint32_t>(positions.size()); // each triangle has corners of its own
            for (std::size_t c = 0; c < 3; ++c) {
                const auto& p = m.positions[m.indices[3 * static_cast<std::size_t>(i) + c]];
                positions.push_back(at + size * glm::vec3(p[0], p[1], p[2]));
            }
            triangles.emplace_back(first, turned ? first + 2 : first + 1, turned ? first + 1 : first + 2);
        }
    };
    add_box({0, 0, 0}, {1, 1, 1}, 12, false);
    add_box({5, 0, 0}, {2, 1, 0.01f}, 12, true); // a thin plate, inside out
    add_box({9, 0, 0}, {1, 1, 1}, 11, false);    // one triangle is missing
    add_box({0, 5, 0}, {1, 1, 0}, 12, false);    // flat
    const std::vector<bool> closed = gi::find_closed(positions, triangles);
    ASSERT_EQ(closed.size(), 47u);
    for (std::size_t i = 0; i < closed.size(); ++i) EXPECT_EQ(closed[i], i < 24) << i;
}

// The glowing ball goes round a loaded model outside of all its vertices, also of those at the corners of its box.
TEST(Gi, TheBallStaysOutsideOfAModel) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("gi_" + std::to_string(::getpid()) + ".obj");
    std::ofstream(file) << "v 0 0 0\nv 1 0 1\nv 0 0.5 0\nv 1 0.5 1\nf 1 2 3\nf 3 2 4\n"; // a wall along a diagonal
    const scene s = gi::load_scene(file);
    std::filesystem::remove(file);
    for (int i = 0; i < 64; ++i) {
        const glm::dvec3 ball = s.motion(i / 64.0);
        EXPECT_GT(std::hypot(ball.x - 0.5, ball.z - 0.5) - 0.04, std::hypot(0.5, 0.5)) << i;
    }
}

// Largest less least channel of the light that an even sky gives to the middle of a wall, turned by so many degrees.
int unevenness_of_wall(double degrees) {
    gi::scene_builder b;
    gi::mesh wall;
    wall.add_box({-1.0, -1.0, -0.2}, {1.0, 1.0, 0.2});
    b.add(gi::placed(std::move(wall), degrees, {0, 0, 0}), {.color = glm::vec3(0.8f)});
    scene s = b.finish();
    s.light.color = glm::vec3(0.0f);
    s.sky_above = s.sky_level = glm::vec3(1.0f);
    const double angle = degrees * 3.14159265358979 / 180;
    const glm::dvec3 front(std::sin(angle), 0, std::cos(angle));
    s.view = [front](double) { return gi::camera{front * 3.0, {0, 0, 0}, 20}; }; // sees the wall's middle alone
    settings how = small(64, 48, 64);
    how.view = gi::view_choice::indirect;
    const pixels seen = gi::make_cpu_renderer(std::move(s), how)->render(0.0).pixels;
    int least = 255, most = 0;
    for (const glm::u8vec4& c : seen) {
        least = std::min({least, int{c.r}, int{c.g}, int{c.b}});
        most = std::max({most, int{c.r}, int{c.g}, int{c.b}});
    }
    EXPECT_GT(least, 60);
    return most - least;
}
// The steps of the voxels of a wall that stands aslant do not show as stripes.
TEST(Gi, AWallThatIsTurnedIsLitEvenly) {
    struct turned_wall {
        double degrees;
        int most; // with one height over walls of all directions: 1, 9, 6, 4, 3
    };
    for (const turned_wall w : {turned_wall{0, 1}, {10, 6}, {17, 4}, {30, 2}, {45, 1}}) {
        const int uneven = unevenness_of_wall(w.degrees);
        std::printf("turned by %.0f degrees: channels differ by at most %d of 255\n", w.degrees, uneven);
        EXPECT_LE(uneven, w.most);
    }
}

// A floor of two parts in the sun, with a block on it and a ball on that.
scene block_on_a_floor() {
    gi::scene_builder b;
    const auto box = [&](gi::vec3 low, gi::vec3 high) {
        gi::mesh m;
        m.add_box(low, high);
        b.add(std::move(m), {.color = glm::vec3(0.8f)});
    };
    box({-2, -0.3, -2}, {0.9, 0, 2});
    box({0.9, -0.3, -2}, {2, 0, 2});
    box({-0.6, 0, -0.6}, {0.6, 0.5, 0.6});
    b.add(gi::placed(gi::make_ball(0.4), 0, {0, 0.9, 0}), {.color = glm::vec3(0.8f)});
    scene s = b.finish();
    s.light.position = {0, 1, 0, 0};
    s.light.color = glm::vec3(1.5f);
    s.sky_above = s.sky_level = glm::vec3(1.0f);
    return s;
}
// Least and largest channel of a picture of that from there.
std::pair<int, int> range_of(const gi::camera& from, settings how) {
    scene s = block_on_a_floor();
    s.view = [from](double) { return from; };
    std::pair<int, int> range(255, 0);
    for (const glm::u8vec4& c : gi::make_cpu_renderer(std::move(s), how)->render(0.0).pixels)
        range = {std::min(range.first, int{c.g}), std::max(range.second, int{c.g})};
    return range;
}

// Faces that other parts cover darken no voxel that is seen: those between the two parts of the floor.
TEST(Gi, CoveredFacesDarkenNoVoxel) {
    for (const bool thorough : {false, true}) {
        settings how = small(96, 54, 48);
        how.view = gi::view_choice::level;
        how.thorough = thorough;
        const auto [least, most] = range_of({{1.2, 2.0, 1.5}, {1.1, 0, 1.4}, 15}, how); // sees the floor alone
        std::printf("%s: voxels of the floor have %d to %d of 255\n", thorough ? "thorough" : "a frame", least, most);
        EXPECT_GT(least, 100);
        EXPECT_GE(100 * least, 93 * most);
    }
}

// A side of a voxel that its light does not leave by is not black.
TEST(Gi, NoSideOfAVoxelIsBlack) {
    settings how = small(160, 90, 48);
    how.view = gi::view_choice::level;
    const auto [least, most] = range_of({{2.2, 1.6, 2.6}, {0, 1.0, 0}, 9}, how); // sees the ball's upper half alone
    std::printf("voxels of the ball have %d to %d of 255\n", least, most);
    EXPECT_GT(100 * least, 62 * most);
}

// Light at the foot of a wall beside that of the open floor, in percent, of thorough pictures and of frames.
TEST(Gi, ThoroughPicturesHaveNoSeamsInCorners) {
    const auto darkest = [](bool thorough) {
        settings how = small(96, 54, 64);
        how.samples = 2;
        how.view = gi::view_choice::indirect;
        how.thorough = thorough;
        const auto [least, most] = range_of({{0.1, 2.4, 2.4}, {0, 0, 0.7}, 8}, how); // the foot of the large block
        return 100 * least / most;
    };
    const int frame = darkest(false), thorough = darkest(true);
    std::printf("a foot has %d %% of the floor's brightness, %d %% in a thorough picture\n", frame, thorough);
    EXPECT_GT(thorough, frame + 10);
    EXPECT_GT(thorough, 60);
}

// Pictures of the samples: a hollow ball whose voxels are as wide as a pixel has neither stripes nor specks of shadow
// where the light of the voxels around a point is taken; lit by its own sides, it has.
TEST(SamplePictures, ARoundSurfaceIsLitEvenly) {
    const auto largest_step = [](int smooth) {
        const glm::ivec3 extent(64);
        const auto color = [](int x, int y, int z) {
            const float away = glm::length(glm::vec3(x, y, z) + 0.5f - 32.0f);
            return glm::vec3(away > 29.0f && away < 30.8f ? 0.8f : -1.0f);
        };
        const picture::scene ball(extent, color, smooth);
        float most = 0.0f;
        for (int y = 44; y < 54; ++y) { // the side that the sun shines on, from pixel to pixel
            float last = -1.0f;
            for (int x = 44; x < 54; ++x) {
                const glm::vec3 from(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 100.0f);
                const float seen =
                    ball.look(from, glm::normalize(glm::vec3(1e-3f, -2e-3f, -1.0f)), false, {0.5f, 0.5f}).x;
                if (last >= 0.0f) most = std::max(most, std::abs(seen - last));
                last = seen;
            }
        }
        return most;
    };
    const float sides = largest_step(0), around = largest_step(4);
    std::printf("neighbours differ by at most %.3f, by their own sides %.3f\n", static_cast<double>(around),
                static_cast<double>(sides));
    EXPECT_LT(around, 0.025f);
    EXPECT_GT(sides, 2.0f * around);
}

// A hollow cube in the sun, seen from inside.
scene closed_box(double thickness, bool roof) {
    gi::scene_builder b;
    const double t = thickness, o = 1 + t;
    const auto box = [&](gi::vec3 low, gi::vec3 high) {
        gi::mesh m;
        m.add_box(low, high);
        b.add(std::move(m), {.color = glm::vec3(0.8f)});
    };
    box({-o, -o, -o}, {o, -1, o});
    if (roof) box({-o, 1, -o}, {o, o, o});
    box({-o, -1, -o}, {-1, 1, o});
    box({1, -1, -o}, {o, 1, o});
    box({-1, -1, -o}, {1, 1, -1});
    box({-1, -1, 1}, {1, 1, o});
    scene s = b.finish();
    s.light.position = glm::vec4(glm::normalize(glm::vec3(0.3f, 1.0f, 0.2f)), 0.0f);
    s.light.color = glm::vec3(20.0f);
    s.sky_above = s.sky_level = glm::vec3(2.0f);
    s.exposure = 0.1f;
    s.wall = 0.7 * thickness;
    s.view = [](double time) { return gi::camera{{0, 0, 0}, {std::sin(7 * time), 0.3, std::cos(7 * time)}, 90}; };
    return s;
}

TEST(Gi, AClosedRoomStaysDark) {
    // Without its roof the room is bright, so the light is there.
    EXPECT_GT(mean_of(gi::make_cpu_renderer(closed_box(0.14, false), small(48, 48, 48))->render(0.0).pixels), 75.0);
    for (const bool thorough : {false, true})
        for (const double voxels : {2.0, 3.0}) { // thickness of the walls
            settings how = small(48, 48, 48);
            how.thorough = thorough;
            const auto room = gi::make_cpu_renderer(closed_box(voxels * 2 / (46 - 2 * voxels), true), how);
            for (const double time : {0.0, 0.3, 0.7}) {
                const pixels seen = room->render(time).pixels;
                EXPECT_LE(largest_of(seen), 12); // without the roof the mean is more than 75
                std::printf("%s, walls of %.0f voxels: at most %d of 255, mean %.3f\n",
                            thorough ? "thorough" : "a frame", voxels, largest_of(seen), mean_of(seen));
            }
        }
}

TEST(Gi, FramesOfASceneThatStandsStillAreTheSame) {
    const auto r = gi::make_cpu_renderer(gi::make_cornell(), small(96, 54, 32));
    pixels last;
    for (int i = 0; i < 12; ++i) last = r->render(0.3).pixels;
    EXPECT_EQ(r->render(0.3).pixels, last);
}

// The glowing ball slides by a twentieth of a voxel a frame; the picture is the indirect light alone.
struct changes {
    double largest = 0, sum = 0, whole = 0; // mean change of a channel: of one step, of all steps, from first to last
};
changes slide(float density) {
    scene s = gi::make_cornell();
    for (gi::material& m : s.materials)
        if (m.emission.b > 11.0f && !m.is_light) m.density = density;
    settings how = small(80, 60, 32);
    how.view = gi::view_choice::indirect;
    const auto camera = s.view(0.0);
    s.view = [camera](double) { return camera; };
    const double voxel = (s.high.x - s.low.x) / 30;
    s.motion = [voxel](double t) { return glm::dvec3(-0.4 + t * voxel, 1.2, 0.3); };
    const auto r = gi::make_cpu_renderer(std::move(s), how);
    for (int i = 0; i < 5; ++i) static_cast<void>(r->render(0.0));
    const pixels first = r->render(0.0).pixels;
    pixels last = first;
    changes c;
    constexpr int steps = 20;
    for (int i = 1; i <= steps; ++i) {
        const pixels next = r->render(static_cast<double>(i) / steps).pixels;
        const double d = difference(last, next);
        c.largest = std::max(c.largest, d);
        c.sum += d;
        last = next;
    }
    c.whole = difference(first, last);
    return c;
}
TEST(Gi, NothingJumpsWhereSomethingMoves) {
    const changes smooth = slide(1.0f), abrupt = slide(8.0f); // an eighth that is filled makes a voxel opaque
    std::printf("change of a step: at most %.3f of 255, mean %.3f; with opaque voxels at most %.3f, mean %.3f\n",
                smooth.largest, smooth.sum / 20, abrupt.largest, abrupt.sum / 20);
    EXPECT_LT(smooth.largest, 0.6);
    EXPECT_GT(abrupt.largest, 1.15 * smooth.largest);
}

} // namespace
