// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --distance: the field in files, its band, sign and values of the nearest triangle, level sets, and what is refused.
#include "tool_test.hpp"

#include <voxelpipe/core/half.hpp>
#include <voxelpipe/sparse/io/nanovdb_layout.hpp>

#include <gtest/gtest.h>

#include <glm/glm.hpp>
#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace tool_test;

namespace {

// The box from LOW to HIGH, its faces outward, without the last SKIPPED of its 12 triangles, which close it at +x.
json& add_box(builder& file, const glm::vec3& low, const glm::vec3& high, int skipped = 0) {
    std::vector<float> positions;
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) positions.push_back((corner >> axis & 1) != 0 ? high[axis] : low[axis]);
    std::vector<std::uint8_t> indices{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                      2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    indices.resize(indices.size() - 3 * static_cast<std::size_t>(skipped));
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    return primitive;
}

// Signed distance from a box.
double box_distance(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
    const glm::dvec3 q = glm::max(low - p, p - high);
    return glm::length(glm::max(q, glm::dvec3(0))) + std::min(0.0, std::max({q.x, q.y, q.z}));
}

const std::vector<std::string> grid_of_16{"--origin", "-4,-4,-4", "-s", "0.5", "--extent", "16,16,16"};

// Runs `voxelize m.glb -o OUTPUT --distance` with ARGUMENTS in a grid of 16^3 voxels of 0.5 from -4 on.
outcome measure(const scratch_folder& folder, const builder& file, const std::string& output,
                const std::vector<std::string>& arguments = {}) {
    file.write_glb(folder / "m.glb");
    std::vector<std::string> all{folder / "m.glb", "-o", folder / output, "--distance"};
    all.insert(all.end(), grid_of_16.begin(), grid_of_16.end());
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run(folder, all);
}

// Visits the samples of a field of n^3: visit(index, position), the first at `first`, 0.5 apart.
template <class Visit>
void for_each_sample(int n, double first, const Visit& visit) {
    std::size_t i = 0;
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) visit(i++, first + 0.5 * glm::dvec3(x, y, z));
}

const glm::vec3 low(-2, -1.5F, -2), high(1.5F, 2, 2);

TEST(Distance, NpyIsTheFieldInWorldUnits) {
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    const outcome result = measure(folder, file, "o.npy");
    ASSERT_EQ(0, result.code) << result.err;
    const array field = read_npy(folder / "o.npy");
    EXPECT_EQ("<f4", field.type);
    ASSERT_EQ((std::vector<std::size_t>{16, 16, 16}), field.shape);
    for_each_sample(16, -3.75, [&](std::size_t i, const glm::dvec3& p) {
        const auto expected = static_cast<float>(std::clamp(box_distance(p, low, high), -1.5, 1.5)); // 3 voxels
        ASSERT_EQ(expected, field.at<float>(i)) << i;
    });
}

TEST(Distance, WholeFieldsCornersAndNoSign) {
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    ASSERT_EQ(0, measure(folder, file, "whole.npy", {"--band", "whole"}).code);
    ASSERT_EQ(0, measure(folder, file, "corners.npy", {"--band", "whole", "--corners"}).code);
    ASSERT_EQ(0, measure(folder, file, "unsigned.npy", {"--band", "2.5", "--unsigned"}).code);
    const array whole = read_npy(folder / "whole.npy"), corners = read_npy(folder / "corners.npy"),
                plain = read_npy(folder / "unsigned.npy");
    ASSERT_EQ((std::vector<std::size_t>{17, 17, 17}), corners.shape);
    for_each_sample(16, -3.75, [&](std::size_t i, const glm::dvec3& p) {
        const double d = box_distance(p, low, high);
        ASSERT_EQ(static_cast<float>(d), whole.at<float>(i)) << i;
        ASSERT_EQ(static_cast<float>(std::min(std::abs(d), 1.25)), plain.at<float>(i)) << i;
    });
    for_each_sample(17, -4, [&](std::size_t i, const glm::dvec3& p) {
        ASSERT_EQ(static_cast<float>(box_distance(p, low, high)), corners.at<float>(i)) << i;
    });
}

TEST(Distance, ValuesAreThoseOfTheNearestTriangle) {
    const scratch_folder folder;
    builder file;
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0, 0, 1}}}}},
                              {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 1, 1}}}}}};
    add_box(file, {-3, -1, -1}, {-1, 1, 1})["material"] = 0;
    add_box(file, {1, -1, -1}, {3, 1, 1})["material"] = 1;
    const outcome result = measure(folder, file, "o.npy", {"-t", "nearest,color,material,normal,triangle,depth"});
    ASSERT_EQ(0, result.code) << result.err;
    const array field = read_npy(folder / "o.distance.npy"), nearest = read_npy(folder / "o.nearest.npy"),
                colors = read_npy(folder / "o.color.npy"), materials = read_npy(folder / "o.material.npy"),
                normals = read_npy(folder / "o.normal.npy"), triangles = read_npy(folder / "o.triangle.npy"),
                depths = read_npy(folder / "o.depth.npy");
    EXPECT_EQ("<i8", nearest.type);
    std::size_t far = 0, left = 0;
    for_each_sample(16, -3.75, [&](std::size_t i, const glm::dvec3& p) {
        const bool in_band = std::abs(field.at<float>(i)) < 1.5F;
        ASSERT_EQ(in_band, nearest.at<std::int64_t>(i) >= 0) << i;
        ASSERT_EQ(nearest.at<std::int64_t>(i), triangles.at<std::int32_t>(i)) << i;
        if (!in_band) {
            ++far;
            ASSERT_EQ(-1, materials.at<std::int32_t>(i)) << i;
            ASSERT_EQ(glm::u8vec4(0), colors.at<glm::u8vec4>(i)) << i;
            ASSERT_EQ(glm::vec3(0), normals.at<glm::vec3>(i)) << i;
            ASSERT_TRUE(std::isnan(depths.at<float>(i))) << i;
            return;
        }
        const bool is_left = p.x < 0;
        left += is_left ? 1 : 0;
        ASSERT_EQ(is_left ? 0 : 1, materials.at<std::int32_t>(i)) << i;
        ASSERT_EQ(is_left, nearest.at<std::int64_t>(i) < 12) << i;
        ASSERT_EQ(is_left ? glm::u8vec4(255, 0, 0, 255) : glm::u8vec4(0, 0, 255, 255), colors.at<glm::u8vec4>(i)) << i;
        const double depth = depths.at<float>(i); // of the closest point
        ASSERT_LE(std::abs(depth), 1) << i;
        if (std::abs(p.z) > 1) {
            ASSERT_EQ(std::clamp(p.z, -1.0, 1.0), depth) << i;
        }
        ASSERT_FLOAT_EQ(1.0F, glm::length(normals.at<glm::vec3>(i))) << i;
    });
    EXPECT_GT(far, 100U);
    EXPECT_GT(left, 100U);
}

TEST(Distance, SignIsByTheRuleAndTheRepairs) {
    const scratch_folder folder;
    builder nested;
    add_box(nested, {-3, -3, -3}, {3, 3, 3});
    add_box(nested, {-1, -1, -1}, {1, 1, 1});
    ASSERT_EQ(0, measure(folder, nested, "nonzero.npy").code);
    ASSERT_EQ(0, measure(folder, nested, "odd.npy", {"--solid", "even_odd"}).code);
    ASSERT_EQ(0, measure(folder, nested, "each.npy", {"--solid", "each_draw"}).code);
    const array nonzero = read_npy(folder / "nonzero.npy"), odd = read_npy(folder / "odd.npy"),
                each = read_npy(folder / "each.npy");
    for_each_sample(16, -3.75, [&](std::size_t i, const glm::dvec3& p) {
        const double reach = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        ASSERT_EQ(reach < 3, nonzero.at<float>(i) < 0) << i;
        ASSERT_EQ(reach < 3 && reach > 1, odd.at<float>(i) < 0) << i;
        ASSERT_EQ(reach < 3, each.at<float>(i) < 0) << i;
    });
    builder holed; // no +x face
    add_box(holed, {-2, -2, -2}, {2, 2, 2}, 2);
    const outcome open = measure(folder, holed, "open.npy");
    ASSERT_EQ(0, open.code) << open.err;
    EXPECT_NE(std::string::npos, open.err.find("the sign of --distance: the model is not closed")) << open.err;
    for (const std::vector<std::string>& repair :
         {std::vector<std::string>{"--close-holes"}, {"--vote"}, {"--vote", "--solid", "nonzero"}, {"--winding"}}) {
        const outcome result = measure(folder, holed, "closed.npy", repair);
        ASSERT_EQ(0, result.code) << result.err;
        const array closed = read_npy(folder / "closed.npy");
        for_each_sample(16, -3.75, [&](std::size_t i, const glm::dvec3& p) {
            if (std::abs(closed.at<float>(i)) < 0.45F) return; // voxels that the surface touches, which --vote takes
            ASSERT_EQ(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 2, closed.at<float>(i) < 0) << i;
        });
    }
}

// What the first grid of a .nvdb says of itself.
voxelpipe::io::nanovdb::file_entry entry_of(const std::string& file) {
    const std::string bytes = read_file(file);
    voxelpipe::io::nanovdb::file_entry entry{};
    std::memcpy(&entry, bytes.data() + sizeof(voxelpipe::io::nanovdb::file_header), sizeof(entry));
    return entry;
}

TEST(Distance, NvdbIsALevelSetWhereVoxelsAreCubes) {
    using voxelpipe::io::nanovdb::grid_class;
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    const outcome cubes = measure(folder, file, "o.nvdb", {"--stats=json"});
    ASSERT_EQ(0, cubes.code) << cubes.err;
    EXPECT_EQ(grid_class::level_set, entry_of(folder / "o.nvdb").meaning);
    const json stats = json::parse(cubes.out);
    EXPECT_EQ(3, stats["distance"]["band"]);
    EXPECT_EQ("nonzero", stats["distance"]["sign"]);
    EXPECT_EQ("centres", stats["distance"]["samples"]);
    EXPECT_FALSE(stats.contains("coverage"));
    EXPECT_LE(entry_of(folder / "o.nvdb").num_voxels, stats["voxels"].get<std::uint64_t>());
    EXPECT_GT(entry_of(folder / "o.nvdb").num_voxels, stats["voxels"].get<std::uint64_t>() / 2);
    EXPECT_EQ(std::string::npos, cubes.err.find("cut off")) << cubes.err;

    ASSERT_EQ(0, measure(folder, file, "plain.nvdb", {"--unsigned"}).code);
    EXPECT_EQ(grid_class::unknown, entry_of(folder / "plain.nvdb").meaning);
    file.write_glb(folder / "m.glb");
    const outcome bricks = run(folder, {folder / "m.glb", "-o", folder / "long.nvdb", "--distance", "--origin",
                                        "-4,-4,-4", "--voxel-size", "0.5,0.5,1", "--extent", "16,16,8"});
    ASSERT_EQ(0, bricks.code) << bricks.err;
    EXPECT_EQ(grid_class::unknown, entry_of(folder / "long.nvdb").meaning);
    EXPECT_NE(std::string::npos, bricks.err.find("level sets have cubic voxels")) << bricks.err;
    const outcome tight = run(folder, {folder / "m.glb", "-o", folder / "tight.nvdb", "--distance", "-r", "16"});
    ASSERT_EQ(0, tight.code) << tight.err;
    EXPECT_NE(std::string::npos, tight.err.find("--padding")) << tight.err;
}

TEST(Distance, VoxelsOfALevelAreThoseOfAtMostIso) {
    const scratch_folder folder;
    builder file;
    add_box(file, {-2, -2, -2}, {2, 2, 2});
    const auto lines = [&](const std::vector<std::string>& arguments) {
        const outcome result = measure(folder, file, "o.xyz", arguments);
        EXPECT_EQ(0, result.code) << result.err;
        const std::string text = read_file(folder / "o.xyz");
        return std::count(text.begin(), text.end(), '\n');
    };
    EXPECT_EQ(512, lines({}));                         // 8^3 centres
    EXPECT_EQ(512 + 6 * 64, lines({"--iso", "0.25"})); // and the layers a quarter before its faces
    EXPECT_EQ(216, lines({"--iso", "-0.5"}));
    // Beyond the band, of which nothing is known but that.
    EXPECT_EQ(8, lines({"--iso", "-1.5"})); // deeper inside
    for (const auto& [level, band] : {std::pair{"1.5", "4"}, {"2", "5"}, {"-1.75", "4"}}) {
        const outcome refused = measure(folder, file, "o.xyz", {"--iso", level});
        EXPECT_EQ(1, refused.code);
        EXPECT_NE(std::string::npos, refused.err.find(std::string("--iso ") + level +
                                                      " lies beyond the band of 3 voxels, "
                                                      "which is 1.5 wide: --band " +
                                                      band + " or --band whole"))
            << refused.err;
    }
    EXPECT_EQ(0, lines({"--iso", "-2", "--band", "whole"}));
    EXPECT_EQ(0, measure(folder, file, "o.npy", {"--iso", "2"}).code); // shows no level
    ASSERT_EQ(0, measure(folder, file, "o.png", {"--iso", "0.5", "--image-size", "64x48"}).code);
    ASSERT_EQ(0, measure(folder, file, "o.html").code);
}

TEST(Distance, EveryFormatOfValuesHoldsIt) {
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    for (const char* output : {"o.npz", "o.vti", "o.pvti", "o.nrrd", "o.nii.gz", "o.zarr", "o.nvdb"}) {
        const outcome result = measure(folder, file, output, {"-t", "nearest,color"});
        EXPECT_EQ(0, result.code) << output << ": " << result.err;
    }
}

// Files of arrays hold the nearest half floats, and all that lies beside them as it is.
TEST(Distance, HalfFloatsAreTheNearest) {
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    ASSERT_EQ(0, measure(folder, file, "o.npy", {"--band", "whole"}).code);
    const array floats = read_npy(folder / "o.npy");
    const outcome result =
        measure(folder, file, "h.npy",
                {"--band", "whole", "--half", "-o", folder / "h.png", "-o", folder / "h.vti", "--image-size", "64x48"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_EQ(std::string::npos, result.err.find("65504")) << result.err;
    const array halves = read_npy(folder / "h.npy");
    EXPECT_EQ("<f2", halves.type);
    ASSERT_EQ(floats.shape, halves.shape);
    int rounded = 0;
    for (std::size_t i = 0; i < floats.voxels(); ++i) {
        const voxelpipe::half h = voxelpipe::half::from_bits(halves.at<std::uint16_t>(i));
        ASSERT_EQ(voxelpipe::half(floats.at<float>(i)), h) << i;
        rounded += static_cast<float>(h) != floats.at<float>(i) ? 1 : 0;
    }
    EXPECT_LT(100, rounded);
    ASSERT_EQ(
        0, measure(folder, file, "f.vti", {"--band", "whole", "-o", folder / "f.png", "--image-size", "64x48"}).code);
    EXPECT_TRUE(read_file(folder / "f.vti") == read_file(folder / "h.vti"));
    EXPECT_TRUE(read_file(folder / "f.png") == read_file(folder / "h.png"));

    ASSERT_EQ(0, measure(folder, file, "n.npy", {"--half", "-t", "distance,nearest"}).code);
    EXPECT_EQ("<f2", read_npy(folder / "n.distance.npy").type);
    EXPECT_EQ("<i8", read_npy(folder / "n.nearest.npy").type);
    EXPECT_EQ(0, measure(folder, file, "z.zarr", {"--half"}).code);
    EXPECT_NE(std::string::npos, read_file(folder / "z.zarr/distance/zarr.json").find("float16"));

    // A sample that is further away than half floats reach is infinite, and a warning says so.
    const outcome far = run(folder, {folder / "m.glb", "-o", folder / "far.npy", "--distance", "--band", "whole",
                                     "--half", "--origin", "-1000,-1000,-1000", "-s", "1000", "--extent", "100,2,2"});
    ASSERT_EQ(0, far.code) << far.err;
    EXPECT_NE(std::string::npos, far.err.find("distances beyond 65504 are infinite")) << far.err;
    EXPECT_EQ(0x7c00, read_npy(folder / "far.npy").at<std::uint16_t>(99));
    EXPECT_NE(0x7c00, read_npy(folder / "far.npy").at<std::uint16_t>(50));
}

TEST(Distance, NoTriangleIsTheBandAway) {
    const scratch_folder folder;
    builder file;
    json& lines = file.mesh({{"POSITION", file.accessor(std::vector<float>{0, 0, 0, 1, 1, 1}, "VEC3")}});
    lines["mode"] = 1;
    const outcome result = measure(folder, file, "o.npy", {"-t", "distance,nearest"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("no triangle to measure from")) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("have no distances")) << result.err;
    const array field = read_npy(folder / "o.distance.npy"), nearest = read_npy(folder / "o.nearest.npy");
    for (std::size_t i = 0; i < field.voxels(); ++i) {
        ASSERT_EQ(1.5F, field.at<float>(i));
        ASSERT_EQ(-1, nearest.at<std::int64_t>(i));
    }
}

TEST(Distance, WhatDoesNotGoTogetherIsRefused) {
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    file.write_glb(folder / "m.glb");
    const auto refused = [&](std::vector<std::string> arguments, const std::string& why, int code = 1) {
        arguments.insert(arguments.begin(), {folder / "m.glb", "-o", folder / "o.npy", "-r", "8"});
        const outcome result = run(folder, arguments);
        EXPECT_EQ(code, result.code) << why << ": " << result.err;
        EXPECT_NE(std::string::npos, result.err.find(why)) << result.err;
    };
    for (const char* band : {"0", "-1", "inf", "nan", "wide", "3x"})
        refused({"--distance", "--band", band}, "--band takes");
    refused({"--band", "2"}, "--band goes with --distance");
    refused({"--corners"}, "--corners goes with --distance");
    refused({"--unsigned"}, "--unsigned goes with --distance");
    refused({"--iso", "1"}, "--iso goes with --distance");
    refused({"--half"}, "--half goes with --distance");
    refused({"-t", "nearest"}, "nearest goes with --distance");
    refused({"-t", "distance"}, "distance goes with --distance");
    refused({"--distance", "--unsigned", "--solid", "nonzero"}, "--unsigned has no sign");
    refused({"--distance", "--unsigned", "--vote"}, "--unsigned has no sign");
    refused({"--distance", "--unsigned", "--winding"}, "--unsigned has no sign");
    refused({"--distance", "--solid", "even_odd", "--winding"}, "--winding does not go with --solid even_odd");
    refused({"--distance", "--unsigned", "--close-holes"}, "--unsigned has no sign");
    refused({"--distance", "-t", "count"}, "count does not go with --distance");
    refused({"--distance", "--coverage", "thin"}, "--coverage");
    refused({"--distance", "--levels"}, "--levels does not go with --distance");
    refused({"--distance", "--sparse"}, "--sparse does not go with --distance");
    refused({"--distance", "--closing", "2"}, "--closing goes with --solid exterior");
    const outcome pictures = run(folder, {folder / "m.glb", "-o", folder / "o.png", "-r", "8", "--distance", "--half"});
    EXPECT_EQ(1, pictures.code);
    EXPECT_NE(std::string::npos, pictures.err.find(".png has no numbers of 16 bits; .npy, .npz and .zarr have"))
        << pictures.err;
    refused({"--distance", "--backend", "cuda", "--devices", "2"}, "one GPU draws distances", 5);
}

// What shows voxels needs the field whole.
TEST(Distance, AFieldBeyondMemoryIsRefusedWithBothNumbers) {
    const scratch_folder folder;
    builder file;
    add_box(file, low, high);
    file.write_glb(folder / "m.glb");
    for (const char* output : {"o.nvdb", "o.html"}) {
        const outcome result = run(folder, {folder / "m.glb", "-o", folder / output, "--distance", "--band", "whole",
                                            "-r", "1000", "--max-memory", "300"});
        EXPECT_EQ(3, result.code) << result.err;
        EXPECT_NE(std::string::npos, result.err.find("a whole distance field of 875 x 875 x 1000 samples"))
            << result.err;
        EXPECT_NE(std::string::npos, result.err.find("300 MiB")) << result.err;
        EXPECT_FALSE(fs::exists(folder / output));
    }
    // Two slabs of 256 layers do not fit either.
    const outcome slabs =
        run(folder, {folder / "m.glb", "-o", folder / "o.zarr", "--distance", "-r", "4000", "--max-memory", "300"});
    EXPECT_EQ(3, slabs.code) << slabs.err;
    EXPECT_NE(std::string::npos, slabs.err.find("in slabs of 256 layers: ")) << slabs.err;
    EXPECT_FALSE(fs::exists(folder / "o.zarr"));
}

// A large file at once.
std::string bytes_of_file(const fs::path& file) {
    std::string bytes(fs::file_size(file), '\0');
    std::ifstream(file, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return bytes;
}

// The warnings of a run, sorted, without the name of its file: those of slabs come when all are drawn.
std::vector<std::string> warnings_of(const json& stats, const std::string& name) {
    std::vector<std::string> all;
    for (const json& each : stats["warnings"]) {
        all.push_back(each.get<std::string>());
        if (const std::size_t at = all.back().find(name); at != std::string::npos) all.back().erase(at, name.size());
    }
    std::sort(all.begin(), all.end());
    return all;
}

// The bytes of a run that holds the field, and its counts and warnings.
TEST(Distance, AFieldBeyondMemoryIsDrawnInSlabs) {
    if (sanitized) return; // which takes memory of its own
    const scratch_folder folder;
    builder file;
    add_box(file, low, high, 2); // open
    file.write_glb(folder / "m.glb");
    struct way {
        std::string output;
        unsigned layers, bytes; // a sample
        int files;
        std::vector<std::string> more;
    };
    for (const way& w : {way{"npy", 700, 4, 1, {}}, way{"npz", 400, 12, 1, {"--band", "1", "-t", "nearest"}},
                         way{"npz", 700, 4, 1, {"--half"}}, way{"nvdb", 700, 12, 1, {"--band", "2", "-t", "nearest"}},
                         way{"zarr", 1100, 4, 7, {"--close-holes"}}, way{"nii", 500, 16, 2, {"-t", "normal"}}}) {
        const auto draw = [&](const std::string& name, const std::vector<std::string>& limit) {
            std::vector<std::string> all{folder / "m.glb",
                                         "-o",
                                         folder / name + "." + w.output,
                                         "--distance",
                                         "--origin",
                                         "-2,-2,-4",
                                         "-s",
                                         "0.03125",
                                         "--extent",
                                         "100,100," + std::to_string(w.layers),
                                         "--stats=json"};
            all.insert(all.end(), w.more.begin(), w.more.end());
            all.insert(all.end(), limit.begin(), limit.end());
            return run(folder, all);
        };
        const outcome whole = draw("whole", {});
        ASSERT_EQ(0, whole.code) << whole.err;
        const json a = json::parse(whole.out);
        const unsigned field = 100 * 100 * w.layers * w.bytes, peak = a["peak_memory_bytes"],
                       limit = (peak - field / 10 * 3) >> 20;
        const outcome tight = draw("tight", {"--max-memory", std::to_string(limit)});
        ASSERT_EQ(0, tight.code) << w.output << ": " << tight.err;
        const json b = json::parse(tight.out);
        EXPECT_LE(b["peak_memory_bytes"], limit << 20);
        EXPECT_EQ(1, a["slabs"]);
        EXPECT_GT(b["slabs"], 1) << w.output;
        EXPECT_EQ(a["voxels"], b["voxels"]);
        EXPECT_EQ(a["distance"], b["distance"]);
        EXPECT_EQ(warnings_of(a, "whole."), warnings_of(b, "tight."));
        int files = 0;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder.path())) {
            std::string name = fs::relative(entry.path(), folder.path()).string();
            if (!entry.is_regular_file() || !name.starts_with("whole.")) continue;
            ++files;
            EXPECT_TRUE(bytes_of_file(entry.path()) == bytes_of_file(folder / name.replace(0, 5, "tight")))
                << entry.path();
        }
        EXPECT_EQ(w.files, files);
        for (const fs::directory_entry& entry : fs::directory_iterator(folder.path()))
            if (entry.path().filename() != "m.glb") fs::remove_all(entry.path());
    }
}

} // namespace
