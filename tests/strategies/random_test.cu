// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Random configurations of grid, crop, voxel shape, mesh, coverage, cleared or loaded targets, and voxel counter. Each
// is compared for several sets of targets and for fragment lists. VOXELPIPE_TEST_SEED chooses other configurations.

#include "cells.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

struct configuration {
    mesh_data mesh;
    vp::grid grid;
    vp::voxelize_options options;
    start how;
};

template <class... Targets>
void shaded(const configuration& c) {
    expect_same<Targets...>(c.mesh, c.grid, vp::passthrough{}, any_values<Targets...>{}, c.options, c.how);
}

struct way {
    const char* name;
    void (*compare)(const configuration&);
};

using std::uint16_t;
using std::uint32_t;

constexpr std::array targets{
    way{"bits, sums, counts and the last",
        [](const configuration& c) {
            expect_same(tile_targets{}, c.mesh, c.grid, vp::passthrough{}, tile_values{5}, c.options, c.how);
        }},
    way{"vectors and small numbers",
        shaded<vp::target<glm::u8vec4, blend::max, vp::layout::planar>, vp::target<std::int16_t, blend::min>,
               vp::target<vp::half, blend::add>, vp::target<uint16_t, blend::bit_xor, vp::layout::tiled>>},
    way{"large values", shaded<vp::target<glm::dvec4, blend::replace, vp::layout::tiled>,
                               vp::target<double, blend::add>, vp::target<float, blend::max>>},
    way{"folded in order, beside tiles",
        [](const configuration& c) {
            expect_same(folded_targets{}, c.mesh, c.grid, vp::passthrough{}, folded_values{}, c.options, c.how);
        }},
    way{"without tiles",
        [](const configuration& c) {
            expect_same(bit_targets{}, c.mesh, c.grid, vp::passthrough{}, same_bits(true), c.options, c.how);
        }},
    way{"without tiles, a sum",
        [](const configuration& c) {
            expect_same<vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>>(
                c.mesh, c.grid, vp::passthrough{}, vp::constant(true, 0.5f), c.options, c.how);
        }},
};

constexpr std::array lists{
    way{"lists of numbers",
        [](const configuration& c) {
            expect_same_lists<void>(c.mesh, c.grid, vp::passthrough{}, vp::constant(true), c.options);
        }},
    way{"lists of one payload",
        [](const configuration& c) {
            expect_same_lists<float>(c.mesh, c.grid, shift{0.75f}, vp::constant(2.5f), c.options);
        }},
    way{"lists of payloads",
        [](const configuration& c) {
            expect_same_lists<double>(c.mesh, c.grid, vp::passthrough{}, any_double{}, c.options);
        }},
};

configuration make(int i, std::mt19937& random) {
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const int limit = i % 10 == 0 ? 300 : 70;
    vp::grid g = box_grid({1 + below(limit), 1 + below(limit), 1 + below(limit)});
    const float size = static_cast<float>(std::max({g.extent.x, g.extent.y, g.extent.z}));
    const mesh_data m = mixed_triangles(1 + below(3000), size, static_cast<uint32_t>(random()));
    g.origin = glm::dvec3(below(3), 0.25, -below(2));
    g.voxel_size = glm::dvec3(1.0 + 0.1 * below(3), 1.0, 0.9);
    if (i % 3 == 0 && g.extent.x > 4) g = g.crop({g.extent.x / 3, 0, 0}, {g.extent.x / 2, g.extent.y, g.extent.z});
    return {m,
            g,
            {every_coverage[random() % std::size(every_coverage)], i % 5 != 0},
            i % 2 == 0 ? start::clear : start::load};
}

TEST(Random, ConfigurationsGiveTheCpusBytes) {
    const char* const seed = std::getenv("VOXELPIPE_TEST_SEED");
    std::mt19937 random(seed != nullptr ? static_cast<uint32_t>(std::atoi(seed)) : 55u);
    for (int i = 0; i < 200 && !HasFailure(); ++i) {
        const configuration c = make(i, random);
        const std::size_t left_out = random() % targets.size(), also = 1 + random() % (targets.size() - 1);
        for (std::size_t k = 0; k < targets.size(); ++k) { // four of the six
            if (k == left_out || k == (left_out + also) % targets.size()) continue;
            SCOPED_TRACE("configuration " + std::to_string(i) + ": " + targets[k].name);
            targets[k].compare(c);
        }
        const way& list = lists[random() % lists.size()];
        SCOPED_TRACE("configuration " + std::to_string(i) + ": " + list.name);
        list.compare(c);
    }
}

} // namespace
