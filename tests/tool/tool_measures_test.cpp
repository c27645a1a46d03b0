// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --target area, centroid, aperture_x, aperture_y and aperture_z: those of boxes, in every format of arrays. --target
// links: the library's lists.
#include "fraction_support.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/cells/links.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <sstream>

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
        for (const std::string extension : {".npy", ".npz", ".zarr", ".vti", ".nrrd", ".nii", ".pvti"}) {
            if (wanted.starts_with("aperture") && extension == ".pvti") continue; // which is refused
            const outcome result = draw(folder, file, "o-" + wanted + extension, {"-t", wanted});
            EXPECT_EQ(0, result.code) << wanted << extension << ": " << result.err;
            EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
            EXPECT_TRUE(std::filesystem::exists(folder / ("o-" + wanted + extension)));
        }
    const std::string zarr = read_file(folder / "o-aperture_x.zarr/aperture_x/zarr.json");
    EXPECT_NE(std::string::npos, zarr.find("17")) << zarr;
}

// The files of a run that has faces and voxels, against runs that have one of them.
TEST(Measures, FacesStandBesideValuesOfVoxels) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const std::vector<std::string> wanted{"fraction", "aperture_x", "area", "aperture_z", "aperture_y", "occupancy"};
    std::string all;
    for (const std::string& each : wanted) all += (all.empty() ? "" : ",") + each;
    for (const std::string grid : {"--padding=0", "--padding=2"}) {
        file.write_glb(folder / "m.glb");
        const auto voxelize = [&](const std::string& output, const std::string& targets) {
            const outcome result = run(folder, {folder / "m.glb", "-o", folder / output, "-t", targets, "-r", "14",
                                                grid, "--solid", "nonzero", "--compression", "0"});
            EXPECT_EQ(0, result.code) << result.err;
        };
        for (const std::string& each : wanted) voxelize(each + ".npy", each);
        voxelize("o.npy", all);
        for (const std::string& each : wanted)
            EXPECT_TRUE(read_file(folder / (each + ".npy")) == read_file(folder / ("o." + each + ".npy"))) << each;
        for (const std::string extension : {".vti", ".nrrd", ".nii"}) {
            voxelize("o" + extension, all);
            voxelize("v" + extension, "fraction,area,occupancy");
            for (const std::string& each : wanted) {
                const bool is_of_faces = each.starts_with("aperture");
                if (extension == ".vti" && !is_of_faces) continue;
                voxelize(each + extension, each);
                EXPECT_TRUE(read_file(folder / (each + extension)) == read_file(folder / ("o." + each + extension)))
                    << each << extension;
            }
        }
        EXPECT_TRUE(read_file(folder / "o.vti") == read_file(folder / "v.vti"));
        voxelize("o.npz", all);
        const std::string npz = read_file(folder / "o.npz");
        for (const std::string& each : wanted) // stored as they are
            EXPECT_NE(std::string::npos, npz.find(read_file(folder / (each + ".npy")))) << each;
        voxelize("o.zarr", all);
        for (const std::string& each : wanted)
            EXPECT_TRUE(std::filesystem::exists(folder / ("o.zarr/" + each + "/zarr.json"))) << each;
    }
    // The samples of an image lie on the faces: half a voxel below those of the voxels, along the axis.
    const auto numbers = [&](const std::string& name, const std::string& attribute) {
        const std::string text = read_file(folder / name);
        std::istringstream list(text.substr(text.find(attribute + "=\"") + attribute.size() + 2));
        std::vector<double> found(6);
        for (double& each : found) list >> each;
        return found;
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::string name = std::string("o.aperture_") + "xyz"[axis] + ".vti";
        for (std::size_t a = 0; a < 3; ++a) {
            const double half = a == axis ? numbers("o.vti", "Spacing")[a] / 2 : 0;
            EXPECT_EQ(numbers("o.vti", "Origin")[a] - half, numbers(name, "Origin")[a]) << name;
            EXPECT_EQ(numbers("o.vti", "WholeExtent")[2 * a + 1] + (a == axis ? 1 : 0),
                      numbers(name, "WholeExtent")[2 * a + 1]);
        }
    }
}

TEST(Measures, FilesOfFacesReplaceNoInput) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    for (const std::string extension : {".npy", ".vti", ".nrrd", ".nii.gz"}) {
        std::filesystem::create_symlink(folder / "m.glb", folder / ("o.aperture_x" + extension));
        const outcome result = draw(folder, file, "o" + extension, {"-t", "fraction,aperture_x"});
        EXPECT_EQ(1, result.code) << extension;
        EXPECT_NE(std::string::npos, result.err.find("is the model")) << result.err;
    }
    const outcome both = draw(folder, file, "p.vti", {"-t", "fraction,aperture_x", "-o", folder / "p.aperture_x.vti"});
    EXPECT_EQ(1, both.code) << both.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "p.vti"));
}

// A voxel of a list of links, by its place: q, triangles and materials.
struct link_row {
    std::vector<float> q;
    std::vector<std::int32_t> triangles, materials;
    bool operator==(const link_row&) const = default;
};
using place = std::array<int, 3>; // z, y, x
using link_rows = std::map<place, link_row>;

// The library's links of parts; part i has the material i.
link_rows library_links(const std::vector<shape>& parts, const vp::grid& grid, int neighbours) {
    vp::cpu_backend backend(1);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, vp::none>> draws;
    for (const shape& part : parts)
        draws.push_back(
            {{{part.positions.data(), part.positions.size()}, {part.triangles.data(), part.triangles.size()}}, {}, {}});
    vp::link_list<vp::cpu_backend> found(backend);
    const vp::status status = vp::voxelize_links(backend, draws, grid, found, vp::link_options{neighbours});
    EXPECT_TRUE(status.ok()) << status.message();
    link_rows rows;
    const std::vector<glm::ivec3> voxels = found.voxels.to_host(backend);
    const std::vector<float> q = found.q.to_host(backend);
    const auto triangles = found.primitives.to_host(backend), of_draws = found.draws.to_host(backend);
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        link_row& row = rows[{voxels[i].z, voxels[i].y, voxels[i].x}];
        for (std::size_t at = i * static_cast<std::size_t>(neighbours);
             row.q.size() < static_cast<std::size_t>(neighbours); ++at) {
            row.q.push_back(q[at]);
            row.triangles.push_back(static_cast<std::int32_t>(triangles[at]));
            row.materials.push_back(static_cast<std::int32_t>(of_draws[at]));
        }
    }
    return rows;
}

// What files NAME.npy, NAME.links.npy and so on hold, each voxel moved by SHIFT.
link_rows read_links(const std::filesystem::path& file, std::size_t neighbours, int shift = 0) {
    const auto beside = [&](const char* word) {
        return read_npy(std::filesystem::path(file).replace_extension(std::string(word) + ".npy"));
    };
    const array coords = read_npy(file), q = beside("links"), triangles = beside("link_triangle"),
                materials = beside("link_material");
    EXPECT_EQ("<i4", coords.type);
    EXPECT_EQ("<f4", q.type);
    EXPECT_EQ("<i4", triangles.type);
    EXPECT_EQ((std::vector<std::size_t>{coords.shape[0], 3}), coords.shape);
    for (const array* a : {&q, &triangles, &materials})
        EXPECT_EQ((std::vector<std::size_t>{coords.shape[0], neighbours}), a->shape);
    link_rows rows;
    for (std::size_t n = 0; n < coords.shape[0]; ++n) {
        const auto at = [&](std::size_t axis) { return coords.at<std::int32_t>(3 * n + axis) + shift; };
        link_row& row = rows[{at(2), at(1), at(0)}];
        for (std::size_t k = n * neighbours; k < (n + 1) * neighbours; ++k) {
            row.q.push_back(q.at<float>(k));
            row.triangles.push_back(triangles.at<std::int32_t>(k));
            row.materials.push_back(materials.at<std::int32_t>(k));
        }
    }
    EXPECT_EQ(coords.shape[0], rows.size());
    return rows;
}

TEST(Links, AreThoseOfTheLibrary) {
    const scratch_folder folder;
    builder file;
    shape sheet = box({-3.5F, -3.5F, 2.6F}, {3.5F, 3.5F, 3.25F});
    sheet.triangles.resize(2); // an open one
    const std::vector<shape> parts{tilted, sheet};
    for (const shape& part : parts) {
        json& primitive = add(file, part);
        primitive["material"] = gltf_test::add_material(file, {1, 1, 1, 1});
    }
    for (const std::size_t neighbours : {std::size_t{18}, std::size_t{26}}) {
        const link_rows expected = library_links(parts, grid_of_16(), static_cast<int>(neighbours));
        EXPECT_GT(expected.size(), 500U);
        for (const char* const threads : {"1", "3"}) {
            const outcome result = draw(folder, file, "o.npy",
                                        {"-t", "links,link_triangle,link_material", "--neighbours",
                                         std::to_string(neighbours), "-j", threads, "--stats", "json"});
            ASSERT_EQ(0, result.code) << result.err;
            EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
            EXPECT_TRUE(read_links(folder / "o.npy", neighbours) == expected);
            std::size_t crossed = 0;
            for (const auto& [at, row] : expected)
                crossed +=
                    static_cast<std::size_t>(std::count_if(row.q.begin(), row.q.end(), [](float q) { return q > 0; }));
            const json stats = json::parse(result.out);
            EXPECT_EQ(expected.size(), stats["voxels"].get<std::size_t>());
            EXPECT_EQ(crossed, stats["fragments"].get<std::size_t>());
            EXPECT_FALSE(stats.contains("fractions"));
        }
    }
    // 18 without the option, and one file of all.
    ASSERT_EQ(0, draw(folder, file, "a.npy", {"-t", "links"}).code);
    ASSERT_EQ(0, draw(folder, file, "b.npy", {"-t", "links", "--neighbours", "18", "--sparse"}).code);
    EXPECT_EQ(read_file(folder / "a.npy"), read_file(folder / "b.npy"));
    EXPECT_EQ(read_file(folder / "a.links.npy"), read_file(folder / "b.links.npy"));
    ASSERT_EQ(0, draw(folder, file, "c.npz", {"-t", "links", "--compression", "0"}).code);
    const std::string archive = read_file(folder / "c.npz");
    for (const char* const member : {"a.npy", "a.links.npy"})
        EXPECT_NE(std::string::npos, archive.find(read_file(folder / member)));
}

// A ring around the grid is fluid, whose links lead into the walls.
TEST(Links, AreThoseOfThePaddingToo) {
    const scratch_folder folder;
    builder file;
    add(file, box({-2.1F, -1.9F, -2.2F}, {2.3F, 1.8F, 2.1F}));
    const std::string wanted = "links,link_triangle,link_material";
    file.write_glb(folder / "m.glb");
    const auto drawn = [&](const std::string& output, std::vector<std::string> grid) {
        grid.insert(grid.begin(), {folder / "m.glb", "-o", folder / output, "-t", wanted, "-s", "0.5"});
        const outcome result = run(folder, grid);
        EXPECT_EQ(0, result.code) << result.err;
    };
    drawn("plain.npy", {});
    drawn("padded.npy", {"--padding", "2"});
    const link_rows plain = read_links(folder / "plain.npy", 18), padded = read_links(folder / "padded.npy", 18, -2);
    EXPECT_GT(padded.size(), plain.size() + 100);
    for (const auto& [at, row] : plain) {
        ASSERT_TRUE(padded.contains(at));
        EXPECT_TRUE(padded.at(at) == row);
    }
}

TEST(Links, WhatDoesNotGoWithThemIsRefused) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const auto refused = [&](std::vector<std::string> arguments, const std::string& why, int code = 1,
                             const std::string& output = "o.npz") {
        const outcome result = draw(folder, file, output, arguments);
        EXPECT_EQ(code, result.code) << why << ": " << result.err;
        EXPECT_NE(std::string::npos, result.err.find(why)) << result.err;
        EXPECT_FALSE(std::filesystem::exists(folder / output));
    };
    refused({"-t", "links", "--neighbours", "6"}, "--neighbours is 18 or 26, not 6");
    refused({"-t", "fraction", "--neighbours", "18"}, "--neighbours goes with --target links");
    refused({"--neighbours", "18"}, "--neighbours goes with --target links");
    refused({"-t", "link_triangle"}, "--target link_triangle goes with --target links");
    refused({"-t", "links,fraction"}, "go with it, fraction does not");
    refused({"-t", "links,color"}, "go with it, color does not");
    refused({"-t", "links", "--solid", "nonzero"}, "--solid and --target links do not go together");
    refused({"-t", "links", "--close-holes"}, "--close-holes and --target links");
    refused({"-t", "links", "--dense"}, "--dense and --target links");
    refused({"-t", "links", "--coverage", "thin"}, "--coverage and --target links");
    refused({"-t", "links", "--alpha", "cutoff"}, "--alpha cutoff and --target links");
    refused({"-t", "links", "--clamp"}, "--clamp goes with --target fraction");
    refused({"-t", "links", "--resume"}, "--target links is one piece of work");
    refused({"-t", "links", "--distance"}, "links does not go with --distance");
    for (const std::string output : {"o.vti", "o.zarr", "o.nvdb", "o.nrrd"})
        refused({"-t", "links"}, ".npz and .npy take the lists of --target links", 1, output);
    refused({"-t", "links", "--backend", "cuda"}, "--target links is drawn on the CPU alone", 5);
    const outcome far = run(folder, {folder / "m.glb", "-o", folder / "o.npz", "-t", "links", "--origin", "50,50,50",
                                     "-s", "0.5", "--extent", "4,4,4"});
    EXPECT_EQ(0, far.code) << far.err;
    EXPECT_NE(std::string::npos, far.err.find("warning")) << far.err; // no voxel has any
}

} // namespace
