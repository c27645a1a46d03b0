// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "../../test_scale.hpp"
#include "test_volumes.hpp"
#include "write/formats/formats.hpp"
#include "write/formats/stl.hpp"
#include "write/formats/voxel_mesh.hpp"

#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Mesh : public in_folder {};

// A grid with nothing in it but the voxels of a box [low, high).
volume make_box(std::array<std::int64_t, 3> extent, std::array<std::int64_t, 3> low, std::array<std::int64_t, 3> high) {
    volume v = make_volume(extent);
    channel& bits = v.add("occupancy", scalar::bit);
    for (std::int64_t k = low[2]; k < high[2]; ++k)
        for (std::int64_t j = low[1]; j < high[1]; ++j)
            for (std::int64_t i = low[0]; i < high[0]; ++i) v.set_bit(bits, i, j, k);
    return v;
}

std::uint64_t area(const std::vector<voxel_face>& faces) {
    std::uint64_t sum = 0;
    for (const voxel_face& f : faces) sum += std::uint64_t{f.size[0]} * f.size[1];
    return sum;
}

} // namespace

TEST_F(Mesh, ABoxHasTheFacesOfItsSides) {
    // Over the border of a word along x, and up to the grid's border on two sides.
    const volume v = make_box({70, 6, 5}, {30, 2, 0}, {70, 5, 4});
    const auto faces = voxel_faces(voxel_shape(v, 1), false, 1, {});
    EXPECT_EQ(faces.size(), 2u * (40 * 3 + 3 * 4 + 40 * 4));
    EXPECT_EQ(area(faces), faces.size());
    const auto merged = voxel_faces(voxel_shape(v, 1), true, 1, {});
    ASSERT_EQ(merged.size(), 6u);
    EXPECT_EQ(area(merged), area(faces));
    using corner = std::array<std::uint32_t, 3>;
    const std::array<corner, 6> lows{corner{30, 2, 0}, corner{70, 2, 0}, corner{30, 2, 0},
                                     corner{30, 5, 0}, corner{30, 2, 0}, corner{30, 2, 4}};
    const std::array<std::array<std::uint32_t, 2>, 6> sizes{{{3, 4}, {3, 4}, {4, 40}, {4, 40}, {40, 3}, {40, 3}}};
    for (std::size_t n = 0; n < 6; ++n) {
        EXPECT_EQ(merged[n].direction, n);
        EXPECT_EQ(merged[n].low, lows[n]) << n;
        EXPECT_EQ(merged[n].size, sizes[n]) << n;
    }
}

TEST_F(Mesh, MergingKeepsColoursApart) {
    volume v = make_box({4, 1, 1}, {0, 0, 0}, {4, 1, 1});
    channel& color = v.add("color", scalar::u8, 4);
    for (std::size_t i = 0; i < 4; ++i) color.data[4 * i] = static_cast<std::byte>(i < 3 ? 7 : 9);
    const auto faces = voxel_faces(voxel_shape(v, 1), true, 1, {});
    EXPECT_EQ(faces.size(), 2u + 4 * 2);
    std::map<std::uint32_t, std::uint64_t> by_color;
    for (const voxel_face& f : faces) by_color[f.rgb] += std::uint64_t{f.size[0]} * f.size[1];
    EXPECT_EQ(by_color, (std::map<std::uint32_t, std::uint64_t>{{7, 1 + 3 * 4}, {9, 1 + 4}}));
}

TEST_F(Mesh, FacesWithoutColoursJoinAcrossThem) {
    volume v = make_box({4, 1, 1}, {0, 0, 0}, {4, 1, 1});
    channel& color = v.add("color", scalar::u8, 4);
    for (std::size_t i = 0; i < 4; ++i) color.data[4 * i] = static_cast<std::byte>(i);
    for (const voxel_face& face : voxel_faces(voxel_shape(v, 1), false, 1, {}, false)) EXPECT_EQ(face.rgb, 0u);
    EXPECT_EQ(voxel_faces(voxel_shape(v, 1), true, 1, {}, false).size(), 6u);
}

TEST_F(Mesh, StlWarnsWhereFloatsJoinItsCorners) {
    volume v = make_box({4, 2, 2}, {0, 0, 0}, {4, 2, 2});
    std::vector<std::string> warnings;
    write_options options;
    options.warn = [&](const std::string& line) { warnings.push_back(line); };
    write(v, folder_ / "near.stl", options);
    EXPECT_TRUE(warnings.empty());
    v.origin = {431234, 4649776, 100};
    v.voxel_size = {0.05, 0.05, 0.05}; // the floats there are 0.5 apart along y
    write(v, folder_ / "far.stl", options);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("far.stl"), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[0].find("floats of .stl"), std::string::npos) << warnings[0];
    write(v, folder_ / "far.ply", options);
    EXPECT_EQ(warnings.size(), 1u);
}

TEST_F(Mesh, StlOfAnyTrianglesHasTheirNormals) {
    const std::array<stl_triangle, 2> triangles{
        {{{{0, 0, 0}, {3, 0, 0}, {0, 0, 4}}}, {{{1, 1, 1}, {2, 2, 2}, {3, 3, 3}}}}};
    const std::function<void(double)> none;
    progress_meter meter(none, 2);
    output_file out(folder_ / "any.stl");
    write_stl_triangles(out, 2, 1, meter, [&](std::size_t n) { return triangles[n]; });
    out.commit();
    std::ifstream file(folder_ / "any.stl", std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    ASSERT_EQ(bytes.size(), 84u + 2 * 50);
    const auto value = [&](std::size_t triangle, std::size_t n) {
        float f = 0;
        std::memcpy(&f, bytes.data() + 84 + 50 * triangle + 4 * n, 4);
        return f;
    };
    const std::array<float, 12> first{0, -1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4};
    for (std::size_t n = 0; n < 12; ++n) EXPECT_EQ(value(0, n), first[n]) << n;
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(value(1, n), 0.0F) << "a triangle without area has no normal";
}

TEST_F(Mesh, CornersAreSharedByEqualColours) {
    volume v = make_box({3, 3, 3}, {0, 0, 0}, {2, 2, 2});
    welded_mesh mesh = weld(voxel_faces(voxel_shape(v, 1), false, 1, {}), v.extent, 1);
    EXPECT_EQ(mesh.vertices.size(), 26u); // of the 27 corners all but the middle
    EXPECT_EQ(mesh.quads.size(), 24u);
    // Closed and the same way around: every edge is used once in each direction.
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& q : mesh.quads)
        for (std::size_t c = 0; c < 4; ++c) EXPECT_TRUE(edges.emplace(q[c], q[(c + 1) % 4]).second);
    for (const auto& [a, b] : edges) EXPECT_TRUE(edges.count({b, a})) << a << ' ' << b;
    // In two colours the corners of the seam are there twice.
    channel& color = v.add("color", scalar::u8, 3);
    for (std::size_t n = 0; n < color.data.size(); n += 3) color.data[n] = static_cast<std::byte>(n / 3 % 3);
    mesh = weld(voxel_faces(voxel_shape(v, 1), false, 1, {}), v.extent, 1);
    EXPECT_EQ(mesh.vertices.size(), 26u + 8);
}

TEST_F(Mesh, ThreadsChangeNothing) {
    const volume v = tests::is_slow_build() ? make_colored({70, 11, 9}, 3) : make_colored({70, 41, 37}, 3);
    for (const bool merge : {false, true}) {
        const auto one = voxel_faces(voxel_shape(v, 1), merge, 1, {});
        EXPECT_TRUE(one == voxel_faces(voxel_shape(v, 1), merge, 5, {}));
        const welded_mesh a = weld(one, v.extent, 1), b = weld(one, v.extent, 5);
        EXPECT_TRUE(a.quads == b.quads);
        EXPECT_EQ(a.vertices.size(), b.vertices.size());
    }
    for (const char* extension : {".glb", ".obj", ".ply", ".xyz"}) {
        write_options options;
        options.threads = 1;
        write(v, folder_ / (std::string("a") + extension), options);
        options.threads = 5;
        write(v, folder_ / (std::string("b") + extension), options);
        EXPECT_TRUE(read_file(folder_ / (std::string("a") + extension)) ==
                    read_file(folder_ / (std::string("b") + extension)))
            << extension;
    }
}

TEST_F(Mesh, TooManyFacesForAFileBecomeSeveralFiles) {
    const volume v = make_box({4, 4, 4}, {0, 0, 0}, {4, 4, 4}); // 96 faces
    write_options options;
    options.faces_per_file = 40;
    for (const std::string extension : {".glb", ".obj", ".ply"}) {
        EXPECT_EQ(
            write(v, folder_ / ("m" + extension), options),
            (std::vector{folder_ / ("m.1" + extension), folder_ / ("m.2" + extension), folder_ / ("m.3" + extension)}));
        EXPECT_FALSE(std::filesystem::exists(folder_ / ("m" + extension)));
    }
    options.faces_per_file = 96;
    EXPECT_EQ(write(v, folder_ / "m.ply", options), std::vector{folder_ / "m.ply"});
    EXPECT_EQ(names().size(), 10u) << "something was left behind";
}

// Lattice positions as decimals that read back to the same doubles.
TEST_F(Mesh, ObjAndXyzHoldExactCoordinates) {
    volume v = make_box({2, 1, 1}, {1, 0, 0}, {2, 1, 1});
    v.origin = {0.1, 4700000.3, -2};
    v.voxel_size = {0.1, 0.3, 3};
    write(v, folder_ / "a.xyz");
    EXPECT_EQ(read_file(folder_ / "a.xyz"), "0.25 4700000.45 -0.5\n");
    write(v, folder_ / "a.obj");
    const std::string obj = read_file(folder_ / "a.obj");
    EXPECT_NE(obj.find("\nv 0.2 4700000.3 -2\n"), std::string::npos) << obj;
    EXPECT_NE(obj.find("\nv 0.30000000000000004 4700000.6 1\n"), std::string::npos) << obj;
    EXPECT_EQ(std::count(obj.begin(), obj.end(), 'f'), 6);
}

TEST_F(Mesh, FormatsWithOneVoxelSizeRefuseSeveral) {
    volume v = make_occupancy({4, 4, 4});
    v.voxel_size = {1, 1, 2};
    for (const std::string extension : {".vox", ".schem", ".binvox"}) {
        try {
            write(v, folder_ / ("a" + extension));
            ADD_FAILURE() << extension << " was written";
        } catch (const write_error& error) {
            EXPECT_NE(std::string(error.what())
                          .find(extension + " has one voxel size for all axes, but this grid's are "
                                            "1, 1 and 2"),
                      std::string::npos)
                << error.what();
        }
    }
    EXPECT_TRUE(names().empty());
    v.voxel_size = {1, 1 + 1e-12, 1};
    EXPECT_NO_THROW(write(v, folder_ / "a.vox"));
}
