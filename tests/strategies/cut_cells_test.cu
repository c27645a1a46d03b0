// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cut cells and links on the device: the bytes and counters of cpu_backend, for triangles of all sizes, by all axes, of
// parts of a grid, for bodies and blends.
#include "device_test.hpp"
#include "solid_drawings.hpp"

#include "../programs/module_cases.hpp"

#include <voxelpipe/cells/device/cells.cuh>
#include <voxelpipe/cells/device/sparse_cells.cuh>
#include <voxelpipe/slabs/devices.cuh>
#include <voxelpipe/slabs/stream.hpp>

#include <cpu_ref/cells/sparse_cells.hpp>
#include <cpu_ref/cells/voxelize_cells.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace vp = voxelpipe;

namespace {
using device_test::mesh_data;

// All that a fragment has, and a discard.
struct everything {
    std::uint32_t id;
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        const auto hash = static_cast<std::uint32_t>(f.voxel.x * 73 + f.voxel.y * 179 + f.voxel.z * 283) + f.draw + id;
        return vp::outputs(f.fraction, f.units, f.aperture, f.next_aperture, f.is_cut).discard_if(hash % 13 == 5);
    }
};
template <class Backend>
using every_target =
    vp::framebuffer<Backend, vp::target<float, vp::blend::add>, vp::target<std::int64_t, vp::blend::replace>,
                    vp::target<std::int64_t, vp::blend::max>, vp::target<std::int64_t, vp::blend::min>,
                    vp::target<vp::bit, vp::blend::bit_or>>;
// All that a shader can ask for.
struct everything_measured {
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area, vp::cell_value::sheets>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        return vp::outputs(f.centroid.x, f.centroid.y, f.centroid.z, f.area, f.area_centroid.x, f.area_centroid.y,
                           f.area_centroid.z, static_cast<std::uint32_t>(f.is_multi_cut ? 2 : 0) + (f.is_cut ? 1 : 0));
    }
};
template <class T>
using replaced = vp::target<T, vp::blend::replace>;
template <class Backend>
using measured_target =
    vp::framebuffer<Backend, replaced<float>, replaced<float>, replaced<float>, replaced<double>, replaced<float>,
                    replaced<float>, replaced<float>, vp::target<std::uint32_t, vp::blend::bit_xor>>;
template <class Backend>
using one_target = vp::framebuffer<Backend, vp::target<float, vp::blend::replace>>;

template <class Backend, class Framebuffer, class Shader>
vp::status draw(Backend& be, const std::vector<mesh_data>& meshes, const vp::grid& g, const Shader& shader,
                Framebuffer& fb, const vp::cell_options& o) {
    std::vector<vp::mesh<Backend>> on_backend;
    for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> draws;
    for (const auto& m : on_backend) draws.push_back({m.view(), {}, shader});
    return vp::voxelize_cells(be, draws, g, fb, o);
}

template <class Framebuffer>
inline constexpr std::size_t num_targets = 0;
template <class Backend, class... Targets>
inline constexpr std::size_t num_targets<vp::framebuffer<Backend, Targets...>> = sizeof...(Targets);

template <template <class> class Framebuffer, class Shader>
void expect_same(const std::vector<mesh_data>& meshes, const vp::grid& g, const Shader& shader,
                 const vp::cell_options& o = {}) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    Framebuffer<vp::cpu_backend> a(cpu, g.extent);
    Framebuffer<vp::cuda_backend> b(gpu, g.extent);
    const vp::status expected = draw(cpu, meshes, g, shader, a, o), found = draw(gpu, meshes, g, shader, b, o);
    ASSERT_TRUE(expected.ok()) << expected.message();
    ASSERT_TRUE(found.ok()) << found.message();
    EXPECT_EQ(expected.counts, found.counts);
    EXPECT_TRUE(expected.cells == found.cells);
    EXPECT_GT(expected.cells.cut_voxels, 0u);
    vp::core::for_each_index<num_targets<Framebuffer<vp::cpu_backend>>>([&]<std::size_t I>() {
        const std::string what = "target " + std::to_string(I);
        device_test::expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), what.c_str());
    });
}

} // namespace

TEST(DeviceCells, TrianglesOfAllSizesHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{33, 26, 21};
    mesh_data m = device_test::mixed_triangles(120, 25, 5);
    device_test::append(m, device_test::long_triangles(extent, 12, 3));
    for (int axis = 0; axis < 3; ++axis)
        expect_same<every_target>({m}, device_test::box_grid(extent), everything{3}, {.axis = axis});
    expect_same<one_target>({m}, device_test::box_grid(extent), vp::fraction{});
}

// Closed bodies with faces in the lattice's planes, in several draws, and parts of a grid.
TEST(DeviceCells, BodiesAndPartsOfGridsHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{40, 21, 35};
    mesh_data bodies = device_test::tied_bodies(30, 8, 2);
    const std::vector<mesh_data> meshes{bodies, device_test::ball({17, 9, 14}, 6.3f, 7)};
    vp::grid flat = device_test::box_grid(extent);
    flat.voxel_size = {0.5f, 1.25f, 0.75f};
    for (const vp::bodies b : {vp::bodies::call, vp::bodies::draw})
        for (const vp::grid& g : {device_test::box_grid(extent), flat, flat.crop({5, 3, 2}, {29, 14, 31})})
            expect_same<every_target>(meshes, g, everything{1}, {.bodies = b, .axis = b == vp::bodies::draw ? 1 : 0});
}

// Centroids, areas and sheets, of flat sides in the lattice's planes too.
TEST(DeviceCells, MeasuresHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{25, 21, 24};
    mesh_data m = device_test::tied_bodies(20, 7, 4);
    const std::vector<mesh_data> meshes{m, device_test::ball({12, 9, 11}, 6.3f, 7),
                                        device_test::long_triangles(extent, 5, 3)};
    vp::grid flat = device_test::box_grid(extent);
    flat.voxel_size = {0.5f, 1.25f, 0.75f};
    for (int axis = 0; axis < 3; ++axis)
        expect_same<measured_target>(meshes, axis == 1 ? flat.crop({5, 3, 2}, {19, 14, 20}) : flat,
                                     everything_measured{},
                                     {.bodies = axis == 2 ? vp::bodies::draw : vp::bodies::call, .axis = axis});
}

// The centroids of faces, by themselves and beside all else.
template <class Fragment>
struct faces_measured {
    using fragment = Fragment;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        const glm::vec3 &a = f.aperture_centroid, &b = f.next_aperture_centroid;
        return vp::outputs(a.x, a.y, a.z, b.x, b.y, b.z, f.aperture, f.next_aperture);
    }
};
template <class Backend>
using face_targets = vp::framebuffer<Backend, replaced<float>, replaced<float>, replaced<float>, replaced<float>,
                                     replaced<float>, replaced<float>, replaced<std::int64_t>, replaced<std::int64_t>>;

TEST(DeviceCells, FacesHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{41, 21, 24};
    const std::vector<mesh_data> meshes{device_test::tied_bodies(20, 7, 4), device_test::ball({19, 9, 11}, 8.3f, 7),
                                        device_test::long_triangles(extent, 5, 3)};
    const vp::grid g = device_test::box_grid(extent);
    for (int axis = 0; axis < 3; ++axis)
        expect_same<face_targets>(meshes, axis == 1 ? g.crop({5, 3, 2}, {35, 14, 20}) : g,
                                  faces_measured<vp::measured_cell<vp::cell_value::faces>>{},
                                  {.bodies = axis == 2 ? vp::bodies::draw : vp::bodies::call, .axis = axis});
    using all = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area, vp::cell_value::sheets,
                                  vp::cell_value::faces>;
    expect_same<face_targets>(meshes, g, faces_measured<all>{});
}

// Cones over the holes of each body, or of all together, in parts of a grid too.
TEST(DeviceCells, ClosedHolesHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{22, 21, 23};
    mesh_data open = device_test::ball({11, 10, 11}, 7.3f, 7), other = device_test::ball({12, 9, 11}, 5.2f, 6);
    open.triangles.erase(open.triangles.begin() + 3, open.triangles.begin() + 9);
    other.triangles.erase(other.triangles.end() - 7);
    const vp::grid g = device_test::box_grid(extent);
    for (int axis = 0; axis < 3; ++axis)
        for (const vp::bodies b : {vp::bodies::call, vp::bodies::draw})
            expect_same<every_target>({open, other}, axis == 1 ? g.crop({4, 3, 5}, {9, 15, 12}) : g, everything{2},
                                      {.bodies = b, .axis = axis, .repair = vp::repair::close_holes});
    expect_same<measured_target>({open, other}, g, everything_measured{},
                                 {.repair = vp::repair::close_holes, .max_hole_edges = 5});
}

// Lists of bodies that share voxels: all arrays of the cpu's, by all axes, of parts of a grid, and without a payload.
struct listed_cell {
    std::int64_t units, aperture;
    std::uint32_t draw, is_cut;
};
struct listing {
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(listed_cell{f.units, f.aperture, f.draw, f.is_cut ? 1u : 0u})
            .discard_if((f.voxel.x + 3 * f.voxel.y + f.voxel.z) % 11 == 4 && f.draw == 1);
    }
};
template <class Payload, class Shader>
static void expect_same_lists(const std::vector<mesh_data>& meshes, const vp::grid& g, const Shader& shader,
                              const vp::cell_options& o) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::abuffer<vp::cpu_backend, Payload> a(cpu);
    vp::abuffer<vp::cuda_backend, Payload> b(gpu);
    const vp::status expected = draw(cpu, meshes, g, shader, a, o), found = draw(gpu, meshes, g, shader, b, o);
    ASSERT_TRUE(expected.ok()) << expected.message();
    ASSERT_TRUE(found.ok()) << found.message();
    EXPECT_EQ(expected.counts, found.counts);
    EXPECT_TRUE(expected.cells == found.cells);
    EXPECT_EQ(a.extent, b.extent);
    const auto x = a.to_host(cpu), y = b.to_host(gpu);
    EXPECT_GT(x.primitives.size(), x.voxels.size());
    device_test::expect_same_bytes(x.voxels, y.voxels, "voxels");
    device_test::expect_same_bytes(x.offsets, y.offsets, "offsets");
    device_test::expect_same_bytes(x.primitives, y.primitives, "draws");
    if constexpr (!std::is_void_v<Payload>) device_test::expect_same_bytes(x.payloads, y.payloads, "payloads");
}

TEST(DeviceCells, ListsOfBodiesHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{27, 21, 24};
    const std::vector<mesh_data> meshes{device_test::tied_bodies(20, 7, 4), device_test::ball({12, 9, 11}, 6.3f, 7),
                                        device_test::ball({15, 10, 12}, 7.1f, 6)};
    const vp::grid g = device_test::box_grid(extent), part = g.crop({5, 3, 2}, {19, 14, 20});
    for (int axis = 0; axis < 3; ++axis) {
        const vp::cell_options each{.bodies = vp::bodies::draw, .axis = axis};
        expect_same_lists<listed_cell>(meshes, axis == 1 ? part : g, listing{}, each);
        expect_same_lists<void>(meshes, axis == 0 ? part : g, vp::fraction{}, each);
    }
    vp::cuda_backend gpu;
    vp::abuffer<vp::cuda_backend, float> lists(gpu);
    EXPECT_TRUE(draw(gpu, meshes, g, vp::fraction{}, lists, {}).ok());
    const std::size_t drawn = lists.num_voxels();
    EXPECT_GT(drawn, 1000u);
    EXPECT_EQ(lists.num_fragments(), drawn);
    mesh_data bad = device_test::ball({2, 2, 2}, 1.5f, 4);
    bad.triangles.push_back({0, 1, 1000000});
    EXPECT_EQ(draw(gpu, {bad}, g, vp::fraction{}, lists, {}).code, vp::status_code::index_out_of_range);
    EXPECT_EQ(lists.num_voxels(), drawn); // nothing is written
    EXPECT_TRUE(draw(gpu, {}, g, vp::fraction{}, lists, {}).ok());
    EXPECT_EQ(lists.num_voxels(), 0u);
}

// Slabs of a stream on the device, with holes that the host closes: the cpu's whole.
TEST(DeviceCells, SlabsOfAStreamAreTheWhole) {
    namespace slabs = vp::slabs;
    const glm::ivec3 extent{14, 17, 15};
    mesh_data open = device_test::ball({7, 8, 7}, 5.3f, 7);
    open.triangles.erase(open.triangles.end() - 7, open.triangles.end() - 3);
    const vp::grid g = device_test::box_grid(extent);
    const vp::cell_options how{.count_open_edges = false, .repair = vp::repair::close_holes};
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    one_target<vp::cpu_backend> whole(cpu, extent);
    const vp::status expected = draw(cpu, {open}, g, vp::fraction{}, whole, how);
    ASSERT_TRUE(expected.ok()) << expected.message();
    slabs::stream stream(gpu, g, vp::passthrough{}, {.num_slabs = 4, .repair = vp::repair::close_holes});
    ASSERT_TRUE(stream.add({open.positions, open.triangles}).ok());
    std::vector<float> found;
    std::size_t num_slabs = 0;
    const vp::status s = stream.draw_cells(
        vp::fraction{},
        [&](glm::ivec3 e) {
            return one_target<vp::cuda_backend>{gpu, e};
        },
        [&](const slabs::slab&, const one_target<vp::cuda_backend>& part) { // layers along z follow each other
            const auto values = vp::get<0>(part).to_host(gpu);
            found.insert(found.end(), values.begin(), values.end());
            ++num_slabs;
        },
        how);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(num_slabs, 4u);
    EXPECT_EQ(s.counts, expected.counts);
    EXPECT_TRUE(s.cells == expected.cells);
    EXPECT_GT(s.cells.cones, 0u);
    device_test::expect_same_bytes(vp::get<0>(whole).to_host(cpu), found, "slabs");
}

// Slabs of several GPUs, dense and sparse, with and without holes that are closed: the cpu's whole.
TEST(DeviceCells, SlabsOfSeveralGpusAreTheWhole) {
    namespace slabs = vp::slabs;
    const vp::grid g = device_test::box_grid(glm::ivec3(26, 24, 27)).crop({1, 0, 2}, {24, 23, 24});
    mesh_data open = device_test::ball({13, 12, 14}, 9.3f, 8);
    open.triangles.erase(open.triangles.end() - 9, open.triangles.end() - 3);
    using fractions = vp::target<float, vp::blend::replace>;
    vp::cpu_backend cpu;
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes}) {
        const vp::cell_options how{.count_open_edges = false, .repair = repair};
        vp::sparse_framebuffer<vp::cpu_backend, fractions> whole(cpu, g.extent);
        const vp::status expected = draw(cpu, {open}, g, vp::fraction{}, whole, how);
        ASSERT_TRUE(expected.ok()) << expected.message();
        EXPECT_EQ(expected.cells.cones != 0, repair == vp::repair::close_holes);
        slabs::devices gpus(std::vector<int>{0, 0, 0}, false);
        slabs::device_options options;
        options.is_solid = true;
        options.may_turn = false;
        options.repair = repair;
        slabs::device_slabs parts(gpus, g, vp::mesh_view<>{open.positions, open.triangles}, vp::passthrough{}, options);
        auto dense = parts.make([](vp::cuda_backend& gpu, glm::ivec3 e) {
            return one_target<vp::cuda_backend>{gpu, e};
        });
        auto bricks = parts.make([](vp::cuda_backend& gpu, glm::ivec3 e) {
            return vp::sparse_framebuffer<vp::cuda_backend, fractions>{gpu, e};
        });
        ASSERT_EQ(dense.size(), 3u);
        std::vector<float> values;
        std::vector<vp::host_sparse<fractions>> hosts;
        for (int call = 0; call < 2; ++call) {
            const vp::status s = call == 0 ? parts.draw_cells(vp::fraction{}, dense, how)
                                           : parts.draw_cells(vp::fraction{}, bricks, how);
            ASSERT_TRUE(s.ok()) << s.message();
            EXPECT_EQ(s.counts, expected.counts);
            EXPECT_TRUE(s.cells == expected.cells);
        }
        for (std::size_t i = 0; i < dense.size(); ++i) {
            const auto layers = vp::get<0>(dense[i]).to_host(gpus.backend(i));
            values.insert(values.end(), layers.begin(), layers.end());
            hosts.push_back(bricks[i].to_host(gpus.backend(i)));
        }
        const auto host = whole.to_host(cpu);
        EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const vp::host_sparse<fractions>>(hosts)), host));
        const auto all = vp::get<0>(host).to_dense();
        std::size_t at = 0, wrong = 0;
        vp::for_each_voxel(all, [&](const glm::ivec3&, float value) { wrong += values[at++] != value; });
        EXPECT_EQ(wrong, 0u);
        vp::cell_options other = how;
        other.axis = 1;
        EXPECT_EQ(parts.draw_cells(vp::fraction{}, dense, other).code, vp::status_code::bad_cell_options);
    }
}

// What programs make has the cells of a mesh.
TEST(DeviceCells, ProgramsAreTheMadeMesh) {
    vp::cuda_backend gpu;
    programs::expect_cells_of_programs(gpu);
}

// Bricks, tiles and values of both backends, of both ways to make them, and the values of a dense call.
struct placeless {
    static constexpr bool ignores_voxel = true;
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.fraction, f.next_aperture, f.is_cut).discard_if((f.units & 7) == 5);
    }
};
struct with_place {
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return placeless{}(f).discard_if((f.voxel.x + 3 * f.voxel.y) % 5 == 0);
    }
};
using sum_target = vp::target<float, vp::blend::add>;
using face_target = vp::target<std::int64_t, vp::blend::max>;
using cut_target = vp::target<vp::bit, vp::blend::bit_or>;
template <class Shader>
static void expect_same_bricks(const std::vector<mesh_data>& meshes, const vp::grid& g, const vp::cell_options& o,
                               bool loads) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, sum_target, face_target, cut_target> dense(cpu, g.extent);
    vp::sparse_framebuffer<vp::cpu_backend, sum_target, face_target, cut_target> a(cpu, g.extent);
    vp::sparse_framebuffer<vp::cuda_backend, sum_target, face_target, cut_target> b(gpu, g.extent);
    for (int call = 0; call < (loads ? 2 : 1); ++call) {
        if (call == 1) {
            vp::get<0>(dense).load();
            vp::get<0>(a).load();
            vp::get<0>(b).load();
        }
        const vp::status whole = draw(cpu, meshes, g, Shader{}, dense, o),
                         expected = draw(cpu, meshes, g, Shader{}, a, o), found = draw(gpu, meshes, g, Shader{}, b, o);
        ASSERT_TRUE(whole.ok()) << whole.message();
        ASSERT_TRUE(expected.ok()) << expected.message();
        ASSERT_TRUE(found.ok()) << found.message();
        EXPECT_EQ(whole.counts, found.counts);
        EXPECT_EQ(expected.counts, found.counts);
        EXPECT_TRUE(whole.cells == found.cells);
    }
    const auto x = a.to_host(cpu), y = b.to_host(gpu);
    EXPECT_TRUE(vp::same_contents(x, y));
    EXPECT_EQ(x.is_tiled, y.is_tiled);
    EXPECT_EQ(y.is_tiled, vp::core::ignores_voxel<Shader> && !loads);
    const auto all = vp::get<0>(dense).to_host_target(cpu), of_bricks = vp::get<0>(y).to_dense();
    std::size_t wrong = 0;
    vp::for_each_voxel(all, [&](const glm::ivec3& v, float value) { wrong += of_bricks(v.x, v.y, v.z) != value; });
    EXPECT_EQ(wrong, 0u);
}

TEST(DeviceCells, SparseFramebuffersHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{42, 33, 38};
    mesh_data m = device_test::tied_bodies(30, 6, 2);
    const std::vector<mesh_data> meshes{m, device_test::ball({20, 17, 18}, 15.3f, 9)};
    const vp::grid g = device_test::box_grid(extent);
    for (int axis = 0; axis < 3; ++axis) {
        const vp::cell_options o{.bodies = axis == 1 ? vp::bodies::draw : vp::bodies::call, .axis = axis};
        const vp::grid part = axis == 2 ? g.crop({3, 2, 5}, {37, 30, 31}) : g;
        expect_same_bricks<placeless>(meshes, part, o, false);
        expect_same_bricks<with_place>(meshes, part, o, false);
    }
    expect_same_bricks<placeless>(meshes, g, {}, true);
    vp::cuda_backend gpu;
    vp::sparse_framebuffer<vp::cuda_backend, vp::target<float, vp::blend::replace>> fb(gpu, extent);
    fb.limit({2, 5});
    EXPECT_EQ(draw(gpu, meshes, g, vp::fraction{}, fb, {}).code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(fb.num_bricks(), 0u);
    EXPECT_TRUE(draw(gpu, {}, g, vp::fraction{}, fb, {}).ok());
}

// The lists of both backends, record by record. Returns the number of crossed links.
static std::uint64_t expect_same_links(const std::vector<mesh_data>& meshes, const vp::grid& g, int neighbours) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::link_list<vp::cpu_backend> a(cpu);
    vp::link_list<vp::cuda_backend> b(gpu);
    const auto run = [&](auto& backend, auto& list) {
        using backend_type = std::remove_reference_t<decltype(backend)>;
        std::vector<vp::mesh<backend_type>> on_backend;
        for (const mesh_data& m : meshes) on_backend.emplace_back(backend, m.positions, m.triangles);
        std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, vp::none>> draws;
        for (const auto& m : on_backend) draws.push_back({m.view(), {}, {}});
        return vp::voxelize_links(backend, draws, g, list, {.neighbours = neighbours});
    };
    const vp::status expected = run(cpu, a), found = run(gpu, b);
    EXPECT_TRUE(expected.ok()) << expected.message();
    EXPECT_TRUE(found.ok()) << found.message();
    EXPECT_EQ(expected.counts, found.counts);
    EXPECT_EQ(a.neighbours, b.neighbours);
    device_test::expect_same_bytes(a.voxels.to_host(cpu), b.voxels.to_host(gpu), "voxels");
    device_test::expect_same_bytes(a.q.to_host(cpu), b.q.to_host(gpu), "q");
    device_test::expect_same_bytes(a.primitives.to_host(cpu), b.primitives.to_host(gpu), "primitives");
    device_test::expect_same_bytes(a.draws.to_host(cpu), b.draws.to_host(gpu), "draws");
    return expected.counts.fragments;
}

TEST(DeviceLinks, HaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{25, 21, 24};
    mesh_data m = device_test::mixed_triangles(120, 22, 5);
    device_test::append(m, device_test::long_triangles(extent, 8, 3));
    const std::vector<mesh_data> meshes{m, device_test::tied_bodies(20, 8, 2), device_test::ball({12, 9, 11}, 6.3f, 7)};
    vp::grid flat = device_test::box_grid(extent);
    flat.voxel_size = {0.5f, 1.25f, 0.75f};
    EXPECT_GT(expect_same_links(meshes, device_test::box_grid(extent), 26), 5000u);
    EXPECT_GT(expect_same_links(meshes, flat, 18), 1000u);
    EXPECT_GT(expect_same_links(meshes, flat.crop({5, 3, 2}, {17, 14, 19}), 26), 1000u);
    EXPECT_EQ(expect_same_links({}, flat, 18), 0u);
}

// Slabs of a stream on the device: the cpu's records of the whole, with the whole's primitives.
TEST(DeviceLinks, SlabsOfAStreamAreTheWhole) {
    namespace slabs = vp::slabs;
    const glm::ivec3 extent{14, 17, 15};
    mesh_data m = device_test::ball({7, 8, 7}, 5.3f, 7);
    device_test::append(m, device_test::long_triangles(extent, 5, 3));
    const vp::grid g = device_test::box_grid(extent).crop({1, 2, 1}, {12, 14, 13});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::link_list<vp::cpu_backend> whole(cpu);
    const vp::mesh_view<> view{m.positions, m.triangles};
    const vp::status expected = vp::voxelize_links(cpu, view, g, vp::passthrough{}, whole);
    ASSERT_TRUE(expected.ok()) << expected.message();
    slabs::stream stream(gpu, g, vp::passthrough{}, {.num_slabs = 4, .is_links = true});
    ASSERT_TRUE(stream.add(view).ok());
    std::vector<glm::ivec3> voxels;
    std::vector<float> q;
    std::vector<std::uint32_t> primitives;
    const vp::status s =
        stream.draw_links([&](const slabs::slab& part, const vp::link_list<vp::cuda_backend>& of_slab) {
            for (const glm::ivec3& p : of_slab.voxels.to_host(gpu)) voxels.push_back(p + part.where.offset - g.offset);
            for (const float f : of_slab.q.to_host(gpu)) q.push_back(f);
            for (const std::uint32_t p : of_slab.primitives.to_host(gpu)) primitives.push_back(p);
        });
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, expected.counts);
    EXPECT_GT(voxels.size(), 100u);
    device_test::expect_same_bytes(whole.voxels.to_host(cpu), voxels, "voxels");
    device_test::expect_same_bytes(whole.q.to_host(cpu), q, "q");
    device_test::expect_same_bytes(whole.primitives.to_host(cpu), primitives, "primitives");
}

TEST(DeviceCells, NothingAndBadIndices) {
    vp::cuda_backend gpu;
    const vp::grid g = device_test::box_grid(glm::ivec3(5));
    one_target<vp::cuda_backend> fb(gpu, g.extent);
    EXPECT_TRUE(draw(gpu, {}, g, vp::fraction{}, fb, {}).ok());
    mesh_data m = device_test::ball({2, 2, 2}, 1.5f, 4);
    m.triangles.push_back({0, 1, 1000000});
    EXPECT_EQ(draw(gpu, {m}, g, vp::fraction{}, fb, {}).code, vp::status_code::index_out_of_range);
    m.positions.clear();
    EXPECT_EQ(draw(gpu, {m}, g, vp::fraction{}, fb, {}).code, vp::status_code::index_out_of_range);
    for (const float f : vp::get<0>(fb).to_host(gpu)) EXPECT_EQ(f, 0.0f);
}
