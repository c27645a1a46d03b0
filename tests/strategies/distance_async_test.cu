// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_distance_async: the bytes and the status of voxelize_distance in the caller's memory, replayed by a graph;
// and what it says of room that is too small and of bad input, which leave every target as it was.

#include "captured_graph.hpp"
#include "distance_drawings.hpp"

#include "../programs/module_cases.hpp"

#include <voxelpipe/distance/device/distance_async.cuh>
#include <voxelpipe/distance/device/sparse_distance_async.cuh>
#include <voxelpipe/programs/device/distance_program_async.cuh>

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace {

using namespace distance_drawings;

using async_target = every_target<vp::cuda_backend>;
using async_draw = vp::draw<vp::mesh_view<>, vp::passthrough, everything>;

// A workspace, filled with a byte.
struct distance_workspace {
    vp::cuda_backend::buffer<std::uint8_t> memory;
    vp::distance_workspace_view view;

    distance_workspace(vp::cuda_backend& gpu, const std::vector<async_draw>& draws, const vp::grid& g, async_target& fb,
                       const vp::distance_options& o, const vp::distance_limits& limits)
        : memory(gpu, vp::distance_workspace_bytes(std::span<const async_draw>(draws), g, fb.view(), o, limits)),
          view{memory.data(), memory.size(), limits} {
        EXPECT_NE(memory.size(), 0u);
        EXPECT_EQ(cudaMemsetAsync(memory.data(), 0xa5, memory.size(), gpu.stream), cudaSuccess);
    }
};

vp::status run_async(vp::cuda_backend& gpu, const std::vector<async_draw>& draws, const vp::grid& g, async_target& fb,
                     const vp::distance_options& o, const vp::distance_workspace_view& w) {
    return vp::voxelize_distance_async(gpu, std::span<const async_draw>(draws), g, fb.view(), o, w);
}

void expect_same_targets(vp::cuda_backend& gpu, const async_target& a, const async_target& b) {
    vp::core::for_each_index<num_targets<async_target>>([&]<std::size_t I>() {
        const std::string what = "target " + std::to_string(I);
        device_test::expect_same_bytes(vp::get<I>(a).to_host(gpu), vp::get<I>(b).to_host(gpu), what.c_str());
    });
}

std::vector<async_draw> async_draws(const std::vector<vp::mesh<vp::cuda_backend>>& meshes) {
    std::vector<async_draw> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, {static_cast<std::uint32_t>(draws.size() + 3), 1.5f}});
    return draws;
}

} // namespace

// From no room at all, with what each failure asks for; then with spare room. Bands and whole fields, rules and bodies,
// without a sign, at corners and in a part of a grid.
TEST(DeviceDistanceAsync, HaveTheBytesOfCallsThatWait) {
    vp::cuda_backend gpu;
    const glm::ivec3 extent{33, 21, 27};
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    mesh_data large = device_test::mixed_triangles(80, 20, 5);
    device_test::add_triangle(large, {-300, 4, 2}, {500, 11, 9}, {10, 300, 400}); // near more than 32 bricks
    for (const mesh_data& d : {large, device_test::tied_bodies(20, 7, 2), device_test::ball({14, 9, 12}, 6.3f, 7)})
        meshes.emplace_back(gpu, d.positions, d.triangles);
    const std::vector<async_draw> draws = async_draws(meshes);
    const vp::grid whole = unit_grid(extent);
    int retries = 0;
    for (const vp::distance_options& o :
         {vp::distance_options{}, vp::distance_options{.band = 1.5, .rule = vp::fill_rule::even_odd},
          vp::distance_options{.sample = vp::sample::corner, .rule = vp::fill_rule::positive},
          vp::distance_options{.bodies = vp::bodies::draw},
          vp::distance_options{.sign = vp::distance_sign::none, .count_voxels = true},
          vp::distance_options{.band = vp::band::whole}}) {
        const vp::grid g = o.sample == vp::sample::corner ? whole.crop({3, 2, 5}, {24, 17, 20}) : whole;
        const glm::ivec3 samples = vp::core::sample_grid(g, o.sample).extent;
        async_target waited(gpu, samples), found(gpu, samples);
        const vp::status expected = vp::voxelize_distance(gpu, draws, g, waited, o);
        ASSERT_TRUE(expected.ok()) << expected.message();
        ASSERT_TRUE(vp::clear(gpu, found).ok());
        const auto before = vp::get<0>(found).to_host(gpu);
        vp::distance_limits limits;
        for (int tries = 0;; ++tries) {
            ASSERT_LT(tries, 4);
            const distance_workspace room(gpu, draws, g, found, o, limits);
            ASSERT_TRUE(run_async(gpu, draws, g, found, o, room.view).ok());
            const vp::status s = vp::read_distance_status(gpu, room.view, &limits);
            if (s.ok()) {
                expect_same_status(expected, s);
                break;
            }
            ++retries;
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded);
            ASSERT_EQ(vp::get<0>(found).to_host(gpu), before);
        }
        expect_same_targets(gpu, waited, found);
        // The limits are the least ones, and the crossings those of the status.
        if (o.sign != vp::distance_sign::none && o.rule != vp::fill_rule::even_odd) {
            EXPECT_EQ(limits.crossings, expected.solid.crossings);
            ASSERT_TRUE(vp::clear(gpu, found).ok());
            const auto empty = vp::get<0>(found).to_host(gpu);
            vp::distance_limits less = limits;
            --less.crossings;
            const distance_workspace room(gpu, draws, g, found, o, less);
            ASSERT_TRUE(run_async(gpu, draws, g, found, o, room.view).ok());
            EXPECT_EQ(vp::read_distance_status(gpu, room.view, &less).code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(less.crossings, limits.crossings);
            EXPECT_EQ(vp::get<0>(found).to_host(gpu), empty);
        }
        const distance_workspace spare(
            gpu, draws, g, found, o, {limits.pairs + 777, limits.parts + 5, limits.bricks + 13, limits.crossings + 99});
        ASSERT_TRUE(run_async(gpu, draws, g, found, o, spare.view).ok());
        expect_same_status(expected, vp::read_distance_status(gpu, spare.view));
        expect_same_targets(gpu, waited, found);
    }
    EXPECT_GE(retries, 6);
}

// Captured once and replayed with vertices that move, to outside of the grid too.
TEST(DeviceDistanceAsync, GraphsFollowTheVertices) {
    const device_test::owned_stream stream;
    vp::cuda_backend gpu{stream.get()};
    const vp::grid g = unit_grid(glm::ivec3(20));
    const mesh_data m = device_test::ball({9, 10, 9}, 5.4f, 6);
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    meshes.emplace_back(gpu, m.positions, m.triangles);
    const std::vector<async_draw> draws = async_draws(meshes);
    async_target waited(gpu, g.extent), found(gpu, g.extent);
    const distance_workspace room(gpu, draws, g, found, {}, {20000, 100, 100, 5000});
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    const device_test::captured_graph graph(stream.get(),
                                            [&] { return run_async(gpu, draws, g, found, {}, room.view); });
    for (int frame = 0; frame < 3; ++frame) {
        std::vector<glm::vec3> moved = m.positions;
        for (glm::vec3& p : moved) p += glm::vec3(frame == 1 ? 100.0f : 0.3f * static_cast<float>(frame));
        ASSERT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(meshes[0].view().positions.data()), moved.data(),
                                  moved.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice, stream.get()),
                  cudaSuccess);
        graph.launch(stream.get());
        const vp::status s = vp::read_distance_status(gpu, room.view);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_status(vp::voxelize_distance(gpu, draws, g, waited, {}), s);
        EXPECT_EQ(s.distance.band_samples == 0, frame == 1);
        expect_same_targets(gpu, waited, found);
    }
}

TEST(DeviceDistanceAsync, BadInputAndWhatItCannotDo) {
    vp::cuda_backend gpu;
    const vp::grid g = unit_grid(glm::ivec3(12));
    mesh_data m = device_test::ball({6, 6, 6}, 4.4f, 5);
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    meshes.emplace_back(gpu, m.positions, m.triangles);
    m.triangles.push_back({0, 1, 1000000});
    meshes.emplace_back(gpu, m.positions, m.triangles);
    const std::vector<async_draw> both = async_draws(meshes), good{both[0]}, none;
    async_target fb(gpu, g.extent);
    const distance_workspace room(gpu, both, g, fb, {}, {20000, 100, 100, 5000});
    ASSERT_TRUE(run_async(gpu, good, g, fb, {}, room.view).ok());
    ASSERT_TRUE(vp::read_distance_status(gpu, room.view).ok());
    const auto before = vp::get<0>(fb).to_host(gpu);
    for (const auto sign : {vp::distance_sign::inside, vp::distance_sign::none}) {
        ASSERT_TRUE(run_async(gpu, both, g, fb, {.sign = sign}, room.view).ok());
        EXPECT_EQ(vp::read_distance_status(gpu, room.view).code, vp::status_code::index_out_of_range);
        EXPECT_EQ(vp::get<0>(fb).to_host(gpu), before);
    }

    const auto code = [&](const vp::distance_options& o, const vp::distance_workspace_view& w) {
        return run_async(gpu, good, g, fb, o, w).code;
    };
    for (const auto repair : {vp::repair::close_holes, vp::repair::exterior, vp::repair::vote, vp::repair::winding}) {
        EXPECT_EQ(code({.repair = repair}, room.view), vp::status_code::strategy_unavailable);
        EXPECT_EQ(vp::distance_workspace_bytes(std::span<const async_draw>(good), g, fb.view(), {.repair = repair},
                                               room.view.limits),
                  0u);
    }
    EXPECT_EQ(code({.band = -1}, room.view), vp::status_code::bad_distance_options);
    vp::distance_workspace_view bad = room.view;
    bad.bytes = 1000;
    EXPECT_EQ(code({}, bad), vp::status_code::capacity_exceeded);
    bad = room.view;
    bad.limits.pairs = std::uint64_t{1} << 33;
    EXPECT_EQ(code({}, bad), vp::status_code::size_overflow);
    async_target other(gpu, glm::ivec3(11));
    EXPECT_EQ(run_async(gpu, good, g, other, {}, room.view).code, vp::status_code::extent_mismatch);
    // Nothing clears; a mesh without triangles has the band's distance everywhere.
    ASSERT_TRUE(run_async(gpu, none, g, fb, {}, room.view).ok());
    EXPECT_TRUE(vp::read_distance_status(gpu, room.view).ok());
    for (const float v : vp::get<0>(fb).to_host(gpu)) ASSERT_EQ(v, 0.0f);
    std::vector<vp::mesh<vp::cuda_backend>> empty;
    empty.emplace_back(gpu, std::vector<glm::vec3>{}, std::vector<glm::uvec3>{});
    async_target waited(gpu, g.extent);
    ASSERT_TRUE(run_async(gpu, async_draws(empty), g, fb, {}, room.view).ok());
    expect_same_status(vp::voxelize_distance(gpu, async_draws(empty), g, waited, {}),
                       vp::read_distance_status(gpu, room.view));
    expect_same_targets(gpu, waited, fb);
}

namespace {

using program_targets = programs::distance_targets<vp::cuda_backend>;

// Draws what programs make without waits, from no room at all, and compares with the call that waits.
template <class Amplify>
void expect_same_programs(vp::cuda_backend& gpu, const std::vector<vp::mesh_view<>>& meshes, const vp::grid& g,
                          const Amplify& amplify, const vp::distance_options& o) {
    using draw_type = vp::draw<vp::mesh_view<>, programs::weighted, programs::numbers_of_distance, Amplify>;
    std::vector<draw_type> draws;
    for (const auto& m : meshes) draws.push_back({m, {}, amplify, {}});
    const std::span<const draw_type> all(draws);
    program_targets waited(gpu, g.extent), found(gpu, g.extent);
    const vp::status expected = vp::voxelize_distance(gpu, all, g, waited, o);
    ASSERT_TRUE(expected.ok()) << expected.message();
    ASSERT_TRUE(vp::clear(gpu, found).ok());
    const auto before = vp::get<0>(found).to_host(gpu);
    vp::distance_program_limits limits;
    const auto run = [&](const vp::distance_program_limits& l, vp::distance_program_limits* need) {
        vp::cuda_backend::buffer<std::uint8_t> memory(gpu, vp::distance_workspace_bytes(all, g, found.view(), o, l));
        EXPECT_NE(memory.size(), 0u);
        EXPECT_EQ(cudaMemsetAsync(memory.data(), 0xa5, memory.size(), gpu.stream), cudaSuccess);
        const vp::distance_program_workspace_view w{memory.data(), memory.size(), l};
        const vp::status launched = vp::voxelize_distance_async(gpu, all, g, found.view(), o, w);
        return launched.ok() ? vp::read_distance_status(gpu, w, need) : launched;
    };
    const auto expect_same = [&](const vp::status& s) {
        expect_same_status(expected, s);
        vp::core::for_each_index<3>([&]<std::size_t I>() {
            device_test::expect_same_bytes(vp::get<I>(waited).to_host(gpu), vp::get<I>(found).to_host(gpu), "target");
        });
    };
    int failures = 0;
    for (vp::status s = run(limits, &limits); !s.ok(); s = run(limits, &limits)) {
        ASSERT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
        ASSERT_EQ(vp::get<0>(found).to_host(gpu), before);
        ASSERT_LT(++failures, 8);
    }
    EXPECT_GE(failures, o.band.is_whole ? 1 : 2); // the programs, and the pairs of a band behind them
    expect_same(run(limits, nullptr));
    vp::distance_program_limits spare = limits;
    spare.triangles += 77; // of each draw: the primitives of later ones move
    spare.pairs += 500;
    expect_same(run(spare, nullptr));
}

} // namespace

// Draws of several meshes with each kind of program, in bands and whole fields, with and without a sign: the triangles
// for which there is room and which no program makes have no distance, and no number.
TEST(DeviceDistanceAsync, ProgramsHaveTheBytesOfCallsThatWait) {
    vp::cuda_backend gpu;
    vp::grid g;
    g.extent = {20, 17, 22};
    programs::octahedra one, two;
    one.add({9.25f, 8.5f, 8.0f}, 5.75f);
    two.add({7.5f, 9.0f, 15.0f}, 3.5f);
    const vp::mesh<vp::cuda_backend> a(gpu, one.positions, one.triangles), b(gpu, two.positions, two.triangles);
    const vp::geometry doubled{programs::doubled{{1.5f, 0.25f, 7.0f}}};
    const std::vector<vp::mesh_view<>> both{a.view(), b.view()};
    expect_same_programs(gpu, both, g, doubled, {.band = 2.5});
    expect_same_programs(gpu, both, g, doubled, {.band = vp::band::whole, .sign = vp::distance_sign::none});
    expect_same_programs(gpu, both, g, vp::tessellate{programs::divided{9}}, {});
    expect_same_programs(gpu, {a.view()}, g, vp::tessellate{programs::divided{10}} | doubled, {.band = 1.5});
}

// What a call of programs is refused for.
TEST(DeviceDistanceAsync, ProgramsThatCannotBeDrawn) {
    vp::cuda_backend gpu;
    vp::grid g;
    g.extent = {12, 12, 12};
    programs::octahedra one;
    one.add({6, 6, 6}, 4);
    const vp::mesh<vp::cuda_backend> m(gpu, one.positions, one.triangles);
    const vp::geometry amplify{programs::doubled{{1, 0, 2}}};
    using draw_type = vp::draw<vp::mesh_view<>, programs::weighted, programs::numbers_of_distance,
                               std::remove_cv_t<decltype(amplify)>>;
    const draw_type d{m.view(), {}, amplify, {}};
    const std::span<const draw_type> draws(&d, 1);
    program_targets fb(gpu, g.extent);
    const auto limits = vp::distance_program_limits::for_triangles(100);
    const auto code = [&](const vp::distance_options& o, const vp::distance_program_limits& l) {
        return vp::voxelize_distance_async(gpu, draws, g, fb.view(), o, {nullptr, 0, l}).code;
    };
    EXPECT_EQ(code({}, limits), vp::status_code::capacity_exceeded);
    EXPECT_EQ(code({.repair = vp::repair::close_holes}, limits), vp::status_code::strategy_unavailable);
    EXPECT_EQ(code({.band = -1}, limits), vp::status_code::bad_distance_options);
    vp::distance_program_limits many = limits;
    many.triangles = std::uint64_t{1} << 40;
    EXPECT_EQ(code({}, many), vp::status_code::size_overflow);
    many = limits;
    many.pairs = std::uint64_t{1} << 33;
    EXPECT_EQ(code({}, many), vp::status_code::size_overflow);
}

namespace {

using sparse_draw = vp::draw<vp::mesh_view<>, vp::passthrough, sparse_shader>;
using bricks_result = vp::sparse_result<vp::target<float, vp::blend::add>, vp::target<std::uint32_t, vp::blend::max>,
                                        vp::target<vp::bit, vp::blend::bit_or>>;
using bricks_framebuffer =
    vp::sparse_framebuffer<vp::cuda_backend, vp::target<float, vp::blend::add>,
                           vp::target<std::uint32_t, vp::blend::max>, vp::target<vp::bit, vp::blend::bit_or>>;

template <class Host>
void expect_same_host(const Host& x, const Host& y) {
    device_test::expect_same_bytes(x.keys, y.keys, "keys");
    device_test::expect_same_bytes(x.masks, y.masks, "masks");
    device_test::expect_same_bytes(x.offsets, y.offsets, "offsets");
    vp::core::for_each_index<3>(
        [&]<std::size_t I>() { device_test::expect_same_bytes(vp::get<I>(x.values), vp::get<I>(y.values), "values"); });
}

} // namespace

// Bricks in the caller's memory, from no room at all: those of the call that waits, with a discard; at corners, of a
// part of a grid, without a sign, of a whole field; and once more on top of what the first call left.
TEST(DeviceDistanceAsync, BricksAreThoseOfCallsThatWait) {
    vp::cuda_backend gpu;
    mesh_data bodies = device_test::tied_bodies(25, 3, 2);
    append(bodies, device_test::ball({17, 9, 14}, 6.3f, 6));
    const vp::mesh<vp::cuda_backend> mesh(gpu, bodies.positions, bodies.triangles);
    const sparse_draw d{mesh.view(), {}, {}};
    const std::span<const sparse_draw> draws(&d, 1);
    const vp::grid whole = unit_grid({43, 26, 21});
    for (const vp::distance_options& o :
         {vp::distance_options{.band = 2}, vp::distance_options{.band = 1.5, .sample = vp::sample::corner},
          vp::distance_options{.sign = vp::distance_sign::none},
          vp::distance_options{.band = vp::band::whole, .rule = vp::fill_rule::even_odd, .count_voxels = false}}) {
        const vp::grid g = o.sample == vp::sample::corner ? whole.crop({3, 5, 2}, {37, 19, 17})
                           : o.band.is_whole              ? whole.crop({9, 4, 5}, {15, 14, 11})
                                                          : whole;
        bricks_framebuffer waited(gpu, vp::core::sample_grid(g, o.sample).extent);
        bricks_result result;
        vp::sparse_distance_limits limits;
        limits.nodes = 4;
        int failures = 0;
        std::vector<vp::cuda_backend::buffer<std::uint8_t>> kept; // what the first call left stays in its own memory
        for (const bool again : {false, true}) {
            const vp::status expected = vp::voxelize_distance(gpu, draws, g, waited, o);
            ASSERT_TRUE(expected.ok()) << expected.message();
            bricks_result next;
            if (again) next.load(result);
            for (;;) {
                ASSERT_LT(failures, 16);
                const std::size_t bytes = vp::distance_workspace_bytes(draws, g, next, o, limits);
                ASSERT_NE(bytes, 0u);
                kept.emplace_back(gpu, bytes);
                ASSERT_EQ(cudaMemsetAsync(kept.back().data(), 0xa5, bytes, gpu.stream), cudaSuccess);
                const vp::sparse_distance_workspace_view w{kept.back().data(), bytes, limits};
                ASSERT_TRUE(vp::voxelize_distance_async(gpu, draws, g, next, o, w).ok());
                const vp::status s = vp::read_distance_status(gpu, w, &limits);
                if (s.ok()) {
                    expect_same_status(expected, s);
                    break;
                }
                ++failures;
                ASSERT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
                ASSERT_EQ(next.to_host(gpu).num_voxels(), 0u);
            }
            result = next;
            const auto x = waited.to_host(gpu);
            EXPECT_GT(x.num_voxels(), 100u);
            expect_same_host(x, result.to_host(gpu));
            if (!again) vp::core::for_each_index<3>([&]<std::size_t I>() { vp::get<I>(waited).load(); });
        }
        EXPECT_GE(failures, 2);
    }
}

TEST(DeviceDistanceAsync, BricksWithoutTrianglesAndWhatIsRefused) {
    vp::cuda_backend gpu;
    const vp::grid g = unit_grid(glm::ivec3(12));
    const mesh_data m = device_test::ball({6, 6, 6}, 4.4f, 5);
    const vp::mesh<vp::cuda_backend> full(gpu, m.positions, m.triangles),
        empty(gpu, std::vector<glm::vec3>{}, std::vector<glm::uvec3>{});
    const sparse_draw d{full.view(), {}, {}}, none{empty.view(), {}, {}};
    const auto limits = vp::sparse_distance_limits::for_triangles(500);
    bricks_result result;
    const auto run = [&](const sparse_draw& drawn, const vp::distance_options& o,
                         const vp::sparse_distance_workspace_view& w) {
        return vp::voxelize_distance_async(gpu, std::span<const sparse_draw>(&drawn, 1), g, result, o, w).code;
    };
    const std::size_t bytes =
        vp::distance_workspace_bytes(std::span<const sparse_draw>(&d, 1), g, result, vp::distance_options{}, limits);
    vp::cuda_backend::buffer<std::uint8_t> memory(gpu, bytes);
    const vp::sparse_distance_workspace_view room{memory.data(), bytes, limits};
    EXPECT_EQ(run(none, {}, room), vp::status_code::ok);
    const vp::status s = vp::read_distance_status(gpu, room);
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(result.to_host(gpu).num_voxels(), 0u);
    EXPECT_EQ(run(d, {.repair = vp::repair::winding}, room), vp::status_code::strategy_unavailable);
    EXPECT_EQ(run(d, {.band = -1}, room), vp::status_code::bad_distance_options);
    EXPECT_EQ(run(d, {}, {memory.data(), bytes - 1, limits}), vp::status_code::capacity_exceeded);
    vp::sparse_distance_limits many = limits;
    many.voxels = std::uint64_t{1} << 33;
    EXPECT_EQ(run(d, {}, {memory.data(), bytes, many}), vp::status_code::size_overflow);
}
