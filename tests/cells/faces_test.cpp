// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// cell_value::faces: the centroids of the inside parts of voxels' faces, against exact fractions and closed formulas.
#include "cell_support.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace cells;

struct face_values {
    std::int64_t aperture, next_aperture;
    std::array<float, 3> centroid, next_centroid;
    bool operator==(const face_values&) const = default;
};

template <class Fragment>
struct face_shader {
    using fragment = Fragment;
    face_values* to;
    glm::ivec3 extent, offset;

    vp::output<float> operator()(const fragment& f) const {
        const glm::ivec3 p = f.voxel - offset;
        const glm::vec3 &a = f.aperture_centroid, &b = f.next_aperture_centroid;
        to[solids::index(extent, p.x, p.y, p.z)] = {f.aperture, f.next_aperture, {a.x, a.y, a.z}, {b.x, b.y, b.z}};
        return vp::outputs(f.fraction);
    }
};
using faces_alone = vp::measured_cell<vp::cell_value::faces>;
using with_all =
    vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area, vp::cell_value::sheets, vp::cell_value::faces>;

// Of voxels without a fragment all is 0.
template <class Fragment = faces_alone>
std::vector<face_values> faces_of(const mesh& m, const vp::grid& g, int axis, unsigned threads = 2) {
    const auto voxels = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y) *
                        static_cast<std::size_t>(g.extent.z);
    std::vector<face_values> all(voxels);
    vp::cpu_backend backend(threads);
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(backend, g.extent);
    const vp::status s = vp::voxelize_cells(backend, m.view(), g, vp::passthrough{},
                                            face_shader<Fragment>{all.data(), g.extent, g.offset}, fb, {.axis = axis});
    EXPECT_TRUE(s.ok()) << s.message();
    return all;
}

template <class Visit>
void for_each_voxel(const glm::ivec3& extent, const Visit& visit) {
    for (int z = 0; z < extent.z; ++z)
        for (int y = 0; y < extent.y; ++y)
            for (int x = 0; x < extent.x; ++x) visit(glm::ivec3(x, y, z));
}

// A box's part of a face is a rectangle, whose middle is that of the overlap.
TEST(CellFaces, OfBoxesAreThoseOfTheirOverlaps) {
    splitmix64 random(61);
    for (int round = 0; round < 12; ++round) {
        const int axis = round % 3;
        glm::dvec3 a, b;
        for (int i = 0; i < 3; ++i) {
            const auto number = [&] { return static_cast<double>(random.next() % 25) / 4.0; };
            a[i] = number();
            b[i] = a[i] + number() + 0.25;
        }
        vp::grid g = solids::unit_grid({7, 8, 6});
        g.voxel_size = {0.5, 1.25, 3.0}; // centroids are in voxels
        const mesh m = solids::box(glm::vec3(a * g.voxel_size), glm::vec3(b * g.voxel_size));
        const auto found = faces_of(m, g, axis);
        for_each_voxel(g.extent, [&](const glm::ivec3& p) {
            const face_values& v = found[solids::index(g.extent, p.x, p.y, p.z)];
            for (const bool upper : {false, true}) {
                const double plane = p[axis] + (upper ? 1 : 0);
                double area = plane >= a[axis] && plane < b[axis] ? 1 : 0; // a side in the plane lies below it
                glm::dvec3 middle(0);
                for (int i = 0; i < 3; ++i) {
                    if (i == axis) continue;
                    const double from = std::max<double>(a[i], p[i]), to = std::min<double>(b[i], p[i] + 1);
                    area *= std::max(0.0, to - from);
                    middle[i] = (from + to) / 2 - p[i] - 0.5;
                }
                const auto& c = upper ? v.next_centroid : v.centroid;
                EXPECT_EQ(static_cast<double>(upper ? v.next_aperture : v.aperture), std::ldexp(area, 44));
                for (int i = 0; i < 3; ++i)
                    EXPECT_EQ(c[static_cast<std::size_t>(i)], area > 0 ? static_cast<float>(middle[i]) : 0.0F);
            }
        });
    }
}

// Random closed meshes: apertures within the bound a triangle of the face, centroids the quotients of exact moments.
TEST(CellFaces, AreThoseOfTheOracle) {
    splitmix64 random(67);
    constexpr int bits = 8;
    std::size_t checked = 0, inner = 0;
    for (int round = 0; round < 6; ++round) {
        const int axis = round % 3;
        const mesh m = solids::random_cycle(random, 6, -1, 6, 1 << bits);
        const vp::grid g = solids::unit_grid({5, 4, 5});
        const auto found = faces_of(m, g, axis);
        auto exact = snapped(m, bits);
        for (oracle::lattice_triangle& t : exact) // the oracle's rows run along x
            for (auto& p : t) std::rotate(p.begin(), p.begin() + axis, p.end());
        for_each_voxel(g.extent, [&](const glm::ivec3& p) {
            const face_values& v = found[solids::index(g.extent, p.x, p.y, p.z)];
            for (const int step : {0, 1}) {
                std::array<int, 3> voxel{p.x, p.y, p.z};
                voxel[static_cast<std::size_t>(axis)] += step;
                std::rotate(voxel.begin(), voxel.begin() + axis, voxel.end());
                long double cover = 0.0L;
                std::array<long double, 2> moment{};
                std::size_t touching = 0;
                for (const oracle::lattice_triangle& t : exact) {
                    const oracle::cell_part part = oracle::cell_of(t, bits, voxel);
                    cover += part.cover;
                    for (std::size_t i = 0; i < 2; ++i) moment[i] += part.cover_moment[i];
                    touching += part.touches_face ? 1 : 0;
                }
                const double margin = face_bound * static_cast<double>(touching) + slack;
                const std::int64_t units = step == 0 ? v.aperture : v.next_aperture;
                ASSERT_LE(std::abs(static_cast<long double>(units) - std::ldexp(cover, 44)), margin);
                const auto& c = step == 0 ? v.centroid : v.next_centroid;
                ASSERT_EQ(c[static_cast<std::size_t>(axis)], 0.0F);
                const bool is_lost = std::abs(cover) < 0x1p-20L || std::abs(moment[0]) > 0.5L * std::abs(cover) ||
                                     std::abs(moment[1]) > 0.5L * std::abs(cover);
                for (std::size_t i = 0; i < 2; ++i) {
                    const float at = c[(static_cast<std::size_t>(axis) + 1 + i) % 3];
                    ASSERT_LE(std::abs(at), 0.5F);
                    if (is_lost) continue;
                    const long double q = moment[i] / cover;
                    // Both sums are off by the margin at most, and the float by half of its last digit.
                    const long double off = std::ldexp(1.5L * margin, -44) / std::abs(cover) + std::abs(q) * 0x1p-23L;
                    ASSERT_LE(std::abs(static_cast<long double>(at) - q), off) << round;
                    ++checked;
                    inner += std::abs(q) > 0.01L ? 1 : 0;
                }
            }
        });
    }
    EXPECT_GT(checked, 500u);
    EXPECT_GT(inner, 200u);
}

// Each face has one centroid, whichever voxel sees it; crops, threads, and what else is asked for change nothing.
TEST(CellFaces, AreThoseOfTheNeighbours) {
    splitmix64 random(71);
    mesh m = solids::random_cycle(random, 8, 0, 8, 4);
    m.add(solids::sphere({5.1F, 4.9F, 5.3F}, 3.7F, 2));
    const vp::grid g = solids::unit_grid({12, 11, 10});
    for (int axis = 0; axis < 3; ++axis) {
        const auto whole = faces_of(m, g, axis);
        EXPECT_EQ(faces_of(m, g, axis, 1), whole);
        EXPECT_EQ(faces_of<with_all>(m, g, axis), whole);
        std::size_t cut = 0;
        for_each_voxel(g.extent, [&](glm::ivec3 p) {
            const face_values& v = whole[solids::index(g.extent, p.x, p.y, p.z)];
            if (++p[axis] == g.extent[axis]) return;
            const face_values& next = whole[solids::index(g.extent, p.x, p.y, p.z)];
            EXPECT_EQ(v.next_aperture, next.aperture);
            EXPECT_EQ(v.next_centroid, next.centroid);
            cut += v.next_centroid != std::array<float, 3>{} ? 1 : 0;
        });
        EXPECT_GT(cut, 50u);
        struct box_of_voxels {
            glm::ivec3 begin, size;
        };
        for (const box_of_voxels& box : {box_of_voxels{glm::ivec3(4, 2, 3), glm::ivec3(3, 5, 4)},
                                         box_of_voxels{glm::ivec3(0, 3, 0), glm::ivec3(12, 2, 10)}}) {
            const glm::ivec3 begin = box.begin, size = box.size;
            const auto part = faces_of(m, g.crop(begin, size), axis);
            for_each_voxel(size, [&](const glm::ivec3& p) {
                const glm::ivec3 at = p + begin;
                EXPECT_EQ(part[solids::index(size, p.x, p.y, p.z)], whole[solids::index(g.extent, at.x, at.y, at.z)]);
            });
        }
    }
}

// Parts of opposite signs have no middle in the face; nor have faces of less than 2^-20.
TEST(CellFaces, WithoutAPlaceHaveTheirCentre) {
    const vp::grid g = solids::unit_grid({2, 1, 1});
    mesh m = solids::box({0.5F, 0.25F, 0.25F}, {1.5F, 0.75F, 0.75F});
    m.add(solids::box({0.5F, 0.25F, 0.25F}, {1.5F, 0.75F, 0.74F}).inside_out());
    const auto thin = faces_of(m, g, 0); // a strip of 0.01 at the high side
    EXPECT_NEAR(thin[0].next_centroid[2], 0.245F, 1e-4F);
    m.add(solids::box({0.5F, 0.25F, 0.25F}, {1.5F, 0.75F, 0.255F}).inside_out());
    const auto found = faces_of(m, g, 0);
    EXPECT_GT(found[0].next_aperture, std::int64_t{1} << 24);
    EXPECT_EQ(found[0].next_centroid, (std::array<float, 3>{})); // the quotient is about 0.7
    const auto small = [&](float width) {
        return faces_of(solids::box({0.5F, 0, 0}, {1.5F, 0.0009765625F, width}), g, 0)[0].next_centroid;
    };
    EXPECT_EQ(small(0.00048828125F), (std::array<float, 3>{})); // 2^-21
    EXPECT_EQ(small(0.0009765625F)[1], 0.00048828125F - 0.5F);
}

} // namespace
