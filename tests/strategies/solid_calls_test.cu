// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Solids in calls that run again, fail or do not wait, of instances, and with repairs.
#include "solid_drawings.hpp"

#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/stream.hpp>
#include <voxelpipe/solid/diagnose_repair.hpp>

using namespace device_test;

// ---- calls ----------------------------------------------------------------------------------------------------------

// The third call like those before it is a graph; vertices may change meanwhile, and other calls come in between.
TEST(Solids, RepeatedCalls) {
    const vp::grid g = box_grid({40, 24, 22});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    bit_target<vp::cpu_backend> a{cpu, g.extent};
    bit_target<vp::cuda_backend> b{gpu, g.extent};
    mesh_data m = tied_bodies(22.0f, 6, 2);
    vp::mesh<vp::cuda_backend> on_device(gpu, m.positions, m.triangles);
    for (int i = 0; i < 12; ++i) {
        SCOPED_TRACE(i);
        const vp::solid_options options{.rule = i / 6 == 0 ? vp::fill_rule::even_odd : vp::fill_rule::nonzero};
        if (i % 6 == 3) {
            for (glm::vec3& p : m.positions) p += glm::vec3(0.5f, 1.0f, 0.25f);
            ASSERT_EQ(cudaMemcpy(const_cast<glm::vec3*>(on_device.view().positions.data()), m.positions.data(),
                                 m.positions.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice),
                      cudaSuccess);
        }
        const vp::mesh<vp::cpu_backend> on_host(cpu, m.positions, m.triangles);
        const auto shader = vp::constant(true);
        const vp::status sa = vp::voxelize_solid(cpu, on_host, g, vp::passthrough{}, shader, a, options);
        const vp::status sb = vp::voxelize_solid(gpu, on_device, g, vp::passthrough{}, shader, b, options);
        ASSERT_TRUE(sa.ok() && sb.ok());
        expect_same_counts(sa.counts, sb.counts);
        EXPECT_EQ(sa.solid, sb.solid);
        expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits");
    }
}

// A bad index: the same status on both backends, and targets keep what they held.
TEST(Solids, ABadIndexWritesNothing) {
    const vp::grid g = box_grid({40, 24, 22});
    vp::cuda_backend gpu;
    bit_target<vp::cuda_backend> fb{gpu, g.extent};
    mesh_data m = tied_bodies(22.0f, 6, 2);
    {
        const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
        ASSERT_TRUE(vp::voxelize_solid(gpu, mesh, g, vp::passthrough{}, vp::constant(true), fb).ok());
    }
    const std::vector<std::uint32_t> before = vp::get<0>(fb).to_host(gpu);
    m.triangles[17].y = static_cast<std::uint32_t>(m.positions.size());
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    std::vector<vp::solid_options> options;
    for (const auto rule : all_rules) options.push_back({.rule = rule});
    for (const auto repair : {vp::repair::close_holes, vp::repair::exterior, vp::repair::vote, vp::repair::winding})
        options.push_back({.repair = repair});
    for (const vp::solid_options& o : options) {
        SCOPED_TRACE(static_cast<int>(o.rule) + 10 * static_cast<int>(o.repair));
        const vp::status s =
            vp::voxelize_solid(gpu, view_of(mesh, indices::unknown), g, vp::passthrough{}, vp::constant(true), fb, o);
        EXPECT_EQ(s.code, vp::status_code::index_out_of_range) << s.message();
        EXPECT_EQ(s.triangle, 17u);
        EXPECT_EQ(before, vp::get<0>(fb).to_host(gpu));
    }
}

// Without memory the call says so, and targets keep what they held.
TEST(Solids, NoMemoryWritesNothing) {
    const vp::grid g = box_grid({40, 24, 22});
    counting_resource memory;
    vp::cuda_backend gpu(nullptr, memory);
    bit_target<vp::cuda_backend> fb{gpu, g.extent};
    const mesh_data m = tied_bodies(22.0f, 6, 2);
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    ASSERT_TRUE(vp::voxelize_solid(gpu, mesh, g, vp::passthrough{}, vp::constant(true), fb).ok());
    const std::vector<std::uint32_t> before = vp::get<0>(fb).to_host(gpu);
    gpu.release();
    memory.limit = memory.live + 1000;
    const vp::status s =
        vp::voxelize_solid(gpu, mesh, g, vp::passthrough{}, vp::constant(true), fb, {.rule = vp::fill_rule::positive});
    EXPECT_EQ(s.code, vp::status_code::out_of_memory) << s.message();
    EXPECT_EQ(before, vp::get<0>(fb).to_host(gpu));
}

// In the caller's memory: capacities that are too small are told and nothing is written; a captured call is replayed
// with other vertices.
TEST(Solids, Async) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    const vp::grid g = box_grid({40, 24, 22});
    const stream_owner stream;
    vp::cpu_backend cpu;
    vp::cuda_backend gpu(stream.stream);
    mesh_data m = tied_bodies(22.0f, 6, 2);
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    const draw_type draw{mesh.view(), {}, {true}};
    const std::span<const draw_type> draws(&draw, 1);
    bit_target<vp::cpu_backend> a{cpu, g.extent};
    bit_target<vp::cuda_backend> b{gpu, g.extent};
    const auto expect_same = [&](const vp::solid_options& options, const vp::status& sb) {
        const vp::mesh<vp::cpu_backend> on_host(cpu, m.positions, m.triangles);
        const vp::status sa = vp::voxelize_solid(cpu, on_host, g, vp::passthrough{}, vp::constant(true), a, options);
        ASSERT_TRUE(sb.ok()) << sb.message();
        expect_same_counts(sa.counts, sb.counts);
        EXPECT_EQ(sa.solid, sb.solid);
        expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits");
    };
    for (const auto rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero}) {
        SCOPED_TRACE(static_cast<int>(rule));
        const bool needs_room = rule == vp::fill_rule::nonzero;
        const vp::solid_options options{.rule = rule};
        vp::workspace_limits limits;
        limits.expects_deferred = needs_room; // is not asked
        limits.fragments = needs_room ? 10 : 0;
        std::size_t bytes = vp::solid_workspace_bytes(draws, g, b.view(), options, limits);
        ASSERT_NE(bytes, 0u);
        vp::cuda_backend::buffer<std::byte> memory(gpu, std::size_t{1} << 22);
        const vp::status small =
            vp::voxelize_solid_async(gpu, draws, g, b.view(), options, {memory.data(), bytes - 1, limits});
        EXPECT_EQ(small.code, vp::status_code::capacity_exceeded);
        EXPECT_EQ(small.required.bytes, bytes);
        if (needs_room) {
            const auto before = vp::get<0>(b).to_host(gpu);
            const vp::workspace_view workspace{memory.data(), memory.size(), limits};
            ASSERT_TRUE(vp::voxelize_solid_async(gpu, draws, g, b.view(), options, workspace).ok());
            EXPECT_EQ(vp::read_status(gpu, workspace, &limits).code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(before, vp::get<0>(b).to_host(gpu));
            EXPECT_GT(limits.fragments, 10u);
            limits.fragments += limits.fragments / 2; // the vertices will move
        }
        bytes = vp::solid_workspace_bytes(draws, g, b.view(), options, limits);
        ASSERT_LE(bytes, memory.size());
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        cudaGraph_t graph = nullptr;
        cudaGraphExec_t replay = nullptr;
        ASSERT_EQ(cudaStreamBeginCapture(stream.stream, cudaStreamCaptureModeRelaxed), cudaSuccess);
        ASSERT_TRUE(vp::voxelize_solid_async(gpu, draws, g, b.view(), options, workspace).ok());
        ASSERT_EQ(cudaStreamEndCapture(stream.stream, &graph), cudaSuccess);
        ASSERT_EQ(cudaGraphInstantiate(&replay, graph, 0), cudaSuccess);
        for (int i = 0; i < 3; ++i) {
            ASSERT_EQ(cudaGraphLaunch(replay, stream.stream), cudaSuccess);
            expect_same(options, vp::read_status(gpu, workspace));
            for (glm::vec3& p : m.positions) p += glm::vec3(-0.5f, 0.0f, 0.25f);
            ASSERT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(mesh.view().positions.data()), m.positions.data(),
                                      m.positions.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice, stream.stream),
                      cudaSuccess);
            ASSERT_EQ(cudaStreamSynchronize(stream.stream), cudaSuccess);
        }
        cudaGraphExecDestroy(replay);
        cudaGraphDestroy(graph);
    }
}

// Two instances that lie in the same place, each with vertices of its own.
TEST(Solids, InstancesAreTheCpus) {
    const mesh_data m = tied_bodies(22.0f, 8, 9);
    const vp::grid g = box_grid({40, 24, 22});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const vp::mesh<vp::cpu_backend> here(cpu, m.positions, m.triangles);
    const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
    bit_target<vp::cpu_backend> a{cpu, g.extent};
    bit_target<vp::cuda_backend> b{gpu, g.extent};
    for (const auto extent : {vp::solid_extent::centre, vp::solid_extent::outer})
        for (const auto repair : {vp::repair::none, vp::repair::close_holes}) {
            const vp::solid_options options{.rule = vp::fill_rule::nonzero, .extent = extent, .repair = repair};
            const vp::status sa = vp::voxelize_solid(cpu, here.view(vp::instances{2}), g, vp::passthrough{},
                                                     vp::constant(true), a, options);
            const vp::status sb = vp::voxelize_solid(gpu, there.view(vp::instances{2}), g, vp::passthrough{},
                                                     vp::constant(true), b, options);
            ASSERT_TRUE(sa.ok() && sb.ok()) << sa.message() << sb.message();
            EXPECT_EQ(sa.counts.triangles_in, 2 * m.triangles.size());
            expect_same_counts(sa.counts, sb.counts);
            EXPECT_EQ(sa.solid, sb.solid);
            expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits");
        }
}

// ---- repairs --------------------------------------------------------------------------------------------------------

TEST(Solids, ClosedHoles) {
    const drawing_of_everything all{broken_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    const drawing_of_bits bits{broken_meshes(), {{}}, {{true}}}, one{{broken_meshes()[0]}, {{}}, {{true}}};
    const vp::grid g = box_grid({37, 26, 25});
    for (const std::uint64_t max_edges : {std::uint64_t{3}, ~std::uint64_t{0}})
        for (const auto of : all_bodies) {
            vp::solid_options options{.rule = vp::fill_rule::even_odd,
                                      .bodies = of,
                                      .repair = vp::repair::close_holes,
                                      .max_hole_edges = max_edges};
            bits.expect_same(g, options);
            one.expect_same(g.crop({5, 6, 7}, {20, 9, 11}), options);
            options.rule = vp::fill_rule::nonzero;
            options.extent = vp::solid_extent::outer;
            all.expect_same(g, options);
            expect_same_lists<std::uint32_t>(broken_meshes(), id_of_fragment{5}, g, options);
        }
}

// Cones that were found beforehand, of the whole mesh, are drawn in place of those that the call would find.
TEST(Solids, ConesOfTheWholeMesh) {
    const mesh_data m = broken_meshes()[1];
    const vp::grid g = box_grid({37, 26, 25}), part = g.crop({5, 6, 7}, {20, 9, 11});
    const vp::core::snap_transform snap = vp::core::make_snap_transform(g);
    std::vector<vp::core::snapped_position> at;
    for (const glm::vec3& p : m.positions) at.push_back(vp::core::snap(snap, p.x, p.y, p.z));
    const auto vertices = static_cast<std::uint32_t>(at.size()),
               triangles = static_cast<std::uint32_t>(m.triangles.size());
    const vp::core::hole_part whole{at.data(), at.size(), {m.triangles.data(), triangles, vertices}, triangles};
    const vp::core::hole_cones cones = vp::core::close_holes({whole}, ~std::uint64_t{0});
    ASSERT_NE(cones.cones, 0u);
    vp::cuda_backend gpu;
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    bit_target<vp::cuda_backend> a{gpu, part.extent}, b{gpu, part.extent};
    for (const auto of : all_bodies) {
        vp::solid_options options{.bodies = of, .extent = vp::solid_extent::outer, .repair = vp::repair::close_holes};
        const vp::status found = vp::voxelize_solid(gpu, mesh, part, vp::passthrough{}, vp::constant(true), a, options);
        options.max_hole_edges = 0; // of what the call would find
        options.cones = &cones;
        const vp::status given = vp::voxelize_solid(gpu, mesh, part, vp::passthrough{}, vp::constant(true), b, options);
        ASSERT_TRUE(found.ok() && given.ok()) << found.message() << given.message();
        EXPECT_EQ(found.solid, given.solid);
        expect_same_bytes(vp::get<0>(a).to_host(gpu), vp::get<0>(b).to_host(gpu), "bits");
    }
}

TEST(Solids, ExteriorAndVote) {
    const drawing_of_everything all{broken_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    const drawing_of_bits bits{broken_meshes(), {{}}, {{true}}};
    for (const auto of : all_bodies) {
        for (const int closing : {0, 1, 3}) {
            SCOPED_TRACE(closing);
            const vp::solid_options options{.bodies = of, .repair = vp::repair::exterior, .closing = closing};
            bits.expect_same(box_grid({37, 26, 25}), options);
            all.expect_same(box_grid({37, 26, 25}), options, loading::load);
        }
        const vp::solid_options options{.bodies = of, .repair = vp::repair::vote};
        bits.expect_same(box_grid({37, 26, 25}), options);
        all.expect_same(box_grid({64, 26, 25}).crop({3, 5, 2}, {40, 17, 20}), options);
        expect_same_lists<std::uint32_t>(broken_meshes(), id_of_fragment{5}, box_grid({37, 26, 25}), options);
    }
    const drawing_of_bits one{{broken_meshes()[1]}, {{}}, {{true}}};
    one.expect_same(box_grid({130, 41, 43}), {.repair = vp::repair::exterior, .closing = 35});
}

// The sides of centres, also where rows end with a word and where bodies reach over the faces of the grid. Of the
// broken meshes a flood leaves nothing here unless gaps are closed, of the closed ones it does.
TEST(Solids, ExteriorAndVoteWithoutTheirCover) {
    std::vector<mesh_data> meshes = broken_meshes();
    meshes.push_back(ball({9.1f, 8.4f, 10.3f}, 5.7f, 6));
    meshes.insert(meshes.begin(), ball({26.6f, 15.2f, 12.9f}, 8.2f, 5));
    const drawing_of_everything all{meshes, {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    const drawing_of_bits bits{meshes, {{}}, {{true}}};
    for (const auto of : all_bodies) {
        vp::solid_options options{.bodies = of, .repair = vp::repair::exterior, .with_cover = false};
        for (const glm::ivec3& extent : {glm::ivec3(37, 26, 25), glm::ivec3(64, 26, 25), glm::ivec3(33, 26, 25)}) {
            bits.expect_same(box_grid(extent), options);
            options.closing = (options.closing + 1) % 3;
        }
        all.expect_same(box_grid({37, 26, 25}), options, loading::load);
        options = {.bodies = of, .repair = vp::repair::vote, .with_cover = false};
        bits.expect_same(box_grid({37, 26, 25}), options);
        bits.expect_same(box_grid({64, 26, 25}).crop({3, 5, 2}, {40, 17, 20}), options);
        expect_same_lists<std::uint32_t>(meshes, id_of_fragment{5}, box_grid({37, 26, 25}), options);
    }
}

// Rows without crossings, bricks over the faces of the grid, bodies with and without cones.
TEST(Solids, GeneralizedWindingNumbers) {
    const drawing_of_everything all{broken_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    const drawing_of_bits bits{broken_meshes(), {{}}, {{true}}};
    const vp::grid part = box_grid({37, 26, 25}).crop({3, 5, 2}, {33, 9, 10});
    bits.expect_same(box_grid({37, 26, 25}), {.repair = vp::repair::winding});
    for (const auto of : all_bodies) {
        for (const auto extent : {vp::solid_extent::outer, vp::solid_extent::inner})
            bits.expect_same(part, {.bodies = of, .extent = extent, .repair = vp::repair::winding});
        const vp::solid_options positive{
            .rule = vp::fill_rule::positive, .bodies = of, .repair = vp::repair::winding, .max_hole_edges = 9};
        all.expect_same(part, positive, loading::load);
        expect_same_lists<std::uint32_t>(broken_meshes(), id_of_fragment{5}, part,
                                         {.bodies = of, .repair = vp::repair::winding});
    }
    mesh_data closed;
    add_box(closed, {3, 3, 3}, {21, 21, 21});
    const drawing_of_bits whole{{closed}, {{}}, {{true}}};
    whole.expect_same(box_grid({37, 26, 25}), {.repair = vp::repair::winding});
}

// Boxes of bricks that rows decide, and bricks beside holes of few edges, of many, and of both. Triangles share places
// and no vertices.
TEST(Solids, GeneralizedWindingNumbersOfManyHoles) {
    const auto opened = [](const mesh_data& m, std::size_t every, float below) {
        mesh_data open = m;
        open.triangles.clear();
        for (std::size_t i = 0; i < m.triangles.size(); ++i)
            if ((every == 0 || (i * 7919) % every != 0) && m.positions[m.triangles[i].x].z < below)
                open.triangles.push_back(m.triangles[i]);
        return open;
    };
    const mesh_data whole = ball({30.0f, 27.5f, 27.0f}, 24.0f, 24);
    for (const auto& [every, below] :
         {std::pair{std::size_t{9}, 1e9f}, {std::size_t{0}, 36.0f}, {std::size_t{9}, 36.0f}}) {
        SCOPED_TRACE(every);
        const drawing_of_bits bits{{opened(whole, every, below)}, {{}}, {{true}}};
        bits.expect_same(box_grid({69, 55, 52}), {.repair = vp::repair::winding});
    }
    const drawing_of_bits two{
        {opened(whole, 11, 1e9f), opened(ball({40.0f, 20.0f, 25.0f}, 14.0f, 14), 0, 27.0f)}, {{}}, {{true}}};
    two.expect_same(box_grid({69, 55, 52}), {.bodies = vp::bodies::draw, .repair = vp::repair::winding});
}

// A block takes as many triangles as it has threads, and several blocks share those of a small mesh.
TEST(Solids, VotesOfMoreTrianglesThanABlockHasThreads) {
    const mesh_data all = tied_bodies(36.0f, 300, 11);
    for (const std::size_t count : {std::size_t{255}, std::size_t{256}, std::size_t{257}, all.triangles.size()}) {
        SCOPED_TRACE(count);
        ASSERT_GE(all.triangles.size(), count);
        mesh_data m = all;
        m.triangles.resize(count);
        const drawing_of_bits bits{{m}, {{}}, {{true}}};
        bits.expect_same(box_grid({37, 26, 25}), {.repair = vp::repair::vote});
    }
}

// What a flood took, its holes, and what keeps it: the same counts, whether it takes nothing, much or is refused.
TEST(Solids, DiagnosesAreTheCpus) {
    mesh_data open;
    add_box(open, {3, 3, 3}, {21, 21, 21});
    open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 1); // half of a face
    mesh_data closed;
    add_box(closed, {3, 3, 3}, {21, 21, 21});
    mesh_data leaving;
    add_box(leaving, {3, 3, 3}, {31, 21, 21});
    mesh_data around;
    add_box(around, {-3, -3, -3}, {31, 31, 31});
    const vp::grid g = box_grid({24, 24, 24});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    bool has_lost = false, has_kept = false, is_refused = false;
    std::vector<mesh_data> meshes = broken_meshes();
    meshes.insert(meshes.end(), {open, closed, leaving, around});
    for (const mesh_data& m : meshes) {
        const vp::mesh<vp::cpu_backend> here(cpu, m.positions, m.triangles);
        const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
        for (const int closing : {0, 2}) {
            if (closing != 0 && &m == &meshes[0]) continue; // takes long to emulate
            vp::solid_options options;
            options.closing = closing;
            const vp::status a = vp::diagnose_repair(cpu, here.view(), g, vp::passthrough{}, options),
                             b = vp::diagnose_repair(gpu, there.view(), g, vp::passthrough{}, options);
            EXPECT_EQ(a.code, b.code);
            EXPECT_EQ(a.where, b.where);
            expect_same_counts(a.counts, b.counts);
            EXPECT_EQ(a.solid, b.solid) << a.solid.flood.lost_voxels << " " << b.solid.flood.lost_voxels;
            has_lost = has_lost || a.solid.flood.closing != 0;
            has_kept = has_kept || (a.ok() && a.solid.flood.lost_voxels == 0);
            is_refused = is_refused || a.code == vp::status_code::crop_without_whole;
        }
    }
    EXPECT_TRUE(has_lost && has_kept && is_refused);
}

// A slab takes what the rest of the grid has decided (solid_options::slab): as on the CPU, and as the whole's layers.
struct layers {
    int begin, end;
};
inline constexpr layers slab_layers[] = {{0, 5}, {5, 6}, {6, 14}, {14, 20}};
template <class Expected>
void expect_slab(const drawing_of_bits& drawn, const vp::grid& g, const layers& at, const vp::solid_options& options,
                 const Expected& expected) {
    vp::cuda_backend gpu;
    const vp::grid slab = g.crop({0, 0, at.begin}, {g.extent.x, g.extent.y, at.end - at.begin});
    bit_target<vp::cuda_backend> bits{gpu, slab.extent};
    const vp::status s = drawn.draw(gpu, bits, slab, options, loading::clear);
    ASSERT_TRUE(s.ok()) << s.message();
    const auto found = vp::get<0>(bits).to_host_target(gpu);
    int wrong = 0;
    for (int z = 0; z < slab.extent.z; ++z)
        for (int y = 0; y < slab.extent.y; ++y)
            for (int x = 0; x < slab.extent.x; ++x) wrong += found(x, y, z) != expected(x, y, at.begin + z);
    EXPECT_EQ(wrong, 0) << "layers from " << at.begin;
}

TEST(Solids, SlabsOfAVote) {
    const auto meshes = broken_meshes();
    const drawing_of_everything all{meshes, {{0.0f}}, {{1, 0.1f}}};
    const drawing_of_bits bits{meshes, {{}}, {{true}}};
    for (const vp::grid& g : {box_grid({70, 26, 20}), box_grid({70, 26, 25}).crop({9, 5, 2}, {41, 17, 20})}) {
        const vp::core::snap_transform snap = vp::core::make_snap_transform(g);
        std::vector<vp::slabs::layer_range> ranges;
        for (const layers& l : slab_layers) ranges.push_back({l.begin, l.end});
        vp::slabs::column_parities columns(g, ranges);
        for (const mesh_data& m : meshes)
            for (const glm::uvec3& t : m.triangles) {
                const auto at = [&](std::uint32_t v) {
                    const glm::vec3 p = m.positions[v];
                    return vp::core::snap(snap, p.x, p.y, p.z);
                };
                columns.add(at(t.x), at(t.y), at(t.z));
            }
        vp::solid_options options{.repair = vp::repair::vote};
        vp::cpu_backend cpu;
        bit_target<vp::cpu_backend> whole{cpu, g.extent};
        ASSERT_TRUE(bits.draw(cpu, whole, g, options, loading::clear).ok());
        const auto expected = vp::get<0>(whole).to_host_target(cpu);
        for (std::size_t s = 0; s < std::size(slab_layers); ++s) {
            const layers& at = slab_layers[s];
            const vp::solid_slab decided = columns.of(s);
            options.slab = &decided;
            expect_slab(bits, g, at, options, expected);
            const vp::grid slab = g.crop({0, 0, at.begin}, {g.extent.x, g.extent.y, at.end - at.begin});
            bits.expect_same(slab, options);
            all.expect_same(slab, options, loading::load);
        }
    }
}

TEST(Solids, SlabsOfAnExterior) {
    const drawing_of_everything all{broken_meshes(), {{0.0f}}, {{1, 0.1f}}};
    const drawing_of_bits bits{broken_meshes(), {{}}, {{true}}};
    const vp::grid g = box_grid({70, 26, 20});
    for (const int closing : {0, 2}) {
        vp::solid_options options{.repair = vp::repair::exterior, .closing = closing};
        vp::cpu_backend cpu;
        bit_target<vp::cpu_backend> whole{cpu, g.extent};
        ASSERT_TRUE(bits.draw(cpu, whole, g, options, loading::clear).ok());
        const auto expected = vp::get<0>(whole).to_host_target(cpu);
        for (const layers& at : slab_layers) {
            const vp::grid slab = g.crop({0, 0, at.begin}, {g.extent.x, g.extent.y, at.end - at.begin});
            std::vector<std::uint64_t> inside(std::size_t{2} * 26 * static_cast<std::size_t>(slab.extent.z));
            for (int z = 0; z < slab.extent.z; ++z)
                for (int y = 0; y < 26; ++y)
                    for (int x = 0; x < 70; ++x)
                        if (expected(x, y, at.begin + z))
                            inside[static_cast<std::size_t>((z * 26 + y) * 2 + x / 64)] |= std::uint64_t{1} << x % 64;
            vp::solid_slab decided;
            decided.inside = inside.data();
            options.slab = &decided;
            expect_slab(bits, g, at, options, expected);
            bits.expect_same(slab, options);
            all.expect_same(slab, options, loading::load);
            expect_same_lists<std::uint32_t>(broken_meshes(), id_of_fragment{5}, slab, options);
        }
    }
}

// A stream draws its slabs, and the cover that a flood needs, on the GPU.
TEST(Solids, StreamsWithRepairs) {
    const mesh_data m = broken_meshes()[2];
    const vp::grid g = box_grid({37, 26, 25});
    for (const vp::solid_options& options :
         {vp::solid_options{.extent = vp::solid_extent::outer, .repair = vp::repair::close_holes},
          vp::solid_options{.extent = vp::solid_extent::outer, .repair = vp::repair::winding},
          vp::solid_options{.repair = vp::repair::vote}, vp::solid_options{.repair = vp::repair::exterior},
          vp::solid_options{.repair = vp::repair::exterior, .closing = 2}}) {
        SCOPED_TRACE(static_cast<int>(options.repair));
        vp::cpu_backend cpu;
        vp::cuda_backend gpu;
        bit_target<vp::cpu_backend> whole{cpu, g.extent};
        const vp::status one = vp::voxelize_solid(cpu, vp::mesh_view<>{m.positions, m.triangles}, g, vp::passthrough{},
                                                  vp::constant(true), whole, options);
        ASSERT_TRUE(one.ok()) << one.message();
        const auto expected = vp::get<0>(whole).to_host_target(cpu);
        vp::slabs::stream_options how;
        how.num_slabs = 4;
        how.repair = options.repair;
        vp::slabs::stream<vp::cuda_backend, vp::passthrough> stream(gpu, g, {}, how);
        stream.add({m.positions, m.triangles}).or_throw();
        int wrong = 0, num_slabs = 0;
        const vp::status s = stream.draw_solid(
            vp::constant(true),
            [&](glm::ivec3 size) {
                return bit_target<vp::cuda_backend>{gpu, size};
            },
            [&](const vp::slabs::slab& slab, const bit_target<vp::cuda_backend>& bits) {
                const auto found = vp::get<0>(bits).to_host_target(gpu);
                const glm::ivec3 e = slab.where.extent;
                for (int z = 0; z < e.z; ++z)
                    for (int y = 0; y < e.y; ++y)
                        for (int x = 0; x < e.x; ++x)
                            wrong += found(x, y, z) != expected(x, y, slab.where.offset.z + z);
                ++num_slabs;
            },
            options);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(wrong, 0);
        EXPECT_EQ(num_slabs, 4);
        expect_same_counts(s.counts, one.counts);
        EXPECT_EQ(s.solid, one.solid);
    }
}

// The whole of a maze is reached, whatever the number of turns.
TEST(Solids, ExteriorOfAMaze) {
    mesh_data m;
    for (int i = 0; i < 6; ++i) { // walls one after the other, each with a gap at another end
        const float x = 4.5f + 5.0f * static_cast<float>(i), low = i % 2 == 0 ? 0.0f : 3.0f, high = low + 20.5f;
        add_quad(m, {x, low, 0.0f}, {x, high, 0.0f}, {x, high, 24.0f}, {x, low, 24.0f}, false);
    }
    for (const float y : {0.0f, 24.0f})
        add_quad(m, {4.5f, y, 0.0f}, {29.5f, y, 0.0f}, {29.5f, y, 24.0f}, {4.5f, y, 24.0f}, false);
    for (const float z : {0.5f, 23.5f})
        add_quad(m, {4.5f, 0.0f, z}, {29.5f, 0.0f, z}, {29.5f, 24.0f, z}, {4.5f, 24.0f, z}, false);
    const drawing_of_bits maze{{m}, {{}}, {{true}}};
    maze.expect_same(box_grid({34, 24, 24}), {.repair = vp::repair::exterior});
    for (const bool is_low_open : {true, false}) { // a long tube, whose one end is the only way in
        mesh_data box;
        add_box(box, {10.5f, 2.5f, 2.5f}, {100.5f, 9.5f, 8.5f});
        const auto first = box.triangles.begin() + (is_low_open ? 0 : 2); // of the face at that end
        box.triangles.erase(first, first + 2);
        const drawing_of_bits tube{{box}, {{}}, {{true}}};
        tube.expect_same(box_grid({110, 12, 12}), {.repair = vp::repair::exterior});
    }
}
