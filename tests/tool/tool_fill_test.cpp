// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --fill: which colour and material the voxels inside a solid get that no triangle touches.
#include "draw/body_colors.hpp"
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

// A box of one colour.
struct filled_box {
    glm::ivec3 low, high;
    bool inward = false;
    glm::u8vec3 color{}; // of bytes 0 and 255
    int skipped = 0;     // of its 12 triangles, from the last on: the side at -x, then that at +x

    [[nodiscard]] int winding(const glm::dvec3& p) const {
        for (int a = 0; a < 3; ++a)
            if (p[a] < low[a] || p[a] > high[a]) return 0;
        return inward ? -1 : 1;
    }
    // True if the closed voxel meets the surface.
    [[nodiscard]] bool touches(const glm::ivec3& voxel) const {
        bool is_within = true;
        for (int a = 0; a < 3; ++a) {
            if (voxel[a] > high[a] || voxel[a] + 1 < low[a]) return false;
            is_within = is_within && voxel[a] > low[a] && voxel[a] + 1 < high[a];
        }
        return !is_within;
    }
};

std::vector<float> corners_of(const filled_box& box) {
    std::vector<float> positions;
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis)
            positions.push_back(static_cast<float>((corner >> axis & 1) != 0 ? box.high[axis] : box.low[axis]));
    return positions;
}

std::vector<std::uint32_t> triangles_of(const filled_box& box) {
    std::vector<std::uint32_t> indices{0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1,
                                       4, 5, 7, 4, 7, 6, 1, 3, 7, 1, 7, 5, 0, 4, 6, 0, 6, 2};
    if (box.inward)
        for (std::size_t t = 0; t < indices.size(); t += 3) std::swap(indices[t + 1], indices[t + 2]);
    indices.resize(indices.size() - 3 * static_cast<std::size_t>(box.skipped));
    return indices;
}

void write_boxes(const std::string& path, const std::vector<filled_box>& boxes) {
    builder file;
    for (const filled_box& box : boxes) {
        const int material =
            gltf_test::add_material(file, {box.color.r / 255.0, box.color.g / 255.0, box.color.b / 255.0, 1.0});
        const int indices = file.accessor(triangles_of(box), "SCALAR");
        json& primitive = file.mesh({{"POSITION", file.accessor(corners_of(box), "VEC3")}});
        primitive["indices"] = indices;
        primitive["material"] = material;
    }
    file.write_glb(path);
}

struct filled {
    array occupancy, color, material;
    [[nodiscard]] std::size_t number(const glm::ivec3& voxel) const {
        return (static_cast<std::size_t>(voxel.z) * occupancy.shape[1] + static_cast<std::size_t>(voxel.y)) *
                   occupancy.shape[2] +
               static_cast<std::size_t>(voxel.x);
    }
    [[nodiscard]] glm::u8vec4 color_at(const glm::ivec3& v) const { return color.at<glm::u8vec4>(number(v)); }
    [[nodiscard]] int material_at(const glm::ivec3& v) const { return material.at<std::int32_t>(number(v)); }
};

// Draws in voxels of 1 from the origin on, densely and into bricks, which give the same bytes.
filled fill(const scratch_folder& folder, const std::string& model, const std::string& extent,
            const std::vector<std::string>& how, bool with_bricks = true) {
    std::vector<std::string> all{model,       "-q",       "-s",   "1",  "--origin",
                                 "0,0,0",     "--extent", extent, "-t", "occupancy,color,material",
                                 "--backend", "cpu"};
    all.insert(all.end(), how.begin(), how.end());
    const auto draw = [&](const std::string& out, const char* storage) {
        std::vector<std::string> arguments = all;
        arguments.insert(arguments.end(), {"-o", folder / out, storage});
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
    };
    draw("o.npy", "--dense");
    if (with_bricks) {
        draw("d.vti", "--dense");
        draw("s.vti", "--sparse");
        EXPECT_TRUE(read_file(folder / "d.vti") == read_file(folder / "s.vti"));
    }
    const auto read = [&](const char* name) { return read_npy(folder / (std::string("o.") + name + ".npy")); };
    return {read("occupancy"), read("color"), read("material")};
}

bool is_inside(const std::string& rule, const std::vector<filled_box>& boxes, const glm::dvec3& p) {
    int sum = 0, crossings = 0;
    for (const filled_box& box : boxes) {
        sum += box.winding(p);
        crossings += std::abs(box.winding(p));
    }
    if (rule == "each_draw") return crossings != 0;
    return rule == "even_odd" ? crossings % 2 != 0 : rule == "positive" ? sum > 0 : sum != 0;
}

TEST(Fill, BodyIsTheFirstDrawWhoseOwnWindingAcceptsTheVoxel) {
    const scratch_folder folder;
    const std::vector<filled_box> boxes{{{10, 2, 2}, {22, 20, 20}, true, {255, 0, 0}},
                                        {{0, 0, 0}, {16, 22, 22}, false, {0, 255, 0}},
                                        {{3, 4, 1}, {30, 18, 19}, false, {0, 0, 255}}};
    write_boxes(folder / "m.glb", boxes);
    for (const std::string rule : {"nonzero", "even_odd", "positive", "each_draw"}) {
        SCOPED_TRACE(rule);
        const filled voxels = fill(folder, folder / "m.glb", "32,24,24", {"--solid", rule});
        std::array<int, 3> counts{};
        for (int z = 0; z < 24; ++z)
            for (int y = 0; y < 24; ++y)
                for (int x = 0; x < 32; ++x) {
                    const glm::ivec3 at(x, y, z);
                    bool is_touched = false;
                    for (const filled_box& box : boxes) is_touched = is_touched || box.touches(at);
                    if (is_touched) continue;
                    const glm::dvec3 centre = glm::dvec3(at) + 0.5;
                    if (!is_inside(rule, boxes, centre)) {
                        ASSERT_EQ(0, voxels.color_at(at).a);
                        ASSERT_EQ(-1, voxels.material_at(at));
                        continue;
                    }
                    std::size_t body = 0;
                    while (rule == "positive" ? boxes[body].winding(centre) <= 0 : boxes[body].winding(centre) == 0)
                        ++body;
                    ++counts[body];
                    ASSERT_EQ(static_cast<int>(body), voxels.material_at(at)) << x << ' ' << y << ' ' << z;
                    ASSERT_EQ(glm::u8vec4(boxes[body].color, 255), voxels.color_at(at)) << x << ' ' << y << ' ' << z;
                }
        EXPECT_EQ(rule == "positive", counts[0] == 0);
        EXPECT_LT(100, counts[1]);
        EXPECT_LT(100, counts[2]);
    }
}

// Small bodies all over the grid and beyond it, whose boxes do not meet. One lacks its side at -x, so all voxels behind
// it along +x are its own.
TEST(Fill, SmallBodiesAreFoundWhereTheyLie) {
    const scratch_folder folder;
    constexpr int side = 28, step = 8;
    std::vector<filled_box> boxes;
    for (int z = -5; z < side; z += step)
        for (int y = -5; y < side; y += step)
            for (int x = -5; x < side; x += step)
                boxes.push_back({{x, y, z}, {x + 6, y + 6, z + 6}, boxes.size() % 2 != 0});
    filled_box& open = boxes[5 * 5 * 2 + 5 * 2 + 2]; // in the middle, of five along each axis
    open.skipped = 2;
    write_boxes(folder / "m.glb", boxes);
    const filled voxels = fill(folder, folder / "m.glb", "28,28,28", {"--solid", "nonzero"});
    std::size_t inside = 0, behind = 0;
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const glm::ivec3 at(x, y, z);
                const glm::dvec3 centre = glm::dvec3(at) + 0.5;
                int body = -1;
                bool is_touched = false;
                for (std::size_t b = 0; b < boxes.size(); ++b) {
                    is_touched = is_touched || boxes[b].touches(at);
                    filled_box reach = boxes[b];
                    if (&boxes[b] == &open) {
                        reach.low.x = open.high.x;
                        reach.high.x = side;
                    }
                    if (body < 0 && reach.winding(centre) != 0) body = static_cast<int>(b);
                }
                if (is_touched) continue;
                ASSERT_EQ(body, voxels.material_at(at)) << x << ' ' << y << ' ' << z;
                if (body < 0) continue;
                ++inside;
                if (&boxes[static_cast<std::size_t>(body)] == &open) ++behind;
            }
    EXPECT_LT(1000U, inside);
    EXPECT_LT(30U, behind);
}

// Two cubes in one list of faces, of which each names vertices of its own: the one with the first vertex comes last.
TEST(Fill, AModelOfOneDrawHasItsConnectedParts) {
    const scratch_folder folder;
    const std::vector<filled_box> boxes{{{6, 0, 0}, {18, 12, 12}, false, {0, 255, 0}},
                                        {{0, 1, 1}, {12, 11, 11}, false, {255, 0, 0}}};
    std::string vertices;
    std::vector<std::string> faces;
    int count = 0;
    for (const filled_box& box : boxes) {
        const std::vector<float> corners = corners_of(box);
        std::string of_box;
        const std::vector<std::uint32_t> indices = triangles_of(box);
        for (std::size_t i = 0; i < indices.size(); ++i) {
            for (std::size_t a = 0; a < 3; ++a) vertices += std::to_string(corners[3 * indices[i] + a]) + ' ';
            vertices += std::to_string(box.color.r) + ' ' + std::to_string(box.color.g) + " 0\n";
            if (i % 3 == 0) of_box += "3";
            of_box += ' ' + std::to_string(count++) + (i % 3 == 2 ? "\n" : "");
        }
        faces.insert(faces.begin(), of_box);
    }
    std::ofstream(folder / "m.ply") << "ply\nformat ascii 1.0\nelement vertex " << count
                                    << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
                                       "red\nproperty uchar green\nproperty uchar blue\nelement face "
                                    << count / 3 << "\nproperty list uchar int vertex_indices\nend_header\n"
                                    << vertices << faces[0] << faces[1];
    const filled voxels = fill(folder, folder / "m.ply", "20,16,16", {"--solid", "nonzero"});
    EXPECT_EQ(glm::u8vec4(255, 0, 0, 255), voxels.color_at({3, 5, 5}));
    EXPECT_EQ(glm::u8vec4(0, 255, 0, 255), voxels.color_at({9, 5, 5})); // both accept it
    EXPECT_EQ(glm::u8vec4(0, 255, 0, 255), voxels.color_at({15, 5, 5}));
    EXPECT_EQ(0, voxels.material_at({9, 5, 5}));
    // Counts of one draw are 1, also in tiles that are cut where its parts meet.
    for (const std::string storage : {"dense", "sparse"}) {
        const outcome result =
            run(folder, {folder / "m.ply", "-q", "-r", "64", "--backend", "cpu", "--solid", "each_draw", "-t",
                         "count,color", "--" + storage, "-o", folder / (storage + ".vti")});
        EXPECT_EQ(0, result.code) << result.err;
    }
    EXPECT_TRUE(read_file(folder / "dense.vti") == read_file(folder / "sparse.vti"));
}

// The red box lacks its side at -x, so rows along x have nothing of it before they are in it; lids on the holes of each
// body tell what is whose. Between the plates is nobody's inside, which the flood does not reach.
TEST(Fill, RepairsMayLeaveVoxelsToNoBody) {
    const scratch_folder folder;
    const std::vector<filled_box> open{{{1, 1, 1}, {11, 11, 11}, false, {255, 0, 0}, 2},
                                       {{13, 1, 1}, {23, 11, 11}, false, {0, 0, 255}}};
    write_boxes(folder / "m.glb", open);
    const glm::ivec3 red(5, 5, 5), blue(18, 5, 5);
    for (const std::vector<std::string>& repair :
         std::vector<std::vector<std::string>>{{"--close-holes"}, {"--vote"}}) {
        std::vector<std::string> how{"--solid", "nonzero"};
        how.insert(how.end(), repair.begin(), repair.end());
        const filled voxels = fill(folder, folder / "m.glb", "24,12,12", how);
        EXPECT_EQ(glm::u8vec4(255, 0, 0, 255), voxels.color_at(red));
        EXPECT_EQ(0, voxels.material_at(red));
        EXPECT_EQ(glm::u8vec4(0, 0, 255, 255), voxels.color_at(blue));
        EXPECT_EQ(1, voxels.material_at(blue));
        how.insert(how.end(), {"--fill", "mean"});
        EXPECT_EQ(-1, fill(folder, folder / "m.glb", "24,12,12", how).material_at(blue));
    }
    // Six plates of a thickness of 0 around a room, each a draw.
    std::vector<filled_box> plates;
    for (int axis = 0; axis < 3; ++axis)
        for (const int at : {1, 15}) {
            filled_box plate{{1, 1, 1}, {15, 15, 15}, false, plates.empty() ? glm::u8vec3(255, 0, 0) : glm::u8vec3(0)};
            plate.low[axis] = plate.high[axis] = at;
            plates.push_back(plate);
        }
    write_boxes(folder / "m.glb", plates);
    const filled room = fill(folder, folder / "m.glb", "16,16,16", {"--solid", "exterior"});
    const filled mean = fill(folder, folder / "m.glb", "16,16,16", {"--solid", "exterior", "--fill", "mean"});
    EXPECT_EQ(-1, room.material_at({8, 8, 8}));
    EXPECT_EQ(mean.color_at({8, 8, 8}), room.color_at({8, 8, 8}));
    EXPECT_EQ(255, room.color_at({8, 8, 8}).a);
}

// Bodies that meet within bricks and along their sides: the same files from a grid at once, in slabs of a run with
// little memory, and from processes that share it.
TEST(Fill, BodiesAreTheSameInSlabs) {
    const scratch_folder folder;
    write_boxes(folder / "m.glb", {{{0, 0, 0}, {32, 64, 75}, false, {255, 0, 0}},
                                   {{16, 8, 8}, {64, 56, 72}, false, {0, 255, 0}},
                                   {{5, 5, 60}, {61, 61, 95}, true, {0, 0, 255}},
                                   {{32, 0, 0}, {64, 32, 32}, false, {255, 0, 0}}});
    const std::vector<std::vector<std::string>> rules{{"nonzero"}, {"exterior", "--padding", "3"}};
    for (const std::vector<std::string>& rule : rules) {
        SCOPED_TRACE(rule.front() + std::to_string(rule.size()));
        const auto draw = [&](const std::string& out, const std::vector<std::string>& more) {
            std::vector<std::string> arguments{folder / "m.glb", "-q",       "-s", "1",          "-j",     "2", "-t",
                                               "color,material", "--sparse", "-o", folder / out, "--solid"};
            arguments.insert(arguments.end(), rule.begin(), rule.end());
            arguments.insert(arguments.end(), more.begin(), more.end());
            const outcome result = run(folder, arguments);
            EXPECT_EQ(0, result.code) << result.err;
        };
        draw("whole.nvdb", {});
        draw("little.nvdb", {"--work-memory", "1"});
        EXPECT_TRUE(read_file(folder / "whole.nvdb") == read_file(folder / "little.nvdb"));
        fs::create_directories(folder.path() / "a");
        fs::create_directories(folder.path() / "b");
        draw("a/m.pvti", {"--pieces", "3"});
        draw("b/m.pvti", {"--pieces", "3", "--world-size", "2", "--rank", "1"});
        draw("b/m.pvti", {"--pieces", "3", "--world-size", "2", "--rank", "0"});
        for (const char* const name : {"m.pvti", "m.1.vti", "m.2.vti", "m.3.vti"})
            EXPECT_TRUE(read_file(folder.path() / "a" / name) == read_file(folder.path() / "b" / name)) << name;
        fs::remove_all(folder.path() / "a");
        fs::remove_all(folder.path() / "b");
    }
}

// A box whose six sides have a material each.
TEST(Fill, NearestTakesTheNearestTriangle) {
    const scratch_folder folder;
    builder file;
    constexpr int side = 13;
    const filled_box box{{1, 1, 1}, {1 + side, 1 + side, 1 + side}, false, {}};
    const std::vector<std::uint32_t> all = triangles_of(box);
    const std::array<glm::ivec2, 6> planes{{{1, 0}, {1, 1}, {2, 0}, {2, 1}, {0, 1}, {0, 0}}}; // axis, whether high
    const std::array<glm::u8vec3, 6> colors{
        {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {255, 255, 0}, {255, 0, 255}, {0, 255, 255}}};
    for (std::size_t s = 0; s < 6; ++s) {
        const int material =
            gltf_test::add_material(file, {colors[s].r / 255.0, colors[s].g / 255.0, colors[s].b / 255.0, 1.0});
        const auto first = all.begin() + static_cast<std::ptrdiff_t>(6 * s);
        const int indices = file.accessor(std::vector<std::uint32_t>(first, first + 6), "SCALAR");
        json& primitive = file.mesh({{"POSITION", file.accessor(corners_of(box), "VEC3")}});
        primitive["indices"] = indices;
        primitive["material"] = material;
    }
    file.write_glb(folder / "m.glb");
    for (const char* const memory : {"1", "0"}) {
        std::vector<std::string> how{"--solid", "nonzero", "--fill", "nearest"};
        if (memory[0] == '1') how.insert(how.end(), {"--work-memory", "1"});
        const filled voxels = fill(folder, folder / "m.glb", "15,15,15", how, false);
        for (int z = 2; z < side; ++z)
            for (int y = 2; y < side; ++y)
                for (int x = 2; x < side; ++x) {
                    const glm::dvec3 centre(x + 0.5, y + 0.5, z + 0.5);
                    std::size_t nearest = 0;
                    double least = 1e9;
                    for (std::size_t s = 0; s < 6; ++s) {
                        const int axis = planes[s].x;
                        const double distance =
                            std::abs(centre[axis] - (planes[s].y != 0 ? box.high[axis] : box.low[axis]));
                        if (distance < least) nearest = s;
                        least = std::min(least, distance);
                    }
                    ASSERT_EQ(static_cast<int>(nearest), voxels.material_at({x, y, z}));
                    ASSERT_EQ(glm::u8vec4(colors[nearest], 255), voxels.color_at({x, y, z}));
                }
    }
    const auto expect = [&](int code, const std::vector<std::string>& more, const std::string& why) {
        std::vector<std::string> arguments{folder / "m.glb", "-s", "1", "--solid", "nonzero", "--fill", "nearest"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(code, result.code);
        EXPECT_NE(std::string::npos, result.err.find(why)) << result.err;
    };
    expect(1, {"-o", folder / "o.npy", "--sparse"}, "--fill nearest does not go with --sparse");
    expect(1, {"-o", folder / "o.zarr", "--resume"}, "--fill nearest is one piece of work");
    expect(5, {"-o", folder / "o.npy", "--backend", "cuda"}, "--fill nearest is drawn on the CPU alone");
}

// ---- The colour of a body -------------------------------------------------------------------------------------------

voxelize::primitive triangles(const std::vector<glm::vec3>& positions) {
    voxelize::primitive made;
    made.positions = positions;
    for (std::uint32_t i = 0; i + 3 <= positions.size(); i += 3) made.triangles.emplace_back(i, i + 1, i + 2);
    return made;
}

std::uint8_t srgb_byte(double linear) {
    return static_cast<std::uint8_t>(
        std::lround(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
}

TEST(BodyColors, AreMeansByAreaAndAlpha) {
    voxelize::scene model;
    model.materials.resize(1);
    model.primitives.push_back(triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {3, 0, 0}, {0, 1, 0}}));
    model.primitives[0].colors = {{1, 0, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, 1}, {0, 1, 0, 1}, {0, 1, 0, 1}, {0, 1, 0, 1}};
    voxelize::voxelize_request request;
    EXPECT_EQ((voxelize::body_color{srgb_byte(0.25), srgb_byte(0.75), 0, 255}), colors_of(model, request).at(0));
    // A triangle of which a third of the light gets through counts a third.
    model.materials[0].alpha = voxelize::alpha_mode::blend;
    for (std::size_t v = 3; v < 6; ++v) model.primitives[0].colors[v].a = 1.0F / 3;
    EXPECT_EQ((voxelize::body_color{srgb_byte(0.5), srgb_byte(0.5), 0, 255}), colors_of(model, request).at(0));
    // A mask cuts it off.
    model.materials[0].alpha = voxelize::alpha_mode::mask;
    EXPECT_EQ((voxelize::body_color{255, 0, 0, 255}), colors_of(model, request).at(0));
    model.materials[0].base_color = {0.5F, 1, 1, 1};
    EXPECT_EQ((voxelize::body_color{srgb_byte(0.5), 0, 0, 255}), colors_of(model, request).at(0));
}

TEST(BodyColors, TexturesCountOverTheTriangle) {
    voxelize::scene model;
    model.images.resize(1);
    model.images[0].width = model.images[0].height = 2;
    model.images[0].rgba = {255, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 0, 255};
    model.textures.resize(1);
    model.materials.resize(1);
    model.materials[0].texture = 0;
    model.primitives.push_back(triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    model.primitives[0].texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    voxelize::voxelize_request request;
    const voxelize::body_color half = colors_of(model, request).at(0);
    EXPECT_NEAR(srgb_byte(0.5), half[0], 1);
    EXPECT_EQ(0, half[1]);
    // All corners at one texel, as models with a palette have it: its colour.
    for (glm::vec2& uv : model.primitives[0].texcoords) uv = {0.25F, 0.25F};
    EXPECT_EQ((voxelize::body_color{255, 0, 0, 255}), colors_of(model, request).at(0));
}

TEST(BodyColors, ConnectedPartsShareThePlacesOfVertices) {
    const float none = std::nanf("");
    const std::vector<voxelize::primitive> parts = voxelize::connected_parts(triangles({{9, 0, 0},
                                                                                        {8, 0, 0},
                                                                                        {8, 1, 0},
                                                                                        {0, 0, 0},
                                                                                        {1, 0, 0},
                                                                                        {0, 1, 0},
                                                                                        {none, 0, 0},
                                                                                        {8, 1, 0},
                                                                                        {0, 1, 0},
                                                                                        {-0.0F, 0, 0},
                                                                                        {7, 7, 7},
                                                                                        {6, 6, 6},
                                                                                        {5, 5, 5},
                                                                                        {5, 4, 5},
                                                                                        {5, 4, 4},
                                                                                        {8, 1, 0},
                                                                                        {8, 2, 0},
                                                                                        {8, 2, 2}}));
    ASSERT_EQ(3U, parts.size());
    EXPECT_EQ(2U, parts[0].triangles.size()); // of the first vertex, and the last triangle
    EXPECT_EQ(2U, parts[1].triangles.size());
    EXPECT_EQ(1U, parts[2].triangles.size());
    EXPECT_EQ(glm::vec3(9, 0, 0), parts[0].positions.at(parts[0].triangles[0].x));
    EXPECT_EQ(glm::vec3(8, 2, 2), parts[0].positions.at(parts[0].triangles[1].z));
    EXPECT_EQ(6U, parts[0].positions.size());
    EXPECT_EQ(glm::vec3(5, 5, 5), parts[2].positions.at(0));
}

} // namespace
