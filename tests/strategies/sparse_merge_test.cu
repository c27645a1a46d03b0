// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse calls that never wait, in slabs of several GPUs, and their merge on one of them: the bytes of a synchronous
// call in the whole, over several calls, with rooms that do not suffice at first, and in a CUDA graph. One GPU works
// for several; so do all GPUs where there are more.

#include "async_lists.hpp"
#include "device_test.hpp"
#include "sparse_pairs.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <vector>

namespace {

using namespace sparse_pairs;
namespace slabs = voxelpipe::slabs;

using result_type = result_of<framebuffer<vp::cuda_backend>>::type;
template <class Result>
struct host_of;
template <class... Targets>
struct host_of<vp::sparse_result<Targets...>> {
    using type = vp::host_sparse<Targets...>;
};

std::vector<std::vector<int>> every_set() {
    std::vector<std::vector<int>> sets{{0}, {0, 0}, {0, 0, 0}};
    if (slabs::devices::all().size() > 1) sets.push_back(slabs::devices::all());
    return sets;
}

template <class Result>
void keep_some(Result& to) {
    to.template keep_sums<2>();
    to.template keep_sums<3>();
}
template <class Host>
void expect_same(const Host& a, const Host& b) {
    EXPECT_EQ(a.keys, b.keys);
    EXPECT_TRUE(a.masks == b.masks);
    EXPECT_EQ(a.offsets, b.offsets);
    EXPECT_EQ(a.num_tiles(), 0u);
    EXPECT_EQ(a.where.extent, b.where.extent);
    EXPECT_EQ(a.where.offset, b.where.offset);
    EXPECT_EQ(a.where.whole_extent(), b.where.whole_extent());
    vp::core::for_each_index<Host::num_targets>([&]<std::size_t I>() {
        EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.values), vp::get<I>(b.values))) << "target " << I;
        EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.sums), vp::get<I>(b.sums))) << "sums of " << I;
        EXPECT_TRUE(vp::get<I>(a.clear_values) == vp::get<I>(b.clear_values)) << "target " << I;
    });
}

// Memory of a call, which has seen other things before, with a guard behind it.
class call_memory {
public:
    call_memory(vp::cuda_backend& be, std::size_t bytes, const vp::workspace_limits& limits) : memory_(be, bytes) {
        view = {const_cast<unsigned char*>(memory_.memory.data()), bytes, limits};
        EXPECT_EQ(cudaMemsetAsync(view.memory, 0xa5, bytes, be.stream), cudaSuccess);
    }
    void expect_untouched_behind(vp::cuda_backend& be) const { memory_.expect_untouched_behind(be); }
    vp::workspace_view view;

private:
    device_test::guarded_memory memory_;
};

// Slabs, and what they hold.
class slab_calls {
public:
    slabs::devices gpus;
    slabs::device_slabs<vp::passthrough> drawn;
    std::vector<result_type> parts;
    result_type whole;

    slab_calls(const std::vector<int>& ordinals, const vp::grid& g, const unit::small_mesh& mesh, int align)
        : gpus(ordinals, ordinals != std::vector<int>(ordinals.size(), 0)),
          drawn(gpus, g, mesh.view(), vp::passthrough{}, options_with(align)), parts(drawn.size()) {
        for (result_type& r : parts) keep_some(r);
    }

    // One call, at first without room. is_first: clears, otherwise goes on.
    void draw(bool is_first, const vp::status& expected, const host_of<result_type>::type& contents) {
        for (result_type& r : parts) {
            if (!is_first) r.load(result_type(r));
            vp::get<1>(r.clear_values) = 9u;
            vp::get<3>(r.clear_values) = {-1.5, 2};
        }
        std::vector<vp::workspace_limits> limits(drawn.size()), need;
        for (vp::workspace_limits& l : limits) l.bricks = 1;
        bool has_failed = false;
        for (int tries = 0; tries < 8; ++tries) {
            std::vector<std::unique_ptr<call_memory>> memories;
            std::vector<vp::workspace_view> workspaces;
            for (std::size_t i = 0; i < drawn.size(); ++i) {
                const slabs::detail::current_device device(gpus.ordinal(i));
                const std::size_t bytes = drawn.workspace_bytes(i, shader{}, parts[i], limits[i]);
                ASSERT_GT(bytes, 0u);
                memories.push_back(std::make_unique<call_memory>(gpus.backend(i), bytes, limits[i]));
                workspaces.push_back(memories.back()->view);
            }
            ASSERT_TRUE(drawn.draw_async(shader{}, parts, workspaces).ok());
            vp::workspace_limits of_whole{};
            for (const vp::workspace_limits& l : limits) {
                of_whole.bricks += l.bricks;
                of_whole.voxels += l.voxels;
            }
            const std::size_t at = drawn.size() - 1;
            merge(workspaces, at, of_whole);
            const vp::status s = drawn.read_status(workspaces, &need);
            const vp::status merged = vp::read_status(gpus.backend(at), whole_memory_->view);
            for (std::size_t i = 0; i < drawn.size(); ++i) memories[i]->expect_untouched_behind(gpus.backend(i));
            if (s.ok()) {
                EXPECT_TRUE(has_failed);
                EXPECT_EQ(s.counts, expected.counts);
                ASSERT_TRUE(merged.ok()) << merged.message();
                EXPECT_EQ(merged.counts.voxels, contents.num_voxels());
                expect_same(whole.to_host(gpus.backend(at)), contents);
                for (auto& m : memories) kept_.push_back(std::move(m));
                merge_without_room(workspaces, at);
                return;
            }
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
            EXPECT_EQ(merged.code, vp::status_code::other_rank_failed);
            EXPECT_EQ(whole.to_host(gpus.backend(at)).num_voxels(), 0u);
            has_failed = true;
            limits = need;
        }
        FAIL() << "never fits";
    }

private:
    static slabs::device_options options_with(int align) {
        slabs::device_options o;
        o.align = align;
        o.voxelize.rule = vp::coverage::conservative;
        return o;
    }
    void merge(const std::vector<vp::workspace_view>& workspaces, std::size_t at, const vp::workspace_limits& limits) {
        const slabs::detail::current_device device(gpus.ordinal(at));
        const std::size_t bytes = vp::merge_workspace_bytes(std::span<const result_type>(parts), workspaces, limits);
        ASSERT_GT(bytes, 0u);
        whole_memory_ = std::make_unique<call_memory>(gpus.backend(at), bytes, limits);
        vp::workspace_view few = whole_memory_->view;
        few.bytes -= 1;
        EXPECT_EQ(drawn.merge_async(parts, workspaces, at, whole, few).required.bytes, bytes);
        const vp::status s = drawn.merge_async(parts, workspaces, at, whole, whole_memory_->view);
        ASSERT_TRUE(s.ok()) << s.message();
        whole_memory_->expect_untouched_behind(gpus.backend(at));
    }
    void merge_without_room(const std::vector<vp::workspace_view>& workspaces, std::size_t at) {
        const auto full = whole.to_host(gpus.backend(at));
        vp::workspace_limits few{}, need;
        few.bricks = full.num_bricks();
        few.voxels = full.num_values() - 1;
        merge(workspaces, at, few);
        EXPECT_EQ(vp::read_status(gpus.backend(at), whole_memory_->view, &need).code,
                  vp::status_code::capacity_exceeded);
        EXPECT_EQ(need.voxels, full.num_values());
        EXPECT_EQ(whole.to_host(gpus.backend(at)).num_values(), 0u);
        merge(workspaces, at, need);
        expect_same(whole.to_host(gpus.backend(at)), full);
    }

    std::unique_ptr<call_memory> whole_memory_;
    std::vector<std::unique_ptr<call_memory>> kept_; // what results refer to
};

} // namespace

TEST(DeviceSparseMerge, SlabsOfSeveralGpusAreTheSynchronousCalls) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid g = unit::unit_grid(extent);
    const unit::small_mesh mesh = unit::make_mesh(14, 25, extent);
    vp::cpu_backend host{2};
    const vp::mesh<vp::cpu_backend> on_host{host, mesh.positions, mesh.triangles};
    framebuffer<vp::cpu_backend> expected{host, extent};
    keep_some(expected);
    vp::get<1>(expected).clear(9u);
    vp::get<3>(expected).clear({-1.5, 2});
    const auto draw = [&] {
        return vp::voxelize(host, on_host, g, vp::passthrough{}, shader{}, expected, vp::coverage::conservative);
    };
    const vp::status first = draw();
    const auto after_first = expected.to_host(host);
    vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(expected).load(); });
    const vp::status second = draw();
    const auto after_second = expected.to_host(host);
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_GT(after_first.num_voxels(), 500u);
    for (const std::vector<int>& set : every_set())
        for (const int align : {1, 8}) { // borders that cut bricks, and those that do not
            SCOPED_TRACE(std::to_string(set.size()) + " GPUs, aligned to " + std::to_string(align));
            slab_calls calls(set, g, mesh, align);
            EXPECT_EQ(calls.drawn.size(), set.size());
            calls.draw(true, first, after_first);
            calls.draw(false, second, after_second);
        }
}

// Two parts and their merge in one graph, which is replayed with moved vertices.
TEST(DeviceSparseMerge, AGraphHoldsPartsAndTheirMerge) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid g = unit::unit_grid(extent);
    const vp::grid grids[] = {g.crop({0, 0, 0}, {45, 34, 19}), g.crop({0, 0, 19}, {45, 34, 18})};
    const unit::small_mesh mesh = unit::make_mesh(1, 25, extent);
    const device_test::stream_owner stream;
    vp::cuda_backend be{stream.stream};
    vp::cpu_backend host{2};
    const vp::mesh<vp::cuda_backend> a(be, mesh.positions, mesh.triangles);
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, shader>;
    const draw_type one{a.view(), {}, shader{}};
    const std::span<const draw_type> draws(&one, 1);
    vp::workspace_limits limits{};
    limits.bricks = 400;
    limits.voxels = 60000;
    limits.fragments = 120000;
    limits.fragment_records = 20000;
    std::vector<result_type> parts(2);
    result_type whole;
    std::vector<std::unique_ptr<call_memory>> memories;
    std::vector<vp::workspace_view> workspaces;
    for (int i = 0; i < 2; ++i) {
        memories.push_back(
            std::make_unique<call_memory>(be, vp::workspace_bytes(draws, grids[i], parts[0], {}, limits), limits));
        workspaces.push_back(memories.back()->view);
        // What merge_workspace_bytes asks for: results of calls.
        ASSERT_TRUE(
            vp::voxelize_async(be, draws, grids[i], parts[static_cast<std::size_t>(i)], {}, workspaces.back()).ok());
    }
    const std::span<const result_type> all(parts);
    const call_memory memory(be, vp::merge_workspace_bytes(all, workspaces, limits), limits);
    const device_test::captured_graph graph(be.stream, [&] {
        for (std::size_t i = 0; i < 2; ++i)
            if (const vp::status s = vp::voxelize_async(be, draws, grids[i], parts[i], {}, workspaces[i]); !s.ok())
                return s;
        return vp::merge_async(be, all, workspaces, whole, memory.view);
    });
    for (const glm::vec3& by : {glm::vec3(3, -2, 1), glm::vec3(0)}) {
        const unit::small_mesh moved = sparse_pairs::move_mesh(be, a, mesh, by);
        graph.launch(be.stream);
        ASSERT_TRUE(vp::read_status(be, memory.view).ok());
        framebuffer<vp::cpu_backend> expected(host, extent);
        ASSERT_TRUE(vp::voxelize(host, moved.view(), g, vp::passthrough{}, shader{}, expected).ok());
        EXPECT_GT(expected.num_voxels(), 300u);
        expect_same(whole.to_host(be), expected.to_host(host));
    }
}

TEST(DeviceSparseMerge, WhatCannotBeJoinedIsRefused) {
    vp::cuda_backend be;
    std::vector<result_type> parts(2);
    const std::vector<vp::workspace_view> workspaces(2);
    result_type whole;
    const auto code_of = [&](std::span<const vp::workspace_view> w) {
        return vp::merge_async(be, std::span<const result_type>(parts), w, whole, {}).code;
    };
    EXPECT_EQ(code_of(workspaces), vp::status_code::null_view); // not drawn
    const vp::sparse_counts counts{};
    for (result_type& r : parts) {
        r.counts = &counts;
        r.where = unit::unit_grid({20, 20, 20});
    }
    EXPECT_EQ(code_of(workspaces), vp::status_code::capacity_exceeded);
    EXPECT_EQ(code_of(std::span(workspaces.data(), 1)), vp::status_code::extent_mismatch);
    parts[1].view.table.num_tiles = 1;
    EXPECT_EQ(code_of(workspaces), vp::status_code::strategy_unavailable);
    parts[1].view.table.num_tiles = 0;
    parts[1].keep_sums<2>();
    EXPECT_EQ(code_of(workspaces), vp::status_code::null_view);
    parts[0].keep_sums<2>();
    parts[1].where = unit::unit_grid({20, 20, 24});
    EXPECT_EQ(code_of(workspaces), vp::status_code::extent_mismatch);
    parts.clear();
    EXPECT_EQ(code_of({}), vp::status_code::extent_mismatch);
    EXPECT_EQ(vp::merge_workspace_bytes(std::span<const result_type>(parts), {}, {}), 0u);
}
