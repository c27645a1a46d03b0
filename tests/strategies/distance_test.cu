// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distances on the device: the bytes and counters of cpu_backend, for every form of a call.

#include "distance_drawings.hpp"

#include "../programs/module_cases.hpp"

#include <voxelpipe/distance/distance_ray.hpp>
#include <voxelpipe/slabs/devices.cuh>
#include <voxelpipe/slabs/stream.hpp>

#include <gtest/gtest.h>

using namespace distance_drawings;

// Triangles of all sizes, needles, points and segments, in several draws, with all that a fragment has.
TEST(DeviceDistance, BandsHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{37, 30, 27};
    const std::vector<mesh_data> meshes{device_test::mixed_triangles(150, 30, 5), needles(extent, 40, 3)};
    for (const float voxels : {0.4f, 3.0f, 11.0f})
        expect_same<every_target>(meshes, unit_grid(extent), everything{3, 1.5f},
                                  {.band = voxels, .sign = vp::distance_sign::none});
    expect_same<every_target>(meshes, unit_grid(extent), everything{3, 1.5f},
                              {.rule = vp::fill_rule::even_odd, .bodies = vp::bodies::draw});
}

// The ready shader, without and with a sign; grids whose voxels are not cubes; corners; parts of a grid.
TEST(DeviceDistance, FieldsOfGridsAndTheirParts) {
    const glm::ivec3 extent{40, 21, 35};
    mesh_data bodies = device_test::tied_bodies(30, 8, 2);
    append(bodies, device_test::ball({17, 9, 14}, 6.3f, 7));
    vp::grid flat = unit_grid(extent);
    flat.voxel_size = {0.5f, 1.25f, 0.75f};
    for (const vp::grid& g : {unit_grid(extent), flat, flat.crop({5, 3, 2}, {29, 14, 31})})
        for (const vp::sample where : {vp::sample::centre, vp::sample::corner}) {
            expect_same<two_targets>({bodies}, g, nearest_shader{}, {.sample = where});
            expect_same<one_target>({bodies}, g, vp::distance{},
                                    {.band = 2, .sample = where, .sign = vp::distance_sign::none});
        }
}

TEST(DeviceDistance, WholeFields) {
    const glm::ivec3 extent{33, 18, 25};
    mesh_data m = device_test::mixed_triangles(90, 20, 8);
    append(m, device_test::ball({17, 9, 14}, 6.3f, 6));
    expect_same<two_targets>({m}, unit_grid(extent), nearest_shader{}, {.band = vp::band::whole});
    expect_same<two_targets>({device_test::ball({90, -40, 14}, 9, 6), needles(extent, 40, 7)}, unit_grid(extent),
                             nearest_shader{}, {.band = vp::band::whole, .sign = vp::distance_sign::none});
}

// Rules, bodies and repairs decide the sign.
TEST(DeviceDistance, SignsOfEveryRuleAndRepair) {
    const glm::ivec3 extent{35, 20, 22};
    mesh_data open = device_test::ball({12, 9, 10}, 7.3f, 6);
    open.triangles.resize(open.triangles.size() - 9);
    const std::vector<mesh_data> meshes{open, device_test::tied_bodies(20, 5, 2)};
    for (const vp::distance_options& o :
         {vp::distance_options{}, vp::distance_options{.rule = vp::fill_rule::positive},
          vp::distance_options{.bodies = vp::bodies::draw, .repair = vp::repair::close_holes},
          vp::distance_options{.repair = vp::repair::exterior, .closing = 1},
          vp::distance_options{.repair = vp::repair::vote}, vp::distance_options{.repair = vp::repair::winding},
          vp::distance_options{
              .rule = vp::fill_rule::positive, .bodies = vp::bodies::draw, .repair = vp::repair::winding}})
        expect_same<two_targets>(meshes, unit_grid(extent), nearest_shader{}, o);
}

// Lists that blocks share, triangles far larger than the grid and of the wide form, coincident and opposite ones.
TEST(DeviceDistance, LongListsAndLargeTriangles) {
    const glm::ivec3 extent{20, 18, 17};
    mesh_data m = device_test::translated(device_test::mixed_triangles(1200, 4, 11), {9, 9, 7});
    expect_same<two_targets>({m}, unit_grid(extent), nearest_shader{}, {.sign = vp::distance_sign::none});
    mesh_data large;
    for (int i = 0; i < 6; ++i) {
        const auto f = static_cast<float>(i);
        device_test::add_triangle(large, {-1e3f * f, 3 + f, -7}, {2e4f, 5 + f, 9}, {7, 6 - f, 3e6f});
        device_test::add_triangle(large, {7, 6 - f, 3e6f}, {2e4f, 5 + f, 9}, {-1e3f * f, 3 + f, -7});
    }
    const vp::grid far = unit_grid(glm::ivec3(150, 140, 130));
    for (const vp::grid& g : {unit_grid(extent), far.crop({125, 2, 3}, {19, 11, 21})})
        for (const vp::band& b : {vp::band(3.0), vp::band::whole})
            expect_same<two_targets>({large}, g, nearest_shader{}, {.band = b, .sign = vp::distance_sign::none});
}

// Lists so long that many blocks search parts of them.
TEST(DeviceDistance, ListsOfThousandsOfTriangles) {
    const glm::ivec3 extent{11, 8, 7};
    mesh_data m = device_test::translated(device_test::mixed_triangles(5000, 2, 3), {4, 4, 3});
    append(m, device_test::ball({7, 3, 4}, 2.3f, 20));
    expect_same<two_targets>({m}, unit_grid(extent), nearest_shader{}, {.sign = vp::distance_sign::none});
}

TEST(DeviceDistance, MeshesWithoutTriangles) {
    for (const vp::band& b : {vp::band(3.0), vp::band::whole}) {
        expect_same<two_targets>({mesh_data{}}, unit_grid(glm::ivec3(9)), nearest_shader{}, {.band = b});
        expect_same<two_targets>({mesh_data{}, mesh_data{}}, unit_grid(glm::ivec3(9)), nearest_shader{}, {.band = b});
    }
    mesh_data wrong = device_test::ball({4, 4, 4}, 3, 3);
    wrong.triangles[4].y = 1000;
    expect_same<one_target>({wrong}, unit_grid(glm::ivec3(9)), vp::distance{}, {.sign = vp::distance_sign::none},
                            vp::status_code::index_out_of_range);
}

// The samples of the band in bricks: cleared, loaded, in parts of a grid, and of several targets with a discard.
TEST(DeviceDistance, SparseFramebuffersHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{43, 26, 21};
    mesh_data bodies = device_test::tied_bodies(25, 3, 2);
    append(bodies, device_test::ball({17, 9, 14}, 6.3f, 6));
    const vp::grid whole = unit_grid(glm::ivec3(60, 40, 40));
    for (const vp::grid& g : {unit_grid(extent), whole.crop({3, 5, 2}, {37, 23, 19})})
        for (const vp::sample where : {vp::sample::centre, vp::sample::corner})
            expect_same_bricks({bodies, device_test::ball({30, 20, 9}, 4, 4)}, g, {.band = 2, .sample = where});
    expect_same_bricks({bodies}, unit_grid({13, 9, 10}), {.band = vp::band::whole, .sign = vp::distance_sign::none});
}

// Slabs of a stream on the device: the whole field of the cpu, with the holes of the whole mesh closed.
TEST(DeviceDistance, SlabsOfAStreamAreTheWhole) {
    namespace slabs = vp::slabs;
    const vp::grid g = unit_grid({14, 17, 20});
    mesh_data open = device_test::ball({7, 8, 9}, 5.3f, 7);
    open.triangles.erase(open.triangles.end() - 7, open.triangles.end() - 3);
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes, vp::repair::winding}) {
        const vp::distance_options how{.band = 2, .repair = repair};
        vp::cpu_backend cpu;
        vp::cuda_backend gpu;
        two_targets<vp::cpu_backend> whole(cpu, g.extent);
        const vp::status expected = draw(cpu, {open}, g, nearest_shader{}, whole, how, false);
        ASSERT_TRUE(expected.ok()) << expected.message();
        slabs::stream stream(gpu, g, vp::passthrough{}, {.num_slabs = 5, .repair = repair, .band = how.band});
        ASSERT_TRUE(stream.add({open.positions, open.triangles}).ok());
        std::vector<float> distances;
        std::vector<std::int64_t> nearest;
        const vp::status s = stream.draw_distance(
            nearest_shader{},
            [&](glm::ivec3 extent) {
                return two_targets<vp::cuda_backend>{gpu, extent};
            },
            [&](const slabs::slab&, const two_targets<vp::cuda_backend>& part) { // layers along z follow each other
                const auto d = vp::get<0>(part).to_host(gpu);
                const auto n = vp::get<1>(part).to_host(gpu);
                distances.insert(distances.end(), d.begin(), d.end());
                nearest.insert(nearest.end(), n.begin(), n.end());
            },
            how);
        expect_same_status(expected, s);
        device_test::expect_same_bytes(vp::get<0>(whole).to_host(cpu), distances, "distances");
        device_test::expect_same_bytes(vp::get<1>(whole).to_host(cpu), nearest, "nearest");
    }
}

// Slabs of several GPUs, along z and where they may turn, dense and in bricks: the whole of the cpu.
TEST(DeviceDistance, SlabsOfSeveralGpusAreTheWhole) {
    namespace slabs = vp::slabs;
    const vp::grid g = unit_grid({40, 40, 40}).crop({1, 2, 3}, {15, 17, 24});
    mesh_data open = device_test::ball({8, 9, 14}, 5.3f, 7);
    open.triangles.erase(open.triangles.end() - 7, open.triangles.end() - 3);
    using one_distance = vp::target<float, vp::blend::replace>;
    vp::cpu_backend cpu;
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes, vp::repair::winding})
        for (const vp::band& band : {vp::band(1.5), vp::band(vp::band::whole)}) {
            SCOPED_TRACE(static_cast<int>(repair));
            const vp::distance_options how{.band = band, .repair = repair};
            two_targets<vp::cpu_backend> whole(cpu, g.extent);
            const vp::status expected = draw(cpu, {open}, g, nearest_shader{}, whole, how, false);
            ASSERT_TRUE(expected.ok()) << expected.message();
            slabs::devices gpus(std::vector<int>{0, 0, 0}, false);
            slabs::device_options options;
            options.may_turn = false;
            options.voxel_bytes = 1000; // slabs of about equal thickness, also beside the mesh
            options.repair = repair;
            options.band = band;
            const vp::mesh_view<> view{open.positions, open.triangles};
            slabs::device_slabs parts(gpus, g, view, vp::passthrough{}, options);
            auto dense = parts.make([](vp::cuda_backend& gpu, glm::ivec3 e) {
                return two_targets<vp::cuda_backend>{gpu, e};
            });
            ASSERT_EQ(dense.size(), 3u);
            const vp::status s = parts.draw_distance(nearest_shader{}, dense, how);
            expect_same_status(expected, s);
            std::vector<float> distances;
            std::vector<std::int64_t> nearest;
            for (std::size_t i = 0; i < dense.size(); ++i) { // layers along z follow each other
                const auto d = vp::get<0>(dense[i]).to_host(gpus.backend(i));
                const auto n = vp::get<1>(dense[i]).to_host(gpus.backend(i));
                distances.insert(distances.end(), d.begin(), d.end());
                nearest.insert(nearest.end(), n.begin(), n.end());
            }
            device_test::expect_same_bytes(vp::get<0>(whole).to_host(cpu), distances, "distances");
            device_test::expect_same_bytes(vp::get<1>(whole).to_host(cpu), nearest, "nearest");
            if (!band.is_whole) {
                vp::sparse_framebuffer<vp::cpu_backend, one_distance> whole_bricks(cpu, g.extent);
                ASSERT_TRUE(draw(cpu, {open}, g, vp::distance{}, whole_bricks, how, false).ok());
                auto bricks = parts.make([](vp::cuda_backend& gpu, glm::ivec3 e) {
                    return vp::sparse_framebuffer<vp::cuda_backend, one_distance>{gpu, e};
                });
                ASSERT_TRUE(parts.draw_distance(vp::distance{}, bricks, how).ok());
                std::vector<vp::host_sparse<one_distance>> hosts;
                for (std::size_t i = 0; i < bricks.size(); ++i) hosts.push_back(bricks[i].to_host(gpus.backend(i)));
                EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const vp::host_sparse<one_distance>>(hosts)),
                                              whole_bricks.to_host(cpu)));
            }
            using vp::status_code;
            vp::distance_options other = how;
            other.band = vp::band(2.5);
            EXPECT_EQ(parts.draw_distance(nearest_shader{}, dense, other).code, status_code::bad_distance_options);
            other = how;
            other.sample = vp::sample::corner;
            EXPECT_EQ(parts.draw_distance(nearest_shader{}, dense, other).code, status_code::bad_distance_options);
            auto bits = parts.make([](vp::cuda_backend& gpu, glm::ivec3 e) {
                return vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, vp::blend::bit_or>>{gpu, e};
            });
            EXPECT_EQ(parts.draw(vp::constant(true), bits).code, status_code::bad_distance_options);
        }
}

// What programs make has the distances of a mesh, on either backend, with the numbers of the input.
TEST(DeviceDistance, ProgramsAreTheMadeMesh) {
    vp::cuda_backend gpu;
    programs::expect_distances_of_programs(gpu);
    programs::expect_distances_without_what_is_left_out(gpu);
}

TEST(DeviceDistance, PointsHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{35, 20, 22};
    mesh_data open = device_test::ball({12, 9, 10}, 7.3f, 6);
    open.triangles.resize(open.triangles.size() - 9);
    const std::vector<mesh_data> meshes{open, device_test::tied_bodies(20, 5, 2), needles(extent, 20, 3),
                                        device_test::mixed_triangles(40, 20, 9)};
    for (const vp::distance_options& o :
         {vp::distance_options{}, vp::distance_options{.sign = vp::distance_sign::none},
          vp::distance_options{.bodies = vp::bodies::draw, .repair = vp::repair::close_holes},
          vp::distance_options{.repair = vp::repair::winding},
          vp::distance_options{
              .rule = vp::fill_rule::positive, .bodies = vp::bodies::draw, .repair = vp::repair::winding},
          vp::distance_options{.rule = vp::fill_rule::even_odd}})
        expect_same_points(meshes, unit_grid(extent), 300, o);
    expect_same_points({mesh_data{}}, unit_grid(extent), 10, {});
}

namespace {

// Ray i from the border towards the middle of the field, its hit, and value and gradient half way there.
struct follow_ray {
    vp::distance_samples field;
    glm::dvec3 middle;
    vp::distance_hit* hits;
    glm::vec4* read;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        glm::dvec3 way(static_cast<double>(i % 7) - 3.0, static_cast<double>(i / 7 % 5) - 2.1,
                       static_cast<double>(i / 35) - 4.3);
        const double length = vp::exact::sqrt(way.x * way.x + way.y * way.y + way.z * way.z);
        way = glm::dvec3(vp::exact::div(way.x, length), vp::exact::div(way.y, length), vp::exact::div(way.z, length));
        const glm::dvec3 from = middle - glm::dvec3(way.x * 30.0, way.y * 30.0, way.z * 30.0);
        hits[i] = vp::trace(field, from, way, 60.0, i % 3 == 0 ? 1.25f : 0.0f);
        const glm::dvec3 at(vp::exact::fma(way.x, 3.7, middle.x), vp::exact::fma(way.y, 3.7, middle.y),
                            vp::exact::fma(way.z, 3.7, middle.z));
        const glm::vec3 g = field.gradient(at);
        read[i] = {field(at), g.x, g.y, g.z};
    }
};

} // namespace

// Rays and gradients of a field in the backend's memory: the same bits in a kernel.
TEST(DeviceDistance, RaysMeetTheFieldWhereTheyDoOnTheHost) {
    constexpr std::uint64_t rays = 350;
    const vp::grid g = unit_grid({22, 20, 19});
    const mesh_data m = device_test::ball({11, 9, 9}, 5.3f, 9);
    const auto follow = [&](auto& be) {
        using backend = std::remove_cvref_t<decltype(be)>;
        one_target<backend> fb(be, g.extent);
        EXPECT_TRUE(draw(be, {m}, g, vp::distance{}, fb, {}, false).ok());
        typename backend::template buffer<vp::distance_hit> hits(be, rays);
        typename backend::template buffer<glm::vec4> read(be, rays);
        be.for_each(rays,
                    follow_ray{vp::samples_of(vp::get<0>(fb).view(), g), {10.9, 9.1, 9.2}, hits.data(), read.data()});
        return std::pair(hits.to_host(be), read.to_host(be));
    };
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const auto here = follow(cpu), there = follow(gpu);
    std::size_t met = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        const vp::distance_hit &a = here.first[i], &b = there.first[i];
        met += a.hit ? 1 : 0;
        ASSERT_EQ(a.hit, b.hit) << i;
        ASSERT_EQ(a.t, b.t) << i;
        ASSERT_EQ(a.gradient, b.gradient) << i;
    }
    EXPECT_GT(met, rays * 9 / 10);
    device_test::expect_same_bytes(here.second, there.second, "values and gradients");
}
