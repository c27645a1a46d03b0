// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Bad input to the API. Every refused call returns the code that says what is wrong, writes nothing to the caller's
// memory and leaves no allocation behind. Input that is odd but defined (positions that are NaN, a mesh far away)
// works.

#include "breakable_call.hpp"
#include "counted_allocations.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace unit;
using vp::status_code;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr double dnan = std::numeric_limits<double>::quiet_NaN();
constexpr double dinfinity = std::numeric_limits<double>::infinity();

// Indices are checked by the coarse raster; everything else is refused before any stage runs.
vp::stage refusing_stage(status_code code) {
    return code == status_code::index_out_of_range ? vp::stage::coarse_raster : vp::stage::validate;
}

// Framebuffer and A-buffer must refuse the call with `expected`, for both rules and any number of threads.
// `into_lists`: whether the mistake concerns an A-buffer too.
void expect_refused(const call& c, status_code expected, bool into_lists = true) {
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
        for (const unsigned threads : {1u, 3u}) {
            vp::cpu_backend be(threads);
            const std::int64_t before = live_allocations;
            const vp::status s = vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, c.view, rule);
            EXPECT_EQ(live_allocations, before);
            EXPECT_EQ(s.code, expected) << s.message();
            EXPECT_EQ(s.where, refusing_stage(expected)) << s.message();
            EXPECT_FALSE(s.ok());
            EXPECT_EQ(s.counts.fragments, 0u);
            EXPECT_EQ(s.counts.voxels, 0u);
            EXPECT_THROW(s.or_throw(), std::runtime_error);
            const std::string text =
                std::string(vp::to_string(refusing_stage(expected))) + ": " + vp::to_string(expected);
            EXPECT_EQ(s.message().substr(0, text.size()), text);
            EXPECT_EQ(s.triangle != vp::status::unknown, expected == status_code::index_out_of_range);
            EXPECT_TRUE(c.untouched());
            if (!into_lists) continue;
            vp::abuffer<vp::cpu_backend, int> lists{be};
            const std::int64_t before_lists = live_allocations;
            const vp::status t = vp::voxelize(be, c.mesh, c.grid, by_weight{}, payload, lists, rule);
            EXPECT_EQ(live_allocations, before_lists);
            EXPECT_EQ(t.code, expected) << t.message();
            EXPECT_EQ(t.where, refusing_stage(expected)) << t.message();
            EXPECT_EQ(lists.num_voxels(), 0u);
            EXPECT_EQ(lists.num_fragments(), 0u);
            EXPECT_EQ(lists.offsets.size(), 0u);
        }
    }
}

TEST(BadInput, TheUnchangedCallSucceeds) {
    call c;
    vp::cpu_backend be(1);
    const vp::status s = vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, c.view);
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_GT(s.counts.voxels, 10u);
    EXPECT_FALSE(c.untouched());
}

// ---- mesh ----

TEST(BadInput, ACallWithoutDrawsOrTrianglesDrawsNothingButIsStillChecked) {
    call c;
    c.triangles.clear();
    c.positions.clear();
    c.look();
    vp::cpu_backend be(1);
    c.grid.extent.x = 0;
    c.view.extent = c.grid.extent;
    expect_refused(c, status_code::bad_extent);
    call again;
    again.grid.extent.x -= 1;
    EXPECT_EQ(vp::voxelize(be, std::span<const draw>{}, again.grid, again.view).code, status_code::extent_mismatch);
    EXPECT_TRUE(again.untouched());
    again.mesh.positions = {nullptr, 3};
    again.mesh.triangles = {};
    expect_refused(again, status_code::extent_mismatch, false);
}

TEST(BadInput, AnIndexOutOfRangeIsRefused) {
    for (const std::uint32_t index : {3u, 4u, 0x7fffffffu, 0x80000000u, 0xffffffffu})
        for (int corner = 0; corner < 3; ++corner) {
            call c;
            c.triangles[1][corner] = index;
            expect_refused(c, status_code::index_out_of_range);
            vp::cpu_backend be(1);
            const vp::status s = vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, c.view);
            EXPECT_EQ(s.triangle, 1u);
            EXPECT_EQ(s.draw, 0u);
        }
    call c; // a mesh without vertices
    c.positions.clear();
    c.look();
    expect_refused(c, status_code::index_out_of_range);
}

TEST(BadInput, AnIndexOutOfRangeIsFoundInTheLastOfManyTriangles) {
    call c; // far from the start, so that other threads have done work before
    c.triangles.assign(50000, {0, 1, 2});
    c.triangles.back().y = 3;
    c.look();
    expect_refused(c, status_code::index_out_of_range);
}

TEST(BadInput, AnIndexIsComparedWithTheVerticesOfItsOwnMesh) {
    call c;
    vp::cpu_backend be(2);
    const std::vector<glm::vec3> few(c.positions.begin(), c.positions.begin() + 2); // index 2 is out of range here
    const draw draws[] = {
        {c.mesh, {}, shader},
        {{few, c.triangles, vp::core::make_pack(vp::array_view<const float>(c.weights.data(), 2))}, {}, shader}};
    const vp::status s = vp::voxelize(be, std::span<const draw>(draws), c.grid, c.view);
    EXPECT_EQ(s.code, status_code::index_out_of_range);
    EXPECT_EQ(s.draw, 1u);
    EXPECT_TRUE(c.untouched());
}

TEST(BadInput, NullArraysAreRefused) {
    {
        call c;
        c.mesh.positions = {nullptr, 3};
        expect_refused(c, status_code::null_view);
    }
    {
        call c;
        c.mesh.triangles = {nullptr, 1};
        expect_refused(c, status_code::null_view);
    }
    call c; // a null array without elements is an empty array
    c.mesh.positions = {nullptr, 0};
    vp::get<0>(c.mesh.attributes) = {nullptr, 0};
    expect_refused(c, status_code::index_out_of_range);
}

TEST(BadInput, MoreElementsThan32BitsCanNumberAreRefused) {
    call c; // only the lengths are read
    c.mesh.triangles = {c.triangles.data(), std::size_t{1} << 32};
    expect_refused(c, status_code::too_many_triangles);
    c.mesh.triangles = {c.triangles.data(), std::numeric_limits<std::size_t>::max()};
    expect_refused(c, status_code::too_many_triangles);
    c.look();
    c.mesh.positions = {c.positions.data(), std::size_t{1} << 32};
    expect_refused(c, status_code::size_overflow);

    c.look();
    vp::cpu_backend be(1);
    draw half{c.mesh, {}, shader}; // two draws that exceed the limit only together
    half.mesh.triangles = {c.triangles.data(), std::size_t{1} << 31};
    const draw draws[] = {half, half};
    EXPECT_EQ(vp::voxelize(be, std::span<const draw>(draws), c.grid, c.view).code, status_code::too_many_triangles);
    EXPECT_TRUE(c.untouched());
}

TEST(BadInput, AttributesOfAnotherLengthAreRefused) {
    call c;
    vp::cpu_backend be(2);
    const std::vector<float> weights(4, 1.0f);
    const auto with = [&](vp::array_view<const float> attribute) {
        const mesh_type mesh{c.positions, c.triangles, vp::core::make_pack(attribute)};
        const vp::status s = vp::voxelize(be, mesh, c.grid, by_weight{}, shader, c.view);
        if (!s.ok()) {
            EXPECT_TRUE(c.untouched());
        }
        return s.code;
    };
    EXPECT_EQ(with({weights.data(), 2}), status_code::attribute_mismatch);
    EXPECT_EQ(with({weights.data(), 4}), status_code::attribute_mismatch);
    EXPECT_EQ(with({nullptr, 0}), status_code::attribute_mismatch);
    EXPECT_EQ(with({nullptr, 3}), status_code::null_view);
    EXPECT_EQ(with({weights.data(), 3}), status_code::ok);
}

// ---- positions: not an error, but counted ----

TEST(BadInput, PositionsThatAreNotFiniteDropTheirTriangle) {
    for (const float bad : {nan, -nan, infinity, -infinity})
        for (int corner = 0; corner < 3; ++corner)
            for (int axis = 0; axis < 3; ++axis) {
                call c;
                c.positions.insert(c.positions.end(), {{2, 2, 2}, {5, 2, 2}, {2, 5, 2}});
                c.triangles = {{0, 1, 2}, {3, 4, 5}};
                c.positions[static_cast<std::size_t>(corner)][axis] = bad;
                c.look();
                vp::cpu_backend be(2);
                vp::abuffer<vp::cpu_backend> lists{be};
                const vp::status s = vp::voxelize(be, c.mesh, c.grid, by_weight{}, payload, lists);
                ASSERT_TRUE(s.ok()) << s.message();
                EXPECT_EQ(s.counts.triangles_nonfinite, 1u);
                EXPECT_EQ(s.counts.triangles_drawn, 1u);
                for (const auto& [voxel, fragments] : lists.to_host(be))
                    for (const auto& f : fragments) EXPECT_EQ(f.primitive, 1u);
            }
}

TEST(BadInput, AMeshOfBadPositionsOnlyGivesAnEmptyResult) {
    for (const float bad : {nan, infinity, std::numeric_limits<float>::max()}) {
        call c;
        for (glm::vec3& p : c.positions) p = glm::vec3(bad);
        vp::cpu_backend be(2);
        const vp::status s = vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, c.view);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts.triangles_dropped(), 2u);
        EXPECT_EQ(s.counts.fragments, 0u);
        EXPECT_TRUE(std::all_of(c.words.begin(), c.words.end(), [](std::uint32_t w) { return w == 0; })); // cleared
    }
}

TEST(BadInput, AnOriginTooFarAwayDropsEverything) {
    call c;
    for (const double far : {1e30, -1e300, std::numeric_limits<double>::max()}) {
        c.grid.origin = {far, 0, 0};
        vp::cpu_backend be(1);
        const vp::status s = vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, c.view);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts.triangles_too_far, 2u);
    }
}

// ---- grid ----

TEST(BadInput, ExtentsOfZeroOrLessAreRefused) {
    for (const int bad : {0, -1, INT_MIN})
        for (int axis = 0; axis < 3; ++axis) {
            call c;
            c.grid.extent[axis] = bad;
            c.view.extent = c.grid.extent;
            expect_refused(c, status_code::bad_extent);
        }
    call c;
    c.grid.extent = {0, 0, 0};
    expect_refused(c, status_code::bad_extent);
}

TEST(BadInput, ExtentsBeyondTheLimitAreRefused) {
    for (const int bad : {vp::grid::max_extent + 1, INT_MAX})
        for (int axis = 0; axis < 3; ++axis) {
            call c;
            c.grid.extent[axis] = bad;
            c.view.extent = c.grid.extent;
            expect_refused(c, status_code::extent_too_large);
        }
    call c; // as the whole grid of a crop
    c.grid.whole = {vp::grid::max_extent + 1, 8, 8};
    expect_refused(c, status_code::extent_too_large);
}

TEST(BadInput, CropsThatLeaveTheGridAreRefused) {
    call c;
    const vp::grid whole = c.grid;
    for (const glm::ivec3 begin : {glm::ivec3(1, 0, 0), glm::ivec3(0, -1, 0), glm::ivec3(0, 0, 8),
                                   glm::ivec3(INT_MAX, 0, 0), glm::ivec3(0, INT_MIN, 0)}) {
        c.grid = whole.crop(begin, {8, 8, 8});
        expect_refused(c, status_code::bad_crop);
    }
    c.grid = whole.crop({0, 0, 0}, {8, 8, 9});
    c.view.extent = c.grid.extent;
    expect_refused(c, status_code::bad_crop);
    c.grid = whole.crop({4, 4, 4}, {0, 1, 1});
    c.view.extent = c.grid.extent;
    expect_refused(c, status_code::bad_extent);
}

TEST(BadInput, VoxelSizesThatAreNotPositiveAndFiniteAreRefused) {
    for (const double bad : {0.0, -0.0, -1.0, dnan, dinfinity, -dinfinity, 5e-324, 1e-308, 1e-305, 1e308,
                             std::numeric_limits<double>::max()})
        for (int axis = 0; axis < 3; ++axis) {
            call c;
            c.grid.voxel_size[axis] = bad;
            expect_refused(c, status_code::bad_voxel_size);
        }
}

TEST(BadInput, OriginsThatAreNotFiniteAreRefused) {
    for (const double bad : {dnan, dinfinity, -dinfinity})
        for (int axis = 0; axis < 3; ++axis) {
            call c;
            c.grid.origin[axis] = bad;
            expect_refused(c, status_code::bad_origin);
        }
}

TEST(BadInput, ValidateSaysTheSameWithoutAMesh) {
    call c;
    EXPECT_TRUE(vp::validate(c.grid).ok());
    c.grid.voxel_size.y = 0;
    EXPECT_EQ(vp::validate(c.grid).code, status_code::bad_voxel_size);
    c.grid.extent.z = -3;
    EXPECT_EQ(vp::validate(c.grid).code, status_code::bad_voxel_size); // the first wrong axis decides
}

// ---- framebuffer ----

TEST(BadInput, AFramebufferOfAnotherExtentIsRefused) {
    {
        call c;
        c.view.extent = {8, 8, 7};
        expect_refused(c, status_code::extent_mismatch, false);
    }
    {
        call c;
        vp::get<1>(c.view.targets).extent = {8, 9, 8};
        expect_refused(c, status_code::extent_mismatch, false);
    }
    call c;
    c.grid.extent = {4, 8, 8};
    expect_refused(c, status_code::extent_mismatch, false);
}

TEST(BadInput, EnabledTargetsWithoutMemoryAreRefused) {
    for (const vp::load_operation how : {vp::load_operation::clear, vp::load_operation::load}) {
        call c;
        vp::get<1>(c.view.targets).elements = nullptr;
        vp::get<1>(c.view.targets).load = how;
        expect_refused(c, status_code::null_view, false);
    }
    call c; // a target that is off needs no memory
    vp::get<1>(c.view.targets).elements = nullptr;
    vp::get<1>(c.view.targets).load = vp::load_operation::off;
    vp::cpu_backend be(1);
    EXPECT_TRUE(vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, c.view).ok());
}

TEST(BadInput, SizesThatCannotBeAddressedAreRefused) {
    const glm::ivec3 extent(vp::grid::max_extent); // 2^60 voxels of 32 bytes
    vp::cpu_backend be(1);
    call c;
    c.grid.extent = extent;
    c.view.extent = extent;
    vp::get<0>(c.view.targets).load = vp::load_operation::off;
    vp::get<1>(c.view.targets).load = vp::load_operation::off;
    vp::get<2>(c.view.targets).load = vp::load_operation::clear;
    vp::get<2>(c.view.targets).extent = extent;
    vp::get<2>(c.view.targets).elements = reinterpret_cast<glm::dvec4*>(c.depths.data());
    expect_refused(c, status_code::size_overflow, false);
    const std::int64_t before = live_allocations;
    using owner = vp::framebuffer<vp::cpu_backend, large>;
    EXPECT_THROW(owner(be, extent), std::length_error);
    // 2^57 bytes are a valid size, but no machine has that much memory.
    using bit_owner = vp::framebuffer<vp::cpu_backend, bits>;
    static const void* volatile seen = nullptr; // otherwise a compiler may remove the unused allocation
    const auto allocate = [&] {
        const bit_owner fb(be, extent);
        seen = vp::get<0>(fb.view().targets).elements;
    };
    EXPECT_THROW(allocate(), std::bad_alloc);
    EXPECT_EQ(seen, nullptr);
    EXPECT_EQ(live_allocations, before);
}

TEST(BadInput, AFramebufferWithMoreTilesThan32BitsCanNumberIsRefused) {
    call c; // 2^45 tiles; no memory, because the targets are off
    c.grid.extent = glm::ivec3(vp::grid::max_extent);
    c.view.extent = c.grid.extent;
    vp::get<0>(c.view.targets).load = vp::load_operation::off;
    vp::get<1>(c.view.targets).load = vp::load_operation::off;
    expect_refused(c, status_code::size_overflow, false);
}

TEST(BadInput, AFramebufferOfABadExtentOwnsNothingAndIsRefused) {
    vp::cpu_backend be(1);
    for (const glm::ivec3 extent : {glm::ivec3(0, 8, 8), glm::ivec3(8, -1, 8), glm::ivec3(INT_MIN)}) {
        call c;
        vp::framebuffer<vp::cpu_backend, floats, bits, large> fb{be, extent};
        EXPECT_EQ(vp::get<0>(fb).to_host(be).size(), 0u);
        c.grid.extent = extent;
        EXPECT_EQ(vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, fb).code, status_code::bad_extent);
        c.grid.extent = {8, 8, 8};
        EXPECT_EQ(vp::voxelize(be, c.mesh, c.grid, by_weight{}, shader, fb).code, status_code::extent_mismatch);
    }
}

// ---- A-buffer ----

// Nothing is written, not even to the lists of an earlier call.
TEST(BadInput, ARefusedCallLeavesEarlierListsAsTheyWere) {
    call c;
    vp::cpu_backend be(2);
    vp::abuffer<vp::cpu_backend, int> lists{be};
    vp::voxelize(be, c.mesh, c.grid, by_weight{}, payload, lists).or_throw();
    const auto before = lists.to_host(be);
    ASSERT_GT(before.voxels.size(), 10u);
    const auto expect_same = [&] {
        const auto after = lists.to_host(be);
        EXPECT_EQ(after.voxels, before.voxels);
        EXPECT_EQ(after.offsets, before.offsets);
        EXPECT_EQ(after.primitives, before.primitives);
        EXPECT_EQ(after.payloads, before.payloads);
        EXPECT_EQ(after.extent, before.extent);
    };
    vp::grid bad = c.grid;
    bad.voxel_size.x = -1;
    EXPECT_FALSE(vp::voxelize(be, c.mesh, bad, by_weight{}, payload, lists).ok());
    expect_same();
    c.triangles[1].z = 99;
    EXPECT_EQ(vp::voxelize(be, c.mesh, c.grid, by_weight{}, payload, lists).code, status_code::index_out_of_range);
    expect_same();
}

} // namespace
