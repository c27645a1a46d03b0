// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A mesh remembers the largest of its indices. A view that is changed afterwards must not use that number.

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace vp = voxelpipe;

namespace {

const std::vector<glm::vec3> positions(6);
const std::vector<glm::uvec3> triangles{{0, 1, 2}, {3, 5, 1}, {2, 2, 4}};

TEST(Mesh, KnowsItsLargestIndex) {
    vp::cpu_backend be;
    vp::mesh<vp::cpu_backend> m(be, positions, triangles);
    EXPECT_TRUE(m.view().has_checked_indices());
    EXPECT_EQ(m.view().checked.bound, 6u);
    const vp::mesh<vp::cpu_backend> moved = std::move(m);
    EXPECT_TRUE(moved.view().has_checked_indices());
    const std::vector<float> weights(6);
    const vp::mesh<vp::cpu_backend, float> weighed(be, positions, triangles, weights);
    EXPECT_TRUE(weighed.view().has_checked_indices());
    const vp::mesh<vp::cpu_backend> none(be, positions, std::vector<glm::uvec3>{});
    EXPECT_TRUE(none.view().has_checked_indices());
}

TEST(Mesh, KnowsNothingOfOtherTriangles) {
    vp::cpu_backend be;
    const vp::mesh<vp::cpu_backend> m(be, positions, triangles), same(be, positions, triangles);
    vp::mesh_view<> v = m.view();
    v.triangles = same.view().triangles;
    EXPECT_FALSE(v.has_checked_indices());
    v = m.view();
    v.triangles.count = 2; // a part with the same begin
    EXPECT_TRUE(v.has_checked_indices());
    v = m.view();
    v.triangles = {v.triangles.data() + 1, 2};
    EXPECT_FALSE(v.has_checked_indices());
    v = m.view();
    v.checked.count = 2;
    EXPECT_FALSE(v.has_checked_indices());
    const vp::mesh_view<> of_vectors{positions, triangles};
    EXPECT_FALSE(of_vectors.has_checked_indices());
}

TEST(Mesh, AnIndexOutOfRangeIsAnErrorOfTheCall) {
    vp::cpu_backend be;
    for (const std::uint32_t index : {6u, 0x80000000u, 0xffffffffu})
        for (int corner = 0; corner < 3; ++corner) {
            std::vector<glm::uvec3> bad = triangles;
            bad[1][corner] = index;
            const vp::mesh<vp::cpu_backend> m(be, positions, bad);
            EXPECT_FALSE(m.view().has_checked_indices());
            EXPECT_EQ(m.view().checked.bound, std::uint64_t{index} + 1);
            vp::grid g;
            g.extent = glm::ivec3(4);
            vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{be, g.extent};
            EXPECT_EQ(vp::voxelize(be, m, g, vp::passthrough{}, vp::constant(true), fb).code,
                      vp::status_code::index_out_of_range);
        }
    const vp::mesh<vp::cpu_backend> m(be, positions, triangles);
    vp::mesh_view<> v = m.view();
    v.positions.count = 5; // the last vertex, which a triangle uses, is gone
    EXPECT_FALSE(v.has_checked_indices());
}

TEST(Mesh, KnowsNothingOfIndicesInForeignMemory) {
    vp::cpu_backend be;
    vp::mesh_view<> v{positions, triangles};
    v.checked = vp::check_indices(be, v.triangles);
    EXPECT_TRUE(v.has_checked_indices());
    EXPECT_EQ(v.checked.bound, 6u);
    EXPECT_EQ(vp::check_indices(be, {}).bound, 0u);
    EXPECT_EQ(vp::check_indices(be, {triangles.data(), 1}).bound, 3u);
}

// ---- what a mesh is made from: every form gives the same mesh ----

struct packed_vertex {
    std::uint16_t id;
    glm::vec3 position;
    glm::u8vec4 colour;
    float weight;
};
const std::vector<packed_vertex> packed{{7, {1, 1, 1}, {1, 2, 3, 4}, 0.5f},
                                        {8, {6, 1, 2}, {5, 6, 7, 8}, 1.5f},
                                        {9, {1, 6, 3}, {9, 10, 11, 12}, 2.5f},
                                        {10, {6, 6, 6}, {13, 14, 15, 16}, 3.5f}};

template <class Mesh>
std::vector<glm::uvec3> triangles_of(const Mesh& m) {
    const auto t = m.view().triangles;
    return {t.begin(), t.end()};
}

TEST(MeshSource, InterleavedVertices) {
    vp::cpu_backend be;
    const std::vector<glm::uvec3> two{{0, 1, 2}, {2, 1, 3}};
    const vp::mesh m{be, vp::member_of(packed, &packed_vertex::position), two,
                     vp::member_of(packed, &packed_vertex::colour), vp::member_of(packed, &packed_vertex::weight)};
    static_assert(std::is_same_v<decltype(m.view()), vp::mesh_view<glm::u8vec4, float>>);
    const auto v = m.view();
    ASSERT_EQ(v.positions.size(), packed.size());
    for (std::size_t i = 0; i < packed.size(); ++i) {
        EXPECT_EQ(v.positions[i], packed[i].position);
        EXPECT_EQ(vp::get<0>(v.attributes)[i], packed[i].colour);
        EXPECT_EQ(vp::get<1>(v.attributes)[i], packed[i].weight);
    }
    // Floats in bytes, at no alignment.
    std::vector<unsigned char> bytes(1 + 3 * 15);
    for (std::size_t i = 0; i < 3; ++i) std::memcpy(&bytes[1 + 15 * i], &packed[i].position, 12);
    const vp::mesh unaligned{be, vp::strided_view<glm::vec3>{&bytes[1], 3, 15}, vp::no_indices{}};
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(unaligned.view().positions[i], packed[i].position);
    const std::vector<packed_vertex> none;
    const vp::mesh empty{be, vp::member_of(none, &packed_vertex::position), vp::no_indices{}};
    EXPECT_EQ(empty.view().positions.size(), 0u);
}

template <class Index>
class Indices : public ::testing::Test {};
using index_types = ::testing::Types<std::uint8_t, std::uint16_t, std::int16_t, std::int32_t, std::uint32_t>;
TYPED_TEST_SUITE(Indices, index_types);

TYPED_TEST(Indices, FlatOrInTriples) {
    vp::cpu_backend be;
    std::vector<TypeParam> flat;
    std::vector<glm::vec<3, TypeParam>> triples;
    for (const glm::uvec3& t : triangles) {
        for (int k = 0; k < 3; ++k) flat.push_back(static_cast<TypeParam>(t[k]));
        triples.emplace_back(t);
    }
    const vp::mesh from_flat{be, positions, flat}, from_triples{be, positions, triples};
    EXPECT_EQ(triangles_of(from_flat), triangles);
    EXPECT_EQ(triangles_of(from_triples), triangles);
    EXPECT_EQ(from_flat.view().checked.bound, 6u);
    EXPECT_TRUE(from_flat.view().has_checked_indices());
    flat.pop_back();
    EXPECT_THROW((vp::mesh{be, positions, flat}), std::invalid_argument);
    if (std::is_signed_v<TypeParam>) {
        triples[0].y = static_cast<TypeParam>(-1);
        const vp::mesh negative{be, positions, triples};
        EXPECT_FALSE(negative.view().has_checked_indices());
    }
}

TEST(MeshSource, NoIndices) {
    vp::cpu_backend be;
    const std::vector<float> weights(6, 1.0f);
    const vp::mesh m{be, positions, vp::no_indices{}, weights};
    EXPECT_EQ(triangles_of(m), (std::vector<glm::uvec3>{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_TRUE(m.view().has_checked_indices());
    const std::vector<glm::vec3> four(4);
    EXPECT_THROW((vp::mesh{be, four, vp::no_indices{}}), std::invalid_argument);
}

TEST(MeshSource, MemoryOfTheBackendAndFlatIndicesWhereTheyLie) {
    vp::cpu_backend be;
    const vp::mesh m{be, positions, triangles};
    const vp::mesh copy{be, m.view().positions, m.view().triangles};
    EXPECT_NE(copy.view().triangles.data(), m.view().triangles.data());
    EXPECT_EQ(triangles_of(copy), triangles);
    EXPECT_EQ(copy.view().checked.bound, 6u);
    const std::vector<std::uint32_t> flat{0, 1, 2, 3, 5, 1, 2, 2, 4};
    const vp::mesh_view<> view{positions, vp::as_triangles(flat)};
    EXPECT_EQ(static_cast<const void*>(view.triangles.data()), flat.data());
    EXPECT_EQ(std::vector<glm::uvec3>(view.triangles.begin(), view.triangles.end()), triangles);
    EXPECT_THROW((void)vp::as_triangles({flat.data(), 8}), std::invalid_argument);
}

} // namespace
