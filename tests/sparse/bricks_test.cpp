// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The layout of sparse framebuffers, access to them, grids that no dense framebuffer could hold, limits and errors.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VOXELPIPE_IS_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VOXELPIPE_IS_SANITIZED
#endif
#endif

namespace {

#ifdef VOXELPIPE_IS_SANITIZED
constexpr bool is_sanitized = true;
#else
constexpr bool is_sanitized = false;
#endif

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using backend_type = vp::cpu_backend;

using primitive = vp::target<std::uint32_t, blend::replace>;
using sum = vp::target<float, blend::add>;
using occupied = vp::target<vp::bit, blend::bit_or>;
using sparse_type = vp::sparse_framebuffer<backend_type, primitive, sum, occupied>;

struct shader {
    auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.primitive, f.barycentric.y, true); }
};

// Triangles with edges of some `size` voxels around `centre`.
unit::small_mesh mesh_at(std::uint64_t seed, int count, glm::dvec3 centre, double size) {
    unit::splitmix64 random(seed);
    unit::small_mesh m;
    for (int i = 0; i < 3 * count; ++i)
        m.positions.emplace_back(
            glm::dvec3(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)) + centre);
    for (unsigned i = 0; i < static_cast<unsigned>(count); ++i) m.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    return m;
}

TEST(Morton, KeysInvertAndOrderTheirBits) {
    unit::splitmix64 random(1);
    for (int i = 0; i < 1000; ++i) {
        const glm::ivec3 p(random.between(0, 1 << 20), random.between(0, 1 << 20), random.between(0, 1 << 20));
        std::uint64_t key = 0;
        for (int b = 0; b < 21; ++b)
            for (int a = 0; a < 3; ++a) key |= static_cast<std::uint64_t>(p[a] >> b & 1) << (3 * b + a);
        EXPECT_EQ(vp::core::morton_key(p), key);
        EXPECT_EQ(vp::core::morton_position(key), p);
    }
}

TEST(SparseBricks, AreSortedMaskedAndRankedInMortonOrder) {
    const glm::ivec3 extent{90, 60, 70};
    backend_type backend = unit::make_backend();
    const vp::grid part = unit::unit_grid({120, 100, 90}).crop({11, 21, 3}, extent);
    const unit::small_mesh mesh = mesh_at(7, 40, {60, 50, 40}, 50);
    sparse_type fb{backend, extent};
    vp::abuffer<backend_type> lists{backend};
    const vp::status s =
        vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, fb, vp::coverage::conservative);
    ASSERT_TRUE(s.ok()) << s.message();
    ASSERT_TRUE(
        vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, lists, vp::coverage::conservative).ok());

    // The voxels by another way, in Morton order of the whole grid.
    struct expectation {
        glm::ivec3 voxel;
        std::uint32_t last;
    };
    std::map<std::uint64_t, expectation> expected;
    const auto fragments = lists.to_host(backend);
    for (const auto& [voxel, list] : fragments)
        expected[vp::core::morton_key(voxel + part.offset)] = {voxel, list[list.size() - 1].primitive};

    const auto host = fb.to_host(backend);
    ASSERT_EQ(host.num_voxels(), expected.size());
    ASSERT_EQ(host.offsets.size(), host.keys.size() + 1);
    EXPECT_EQ(host.offsets.back(), expected.size());
    EXPECT_EQ(fb.num_bytes(), host.num_bricks() * 80 + 8 + expected.size() * 8 + (expected.size() + 31) / 32 * 4);
    const vp::brick_slots slots{backend, fb};
    auto at = expected.begin();
    std::uint64_t rank = 0;
    for (std::size_t b = 0; b < host.keys.size(); ++b) {
        EXPECT_TRUE(b == 0 || host.keys[b - 1] < host.keys[b]);
        EXPECT_EQ(host.offsets[b], rank);
        EXPECT_NE(host.masks[b].count(), 0u);
        for (unsigned bit = 0; bit < 512; ++bit) {
            if (!host.masks[b].has(bit)) continue;
            ASSERT_NE(at, expected.end());
            EXPECT_EQ(at->first, host.keys[b] * 512 + bit);
            EXPECT_EQ(vp::get<0>(host)[rank], at->second.last);
            EXPECT_EQ(host.table().find(at->second.voxel), rank);
            EXPECT_EQ(slots.lookup().find(host.table(), at->second.voxel), rank);
            EXPECT_TRUE(vp::get<2>(host)[rank]);
            ++at;
            ++rank;
        }
    }
    EXPECT_EQ(at, expected.end());

    // Iteration agrees, and what is not there reads as the clear value.
    std::uint64_t visited = 0;
    host.for_each_voxel([&](const glm::ivec3& voxel, std::uint64_t r) {
        EXPECT_EQ(r, visited++);
        EXPECT_EQ(fb.view().template read<0>(voxel), vp::get<0>(host)[r]);
    });
    EXPECT_EQ(visited, host.num_voxels());
    // A lookup by hash finds what bisection finds, within the part and around it.
    unit::for_each_voxel(extent + 2, [&](int x, int y, int z) {
        const glm::ivec3 voxel = glm::ivec3(x, y, z) - 1;
        ASSERT_EQ(slots.lookup().find(host.table(), voxel), host.table().find(voxel));
    });
    std::uint64_t counted = 0;
    for (const auto& brick : host.bricks()) {
        EXPECT_EQ(brick.first, counted);
        counted += brick.mask.count();
        EXPECT_EQ((brick.origin + part.offset) % 8, glm::ivec3(0));
    }
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        const bool exists = expected.contains(vp::core::morton_key(glm::ivec3(x, y, z) + part.offset));
        ASSERT_EQ(host.contains({x, y, z}), exists);
        ASSERT_TRUE(exists || vp::get<0>(host)(x, y, z) == 0u);
    });
    EXPECT_FALSE(host.contains({-1, 0, 0}));
    EXPECT_FALSE(host.contains({extent.x, 0, 0}));

    // A region: through few bricks, and through all.
    const auto dense = vp::get<0>(fb).to_host_target(backend);
    for (const glm::ivec3 size : {glm::ivec3(9, 17, 3), extent - glm::ivec3(5, 1, 2)}) {
        const auto region = vp::get<0>(fb).to_host_region(backend, {5, 1, 2}, size);
        vp::for_each_voxel(region,
                           [&](const glm::ivec3& v, std::uint32_t value) { ASSERT_EQ(value, dense(v.x, v.y, v.z)); });
        EXPECT_EQ(region.last() - region.first(), size);
    }
    EXPECT_THROW((void)vp::get<0>(fb).to_host_region(backend, {5, 1, 2}, extent), std::out_of_range);

    // The grid of the call says where voxels are.
    EXPECT_EQ(fb.where(), part);
    EXPECT_EQ(fb.where().voxel_at(fb.where().voxel_center({4, 5, 6})), glm::ivec3(4, 5, 6));
}

TEST(SparseBricks, AreTheSameBytesForAnyNumberOfThreads) {
    const glm::ivec3 extent{260, 240, 250};
    const unit::small_mesh mesh = mesh_at(8, 20, {130, 120, 125}, 140);
    std::vector<vp::host_sparse<primitive, sum, occupied>> results;
    for (const unsigned threads : {1u, 2u, 5u}) {
        backend_type backend{threads};
        sparse_type fb{backend, extent};
        ASSERT_TRUE(vp::voxelize(backend, mesh.view(), unit::unit_grid(extent), vp::passthrough{}, shader{}, fb));
        results.push_back(fb.to_host(backend));
    }
    EXPECT_GT(results[0].num_bricks(), 4000u); // many stretches of tiles
    EXPECT_TRUE(vp::same_contents(results[0], results[1]));
    EXPECT_TRUE(vp::same_contents(results[0], results[2]));
}

// 65,536^3 and 2^20 x 8 x 2^20 voxels: keys of tiles beyond 32 bits. Slabs merge to the whole, and a part of the whole
// is the dense framebuffer of that part.
TEST(SparseBricks, ReachFarBeyondDenseGrids) {
    struct scene {
        glm::ivec3 extent, centre;
    };
    for (const scene& c : {scene{glm::ivec3(65536), {65400, 32768, 40000}},
                           scene{{1 << 20, 300, 1 << 20}, {(1 << 20) - 200, 100, 1000000}}}) {
        backend_type backend = unit::make_backend();
        const vp::grid grid = unit::unit_grid(c.extent);
        const unit::small_mesh mesh = mesh_at(9, 12, c.centre, 120);
        sparse_type fb{backend, c.extent};
        const vp::status s = vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, shader{}, fb);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_GT(s.counts.voxels, 20000u);
        const auto whole = fb.to_host(backend);

        const glm::ivec3 begin = glm::max(c.centre - 37, glm::ivec3(0)), size(61, 70, 65);
        const vp::grid part = grid.crop(begin, size);
        vp::framebuffer<backend_type, primitive, sum, occupied> dense{backend, size};
        ASSERT_TRUE(vp::voxelize(backend, mesh.view(), part, vp::passthrough{}, shader{}, dense).ok());
        const auto expected = vp::get<0>(dense).to_host_target(backend);
        const auto region = vp::get<0>(whole).to_dense_region(begin, size);
        std::uint64_t drawn = 0;
        unit::for_each_voxel(size, [&](int x, int y, int z) {
            ASSERT_EQ(region(begin.x + x, begin.y + y, begin.z + z), expected(x, y, z));
            drawn += whole.contains(begin + glm::ivec3(x, y, z)) ? 1 : 0;
        });
        EXPECT_GT(drawn, 1000u);

        std::vector<vp::host_sparse<primitive, sum, occupied>> slabs;
        const int borders[] = {0, c.centre.z - 50, c.centre.z + 3, c.extent.z};
        for (int i = 0; i < 3; ++i) {
            const vp::grid slab = grid.crop({0, 0, borders[i]}, {c.extent.x, c.extent.y, borders[i + 1] - borders[i]});
            sparse_type piece{backend, slab.extent};
            ASSERT_TRUE(vp::voxelize(backend, mesh.view(), slab, vp::passthrough{}, shader{}, piece).ok());
            slabs.push_back(piece.to_host(backend));
        }
        using host = vp::host_sparse<primitive, sum, occupied>;
        EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const host>(slabs)), whole));
        if (!is_sanitized) { // sanitizers end the program if operator new fails
            EXPECT_THROW((void)vp::get<0>(whole).to_dense(), std::exception); // no memory has room for it
        }
    }
}

TEST(SparseErrors, ChangeNothing) {
    const glm::ivec3 extent{50, 50, 50};
    backend_type backend = unit::make_backend();
    const unit::small_mesh mesh = mesh_at(10, 10, {25, 25, 25}, 25);
    const vp::grid grid = unit::unit_grid(extent);
    sparse_type fb{backend, extent};
    ASSERT_TRUE(vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, shader{}, fb));
    const auto before = fb.to_host(backend);
    const auto expect_same = [&](const char* what) {
        EXPECT_TRUE(vp::same_contents(before, fb.to_host(backend))) << what;
    };
    const auto code = [&](const unit::small_mesh& m, const vp::grid& g) {
        return vp::voxelize(backend, m.view(), g, vp::passthrough{}, shader{}, fb).code;
    };

    fb.limit({before.num_bricks() - 1, before.num_voxels()});
    vp::status s = vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, shader{}, fb);
    EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(s.required.bricks, before.num_bricks());
    EXPECT_EQ(s.required.voxels, before.num_voxels());
    fb.limit({before.num_bricks(), before.num_voxels() - 1});
    EXPECT_EQ(code(mesh, grid), vp::status_code::capacity_exceeded);
    expect_same("a limit");
    fb.limit({s.required.bricks, s.required.voxels});
    EXPECT_EQ(code(mesh, grid), vp::status_code::ok);
    expect_same("room for all");

    unit::small_mesh bad = mesh;
    bad.triangles.back().y = 1000;
    EXPECT_EQ(code(bad, grid), vp::status_code::index_out_of_range);
    EXPECT_EQ(code(mesh, unit::unit_grid({50, 50, 51})), vp::status_code::extent_mismatch);
    vp::get<0>(fb).load();
    EXPECT_EQ(code(mesh, unit::unit_grid({60, 50, 50}).crop({1, 0, 0}, extent)), vp::status_code::extent_mismatch);
    vp::get<0>(fb).clear(0);
    expect_same("errors");

    vp::sparse_framebuffer<backend_type, sum, sum> half{backend, extent, 1};
    vp::get<1>(half).load();
    EXPECT_EQ(vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(1.0f, 1.0f), half).code,
              vp::status_code::null_view);
}

// A voxel's sum keeps its terms as the blend rounds them, without the clear value.
TEST(SparseSums, AreKeptWithoutTheClearValue) {
    const glm::ivec3 extent{40, 40, 40};
    backend_type backend = unit::make_backend();
    const unit::small_mesh mesh = mesh_at(11, 30, {20, 20, 20}, 20);
    const vp::grid grid = unit::unit_grid(extent);
    using counts = vp::target<std::uint32_t, blend::count>;
    vp::sparse_framebuffer<backend_type, sum, counts> plain{backend, extent}, kept{backend, extent};
    kept.keep_sums<0>();
    for (auto* fb : {&plain, &kept}) {
        vp::get<0>(*fb).clear(2.5f);
        ASSERT_TRUE(vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(0.25f, 1u), *fb));
    }
    const auto a = plain.to_host(backend), b = kept.to_host(backend);
    EXPECT_TRUE(vp::same_contents(a, b));
    EXPECT_TRUE(vp::get<0>(a.sums).empty());
    const auto& sums = vp::get<0>(b.sums);
    ASSERT_EQ(sums.size(), b.num_voxels());
    for (std::uint64_t r = 0; r < b.num_voxels(); ++r) {
        EXPECT_EQ(sums[r].limb[0], std::uint64_t{vp::get<1>(b)[r]} << 30); // quarters in units of 2^-32
        EXPECT_EQ(vp::get<0>(b)[r], 2.5f + 0.25f * static_cast<float>(vp::get<1>(b)[r]));
    }
    // Loaded voxels count once with what they hold; drawn voxels that are new, with their terms alone.
    vp::get<0>(kept).load();
    vp::get<1>(kept).load();
    const unit::small_mesh more = mesh_at(12, 5, {20, 20, 20}, 20);
    ASSERT_TRUE(vp::voxelize(backend, more.view(), grid, vp::passthrough{}, vp::constant(0.25f, 1u), kept));
    const auto c = kept.to_host(backend);
    EXPECT_GT(c.num_voxels(), b.num_voxels());
    c.for_each_voxel([&](const glm::ivec3& v, std::uint64_t r) {
        const float value = vp::get<0>(c)[r], terms = vp::core::round_sum_to_float<-32>(vp::get<0>(c.sums)[r]);
        EXPECT_EQ(value, b.contains(v) ? terms : 2.5f + terms);
    });
}

} // namespace
