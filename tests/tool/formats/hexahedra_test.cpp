// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// .vtu, .inp and .msh: what read_back.py does not see. It compares whole meshes with what other people's readers find.

#include "test_volumes.hpp"
#include "write/formats/cell_sets.hpp"
#include "write/formats/formats.hpp"
#include "write/formats/hexahedra.hpp"
#include "write/sparse_formats.hpp"

#include <map>
#include <set>
#include <sstream>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

const std::vector<std::string> all_extensions{".vtu", ".inp", ".msh"};

using number_list = std::vector<std::uint64_t>;
using corner_list = std::vector<std::array<std::uint64_t, 8>>;

struct whole_mesh {
    std::vector<std::array<std::size_t, 3>> nodes;
    corner_list cells;
    std::vector<glm::ivec3> voxels;

    explicit whole_mesh(const hexahedra& mesh) {
        for (std::size_t part = 0; part < mesh.num_parts(); ++part) {
            mesh.for_each_node(part, [&](std::size_t x, std::size_t y, std::size_t z) { nodes.push_back({x, y, z}); });
            mesh.for_each_cell(part, [&](std::uint64_t number, const std::array<std::uint64_t, 8>& corners) {
                EXPECT_EQ(number, cells.size());
                cells.push_back(corners);
            });
            mesh.for_each_voxel(part, [&](std::uint64_t number, std::size_t, const glm::ivec3& voxel) {
                EXPECT_EQ(number, voxels.size());
                voxels.push_back(voxel);
            });
        }
        EXPECT_EQ(mesh.num_nodes(), nodes.size());
        EXPECT_EQ(mesh.num_cells(), cells.size());
        EXPECT_EQ(voxels.size(), cells.size());
    }
};

volume with_voxels(std::array<std::int64_t, 3> extent, const std::vector<std::array<std::int64_t, 3>>& voxels) {
    volume v = make_volume(extent);
    v.add("occupancy", scalar::bit);
    for (const auto& [x, y, z] : voxels) v.set_bit(v.channels[0], x, y, z);
    return v;
}

class Hexahedra : public in_folder {
protected:
    std::string written(const volume& v, const std::string& name, const write_options& options = {}) {
        EXPECT_EQ(1U, write(v, folder_ / name, options).size());
        return read_file(folder_ / name);
    }
    std::string refusal(const volume& v, const std::string& name, const write_options& options) {
        try {
            write(v, folder_ / name, options);
        } catch (const write_error& error) {
            return error.what();
        }
        return "";
    }
};

TEST_F(Hexahedra, OneVoxelHasTheCornersOfVtk) {
    const volume v = with_voxels({70, 3, 3}, {{64, 1, 2}});
    const voxel_shape shape(v, 1);
    const whole_mesh mesh(hexahedra(shape, 1));
    ASSERT_EQ(8U, mesh.nodes.size());
    for (std::size_t n = 0; n < 8; ++n)
        EXPECT_EQ((std::array<std::size_t, 3>{64 + n % 2, 1 + n / 2 % 2, 2 + n / 4}), mesh.nodes[n]);
    EXPECT_EQ((corner_list{{0, 1, 3, 2, 4, 5, 7, 6}}), mesh.cells);
}

TEST_F(Hexahedra, VoxelsThatShareAnEdgeShareItsNodes) {
    const volume v = with_voxels({8, 9, 2}, {{3, 7, 0}, {4, 8, 0}}); // of two bricks
    const voxel_shape shape(v, 1);
    const whole_mesh mesh(hexahedra(shape, 1));
    EXPECT_EQ(14U, mesh.nodes.size());
    ASSERT_EQ(2U, mesh.cells.size());
    EXPECT_EQ(mesh.cells[0][2], mesh.cells[1][0]);
    EXPECT_EQ(mesh.cells[0][6], mesh.cells[1][4]);
}

TEST_F(Hexahedra, NothingHasNoNodes) {
    const volume v = with_voxels({5, 4, 3}, {});
    const voxel_shape shape(v, 1);
    EXPECT_EQ(0U, hexahedra(shape, 1).num_nodes());
    EXPECT_EQ(0U, hexahedra(shape, 1).num_parts());
    EXPECT_NE(std::string::npos, written(v, "a.vtu").find("NumberOfPoints=\"0\" NumberOfCells=\"0\""));
    EXPECT_EQ("*HEADING\nmade by voxelize\n*NODE, NSET=NODES\n", written(v, "a.inp"));
    EXPECT_NE(std::string::npos, written(v, "a.msh").find("$PhysicalNames\n0\n"));
}

// Many parts, of a block with a rough skin, against the plain definition.
TEST_F(Hexahedra, NodesAndSidesAreThoseOfTheDefinition) {
    volume v = make_volume({1400, 30, 4});
    v.add("occupancy", scalar::bit);
    const auto is_in = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        if (x < 0 || y < 9 || z < 1 || x >= 1400 || y >= 30 || z >= 4) return false;
        return (y < 26 && z < 3) || pattern(x, y, z, 0, 0) % 3 == 0;
    };
    for (std::int64_t z = 0; z < 4; ++z)
        for (std::int64_t y = 0; y < 30; ++y)
            for (std::int64_t x = 0; x < 1400; ++x) v.set_bit(v.channels[0], x, y, z, is_in(x, y, z));
    const voxel_shape shape(v, 2);
    const hexahedra mesh(shape, 2);
    EXPECT_EQ(15U, mesh.num_parts());
    const whole_mesh all(mesh);
    std::vector<std::array<std::size_t, 3>> nodes;
    std::vector<glm::ivec3> voxels;
    for (std::int64_t z = 0; z <= 4; ++z)
        for (std::int64_t y = 0; y <= 30; ++y)
            for (std::int64_t x = 0; x <= 1400; ++x) {
                if (is_in(x, y, z)) voxels.emplace_back(x, y, z);
                bool is_node = false;
                for (int n = 0; n < 8; ++n) is_node = is_node || is_in(x - n % 2, y - n / 2 % 2, z - n / 4);
                if (is_node)
                    nodes.push_back(
                        {static_cast<std::size_t>(x), static_cast<std::size_t>(y), static_cast<std::size_t>(z)});
            }
    EXPECT_TRUE(nodes == all.nodes);
    ASSERT_TRUE(voxels == all.voxels);
    for (std::size_t n = 0; n < voxels.size(); ++n)
        for (std::size_t c = 0; c < 8; ++c) {
            const std::array<std::size_t, 3>& at = all.nodes[all.cells[n][c]];
            ASSERT_TRUE(at[0] == static_cast<std::size_t>(voxels[n].x) + ((c + 1) / 2 % 2) &&
                        at[1] == static_cast<std::size_t>(voxels[n].y) + c / 2 % 2 &&
                        at[2] == static_cast<std::size_t>(voxels[n].z) + c / 4)
                << n << ' ' << c;
        }
    for (unsigned d = 0; d < 6; ++d) {
        number_list cells, side_nodes, expected_cells;
        std::vector<bool> is_of_side(nodes.size());
        for (std::size_t part = 0; part < mesh.num_parts(); ++part) {
            for (const std::uint64_t n : mesh.cells_at_side(part, d)) cells.push_back(n);
            for (const std::uint64_t n : mesh.nodes_at_side(part, d)) side_nodes.push_back(n);
        }
        for (std::size_t n = 0; n < voxels.size(); ++n) {
            glm::ivec3 beside = voxels[n];
            const auto axis = static_cast<int>(d / 2);
            beside[axis] += d % 2 != 0 ? 1 : -1;
            if (is_in(beside.x, beside.y, beside.z)) continue;
            expected_cells.push_back(n);
            for (const std::uint64_t corner : all.cells[n])
                if (static_cast<int>(nodes[corner][d / 2]) == voxels[n][axis] + static_cast<int>(d % 2))
                    is_of_side[corner] = true;
        }
        number_list expected_nodes;
        for (std::size_t n = 0; n < nodes.size(); ++n)
            if (is_of_side[n]) expected_nodes.push_back(n);
        EXPECT_TRUE(expected_cells == cells) << d;
        EXPECT_TRUE(expected_nodes == side_nodes) << d;
    }
}

// The sides at which sets of cells end, with their nodes, over parts of several planes and rows.
TEST_F(Hexahedra, SidesOfMaterialsAreThoseOfTheDefinition) {
    volume v = make_volume({300, 30, 4});
    v.add("occupancy", scalar::bit);
    v.add("material", scalar::i32);
    constexpr int nothing = -2;
    const auto number = [](std::int64_t x, std::int64_t y, std::int64_t z) { // of a material, -1 for none
        if (x < 0 || y < 5 || z < 0 || x >= 300 || y >= 30 || z >= 4) return nothing;
        if (x == 17 && y == 15 && z == 1)
            return 9; // the last row of its part: the next one has nodes of it, and no sides
        if (pattern(x, y, z, 0, 0) % 16 == 0) return nothing;
        return pattern(x / 5, y / 7, z / 2, 1, 0) % 3 == 0 ? static_cast<int>(x / 64 % 4) - 1 : 7;
    };
    for (std::int64_t z = 0; z < 4; ++z)
        for (std::int64_t y = 0; y < 30; ++y)
            for (std::int64_t x = 0; x < 300; ++x) {
                v.set_bit(v.channels[0], x, y, z, number(x, y, z) != nothing);
                store(v.channels[1].data.data() + 4 * v.index(x, y, z), static_cast<std::int32_t>(number(x, y, z)));
            }
    const voxel_shape shape(v, 2);
    const hexahedra mesh(shape, 2);
    ASSERT_LT(10U, mesh.num_parts());
    const cell_sets sets(mesh, 2);
    const side_sets sides(sets, 2);
    const whole_mesh all(mesh);
    using cell_and_direction = std::pair<std::uint64_t, unsigned>;
    std::map<std::string, std::vector<cell_and_direction>> expected;
    std::map<std::string, std::set<std::uint64_t>> expected_nodes;
    const auto name = [](int of) { return of < 0 ? "NO_MATERIAL" : "MATERIAL_" + std::to_string(of); };
    for (std::size_t n = 0; n < all.voxels.size(); ++n)
        for (unsigned d = 0; d < 6; ++d) {
            const glm::ivec3& voxel = all.voxels[n];
            glm::ivec3 there = voxel;
            there[static_cast<int>(d / 2)] += d % 2 != 0 ? 1 : -1;
            const int of = number(voxel.x, voxel.y, voxel.z), beside = number(there.x, there.y, there.z);
            if (of == beside) continue;
            const std::string both = name(of) + (beside == nothing ? "" : "_" + name(beside));
            expected[both].emplace_back(n, d);
            for (const std::uint64_t corner : all.cells[n])
                if (static_cast<int>(all.nodes[corner][d / 2]) ==
                    voxel[static_cast<int>(d / 2)] + static_cast<int>(d % 2))
                    expected_nodes[both].insert(corner);
        }
    EXPECT_EQ(6U, sets.all().size());
    EXPECT_EQ(expected.size(), sides.all().size());
    for (const side_sets::side_set& set : sides.all()) {
        const side_choice choice = sides.choice_of(set);
        std::vector<cell_and_direction> found;
        for (const side_sets::of_part& each : set.parts) {
            EXPECT_EQ(each.first, found.size()) << set.name;
            std::uint64_t cell = mesh.first_cell(each.part);
            for (const std::uint8_t directions : mesh.sides_of_cells(each.part, choice)) {
                for (unsigned d = 0; d < 6; ++d)
                    if ((directions >> d & 1U) != 0) found.emplace_back(cell, d);
                ++cell;
            }
        }
        EXPECT_EQ(set.sides, found.size()) << set.name;
        EXPECT_TRUE(expected[set.name] == found) << set.name;
        number_list nodes;
        for (const std::size_t part : sides.parts_of_nodes(set))
            for (const std::uint64_t n : mesh.nodes_of_sides(part, choice)) nodes.push_back(n);
        EXPECT_TRUE(number_list(expected_nodes[set.name].begin(), expected_nodes[set.name].end()) == nodes) << set.name;
    }
    for (std::size_t set = 0; set < sets.all().size(); ++set) {
        std::set<std::uint64_t> of_cells;
        for (std::size_t n = 0; n < all.voxels.size(); ++n)
            if (name(number(all.voxels[n].x, all.voxels[n].y, all.voxels[n].z)) == sets.all()[set].name)
                of_cells.insert(all.cells[n].begin(), all.cells[n].end());
        number_list nodes;
        for (const std::size_t part : mesh.parts_of_nodes(sets.parts_of(set)))
            for (const std::uint64_t n : mesh.nodes_of_cells(part, sets.cells_of(set))) nodes.push_back(n);
        EXPECT_TRUE(number_list(of_cells.begin(), of_cells.end()) == nodes) << sets.all()[set].name;
    }
}

TEST_F(Hexahedra, SparseVolumesAndAnyThreadsGiveTheSameBytes) {
    volume v = make_colored({70, 40, 9}, 23);
    v.add("material", scalar::i32);
    fill(v, 2);
    for (std::int64_t n = 0; n < v.num_voxels(); ++n)
        store(v.channels[2].data.data() + 4 * n, static_cast<std::int32_t>(n * 7919 % 5) - 1);
    const sparse_volume bricks = make_sparse(v, 1);
    for (const std::string& extension : all_extensions)
        for (const int compression : {0, 1}) {
            write_options options;
            options.compression = compression;
            options.threads = 1;
            const std::string one = written(v, "one" + extension, options);
            options.threads = 3;
            EXPECT_TRUE(one == written(v, "three" + extension, options)) << extension;
            write_sparse(bricks, folder_ / ("sparse" + extension), options);
            EXPECT_TRUE(one == read_file(folder_ / ("sparse" + extension))) << extension;
        }
}

TEST_F(Hexahedra, WhatCannotBeNumberedIsRefused) {
    write_options options;
    options.highest_number = 26;
    const volume fits = with_voxels({2, 2, 2}, {{0, 0, 0}, {1, 0, 0}});
    EXPECT_EQ("", refusal(fits, "a.inp", options));
    volume full = with_voxels({2, 2, 2}, {});
    for (std::int64_t n = 0; n < 8; ++n) full.set_bit(full.channels[0], n % 2, n / 2 % 2, n / 4);
    const std::string why = refusal(full, "b.inp", options);
    EXPECT_NE(std::string::npos, why.find("up to 26, and there are 27")) << why;
    EXPECT_EQ(std::vector<std::string>{"a.inp"}, names()); // nothing is left of the other
}

// The sides between two materials have tags above those of all volumes.
TEST_F(Hexahedra, TagsOfGmshHave31Bits) {
    volume v = with_voxels({3, 1, 1}, {{0, 0, 0}, {2, 0, 0}});
    v.add("material", scalar::i32);
    store(v.channels[1].data.data(), std::int32_t{0x7fff'fffe});
    EXPECT_EQ("", refusal(v, "a.msh", {}));
    v.set_bit(v.channels[0], 1, 0, 0);
    const std::string why = refusal(v, "b.msh", {});
    EXPECT_NE(std::string::npos, why.find("groups up to 2147483647")) << why;
    EXPECT_NE(std::string::npos, why.find("sides between materials")) << why;
}

// Longer numbers are an error of Abaqus.
TEST_F(Hexahedra, CoordinatesForAbaqusHaveTwentyCharacters) {
    volume v = with_voxels({9, 1, 1}, {{0, 0, 0}, {4, 0, 0}, {8, 0, 0}});
    v.origin = {-0.012345678901234567, 0.1, -1.2345678901234567e-200};
    v.voxel_size = {0.0012345678901234567, 0.1, 1e-7};
    const std::string text = written(v, "a.inp");
    std::istringstream lines(text.substr(text.find("NODES\n") + 6));
    std::size_t longest = 0, count = 0;
    for (std::string line; std::getline(lines, line) && line[0] != '*'; ++count) {
        std::istringstream fields(line);
        std::string field;
        std::getline(fields, field, ',');
        for (std::size_t a = 0; a < 3 && std::getline(fields, field, ','); ++a) {
            longest = std::max(longest, field.size() - 1); // without the space
            double nearest = 1;
            for (std::int64_t n = 0; n <= v.extent[a]; ++n) {
                const double exact = std::fma(static_cast<double>(n), v.voxel_size[a], v.origin[a]);
                nearest = std::min(nearest, std::abs(std::stod(field) - exact) / std::abs(exact));
            }
            EXPECT_GT(1e-12, nearest) << field;
        }
    }
    EXPECT_EQ(24U, count);
    EXPECT_EQ(20U, longest);
}

TEST_F(Hexahedra, AThresholdNeedsFractions) {
    volume v = with_voxels({2, 1, 1}, {{1, 0, 0}});
    write_options options;
    options.threshold = 0.7;
    EXPECT_NE(std::string::npos, refusal(v, "a.vtu", options).find("\"fraction\"")) << refusal(v, "a.vtu", options);
    v.add("fraction", scalar::f32);
    store(v.channels[1].data.data(), 0.7F); // a little less than 0.7
    const std::string text = written(v, "a.vtu", options);
    EXPECT_NE(std::string::npos, text.find("NumberOfPoints=\"8\" NumberOfCells=\"1\""));
    std::string warning;
    options.warn = [&](const std::string& line) { warning += line; };
    options.threshold = 1;
    written(v, "b.vtu", options);
    EXPECT_NE(std::string::npos, warning.find("no voxel has a fraction of at least 1")) << warning;
}

} // namespace
