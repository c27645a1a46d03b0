// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Models with holes under --solid: what a flood lost, which repairs the warnings name, and that these do as they say;
// grids that hold a part of the model.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

using namespace tool_test;

namespace {

// A sphere of 2048 triangles, without the MISSING ones that lie furthest in a direction between the axes.
void add_open_sphere(builder& file, const glm::vec3& centre, float radius, std::size_t missing) {
    struct face {
        std::array<glm::vec3, 3> corners;
        [[nodiscard]] float height() const {
            const glm::vec3 sum = corners[0] + corners[1] + corners[2];
            return 0.5F * sum.x + 0.6F * sum.y + 0.7F * sum.z;
        }
    };
    const auto unit = [](const glm::vec3& p) { return p / std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z); };
    std::vector<face> faces;
    for (int i = 0; i < 8; ++i) {
        const glm::vec3 x((i & 1) != 0 ? -1 : 1, 0, 0), y(0, (i & 2) != 0 ? -1 : 1, 0), z(0, 0, (i & 4) != 0 ? -1 : 1);
        const bool is_mirrored = ((i ^ i >> 1 ^ i >> 2) & 1) != 0;
        faces.push_back({{x, is_mirrored ? z : y, is_mirrored ? y : z}});
    }
    for (int level = 0; level < 4; ++level) {
        std::vector<face> finer;
        for (const face& f : faces) {
            const auto [a, b, c] = f.corners;
            const glm::vec3 ab = unit(a + b), bc = unit(b + c), ca = unit(c + a);
            finer.insert(finer.end(), {{{a, ab, ca}}, {{ab, b, bc}}, {{ca, bc, c}}, {{ab, bc, ca}}});
        }
        faces = std::move(finer);
    }
    std::sort(faces.begin(), faces.end(), [](const face& a, const face& b) { return a.height() < b.height(); });
    faces.resize(faces.size() - missing);
    std::vector<float> positions;
    for (const face& f : faces)
        for (const glm::vec3& corner : f.corners)
            for (int a = 0; a < 3; ++a) positions.push_back(centre[a] + radius * corner[a]);
    file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
}

struct drawn_sphere {
    outcome result;
    std::size_t voxels = 0;
    json stats;
};

// A sphere of radius 15 in the middle of 36 voxels a side, or of the grid that ARGUMENTS name.
drawn_sphere draw_sphere(const scratch_folder& folder, std::size_t missing, const std::vector<std::string>& arguments,
                         const std::string& out = "o.npy") {
    builder file;
    add_open_sphere(file, {18.1F, 18.2F, 18.3F}, 15, missing);
    file.write_glb(folder / "m.glb");
    std::vector<std::string> all{folder / "m.glb", "-o",   folder / out, "-s", "1", "-q",
                                 "--stats",        "json", "--backend",  "cpu"};
    if (std::find(arguments.begin(), arguments.end(), "--extent") == arguments.end())
        all.insert(all.end(), {"--origin", "0,0,0", "--extent", "36,36,36"});
    all.insert(all.end(), arguments.begin(), arguments.end());
    drawn_sphere d{run(folder, all), 0, {}};
    if (d.result.code != 0) return d;
    d.stats = json::parse(d.result.out);
    d.voxels = d.stats["voxels"].get<std::size_t>();
    for (const json& warning : d.stats["warnings"]) d.result.err += warning.get<std::string>() + '\n';
    return d;
}

std::ptrdiff_t count_lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

// What follows a word, up to the next blank or stop.
std::string word_after(const std::string& text, const std::string& words) {
    const std::size_t at = text.find(words);
    if (at == std::string::npos) return "";
    const std::size_t begin = at + words.size();
    return text.substr(begin, text.find_first_of(" ,;\n", begin) - begin);
}

TEST(Floods, ASphereWithoutFortyFacesSaysWhatItLostAndWhatKeepsIt) {
    const scratch_folder folder;
    const std::size_t whole = draw_sphere(folder, 0, {"--solid", "exterior"}).voxels;
    for (const bool is_sparse : {false, true}) {
        SCOPED_TRACE(is_sparse);
        std::vector<std::string> how{"--solid", "exterior"};
        if (is_sparse) how.emplace_back("--sparse");
        const std::string out = is_sparse ? "o.npz" : "o.npy";
        const drawn_sphere emptied = draw_sphere(folder, 40, how, out);
        ASSERT_EQ(0, emptied.result.code) << emptied.result.err;
        EXPECT_LT(emptied.voxels, whole / 2);
        const std::string& text = emptied.result.err;
        EXPECT_EQ(1, count_lines(text)) << text;
        EXPECT_NE(std::string::npos, text.find("finds nothing enclosed")) << text;
        const json flood = emptied.stats["solid"]["flood"];
        EXPECT_EQ(1, flood["entered_holes"]);
        EXPECT_EQ(0, flood["enclosed_voxels"]);
        EXPECT_EQ(true, flood["tried_close_holes"]);
        EXPECT_LT(whole / 2, flood["lost_voxels"].get<std::size_t>());
        // A cap of 40 faces of 2048 is 8.4 voxels across.
        EXPECT_LE(7, flood["hole_width"].get<int>());
        EXPECT_GE(13, flood["hole_width"].get<int>());
        EXPECT_NE(std::string::npos,
                  text.find("by 1 hole of the model, of up to " + flood["hole_width"].dump() + " voxels"))
            << text;
        EXPECT_NE(std::string::npos, text.find("took " + flood["lost_voxels"].dump() + " voxels")) << text;
        EXPECT_NE(std::string::npos, text.find("--solid nonzero --close-holes")) << text;
        const std::string closing = word_after(text, "--closing ");
        EXPECT_EQ(flood["tried_closing"].dump(), closing);
        // What is named does as it says, and is silent.
        how.insert(how.end(), {"--closing", closing});
        for (const auto& repair : {how, std::vector<std::string>{"--solid", "nonzero", "--close-holes"}}) {
            const drawn_sphere kept = draw_sphere(folder, 40, repair, out);
            EXPECT_EQ("", kept.result.err);
            EXPECT_LT(whole * 9 / 10, kept.voxels);
        }
    }
    const drawn_sphere closed = draw_sphere(folder, 0, {"--solid", "exterior"});
    EXPECT_EQ("", closed.result.err);
    EXPECT_EQ(0, closed.stats["solid"]["flood"]["lost_voxels"]);
}

TEST(Floods, TheWarningOfAnOpenModelNamesWhatWasTriedOnIt) {
    const scratch_folder folder;
    const std::string text = draw_sphere(folder, 40, {"--solid", "nonzero"}).result.err;
    EXPECT_EQ(1, count_lines(text)) << text;
    EXPECT_NE(std::string::npos, text.find("Tried on it: --close-holes leaves no such row, and --solid exterior "
                                           "--closing "))
        << text;
    EXPECT_EQ(std::string::npos, text.find("--vote")) << "it was not tried: " << text;
    const std::string closing = word_after(text, "--solid exterior --closing ");
    EXPECT_EQ("", draw_sphere(folder, 40, {"--solid", "exterior", "--closing", closing}).result.err);
    EXPECT_EQ("", draw_sphere(folder, 40, {"--solid", "nonzero", "--close-holes"}).result.err);
    // Lids on small holes alone.
    const std::string few = draw_sphere(folder, 40, {"--solid", "nonzero", "--close-holes=3"}).result.err;
    EXPECT_NE(std::string::npos, few.find("--close-holes without a number leaves no such row")) << few;
}

TEST(Floods, AGridWithinTheModelIsSaidToBeThatAndAFloodOfItIsRefused) {
    const scratch_folder folder;
    const std::vector<std::string> within{"--origin", "14,14,14", "--extent", "8,8,8"};
    const auto with = [](std::vector<std::string> how, const std::vector<std::string>& more) {
        how.insert(how.end(), more.begin(), more.end());
        return how;
    };
    for (const std::vector<std::string>& storage : {std::vector<std::string>{}, {"--sparse"}}) {
        const std::string out = storage.empty() ? "part.npy" : "part.npz";
        const outcome refused =
            draw_sphere(folder, 0, with(with(within, storage), {"--solid", "exterior"}), out).result;
        EXPECT_EQ(1, refused.code) << refused.err;
        EXPECT_NE(std::string::npos, refused.err.find("the grid lies within the model")) << refused.err;
        EXPECT_NE(std::string::npos, refused.err.find("crop without whole")) << refused.err;
        EXPECT_FALSE(fs::exists(folder / out)) << "nothing is written";
    }
    const outcome surface = draw_sphere(folder, 0, within).result;
    EXPECT_EQ(0, surface.code);
    EXPECT_EQ(std::string::npos, surface.err.find("lies outside the grid")) << surface.err;
    EXPECT_NE(std::string::npos, surface.err.find("which lies within the model's bounds")) << surface.err;
    EXPECT_EQ(512U, draw_sphere(folder, 0, with(within, {"--solid", "nonzero"})).voxels) << "all of it is inside";
    const outcome outside = draw_sphere(folder, 0, {"--origin", "50,50,50", "--extent", "4,4,4"}).result;
    EXPECT_NE(std::string::npos, outside.err.find("the model lies outside the grid")) << outside.err;
    // The corner of the bounds, where nothing is.
    const outcome corner = draw_sphere(folder, 0, {"--origin", "0,0,0", "--extent", "5,5,5"}).result;
    EXPECT_NE(std::string::npos, corner.err.find("which lies across the model's bounds")) << corner.err;
}

TEST(Floods, AModelThatLeavesTheGridIsFloodedThereAndThatIsSaid) {
    const scratch_folder folder;
    const drawn_sphere half =
        draw_sphere(folder, 0, {"--origin", "0,0,0", "--extent", "18,36,36", "--solid", "exterior"});
    ASSERT_EQ(0, half.result.code) << half.result.err;
    EXPECT_NE(std::string::npos, half.result.err.find("where the model leaves the grid")) << half.result.err;
    const json flood = half.stats["solid"]["flood"];
    EXPECT_EQ(flood["lost_voxels"], flood["face_voxels"]);
    EXPECT_LT(4000, flood["face_voxels"].get<int>());
    EXPECT_EQ(0, flood["tried_closing"]);
    // In slabs it is not examined, and still said.
    const outcome slabs =
        draw_sphere(folder, 0, {"--origin", "0,0,0", "--extent", "18,36,36", "--solid", "exterior", "--resume"},
                    "o.zarr")
            .result;
    ASSERT_EQ(0, slabs.code) << slabs.err;
    EXPECT_NE(std::string::npos, slabs.err.find("the model leaves the grid")) << slabs.err;
}

TEST(Floods, VoteRefusesARuleThatItWouldPassOver) {
    const scratch_folder folder;
    const outcome result = draw_sphere(folder, 0, {"--solid", "positive", "--vote"}).result;
    EXPECT_EQ(1, result.code);
    EXPECT_NE(std::string::npos, result.err.find("--vote does not go with --solid positive")) << result.err;
    EXPECT_EQ(0, draw_sphere(folder, 0, {"--solid", "even_odd", "--vote"}).result.code);
}

} // namespace
