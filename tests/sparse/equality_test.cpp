// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A sparse framebuffer made dense is the dense framebuffer, bit for bit: every blend, many types, both coverages, clear
// and load and off, discard, crops, several draws; with the same counts.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::mark;
using backend_type = vp::cpu_backend;

struct record {
    std::uint64_t chain;
    std::uint32_t fragments, last;
    bool operator==(const record&) const = default;
};
struct chain { // changes with the order
    static constexpr bool order_free = false;
    VOXELPIPE_HD record identity() const { return {0xcbf29ce484222325u, 0, 0xffffffffu}; }
    VOXELPIPE_HD record combine(record a, record b) const {
        return {(a.chain ^ b.chain) * 0x100000001b3u, a.fragments + b.fragments, b.last};
    }
};

float float_of(std::uint64_t m) { return static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-10f; }

// Every blend, every layout, bits, all widths; values depend on primitive and voxel.
struct first_shader {
    auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = mark(f.primitive, f.voxel);
        return vp::outputs((m >> 20 & 3u) != 0, f.primitive, float_of(m),
                           glm::vec3(float_of(m), float_of(m >> 8), float_of(m >> 16)), static_cast<std::int16_t>(m),
                           vp::half(float_of(m) * 0x1p-14f), m, record{m, 1, f.primitive})
            .discard_if(m % 3 == 0);
    }
};
struct second_shader {
    auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = mark(f.primitive, f.voxel);
        return vp::outputs((m & 8u) != 0, static_cast<double>(float_of(m)), static_cast<std::int8_t>(m),
                           static_cast<std::uint8_t>(m), static_cast<std::uint32_t>(m),
                           glm::vec2(float_of(m >> 3), f.barycentric.x), static_cast<std::uint16_t>(m >> 7),
                           float_of(m));
    }
};

using first_dense =
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_xor>, vp::target<std::uint32_t, blend::replace>,
                    vp::target<float, blend::add>, vp::target<glm::vec3, blend::max, vp::layout::planar>,
                    vp::target<std::int16_t, blend::min, vp::layout::tiled>, vp::target<vp::half, blend::add>,
                    vp::target<std::uint64_t, blend::count>, vp::target<record, chain>>;
using second_dense =
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or, vp::layout::tiled>, vp::target<double, blend::add>,
                    vp::target<std::int8_t, blend::add_saturate>, vp::target<std::uint8_t, blend::add_saturate>,
                    vp::target<std::uint32_t, blend::bit_and>, vp::target<glm::vec2, blend::add, vp::layout::planar>,
                    vp::target<std::uint16_t, blend::bit_or>, vp::target<float, blend::add_quantum<-40>>>;

template <class Dense>
struct sparse_twin;
template <class... Targets>
struct sparse_twin<vp::framebuffer<backend_type, Targets...>> {
    using type = vp::sparse_framebuffer<backend_type, Targets...>;
    static constexpr std::size_t size = sizeof...(Targets);
};

// Compares all elements of all targets, with their padding.
template <class Dense, class Sparse>
void expect_equal(backend_type& backend, const Dense& dense, const Sparse& sparse, const char* what) {
    vp::core::for_each_index<sparse_twin<Dense>::size>([&]<std::size_t I>() {
        const auto a = vp::get<I>(dense).to_host(backend);
        const auto b = vp::get<I>(sparse).to_host_target(backend);
        EXPECT_TRUE(unit::same_bytes(a, b.elements)) << what << ", target " << I;
    });
}

// Calls prepare(framebuffer) on both, draws, and compares results and counts. Returns the counts.
template <class Shader, class Dense, class Sparse, class Prepare>
vp::counters draw_both(const std::vector<unit::small_mesh>& meshes, const vp::grid& grid, vp::coverage rule,
                       const Shader& shader, Dense& dense, Sparse& sparse, const Prepare& prepare, const char* what) {
    backend_type backend = unit::make_backend(2);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, shader});
    prepare(dense);
    prepare(sparse);
    const vp::status a = vp::voxelize(backend, draws, grid, dense, rule);
    const vp::status b = vp::voxelize(backend, draws, grid, sparse, rule);
    EXPECT_TRUE(a.ok() && b.ok()) << what << ": " << a.message() << "; " << b.message();
    EXPECT_EQ(a.counts, b.counts) << what;
    expect_equal(backend, dense, sparse, what);
    return b.counts;
}

const glm::ivec3 extent{77, 70, 69};
const std::vector<unit::small_mesh>& meshes() {
    static const std::vector<unit::small_mesh> m{unit::make_mesh(1, 60, extent), unit::make_mesh(2, 40, extent)};
    return m;
}
constexpr auto as_made = [](auto&) {};

class Sparse : public ::testing::TestWithParam<vp::coverage> {};
INSTANTIATE_TEST_SUITE_P(Coverages, Sparse,
                         ::testing::Values(vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair,
                                           vp::coverage::diagonal));

template <class Dense, class Shader>
void check_targets(const Shader& shader, vp::coverage rule) {
    backend_type backend = unit::make_backend();
    const vp::grid grid = unit::unit_grid(extent);
    Dense dense{backend, extent};
    typename sparse_twin<Dense>::type sparse{backend, extent};
    const vp::counters drawn = draw_both(meshes(), grid, rule, shader, dense, sparse, as_made, "cleared");
    EXPECT_EQ(drawn.voxels, sparse.num_voxels());
    EXPECT_GT(drawn.voxels, 4000u);

    // Onto what is there: voxels stay, new ones start from the clear value. One target clears, one is off.
    const std::vector<unit::small_mesh> more{unit::make_mesh(3, 50, extent)};
    const std::uint64_t before = sparse.num_voxels();
    const auto load = [&](auto& fb) {
        vp::core::for_each_index<sparse_twin<Dense>::size>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
    };
    draw_both(more, grid, rule, shader, dense, sparse, load, "loaded");
    EXPECT_GT(sparse.num_voxels(), before);
    const auto mixed = [&](auto& fb) {
        vp::get<2>(fb).off();
        vp::get<1>(fb).clear({});
        vp::get<0>(fb).clear(true);
        vp::get<5>(fb).clear({});
    };
    draw_both(meshes(), grid, rule, shader, dense, sparse, mixed, "cleared, loaded and off");

    // Off by construction.
    auto enabled = ~std::bitset<sparse_twin<Dense>::size>{};
    enabled[1] = enabled[6] = false;
    Dense few_dense{backend, extent, enabled};
    typename sparse_twin<Dense>::type few_sparse{backend, extent, enabled};
    const vp::status a = vp::voxelize(backend, meshes()[0].view(), grid, vp::passthrough{}, shader, few_dense, rule);
    const vp::status b = vp::voxelize(backend, meshes()[0].view(), grid, vp::passthrough{}, shader, few_sparse, rule);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a.counts, b.counts);
    expect_equal(backend, few_dense, few_sparse, "two targets disabled");
}

TEST_P(Sparse, MadeDenseIsTheDenseFramebufferForAFirstEightTargets) {
    check_targets<first_dense>(first_shader{}, GetParam());
}
TEST_P(Sparse, MadeDenseIsTheDenseFramebufferForASecondEightTargets) {
    check_targets<second_dense>(second_shader{}, GetParam());
}

// A shader that gives every fragment the same values takes another way through the tile.
TEST_P(Sparse, ConstantShadersAgreeToo) {
    backend_type backend = unit::make_backend();
    const vp::grid grid = unit::unit_grid(extent);
    using dense_type =
        vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>,
                        vp::target<std::uint32_t, blend::count>, vp::target<glm::u8vec4, blend::replace>>;
    dense_type dense{backend, extent};
    sparse_twin<dense_type>::type sparse{backend, extent};
    const auto shader = vp::constant(true, 0.1f, 0u, glm::u8vec4(1, 2, 3, 4));
    const auto clear = [](auto& fb) {
        vp::get<1>(fb).clear(3.7f);
        vp::get<2>(fb).clear(5u);
    };
    draw_both(meshes(), grid, GetParam(), shader, dense, sparse, clear, "cleared");
    const auto load = [](auto& fb) {
        vp::get<0>(fb).load();
        vp::get<1>(fb).load();
        vp::get<2>(fb).clear(9u);
    };
    draw_both({unit::make_mesh(5, 30, extent)}, grid, GetParam(), shader, dense, sparse, load, "loaded");
    // Idempotent targets alone need no count of fragments.
    using bits = vp::target<vp::bit, blend::bit_or>;
    vp::framebuffer<backend_type, bits> dense_bits{backend, extent};
    vp::sparse_framebuffer<backend_type, bits> sparse_bits{backend, extent};
    draw_both(meshes(), grid, GetParam(), vp::constant(true), dense_bits, sparse_bits, as_made, "bits");
}

// Crops whose borders run through tiles and bricks: voxels, counts and, put together, the whole.
TEST_P(Sparse, CropsAreTheCropsOfTheWholeAndMergeToIt) {
    backend_type backend = unit::make_backend();
    const vp::grid grid = unit::unit_grid(extent);
    sparse_twin<first_dense>::type whole{backend, extent};
    ASSERT_TRUE(vp::voxelize(backend, meshes()[0].view(), grid, vp::passthrough{}, first_shader{}, whole, GetParam()));
    const auto expected = whole.to_host(backend);
    using host = std::remove_const_t<decltype(expected)>;
    std::vector<host> parts;
    for (const int begin : {0, 19, 40, 41}) {
        const int end = begin == 0 ? 19 : begin == 19 ? 40 : begin == 40 ? 41 : extent.z;
        const vp::grid part = grid.crop({0, 0, begin}, {extent.x, extent.y, end - begin});
        first_dense dense{backend, part.extent};
        sparse_twin<first_dense>::type sparse{backend, part.extent};
        draw_both({meshes()[0]}, part, GetParam(), first_shader{}, dense, sparse, as_made, "a slab");
        parts.push_back(sparse.to_host(backend));
    }
    const host merged = vp::merge(std::span<const host>(parts));
    EXPECT_TRUE(vp::same_contents(merged, expected));
    EXPECT_EQ(merged.where.extent, extent);
    EXPECT_THROW((void)vp::merge(parts[0], parts[0]), std::invalid_argument); // voxels in both

    // On all axes, from within a brick.
    const vp::grid part = grid.crop({13, 35, 9}, {41, 30, 37});
    first_dense dense{backend, part.extent};
    sparse_twin<first_dense>::type sparse{backend, part.extent};
    draw_both(meshes(), part, GetParam(), first_shader{}, dense, sparse, as_made, "a crop");
}

TEST(SparseCalls, WithoutTrianglesClearAsDenseCallsDo) {
    backend_type backend = unit::make_backend();
    using target = vp::target<float, blend::add>;
    const glm::ivec3 small{20, 21, 22};
    const vp::grid grid = unit::unit_grid(small);
    vp::framebuffer<backend_type, target, target> dense{backend, small};
    vp::sparse_framebuffer<backend_type, target, target> sparse{backend, small};
    const std::vector<unit::small_mesh> mesh{unit::make_mesh(4, 20, small)};
    const auto shader = vp::constant(1.0f, 2.0f);
    draw_both(mesh, grid, vp::coverage::conservative, shader, dense, sparse, as_made, "drawn");
    const std::uint64_t voxels = sparse.num_voxels();
    EXPECT_GT(voxels, 0u);
    const auto one = [](auto& fb) {
        vp::get<0>(fb).load();
        vp::get<1>(fb).clear(4.0f);
    };
    draw_both({}, grid, vp::coverage::conservative, shader, dense, sparse, one, "no draws, one target loads");
    EXPECT_EQ(sparse.num_voxels(), voxels);
    vp::get<0>(sparse).clear(0.5f);
    vp::get<0>(dense).clear(0.5f);
    ASSERT_TRUE(vp::clear(backend, dense));
    ASSERT_TRUE(vp::clear(backend, sparse));
    expect_equal(backend, dense, sparse, "cleared");
    EXPECT_EQ(sparse.num_voxels(), 0u);
    EXPECT_EQ(sparse.num_bytes(), 0u);
}

// A clear value that is set after the call is for the next call only.
TEST(SparseCalls, ReadTheClearValueOfTheCallThatClearedThem) {
    backend_type backend = unit::make_backend();
    const glm::ivec3 small{20, 21, 22};
    const vp::grid grid = unit::unit_grid(small);
    using target = vp::target<std::uint32_t, blend::add>;
    vp::framebuffer<backend_type, target> dense{backend, small};
    vp::sparse_framebuffer<backend_type, target> sparse{backend, small};
    const auto seven = [](auto& fb) { vp::get<0>(fb).clear(7u); };
    draw_both({unit::make_mesh(4, 5, small)}, grid, vp::coverage::thin, vp::constant(1u), dense, sparse, seven, "7");
    vp::get<0>(sparse).clear(9u);
    vp::get<0>(dense).clear(9u);
    expect_equal(backend, dense, sparse, "set, not drawn");
    const auto load = [](auto& fb) { vp::get<0>(fb).load(); };
    draw_both({unit::make_mesh(5, 5, small)}, grid, vp::coverage::thin, vp::constant(1u), dense, sparse, load,
              "onto 7");
}

} // namespace
