// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_cells into sparse framebuffers: the values and the status of dense ones, tiles of what is untouched inside,
// crops that are merged, targets that load or keep sums, limits.
#include "../test_scale.hpp"
#include "cell_support.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace {

using namespace cells;
namespace blend = voxelpipe::blend;

template <class... Targets>
using dense_of = vp::framebuffer<vp::cpu_backend, Targets...>;
template <class... Targets>
using sparse_of = vp::sparse_framebuffer<vp::cpu_backend, Targets...>;

// Everything that a voxel has but its place, with a discard by that too.
struct placeless {
    static constexpr bool ignores_voxel = true;
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        return vp::outputs(f.fraction + 1.0f, f.units, f.next_aperture - f.aperture, true,
                           glm::vec3(f.centroid.y, f.area_centroid.z, static_cast<float>(f.area)))
            .discard_if((f.units & 7) == 5);
    }
};
struct with_place {
    using fragment = placeless::fragment;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        auto out = placeless{}(f);
        return out.discard_if((f.voxel.x + 2 * f.voxel.y + 5 * f.voxel.z) % 7 == static_cast<int>(f.draw));
    }
};
template <template <class...> class Framebuffer>
using filled = Framebuffer<vp::target<float, blend::add>, vp::target<std::int64_t, blend::max>,
                           vp::target<std::int64_t, blend::replace>, vp::target<vp::bit, blend::bit_or>,
                           vp::target<glm::vec3, blend::add>>;
template <template <class...> class Framebuffer>
using fractions = Framebuffer<vp::target<float, blend::replace>>;

template <class Shader, class Framebuffer>
vp::status draw_into(vp::cpu_backend& backend, const std::vector<mesh>& meshes, const vp::grid& g, Framebuffer& fb,
                     const vp::cell_options& options = {}) {
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> draws;
    for (const mesh& m : meshes) draws.push_back({m.view(), {}, {}});
    return vp::voxelize_cells(backend, draws, g, fb, options);
}

// Compares all targets, voxel by voxel.
template <class Backend, class... Targets>
void expect_equal(vp::cpu_backend& backend, const vp::framebuffer<Backend, Targets...>& a,
                  const vp::sparse_framebuffer<Backend, Targets...>& b) {
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto dense = vp::get<I>(a).to_host_target(backend);
        const auto sparse = vp::get<I>(b).to_host_target(backend);
        std::size_t wrong = 0;
        vp::for_each_voxel(dense, [&](const glm::ivec3& v, const auto& value) {
            wrong += vp::core::has_same_bits(value, sparse(v.x, v.y, v.z)) ? 0u : 1u;
        });
        EXPECT_EQ(wrong, 0u) << "target " << I;
    });
}

template <class Shader, template <template <class...> class> class Targets>
vp::status compare(const std::vector<mesh>& meshes, const vp::grid& g, const vp::cell_options& options,
                   bool makes_tiles) {
    vp::cpu_backend backend(2);
    Targets<dense_of> a(backend, g.extent);
    Targets<sparse_of> b(backend, g.extent);
    vp::get<0>(a).clear(0.25f);
    vp::get<0>(b).clear(0.25f);
    const vp::status expected = draw_into<Shader>(backend, meshes, g, a, options),
                     found = draw_into<Shader>(backend, meshes, g, b, options);
    EXPECT_TRUE(expected.ok()) << expected.message();
    EXPECT_TRUE(found.ok()) << found.message();
    EXPECT_EQ(expected.counts, found.counts);
    EXPECT_EQ(expected.cells, found.cells);
    EXPECT_EQ(b.num_voxels(), expected.counts.voxels);
    EXPECT_EQ(b.to_host(backend).is_tiled, makes_tiles);
    expect_equal(backend, a, b);
    return found;
}

// Closed and open meshes, by all axes, of parts of a grid, for bodies: both ways of making bricks.
TEST(SparseCells, HaveTheValuesOfDenseOnes) {
    splitmix64 random(41);
    mesh open = solids::sphere({10, 9, 12}, 8.3f, 2);
    open.triangles.erase(open.triangles.begin() + 5, open.triangles.begin() + 9);
    const std::vector<mesh> meshes{solids::random_cycle(random, 9, -2, 24, 32), open,
                                   solids::box({2, 1, 3}, {21, 20.5f, 23})};
    vp::grid g = solids::unit_grid(glm::ivec3(26, 21, 27));
    g.voxel_size = {0.5f, 1.0f, 1.25f};
    std::uint64_t discarded = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (const vp::bodies each : {vp::bodies::call, vp::bodies::draw})
            for (const vp::grid& part : {g, g.crop({3, 5, 1}, {22, 13, 25})}) {
                if (tests::is_slow_build() && (part.extent == g.extent) != (each == vp::bodies::call)) continue;
                const vp::cell_options how{.bodies = each, .axis = axis};
                discarded += compare<placeless, filled>(meshes, part, how, true).counts.fragments_discarded;
                discarded += compare<with_place, filled>(meshes, part, how, false).counts.fragments_discarded;
                EXPECT_EQ((compare<vp::fraction, fractions>(meshes, part, how, true).counts.fragments_discarded), 0u);
            }
    EXPECT_GT(discarded, 1000u);
    vp::cell_options closed{.repair = vp::repair::close_holes};
    EXPECT_GT((compare<vp::fraction, fractions>({open}, g, closed, true).cells.cones), 0u);
}

// What is untouched inside is the largest cubes; windings of 1 and 2 are not joined.
TEST(SparseCells, InsidesAreTiles) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(72, 64, 80));
    for (int axis = 0; axis < 3; ++axis) {
        fractions<sparse_of> fb(backend, g.extent);
        const vp::cell_options how{.axis = axis};
        // Whole bricks: 1 to 7 by 0 to 7 by 1 to 8.
        ASSERT_TRUE(draw_into<vp::fraction>(backend, {solids::box({7.5f, 0, 8}, {64, 64, 72})}, g, fb, how).ok());
        auto h = fb.to_host(backend);
        std::size_t sizes[4]{};
        std::uint64_t bricks = 0;
        for (const vp::brick_tile& t : h.tiles) {
            ASSERT_LT(t.level(), 4);
            ++sizes[t.level()];
            bricks += t.num_voxels() / 512;
        }
        EXPECT_EQ(bricks, 7u * 8 * 8);
        EXPECT_EQ(sizes[2], 2u); // bricks 4 to 7 by 0 to 3 or 4 to 7 by 4 to 7
        for (std::size_t t = 0; t < h.tiles.size(); ++t)
            EXPECT_EQ(vp::get<0>(h)[h.num_values() - h.num_tiles() + t], 1.0f);
        // A layer of halves; by z, what has the lowest side as its upper face is cut too, and has 0.
        EXPECT_EQ(h.num_bricks(), axis == 2 ? 128u : 64u);
        EXPECT_EQ(h.num_voxels(), 64u * 57 * (axis == 2 ? 65 : 64));

        // Two boxes, one in the other.
        const std::vector<mesh> both{solids::box({0, 0, 0}, {64, 64, 64}), solids::box({16, 16, 16}, {32, 32, 32})};
        ASSERT_TRUE(draw_into<vp::fraction>(backend, both, g, fb, how).ok());
        h = fb.to_host(backend);
        EXPECT_EQ(h.num_bricks(), 0u);
        std::size_t twos = 0;
        for (std::size_t t = 0; t < h.tiles.size(); ++t)
            if (vp::get<0>(h)[t] == 2.0f) {
                ++twos;
                EXPECT_EQ(h.tiles[t], vp::brick_tile::of(vp::core::morton_key(2, 2, 2), 1));
            }
        EXPECT_EQ(twos, 1u);
        EXPECT_EQ(h.num_tiles(), 7u + 8); // octants, and those of the one with the inner box
    }
}

// Crops, whose borders cut bricks, are merged to the bytes of the whole, tiles included.
TEST(SparseCells, MergedCropsAreTheWhole) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(44, 40, 48));
    mesh m = solids::sphere({21, 20, 23}, 18.7f, 3);
    m.add(solids::box({3, 4, 5}, {40, 36, 44}));
    const auto draw = [&](const vp::grid& part) {
        fractions<sparse_of> fb(backend, part.extent);
        const vp::status s = draw_into<vp::fraction>(backend, {m}, part, fb, {.count_open_edges = false});
        EXPECT_TRUE(s.ok()) << s.message();
        return fb.to_host(backend);
    };
    const auto whole = draw(g);
    EXPECT_GT(whole.num_tiles(), 10u);
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<std::remove_const_t<decltype(whole)>> parts;
        int begin = 0;
        for (const int end : {13, 14, 32, g.extent[axis]}) {
            glm::ivec3 low(0), size = g.extent;
            low[axis] = begin;
            size[axis] = end - begin;
            parts.push_back(draw(g.crop(low, size)));
            begin = end;
        }
        const auto merged = vp::merge(std::span<const std::remove_const_t<decltype(whole)>>(parts));
        EXPECT_TRUE(vp::same_contents(merged, whole)) << axis;
    }
}

// Targets that load blend onto what was there, inside tiles too; those that are off stay.
TEST(SparseCells, LoadAndOffAreThoseOfDenseTargets) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(40, 33, 35));
    const std::vector<mesh> first{solids::box({1, 1, 1}, {38, 31, 33})}, second{solids::sphere({20, 17, 16}, 11.2f, 2)};
    filled<dense_of> a(backend, g.extent);
    filled<sparse_of> b(backend, g.extent);
    ASSERT_TRUE(draw_into<placeless>(backend, first, g, a).ok());
    ASSERT_TRUE(draw_into<placeless>(backend, first, g, b).ok());
    EXPECT_GT(b.num_tiles(), 0u);
    vp::get<0>(a).load();
    vp::get<0>(b).load();
    vp::get<1>(a).off();
    vp::get<1>(b).off();
    ASSERT_TRUE(draw_into<placeless>(backend, second, g, a).ok());
    ASSERT_TRUE(draw_into<placeless>(backend, second, g, b).ok());
    expect_equal(backend, a, b);
    // A target that is off from the start reads as its background, and takes no part in what is a tile.
    filled<sparse_of> c(backend, g.extent);
    for (int call = 0; call < 2; ++call) {
        vp::get<1>(c).off();
        ASSERT_TRUE(draw_into<placeless>(backend, first, g, c).ok());
    }
    EXPECT_GT(c.num_voxels(), 0u);
}

// Kept sums make bricks alone, and the same values.
TEST(SparseCells, KeptSumsAreInBricks) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(24));
    const std::vector<mesh> m{solids::box({1, 1, 1}, {22, 23, 21.5f})};
    using sum = vp::target<float, blend::add>;
    dense_of<sum> a(backend, g.extent);
    sparse_of<sum> b(backend, g.extent);
    b.keep_sums<0>();
    ASSERT_TRUE(draw_into<vp::fraction>(backend, m, g, a).ok());
    ASSERT_TRUE(draw_into<vp::fraction>(backend, m, g, b).ok());
    EXPECT_EQ(b.num_tiles(), 0u);
    EXPECT_EQ(b.to_host(backend).sums.first.size(), b.num_voxels());
    expect_equal(backend, a, b);
}

// A call beyond the limits changes nothing and names its need, which suffices.
TEST(SparseCells, LimitsNameTheNeed) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(40));
    const std::vector<mesh> m{solids::sphere({20, 20, 20}, 15.5f, 3)};
    fractions<sparse_of> fb(backend, g.extent);
    fb.limit({3, 100});
    const vp::status s = draw_into<vp::fraction>(backend, m, g, fb);
    EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(fb.num_voxels(), 0u);
    fb.limit({s.required.bricks, s.required.voxels});
    ASSERT_TRUE(draw_into<vp::fraction>(backend, m, g, fb).ok());
    EXPECT_EQ(fb.num_bricks() + fb.num_tiles(), s.required.bricks);
    EXPECT_EQ(fb.num_values(), s.required.voxels);
    fb.limit({s.required.bricks - 1, s.required.voxels});
    EXPECT_EQ(draw_into<vp::fraction>(backend, {m}, g, fb).code, vp::status_code::capacity_exceeded);
}

// A grid far beyond dense memory: a large box is a few tiles and what is cut.
TEST(SparseCells, LargeGridsFollowTheSurface) {
    vp::cpu_backend backend(2);
    vp::grid g = solids::unit_grid(glm::ivec3(1 << 20));
    g.origin = glm::vec3(0.0f);
    fractions<sparse_of> fb(backend, g.extent);
    const float low = 524288.0f;
    const std::vector<mesh> m{solids::box(glm::vec3(low), glm::vec3(low + 64.0f, low + 64.0f, low + 64.5f))};
    const vp::status s = draw_into<vp::fraction>(backend, m, g, fb);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(fb.num_tiles(), 1u);
    EXPECT_EQ(fb.num_voxels(), 64u * 65 * 65); // the side at the low end of the rows is an upper face
    EXPECT_EQ(s.cells.volume(), 64.0 * 64 * 64.5);
}

// Nothing clears; bad input is refused, and leaves what was there.
TEST(SparseCells, NothingAndBadInput) {
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid(glm::ivec3(16));
    fractions<sparse_of> fb(backend, g.extent);
    const std::vector<mesh> box{solids::box({1, 1, 1}, {15, 15, 15})};
    ASSERT_TRUE(draw_into<vp::fraction>(backend, box, g, fb).ok());
    const std::uint64_t voxels = fb.num_voxels();
    EXPECT_EQ(voxels, 15u * 14 * 14);
    mesh bad = box[0];
    bad.triangles.push_back({0, 1, 1000000});
    EXPECT_EQ(draw_into<vp::fraction>(backend, {bad}, g, fb).code, vp::status_code::index_out_of_range);
    EXPECT_EQ(draw_into<vp::fraction>(backend, box, g, fb, {.axis = 3}).code, vp::status_code::bad_cell_options);
    EXPECT_EQ(draw_into<vp::fraction>(backend, box, solids::unit_grid(glm::ivec3(15)), fb).code,
              vp::status_code::extent_mismatch);
    EXPECT_EQ(fb.num_voxels(), voxels);
    // Beside the grid there is nothing, but a call.
    ASSERT_TRUE(draw_into<vp::fraction>(backend, {solids::box({20, 20, 20}, {30, 30, 30})}, g, fb).ok());
    EXPECT_EQ(fb.num_voxels(), 0u);
    ASSERT_TRUE(draw_into<vp::fraction>(backend, box, g, fb).ok());
    ASSERT_TRUE(draw_into<vp::fraction>(backend, {}, g, fb).ok());
    EXPECT_EQ(fb.num_voxels(), 0u);
}

} // namespace
