// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_cells_async: the bytes and the status of voxelize_cells in the caller's memory, replayed by a graph; and
// what it says of room that is too small and of bad input, which leave every target as it was.

#include "captured_graph.hpp"
#include "device_test.hpp"
#include "solid_drawings.hpp"

#include <voxelpipe/cells/device/cells_async.cuh>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace vp = voxelpipe;

namespace {
using device_test::mesh_data;

struct async_shader {
    std::uint32_t id;
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::sheets>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        return vp::outputs(f.units + static_cast<std::int64_t>(id), f.centroid.y,
                           static_cast<std::uint32_t>(f.is_multi_cut ? 2 : 1), f.is_cut)
            .discard_if((f.voxel.x + f.voxel.z) % 11 == 3);
    }
};
using async_target =
    vp::framebuffer<vp::cuda_backend, vp::target<std::int64_t, vp::blend::add>, vp::target<float, vp::blend::replace>,
                    vp::target<std::uint32_t, vp::blend::add>, vp::target<vp::bit, vp::blend::bit_or>>;
using async_draw = vp::draw<vp::mesh_view<>, vp::passthrough, async_shader>;

// A workspace, filled with a byte.
struct cell_workspace {
    vp::cuda_backend::buffer<std::uint8_t> memory;
    vp::cell_workspace_view view;

    cell_workspace(vp::cuda_backend& gpu, const std::vector<async_draw>& draws, const vp::grid& g, async_target& fb,
                   const vp::cell_options& o, std::uint64_t records)
        : memory(gpu, vp::cell_workspace_bytes(std::span<const async_draw>(draws), g, fb.view(), o, {records})),
          view{memory.data(), memory.size(), {records}} {
        EXPECT_NE(memory.size(), 0u);
        EXPECT_EQ(cudaMemsetAsync(memory.data(), 0xa5, memory.size(), gpu.stream), cudaSuccess);
    }
};

vp::status run_async(vp::cuda_backend& gpu, const std::vector<async_draw>& draws, const vp::grid& g, async_target& fb,
                     const vp::cell_options& o, const vp::cell_workspace_view& w) {
    return vp::voxelize_cells_async(gpu, std::span<const async_draw>(draws), g, fb.view(), o, w);
}

void expect_same_targets(vp::cuda_backend& gpu, const async_target& a, const async_target& b) {
    vp::core::for_each_index<4>([&]<std::size_t I>() {
        device_test::expect_same_bytes(vp::get<I>(a).to_host(gpu), vp::get<I>(b).to_host(gpu), "target");
    });
}

std::vector<async_draw> draws_of(const std::vector<vp::mesh<vp::cuda_backend>>& meshes) {
    std::vector<async_draw> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, {static_cast<std::uint32_t>(draws.size() + 3)}});
    return draws;
}

} // namespace

// With the room that a first attempt asks for, by all axes, of bodies and parts of a grid; a record less leaves all.
TEST(DeviceCellsAsync, HaveTheBytesOfCallsThatWait) {
    vp::cuda_backend gpu;
    const glm::ivec3 extent{30, 21, 26};
    mesh_data m = device_test::mixed_triangles(60, 20, 5);
    device_test::append(m, device_test::long_triangles(extent, 6, 3));
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    for (const mesh_data& d : {m, device_test::tied_bodies(20, 7, 2), device_test::ball({14, 9, 12}, 6.3f, 7)})
        meshes.emplace_back(gpu, d.positions, d.triangles);
    const std::vector<async_draw> draws = draws_of(meshes);
    for (int axis = 0; axis < 3; ++axis) {
        const vp::cell_options o{.bodies = axis == 1 ? vp::bodies::draw : vp::bodies::call,
                                 .axis = axis,
                                 .count_voxels = axis != 2,
                                 .count_open_edges = axis != 1};
        vp::grid g = device_test::box_grid(extent);
        if (axis == 2) g = g.crop({3, 2, 5}, {24, 17, 20});
        async_target waited(gpu, g.extent), found(gpu, g.extent);
        vp::get<0>(waited).clear(17);
        vp::get<0>(found).clear(17);
        const vp::status expected = vp::voxelize_cells(gpu, draws, g, waited, o);
        ASSERT_TRUE(expected.ok()) << expected.message();
        vp::cell_limits need;
        {
            const cell_workspace small(gpu, draws, g, found, o, expected.cells.cell_records - 1);
            ASSERT_TRUE(vp::clear(gpu, found).ok());
            const auto before = vp::get<0>(found).to_host(gpu);
            vp::get<0>(found).clear(18); // would show
            ASSERT_TRUE(run_async(gpu, draws, g, found, o, small.view).ok());
            EXPECT_EQ(vp::read_cells_status(gpu, small.view, &need).code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(need.records, expected.cells.cell_records);
            EXPECT_EQ(vp::get<0>(found).to_host(gpu), before);
            vp::get<0>(found).clear(17);
        }
        for (const std::uint64_t spare : {0u, 777u}) {
            const cell_workspace room(gpu, draws, g, found, o, need.records + spare);
            ASSERT_TRUE(run_async(gpu, draws, g, found, o, room.view).ok());
            const vp::status s = vp::read_cells_status(gpu, room.view);
            ASSERT_TRUE(s.ok()) << s.message();
            EXPECT_EQ(s.counts, expected.counts);
            EXPECT_TRUE(s.cells == expected.cells);
            expect_same_targets(gpu, waited, found);
        }
    }
}

namespace {

// Captures a call with the mesh once, and replays it with each frame's positions: the bytes and counts of calls that
// wait. Calls check(frame, status).
template <class Check>
void replay_frames(const mesh_data& m, const std::vector<std::vector<glm::vec3>>& frames, const Check& check) {
    const device_test::owned_stream stream;
    vp::cuda_backend gpu{stream.get()};
    const vp::grid g = device_test::box_grid(glm::ivec3(20));
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    meshes.emplace_back(gpu, m.positions, m.triangles);
    const std::vector<async_draw> draws = draws_of(meshes);
    async_target waited(gpu, g.extent), found(gpu, g.extent);
    const cell_workspace room(gpu, draws, g, found, {}, 20000);
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    const device_test::captured_graph graph(stream.get(),
                                            [&] { return run_async(gpu, draws, g, found, {}, room.view); });
    for (std::size_t frame = 0; frame < frames.size(); ++frame) {
        SCOPED_TRACE(frame);
        const std::vector<glm::vec3>& moved = frames[frame];
        ASSERT_EQ(moved.size(), m.positions.size());
        ASSERT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(meshes[0].view().positions.data()), moved.data(),
                                  moved.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice, stream.get()),
                  cudaSuccess);
        graph.launch(stream.get());
        const vp::status s = vp::read_cells_status(gpu, room.view);
        ASSERT_TRUE(s.ok()) << s.message();
        const vp::status expected = vp::voxelize_cells(gpu, draws, g, waited, {});
        EXPECT_EQ(s.counts, expected.counts);
        EXPECT_TRUE(s.cells == expected.cells);
        check(frame, s);
        expect_same_targets(gpu, waited, found);
    }
}

} // namespace

// Captured once and replayed with vertices that move, to outside of the grid too.
TEST(DeviceCellsAsync, GraphsFollowTheVertices) {
    const mesh_data m = device_test::ball({9, 10, 9}, 5.4f, 6);
    std::vector<std::vector<glm::vec3>> frames(3, m.positions);
    for (glm::vec3& p : frames[1]) p += glm::vec3(100.0f);
    for (glm::vec3& p : frames[2]) p += glm::vec3(0.6f);
    replay_frames(m, frames,
                  [](std::size_t frame, const vp::status& s) { EXPECT_EQ(s.counts.voxels == 0, frame == 1); });
}

// Vertices that triangles do not share: where they lie together the mesh is closed. They part, and meet again.
TEST(DeviceCellsAsync, GraphsCountTheOpenEdgesOfEachFrame) {
    const mesh_data shared = device_test::ball({9, 10, 9}, 5.4f, 6);
    mesh_data m;
    for (const glm::uvec3& t : shared.triangles) {
        const auto first = static_cast<std::uint32_t>(m.positions.size());
        for (int i = 0; i < 3; ++i) m.positions.push_back(shared.positions[t[i]]);
        m.triangles.push_back({first, first + 1, first + 2});
    }
    const auto area = [&](std::size_t t) {
        const glm::vec3* const p = &m.positions[3 * t];
        return glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
    };
    std::size_t t = 0; // one that has three edges
    while (area(t) < 0.5f) ++t;
    std::vector<std::vector<glm::vec3>> frames(6, m.positions);
    for (std::size_t i = 0; i < 3; ++i) frames[1][3 * t + i] += glm::vec3(0.25f); // leaves a hole
    frames[2][3 * t] *= 1.125f;                                                   // two edges of it
    for (std::size_t i = 0; i < m.positions.size(); ++i) {
        frames[4][i] += static_cast<float>(i / 3 % 3); // all part
        frames[5][i] += glm::vec3(2.0f, 0.0f, -1.0f);  // and meet, elsewhere
    }
    frames[4][0].y = std::numeric_limits<float>::quiet_NaN();
    std::uint64_t most = 0;
    replay_frames(m, frames, [&](std::size_t frame, const vp::status& s) {
        constexpr std::uint64_t known[6] = {0, 6, 4, 0, 0, 0};
        if (frame == 4)
            most = s.cells.open_edges;
        else
            EXPECT_EQ(s.cells.open_edges, known[frame]);
        EXPECT_EQ(s.counts.triangles_nonfinite, frame == 4 ? 1u : 0u);
    });
    EXPECT_GT(most, 100u);
}

TEST(DeviceCellsAsync, BadInputAndWhatItCannotDo) {
    vp::cuda_backend gpu;
    const vp::grid g = device_test::box_grid(glm::ivec3(12));
    mesh_data m = device_test::ball({6, 6, 6}, 4.4f, 5);
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    meshes.emplace_back(gpu, m.positions, m.triangles);
    m.triangles.push_back({0, 1, 1000000});
    meshes.emplace_back(gpu, m.positions, m.triangles);
    const std::vector<async_draw> both = draws_of(meshes), good{both[0]}, none;
    async_target fb(gpu, g.extent);
    const cell_workspace room(gpu, both, g, fb, {}, 20000);
    ASSERT_TRUE(run_async(gpu, good, g, fb, {}, room.view).ok());
    ASSERT_TRUE(vp::read_cells_status(gpu, room.view).ok());
    const auto before = vp::get<0>(fb).to_host(gpu);
    ASSERT_TRUE(run_async(gpu, both, g, fb, {}, room.view).ok());
    EXPECT_EQ(vp::read_cells_status(gpu, room.view).code, vp::status_code::index_out_of_range);
    EXPECT_EQ(vp::get<0>(fb).to_host(gpu), before);

    const auto code = [&](const vp::cell_options& o, const vp::cell_workspace_view& w) {
        return run_async(gpu, good, g, fb, o, w).code;
    };
    EXPECT_EQ(code({.repair = vp::repair::close_holes}, room.view), vp::status_code::strategy_unavailable);
    EXPECT_EQ(code({.axis = 5}, room.view), vp::status_code::bad_cell_options);
    vp::cell_workspace_view bad = room.view;
    bad.bytes = 1000;
    EXPECT_EQ(code({}, bad), vp::status_code::capacity_exceeded);
    bad = room.view;
    bad.limits.records = std::uint64_t{1} << 33;
    EXPECT_EQ(code({}, bad), vp::status_code::size_overflow);
    async_target other(gpu, glm::ivec3(11));
    EXPECT_EQ(run_async(gpu, good, g, other, {}, room.view).code, vp::status_code::extent_mismatch);
    // Nothing clears.
    ASSERT_TRUE(run_async(gpu, none, g, fb, {}, room.view).ok());
    EXPECT_TRUE(vp::read_cells_status(gpu, room.view).ok());
    for (const std::int64_t v : vp::get<0>(fb).to_host(gpu)) ASSERT_EQ(v, 0);
}
