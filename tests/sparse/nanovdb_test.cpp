// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// NanoVDB files: the same grids give the same bytes, and other people's readers find what was written.

#include "api_model.hpp"

#include <algorithm>
#include <voxelpipe/sparse/io/nanovdb.hpp>

#include <gtest/gtest.h>

#if defined(VOXELPIPE_TEST_HAS_NANOVDB)
#include <nanovdb/util/GridStats.h>
#include <nanovdb/util/GridValidator.h>
#include <nanovdb/util/IO.h>
#endif

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using backend_type = vp::cpu_backend;

struct shader {
    auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = unit::mark(f.primitive, f.voxel);
        return vp::outputs(f.barycentric.x, f.normal, glm::u8vec4(m, m >> 8, m >> 16, m >> 24), (m & 1u) != 0,
                           f.primitive, static_cast<std::int16_t>(m), static_cast<double>(f.barycentric.y),
                           static_cast<std::int64_t>(m));
    }
};
template <class... Targets>
using fb = vp::sparse_framebuffer<backend_type, Targets...>;
using framebuffer = fb<vp::target<float, blend::add>, vp::target<glm::vec3, blend::replace>,
                       vp::target<glm::u8vec4, blend::replace>, vp::target<vp::bit, blend::replace>,
                       vp::target<std::uint32_t, blend::replace>, vp::target<std::int16_t, blend::replace>,
                       vp::target<double, blend::replace>, vp::target<std::int64_t, blend::replace>>;
using host = decltype(std::declval<const framebuffer&>().to_host(std::declval<backend_type&>()));

// Triangles across several of NanoVDB's upper nodes of 4096^3, in a part of a large grid with voxels that are no cubes.
host drawn(unsigned threads) {
    vp::grid grid = unit::unit_grid({20000, 9000, 30000});
    grid.origin = {-3.0, 10.5, 0.25};
    grid.voxel_size = {0.5, 0.25, 1.0};
    const vp::grid part = grid.crop({4000, 3, 8100}, {9000, 8500, 9001});
    unit::small_mesh mesh;
    for (const glm::dvec3& at :
         {glm::dvec3(4090, 4100, 8190), glm::dvec3(12900, 70, 12287), glm::dvec3(8200, 8200, 9000)})
        for (int i = 0; i < 4; ++i) {
            const auto n = static_cast<unsigned>(mesh.positions.size());
            for (const glm::dvec3& corner :
                 {glm::dvec3(-30, -20, 10.0 * i), glm::dvec3(40, 5.0 * i, -9), glm::dvec3(3, 50, 40)})
                mesh.positions.emplace_back(grid.to_world(at + corner));
            mesh.triangles.emplace_back(n, n + 1, n + 2);
        }
    backend_type backend{threads};
    framebuffer out{backend, part.extent};
    vp::get<0>(out).clear(-7.0f);
    vp::get<4>(out).clear(9u);
    EXPECT_TRUE(vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, out));
    EXPECT_GT(out.num_voxels(), 10000u);
    return out.to_host(backend);
}

std::string bytes_of(const host& h, bool all = true) {
    vp::io::nanovdb_file file;
    file.add_target<0>("weight", h);
    if (all) {
        file.add_target<1>("normal", h);
        file.add_target<2>("color", h);
        file.add_target<3>("bit", h);
        file.add_target<4>("triangle", h);
        file.add_target<5>("small", h);
        file.add_target<6>("double", h);
        file.add_target<7>("long", h);
        file.add_mask("occupancy", h);
    }
    std::ostringstream out;
    file.write(out);
    EXPECT_EQ(out.str().size(), file.size());
    return out.str();
}

std::string write_file(const char* name, const std::string& bytes) {
    const std::string path = ::testing::TempDir() + name;
    std::ofstream out(path, std::ios::binary);
    out << bytes;
    return path;
}

TEST(NanovdbFiles, AreTheSameBytesEachTime) {
    const std::string once = bytes_of(drawn(1)), again = bytes_of(drawn(3));
    EXPECT_TRUE(once == again);
}

TEST(NanovdbFiles, RefuseNamesThatAreTooLong) {
    vp::io::nanovdb_file file;
    const host none{};
    EXPECT_NO_THROW(file.add_mask(std::string(255, 'a'), none));
    EXPECT_THROW(file.add_mask(std::string(256, 'a'), none), std::invalid_argument);
}

#if defined(VOXELPIPE_TEST_HAS_NANOVDB)
// Voxel by voxel, with those next to them; `value` converts a value of ours.
template <class Build, std::size_t I, class Convert>
void expect_grid(const std::string& path, const std::string& name, const host& h, const Convert& value) {
    auto handle = nanovdb::io::readGrid(path, name);
    const auto* grid = handle.grid<Build>();
    ASSERT_NE(grid, nullptr) << name;
    EXPECT_TRUE(nanovdb::isValid(*grid, true, true)) << name;
    EXPECT_EQ(grid->activeVoxelCount(), h.num_voxels()) << name;
    auto accessor = grid->getAccessor();
    std::uint64_t wrong = 0;
    glm::ivec3 low(INT32_MAX), high(INT32_MIN);
    h.for_each_voxel([&](const glm::ivec3& v, std::uint64_t rank) {
        const glm::ivec3 p = v + h.where.offset;
        low = glm::min(low, p);
        high = glm::max(high, p);
        const nanovdb::Coord at(p.x, p.y, p.z), beside(p.x + 1, p.y, p.z);
        wrong += !accessor.isActive(at) || !(accessor.getValue(at) == value(vp::get<I>(h)[rank]));
        const bool exists = h.contains(v + glm::ivec3(1, 0, 0));
        wrong += accessor.isActive(beside) != exists;
        if (!exists) wrong += !(accessor.getValue(beside) == value(vp::get<I>(h.clear_values)));
    });
    EXPECT_EQ(wrong, 0u) << name;
    const auto& box = grid->tree().bbox();
    EXPECT_EQ(glm::ivec3(box.min()[0], box.min()[1], box.min()[2]), low) << name;
    EXPECT_EQ(glm::ivec3(box.max()[0], box.max()[1], box.max()[2]), high) << name;
    const glm::dvec3 centre = h.where.uncropped().voxel_center(low);
    const auto world = grid->indexToWorld(nanovdb::Vec3d(low.x, low.y, low.z));
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(world[a], centre[a], 1e-9) << name;
    // Every leaf's box is that of its voxels.
    std::uint64_t leaves = 0;
    for (const auto* leaf = grid->tree().template getFirstNode<0>(); leaves < grid->tree().nodeCount(0);
         ++leaf, ++leaves) {
        for (auto it = leaf->valueMask().beginOn(); it; ++it)
            wrong += !leaf->bbox().isInside(leaf->offsetToGlobalCoord(*it));
    }
    EXPECT_EQ(leaves, h.num_bricks()) << name;
    EXPECT_EQ(wrong, 0u) << name;
    if constexpr (std::is_same_v<Build, float> || std::is_same_v<Build, double> ||
                  std::is_same_v<Build, nanovdb::Vec3f>) {
        const auto& root = grid->tree().root();
        const auto minimum = root.minimum(), maximum = root.maximum();
        const auto average = root.average(), deviation = root.stdDeviation();
        nanovdb::gridStats(*handle.grid<Build>(), nanovdb::StatsMode::All);
        const auto number = [](const auto& v) {
            if constexpr (std::is_same_v<Build, nanovdb::Vec3f>)
                return v.lengthSqr(); // which of several unit vectors it is, a rounding decides
            else
                return v;
        };
        EXPECT_NEAR(number(root.minimum()), number(minimum), 1e-6) << name;
        EXPECT_NEAR(number(root.maximum()), number(maximum), 1e-6) << name;
        EXPECT_NEAR(root.average(), average, 1e-6) << name;
        EXPECT_NEAR(root.stdDeviation(), deviation, 1e-6) << name;
    }
}

TEST(NanovdbFiles, AreReadByNanovdbVoxelByVoxel) {
    const host h = drawn(2);
    const std::string path = write_file("read_back.nvdb", bytes_of(h));
    const auto same = [](auto v) { return v; };
    expect_grid<float, 0>(path, "weight", h, same);
    expect_grid<nanovdb::Vec3f, 1>(path, "normal", h, [](glm::vec3 v) { return nanovdb::Vec3f(v.x, v.y, v.z); });
    expect_grid<nanovdb::Rgba8, 2>(path, "color", h, [](glm::u8vec4 v) { return nanovdb::Rgba8(v.r, v.g, v.b, v.a); });
    expect_grid<bool, 3>(path, "bit", h, same);
    expect_grid<std::uint32_t, 4>(path, "triangle", h, same);
    expect_grid<std::int16_t, 5>(path, "small", h, same);
    expect_grid<double, 6>(path, "double", h, same);
    expect_grid<std::int64_t, 7>(path, "long", h, same);
    auto mask = nanovdb::io::readGrid(path, std::string("occupancy"));
    ASSERT_NE(mask.grid<nanovdb::ValueMask>(), nullptr);
    EXPECT_EQ(mask.grid<nanovdb::ValueMask>()->activeVoxelCount(), h.num_voxels());
    EXPECT_GT(mask.grid<nanovdb::ValueMask>()->tree().nodeCount(2), 2u);
    std::remove(path.c_str());
}

// Tiles are active values of lower nodes, of upper ones and of the root; beside them there are leaves.
TEST(NanovdbFiles, HaveTilesAsActiveValues) {
    using target = vp::target<float, blend::replace>;
    vp::host_sparse<target> h;
    h.where.extent = h.where.whole = glm::ivec3(1 << 15);
    vp::get<0>(h.clear_values) = -1.0f;
    const auto key = [](int x, int y, int z) { return vp::core::morton_key(x / 8, y / 8, z / 8); };
    // By key: bricks at 8 and 40, tiles of 8, 16, 64, 128, 256, 4096 and 8192 voxels a side.
    h.keys = {key(8, 0, 0), key(40, 0, 8)};
    h.masks.resize(2);
    h.masks[0].words[0] = 5;
    h.masks[1].words[7] = 1;
    h.offsets = {0, 2, 3};
    h.tiles = {vp::brick_tile::of(key(0, 0, 0), 0),       vp::brick_tile::of(key(16, 16, 0), 1),
               vp::brick_tile::of(key(64, 0, 64), 3),     vp::brick_tile::of(key(128, 0, 0), 4),
               vp::brick_tile::of(key(0, 256, 0), 5),     vp::brick_tile::of(key(4096, 0, 0), 9),
               vp::brick_tile::of(key(8192, 8192, 0), 10)};
    ASSERT_TRUE(std::is_sorted(h.tiles.begin(), h.tiles.end(), [](auto a, auto b) { return a.bits < b.bits; }));
    for (std::uint64_t i = 0; i < h.num_values(); ++i) vp::get<0>(h.values).push_back(static_cast<float>(i) + 1);
    vp::io::nanovdb_file file;
    file.add_target<0>("weight", h);
    file.add_mask("occupancy", h);
    std::ostringstream out;
    file.write(out);
    EXPECT_EQ(out.str().size(), file.size());
    const std::string path = write_file("tiles.nvdb", out.str());
    auto handle = nanovdb::io::readGrid(path, std::string("weight"));
    auto occupancy = nanovdb::io::readGrid(path, std::string("occupancy"));
    std::remove(path.c_str());
    const auto* grid = handle.grid<float>();
    const auto* mask = occupancy.grid<nanovdb::ValueMask>();
    ASSERT_TRUE(grid != nullptr && mask != nullptr);
    EXPECT_TRUE(nanovdb::isValid(*grid, true, true));
    EXPECT_EQ(grid->activeVoxelCount(), h.num_voxels());
    EXPECT_EQ(mask->activeVoxelCount(), h.num_voxels());
    EXPECT_EQ(grid->tree().activeTileCount(1), 1u + 8 + 512); // of 8 voxels a side
    EXPECT_EQ(grid->tree().activeTileCount(2), 1u + 8);
    EXPECT_EQ(grid->tree().activeTileCount(3), 1u + 8);
    auto accessor = grid->getAccessor();
    int wrong = 0;
    const auto look = [&](const glm::ivec3& p) {
        const nanovdb::Coord at(p.x, p.y, p.z);
        wrong += accessor.getValue(at) == vp::get<0>(h)(p.x, p.y, p.z) ? 0 : 1;
        // Not by an accessor, for which tiles of the root are never active in NanoVDB 32.4.
        wrong += grid->tree().isActive(at) == h.contains(p) && mask->tree().isActive(at) == h.contains(p) ? 0 : 1;
    };
    for (std::uint64_t i = 0; i < h.num_tiles(); ++i) {
        const auto tile = h.tile(i);
        for (int c = 0; c < 27; ++c) { // within, at the corners, and beyond them
            glm::ivec3 p;
            for (int a = 0, n = c; a < 3; ++a, n /= 3)
                p[a] = tile.origin[a] + (n % 3 == 0 ? -1 : n % 3 == 1 ? tile.side - 1 : tile.side);
            look(p);
            look(glm::max(p - 1, glm::ivec3(0)));
        }
    }
    for (int z = 0; z < 72; ++z)
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 80; ++x) look({x, y, z});
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(grid->tree().bbox().min(), nanovdb::Coord(0, 0, 0));
    EXPECT_EQ(grid->tree().bbox().max(), nanovdb::Coord(16383, 16383, 8191));
    const auto& root = grid->tree().root();
    const float average = root.average(), deviation = root.stdDeviation();
    EXPECT_EQ(root.minimum(), 1.0f);
    EXPECT_EQ(root.maximum(), 10.0f);
    nanovdb::gridStats(*handle.grid<float>(), nanovdb::StatsMode::All);
    EXPECT_NEAR(root.average(), average, 1e-5);
    EXPECT_NEAR(root.stdDeviation(), deviation, 1e-4);
}
#else
TEST(NanovdbFiles, AreReadByNanovdbVoxelByVoxel) { GTEST_SKIP() << "no libnanovdb-dev"; }
#endif

#if defined(VOXELPIPE_NANOVDB_VALIDATE)
std::string output_of(const std::string& command) {
    std::string text;
    FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return "cannot run it";
    for (int c; (c = std::fgetc(pipe)) != EOF;) text.push_back(static_cast<char>(c));
    return pclose(pipe) == 0 ? text : "exit status: " + text;
}

TEST(NanovdbFiles, AreAcceptedByItsTools) {
    const host h = drawn(2), none{};
    for (const bool empty : {false, true}) {
        const std::string path = write_file("tools.nvdb", bytes_of(empty ? none : h));
        const std::string valid = output_of(VOXELPIPE_NANOVDB_VALIDATE " -v " + path);
        EXPECT_EQ(valid.find("failed"), std::string::npos) << valid;
        std::size_t passed = 0;
        for (std::size_t at = 0; (at = valid.find("passed", at)) != std::string::npos; ++at) ++passed;
        EXPECT_EQ(passed, 9u) << valid;
        const std::string listed = output_of(VOXELPIPE_NANOVDB_PRINT " " + path);
        for (const char* line : {"weight     float", "normal     Vec3f", "color      RGBA8", "occupancy  Mask"})
            EXPECT_NE(listed.find(line), std::string::npos) << listed;
        std::remove(path.c_str());
    }
    // A byte of the head that is not as it was.
    std::string bytes = bytes_of(h, false);
    bytes[500] = static_cast<char>(bytes[500] ^ 1);
    const std::string path = write_file("broken.nvdb", bytes);
    EXPECT_NE(output_of(VOXELPIPE_NANOVDB_VALIDATE " -v " + path).find("failed"), std::string::npos);
    std::remove(path.c_str());
}
#else
TEST(NanovdbFiles, AreAcceptedByItsTools) { GTEST_SKIP() << "no libnanovdb-tools"; }
#endif

} // namespace
