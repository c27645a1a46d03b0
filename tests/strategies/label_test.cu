// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Labels on the device: the bytes and components of cpu_backend.

#include "../label/label_support.hpp"

#include <cpu_ref/label/label.hpp>
#include <voxelpipe/label/device/label.cuh>

#include <gtest/gtest.h>

using namespace label_tests;

namespace {

template <class Label, class Layout = vp::layout::linear>
void expect_same(const volume& v, int connectivity, const std::string& what) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu{2};
    const result expected = label<Label, Layout>(cpu, v, connectivity),
                 found = label<Label, Layout>(gpu, v, connectivity);
    EXPECT_TRUE(found.status.ok()) << found.status.message();
    EXPECT_TRUE(found.is(expected)) << what << ", connectivity " << connectivity;
}

} // namespace

TEST(DeviceLabel, RandomGridsHaveTheBytesOfTheCpu) {
    std::mt19937 random(1);
    for (int k = 0; k < 60; ++k) {
        const volume v = random_volume(random);
        const int connectivity = connectivities[static_cast<std::size_t>(k % 3)];
        if (k % 5 == 0)
            expect_same<std::int64_t>(v, connectivity, std::to_string(k));
        else if (k % 5 == 1)
            expect_same<std::int32_t, vp::layout::tiled>(v, connectivity, std::to_string(k));
        else
            expect_same<std::int32_t>(v, connectivity, std::to_string(k));
    }
    const volume large = random_volume(random, glm::ivec3(101, 33, 17), 35);
    for (const int connectivity : connectivities) expect_same<std::int32_t>(large, connectivity, "large");
}

TEST(DeviceLabel, ShapesHaveTheBytesOfTheCpu) {
    for (const int nx : {1, 32, 33, 65})
        for (const named_volume& shape : shapes(nx))
            for (const int connectivity : connectivities)
                if (nx == 33 || connectivity == 6)
                    expect_same<std::int32_t>(shape.voxels, connectivity, shape.name + ", " + std::to_string(nx));
}

// At the borders of words.
TEST(DeviceLabel, NeighbourhoodsHaveTheBytesOfTheCpu) {
    std::mt19937 random(2);
    std::vector<std::uint32_t> patterns(400);
    for (std::uint32_t& p : patterns) p = static_cast<std::uint32_t>(random()) >> 7 & 0x3ffffu;
    for (const int first : {30, 31})
        for (const int connectivity : connectivities)
            expect_same<std::int32_t>(of_patterns(patterns, 2, first, 32, 66), connectivity, std::to_string(first));
}

TEST(DeviceLabel, LabelsAloneAndMistakes) {
    vp::cuda_backend gpu;
    volume v(glm::ivec3(40, 3, 2));
    v.add_where([](int x, int y, int) { return x != 20 && y != 1; });
    const result r = label<std::int32_t>(gpu, v, 6, false);
    EXPECT_TRUE(r.status.ok());
    EXPECT_EQ(r.labels, flood(v, 6).labels);
    EXPECT_EQ(r.status.label.components, 4u);
    EXPECT_TRUE(r.components.empty());
    const result bad = label<std::int32_t>(gpu, v, 8);
    EXPECT_EQ(bad.status.code, vp::status_code::bad_label_options);
    for (const std::int64_t l : bad.labels) EXPECT_EQ(l, 5);
}
