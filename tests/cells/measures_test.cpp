// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// What a cell's shader can ask for: centroids, areas, and whether more than one sheet cuts the voxel.
#include "cell_support.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace {

using namespace cells;
using values = vp::cell_value;

// The numbers of voxels' fragments, 10 a voxel: the centroid, the area and its centroid, whether it is cut more than
// once, is cut, and the fraction.
struct measures {
    glm::ivec3 extent;
    std::vector<double> all;
    vp::status status;
    static constexpr std::size_t each = 10;

    [[nodiscard]] std::array<double, each> at(const glm::ivec3& p) const {
        std::array<double, each> v{};
        std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(each * solids::index(extent, p.x, p.y, p.z)), each,
                    v.begin());
        return v;
    }
};

struct measuring_shader {
    using fragment = vp::measured_cell<values::centroid, values::area, values::sheets>;
    double* to;
    glm::ivec3 extent, offset;

    vp::output<float> operator()(const fragment& f) const {
        const glm::ivec3 p = f.voxel - offset;
        double* const v = to + measures::each * solids::index(extent, p.x, p.y, p.z);
        for (int i = 0; i < 3; ++i) {
            v[i] = f.centroid[i];
            v[4 + i] = f.area_centroid[i];
        }
        v[3] = f.area;
        v[7] = f.is_multi_cut ? 1 : 0;
        v[8] = f.is_cut ? 1 : 0;
        v[9] = f.fraction;
        return vp::outputs(f.fraction);
    }
};

measures measure(const mesh& m, const vp::grid& g, int axis = 0, unsigned threads = 2) {
    measures r{g.extent, {}, {}};
    const auto voxels = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y) *
                        static_cast<std::size_t>(g.extent.z);
    r.all.assign(voxels * measures::each, 0.0);
    vp::cpu_backend backend(threads);
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(backend, g.extent);
    vp::cell_options options;
    options.axis = axis;
    r.status = vp::voxelize_cells(backend, m.view(), g, vp::passthrough{},
                                  measuring_shader{r.all.data(), g.extent, g.offset}, fb, options);
    EXPECT_TRUE(r.status.ok()) << r.status.message();
    return r;
}

template <class Visit>
void for_each_voxel(const glm::ivec3& extent, const Visit& visit) {
    for (int z = 0; z < extent.z; ++z)
        for (int y = 0; y < extent.y; ++y)
            for (int x = 0; x < extent.x; ++x) visit(glm::ivec3(x, y, z));
}

// A box's part in a voxel is a box, and so is each side's, as one of no thickness. Sides in planes of the lattice
// belong to the voxels below, along all axes.
TEST(CellMeasures, BoxesHaveThoseOfTheirOverlaps) {
    splitmix64 random(17);
    for (int round = 0; round < 12; ++round) {
        glm::dvec3 a, b;
        for (int axis = 0; axis < 3; ++axis) {
            const auto number = [&] { return static_cast<double>(random.next() % 25) / 4.0; };
            a[axis] = number();
            b[axis] = a[axis] + number() + 0.25;
        }
        vp::grid g = solids::unit_grid({7, 8, 6});
        const glm::dvec3 size{0.5, 1.25, 3.0};
        g.voxel_size = size;
        const mesh m = solids::box(glm::vec3(a * size), glm::vec3(b * size));
        const auto found = measure(m, g, round % 3);
        for_each_voxel(g.extent, [&](const glm::ivec3& p) {
            const auto v = found.at(p);
            const glm::dvec3 low(p), high = low + 1.0;
            const glm::dvec3 from = glm::max(a, low), to = glm::min(b, high), part = glm::max(to - from, 0.0);
            for (int i = 0; i < 3 && part.x * part.y * part.z > 0; ++i)
                ASSERT_NEAR(v[static_cast<std::size_t>(i)], (from[i] + to[i]) / 2 - p[i] - 0.5, 1e-6) << round;
            double area = 0;
            glm::dvec3 moment(0);
            for (int i = 0; i < 3; ++i)
                for (const double side : {a[i], b[i]}) {
                    const int j = (i + 1) % 3, k = (i + 2) % 3;
                    if (side <= low[i] || side > high[i]) continue;
                    const double of_side = part[j] * part[k] * size[j] * size[k];
                    glm::dvec3 middle = (from + to) / 2.0 - low - 0.5;
                    middle[i] = side - low[i] - 0.5;
                    area += of_side;
                    moment += of_side * middle;
                }
            ASSERT_NEAR(v[3], area, 1e-9) << round << ' ' << p.x << ' ' << p.y << ' ' << p.z;
            for (int i = 0; i < 3 && area > 0; ++i)
                ASSERT_NEAR(v[4 + static_cast<std::size_t>(i)], moment[i] / area, 1e-6);
        });
    }
}

// The areas of all voxels add up to the mesh's, and moments to the body's centre.
TEST(CellMeasures, SpheresHaveTheAreaAndTheCentreOfTheirPolyhedron) {
    const glm::vec3 centre{8.1f, 7.9f, 8.3f};
    const mesh m = solids::sphere(centre, 6.2f, 3);
    const auto found = measure(m, solids::unit_grid(glm::ivec3(16)));
    double area = 0, volume = 0, exact = 0, several = 0;
    glm::dvec3 moment(0);
    for_each_voxel(found.extent, [&](const glm::ivec3& p) {
        const auto v = found.at(p);
        area += v[3];
        volume += v[9];
        moment += v[9] * (glm::dvec3(p) + 0.5 + glm::dvec3(v[0], v[1], v[2]));
        several += v[7];
    });
    EXPECT_LE(several, 2.0); // a ball can cut off two corners of a voxel
    for (const auto& t : snapped(m, 16)) {
        const auto d = [&](std::size_t i, std::size_t j) { return static_cast<double>(t[i][j] - t[0][j]) / 65536; };
        exact +=
            glm::length(glm::cross(glm::dvec3(d(1, 0), d(1, 1), d(1, 2)), glm::dvec3(d(2, 0), d(2, 1), d(2, 2)))) / 2;
    }
    EXPECT_NEAR(area, exact, 1e-7);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(moment[i] / volume, static_cast<double>(centre[i]), 1e-4);
}

// A crop has the measures of the whole, with triangles in its own upper faces; so has a mesh that is moved by whole
// voxels or whose triangles come in another order, for any number of threads.
TEST(CellMeasures, DoNotDependOnCropsMovesOrOrder) {
    splitmix64 random(37);
    mesh m = solids::random_cycle(random, 8, 0, 8, 4);
    m.add(solids::box({1, 2, 3}, {4, 5, 6}));
    const vp::grid g = solids::unit_grid(glm::ivec3(12, 11, 10));
    for (int axis = 0; axis < 3; ++axis) {
        const auto whole = measure(m, g, axis);
        const auto expect_part = [&](const measures& part, const glm::ivec3& begin) {
            for_each_voxel(part.extent, [&](const glm::ivec3& p) { EXPECT_EQ(part.at(p), whole.at(p + begin)); });
        };
        for (const auto& [begin, size] : {std::pair{glm::ivec3(4, 0, 0), glm::ivec3(3, 11, 10)},
                                          {glm::ivec3(0, 3, 0), glm::ivec3(12, 2, 10)},
                                          {glm::ivec3(2, 1, 4), glm::ivec3(3, 7, 2)}})
            expect_part(measure(m, g.crop(begin, size), axis), begin);
        mesh shuffled = m;
        for (std::size_t i = shuffled.triangles.size(); i > 1; --i)
            std::swap(shuffled.triangles[i - 1], shuffled.triangles[random.next() % i]);
        for (glm::uvec3& t : shuffled.triangles) t = glm::uvec3(t.y, t.z, t.x);
        EXPECT_EQ(measure(shuffled, g, axis, 1).all, whole.all);
        const auto moved = measure(m.moved({2, 1, 1}), solids::unit_grid(glm::ivec3(14, 12, 11)), axis);
        for_each_voxel(g.extent,
                       [&](const glm::ivec3& p) { EXPECT_EQ(moved.at(p + glm::ivec3(2, 1, 1)), whole.at(p)); });
        // Rows along another axis: areas are those of the same polygons, centroids within roundings.
        const auto other = measure(m, g, (axis + 1) % 3);
        for_each_voxel(g.extent, [&](const glm::ivec3& p) {
            const auto v = whole.at(p), w = other.at(p);
            EXPECT_NEAR(v[3], w[3], 1e-10 + 1e-10 * v[3]);
            for (std::size_t i = 0; i < 3 && v[9] > 0.01 && w[9] > 0.01; ++i) EXPECT_NEAR(v[i], w[i], 1e-6);
        });
    }
}

// Overlaps and slivers have no centroid of their own; the status counts them.
TEST(CellMeasures, LostCentroidsAreCounted) {
    mesh m = solids::box({0.25f, 0.25f, 0.25f}, {0.75f, 0.75f, 0.75f});
    m.add(solids::box({0.25f, 0.25f, 0.25f}, {0.75f, 0.75f, 0.5f}).inside_out());
    m.add(solids::box({0.25f, 0.25f, 0.25f}, {0.75f, 0.75f, 0.49f}).inside_out());
    const auto found = measure(m, solids::unit_grid(glm::ivec3(1)));
    EXPECT_EQ(found.status.cells.lost_centroids, 1u);
    EXPECT_EQ(found.at({0, 0, 0})[2], 0.0);
    const mesh thin = solids::box({0, 0, 0}, {0.0009765625f, 0.0009765625f, 0.5f}); // 2^-21
    EXPECT_EQ(measure(thin, solids::unit_grid(glm::ivec3(1))).status.cells.lost_centroids, 1u);
    const mesh enough = solids::box({0, 0, 0}, {0.0009765625f, 0.0009765625f, 1.0f}); // 2^-20
    EXPECT_EQ(measure(enough, solids::unit_grid(glm::ivec3(1))).status.cells.lost_centroids, 0u);
}

// Two walls of a plate are two sheets where a voxel has both and no side joins them within it.
TEST(CellMeasures, SheetsAreJoinedByEdgesWithinTheVoxel) {
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    const auto plate = measure(solids::box({0.5f, 0.5f, 2.25f}, {5.5f, 5.5f, 2.75f}), g);
    for_each_voxel(g.extent, [&](const glm::ivec3& p) {
        const bool is_inner = p.x > 0 && p.x < 5 && p.y > 0 && p.y < 5;
        EXPECT_EQ(plate.at(p)[7], p.z == 2 && is_inner ? 1.0 : 0.0) << p.x << ' ' << p.y << ' ' << p.z;
    });
    // Of one wall a voxel, none.
    const auto thick = measure(solids::box({0.5f, 0.5f, 1.25f}, {5.5f, 5.5f, 2.75f}), g);
    for_each_voxel(g.extent, [&](const glm::ivec3& p) { EXPECT_EQ(thick.at(p)[7], 0.0); });
    // Triangles that share no vertex but lie at the same places are joined; those that touch in a point are not.
    mesh soup;
    for (const glm::uvec3& t : solids::box({1.25f, 1.25f, 1.25f}, {1.75f, 1.75f, 1.75f}).triangles) {
        const mesh box = solids::box({1.25f, 1.25f, 1.25f}, {1.75f, 1.75f, 1.75f});
        const auto n = static_cast<std::uint32_t>(soup.positions.size());
        for (const std::uint32_t v : {t.x, t.y, t.z}) soup.positions.push_back(box.positions[v]);
        soup.triangles.push_back({n, n + 1, n + 2});
    }
    EXPECT_EQ(measure(soup, g).at({1, 1, 1})[7], 0.0);
    soup.add(solids::box({1.75f, 1.75f, 1.75f}, {2.5f, 2.5f, 2.5f}));
    EXPECT_EQ(measure(soup, g).at({1, 1, 1})[7], 1.0);
}

// snippet: measured_cell
// A wall's area and its place, and where the part inside has its middle.
struct wall_and_middle {
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        return vp::outputs(f.fraction, static_cast<float>(f.area), f.centroid.x, f.area_centroid.x);
    }
};
// end snippet

// Targets of a framebuffer hold what a shader asks for.
TEST(CellMeasures, AreDrawnIntoTargets) {
    const mesh m = solids::box({0.25f, 0, 0}, {2, 1, 1});
    vp::cpu_backend backend(1);
    using number = vp::target<float, vp::blend::replace>;
    vp::framebuffer<vp::cpu_backend, number, number, number, number> fb(backend, {2, 1, 1});
    vp::voxelize_cells(backend, m.view(), solids::unit_grid({2, 1, 1}), vp::passthrough{}, wall_and_middle{}, fb)
        .or_throw();
    EXPECT_EQ((vp::get<0>(fb).to_host(backend)), (std::vector<float>{0.75f, 1}));
    // The sides at y = 0 and z = 0 belong to the voxels below, which are not in the grid.
    EXPECT_EQ((vp::get<1>(fb).to_host(backend)), (std::vector<float>{2.5f, 3}));
    EXPECT_EQ((vp::get<2>(fb).to_host(backend)), (std::vector<float>{0.125f, 0}));
    EXPECT_EQ((vp::get<3>(fb).to_host(backend)), (std::vector<float>{-0.025f, 1.0f / 6}));
}

// What is not asked for is not there: the fraction alone has the numbers that it has with all else.
TEST(CellMeasures, DoNotChangeFractions) {
    splitmix64 random(43);
    const mesh m = solids::random_cycle(random, 10, 0, 10, 64);
    const vp::grid g = solids::unit_grid(glm::ivec3(10));
    const auto plain = library_cells(m, g);
    const auto found = measure(m, g);
    for_each_voxel(g.extent, [&](const glm::ivec3& p) {
        const auto units = static_cast<float>(plain.units[plain.index(p.x, p.y, p.z)]);
        EXPECT_EQ(static_cast<float>(found.at(p)[9]), units * 0x1p-44f);
    });
    EXPECT_EQ(plain.status.cells.lost_centroids, 0u);
    EXPECT_EQ(plain.status.cells.volume(), found.status.cells.volume());
}

} // namespace
