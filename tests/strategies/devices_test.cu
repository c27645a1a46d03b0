// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Slabs of several GPUs (slabs/devices.cuh) are the CPU's whole: targets of every kind, gathered and where they were
// drawn, lists, counts, and what is refused. One GPU works for several, one after the other and at once; so do all GPUs
// where there are more. Sparse framebuffers and solids: sparse_test.cu.

#include "cells.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <string>

using namespace device_test;
namespace slabs = voxelpipe::slabs;

namespace {

using kinds = small_kinds<target_list>;
using values = small_kinds<any_values>;
template <class Backend>
using framebuffer_of = typename kinds::template framebuffer<Backend>;
constexpr std::size_t num_targets = 5;

struct set_of_gpus {
    std::vector<int> ordinals;
    bool is_parallel;
};
std::vector<set_of_gpus> every_set() {
    std::vector<set_of_gpus> sets{{{0}, false}, {{0, 0, 0}, false}};
#if defined(__NVCC__) // emulated GPUs work for one thread
    sets.push_back({{0, 0}, true});
    sets.push_back({{0, 0, 0, 0, 0, 0, 0}, true});
    if (slabs::devices::all().size() > 1) sets.push_back({slabs::devices::all(), true});
#endif
    return sets;
}

class Devices : public ::testing::Test {
protected:
    mesh_data m = mixed_triangles(400, 30.0f, 80);
    vp::mesh_view<> view{m.positions, m.triangles};
    vp::grid whole = box_grid({30, 33, 40}), g = whole.crop({2, 0, 3}, {27, 30, 32});
    vp::cpu_backend cpu;

    template <class Output, class Shader>
    vp::status draw_on_cpu(const Shader& shader, Output& out) {
        const vp::mesh<vp::cpu_backend> mesh(cpu, m.positions, m.triangles);
        return vp::voxelize(cpu, mesh, g, vp::passthrough{}, shader, out);
    }
};

TEST_F(Devices, SlabsOfTargetsAreTheCpus) {
    for (const bool may_turn : {false, true}) {
        if (may_turn) // slabs along z would be uneven
            for (glm::vec3& p : m.positions) p.z = 15.0f + 0.04f * p.z;
        framebuffer_of<vp::cpu_backend> expected{cpu, g.extent};
        const vp::status on_cpu = draw_on_cpu(values{}, expected);
        for (const set_of_gpus& set : every_set()) {
            SCOPED_TRACE(std::to_string(set.ordinals.size()) + " GPUs" + (may_turn ? ", any axis" : ""));
            slabs::devices gpus(set.ordinals, set.is_parallel);
            slabs::device_options options;
            options.may_turn = may_turn;
            options.voxel_bytes = may_turn ? 0 : 20;
            slabs::device_slabs drawn(gpus, g, view, vp::passthrough{}, options);
            ASSERT_EQ(drawn.size(), set.ordinals.size());
            EXPECT_EQ(drawn.cuts().axis != 2, may_turn && drawn.size() > 1);
            auto parts = drawn.make([](vp::cuda_backend& gpu, glm::ivec3 extent) {
                return framebuffer_of<vp::cuda_backend>{gpu, extent};
            });
            for (int call = 0; call < 2; ++call) { // the second one overwrites the first
                const vp::status s = drawn.draw(values{}, parts);
                ASSERT_TRUE(s.ok()) << s.message();
                expect_same_counts(on_cpu.counts, s.counts);
            }
            std::vector<vp::host_target<vp::target<double, vp::blend::max>>> hosts;
            for (std::size_t i = 0; i < parts.size(); ++i)
                hosts.push_back(vp::get<2>(parts[i]).to_host_target(gpus.backend(i)));
            const auto all = vp::get<2>(expected).to_host_target(cpu);
            for (std::size_t i = 0; i < parts.size(); ++i) {
                const vp::grid& where = drawn.slabs()[i].where;
                int wrong = 0;
                vp::for_each_voxel(hosts[i], [&](const glm::ivec3& v, double value) {
                    const glm::ivec3 at = v + where.offset - g.offset;
                    wrong += vp::core::is_same_value(value, all(at.x, at.y, at.z)) ? 0 : 1;
                });
                EXPECT_EQ(wrong, 0) << "slab " << i;
            }
            framebuffer_of<vp::cuda_backend> gathered{gpus.backend(0), g.extent};
            ASSERT_EQ(cudaStreamSynchronize(gpus.backend(0).stream), cudaSuccess);
            vp::core::for_each_index<num_targets>([&]<std::size_t I>() {
                const vp::status s = drawn.template gather<I>(parts, gathered.view());
                if (drawn.cuts().axis != 2) {
                    EXPECT_EQ(s.code, vp::status_code::bad_crop);
                    return;
                }
                ASSERT_TRUE(s.ok()) << s.message();
                expect_same_bytes(vp::get<I>(expected).to_host(cpu), vp::get<I>(gathered).to_host(gpus.backend(0)),
                                  ("target " + std::to_string(I)).c_str());
            });
        }
    }
}

TEST_F(Devices, SlabsOfListsAreTheCpus) {
    vp::abuffer<vp::cpu_backend, double> expected{cpu};
    const vp::status on_cpu = draw_on_cpu(any_double{}, expected);
    for (const set_of_gpus& set : every_set()) {
        SCOPED_TRACE(set.ordinals.size());
        slabs::devices gpus(set.ordinals, set.is_parallel);
        slabs::device_options options;
        options.may_turn = false;
        slabs::device_slabs drawn(gpus, g, view, vp::passthrough{}, options);
        auto parts =
            drawn.make([](vp::cuda_backend& gpu, glm::ivec3) { return vp::abuffer<vp::cuda_backend, double>{gpu}; });
        const vp::status s = drawn.draw(any_double{}, parts);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_counts(on_cpu.counts, s.counts);
        vp::host_abuffer<double> joined;
        for (std::size_t i = 0; i < parts.size(); ++i) {
            EXPECT_EQ(drawn.slabs()[i].voxels_before, joined.voxels.size());
            EXPECT_EQ(drawn.slabs()[i].fragments_before, joined.primitives.size());
            slabs::append(joined, g, drawn.slabs()[i], parts[i].to_host(gpus.backend(i)));
        }
        expect_same_on_host(expected.to_host(cpu), joined);
    }
}

TEST_F(Devices, MoreGpusThanLayersLeaveSomeIdle) {
    slabs::devices gpus({0, 0, 0, 0, 0}, false);
    g = whole.crop({0, 0, 7}, {30, 33, 3});
    slabs::device_options options;
    options.may_turn = false;
    slabs::device_slabs drawn(gpus, g, view, vp::passthrough{}, options);
    EXPECT_LE(drawn.size(), 3u);
    int layers = 0;
    for (const slabs::slab& s : drawn.slabs()) layers += s.where.extent.z;
    EXPECT_EQ(layers, 3);
}

TEST_F(Devices, WhatCannotBeDrawnIsRefused) {
    slabs::devices gpus({0, 0}, false);
    const auto message_of = [&](const vp::mesh_view<>& mesh) -> std::string {
        try {
            const slabs::device_slabs drawn(gpus, g, mesh, vp::passthrough{});
            return "none";
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
    };
    EXPECT_EQ(message_of(view), "none");
    vp::mesh_view<> copies = view;
    copies.copies.count = 2;
    EXPECT_NE(message_of(copies).find("subset"), std::string::npos);
    mesh_data bad = m;
    bad.triangles[5].y = 1u << 30;
    EXPECT_NE(message_of({bad.positions, bad.triangles}).find("index"), std::string::npos);
    slabs::device_slabs drawn(gpus, g, view, vp::passthrough{});
    std::vector<framebuffer_of<vp::cuda_backend>> none;
    EXPECT_EQ(drawn.draw(values{}, none).code, vp::status_code::extent_mismatch);
}

// What a GPU's work throws reaches the caller when all have ended.
TEST_F(Devices, ExceptionsReachTheCaller) {
    for (const set_of_gpus& set : every_set()) {
        const slabs::devices gpus(set.ordinals, set.is_parallel);
        const std::size_t last = gpus.size() - 1;
        std::vector<char> ended(gpus.size());
        EXPECT_THROW(gpus.for_each(gpus.size(),
                                   [&](std::size_t i, vp::cuda_backend&) {
                                       ended[i] = 1;
                                       if (i == last) throw std::length_error("last");
                                   }),
                     std::length_error);
        EXPECT_EQ(std::count(ended.begin(), ended.end(), 1), static_cast<std::ptrdiff_t>(gpus.size()));
    }
}

} // namespace
