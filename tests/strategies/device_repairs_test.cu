// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Repairs of solids in slabs of several GPUs (slabs/devices.cuh): voxels, counts and counts of rows are those of one
// call, for broken meshes, also such that leave the grid. One GPU works for several where there is one.

#include "solid_drawings.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <string>

using namespace device_test;
namespace slabs = voxelpipe::slabs;

namespace {

template <class Backend>
using values = vp::framebuffer<Backend, vp::target<std::uint32_t, vp::blend::replace>>;
template <class Backend>
using sparse_bits = vp::sparse_framebuffer<Backend, vp::target<vp::bit, vp::blend::bit_or>>;
constexpr id_of_fragment numbered{5};
#if defined(__NVCC__)
constexpr bool is_parallel = true;
#else
constexpr bool is_parallel = false; // emulated GPUs work for one thread
#endif

std::vector<int> gpus_for(int num_slabs) {
    const int all = std::max(1, static_cast<int>(slabs::devices::all().size()));
    std::vector<int> ordinals;
    for (int i = 0; i < num_slabs; ++i) ordinals.push_back(i % all);
    return ordinals;
}

mesh_data moved(mesh_data m, const glm::vec3& by) {
    for (glm::vec3& p : m.positions) p += by;
    return m;
}

// Slabs of about equal thickness, one for each GPU however few triangles there are.
slabs::device_options equal_slabs() {
    slabs::device_options o;
    o.voxel_bytes = 1000;
    return o;
}

// Slabs of a mesh, and the same in one call on the CPU.
struct case_of_slabs {
    mesh_data m;
    vp::grid g;
    vp::solid_options how;
    int num_slabs = 2;
    slabs::device_options options = equal_slabs();

    void expect_same() {
        vp::cpu_backend cpu;
        options.is_solid = true;
        options.repair = how.repair;
        slabs::devices gpus(gpus_for(num_slabs), is_parallel);
        const vp::mesh_view<> view{m.positions, m.triangles};
        slabs::device_slabs drawn(gpus, g, view, vp::passthrough{}, options);
        ASSERT_EQ(drawn.size(), gpus.size());
        auto parts = drawn.make([](vp::cuda_backend& gpu, glm::ivec3 extent) {
            return values<vp::cuda_backend>{gpu, extent};
        });
        for (const int change : {0, 1}) { // another call of the same slabs, with other options
            vp::solid_options o = how;
            if (change == 1) o.max_hole_edges = 3, o.closing = o.repair == vp::repair::exterior ? 3 - o.closing : 0;
            values<vp::cpu_backend> whole{cpu, g.extent};
            const vp::status one = vp::voxelize_solid(cpu, view, g, vp::passthrough{}, numbered, whole, o);
            const vp::status all = drawn.draw_solid(numbered, parts, o);
            ASSERT_TRUE(one.ok() && all.ok()) << one.message() << "; " << all.message();
            expect_same_counts(one.counts, all.counts);
            EXPECT_EQ(one.solid, all.solid);
            const auto expected = vp::get<0>(whole).to_host_target(cpu);
            for (std::size_t i = 0; i < parts.size(); ++i) {
                const glm::ivec3 from = drawn.slabs()[i].where.offset - g.offset;
                int wrong = 0;
                vp::for_each_voxel(vp::get<0>(parts[i]).to_host_target(gpus.backend(i)),
                                   [&](const glm::ivec3& v, std::uint32_t value) {
                                       wrong += value != expected(v.x + from.x, v.y + from.y, v.z + from.z) ? 1 : 0;
                                   });
                EXPECT_EQ(wrong, 0) << "slab " << i;
            }
        }
    }
};

// Inside, and over the faces of each axis.
const glm::vec3 places[] = {{0.0f, 0.0f, 0.0f}, {9.3f, -8.7f, 3.25f}, {-7.1f, 4.6f, -9.4f}, {2.0f, 12.2f, 8.8f}};

TEST(DeviceRepairs, HolesAndVotes) {
    for (const mesh_data& m : broken_meshes())
        for (const glm::vec3& by : places) {
            SCOPED_TRACE(std::to_string(m.triangles.size()) + " triangles, moved by " + std::to_string(by.x));
            const mesh_data there = moved(m, by);
            const vp::grid g = box_grid({37, 26, 25}), part = box_grid({67, 31, 29}).crop({3, 5, 2}, {33, 17, 20});
            for (const vp::grid& where : {g, part}) {
                case_of_slabs{there, where, {.repair = vp::repair::vote}}.expect_same();
                case_of_slabs{there, where, {.extent = vp::solid_extent::outer, .repair = vp::repair::close_holes}, 3}
                    .expect_same();
            }
            case_of_slabs{there, g, {.repair = vp::repair::vote}, 3}.expect_same();
            case_of_slabs{there, g, {.repair = vp::repair::vote, .with_cover = false}, 3}.expect_same();
            case_of_slabs{there, g, {.rule = vp::fill_rule::even_odd, .repair = vp::repair::close_holes}}.expect_same();
        }
}

// Small enough for valgrind, which then says whether a result depends on memory that nobody has written.
TEST(DeviceRepairs, FourSlabs) {
    const mesh_data there = moved(broken_meshes()[0], places[1]);
    const vp::grid g = box_grid({37, 26, 25});
    case_of_slabs{there, g, {}, 4}.expect_same();
    case_of_slabs{there, g, {.repair = vp::repair::vote}, 4}.expect_same();
    case_of_slabs{there, g, {.repair = vp::repair::close_holes}, 4}.expect_same();
}

TEST(DeviceRepairs, WindingNumbers) {
    const mesh_data there = moved(broken_meshes()[1], places[2]);
    const vp::grid part = box_grid({67, 31, 29}).crop({3, 5, 2}, {33, 17, 20});
    case_of_slabs{there, part, {.repair = vp::repair::winding}, 3}.expect_same();
    case_of_slabs{there, box_grid({37, 26, 25}), {.repair = vp::repair::winding}}.expect_same();
}

TEST(DeviceRepairs, Exteriors) {
    for (const mesh_data& m : broken_meshes())
        for (const glm::vec3& by : places)
            for (const int closing : {0, 1, 3}) {
                SCOPED_TRACE(std::to_string(m.triangles.size()) + " triangles, moved by " + std::to_string(by.x) +
                             ", closing " + std::to_string(closing));
                case_of_slabs on_gpus{moved(m, by),
                                      box_grid({37, 26, 25}),
                                      {.repair = vp::repair::exterior, .closing = closing},
                                      closing == 1 ? 3 : 2};
                on_gpus.options.floods_on_host = by.z == places[1].z;
                on_gpus.expect_same();
            }
}

// Slabs are along y for holes where that is better, and along z for the others.
TEST(DeviceRepairs, OnlyHolesMayTurn) {
    mesh_data thin = broken_meshes()[0]; // one layer along x and z
    for (glm::vec3& p : thin.positions) p = {18.0f + 0.01f * p.x, p.y, 12.0f + 0.01f * p.z};
    const vp::grid g = box_grid({37, 26, 25});
    for (const auto repair : {vp::repair::close_holes, vp::repair::vote, vp::repair::exterior, vp::repair::winding}) {
        slabs::devices gpus(gpus_for(2), is_parallel);
        slabs::device_options options;
        options.repair = repair;
        const slabs::device_slabs drawn(gpus, g, vp::mesh_view<>{thin.positions, thin.triangles}, vp::passthrough{},
                                        options);
        EXPECT_EQ(drawn.cuts().axis, vp::core::has_cones(repair) ? 1 : 2);
    }
    const vp::solid_options holes{.extent = vp::solid_extent::outer, .repair = vp::repair::close_holes};
    case_of_slabs{thin, g, holes, 2, {}}.expect_same();
}

// Along y where x would be best: rows along x need the triangles beside a slab. Lists need slabs along z.
TEST(DeviceRepairs, SolidsAreNotCutAlongX) {
    mesh_data thin = broken_meshes()[0]; // one layer along z, few along y
    for (glm::vec3& p : thin.positions) p = {p.x, 11.0f + 0.2f * p.y, 12.0f + 0.01f * p.z};
    const vp::grid g = box_grid({37, 26, 25});
    const vp::mesh_view<> view{thin.positions, thin.triangles};
    for (const bool is_solid : {false, true}) {
        slabs::devices gpus(gpus_for(2), is_parallel);
        slabs::device_options options;
        options.is_solid = is_solid;
        slabs::device_slabs drawn(gpus, g, view, vp::passthrough{}, options);
        EXPECT_EQ(drawn.cuts().axis, is_solid ? 1 : 0);
        auto lists = drawn.make(
            [](vp::cuda_backend& gpu, glm::ivec3) { return vp::abuffer<vp::cuda_backend, std::uint32_t>{gpu}; });
        EXPECT_EQ(drawn.draw_solid(numbered, lists).code,
                  is_solid ? vp::status_code::bad_crop : vp::status_code::bad_solid_options);
    }
    case_of_slabs{thin, g, {.extent = vp::solid_extent::outer}, 2, {}}.expect_same();
}

// Two plates that a long cone, or `closing`, joins: slabs between them have voxels, and no triangle.
TEST(DeviceRepairs, SlabsWithoutTriangles) {
    const vp::grid g = box_grid({21, 20, 40});
    mesh_data walls; // a tube without its middle, and without ends
    const auto ring = [&](float low, float high) {
        const glm::vec2 corners[] = {{4.2f, 4.3f}, {15.1f, 4.4f}, {15.2f, 14.9f}, {4.1f, 15.3f}};
        for (int i = 0; i < 4; ++i) {
            const glm::vec2 a = corners[i], b = corners[(i + 1) % 4];
            const auto first = static_cast<std::uint32_t>(walls.positions.size());
            for (const glm::vec3 p : {glm::vec3(a, low), glm::vec3(b, low), glm::vec3(b, high), glm::vec3(a, high)})
                walls.positions.push_back(p);
            walls.triangles.push_back({first, first + 1, first + 2});
            walls.triangles.push_back({first, first + 2, first + 3});
        }
    };
    ring(2.3f, 5.6f);
    ring(33.2f, 36.7f);
    slabs::device_options by_voxels = equal_slabs();
    by_voxels.may_turn = false;
    const vp::solid_options holes{.extent = vp::solid_extent::outer, .repair = vp::repair::close_holes},
        outside{.repair = vp::repair::exterior, .closing = 3};
    case_of_slabs{walls, g, holes, 3, by_voxels}.expect_same();
    case_of_slabs{walls, g, outside, 3, by_voxels}.expect_same();
    // Two plates that are 4 layers apart: what lies between them is closed, and a slab of its own.
    mesh_data plates;
    for (const float z : {15.5f, 20.5f}) {
        const auto first = static_cast<std::uint32_t>(plates.positions.size());
        for (const glm::vec2 p : {glm::vec2(3.5f), glm::vec2(17.5f, 3.5f), glm::vec2(17.5f), glm::vec2(3.5f, 17.5f)})
            plates.positions.emplace_back(p, z);
        plates.triangles.push_back({first, first + 1, first + 2});
        plates.triangles.push_back({first, first + 2, first + 3});
    }
    case_of_slabs closed{plates, box_grid({21, 20, 36}), outside, 18, by_voxels};
    closed.expect_same();
    slabs::devices gpus(gpus_for(closed.num_slabs), is_parallel);
    by_voxels.repair = vp::repair::exterior;
    slabs::device_slabs drawn(gpus, closed.g, vp::mesh_view<>{plates.positions, plates.triangles}, vp::passthrough{},
                              by_voxels);
    auto parts = drawn.make([](vp::cuda_backend& gpu, glm::ivec3 extent) {
        return sparse_bits<vp::cuda_backend>{gpu, extent};
    });
    ASSERT_TRUE(drawn.draw_solid(vp::constant(true), parts, outside).ok());
    ASSERT_EQ(drawn.slabs()[9].where.offset.z, 18); // two layers, between the plates
    EXPECT_EQ(drawn.mesh(9).triangles.size(), 1u);
    EXPECT_GT(parts[9].num_voxels(), 0u);
}

// Lists and sparse results, joined. The search may take files.
TEST(DeviceRepairs, ListsAndSparseResults) {
    const mesh_data m = moved(broken_meshes()[2], {0.25f, -3.0f, 1.5f});
    const vp::mesh_view<> view{m.positions, m.triangles};
    const vp::grid g = box_grid({37, 26, 25});
    vp::cpu_backend cpu;
    for (const auto repair : {vp::repair::close_holes, vp::repair::vote, vp::repair::exterior, vp::repair::winding}) {
        SCOPED_TRACE(static_cast<int>(repair));
        const vp::solid_options how{.repair = repair, .closing = repair == vp::repair::exterior ? 1 : 0};
        slabs::devices gpus(gpus_for(3), is_parallel);
        slabs::device_options options;
        options.repair = repair;
        options.may_turn = false;
        options.floods_on_host = true;
        options.memory = 4096;
        slabs::device_slabs drawn(gpus, g, view, vp::passthrough{}, options);

        vp::abuffer<vp::cpu_backend, std::uint32_t> lists{cpu};
        ASSERT_TRUE(vp::voxelize_solid(cpu, view, g, vp::passthrough{}, numbered, lists, how).ok());
        auto parts = drawn.make(
            [](vp::cuda_backend& gpu, glm::ivec3) { return vp::abuffer<vp::cuda_backend, std::uint32_t>{gpu}; });
        ASSERT_TRUE(drawn.draw_solid(numbered, parts, how).ok());
        vp::host_abuffer<std::uint32_t> joined;
        for (std::size_t i = 0; i < parts.size(); ++i)
            slabs::append(joined, g, drawn.slabs()[i], parts[i].to_host(gpus.backend(i)));
        expect_same_on_host(lists.to_host(cpu), joined);

        sparse_bits<vp::cpu_backend> bits{cpu, g.extent};
        ASSERT_TRUE(vp::voxelize_solid(cpu, view, g, vp::passthrough{}, vp::constant(true), bits, how).ok());
        auto bricks = drawn.make([](vp::cuda_backend& gpu, glm::ivec3 extent) {
            return sparse_bits<vp::cuda_backend>{gpu, extent};
        });
        ASSERT_TRUE(drawn.draw_solid(vp::constant(true), bricks, how).ok());
        std::vector<decltype(bits.to_host(cpu))> on_gpus;
        for (std::size_t i = 0; i < bricks.size(); ++i) on_gpus.push_back(bricks[i].to_host(gpus.backend(i)));
        EXPECT_TRUE(
            vp::same_contents(vp::merge(std::span<const decltype(bits.to_host(cpu))>(on_gpus)), bits.to_host(cpu)));
        EXPECT_GT(bits.num_voxels(), 500u);
    }
}

// Another repair than the slabs were cut for, what is found and not given, and the exterior of a crop.
TEST(DeviceRepairs, WhatCannotBeRepairedIsRefused) {
    const mesh_data m = broken_meshes()[1];
    const vp::grid g = box_grid({37, 26, 25});
    slabs::devices gpus(gpus_for(2), is_parallel);
    const auto code = [&](const vp::grid& where, vp::repair repair, const vp::solid_options& how) {
        slabs::device_options options;
        options.repair = repair;
        options.is_solid = true;
        slabs::device_slabs drawn(gpus, where, vp::mesh_view<>{m.positions, m.triangles}, vp::passthrough{}, options);
        auto parts = drawn.make([](vp::cuda_backend& gpu, glm::ivec3 extent) {
            return values<vp::cuda_backend>{gpu, extent};
        });
        return drawn.draw_solid(numbered, parts, how).code;
    };
    const vp::solid_options vote{.repair = vp::repair::vote}, outside{.repair = vp::repair::exterior};
    EXPECT_EQ(code(g, vp::repair::vote, vote), vp::status_code::ok);
    EXPECT_EQ(code(g, vp::repair::none, vote), vp::status_code::bad_solid_options);
    EXPECT_EQ(code(g, vp::repair::exterior, vote), vp::status_code::bad_solid_options);
    EXPECT_EQ(code(g, vp::repair::vote, {}), vp::status_code::bad_solid_options);
    const vp::core::hole_cones cones;
    EXPECT_EQ(code(g, vp::repair::close_holes, {.repair = vp::repair::close_holes, .cones = &cones}),
              vp::status_code::bad_solid_options);
    const vp::solid_slab slab;
    vp::solid_options given = vote;
    given.slab = &slab;
    EXPECT_EQ(code(g, vp::repair::vote, given), vp::status_code::bad_solid_options);
    EXPECT_EQ(code(g.crop({0, 0, 3}, {37, 26, 20}), vp::repair::exterior, outside),
              vp::status_code::crop_without_whole);
    vp::solid_options wide = outside;
    wide.closing = vp::solid_options::max_closing + 1;
    EXPECT_EQ(code(g, vp::repair::exterior, wide), vp::status_code::bad_solid_options);
}

} // namespace
