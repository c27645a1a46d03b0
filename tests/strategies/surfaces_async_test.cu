// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// extract_async and remesh_async: the bytes of extract and remesh in the caller's memory, replayed by a graph; and what
// they say of room that is too small.

#include "../surfaces/surface_support.hpp"
#include "captured_graph.hpp"

#include <voxelpipe/surfaces/device/remesh_async.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

using namespace surface_tests;

namespace {

using bits = vp::target<vp::bit, vp::blend::replace>;
using field = vp::target<float, vp::blend::replace>;

// A workspace, filled with a byte.
struct workspace {
    vp::cuda_backend::buffer<std::uint8_t> memory;
    vp::surface_workspace_view view;

    template <class View>
    workspace(vp::cuda_backend& gpu, const View& from, const vp::extract_options& o, const vp::surface_limits& limits)
        : memory(gpu, vp::extract_workspace_bytes(from, grid_of(from.extent), o, limits)), view{memory.data(),
                                                                                                memory.size(), limits} {
        EXPECT_NE(memory.size(), 0u);
        EXPECT_EQ(cudaMemsetAsync(memory.data(), 0xa5, memory.size(), gpu.stream), cudaSuccess);
    }
};

template <class T>
std::vector<T> read(vp::cuda_backend& gpu, const T* from, std::uint64_t count) {
    return from == nullptr ? std::vector<T>{} : gpu.read(vp::backend_view<const T>{from, count});
}

host_surface to_host(vp::cuda_backend& gpu, const vp::surface_result& r, const vp::status& s) {
    const auto counts = read(gpu, r.counts, 1)[0];
    EXPECT_EQ(counts, s.surface);
    return {s,
            r.samples,
            read(gpu, r.vertices, counts.vertices),
            read(gpu, r.triangles, counts.faces),
            read(gpu, r.quads, counts.faces),
            read(gpu, r.sources, counts.vertices)};
}

// extract and extract_async with the room that the first one needs, and a little less.
template <class View>
void expect_same(vp::cuda_backend& gpu, const View& from, const vp::extract_options& o) {
    const vp::grid g = grid_of(from.extent);
    vp::surface<vp::cuda_backend> s(gpu);
    const vp::status status = vp::extract(gpu, from, g, s, o);
    const host_surface expected = surface_tests::to_host(gpu, s, status);
    vp::surface_limits limits;
    for (int attempt = 0; attempt < 3; ++attempt) { // cells, then the others
        const workspace tried(gpu, from, o, limits);
        vp::surface_result out;
        ASSERT_TRUE(vp::extract_async(gpu, from, g, out, o, tried.view).ok());
        const vp::status found = vp::read_surface_status(gpu, tried.view, &limits);
        if (found.ok()) {
            EXPECT_TRUE(to_host(gpu, out, found).has_same_arrays(expected));
            EXPECT_NE(attempt, 0);
            // A vertex less does not fit, and leaves nothing.
            vp::surface_limits less = limits;
            --less.vertices;
            const workspace small(gpu, from, o, less);
            ASSERT_TRUE(vp::extract_async(gpu, from, g, out, o, small.view).ok());
            vp::surface_limits need;
            const vp::status failed = vp::read_surface_status(gpu, small.view, &need);
            if (failed.ok()) { // the room was of the cells
                EXPECT_TRUE(to_host(gpu, out, failed).has_same_arrays(expected));
            } else {
                EXPECT_EQ(failed.code, vp::status_code::capacity_exceeded);
                EXPECT_EQ(need.vertices, limits.vertices);
                EXPECT_EQ(read(gpu, out.counts, 1)[0], vp::surface_counters{});
            }
            return;
        }
        EXPECT_EQ(found.code, vp::status_code::capacity_exceeded);
    }
    FAIL() << "the room that was asked for does not suffice";
}

using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::none>;
using gpu_mesh = vp::mesh<vp::cuda_backend>;

// Draws of meshes on the device.
std::vector<draw_type> draws_of(const std::vector<gpu_mesh>& meshes) {
    std::vector<draw_type> draws;
    for (const gpu_mesh& m : meshes) draws.push_back({m.view(), {}, {}});
    return draws;
}

// The workspace of a remesh, filled with a byte.
struct remesh_workspace {
    vp::cuda_backend::buffer<std::uint8_t> memory;
    vp::remesh_workspace_view view;

    remesh_workspace(vp::cuda_backend& gpu, std::span<const draw_type> draws, const vp::grid& g,
                     const vp::remesh_options& o, const vp::remesh_limits& limits)
        : memory(gpu, vp::remesh_workspace_bytes(draws, g, o, limits)), view{memory.data(), memory.size(), limits} {
        EXPECT_NE(memory.size(), 0u);
        EXPECT_EQ(cudaMemsetAsync(memory.data(), 0xa5, memory.size(), gpu.stream), cudaSuccess);
    }
};

host_surface remesh_draws(vp::cuda_backend& gpu, std::span<const draw_type> draws, const vp::grid& g,
                          const vp::remesh_options& o) {
    vp::surface<vp::cuda_backend> s(gpu);
    const vp::status status = vp::remesh(gpu, draws, g, s, o);
    return surface_tests::to_host(gpu, s, status);
}

// remesh and remesh_async with the room that the first one needs, and with a crossing less.
void expect_same_remesh(const std::vector<host_mesh>& models, const vp::grid& g, const vp::remesh_options& o) {
    vp::cuda_backend gpu;
    std::vector<gpu_mesh> meshes;
    for (const host_mesh& m : models) meshes.emplace_back(gpu, m.positions, m.triangles);
    const std::vector<draw_type> list = draws_of(meshes);
    const std::span<const draw_type> draws(list);
    const host_surface expected = remesh_draws(gpu, draws, g, o);
    ASSERT_TRUE(expected.status.ok()) << expected.status.message();
    ASSERT_GT(expected.vertices.size(), 50u);
    vp::remesh_limits limits;
    vp::surface_result out;
    vp::status found;
    for (int attempt = 0; attempt < 5; ++attempt) { // the solid, then cells, the others, and crossings
        const remesh_workspace tried(gpu, draws, g, o, limits);
        ASSERT_TRUE(vp::remesh_async(gpu, draws, g, out, o, tried.view).ok());
        found = vp::read_remesh_status(gpu, tried.view, &limits);
        if (found.ok()) {
            EXPECT_TRUE(to_host(gpu, out, found).has_same_arrays(expected));
            EXPECT_EQ(found.counts, expected.status.counts);
            EXPECT_EQ(found.solid, expected.status.solid);
            break;
        }
        ASSERT_EQ(found.code, vp::status_code::capacity_exceeded);
    }
    ASSERT_TRUE(found.ok()) << "the room that was asked for does not suffice";
    vp::remesh_limits less = limits;
    --less.crossings;
    const remesh_workspace small(gpu, draws, g, o, less);
    ASSERT_TRUE(vp::remesh_async(gpu, draws, g, out, o, small.view).ok());
    vp::remesh_limits need;
    EXPECT_EQ(vp::read_remesh_status(gpu, small.view, &need).code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(need.crossings, limits.crossings);
    EXPECT_EQ(read(gpu, out.counts, 1)[0], vp::surface_counters{});
}

} // namespace

TEST(DeviceSurfacesAsync, OfBitsHaveTheBytesOfExtract) {
    vp::cuda_backend gpu;
    std::mt19937 random(1);
    for (int k = 0; k < 4; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(3 + 15 * k, 4 + k, 7), 0.3 + 0.1 * k);
        const std::vector<std::uint32_t> words = v.words();
        vp::cuda_backend::buffer<std::uint32_t> memory(gpu, vp::array_view<const std::uint32_t>(words));
        const vp::target_view<bits> view{memory.data(), v.extent};
        expect_same(gpu, view, {});
        expect_same(gpu, view, {.place = vp::place::corner, .quads = true});
        expect_same(gpu, view, {.border = vp::border::open, .min_component = 12});
        expect_same(gpu, view, {.quads = true, .min_component = 20});
    }
}

TEST(DeviceSurfacesAsync, OfFieldsHaveTheBytesOfExtract) {
    vp::cuda_backend gpu;
    std::mt19937 random(2);
    const glm::ivec3 extent(37, 9, 8);
    std::vector<float> values(37 * 9 * 8);
    for (float& f : values) f = static_cast<float>(random() % 2001) / 1000.0f - 1.0f;
    values[77] = std::nanf("");
    vp::cuda_backend::buffer<float> memory(gpu, vp::array_view<const float>(values));
    const vp::target_view<field> view{memory.data(), extent};
    expect_same(gpu, view, {});
    expect_same(gpu, view, {.level = 0.3, .border = vp::border::open});
}

TEST(DeviceSurfacesAsync, GraphsFollowTheSamples) {
    const device_test::owned_stream stream;
    vp::cuda_backend gpu{stream.get()};
    const glm::ivec3 extent(20, 11, 9);
    std::mt19937 random(3);
    std::vector<float> values(20 * 11 * 9);
    vp::cuda_backend::buffer<float> memory(gpu, values.size());
    const vp::target_view<field> view{memory.data(), extent};
    const workspace room(gpu, view, {}, {3000, 4000, 6000});
    vp::surface_result out;
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    const device_test::captured_graph graph(
        stream.get(), [&] { return vp::extract_async(gpu, view, grid_of(extent), out, {}, room.view); });
    for (int frame = 0; frame < 3; ++frame) {
        const double inside = frame == 1 ? 0.0 : 0.1 * frame + 0.3;
        for (float& f : values) f = static_cast<double>(random() % 1000) < 1000 * inside ? -0.5f : 0.25f;
        ASSERT_EQ(cudaMemcpyAsync(memory.data(), values.data(), values.size() * sizeof(float), cudaMemcpyHostToDevice,
                                  stream.get()),
                  cudaSuccess);
        graph.launch(stream.get());
        const vp::status s = vp::read_surface_status(gpu, room.view);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.surface.vertices == 0, frame == 1);
        EXPECT_TRUE(to_host(gpu, out, s).has_same_arrays(extract_field(gpu, values, grid_of(extent))));
    }
}

TEST(DeviceSurfacesAsync, RefusesWhatItCannotDo) {
    vp::cuda_backend gpu;
    vp::cuda_backend::buffer<std::uint32_t> memory(gpu, 64);
    const vp::target_view<bits> view{memory.data(), glm::ivec3(8)};
    const vp::surface_limits limits{100, 100, 100};
    const workspace room(gpu, view, {}, limits);
    vp::surface_result out;
    const auto code = [&](const vp::extract_options& o, vp::surface_workspace_view w) {
        return vp::extract_async(gpu, view, grid_of(glm::ivec3(8)), out, o, w).code;
    };
    EXPECT_EQ(code({.embedded = true}, room.view), vp::status_code::strategy_unavailable);
    EXPECT_EQ(code({.level = 1.0}, room.view), vp::status_code::bad_surface_options);
    vp::surface_workspace_view bad = room.view;
    --bad.bytes;
    EXPECT_EQ(code({}, bad), vp::status_code::capacity_exceeded);
    bad = room.view;
    bad.limits.quads = std::uint64_t{1} << 33;
    EXPECT_EQ(code({}, bad), vp::status_code::size_overflow);
    EXPECT_EQ(vp::extract_workspace_bytes(view, grid_of(glm::ivec3(8)), {}, bad.limits), 0u);
    EXPECT_EQ(vp::extract_async(gpu, view, grid_of(glm::ivec3(9)), out, {}, room.view).code,
              vp::status_code::extent_mismatch);
}

TEST(DeviceRemeshAsync, HasTheBytesOfRemesh) {
    const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
    expect_same_remesh({bad_model(0)}, g, {});
    expect_same_remesh({bad_model(1), ball(glm::vec3(0.5f), 0.3f, 1)}, g, {.bodies = vp::bodies::draw});
    expect_same_remesh({bad_model(2), bad_model(3)}, g.crop({1, 2, 3}, {16, 17, 15}),
                       {.place = vp::place::mean, .rule = vp::fill_rule::even_odd, .quads = true});
    expect_same_remesh({bad_model(4)}, g,
                       {.sample = vp::sample::corner, .border = vp::border::open, .min_component = 12});
}

TEST(DeviceRemeshAsync, GraphsFollowTheVertices) {
    const device_test::owned_stream stream;
    vp::cuda_backend gpu{stream.get()};
    const vp::grid g = grid_around_models(glm::ivec3(14, 13, 12));
    const host_mesh m = ball(glm::vec3(0.5f), 0.35f, 1);
    vp::cuda_backend::buffer<glm::vec3> positions(gpu, vp::array_view<const glm::vec3>(m.positions));
    const vp::cuda_backend::buffer<glm::uvec3> triangles(gpu, vp::array_view<const glm::uvec3>(m.triangles));
    const draw_type d{{positions.view(), triangles.view()}, {}, {}};
    const std::span<const draw_type> draws(&d, 1);
    const remesh_workspace room(gpu, draws, g, {}, {{2000, 2000, 3000}, 2000});
    vp::surface_result out;
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    const device_test::captured_graph graph(stream.get(),
                                            [&] { return vp::remesh_async(gpu, draws, g, out, {}, room.view); });
    for (int frame = 0; frame < 3; ++frame) { // the second beside the grid
        std::vector<glm::vec3> moved = m.positions;
        for (glm::vec3& p : moved) p.x += frame == 1 ? 5.0f : 0.1f * static_cast<float>(frame);
        ASSERT_EQ(cudaMemcpyAsync(positions.data(), moved.data(), moved.size() * sizeof(glm::vec3),
                                  cudaMemcpyHostToDevice, stream.get()),
                  cudaSuccess);
        graph.launch(stream.get());
        const vp::status s = vp::read_remesh_status(gpu, room.view);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.surface.vertices == 0, frame == 1);
        EXPECT_TRUE(to_host(gpu, out, s).has_same_arrays(remesh_draws(gpu, draws, g, {})));
    }
}

TEST(DeviceRemeshAsync, RefusesWhatItCannotDo) {
    vp::cuda_backend gpu;
    const vp::grid g = grid_around_models(glm::ivec3(9));
    const auto run = [&](const host_mesh& m, const vp::remesh_options& o, const vp::remesh_limits& limits,
                         std::size_t missing = 0) {
        const gpu_mesh mesh(gpu, m.positions, m.triangles);
        const draw_type d{mesh.view(), {}, {}};
        const std::span<const draw_type> draws(&d, 1);
        const std::size_t bytes = vp::remesh_workspace_bytes(draws, g, o, limits);
        const vp::cuda_backend::buffer<std::uint8_t> memory(gpu, std::max<std::size_t>(bytes, 1));
        const vp::remesh_workspace_view view{const_cast<std::uint8_t*>(memory.data()), bytes - missing, limits};
        vp::surface_result out;
        const vp::status s = vp::remesh_async(gpu, draws, g, out, o, view);
        if (!s.ok()) return s.code;
        const vp::status found = vp::read_remesh_status(gpu, view);
        EXPECT_EQ(read(gpu, out.counts, 1)[0], found.surface);
        return found.code;
    };
    const host_mesh m = ball(glm::vec3(0.5f), 0.3f, 1);
    const vp::remesh_limits limits{{500, 500, 800}, 1000};
    EXPECT_EQ(run(m, {}, limits), vp::status_code::ok);
    EXPECT_EQ(run({}, {}, limits), vp::status_code::ok);
    EXPECT_EQ(run({}, {}, {}), vp::status_code::ok);
    EXPECT_EQ(run(m, {}, limits, 1), vp::status_code::capacity_exceeded);
    EXPECT_EQ(run(m, {.repair = vp::repair::close_holes}, limits), vp::status_code::strategy_unavailable);
    EXPECT_EQ(run(m, {.level = 0.1}, limits), vp::status_code::strategy_unavailable);
    EXPECT_EQ(run(m, {.embedded = true}, limits), vp::status_code::strategy_unavailable);
    EXPECT_EQ(run(m, {}, {limits.surface, std::uint64_t{1} << 33}), vp::status_code::size_overflow);
    host_mesh wrong = m;
    wrong.triangles[7].y = 5000;
    EXPECT_EQ(run(wrong, {}, limits), vp::status_code::index_out_of_range);
    EXPECT_EQ(run(m, {}, {limits.surface, 3}), vp::status_code::capacity_exceeded);
}
