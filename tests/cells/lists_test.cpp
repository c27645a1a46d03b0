// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_cells into A-buffers: which bodies share a voxel, and how much of it each has, against exact fractions and
// against each body's own call.
#include "cell_support.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace {

using namespace cells;
constexpr int fraction_bits = 8;

struct listed_cell {
    std::uint32_t draw;
    std::int64_t units;
    bool is_cut;
};
struct listing_shader {
    VOXELPIPE_HD vp::output<listed_cell> operator()(const vp::cell_fragment& f) const {
        return vp::outputs(listed_cell{f.draw, f.units, f.is_cut});
    }
};
template <class Shader>
using cell_draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;

template <class Shader>
std::vector<cell_draw<Shader>> draws_of(const std::vector<mesh>& meshes, const Shader& shader) {
    std::vector<cell_draw<Shader>> all;
    for (const mesh& m : meshes) all.push_back({m.view(), {}, shader});
    return all;
}
template <class Payload, class Shader>
vp::host_abuffer<Payload> lists_of(const std::vector<mesh>& meshes, const vp::grid& g, const Shader& shader,
                                   const vp::cell_options& options, vp::status* status = nullptr,
                                   unsigned threads = 2) {
    vp::cpu_backend backend(threads);
    vp::abuffer<vp::cpu_backend, Payload> lists(backend);
    const vp::status s = vp::voxelize_cells(backend, draws_of(meshes, shader), g, lists, options);
    EXPECT_TRUE(s.ok()) << s.message();
    if (status != nullptr) *status = s;
    EXPECT_EQ(lists.num_voxels(), s.counts.voxels);
    EXPECT_EQ(lists.num_fragments(), s.counts.fragments);
    return lists.to_host(backend);
}

// Positions are multiples of 2^-8, which a unit grid of such a fraction and a finer one hold.
std::vector<mesh> bodies_of(splitmix64& random) {
    std::vector<mesh> all{solids::box({0.75F, 1.5F, 1.25F}, {4.25F, 4, 4.5F}),
                          solids::box({4.25F, 1.5F, 1.25F}, {6, 4, 4.5F})};
    for (int i = 0; i < 2; ++i) all.push_back(solids::random_cycle(random, 5, -1, 7, 1 << fraction_bits));
    all.push_back(solids::box({2, 2, 2}, {3, 3, 3}).inside_out());
    return all;
}

// Each fragment is within the bound of the exact fraction of its draw, draws ascend, and no part of a body is missing.
TEST(CellLists, BodiesHaveTheFractionsOfTheOracle) {
    splitmix64 random(11);
    std::size_t shared = 0, several = 0;
    for (int round = 0; round < 3; ++round) {
        const std::vector<mesh> meshes = bodies_of(random);
        const glm::ivec3 extent(6, 5, 6);
        vp::grid g = solids::unit_grid(extent);
        const auto lists =
            lists_of<listed_cell>(meshes, g, listing_shader{}, {.bodies = vp::bodies::draw, .axis = round});
        std::vector<std::vector<oracle::lattice_triangle>> exact;
        for (const mesh& m : meshes) {
            exact.push_back(snapped(m, fraction_bits));
            // The oracle's rows run along x; the axis that rows run along comes first.
            for (oracle::lattice_triangle& t : exact.back())
                for (auto& p : t) std::rotate(p.begin(), p.begin() + round, p.end());
        }
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    const auto found = lists.find({x, y, z});
                    std::array<int, 3> voxel{x, y, z};
                    std::rotate(voxel.begin(), voxel.begin() + round, voxel.end());
                    std::size_t next = 0;
                    for (std::uint32_t body = 0; body < exact.size(); ++body) {
                        long double part = 0.0L;
                        std::size_t touching = 0;
                        for (const oracle::lattice_triangle& t : exact[body]) {
                            const oracle::cell_part of = oracle::cell_of(t, fraction_bits, voxel);
                            part += of.fraction;
                            touching += of.touches ? 1 : 0;
                        }
                        const double margin = bound * static_cast<double>(touching) + slack;
                        if (next == found.size() || found[next].primitive != body) {
                            ASSERT_LE(std::abs(std::ldexp(part, 44)), margin) << round << ' ' << body;
                            continue;
                        }
                        const listed_cell& f = found[next++].value;
                        ASSERT_EQ(f.draw, body);
                        ASSERT_LE(std::abs(static_cast<long double>(f.units) - std::ldexp(part, 44)), margin) << round;
                        ASSERT_TRUE(f.is_cut || f.units != 0);
                        ASSERT_TRUE(!f.is_cut || touching != 0);
                    }
                    ASSERT_EQ(next, found.size());
                    shared += found.size() > 1 ? 1 : 0;
                    several += found.size() > 2 ? 1 : 0;
                }
    }
    EXPECT_GT(shared, 200u);
    EXPECT_GT(several, 50u);
}

// The lists of all bodies are those of each body's own call, voxel by voxel; parts of a grid have those of the whole,
// and the number of threads does not matter.
TEST(CellLists, AreTheBodiesByThemselves) {
    splitmix64 random(29);
    const std::vector<mesh> meshes = bodies_of(random);
    const vp::grid whole = solids::unit_grid({9, 7, 8});
    for (int axis = 0; axis < 3; ++axis)
        for (const vp::grid& g : {whole, whole.crop({1, 2, 1}, {5, 3, 6})}) {
            const vp::cell_options how{.bodies = vp::bodies::draw, .axis = axis};
            vp::status status;
            const auto lists = lists_of<listed_cell>(meshes, g, listing_shader{}, how, &status);
            ASSERT_TRUE(std::is_sorted(lists.voxels.begin(), lists.voxels.end()));
            ASSERT_EQ(lists.extent, g.extent);
            std::size_t fragments = 0;
            for (std::uint32_t body = 0; body < meshes.size(); ++body) {
                const cell_values alone = library_cells(meshes[body], g, how);
                for (std::size_t v = 0; v < alone.units.size(); ++v) {
                    const auto of_voxel = lists.find(lists.position(v));
                    const auto at = std::find_if(of_voxel.begin(), of_voxel.end(),
                                                 [&](const auto& f) { return f.primitive == body; });
                    const bool is_drawn = alone.units[v] != 0 || alone.cut[v] != 0;
                    ASSERT_EQ(at != of_voxel.end(), is_drawn) << body << ' ' << v;
                    if (!is_drawn) continue;
                    ++fragments;
                    EXPECT_EQ((*at).value.units, alone.units[v]);
                    EXPECT_EQ((*at).value.is_cut, alone.cut[v] != 0);
                }
            }
            EXPECT_EQ(fragments, lists.primitives.size());
            const cell_values dense = library_cells(meshes, g, how);
            EXPECT_EQ(dense.status.counts, status.counts);
            EXPECT_EQ(dense.status.cells, status.cells);
            const auto one = lists_of<listed_cell>(meshes, g, listing_shader{}, how, nullptr, 1);
            EXPECT_EQ(one.voxels, lists.voxels);
            EXPECT_EQ(one.offsets, lists.offsets);
            EXPECT_EQ(one.primitives, lists.primitives);
        }
}

struct odd_draws { // and no payload
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.fraction).discard_if(f.draw % 2 == 0);
    }
};

// One body of all draws has the sums; discarded fragments are not listed, and lists without payload hold draws alone.
TEST(CellLists, SumsDiscardsAndDrawsAlone) {
    const std::vector<mesh> meshes{solids::box({0, 0, 0}, {2.5F, 2, 2}), solids::box({2.5F, 0, 0}, {4, 2, 2}),
                                   solids::box({1, 0, 0}, {2, 1, 1})};
    const vp::grid g = solids::unit_grid({5, 3, 3});
    const auto sums = lists_of<float>(meshes, g, vp::fraction{}, {});
    EXPECT_EQ(sums.find({2, 0, 0}).size(), 1u);
    EXPECT_EQ(sums.find({2, 0, 0})[0].value, 1.0F);
    EXPECT_EQ(sums.find({1, 0, 0})[0].value, 2.0F);
    EXPECT_EQ(sums.find({1, 0, 0})[0].primitive, 0u);
    for (int axis = 0; axis < 3; ++axis) {
        const auto each = lists_of<float>(meshes, g, vp::fraction{}, {.bodies = vp::bodies::draw, .axis = axis});
        const auto shared = each.find({2, 1, 1});
        ASSERT_EQ(shared.size(), 2u);
        EXPECT_EQ(shared[0].value, 0.5F);
        EXPECT_EQ(shared[1].value, 0.5F);
        EXPECT_EQ(shared[1].primitive, 1u);
        EXPECT_EQ(each.find({1, 0, 0}).size(), 2u);
        EXPECT_EQ(each.find({1, 0, 0})[1].primitive, 2u);
        vp::status status;
        const auto odd = lists_of<void>(meshes, g, odd_draws{}, {.bodies = vp::bodies::draw, .axis = axis}, &status);
        EXPECT_EQ(odd.voxels.size(), 8u);
        EXPECT_TRUE(odd.payloads.empty());
        EXPECT_TRUE(std::all_of(odd.primitives.begin(), odd.primitives.end(), [](auto d) { return d == 1; }));
        EXPECT_EQ(status.counts.fragments_discarded, each.primitives.size() - 8);
    }
}

// Nothing gives empty lists of the grid's extent; a call that fails leaves them as they are.
TEST(CellLists, NothingAndBadInput) {
    const mesh box = solids::box({1.5F, 1.5F, 1.5F}, {3, 3, 3});
    const vp::grid g = solids::unit_grid(glm::ivec3(5));
    vp::cpu_backend backend;
    vp::abuffer<vp::cpu_backend, float> lists(backend);
    const auto draw = [&](const mesh& m, const vp::cell_options& options) {
        return vp::voxelize_cells(backend, m.view(), g, vp::passthrough{}, vp::fraction{}, lists, options);
    };
    ASSERT_TRUE(draw(box, {}).ok());
    EXPECT_EQ(lists.num_voxels(), 8u);
    mesh bad = box;
    bad.triangles.push_back({0, 1, 99});
    const vp::status s = draw(bad, {});
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(s.triangle, bad.triangles.size() - 1);
    EXPECT_EQ(draw(box, {.axis = 3}).code, vp::status_code::bad_cell_options);
    mesh many; // whose sums might wrap
    many.positions = {{0.5F, 0, 0}, {0.5F, 1, 0}, {0.5F, 0, 1}};
    many.triangles.assign((std::size_t{1} << 19) + 1, glm::uvec3(0, 1, 2));
    EXPECT_EQ(draw(many, {.count_open_edges = false}).code, vp::status_code::winding_too_large);
    EXPECT_EQ(lists.num_voxels(), 8u);
    EXPECT_EQ(lists.num_fragments(), 8u);
    EXPECT_TRUE(draw(box.moved({10, 10, 10}), {}).ok()); // beside the grid
    EXPECT_EQ(lists.num_voxels(), 0u);
    ASSERT_TRUE(draw(box, {}).ok());
    EXPECT_TRUE(draw({}, {}).ok());
    EXPECT_EQ(lists.num_voxels(), 0u);
    EXPECT_EQ(lists.extent, g.extent);
}

} // namespace
