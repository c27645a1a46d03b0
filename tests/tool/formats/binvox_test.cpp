// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "test_volumes.hpp"
#include "write/formats/binvox.hpp"

#include <array>
#include <sstream>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Binvox : public in_folder {};

struct binvox_file {
    std::int64_t side = 0;
    std::array<double, 3> translate{};
    double scale = 0;
    std::string voxels; // one byte each, y fastest, then z, then x
    std::string pairs;  // the runs as they stand in the file
};

// As the format's published description reads it.
binvox_file load(const std::filesystem::path& path) {
    const std::string bytes = read_file(path);
    std::istringstream in(bytes);
    binvox_file file;
    std::string word;
    std::array<std::int64_t, 3> dim{};
    std::getline(in, word);
    EXPECT_EQ(word, "#binvox 1");
    in >> word >> dim[0] >> dim[1] >> dim[2];
    EXPECT_EQ(word, "dim");
    EXPECT_TRUE(dim[0] == dim[1] && dim[1] == dim[2]);
    in >> word >> file.translate[0] >> file.translate[1] >> file.translate[2];
    EXPECT_EQ(word, "translate");
    in >> word >> file.scale;
    EXPECT_EQ(word, "scale");
    in >> word;
    EXPECT_EQ(word, "data");
    EXPECT_EQ(in.get(), '\n');
    file.side = dim[0];
    file.pairs = bytes.substr(static_cast<std::size_t>(in.tellg()));
    EXPECT_EQ(file.pairs.size() % 2, 0u);
    for (std::size_t n = 0; n + 1 < file.pairs.size(); n += 2) {
        EXPECT_TRUE(file.pairs[n] == 0 || file.pairs[n] == 1);
        EXPECT_NE(file.pairs[n + 1], 0);
        file.voxels.append(static_cast<unsigned char>(file.pairs[n + 1]), file.pairs[n]);
    }
    EXPECT_EQ(static_cast<std::int64_t>(file.voxels.size()), file.side * file.side * file.side);
    return file;
}

void expect_same_voxels(const volume& v, const binvox_file& file) {
    std::size_t at = 0;
    for (std::int64_t x = 0; x < file.side; ++x)
        for (std::int64_t z = 0; z < file.side; ++z)
            for (std::int64_t y = 0; y < file.side; ++y, ++at) {
                const bool inside = x < v.extent[0] && y < v.extent[1] && z < v.extent[2];
                ASSERT_EQ(file.voxels[at] != 0, inside && v.occupied(x, y, z)) << x << " " << y << " " << z;
            }
}

} // namespace

TEST_F(Binvox, HoldsEveryVoxelOfAnyExtent) {
    using extent = std::array<std::int64_t, 3>;
    for (const extent& e : {extent{1, 1, 1}, extent{32, 32, 32}, extent{33, 31, 64}, extent{5, 70, 9}, extent{70, 5, 9},
                            extent{9, 5, 70}, extent{65, 64, 63}, extent{1, 100, 1}})
        for (const std::uint32_t density : {1u, 2u, 40u}) {
            const volume v = make_occupancy(e, density);
            write(v, folder_ / "a.binvox");
            const binvox_file file = load(folder_ / "a.binvox");
            EXPECT_EQ(file.side, std::max({e[0], e[1], e[2]}));
            EXPECT_EQ(file.translate, v.origin);
            EXPECT_EQ(file.scale, 0.125 * static_cast<double>(file.side));
            expect_same_voxels(v, file);
        }
}

TEST_F(Binvox, RunsAreAsLongAsTheyCanBe) {
    volume v = make_volume({20, 20, 20}); // 8000 empty voxels: 31 runs of 255 and one of 95
    v.add("occupancy", scalar::bit);
    write(v, folder_ / "a.binvox");
    EXPECT_EQ(load(folder_ / "a.binvox").pairs.size(), 2u * 32);
    const volume full = make_occupancy({300, 300, 3}, 1);
    write(full, folder_ / "b.binvox");
    const binvox_file file = load(folder_ / "b.binvox");
    for (std::size_t n = 2; n + 1 < file.pairs.size(); n += 2)
        if (file.pairs[n] == file.pairs[n - 2]) {
            ASSERT_EQ(file.pairs[n - 1], '\xff') << "a run was broken off early";
        }
}

TEST_F(Binvox, RefusesVoxelsThatAreNoCubes) {
    volume v = make_occupancy({4, 4, 4});
    v.voxel_size = {1, 1, 2};
    try {
        write(v, folder_ / "a.binvox");
        FAIL();
    } catch (const write_error& e) {
        EXPECT_NE(std::string(e.what()).find("one voxel size"), std::string::npos) << e.what();
    }
    EXPECT_TRUE(names().empty());

    EXPECT_TRUE(voxelize::are_cubic({0.1, 0.1, 0.1}));
    EXPECT_TRUE(voxelize::are_cubic({1, 1 + 1e-12, 1 - 1e-12})); // rounding
    const std::array<double, 3> others[]{{1, 1, 2}, {1, 2, 1}, {2, 1, 1}};
    for (const std::array<double, 3>& size : others)
        EXPECT_FALSE(voxelize::are_cubic(size)) << size[0] << ' ' << size[1] << ' ' << size[2];
}
