// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Promises of a call other than its bits: status and counters, nothing written on failure, memory from the resource,
// several draws with attributes and varyings, crops, streams, no wait in voxelize_async, graphs, tile policies.

#include "cells.hpp"
#include "subset_meshes.hpp"

#include <algorithm>
#include <numeric>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using bits = vp::target<vp::bit, blend::bit_or>;
using sum = vp::target<float, blend::add>;

// glm arithmetic on the device, which some versions lose without --expt-relaxed-constexpr.
struct varyings {
    glm::vec3 colour;
    std::array<float, 2> uv;
    vp::flat<std::uint32_t> id;
};
struct moved {
    glm::vec3 offset;
    VOXELPIPE_HD vp::vertex_output<varyings> operator()(const vp::vertex<glm::vec3, std::uint32_t>& v) const {
        const glm::vec3 p = v.position + offset;
        return {p, {vp::get<0>(v), {p.x, p.y}, {vp::get<1>(v) + v.draw}}};
    }
};
struct coloured {
    float scale;
    VOXELPIPE_HD auto operator()(const vp::fragment<varyings>& f) const {
        const varyings c = f.clamped_varyings();
        return vp::outputs(f.varyings.colour, vp::exact::mul(c.uv[1], scale), f.varyings.id.value + f.triangle,
                           f.primitive)
            .discard_if(f.varyings.id.value % 13 == 5);
    }
};

template <class Backend>
struct two_draws {
    using mesh_type = vp::mesh<Backend, glm::vec3, std::uint32_t>;
    using draw_type = vp::draw<vp::mesh_view<glm::vec3, std::uint32_t>, moved, coloured>;
    using framebuffer =
        vp::framebuffer<Backend, vp::target<glm::vec3, blend::add>, vp::target<float, blend::max>,
                        vp::target<std::uint32_t, blend::min>, vp::target<std::uint32_t, blend::replace>>;

    std::vector<mesh_type> meshes;
    std::vector<some_triangles<Backend>> parts;
    std::vector<draw_type> draws;

    explicit two_draws(Backend& be) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            mesh_data m = mixed_triangles(k == 1 ? 0 : 700, 40.0f, 20 + k);
            std::vector<glm::vec3> colours(m.positions.size());
            std::vector<std::uint32_t> ids(m.positions.size());
            for (std::size_t i = 0; i < colours.size(); ++i) {
                colours[i] = glm::vec3(static_cast<float>(i % 17), -static_cast<float>(i % 5), 0.1f);
                ids[i] = static_cast<std::uint32_t>(i / 3);
            }
            meshes.emplace_back(be, m.positions, m.triangles, colours, ids);
            parts.emplace_back(be, m.triangles);
        }
        for (std::size_t k = 0; k < 3; ++k)
            draws.push_back(
                {meshes[k].view(), {glm::vec3(static_cast<float>(k) * 1.25f)}, {0.5f + static_cast<float>(k)}});
    }
};

template <class Backend>
struct outcome {
    vp::status s;
    std::tuple<std::vector<glm::vec3>, std::vector<float>, std::vector<std::uint32_t>, std::vector<std::uint32_t>> data;
};
// How draws are changed: not; the first is a subset of two instances; the last is a subset, and alone.
enum class parts { none, first, last_alone };
template <class Backend>
outcome<Backend> run_draws(const vp::grid& g, vp::coverage rule, parts which = parts::none,
                           vp::strategy strategy = vp::strategy::automatic) {
    Backend be;
    if constexpr (std::is_same_v<Backend, vp::cuda_backend>) be.strategy = strategy;
    two_draws<Backend> scene(be);
    if (which == parts::first) scene.draws[0].mesh = scene.parts[0].of(scene.draws[0].mesh, 2);
    if (which == parts::last_alone) {
        scene.draws[2].mesh = scene.parts[2].of(scene.draws[2].mesh);
        scene.draws.erase(scene.draws.begin(), scene.draws.begin() + 2);
    }
    typename two_draws<Backend>::framebuffer fb{be, g.extent};
    using draw_type = typename two_draws<Backend>::draw_type;
    outcome<Backend> o;
    o.s = vp::voxelize(be, std::span<const draw_type>(scene.draws), g, fb, rule);
    o.data = {vp::get<0>(fb).to_host(be), vp::get<1>(fb).to_host(be), vp::get<2>(fb).to_host(be),
              vp::get<3>(fb).to_host(be)};
    return o;
}

void expect_same_outcome(const outcome<vp::cpu_backend>& a, const outcome<vp::cuda_backend>& b) {
    ASSERT_TRUE(a.s.ok() && b.s.ok()) << b.s.message();
    expect_same_counts(a.s.counts, b.s.counts);
    expect_same_bytes(std::get<0>(a.data), std::get<0>(b.data), "add");
    expect_same_bytes(std::get<1>(a.data), std::get<1>(b.data), "max");
    expect_same_bytes(std::get<2>(a.data), std::get<2>(b.data), "min");
    expect_same_bytes(std::get<3>(a.data), std::get<3>(b.data), "replace");
}

TEST(Pipeline, SeveralDrawsWithVaryingsGiveTheCpusBytes) {
    const vp::grid whole = box_grid({40, 33, 47});
    for (const vp::coverage rule : both_rules)
        for (const vp::grid& g : {whole, whole.crop({7, 3, 11}, {20, 30, 17})})
            expect_same_outcome(run_draws<vp::cpu_backend>(g, rule), run_draws<vp::cuda_backend>(g, rule));
}

// mesh_view::part, listed and in tiles.
TEST(Pipeline, SubsetsGiveTheCpusBytes) {
    const vp::grid g = box_grid({40, 33, 47}).crop({7, 3, 11}, {20, 30, 17});
    for (const parts which : {parts::first, parts::last_alone})
        for (const vp::strategy strategy : {vp::strategy::automatic, vp::strategy::tiled}) {
            SCOPED_TRACE(std::to_string(static_cast<int>(which)) + " " + std::to_string(static_cast<int>(strategy)));
            expect_same_outcome(run_draws<vp::cpu_backend>(g, vp::coverage::thin, which),
                                run_draws<vp::cuda_backend>(g, vp::coverage::thin, which, strategy));
        }
}

TEST(Pipeline, NumbersOfSubsetsThatCannotBeWriteNothing) {
    const mesh_data m = mixed_triangles(50, 20.0f, 31);
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    const vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    vp::framebuffer<vp::cuda_backend, sum> other{be, g.extent};
    vp::abuffer<vp::cuda_backend> lists{be};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok());
    const std::vector<float> before = vp::get<0>(fb).to_host(be);
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<float>>;
    const vp::workspace_limits limits{};
    const auto expect_refused = [&](const std::vector<std::uint32_t>& numbers) {
        const some_triangles some(be, m.triangles, numbers);
        vp::mesh_view<> view = some.of(mesh.view());
        EXPECT_EQ(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(2.0f), fb).code,
                  vp::status_code::bad_subset);
        EXPECT_EQ(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(true), lists).code,
                  vp::status_code::bad_subset);
        view.checked = vp::check_indices(be, view.triangles);
        const draw d{view, {}, vp::constant(2.0f)};
        const std::span<const draw> draws(&d, 1);
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
        EXPECT_EQ(vp::read_status(be, workspace).code, vp::status_code::bad_subset);
        view.part.checked = 1; // the caller's word, and constants need no numbers
        EXPECT_TRUE(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(2.0f), other).ok());
    };
    expect_refused({3, 4, 50}); // beyond the whole
    expect_refused({3, 3, 9});  // twice
    expect_refused({4, 3});     // not ascending
    expect_same_bytes(before, vp::get<0>(fb).to_host(be), "sums");
    EXPECT_EQ(lists.num_voxels(), 0u);
}

TEST(Pipeline, AnIndexOutOfRangeWritesNothing) {
    mesh_data m = mixed_triangles(500, 20.0f, 30);
    m.triangles[321].y = static_cast<std::uint32_t>(m.positions.size());
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    cudaMemset(const_cast<float*>(vp::get<0>(fb).view().elements), 0x5a, 8000 * sizeof(float));
    vp::mesh mesh{be, m.positions, m.triangles};
    const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb);
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(s.where, vp::stage::coarse_raster);
    EXPECT_EQ(s.triangle, 321u);
    EXPECT_EQ(s.counts.triangles_in, 500u);
    for (const float v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(std::bit_cast<std::uint32_t>(v), 0x5a5a5a5au);
    vp::abuffer<vp::cuda_backend> lists{be};
    EXPECT_EQ(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists).code,
              vp::status_code::index_out_of_range);
    EXPECT_EQ(lists.num_voxels(), 0u);
}

TEST(Pipeline, BadArgumentsAreRefused) {
    vp::cuda_backend be;
    const mesh_data m = mixed_triangles(5, 20.0f, 31);
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, bits> fb{be, {20, 20, 20}};
    EXPECT_EQ(vp::voxelize(be, mesh, box_grid({20, 20, 21}), vp::passthrough{}, vp::constant(true), fb).code,
              vp::status_code::extent_mismatch);
}

// Calls without triangles clear, on the stream and in a workspace too; what loads keeps what it holds.
TEST(Pipeline, ACallWithoutTrianglesClears) {
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    const mesh_data m = mixed_triangles(50, 20.0f, 31);
    const vp::mesh mesh{be, m.positions, m.triangles}, empty{be, m.positions, std::vector<glm::uvec3>{}};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const auto holds = [&](float value) {
        for (const float v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(v, value);
    };
    const auto fill = [&] {
        vp::get<0>(fb).clear(0.0f);
        ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok());
    };
    for (const bool tracked : {false, true}) {
        if (tracked) fb.track_changes(be);
        fill();
        vp::get<0>(fb).clear(3.0f);
        const vp::status s = vp::voxelize(be, empty, g, vp::passthrough{}, vp::constant(1.0f), fb);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_TRUE(s.nothing_drawn());
        holds(3.0f);
        fill();
        vp::get<0>(fb).clear(4.0f);
        EXPECT_TRUE(vp::clear(be, fb).ok());
        holds(4.0f);
        vp::get<0>(fb).load();
        EXPECT_TRUE(vp::clear(be, fb).ok());
        holds(4.0f);
    }
    fill();
    vp::get<0>(fb).clear(5.0f);
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<float>>;
    const draw nothing{empty, {}, vp::constant(1.0f)};
    const std::span<const draw> draws(&nothing, 1);
    const vp::workspace_limits limits{};
    const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
    vp::cuda_backend::buffer<std::byte> memory(be, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};
    EXPECT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
    EXPECT_TRUE(vp::read_status(be, workspace).ok());
    holds(5.0f);
    EXPECT_EQ(vp::voxelize_async(be, draws, g, fb.view(), {}, {memory.data(), 8, limits}).code,
              vp::status_code::capacity_exceeded);

    vp::abuffer<vp::cuda_backend> lists{be};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_GT(lists.num_fragments(), 0u);
    EXPECT_TRUE(vp::voxelize(be, empty, g, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_EQ(lists.num_fragments(), 0u);
    EXPECT_EQ(lists.to_host(be).extent, g.extent);
}

// Copies of a target to the host: a box of it, and nothing more; and copies of page-locked memory to the device, whose
// owner may write to it as soon as the constructor returns.
TEST(Pipeline, MemoryIsCopiedBothWays) {
    vp::cuda_backend be;
    const vp::grid g = box_grid({70, 20, 20});
    const mesh_data m = mixed_triangles(50, 20.0f, 31);
    const vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> sums{be, g.extent};
    vp::framebuffer<vp::cuda_backend, bits> words{be, g.extent};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), sums).ok());
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), words).ok());
    const glm::ivec3 begin{3, 5, 7}, size{40, 9, 12};
    const auto check = [&](const auto& whole, const auto& part) {
        bool same = true;
        vp::for_each_voxel(part,
                           [&](glm::ivec3 v, const auto& value) { same = same && value == whole(v.x, v.y, v.z); });
        EXPECT_TRUE(same);
        EXPECT_EQ(part.last() - part.first(), size);
    };
    check(vp::get<0>(sums).to_host_target(be), vp::get<0>(sums).to_host_region(be, begin, size));
    check(vp::get<0>(words).to_host_target(be), vp::get<0>(words).to_host_region(be, begin, size));
    EXPECT_EQ(vp::bounds(be, mesh.view().positions), vp::bounds(m.positions));
    const std::vector<float> whole = vp::get<0>(sums).to_host(be);
    std::vector<float> kept(whole.size(), -1.0f);
    vp::get<0>(sums).to_host(be, kept);
    EXPECT_EQ(kept, whole);

    std::vector<float> source(std::size_t{1} << 22, 1.0f);
    ASSERT_EQ(cudaHostRegister(source.data(), source.size() * sizeof(float), 0), cudaSuccess);
    const vp::cuda_backend::buffer<float> copy(be, source);
    std::fill(source.begin(), source.end(), 2.0f);
    const std::vector<float> host = copy.to_host(be);
    EXPECT_EQ(std::count(host.begin(), host.end(), 1.0f), static_cast<std::ptrdiff_t>(host.size()));
    cudaHostUnregister(source.data());
    const vp::cuda_backend::buffer<float> again(be, copy.view()); // from device memory
    EXPECT_EQ(again.to_host(be), host);
}

TEST(Pipeline, MemoryComesFromTheResource) {
    counting_resource resource;
    {
        vp::cuda_backend be{nullptr, resource};
        const mesh_data m = mixed_triangles(500, 20.0f, 32);
        const vp::grid g = box_grid({20, 20, 20});
        vp::mesh mesh{be, m.positions, m.triangles};
        vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
        EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok());
        EXPECT_GT(resource.calls, 3);
        be.release();
        resource.limit = resource.live;
        const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb);
        EXPECT_EQ(s.code, vp::status_code::out_of_memory);
    }
    EXPECT_EQ(resource.live, 0u);
}

// Constant, but the library cannot know it.
struct computed {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment&) const {
        return vp::outputs(0.3f);
    }
};

// If memory suffices for tiles only, the call uses tiles instead of lists. With less memory it fails.
TEST(Pipeline, FragmentsAreDrawnInTilesIfMemoryDoesNotSufficeForLists) {
    mesh_data m = mixed_triangles(200, 60.0f, 35);
    for (int i = 0; i < 300; ++i) { // many times more fragments than tile pairs
        const float h = 0.2f * static_cast<float>(i);
        add_triangle(m, {-9.0f, -9.0f, h}, {130.0f, -9.0f, h + 3.0f}, {-9.0f, 130.0f, h + 9.0f});
    }
    const vp::grid g = box_grid({60, 50, 70});
    std::size_t bytes[2] = {}; // with lists, with tiles
    std::vector<float> expected;
    const auto draw = [&](vp::cuda_backend& be, vp::framebuffer<vp::cuda_backend, sum>& fb) {
        const vp::mesh mesh{be, m.positions, m.triangles};
        return vp::voxelize(be, mesh, g, vp::passthrough{}, computed{}, fb);
    };
    for (const bool lists : {true, false}) {
        counting_resource resource;
        vp::cuda_backend be{nullptr, resource};
        if (!lists) be.strategy = vp::strategy::tiled;
        vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
        const std::size_t before = resource.live;
        ASSERT_TRUE(draw(be, fb).ok());
        bytes[lists ? 0 : 1] = resource.live - before; // the workspace
        const auto values = vp::get<0>(fb).to_host(be);
        if (lists)
            expected = values;
        else
            expect_same_bytes(expected, values, "in tiles");
    }
    ASSERT_GT(bytes[0], bytes[1]);
    for (const std::size_t bytes_free : {bytes[0], bytes[1], bytes[1] - 1}) {
        counting_resource resource;
        vp::cuda_backend be{nullptr, resource};
        vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
        const std::size_t of_mesh = m.positions.size() * sizeof(glm::vec3) + m.triangles.size() * sizeof(glm::uvec3);
        resource.limit = resource.live + of_mesh + bytes_free;
        const vp::status s = draw(be, fb);
        EXPECT_EQ(s.code, bytes_free < bytes[1] ? vp::status_code::out_of_memory : vp::status_code::ok) << bytes_free;
        if (s.ok()) expect_same_bytes(expected, vp::get<0>(fb).to_host(be), "with less memory");
    }
}

// More pairs, work items and fragments than the first guess of the capacities.
TEST(Pipeline, ACallThatOverflowsIsRunAgain) {
    mesh_data m;
    for (int i = 0; i < 40; ++i) {
        const float h = static_cast<float>(i);
        add_triangle(m, {-100.0f, -100.0f, h}, {700.0f, -100.0f, h + 30.0f}, {-100.0f, 700.0f, 300.0f});
    }
    const vp::grid g = box_grid({300, 300, 300});
    for (const vp::coverage rule : both_rules) {
        expect_same<bits>(m, g, vp::passthrough{}, vp::constant(true), rule);
        expect_same<sum>(m, g, vp::passthrough{}, computed{}, rule);
        expect_same_lists<void>(m, g, vp::passthrough{}, vp::constant(true), rule);
    }
}

TEST(Pipeline, ListsWithPayloadsAreTheCpus) {
    const any_double shader;
    for (const vp::coverage rule : both_rules) {
        expect_same_lists<double>(mixed_triangles(2000, 40.0f, 33), box_grid({40, 33, 47}), vp::passthrough{}, shader,
                                  rule);
        expect_same_lists<void>(mixed_triangles(2000, 40.0f, 34), box_grid({40, 33, 47}), vp::passthrough{}, shader,
                                rule);
    }
}

// A linear id beyond 32 bits.
TEST(Pipeline, ListsOfAGridBeyond32BitsAreTheCpus) {
    const mesh_data m = translated(mixed_triangles(300, 100.0f, 35), {1900.0f, 1950.0f, 1980.0f});
    for (const vp::coverage rule : both_rules)
        expect_same_lists<void>(m, box_grid({2048, 2048, 2048}), vp::passthrough{}, vp::constant(true), rule);
}

struct small_tiles {
    constexpr vp::tuning::fine_raster_policy operator()(int) const { return {64, 3, 4}; }
};
struct large_blocks {
    constexpr vp::tuning::fine_raster_policy operator()(int) const { return {512, 4, 1}; }
};

template <class Selector>
std::vector<float> run_policy(const mesh_data& m, const vp::grid& g, vp::coverage rule, vp::counters& counts) {
    vp::cuda_backend be;
    be.strategy = vp::strategy::tiled;
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, computed>;
    const draw_type d{mesh.view(), {}, computed{}};
    const vp::status s = be.run<Selector>(std::span<const draw_type>(&d, 1), g, fb.view(), vp::voxelize_options{rule},
                                          m.triangles.size());
    EXPECT_TRUE(s.ok()) << s.message();
    counts = s.counts;
    return vp::get<0>(fb).to_host(be);
}

TEST(Pipeline, ResultsDoNotDependOnThePolicy) {
    const mesh_data m = mixed_triangles(4000, 60.0f, 36);
    const vp::grid g = box_grid({61, 50, 67});
    for (const vp::coverage rule : both_rules) {
        vp::counters a, b, c;
        const auto first = run_policy<vp::tuning::fine_raster_selector>(m, g, rule, a);
        expect_same_bytes(first, run_policy<small_tiles>(m, g, rule, b), "small tiles");
        expect_same_bytes(first, run_policy<large_blocks>(m, g, rule, c), "large blocks");
        expect_same_counts(a, b);
        expect_same_counts(a, c);
    }
}

using one_draw = vp::draw<vp::mesh_view<>, vp::passthrough, computed>;

TEST(Pipeline, TwoStreamsAtOnceAreIndependent) {
    const mesh_data m = mixed_triangles(4000, 60.0f, 37);
    const vp::grid g = box_grid({64, 64, 64});
    vp::counters counts;
    const auto expected = run_policy<vp::tuning::fine_raster_selector>(m, g, vp::coverage::conservative, counts);
    stream_owner streams[2];
    vp::cuda_backend first{streams[0].stream}, second{streams[1].stream};
    vp::cuda_backend* const backends[2] = {&first, &second};
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    std::vector<vp::framebuffer<vp::cuda_backend, sum>> fbs;
    std::vector<vp::cuda_backend::buffer<std::byte>> memory;
    std::vector<vp::workspace_view> views;
    auto limits = vp::workspace_limits::for_triangles(4 * m.triangles.size());
    for (vp::cuda_backend* be : backends) {
        limits.lists_fragments = be == &second;
        meshes.emplace_back(*be, m.positions, m.triangles);
        fbs.emplace_back(*be, g.extent);
        const one_draw d{meshes.back().view(), {}, computed{}};
        const std::size_t bytes =
            vp::workspace_bytes(std::span<const one_draw>(&d, 1), g, fbs.back().view(), {}, limits);
        ASSERT_GT(bytes, 0u);
        memory.emplace_back(*be, bytes);
        views.push_back({memory.back().data(), bytes, limits});
    }
    for (int round = 0; round < 5; ++round)
        for (int k = 0; k < 2; ++k) {
            const one_draw d{meshes[static_cast<std::size_t>(k)].view(), {}, computed{}};
            const vp::status s =
                vp::voxelize_async(*backends[k], std::span<const one_draw>(&d, 1), g,
                                   fbs[static_cast<std::size_t>(k)].view(), {}, views[static_cast<std::size_t>(k)]);
            ASSERT_TRUE(s.ok()) << s.message();
        }
    for (std::size_t k = 0; k < 2; ++k) {
        const vp::status s = vp::read_status(*backends[k], views[k]);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_counts(counts, s.counts);
        expect_same_bytes(expected, vp::get<0>(fbs[k]).to_host(*backends[k]), "stream");
    }
}

void replay(bool lists) {
    stream_owner owner;
    vp::cuda_backend be{owner.stream};
    const mesh_data m = mixed_triangles(3000, 60.0f, 38), other = mixed_triangles(3000, 60.0f, 39);
    const vp::grid g = box_grid({64, 64, 64});
    vp::cuda_backend::buffer<glm::vec3> positions(be, vp::array_view<const glm::vec3>(m.positions));
    vp::cuda_backend::buffer<glm::uvec3> triangles(be, vp::array_view<const glm::uvec3>(m.triangles));
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const one_draw d{{positions.view(), triangles.view(), {}}, {}, computed{}};
    const std::span<const one_draw> draws(&d, 1);
    auto limits = vp::workspace_limits::for_triangles(4 * m.triangles.size());
    limits.lists_fragments = lists;
    limits.fragments *= 16; // some triangles are large
    const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
    vp::cuda_backend::buffer<std::byte> memory(be, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};

    cudaGraph_t graph = nullptr;
    cudaGraphExec_t instance = nullptr;
    ASSERT_EQ(cudaStreamBeginCapture(be.stream, cudaStreamCaptureModeGlobal), cudaSuccess);
    const vp::status captured = vp::voxelize_async(be, draws, g, fb.view(), {}, workspace);
    ASSERT_EQ(cudaStreamEndCapture(be.stream, &graph), cudaSuccess);
    ASSERT_TRUE(captured.ok()) << captured.message();
    ASSERT_EQ(cudaGraphInstantiate(&instance, graph, 0), cudaSuccess);
    for (const mesh_data* data : {&m, &other, &m}) {
        ASSERT_EQ(cudaMemcpyAsync(positions.data(), data->positions.data(), data->positions.size() * sizeof(glm::vec3),
                                  cudaMemcpyHostToDevice, be.stream),
                  cudaSuccess);
        ASSERT_EQ(cudaGraphLaunch(instance, be.stream), cudaSuccess);
        const vp::status s = vp::read_status(be, workspace);
        ASSERT_TRUE(s.ok()) << s.message();
        vp::counters counts;
        mesh_data expected{data->positions, m.triangles};
        const auto reference =
            run_policy<vp::tuning::fine_raster_selector>(expected, g, vp::coverage::conservative, counts);
        expect_same_counts(counts, s.counts);
        expect_same_bytes(reference, vp::get<0>(fb).to_host(be), "graph");
    }
    cudaGraphExecDestroy(instance);
    cudaGraphDestroy(graph);
}

TEST(Pipeline, AGraphIsReplayedWithChangedVertices) {
    for (const bool lists : {false, true}) replay(lists);
}

void start_too_small(vp::workspace_limits limits) {
    vp::cuda_backend be;
    mesh_data m = mixed_triangles(3000, 60.0f, 40);
    const vp::grid g = box_grid({200, 200, 200});
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const one_draw d{mesh.view(), {}, computed{}};
    const std::span<const one_draw> draws(&d, 1);
    EXPECT_EQ(vp::voxelize_async(be, draws, g, fb.view(), {}, {nullptr, 0, limits}).code,
              vp::status_code::capacity_exceeded);
    cudaMemset(const_cast<float*>(vp::get<0>(fb).view().elements), 0x5a, 8000000 * sizeof(float));
    bool done = false;
    for (int tries = 0; tries < 5 && !done; ++tries) {
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
        const vp::status s = vp::read_status(be, workspace, &limits);
        done = s.ok();
        if (!done) {
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(s.where, limits.lists_fragments ? vp::stage::abuffer_emit : vp::stage::coarse_raster);
            EXPECT_GT(limits.lists_fragments ? s.required.fragments : s.required.tile_pairs, 10u);
            for (const float v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(std::bit_cast<std::uint32_t>(v), 0x5a5a5a5au);
        }
    }
    ASSERT_TRUE(done);
    vp::counters counts;
    expect_same_bytes(run_policy<vp::tuning::fine_raster_selector>(m, g, vp::coverage::conservative, counts),
                      vp::get<0>(fb).to_host(be), "after retry");
}

TEST(Pipeline, AWorkspaceThatIsTooSmallSaysWhatIsNeeded) {
    start_too_small({10, 1, 0, 0});
    start_too_small({}); // capacity 0: no kernel may be launched without blocks
    start_too_small({0, 0, 10, 0, true});
    start_too_small({0, 0, 0, 0, true});
}

TEST(Pipeline, AWorkspaceBeyond32BitsIsRefused) {
    vp::cuda_backend be;
    const mesh_data m = mixed_triangles(5, 20.0f, 42);
    const vp::grid g = box_grid({20, 20, 20});
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const one_draw d{mesh.view(), {}, computed{}};
    const std::span<const one_draw> draws(&d, 1);
    for (const vp::workspace_limits limits : {vp::workspace_limits{std::uint64_t{1} << 32, 1, 0, 0},
                                              vp::workspace_limits{1, 1, std::uint64_t{1} << 40, 1}}) {
        EXPECT_EQ(vp::workspace_bytes(draws, g, fb.view(), {}, limits), 0u);
        EXPECT_EQ(vp::voxelize_async(be, draws, g, fb.view(), {}, {nullptr, 0, limits}).code,
                  vp::status_code::size_overflow);
    }
}

// The numbers of blocks for this device. tests/core/launch_size_test.cpp checks the arithmetic.
TEST(Pipeline, LaunchesFillTheDevice) {
    int device = 0;
    cudaDeviceProp properties{};
    ASSERT_EQ(cudaGetDevice(&device), cudaSuccess);
    ASSERT_EQ(cudaGetDeviceProperties(&properties, device), cudaSuccess);
    const auto multiprocessors = static_cast<unsigned>(properties.multiProcessorCount);
    for (int bit = 32; bit < 64; ++bit) {
        const std::uint64_t items = std::uint64_t{1} << bit;
        EXPECT_EQ(vp::device::fill_device(items), 8 * multiprocessors) << bit;
        EXPECT_EQ(vp::device::fill_device(items, 4), 4 * multiprocessors) << bit;
    }
    EXPECT_EQ(vp::device::fill_device(0), 1u);
    EXPECT_EQ(vp::device::num_blocks(0), 1u);
    for (std::uint64_t bit = 0; bit <= 32; ++bit) {
        const auto items = static_cast<std::uint32_t>((std::uint64_t{1} << bit) - (bit == 32 ? 1 : 0));
        const std::uint64_t blocks = vp::device::raster_blocks(items, 8);
        const std::uint64_t in_round = blocks * vp::tuning::raster_threads;
        const std::uint64_t rounds = (items + in_round - 1) / in_round;
        EXPECT_LE(rounds, vp::device::warp_triangles::max_rounds) << bit;
        EXPECT_GE(blocks, std::min<std::uint64_t>(multiprocessors, (items + 127) / 128)) << bit;
        EXPECT_LT((blocks - 1) * vp::tuning::raster_threads, items) << bit; // no block without a triangle
        EXPECT_LE(blocks, static_cast<unsigned>(properties.maxGridSize[0])) << bit;
    }
}

// When blocks of the first pass draw what they would defer. Results are right either way, so no comparison could find a
// mistake.
TEST(Pipeline, BlocksDrawWhatTheyWouldDeferForFineMeshesOnly) {
    using deferred = decltype(vp::device::pipeline_state::deferred);
    const std::uint64_t much = ~std::uint64_t{0};
    for (const vp::coverage rule : both_rules) {
        const bool thin = rule == vp::coverage::thin;
        EXPECT_EQ(deferred{}.num_deferred(rule), 0u);
        EXPECT_EQ((deferred{0, {5, 3, 0, 0}, 0, 0}.num_deferred(rule)), thin ? 3u : 8u);
        EXPECT_EQ((deferred{1, {5, 3, 0, 0}, 1, 0}.num_deferred(rule)), much);
        EXPECT_EQ((deferred{0, {5, 3, 1, 0}, 0, 0}.num_deferred(rule)), much);
        EXPECT_EQ((deferred{0, {0, 0, 0, 1}, 0, 0}.num_deferred(rule)), much);
    }
    const std::uint64_t each = vp::tuning::max_left_of_block;
    for (const std::size_t triangles : {1u, 128u, 129u, 1u << 30}) {
        SCOPED_TRACE(triangles);
        EXPECT_TRUE(vp::device::defers_few(triangles, 0));
        EXPECT_TRUE(vp::device::defers_few(triangles, each));
        EXPECT_FALSE(vp::device::defers_few(triangles, much));
    }
    EXPECT_FALSE(vp::device::defers_few(128, each + 1)); // a block's
    EXPECT_TRUE(vp::device::defers_few(129, each + 1));
    const auto at_once = static_cast<std::uint64_t>(vp::device::num_multiprocessors()) * vp::tuning::max_left_blocks;
    EXPECT_TRUE(vp::device::defers_few(1u << 30, each * at_once));
    EXPECT_FALSE(vp::device::defers_few(1u << 30, each * at_once + 1));
}

// add_unordered may differ in bits, but stays within the rounding errors of its additions.
TEST(Pipeline, UnorderedSumsStayWithinABound) {
    const mesh_data m = mixed_triangles(3000, 30.0f, 41);
    const vp::grid g = box_grid({32, 32, 32});
    using unordered = vp::target<float, blend::add_unordered>;
    vp::cuda_backend be;
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, unordered, vp::target<double, blend::add_unordered>,
                    vp::target<double, blend::add>, vp::target<std::uint32_t, blend::count>>
        fb{be, g.extent};
    const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(0.1f, 0.1, 0.1, 0u), fb);
    ASSERT_TRUE(s.ok()) << s.message();
    const auto f = vp::get<0>(fb).to_host(be);
    const auto d = vp::get<1>(fb).to_host(be), exact = vp::get<2>(fb).to_host(be);
    const auto n = vp::get<3>(fb).to_host(be);
    for (std::size_t i = 0; i < f.size(); ++i) {
        ASSERT_NEAR(static_cast<double>(f[i]), 0.1 * n[i], 1.2e-7 * n[i] * (0.1 * n[i] + 1.0));
        ASSERT_NEAR(d[i], exact[i], 2.3e-16 * n[i] * (0.1 * n[i] + 1.0));
    }
}

} // namespace
