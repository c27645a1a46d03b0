// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_cells_async into bricks: the bricks, tiles, values and status of voxelize_cells into a sparse framebuffer,
// in the caller's memory; replayed by a graph; and what it says of each kind of room that is too small.

#include "async_lists.hpp"
#include "captured_graph.hpp"
#include "device_test.hpp"
#include "solid_drawings.hpp"

#include <voxelpipe/cells/device/sparse_cells.cuh>
#include <voxelpipe/cells/device/sparse_cells_async.cuh>

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vp = voxelpipe;

namespace brick_cells { // named: nvcc warns of members of unnamed ones that the host does not use

// Makes tiles.
struct brick_cell_shader {
    static constexpr bool ignores_voxel = true;
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.fraction, f.next_aperture + static_cast<std::int64_t>(f.draw), f.is_cut)
            .discard_if((f.units & 7) == 5);
    }
};

} // namespace brick_cells

namespace {
using brick_cells::brick_cell_shader;
using device_test::mesh_data;

// Makes none, and needs more of each record.
struct placed_cell_shader {
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::sheets>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        return vp::outputs(f.fraction + f.centroid.y, f.is_multi_cut ? f.aperture : -f.aperture, f.is_cut)
            .discard_if((f.voxel.x + 3 * f.voxel.y) % 5 == 0);
    }
};
using bricks_of_cells = vp::sparse_result<vp::target<float, vp::blend::add>, vp::target<std::int64_t, vp::blend::max>,
                                          vp::target<vp::bit, vp::blend::bit_or>>;
using waited_bricks_of_cells =
    vp::sparse_framebuffer<vp::cuda_backend, vp::target<float, vp::blend::add>,
                           vp::target<std::int64_t, vp::blend::max>, vp::target<vp::bit, vp::blend::bit_or>>;

// Meshes on the device, drawn by one shader.
template <class Shader>
struct drawn_cells {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    std::vector<draw_type> draws;

    drawn_cells(vp::cuda_backend& gpu, const std::vector<mesh_data>& of) {
        for (const mesh_data& m : of) meshes.emplace_back(gpu, m.positions, m.triangles);
        for (const auto& m : meshes) draws.push_back({m.view(), {}, {}});
    }
    [[nodiscard]] std::span<const draw_type> all() const { return draws; }
};

// A workspace, filled with a byte, before memory that no call may write.
struct guarded_cells {
    device_test::guarded_memory memory;
    vp::sparse_cell_workspace_view view;

    guarded_cells(vp::cuda_backend& gpu, std::size_t bytes, const vp::sparse_cell_limits& limits)
        : memory(gpu, bytes), view{memory.memory.data(), bytes, limits} {
        EXPECT_NE(bytes, 0u);
        EXPECT_EQ(cudaMemsetAsync(memory.memory.data(), 0xa5, bytes, gpu.stream), cudaSuccess);
    }
};

void expect_same_brick_bytes(vp::cuda_backend& gpu, const waited_bricks_of_cells& waited,
                             const bricks_of_cells& result) {
    const auto x = waited.to_host(gpu), y = result.to_host(gpu);
    EXPECT_EQ(x.is_tiled, y.is_tiled);
    EXPECT_TRUE(vp::core::passes::are_same_bits(x.clear_values, y.clear_values));
    EXPECT_EQ(x.where.extent, y.where.extent);
    device_test::expect_same_bytes(x.keys, y.keys, "keys");
    device_test::expect_same_bytes(x.masks, y.masks, "masks");
    device_test::expect_same_bytes(x.offsets, y.offsets, "offsets");
    device_test::expect_same_bytes(x.tiles, y.tiles, "tiles");
    vp::core::for_each_index<3>(
        [&]<std::size_t I>() { device_test::expect_same_bytes(vp::get<I>(x.values), vp::get<I>(y.values), "values"); });
    device_test::expect_same_bytes(vp::get<0>(x.sums), vp::get<0>(y.sums), "sums");
}

void expect_same_cell_status(const vp::status& expected, const vp::status& s) {
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, expected.counts);
    EXPECT_TRUE(s.cells == expected.cells);
}

// How a call begins, beside its draws, grid and options.
struct brick_cells_start {
    bool keeps_sums = false, is_off = false;
    float clear_value = 0.0f;
    void set(waited_bricks_of_cells& waited, bricks_of_cells& result) const {
        if (keeps_sums) waited.keep_sums<0>();
        if (keeps_sums) result.keep_sums<0>();
        vp::get<0>(waited).clear(clear_value);
        vp::get<0>(result.clear_values) = clear_value;
        if (is_off) vp::get<2>(waited).off();
        if (is_off) result.loads[2] = vp::load_operation::off;
    }
};

// From no room at all to the exact room; then each room less by one, in turn, with what the status says of it; then the
// exact room again, in the same memory. `result` is set to go on from, or not. Returns the memory that it lies in.
template <class Shader>
guarded_cells expect_bricks_of_cells(vp::cuda_backend& gpu, const drawn_cells<Shader>& drawn, const vp::grid& g,
                                     const vp::cell_options& o, waited_bricks_of_cells& waited,
                                     bricks_of_cells& result) {
    const vp::status expected = vp::voxelize_cells(gpu, drawn.all(), g, waited, o);
    EXPECT_TRUE(expected.ok()) << expected.message();
    const auto bytes_for = [&](const vp::sparse_cell_limits& l) {
        return vp::cell_workspace_bytes(drawn.all(), g, result, o, l);
    };
    const auto run = [&](const guarded_cells& w, vp::sparse_cell_limits* need) {
        const vp::status launched = vp::voxelize_cells_async(gpu, drawn.all(), g, result, o, w.view);
        EXPECT_TRUE(launched.ok()) << launched.message();
        const vp::status s = vp::read_cells_status(gpu, w.view, need);
        w.memory.expect_untouched_behind(gpu);
        return s;
    };
    vp::sparse_cell_limits exact;
    for (int failures = 0;; ++failures) {
        const guarded_cells tried(gpu, bytes_for(exact), exact);
        const vp::status s = run(tried, &exact);
        if (s.ok() || failures == 8) {
            EXPECT_GE(failures, 2);
            expect_same_cell_status(expected, s);
            expect_same_brick_bytes(gpu, waited, result);
            break;
        }
        EXPECT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
        EXPECT_EQ(result.to_host(gpu).num_voxels(), 0u);
    }
    const auto made = waited.to_host(gpu);
    EXPECT_EQ(exact.records, expected.cells.cell_records);
    EXPECT_EQ(exact.bricks, made.keys.size() + made.tiles.size());
    EXPECT_GE(exact.voxels, made.offsets.empty() ? made.tiles.size() : made.offsets.back() + made.tiles.size());

    guarded_cells room(gpu, bytes_for(exact), exact);
    for (std::uint64_t vp::sparse_cell_limits::*const less :
         {static_cast<std::uint64_t vp::sparse_cell_limits::*>(&vp::sparse_cell_limits::records),
          &vp::sparse_cell_limits::bricks, &vp::sparse_cell_limits::voxels, &vp::sparse_cell_limits::nodes}) {
        if (exact.*less == 0) continue;
        vp::sparse_cell_limits limits = exact, need;
        limits.*less -= 1;
        room.view.limits = limits; // needs no more memory
        const vp::status s = run(room, &need);
        EXPECT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
        const bool is_of_records = less == &vp::sparse_cell_limits::records;
        EXPECT_EQ(s.where, is_of_records ? vp::stage::coarse_raster : vp::stage::tile_resolve);
        EXPECT_EQ(s.cells.cell_records, exact.records);
        if (less == &vp::sparse_cell_limits::bricks) {
            EXPECT_EQ(s.required.bricks, exact.bricks);
        }
        if (less == &vp::sparse_cell_limits::voxels) {
            EXPECT_EQ(s.required.voxels, exact.voxels);
        }
        EXPECT_EQ(need.*less, exact.*less);
        const auto none = result.to_host(gpu);
        EXPECT_TRUE(none.keys.empty() && none.tiles.empty());
    }
    room.view.limits = exact;
    for (int twice = 0; twice < 2; ++twice) {
        expect_same_cell_status(expected, run(room, nullptr));
        expect_same_brick_bytes(gpu, waited, result);
    }
    return room;
}

template <class Shader>
void expect_new_bricks_of_cells(const std::vector<mesh_data>& meshes, const vp::grid& g, const vp::cell_options& o,
                                const brick_cells_start& start = {}) {
    vp::cuda_backend gpu;
    const drawn_cells<Shader> drawn(gpu, meshes);
    waited_bricks_of_cells waited(gpu, g.extent);
    bricks_of_cells result;
    start.set(waited, result);
    (void)expect_bricks_of_cells(gpu, drawn, g, o, waited, result);
    const auto x = waited.to_host(gpu);
    EXPECT_EQ(x.is_tiled, vp::core::ignores_voxel<Shader> && !start.keeps_sums);
    EXPECT_GT(x.num_voxels(), 500u);
}

std::vector<mesh_data> closed_and_open() {
    return {device_test::tied_bodies(30, 6, 2), device_test::ball({20, 17, 18}, 15.3f, 9),
            device_test::with_holes(device_test::ball({31, 20, 12}, 8.4f, 6), 7)};
}

} // namespace

// Of closed and open meshes, by all axes, of bodies and parts of a grid, with discards. Only a shader that ignores the
// voxel makes tiles.
TEST(DeviceCellsAsync, BricksAreThoseOfCallsThatWait) {
    const vp::grid g = device_test::box_grid({42, 33, 38});
    for (int axis = 0; axis < 3; ++axis) {
        SCOPED_TRACE(axis);
        const vp::cell_options o{.bodies = axis == 1 ? vp::bodies::draw : vp::bodies::call,
                                 .axis = axis,
                                 .count_voxels = axis != 2,
                                 .count_open_edges = axis != 1};
        const vp::grid part = axis == 2 ? g.crop({3, 2, 5}, {37, 30, 31}) : g;
        expect_new_bricks_of_cells<brick_cell_shader>(closed_and_open(), part, o,
                                                      {.is_off = axis == 2, .clear_value = axis == 1 ? 3.5f : 0.0f});
        expect_new_bricks_of_cells<placed_cell_shader>(closed_and_open(), part, o,
                                                       {.is_off = axis == 0, .clear_value = axis == 2 ? 3.5f : 0.0f});
    }
    expect_new_bricks_of_cells<brick_cell_shader>(closed_and_open(), g, {}, {.keeps_sums = true});
}

// Tiles of several sizes, in a part of a grid whose bricks are not the grid's, and cubes of unequal values side by
// side.
TEST(DeviceCellsAsync, TilesOfSeveralSizesAreThoseOfCallsThatWait) {
    mesh_data m, half;
    device_test::add_box(m, {1.5f, 1.25f, 0.75f}, {70.5f, 69.0f, 66.5f});
    device_test::add_box(half, {24.0f, 0.0f, 0.0f}, {72.0f, 72.0f, 72.0f});
    const vp::grid g = device_test::box_grid({76, 72, 70});
    for (int axis = 0; axis < 3; ++axis) {
        vp::cuda_backend gpu;
        const vp::cell_options o{.bodies = axis == 0 ? vp::bodies::draw : vp::bodies::call, .axis = axis};
        const vp::grid part = axis == 1 ? g.crop({5, 0, 3}, {69, 71, 67}) : g;
        const drawn_cells<brick_cell_shader> drawn(gpu, {m, half});
        waited_bricks_of_cells waited(gpu, part.extent);
        bricks_of_cells result;
        const vp::status expected = vp::voxelize_cells(gpu, drawn.all(), part, waited, o);
        ASSERT_TRUE(expected.ok()) << expected.message();
        const auto made = waited.to_host(gpu);
        const vp::sparse_cell_limits limits{{expected.cells.cell_records},
                                            made.keys.size() + made.tiles.size(),
                                            made.offsets.back() + made.tiles.size(),
                                            0};
        const guarded_cells room(gpu, vp::cell_workspace_bytes(drawn.all(), part, result, o, limits), limits);
        ASSERT_TRUE(vp::voxelize_cells_async(gpu, drawn.all(), part, result, o, room.view).ok());
        expect_same_cell_status(expected, vp::read_cells_status(gpu, room.view));
        expect_same_brick_bytes(gpu, waited, result);
        std::size_t large = 0, small = 0;
        for (const vp::brick_tile t : result.to_host(gpu).tiles) (t.num_voxels() > 512 ? large : small) += 1;
        EXPECT_GT(large, 3u);
        EXPECT_GT(small, 30u);
    }
}

// On top of what a call left, which made tiles; and of a grid that is large enough to have nodes.
TEST(DeviceCellsAsync, BricksGoOnAndHaveNodes) {
    vp::cuda_backend gpu;
    const vp::grid g = device_test::box_grid({42, 33, 38});
    const drawn_cells<brick_cell_shader> first(gpu, {device_test::ball({20, 17, 18}, 15.3f, 9)});
    const drawn_cells<placed_cell_shader> second(gpu, closed_and_open());
    waited_bricks_of_cells waited(gpu, g.extent);
    bricks_of_cells result, next;
    const guarded_cells kept = expect_bricks_of_cells(gpu, first, g, {}, waited, result);
    EXPECT_GT(result.to_host(gpu).tiles.size(), 3u);
    next.load(result);
    vp::core::for_each_index<3>([&]<std::size_t I>() { vp::get<I>(waited).load(); });
    const auto bytes = [&](const vp::sparse_cell_limits& l) {
        return vp::cell_workspace_bytes(second.all(), g, next, vp::cell_options{}, l);
    };
    const vp::sparse_cell_limits enough{{100000}, 300, 60000, 0};
    const guarded_cells room(gpu, bytes(enough), enough);
    const vp::status expected = vp::voxelize_cells(gpu, second.all(), g, waited, {});
    ASSERT_TRUE(vp::voxelize_cells_async(gpu, second.all(), g, next, vp::cell_options{}, room.view).ok());
    expect_same_cell_status(expected, vp::read_cells_status(gpu, room.view));
    expect_same_brick_bytes(gpu, waited, next);

    mesh_data far = device_test::ball({2060, 9, 8}, 6.3f, 7);
    device_test::append(far, device_test::ball({11, 9, 8}, 6.3f, 7));
    const vp::grid large = device_test::box_grid({2100, 18, 17});
    expect_new_bricks_of_cells<placed_cell_shader>({far}, large, {});
    expect_new_bricks_of_cells<brick_cell_shader>({far}, large, {.axis = 2});
}

// Captured once and replayed with vertices that move: to outside of the grid, and so far apart that they do not fit.
TEST(DeviceCellsAsync, GraphsOfBricksFollowTheVertices) {
    const device_test::owned_stream stream;
    vp::cuda_backend gpu{stream.get()};
    const vp::grid g = device_test::box_grid(glm::ivec3(40));
    const mesh_data m = device_test::ball({18, 19, 20}, 14.4f, 6);
    const drawn_cells<brick_cell_shader> drawn(gpu, {m});
    waited_bricks_of_cells waited(gpu, g.extent);
    bricks_of_cells result;
    const vp::sparse_cell_limits limits{{12000}, 120, 16000, 0};
    const guarded_cells room(gpu, vp::cell_workspace_bytes(drawn.all(), g, result, vp::cell_options{}, limits), limits);
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    const device_test::captured_graph graph(stream.get(), [&] {
        return vp::voxelize_cells_async(gpu, drawn.all(), g, result, vp::cell_options{}, room.view);
    });
    for (int frame = 0; frame < 5; ++frame) {
        SCOPED_TRACE(frame);
        std::vector<glm::vec3> moved = m.positions;
        for (glm::vec3& p : moved)
            p = frame == 3 ? 1.3f * (p - glm::vec3(19)) + glm::vec3(19)
                           : p + glm::vec3(frame == 1 ? 100.0f : 0.6f * static_cast<float>(frame));
        ASSERT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(drawn.meshes[0].view().positions.data()), moved.data(),
                                  moved.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice, stream.get()),
                  cudaSuccess);
        graph.launch(stream.get());
        const vp::status s = vp::read_cells_status(gpu, room.view);
        const vp::status expected = vp::voxelize_cells(gpu, drawn.all(), g, waited, {});
        ASSERT_TRUE(expected.ok()) << expected.message();
        EXPECT_EQ(waited.to_host(gpu).tiles.empty(), frame == 1);
        if (frame == 3) {
            EXPECT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
            EXPECT_EQ(result.to_host(gpu).num_voxels(), 0u);
            continue;
        }
        expect_same_cell_status(expected, s);
        expect_same_brick_bytes(gpu, waited, result);
    }
}

TEST(DeviceCellsAsync, BricksWithoutTrianglesAndWhatIsRefused) {
    vp::cuda_backend gpu;
    const vp::grid g = device_test::box_grid(glm::ivec3(12));
    mesh_data bad = device_test::ball({6, 6, 6}, 4.4f, 5);
    const mesh_data good = bad;
    bad.triangles.push_back({0, 1, 1000000});
    const drawn_cells<brick_cell_shader> full(gpu, {good}), empty(gpu, {mesh_data{}}), none(gpu, {}),
        broken(gpu, {bad, good});
    const vp::sparse_cell_limits limits{{5000}, 40, 5000, 2};
    bricks_of_cells result;
    const guarded_cells room(gpu, vp::cell_workspace_bytes(broken.all(), g, result, vp::cell_options{}, limits),
                             limits);
    const auto code = [&](const drawn_cells<brick_cell_shader>& drawn, const vp::cell_options& o,
                          const vp::sparse_cell_workspace_view& w) {
        return vp::voxelize_cells_async(gpu, drawn.all(), g, result, o, w).code;
    };
    for (const drawn_cells<brick_cell_shader>* const drawn : {&empty, &none}) {
        ASSERT_EQ(code(full, {}, room.view), vp::status_code::ok);
        ASSERT_TRUE(vp::read_cells_status(gpu, room.view).ok());
        EXPECT_GT(result.to_host(gpu).num_voxels(), 100u);
        ASSERT_EQ(code(*drawn, {}, room.view), vp::status_code::ok);
        waited_bricks_of_cells waited(gpu, g.extent);
        expect_same_cell_status(vp::voxelize_cells(gpu, drawn->all(), g, waited, {}),
                                vp::read_cells_status(gpu, room.view));
        expect_same_brick_bytes(gpu, waited, result);
    }
    ASSERT_EQ(code(broken, {}, room.view), vp::status_code::ok);
    EXPECT_EQ(vp::read_cells_status(gpu, room.view).code, vp::status_code::index_out_of_range);
    EXPECT_EQ(result.to_host(gpu).num_voxels(), 0u);

    EXPECT_EQ(code(full, {.repair = vp::repair::close_holes}, room.view), vp::status_code::strategy_unavailable);
    EXPECT_EQ(code(full, {.axis = 5}, room.view), vp::status_code::bad_cell_options);
    vp::sparse_cell_workspace_view refused = room.view;
    refused.bytes = 1000;
    EXPECT_EQ(code(full, {}, refused), vp::status_code::capacity_exceeded);
    for (std::uint64_t vp::sparse_cell_limits::*const many :
         {static_cast<std::uint64_t vp::sparse_cell_limits::*>(&vp::sparse_cell_limits::records),
          &vp::sparse_cell_limits::bricks}) {
        refused = room.view;
        refused.limits.*many = std::uint64_t{1} << 33;
        EXPECT_EQ(code(full, {}, refused), vp::status_code::size_overflow);
    }
    bricks_of_cells of_other = result;
    ASSERT_EQ(code(full, {}, room.view), vp::status_code::ok);
    of_other.load(result);
    of_other.start.where.extent = glm::ivec3(11);
    EXPECT_EQ(vp::voxelize_cells_async(gpu, full.all(), g, of_other, vp::cell_options{}, room.view).code,
              vp::status_code::extent_mismatch);
}
