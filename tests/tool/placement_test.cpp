// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Boxes on lattices: the grid holds what it has to and no more, thin shells are closed, nothing is drawn in the
// padding.
#include <draw/padding.hpp>
#include <draw/voxelizer.hpp>
#include <model/placement.hpp>
#include <model/targets.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

namespace {

using voxelize::volume;
using voxelpipe::coverage;

constexpr coverage rules[]{coverage::conservative, coverage::thin};
const char* name_of(coverage rule) { return rule == coverage::thin ? "thin" : "conservative"; }

// The surface of the box from LOW to HIGH, which floats round.
voxelize::scene box(const glm::dvec3& low, const glm::dvec3& high) {
    voxelize::primitive part;
    for (int corner = 0; corner < 8; ++corner)
        part.positions.emplace_back((corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y,
                                    (corner & 4) != 0 ? high.z : low.z);
    part.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    voxelize::scene model;
    model.primitives.push_back(part);
    model.instances.push_back({});
    model.materials.emplace_back();
    return model;
}

volume voxelized(voxelize::scene model, voxelize::grid_request request, coverage rule,
                 std::vector<voxelize::target> targets = {voxelize::target::occupancy}) {
    request.coverage = rule;
    voxelize::voxelize_request work;
    work.grid = voxelize::place_grid(request, voxelize::bounds_of(model, 1));
    work.padding = request.padding;
    work.coverage = rule;
    work.targets = std::move(targets);
    work.backend = voxelize::backend_choice::cpu;
    work.threads = 1;
    voxelize::voxelize_stats stats;
    return voxelize::run_voxelizer(std::move(model), work, stats);
}

volume voxelized(const voxelize::scene& model, double size, int padding, coverage rule) {
    voxelize::grid_request request;
    request.voxel_size = glm::dvec3(size);
    request.padding = padding;
    return voxelized(model, request, rule);
}

// True if empty voxels lead, face to face, from outside of the grid to voxel TO.
bool leaks(const volume& v, const glm::ivec3& to) {
    const glm::ivec3 size(v.extent[0] + 2, v.extent[1] + 2, v.extent[2] + 2); // a layer of outside around it
    const auto blocked = [&](const glm::ivec3& p) {
        for (int a = 0; a < 3; ++a)
            if (p[a] == 0 || p[a] == size[a] - 1) return false;
        return v.occupied(p.x - 1, p.y - 1, p.z - 1);
    };
    std::vector<bool> reached(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                              static_cast<std::size_t>(size.z));
    const auto at = [&](const glm::ivec3& p) { return static_cast<std::size_t>((p.z * size.y + p.y) * size.x + p.x); };
    std::vector<glm::ivec3> pending{glm::ivec3(0)};
    reached[0] = true;
    while (!pending.empty()) {
        const glm::ivec3 p = pending.back();
        pending.pop_back();
        for (int axis = 0; axis < 3; ++axis) {
            for (const int step : {-1, 1}) {
                glm::ivec3 next = p;
                next[axis] += step;
                if (next[axis] < 0 || next[axis] >= size[axis] || blocked(next) || reached[at(next)]) continue;
                reached[at(next)] = true;
                pending.push_back(next);
            }
        }
    }
    return reached[at(to + 1)];
}

// Voxels in the outermost PADDING layers.
std::int64_t in_ring(const volume& v, int padding) {
    std::int64_t count = 0;
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                const bool inside = i >= padding && i < v.extent[0] - padding && j >= padding &&
                                    j < v.extent[1] - padding && k >= padding && k < v.extent[2] - padding;
                count += !inside && v.occupied(i, j, k);
            }
    return count;
}

// A box of COUNT voxels of SIZE along each axis, from voxel FIRST of the lattice on. With NOISE the floats there are so
// coarse that a face may lie in the voxel beyond its plane.
void expect_box(const glm::ivec3& count, const glm::ivec3& first, double size, bool noise = false) {
    const voxelize::scene model = box(glm::dvec3(first) * size, glm::dvec3(first + count) * size);
    for (const coverage rule : rules) {
        for (const int padding : {0, 1, 3}) {
            std::ostringstream text;
            text << count.x << " x " << count.y << " x " << count.z << " voxels of " << size << " from " << first.x
                 << ", padding " << padding << ", " << name_of(rule);
            const volume v = voxelized(model, size, padding, rule);
            EXPECT_EQ(0, in_ring(v, padding)) << text.str();
            bool closed = true; // thick enough that something is inside
            for (int a = 0; a < 3; ++a) {
                const std::int64_t extent = v.extent[static_cast<std::size_t>(a)] - 2 * padding;
                // Rounding may push a thin low face over the plane, too.
                if (noise || rule == coverage::thin) {
                    EXPECT_LE(count[a], extent) << text.str();
                    EXPECT_GE(count[a] + 2, extent) << text.str();
                } else {
                    EXPECT_EQ(count[a], extent) << text.str();
                    EXPECT_NEAR((first[a] - padding) * size, v.origin[static_cast<std::size_t>(a)], 1e-9) << text.str();
                }
                closed = closed && count[a] >= 4;
            }
            if (!noise && rule == coverage::conservative) {
                const glm::ivec3 hollow = glm::max(count - 2, 0);
                EXPECT_EQ(count.x * count.y * count.z - hollow.x * hollow.y * hollow.z, v.popcount()) << text.str();
            }
            if (closed) {
                EXPECT_FALSE(leaks(v, glm::ivec3(padding) + count / 2)) << text.str();
            }
        }
    }
}

// A box of K voxels of SIZE, k x k x k without a look at the voxels.
void expect_extent(int k, double size) {
    voxelize::grid_request request;
    request.voxel_size = glm::dvec3(size);
    const voxelize::bounding_box bounds = voxelize::bounds_of(box(glm::dvec3(0), glm::dvec3(k * size)), 1);
    EXPECT_EQ(glm::ivec3(k), voxelize::place_grid(request, bounds).extent) << size;
    request.coverage = coverage::thin;
    EXPECT_EQ(glm::ivec3(k + 1), voxelize::place_grid(request, bounds).extent) << size;
}

TEST(Placement, DecimalSizesSpanTheirOwnVoxels) {
    for (int k = 1; k <= 40; ++k) expect_box(glm::ivec3(k), glm::ivec3(0), 0.1);
    for (int k = 41; k <= 1000; ++k) expect_extent(k, 0.1);
    expect_box({6, 7, 11}, {-13, 29, 57}, 0.1);
    expect_box({6, 7, 11}, {-13, 29, 1007}, 0.1, true);
    expect_box({4, 5, 6}, {10007, -20011, 30013}, 0.01, true);
}

TEST(Placement, ThirdsSpanTheirOwnVoxels) {
    for (int k = 1; k <= 20; ++k) expect_box(glm::ivec3(k), glm::ivec3(0), 1.0 / 3);
    expect_box({7, 4, 10}, {-5, 200, 12}, 1.0 / 3);
}

TEST(Placement, PowersOfTwoSpanTheirOwnVoxels) {
    for (const double size : {1.0 / 1024, 0.25, 1.0, 2.0, 4096.0}) {
        expect_box({4, 8, 16}, {0, 0, 0}, size);
        expect_box({5, 4, 7}, {-3, 17, -100}, size);
    }
    expect_box({10, 20, 30}, {0, 0, 0}, 1);
}

// Faces in planes of the lattice: the low ones in the first voxel, the high ones in the voxel beyond.
TEST(Placement, ThinFacesInAPlaneLieInTheVoxelAbove) {
    const volume v = voxelized(box(glm::dvec3(0), {10, 20, 30}), 1, 0, coverage::thin);
    EXPECT_EQ((std::array<std::int64_t, 3>{11, 21, 31}), v.extent);
    EXPECT_EQ(11 * 21 * 31 - 9 * 19 * 29, v.popcount());
    const volume cube = voxelized(box(glm::dvec3(0), glm::dvec3(1)), 0.25, 0, coverage::thin);
    EXPECT_EQ((std::array<std::int64_t, 3>{5, 5, 5}), cube.extent);
    EXPECT_EQ(125 - 27, cube.popcount());
}

TEST(Placement, BoxesBetweenPlanesAreHeldByWhatTheyTouch) {
    const voxelize::scene model = box({0.3, -0.7, 2.25}, {5.5, 4.001, 8.75});
    for (const coverage rule : rules) {
        const volume v = voxelized(model, 1, 0, rule);
        EXPECT_EQ((std::array<std::int64_t, 3>{6, 6, 7}), v.extent) << name_of(rule);
        EXPECT_EQ((std::array<double, 3>{0, -1, 2}), v.origin) << name_of(rule);
        EXPECT_FALSE(leaks(v, {3, 3, 3})) << name_of(rule);
    }
}

// Planes and points: a voxel at least, wherever they lie.
TEST(Placement, ModelsWithoutVolumeGetALayer) {
    const volume sheet = voxelized(box({0, 0, 2}, {4, 3, 2}), 1, 0, coverage::conservative);
    EXPECT_EQ((std::array<std::int64_t, 3>{4, 3, 1}), sheet.extent);
    EXPECT_EQ(12, sheet.popcount());
    const volume thin = voxelized(box({0, 0, 2}, {4, 3, 2}), 1, 0, coverage::thin);
    EXPECT_EQ((std::array<std::int64_t, 3>{5, 4, 1}), thin.extent);
    EXPECT_EQ(20, thin.popcount()); // every column that the sheet touches
}

TEST(Placement, ResolutionGivesBoxesTheirProportions) {
    for (const coverage rule : rules) {
        for (const auto& [resolution, padding] :
             {std::pair{128, 0}, std::pair{64, 0}, std::pair{256, 0}, std::pair{132, 2}}) {
            voxelize::grid_request request;
            request.resolution = resolution;
            request.padding = padding;
            const volume v = voxelized(box({1, 1, 1}, {3, 2, 2}), request, rule);
            const std::int64_t half = (resolution - 2 * padding) / 2 + 2 * padding;
            EXPECT_EQ((std::array<std::int64_t, 3>{resolution, half, half}), v.extent) << resolution;
            EXPECT_EQ(0, in_ring(v, padding));
            EXPECT_FALSE(leaks(v, glm::ivec3(static_cast<int>(half / 2))));
            std::int64_t low = 0, high = 0; // along y
            for (std::int64_t k = 0; k < v.extent[2]; ++k)
                for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                    low += v.occupied(i, padding, k);
                    high += v.occupied(i, v.extent[1] - 1 - padding, k);
                }
            EXPECT_EQ(low, high);
            EXPECT_LT(0, low);
        }
    }
}

// Every channel's rows, in a ring of its empty value.
// Some compilers leave the rounding to float out, see place_grid.
TEST(Placement, DigitsBeyondFloatDoNotMoveTheGrid) {
    voxelize::grid_request request;
    request.resolution = 64;
    const voxelize::bounding_box bounds{{-0.94747634, -0.90097301, -0.98100002}, {0.9474, 0.90089998, 0.98123}, false};
    voxelize::bounding_box rounded = bounds;
    for (int axis = 0; axis < 3; ++axis) {
        volatile float low = static_cast<float>(bounds.low[axis]), high = static_cast<float>(bounds.high[axis]);
        rounded.low[axis] = low;
        rounded.high[axis] = high;
        EXPECT_NE(rounded.low[axis], bounds.low[axis]);
    }
    const voxelpipe::grid grid = place_grid(request, bounds), expected = place_grid(request, rounded);
    EXPECT_EQ(grid.origin, expected.origin);
    EXPECT_EQ(grid.voxel_size, expected.voxel_size);
}

TEST(Placement, PaddingHoldsTheEmptyValueOfEveryTarget) {
    const voxelize::scene model = box({0.2, 0.1, 0.3}, {37.7, 4.6, 3.4});
    std::vector<voxelize::target> all;
    for (const voxelize::target_info& entry : voxelize::target_table) all.push_back(entry.id);
    voxelize::grid_request request;
    request.voxel_size = glm::dvec3(1);
    const volume inner = voxelized(model, request, coverage::conservative, all);
    for (const int padding : {1, 5, 32, 33}) {
        request.padding = padding;
        const volume v = voxelized(model, request, coverage::conservative, all);
        ASSERT_NO_THROW(v.check());
        EXPECT_EQ(inner.popcount(), v.popcount());
        for (const voxelize::target_info& entry : voxelize::target_table) {
            const voxelize::channel& from = *inner.find(entry.name);
            const voxelize::channel& to = *v.find(entry.name);
            const std::size_t voxel = size_of(entry.type) * static_cast<std::size_t>(entry.components);
            std::vector<std::byte> empty(voxel);
            for (std::size_t at = 0; at + 4 <= voxel; at += 4) std::memcpy(empty.data() + at, &entry.empty, 4);
            std::size_t wrong = 0;
            for (std::int64_t k = 0; k < v.extent[2]; ++k)
                for (std::int64_t j = 0; j < v.extent[1]; ++j)
                    for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                        const std::int64_t x = i - padding, y = j - padding, z = k - padding;
                        const bool inside = x >= 0 && x < inner.extent[0] && y >= 0 && y < inner.extent[1] && z >= 0 &&
                                            z < inner.extent[2];
                        if (voxel == 0) {
                            wrong += v.bit(to, i, j, k) != (inside && inner.bit(from, x, y, z));
                            continue;
                        }
                        const std::byte* const expected =
                            inside ? from.data.data() + static_cast<std::size_t>(inner.index(x, y, z)) * voxel
                                   : empty.data();
                        wrong +=
                            std::memcmp(expected, to.data.data() + static_cast<std::size_t>(v.index(i, j, k)) * voxel,
                                        voxel) != 0;
                    }
            EXPECT_EQ(0U, wrong) << entry.name << ", padding " << padding;
        }
    }
}

TEST(Placement, RequestsThatNameNoGridAreRefused) {
    const voxelize::bounding_box bounds{glm::dvec3(0), glm::dvec3(1), false};
    const auto refused = [&](const voxelize::grid_request& request) {
        EXPECT_THROW((void)voxelize::place_grid(request, bounds), voxelize::grid_error);
    };
    voxelize::grid_request request;
    request.voxel_size = glm::dvec3(1e-9);
    refused(request);
    request.voxel_size = glm::dvec3(-1);
    refused(request);
    request = {};
    request.resolution = 4;
    request.padding = 2;
    refused(request);
}

} // namespace
