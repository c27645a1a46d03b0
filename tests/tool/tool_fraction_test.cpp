// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --target fraction: the library's values in files, beside other targets, clamped, of open models, and what is refused.
#include "fraction_support.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/sparse/io/nanovdb_layout.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

using namespace tool_test;
using namespace fraction_test;

namespace {

namespace vp = voxelpipe;

// What the library gives for these parts as one mesh.
std::vector<float> library_fractions(const std::vector<shape>& parts, const vp::grid& grid) {
    shape all;
    for (const shape& part : parts) {
        const auto first = static_cast<std::uint32_t>(all.positions.size());
        all.positions.insert(all.positions.end(), part.positions.begin(), part.positions.end());
        for (const glm::uvec3& t : part.triangles) all.triangles.push_back(t + first);
    }
    vp::cpu_backend backend(1);
    const vp::mesh<vp::cpu_backend> mesh(backend, all.positions, all.triangles);
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(backend, grid.extent);
    const vp::status status = vp::voxelize_cells(backend, mesh, grid, vp::passthrough{}, vp::fraction{}, fb);
    EXPECT_TRUE(status.ok()) << status.message();
    return vp::get<0>(fb).to_host(backend);
}

void expect_same(const std::vector<float>& expected, const array& found) {
    ASSERT_EQ(expected.size(), found.voxels());
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_EQ(expected[i], found.at<float>(i)) << i;
}

TEST(Fraction, NpyHasTheBytesOfTheLibrary) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    for (const char* const threads : {"1", "3"}) {
        const outcome result = draw(folder, file, "o.npy", {"-t", "fraction", "-j", threads});
        ASSERT_EQ(0, result.code) << result.err;
        const array found = read_npy(folder / "o.npy");
        EXPECT_EQ("<f4", found.type);
        ASSERT_EQ((std::vector<std::size_t>{16, 16, 16}), found.shape);
        expect_same(library_fractions({tilted}, grid_of_16()), found);
    }
}

// Arrays are indexed by z, y and x; faces across an axis are one more along it.
TEST(Fraction, NpyIsIndexedByZYAndX) {
    const scratch_folder folder;
    builder file;
    add(file, box({-4, -3.75F, -3.5F}, {-3.5F, -2.75F, -1.75F}));
    file.write_glb(folder / "m.glb");
    const auto shape_of = [&](const std::string& wanted) {
        const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "--origin", "-4,-4,-4", "-s",
                                            "0.5", "--extent", "3,5,7", "-t", wanted});
        EXPECT_EQ(0, result.code) << result.err;
        EXPECT_EQ("<f4", read_npy(folder / "o.npy").type);
        return read_npy(folder / "o.npy").shape;
    };
    using shape_type = std::vector<std::size_t>;
    EXPECT_EQ((shape_type{7, 5, 4}), shape_of("aperture_x"));
    EXPECT_EQ((shape_type{7, 6, 3}), shape_of("aperture_y"));
    EXPECT_EQ((shape_type{8, 5, 3}), shape_of("aperture_z"));
    EXPECT_EQ((shape_type{7, 5, 3}), shape_of("fraction"));
    const array found = read_npy(folder / "o.npy");
    const auto at = [&](std::size_t z, std::size_t y, std::size_t x) { return found.at<float>((z * 5 + y) * 3 + x); };
    EXPECT_EQ(0.5F, at(1, 0, 0));
    EXPECT_EQ(1.0F, at(1, 1, 0));
    EXPECT_EQ(0.5F, at(4, 1, 0));
    EXPECT_EQ(0.25F, at(4, 2, 0));
    EXPECT_EQ(0.0F, at(1, 1, 1));
    EXPECT_EQ(0.0F, at(5, 1, 0));
}

TEST(Fraction, OfABoxIsTheProductOfItsOverlaps) {
    const scratch_folder folder;
    builder file;
    const glm::dvec3 low(-2.125, -1.75, -3), high(1.625, 2.0625, 0.25);
    add(file, box(low, high));
    const outcome result = draw(folder, file, "o.npy", {"-t", "fraction", "--stats", "json"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
    const array found = read_npy(folder / "o.npy");
    std::size_t i = 0, covered = 0;
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x) {
                const glm::dvec3 first = -4.0 + 0.5 * glm::dvec3(x, y, z);
                const glm::dvec3 part = glm::max(glm::min(first + 0.5, high) - glm::max(first, low), 0.0) / 0.5;
                covered += part.x * part.y * part.z > 0 ? 1 : 0;
                ASSERT_EQ(static_cast<float>(part.x * part.y * part.z), found.at<float>(i++))
                    << x << ' ' << y << ' ' << z;
            }
    const json stats = json::parse(result.out), fractions = stats["fractions"];
    const glm::dvec3 size = (high - low) / 0.5;
    EXPECT_EQ(size.x * size.y * size.z, fractions["volume"].get<double>());
    EXPECT_EQ(256, fractions["rows"].get<int>());
    for (const char* const name : {"open_rows", "open_edges", "below_zero", "above_one"})
        EXPECT_EQ(0, fractions[name].get<int>()) << name;
    EXPECT_LE(covered, stats["voxels"].get<std::size_t>());
    EXPECT_EQ("cpu", stats["backend"].get<std::string>());
}

// Area of the box's sides within the voxels: for each axis the part of the voxel across it, where a side lies.
TEST(Fraction, AreaVectorsOfABoxAreThoseOfItsSides) {
    const scratch_folder folder;
    builder file;
    const glm::dvec3 low(-2.125, -1.75, -3.25), high(1.625, 2.0625, 0.25);
    add(file, box(low, high));
    for (const char* const targets : {"area_vector", "fraction,area_vector,occupancy"}) {
        const bool is_alone = std::string(targets) == "area_vector";
        const outcome result = draw(folder, file, "o.npy", {"-t", targets, "--stats", "json"});
        ASSERT_EQ(0, result.code) << result.err;
        EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
        const array found = read_npy(folder / (is_alone ? "o.npy" : "o.area_vector.npy"));
        EXPECT_EQ("<f4", found.type);
        ASSERT_EQ((std::vector<std::size_t>{16, 16, 16, 3}), found.shape);
        std::size_t i = 0;
        for (int z = 0; z < 16; ++z)
            for (int y = 0; y < 16; ++y)
                for (int x = 0; x < 16; ++x)
                    for (int axis = 0; axis < 3; ++axis) {
                        const glm::dvec3 first = -4.0 + 0.5 * glm::dvec3(x, y, z), last = first + 0.5;
                        const glm::dvec3 part = glm::max(glm::min(last, high) - glm::max(first, low), 0.0);
                        // A side between two voxels is the lower one's.
                        const auto holds = [&](double side) { return first[axis] < side && side <= last[axis]; };
                        const double across = part[(axis + 1) % 3] * part[(axis + 2) % 3];
                        ASSERT_EQ(static_cast<float>(across * (holds(high[axis]) - holds(low[axis]))),
                                  found.at<float>(i++))
                            << x << ' ' << y << ' ' << z << ' ' << axis;
                    }
        const json fractions = json::parse(result.out)["fractions"];
        EXPECT_EQ(3 * 256, fractions["rows"].get<int>());
        EXPECT_EQ(0, fractions["open_rows"].get<int>());
        const glm::dvec3 size = (high - low) / 0.5;
        EXPECT_EQ(size.x * size.y * size.z, fractions["volume"].get<double>());
        if (!is_alone)
            expect_same(library_fractions({box(low, high)}, grid_of_16()), read_npy(folder / "o.fraction.npy"));
    }
}

TEST(Fraction, AreaVectorsArePaddedAndAddUpToNothing) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const outcome whole = draw(folder, file, "o.npy", {"-t", "area_vector", "-j", "3"});
    ASSERT_EQ(0, whole.code) << whole.err;
    const auto areas = [&](const std::vector<std::string>& grid) {
        std::vector<std::string> arguments{folder / "m.glb", "-o", folder / "p.npy", "-t", "area_vector"};
        arguments.insert(arguments.end(), grid.begin(), grid.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return read_npy(folder / "p.npy");
    };
    const array plain = areas({"-r", "10"}), padded = areas({"-r", "16", "--padding", "3"});
    ASSERT_EQ(plain.shape[2] + 6, padded.shape[2]);
    std::size_t at = 0;
    for (std::size_t z = 0; z < plain.shape[0]; ++z)
        for (std::size_t y = 0; y < plain.shape[1]; ++y)
            for (std::size_t x = 0; x < 3 * plain.shape[2]; ++x)
                ASSERT_EQ(plain.at<float>(at++),
                          padded.at<float>(((z + 3) * padded.shape[1] + y + 3) * 3 * padded.shape[2] + x + 9));
    const array found = read_npy(folder / "o.npy");
    glm::dvec3 sum(0), sizes(0);
    for (std::size_t i = 0; i < found.voxels(); ++i) {
        const glm::dvec3 v(found.at<float>(3 * i), found.at<float>(3 * i + 1), found.at<float>(3 * i + 2));
        sum += v;
        sizes += glm::abs(v);
    }
    EXPECT_GT(1e-5, glm::length(sum));
    // The sides across x are sheared along x: their projections keep their size. No voxel has two opposite sides.
    EXPECT_NEAR(2 * 3.6 * 2.8, sizes.x, 1e-2);
    EXPECT_NEAR(2 * 3.3 * 3.6, sizes.z, 1e-2);
}

TEST(Fraction, OtherTargetsBesideItAreAsWithoutIt) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const std::vector<float> expected = library_fractions({tilted}, grid_of_16());
    const std::vector<std::vector<std::string>> ways{{}, {"--solid", "nonzero"}};
    for (const std::vector<std::string>& way : ways) {
        std::vector<std::string> alone = way, both = way;
        alone.insert(alone.end(), {"-t", "occupancy,normal"});
        both.insert(both.end(), {"-t", "occupancy,fraction,normal", "--work-memory", "1"});
        ASSERT_EQ(0, draw(folder, file, "a.npy", alone).code);
        const outcome result = draw(folder, file, "b.npy", both);
        ASSERT_EQ(0, result.code) << result.err;
        for (const std::string name : {".occupancy.npy", ".normal.npy"})
            EXPECT_EQ(read_file(folder / ("a" + name)), read_file(folder / ("b" + name))) << name;
        expect_same(expected, read_npy(folder / "b.fraction.npy"));
    }
}

TEST(Fraction, PaddingIsEmptyAroundIt) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    file.write_glb(folder / "m.glb");
    const auto fractions = [&](const std::vector<std::string>& grid) {
        std::vector<std::string> arguments{folder / "m.glb", "-o", folder / "o.npy", "-t", "fraction"};
        arguments.insert(arguments.end(), grid.begin(), grid.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return read_npy(folder / "o.npy");
    };
    const array plain = fractions({"-r", "10"}), padded = fractions({"-r", "16", "--padding", "3"});
    for (std::size_t axis = 0; axis < 3; ++axis) ASSERT_EQ(plain.shape[axis] + 6, padded.shape[axis]);
    const std::size_t ny = plain.shape[1], nx = plain.shape[2];
    std::size_t i = 0, whole = 0;
    for (std::size_t z = 0; z < padded.shape[0]; ++z)
        for (std::size_t y = 0; y < padded.shape[1]; ++y)
            for (std::size_t x = 0; x < padded.shape[2]; ++x) {
                const bool inside = z - 3 < plain.shape[0] && y - 3 < ny && x - 3 < nx; // of unsigned numbers
                const float expected = inside ? plain.at<float>(((z - 3) * ny + y - 3) * nx + x - 3) : 0.0F;
                whole += expected == 1.0F ? 1 : 0;
                ASSERT_EQ(expected, padded.at<float>(i++)) << x << ' ' << y << ' ' << z;
            }
    EXPECT_GT(whole, 100U);
}

TEST(Fraction, OverlapsAddUpAndClampKeepsOne) {
    const scratch_folder folder;
    builder file;
    shape inverted = box({2, 2, 2}, {3, 3, 3});
    for (glm::uvec3& t : inverted.triangles) std::swap(t.y, t.z);
    const std::vector<shape> parts{tilted, box({-1, -1, -1}, {1, 3, 1}), inverted};
    for (const shape& part : parts) add(file, part);
    const outcome plain = draw(folder, file, "plain.npy", {"-t", "fraction"});
    ASSERT_EQ(0, plain.code) << plain.err;
    EXPECT_NE(std::string::npos, plain.err.find("--clamp keeps 0 to 1")) << plain.err;
    std::vector<float> expected = library_fractions(parts, grid_of_16());
    EXPECT_EQ(2, *std::max_element(expected.begin(), expected.end()));
    EXPECT_EQ(-1, *std::min_element(expected.begin(), expected.end()));
    expect_same(expected, read_npy(folder / "plain.npy"));
    const outcome clamped = draw(folder, file, "clamped.npy", {"-t", "fraction", "--clamp"});
    ASSERT_EQ(0, clamped.code) << clamped.err;
    EXPECT_EQ(std::string::npos, clamped.err.find("--clamp")) << clamped.err;
    for (float& value : expected) value = std::clamp(value, 0.0F, 1.0F);
    expect_same(expected, read_npy(folder / "clamped.npy"));
}

std::size_t cells_of(const std::string& vtu) {
    const std::string before = "NumberOfCells=\"";
    const std::size_t at = vtu.find(before);
    return at == std::string::npos ? SIZE_MAX : std::stoul(vtu.substr(at + before.size()));
}

// 1 minus the values of the inside, rounded once, in every voxel and on every face; other targets are as without it.
TEST(Fraction, OutsideIsOneMinusTheInside) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    add(file, box({-1, -1, -1}, {1, 3, 1})); // with overlaps
    const std::string names = "fraction,area_vector,aperture_x,aperture_y,aperture_z,occupancy";
    for (const std::vector<std::string>& more :
         std::vector<std::vector<std::string>>{{}, {"--clamp"}, {"--padding", "2"}}) {
        const auto voxelize = [&](const std::string& output, std::vector<std::string> how) {
            file.write_glb(folder / "m.glb");
            how.insert(how.begin(), {folder / "m.glb", "-o", folder / output, "-t", names, "-r", "16", "--solid",
                                     "nonzero", "--stats", "json"});
            how.insert(how.end(), more.begin(), more.end());
            const outcome result = run(folder, how);
            EXPECT_EQ(0, result.code) << result.err;
            return json::parse(result.out)["fractions"];
        };
        EXPECT_EQ(voxelize("i.npy", {}), voxelize("o.npy", {"--outside", "-j", "3"}));
        for (const std::string name : {"fraction", "aperture_x", "aperture_y", "aperture_z"}) {
            const array inside = read_npy(folder / ("i." + name + ".npy")),
                        outside = read_npy(folder / ("o." + name + ".npy"));
            ASSERT_EQ(inside.shape, outside.shape);
            std::size_t cut = 0, whole = 0;
            for (std::size_t i = 0; i < inside.voxels(); ++i) {
                const auto share = inside.at<float>(i);
                ASSERT_EQ(1.0F - share, outside.at<float>(i)) << name << ' ' << i;
                cut += share != 0 && share != 1 ? 1 : 0;
                whole += share == 0 ? 1 : 0;
            }
            EXPECT_LT(100U, cut);
            EXPECT_LT(100U, whole);
        }
        for (const std::string name : {"area_vector", "occupancy"})
            EXPECT_TRUE(read_file(folder / ("i." + name + ".npy")) == read_file(folder / ("o." + name + ".npy")))
                << name;
    }
    // Hexahedra are those of the fluid.
    const std::vector<float> fractions = library_fractions({tilted}, grid_of_16());
    builder alone;
    add(alone, tilted);
    const outcome fluid = draw(folder, alone, "o.vtu", {"-t", "fraction", "--outside", "--threshold", "0.75"});
    ASSERT_EQ(0, fluid.code) << fluid.err;
    EXPECT_EQ(std::count_if(fractions.begin(), fractions.end(), [](float f) { return 1 - f >= 0.75F; }),
              static_cast<std::ptrdiff_t>(cells_of(read_file(folder / "o.vtu"))));
}

// The lid on a box without a side is the side: the closed box's values, without a warning, beside a solid too.
TEST(Fraction, HolesAreClosed) {
    const scratch_folder folder;
    const glm::vec3 low(-2.125F, -1.75F, -3), high(1.625F, 2.0625F, 0.25F);
    const shape whole = box(low, high);
    shape open = whole;
    open.triangles.resize(10); // without the side at the greatest x
    builder file;
    add(file, open);
    const std::vector<float> expected = library_fractions({whole}, grid_of_16());
    const auto values = [&](const std::vector<std::string>& arguments, outcome& result) {
        result = draw(folder, file, "o.npy", arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return read_npy(folder / (arguments[1] == "fraction" ? "o.npy" : "o.fraction.npy"));
    };
    outcome result;
    const array closed = values({"-t", "fraction", "--close-holes", "--stats", "json"}, result);
    EXPECT_EQ(std::string::npos, result.err.find("not closed")) << result.err;
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(expected[i], closed.at<float>(i), 1e-7) << i;
    json counts = json::parse(result.out)["fractions"];
    EXPECT_EQ((std::vector{4, 1, 1, 0, 0}),
              (std::vector<int>{counts["hole_edges"], counts["holes"], counts["closed_holes"], counts["open_edges"],
                                counts["open_rows"]}));
    const array beside =
        values({"-t", "fraction,occupancy", "--solid", "nonzero", "--close-holes=4", "--stats", "json"}, result);
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_EQ(closed.at<float>(i), beside.at<float>(i)) << i;
    EXPECT_EQ(1, json::parse(result.out)["solid"]["closed_holes"].get<int>());
    // Too large a hole: the open box's values, with the warning.
    const array left = values({"-t", "fraction", "--close-holes=3"}, result);
    EXPECT_NE(std::string::npos, result.err.find("not closed")) << result.err;
    expect_same(library_fractions({open}, grid_of_16()), left);
}

TEST(Fraction, OpenModelsAndLinesAreNamed) {
    const scratch_folder folder;
    builder file;
    shape open = tilted;
    open.triangles.pop_back();
    add(file, open);
    file.mesh({{"POSITION", file.accessor(std::vector<float>{0, 0, 0, 1, 1, 1}, "VEC3")}})["mode"] = 1;
    const outcome result = draw(folder, file, "o.npy", {"-t", "fraction"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("the model is not closed: ")) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("(3 open edges)")) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("1 line(s) and point(s) enclose nothing")) << result.err;
    expect_same(library_fractions({open}, grid_of_16()), read_npy(folder / "o.npy"));

    builder lines;
    lines.mesh({{"POSITION", lines.accessor(std::vector<float>{0, 0, 0, 1, 1, 1}, "VEC3")}})["mode"] = 1;
    const outcome none = draw(folder, lines, "o.npy", {"-t", "fraction"});
    EXPECT_EQ(2, none.code);
    EXPECT_NE(std::string::npos, none.err.find("--target fraction needs triangles")) << none.err;
}

TEST(Fraction, EveryFormatOfValuesHoldsIt) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    for (const char* const output :
         {"o.npz", "o.vti", "o.pvti", "o.nrrd", "o.nii", "o.nii.gz", "o.zarr", "o.png", "o.html"}) {
        const outcome result = draw(folder, file, output, {"-t", "fraction", "--image-size", "64x48"});
        EXPECT_EQ(0, result.code) << output << ": " << result.err;
        EXPECT_EQ(std::string::npos, result.err.find("warning")) << output << ": " << result.err;
    }
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"-t", "fraction", "--solid", "nonzero"}, {"-t", "fraction", "--sparse"}}) {
        const outcome result = draw(folder, file, "o.nvdb", arguments);
        EXPECT_EQ(0, result.code) << result.err;
        const std::string bytes = read_file(folder / "o.nvdb");
        std::vector<std::string> fog; // the grids of that class, of the headers of all grids in front
        vp::io::nanovdb::file_header header{};
        ASSERT_GE(bytes.size(), sizeof(header));
        std::memcpy(&header, bytes.data(), sizeof(header));
        for (std::size_t i = 0, at = sizeof(header); i < header.num_grids; ++i) {
            vp::io::nanovdb::file_entry entry{};
            ASSERT_GE(bytes.size(), at + sizeof(entry));
            std::memcpy(&entry, bytes.data() + at, sizeof(entry));
            at += sizeof(entry);
            if (entry.meaning == vp::io::nanovdb::grid_class::fog_volume) fog.emplace_back(bytes.data() + at);
            at += entry.name_size;
        }
        EXPECT_EQ(std::vector<std::string>{"fraction"}, fog);
    }
}

TEST(Fraction, ThresholdChoosesTheHexahedra) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const std::vector<float> fractions = library_fractions({tilted}, grid_of_16());
    std::vector<std::size_t> counts;
    for (const std::string threshold : {"1e-6", "0.5", "1"}) {
        // What another output asks for changes nothing here.
        const outcome result =
            draw(folder, file, "o.vtu", {"-t", "fraction", "--threshold", threshold, "-o", folder / "o.binvox"});
        ASSERT_EQ(0, result.code) << result.err;
        const std::string text = read_file(folder / "o.vtu");
        counts.push_back(static_cast<std::size_t>(
            std::count_if(fractions.begin(), fractions.end(), [&](float f) { return f >= std::stof(threshold); })));
        EXPECT_EQ(counts.back(), cells_of(text)) << threshold;
        EXPECT_NE(std::string::npos, text.find("Name=\"fraction\""));
        EXPECT_EQ(std::string::npos, text.find("Name=\"occupancy\""));
    }
    EXPECT_TRUE(counts[0] > counts[1] && counts[1] > counts[2] && counts[2] > 0);
    for (const char* const output : {"o.inp", "o.msh"}) {
        const outcome result = draw(folder, file, output, {"-t", "fraction", "--threshold", "0.5"});
        EXPECT_EQ(0, result.code) << result.err;
        EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
    }
    const std::string text = read_file(folder / "o.inp");
    EXPECT_NE(std::string::npos, text.find("\n" + std::to_string(counts[1]) + ", "));
    const outcome none =
        run(folder, {folder / "m.glb", "-o", folder / "o.vtu", "-t", "fraction", "--threshold", "1", "-s", "9"});
    EXPECT_EQ(0, none.code) << none.err;
    EXPECT_NE(std::string::npos, none.err.find("no voxel has a fraction of at least 1")) << none.err;
}

TEST(Fraction, HexahedraOfASolidAreItsVoxels) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const outcome dense = draw(folder, file, "o.vtu", {"-t", "fraction,occupancy", "--solid", "nonzero"});
    ASSERT_EQ(0, dense.code) << dense.err;
    ASSERT_EQ(0, draw(folder, file, "o.npy", {"--solid", "nonzero"}).code);
    const array bits = read_npy(folder / "o.npy");
    std::size_t voxels = 0;
    for (std::size_t i = 0; i < bits.voxels(); ++i) voxels += bits.at<std::uint8_t>(i);
    EXPECT_EQ(voxels, cells_of(read_file(folder / "o.vtu")));
    // From bricks and tiles, the same files.
    for (const std::string extension : {".vtu", ".inp", ".msh"}) {
        ASSERT_EQ(0, draw(folder, file, "a" + extension, {"--solid", "nonzero", "-t", "material"}).code);
        ASSERT_EQ(0, draw(folder, file, "b" + extension, {"--solid", "nonzero", "-t", "material", "--sparse"}).code);
        EXPECT_TRUE(read_file(folder / ("a" + extension)) == read_file(folder / ("b" + extension))) << extension;
    }
}

TEST(Fraction, WhatDoesNotGoTogetherIsRefused) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    const auto refused = [&](std::vector<std::string> arguments, const std::string& why, int code = 1,
                             const std::string& output = "o.npy") {
        const outcome result = draw(folder, file, output, arguments);
        EXPECT_EQ(code, result.code) << why << ": " << result.err;
        EXPECT_NE(std::string::npos, result.err.find(why)) << result.err;
        EXPECT_FALSE(fs::exists(folder / output));
    };
    for (const std::string rule : {"even_odd", "positive", "each_draw", "exterior"})
        refused({"-t", "fraction", "--solid", rule}, "--solid " + rule + " and --target fraction do not go together");
    refused({"-t", "fraction", "--solid", "nonzero", "--vote"}, "--vote and --target fraction");
    refused({"-t", "fraction", "--solid", "nonzero", "--winding"}, "--winding and --target fraction");
    refused({"-t", "fraction", "--vote"}, "--vote and --target fraction do not go together");
    refused({"-t", "area", "--winding"}, "--winding and --target area do not go together");
    refused({"-t", "links", "--coverage", "thin"}, "links lead from each voxel's centre", 1, "o.npz");
    refused({"-t", "fraction", "--sparse"}, "it shows occupied voxels, which --sparse with cut cells", 1, "o.png");
    refused({"--close-holes"}, "--close-holes goes with --solid, or with --target fraction");
    refused({"-t", "fraction", "--close-holes=0"}, "--close-holes takes the number of edges");
    refused({"-t", "fraction", "--solid", "nonzero", "--close-holes=few"}, "--close-holes takes the number of edges");
    refused({"-t", "fraction", "--coverage", "thin"}, "--coverage and --target fraction");
    refused({"-t", "fraction", "--alpha", "cutoff"}, "--alpha cutoff and --target fraction");
    refused({"-t", "fraction,occupancy", "--sparse"}, "fraction, area and centroid alone, not occupancy");
    refused({"-t", "fraction", "--solid", "nonzero", "--sparse"}, "--sparse, --solid and --target fraction do not go");
    refused({"-t", "fraction", "--threshold", "0.5", "--sparse"}, "hexahedra take a dense grid", 1, "o.vtu");
    refused({"-t", "fraction", "--resume"}, "one piece of work");
    refused({"-t", "fraction", "--levels"}, "--levels and --target fraction", 1, "o.zarr");
    refused({"-t", "fraction", "--distance"}, "fraction does not go with --distance");
    refused({"-t", "fraction"}, "adds the inside", 1, "o.nvdb");
    refused({"-t", "fraction"}, "--threshold takes voxels by their fractions", 1, "o.vtu");
    refused({"-t", "fraction", "--threshold", "0.5"}, "--threshold: .npy has no hexahedra; .vtu, .inp and .msh have");
    refused({"--threshold", "0.5"}, "--threshold goes with --target fraction", 1, "o.inp");
    for (const std::string bad : {"0", "-1", "1.001", "nan"})
        refused({"-t", "fraction", "--threshold", bad}, "--threshold takes a fraction above 0 and up to 1", 1, "o.msh");
    refused({"--clamp"}, "--clamp goes with --target fraction");
    const std::string needs = "--outside goes with --target fraction, aperture_x, aperture_y and aperture_z";
    refused({"--outside"}, needs);
    refused({"--outside", "--solid", "nonzero", "-t", "occupancy,color"}, needs);
    refused({"--outside", "-t", "area,area_vector"}, needs);
    refused({"--outside", "--distance"}, needs);
    refused({"--outside", "--remesh"}, needs, 1, "o.ply");
    refused({"--outside", "-t", "links"}, needs, 1, "o.npz");
    refused({"--outside", "-t", "fraction,centroid"}, "--outside and --target centroid do not go together");
    refused({"--outside", "-t", "fraction", "--sparse"}, "--outside and --sparse do not go together");
    refused({"--outside", "-t", "fraction", "--solid", "nonzero"}, "--outside is about all others", 1, "o.nvdb");
    refused({"-t", "area_vector", "--clamp"}, "--clamp goes with --target fraction");
    refused({"-t", "area_vector", "--sparse"}, "fraction, area and centroid alone, not area_vector");
    refused({"-t", "area_vector", "--resume"}, "--target area_vector is one piece of work");
    refused({"-t", "area_vector"}, "beside --target area_vector adds the inside", 1, "o.nvdb");
    refused({"-t", "area_vector"}, "slices hold one target, which is occupancy or fraction", 1, "{z}.png");
    refused({"-t", "area_vector", "--backend", "cuda"}, "--target area_vector is drawn on the CPU alone", 5);
    for (const char* const output : {"o.pvti", "o.png", "o.html", "o.nvdb", "o.vtu"})
        refused(
            {"-t", "fraction,aperture_y", "--solid", "nonzero"},
            "it holds voxels; the faces of --target aperture_y go into .npy, .npz, .vti, .nrrd, .nii, .nii.gz, .zarr",
            1, output);
    refused({"-t", "centroid"}, "beside --target centroid adds the inside", 1, "o.nvdb");
    refused({"-t", "centroid", "--backend", "cuda"}, "--target centroid is drawn on the CPU alone", 5);
    refused({"-t", "fraction", "--backend", "cuda"}, "on the CPU alone", 5);
    // What slabs do not have, beyond memory.
    const std::vector<std::vector<std::string>> whole{{"-t", "fraction,aperture_x"},
                                                      {"-t", "fraction,area_vector"},
                                                      {"-t", "fraction", "--dense"},
                                                      {"-t", "fraction,occupancy", "--solid", "nonzero", "--dense"}};
    for (std::vector<std::string> arguments : whole) {
        arguments.insert(arguments.end(),
                         {folder / "m.glb", "-o", folder / "o.npy", "-r", "1000", "--max-memory", "300"});
        const outcome large = run(folder, arguments);
        EXPECT_EQ(3, large.code) << large.err;
        EXPECT_NE(std::string::npos, large.err.find("300 MiB")) << large.err;
        EXPECT_FALSE(fs::exists(folder / "o.npy"));
    }
}

// What is cut or inside, with the values of a dense run; files of all voxels are the same.
TEST(Fraction, SparseGridsHaveTheValuesOfDenseOnes) {
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    add(file, box({-3.5F, -3.5F, 2.5F}, {3.5F, 3.5F, 3.25F}));
    for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{{}, {"--clamp", "-j", "3"}}) {
        std::vector<std::string> dense{"-t", "fraction,area,centroid"};
        dense.insert(dense.end(), more.begin(), more.end());
        std::vector<std::string> sparse = dense;
        sparse.push_back("--sparse");
        for (const char* const output : {"d.npy", "d.vti"}) ASSERT_EQ(0, draw(folder, file, output, dense).code);
        for (const char* const output : {"s.npy", "s.vti", "s.nvdb", "s.npz"}) {
            const outcome drawn = draw(folder, file, output, sparse);
            ASSERT_EQ(0, drawn.code) << drawn.err;
        }
        EXPECT_TRUE(read_file(folder / "s.vti") == read_file(folder / "d.vti"));
        const array coords = read_npy(folder / "s.npy");
        const std::size_t listed = coords.shape[0];
        EXPECT_GT(listed, 400U);
        for (const char* const name : {"fraction", "area", "centroid"}) {
            const array all = read_npy(folder / ("d." + std::string(name) + ".npy")),
                        found = read_npy(folder / ("s." + std::string(name) + ".npy"));
            const std::size_t components = all.shape.size() == 4 ? 3 : 1;
            double left = 0;
            for (std::size_t i = 0; i < all.voxels() * components; ++i) left += std::abs(all.at<float>(i));
            for (std::size_t n = 0; n < listed; ++n) {
                const auto at = [&](std::size_t axis) { return coords.at<std::int32_t>(3 * n + axis); };
                const auto voxel = static_cast<std::size_t>((at(2) * 16 + at(1)) * 16 + at(0));
                for (std::size_t c = 0; c < components; ++c) {
                    ASSERT_EQ(all.at<float>(voxel * components + c), found.at<float>(n * components + c)) << name;
                    left -= std::abs(found.at<float>(n * components + c));
                }
            }
            EXPECT_NEAR(0.0, left, 1e-9) << name; // nothing is where no voxel is
        }
    }
    std::filesystem::create_directories(folder / "s");
    std::filesystem::create_directories(folder / "d");
    ASSERT_EQ(0, draw(folder, file, "s/{z}.png", {"-t", "fraction", "--sparse"}).code);
    ASSERT_EQ(0, draw(folder, file, "d/{z}.png", {"-t", "fraction"}).code);
    for (const char* const layer : {"0004.png", "0013.png"})
        EXPECT_TRUE(read_file(folder / (std::string("s/") + layer)) == read_file(folder / (std::string("d/") + layer)))
            << layer;
    const auto stats = [&](const char* output, std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), {"-t", "fraction", "--stats", "json"});
        return json::parse(draw(folder, file, output, arguments).out);
    };
    // Several files of one run: the list beside the grid of floats has the fractions too.
    ASSERT_EQ(0, draw(folder, file, "t.npy", {"-t", "fraction", "--sparse", "-o", folder / "t.nvdb"}).code);
    ASSERT_EQ(0, draw(folder, file, "u.npy", {"-t", "fraction", "--sparse"}).code);
    EXPECT_TRUE(read_file(folder / "t.fraction.npy") == read_file(folder / "u.fraction.npy"));
    const json a = stats("a.npy", {}), b = stats("b.npy", {"--sparse"});
    EXPECT_EQ(a["fractions"], b["fractions"]);
    EXPECT_EQ(a["voxels"], b["voxels"]);
}

} // namespace
