// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --target area, centroid, aperture_x, aperture_y and aperture_z: those of boxes, in every format of arrays.
#include "fraction_support.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>

using namespace tool_test;
using namespace fraction_test;

namespace {

const glm::dvec3 box_low(-2.125, -1.75, -3), box_high(1.625, 2.0625, 0.25);

// The ends of the box's part in a voxel of grid_of_16, and the voxel's lowest corner.
struct box_part {
    glm::dvec3 first, from, to;
    [[nodiscard]] glm::dvec3 size() const { return glm::max(to - from, 0.0); }
};
box_part part_of(int x, int y, int z) {
    const glm::dvec3 first = -4.0 + 0.5 * glm::dvec3(x, y, z);
    return {first, glm::max(first, box_low), glm::min(first + 0.5, box_high)};
}

TEST(Measures, OfABoxAreThoseOfItsOverlaps) {
    const scratch_folder folder;
    builder file;
    add(file, box(box_low, box_high));
    ASSERT_EQ(0, draw(folder, file, "o.npy", {"-t", "area,centroid,fraction,area_vector"}).code);
    const array areas = read_npy(folder / "o.area.npy"), centroids = read_npy(folder / "o.centroid.npy"),
                vectors = read_npy(folder / "o.area_vector.npy"), fractions = read_npy(folder / "o.fraction.npy");
    ASSERT_EQ((std::vector<std::size_t>{16, 16, 16}), areas.shape);
    ASSERT_EQ((std::vector<std::size_t>{16, 16, 16, 3}), centroids.shape);
    EXPECT_EQ("<f4", areas.type);
    double sum = 0;
    std::size_t i = 0;
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x, ++i) {
                const box_part part = part_of(x, y, z);
                double area = 0;
                for (int axis = 0; axis < 3; ++axis)
                    for (const double side : {box_low[axis], box_high[axis]})
                        if (part.first[axis] < side && side <= part.first[axis] + 0.5)
                            area += part.size()[(axis + 1) % 3] * part.size()[(axis + 2) % 3];
                ASSERT_NEAR(area, areas.at<float>(i), 1e-7) << x << ' ' << y << ' ' << z;
                sum += areas.at<float>(i);
                const bool has_part = part.size().x * part.size().y * part.size().z > 0;
                ASSERT_EQ(has_part, fractions.at<float>(i) > 0);
                for (int axis = 0; axis < 3; ++axis) {
                    const double middle = ((part.from[axis] + part.to[axis]) / 2 - part.first[axis]) / 0.5 - 0.5;
                    ASSERT_NEAR(has_part ? middle : 0.0, centroids.at<float>(3 * i + static_cast<std::size_t>(axis)),
                                1e-6);
                }
            }
    const glm::dvec3 size = box_high - box_low;
    EXPECT_NEAR(2 * (size.x * size.y + size.y * size.z + size.z * size.x), sum, 1e-5);
    // Alone they are the same.
    for (const std::string wanted : {"area", "centroid"}) {
        ASSERT_EQ(0, draw(folder, file, "a.npy", {"-t", wanted}).code);
        EXPECT_EQ(read_file(folder / "a.npy"), read_file(folder / ("o." + wanted + ".npy")));
    }
}

TEST(Measures, FacesHaveOneMoreAlongTheirAxis) {
    const scratch_folder folder;
    builder file;
    add(file, box(box_low, box_high));
    for (int axis = 0; axis < 3; ++axis) {
        const std::string wanted = std::string("aperture_") + "xyz"[axis];
        const outcome result = draw(folder, file, "o.npy", {"-t", wanted, "--stats", "json"});
        ASSERT_EQ(0, result.code) << result.err;
        const array found = read_npy(folder / "o.npy");
        glm::ivec3 faces(16);
        ++faces[axis];
        ASSERT_EQ((std::vector<std::size_t>{static_cast<std::size_t>(faces.z), static_cast<std::size_t>(faces.y),
                                            static_cast<std::size_t>(faces.x)}),
                  found.shape);
        std::size_t i = 0;
        for (int z = 0; z < faces.z; ++z)
            for (int y = 0; y < faces.y; ++y)
                for (int x = 0; x < faces.x; ++x, ++i) {
                    const box_part part = part_of(x, y, z);
                    const double plane = part.first[axis];
                    const bool is_inside = box_low[axis] <= plane && plane < box_high[axis]; // a side counts as below
                    const double across = part.size()[(axis + 1) % 3] * part.size()[(axis + 2) % 3];
                    ASSERT_EQ(is_inside ? static_cast<float>(across / 0.25) : 0.0F, found.at<float>(i))
                        << axis << ' ' << x << ' ' << y << ' ' << z;
                }
        const json stats = json::parse(result.out);
        EXPECT_EQ(0, stats["fractions"]["open_rows"].get<int>());
        const glm::dvec3 size = (box_high - box_low) / 0.5;
        EXPECT_EQ(size.x * size.y * size.z, stats["fractions"]["volume"].get<double>());
    }
}

// The last faces are inside where the model leaves the grid; a ring around the grid is empty.
TEST(Measures, FacesOfPartsOfAModelAndOfPaddedGrids) {
    const scratch_folder folder;
    builder file;
    add(file, box({-2, -2, -2}, {9, 9, 9}));
    for (const std::string wanted : {"aperture_x", "aperture_y", "aperture_z"}) {
        ASSERT_EQ(0, draw(folder, file, "o.npy", {"-t", wanted}).code);
        const array found = read_npy(folder / "o.npy");
        EXPECT_EQ(1.0F, found.at<float>(found.voxels() - 1));
        ASSERT_EQ(
            0,
            run(folder, {folder / "m.glb", "-o", folder / "p.npy", "-t", wanted, "-r", "12", "--padding", "2"}).code);
        ASSERT_EQ(0, run(folder, {folder / "m.glb", "-o", folder / "q.npy", "-t", wanted, "-r", "8"}).code);
        const array padded = read_npy(folder / "p.npy"), plain = read_npy(folder / "q.npy");
        std::size_t i = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) ASSERT_EQ(plain.shape[axis] + 4, padded.shape[axis]);
        for (std::size_t z = 0; z < plain.shape[0]; ++z)
            for (std::size_t y = 0; y < plain.shape[1]; ++y)
                for (std::size_t x = 0; x < plain.shape[2]; ++x)
                    ASSERT_EQ(plain.at<float>(i++),
                              padded.at<float>(((z + 2) * padded.shape[1] + y + 2) * padded.shape[2] + x + 2));
    }
}

TEST(Measures, InEveryFormatOfArrays) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    for (const std::string wanted : {"area", "centroid", "aperture_x", "aperture_z"})
        for (const std::string extension : {".npy", ".npz", ".zarr", ".vti", ".nrrd", ".pvti"}) {
            if (wanted[0] == 'a' && wanted[1] == 'p' && extension != ".npy" && extension != ".npz" &&
                extension != ".zarr")
                continue;
            const outcome result = draw(folder, file, "o-" + wanted + extension, {"-t", wanted});
            EXPECT_EQ(0, result.code) << wanted << extension << ": " << result.err;
            EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
            EXPECT_TRUE(std::filesystem::exists(folder / ("o-" + wanted + extension)));
        }
    const std::string zarr = read_file(folder / "o-aperture_x.zarr/aperture_x/zarr.json");
    EXPECT_NE(std::string::npos, zarr.find("17")) << zarr;
}

} // namespace
