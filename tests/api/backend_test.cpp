// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// cpu_backend itself: results for any number of threads, progress, stage times, exceptions, status texts.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <stdexcept>
#include <string>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;

const glm::ivec3 extent{130, 97, 70};

struct shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(true, f.barycentric.x, f.primitive, f.normal)
            .discard_if(unit::mark(f.primitive, f.voxel) % 11 == 0);
    }
};
using framebuffer =
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>,
                    vp::target<std::uint32_t, blend::replace>, vp::target<glm::vec3, blend::add_unordered>>;

struct payload_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.barycentric); }
};

class Threads : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(Threads, GiveTheSameBytesWhateverTheirNumber) {
    const unit::small_mesh mesh = unit::make_mesh(1, static_cast<int>(unit::cases(10'000)), extent);
    const vp::grid grid = unit::unit_grid(extent);
    std::vector<std::uint32_t> bits, last;
    std::vector<float> sums;
    std::vector<glm::vec3> normals;
    vp::host_abuffer<glm::vec3> lists;
    vp::counters counts, list_counts;
    for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        vp::cpu_backend backend{threads};
        framebuffer fb{backend, extent};
        const vp::status s = vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, shader{}, fb, GetParam());
        ASSERT_TRUE(s.ok()) << s.message();
        vp::abuffer<vp::cpu_backend, glm::vec3> ab{backend};
        const vp::status t =
            vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, payload_shader{}, ab, GetParam());
        ASSERT_TRUE(t.ok()) << t.message();
        const auto host = ab.to_host(backend);
        if (threads == 1) {
            bits = vp::get<0>(fb).to_host(backend);
            sums = vp::get<1>(fb).to_host(backend);
            last = vp::get<2>(fb).to_host(backend);
            normals = vp::get<3>(fb).to_host(backend);
            lists = host;
            counts = s.counts;
            list_counts = t.counts;
            continue;
        }
        EXPECT_EQ(s.counts, counts);
        EXPECT_EQ(t.counts, list_counts);
        EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), bits)) << threads;
        EXPECT_TRUE(unit::same_bytes(vp::get<1>(fb).to_host(backend), sums)) << threads;
        EXPECT_TRUE(unit::same_bytes(vp::get<2>(fb).to_host(backend), last)) << threads;
        EXPECT_TRUE(unit::same_bytes(vp::get<3>(fb).to_host(backend), normals)) << threads;
        EXPECT_TRUE(unit::same_bytes(host.voxels, lists.voxels)) << threads;
        EXPECT_TRUE(unit::same_bytes(host.offsets, lists.offsets)) << threads;
        EXPECT_TRUE(unit::same_bytes(host.primitives, lists.primitives)) << threads;
        EXPECT_TRUE(unit::same_bytes(host.payloads, lists.payloads)) << threads;
    }
}

INSTANTIATE_TEST_SUITE_P(Both, Threads, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& p) { return p.param == vp::coverage::thin ? "thin" : "conservative"; });

TEST(Threads, MayOutnumberTheWorkItems) {
    unit::small_mesh one;
    one.positions = {{1, 1, 1}, {3, 1, 1}, {1, 3, 1}};
    one.triangles = {{0, 1, 2}};
    vp::cpu_backend few{1}, many{64}, machine{};
    const vp::grid grid = unit::unit_grid(extent);
    std::vector<std::uint32_t> expected;
    for (vp::cpu_backend* b : {&few, &many, &machine}) {
        vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, blend::bit_or>> fb{*b, extent};
        vp::voxelize(*b, one.view(), grid, vp::passthrough{}, vp::constant(true), fb).or_throw();
        if (expected.empty()) expected = vp::get<0>(fb).to_host(*b);
        EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(*b), expected));
    }
}

// Two backends, each called from a thread of its own at the same time.
TEST(Threads, TwoConcurrentCallsAreIndependent) {
    const unit::small_mesh mesh = unit::make_mesh(2, static_cast<int>(unit::cases(3000)), extent);
    const vp::grid grid = unit::unit_grid(extent);
    std::vector<std::uint32_t> results[2];
    {
        std::vector<std::thread> callers;
        for (auto& r : results)
            callers.emplace_back([&] {
                vp::cpu_backend backend{2};
                vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, blend::add>> fb{backend, extent};
                vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(1u), fb).or_throw();
                r = vp::get<0>(fb).to_host(backend);
            });
        for (std::thread& t : callers) t.join();
    }
    EXPECT_FALSE(results[0].empty());
    EXPECT_TRUE(unit::same_bytes(results[0], results[1]));
}

TEST(Progress, RisesToTheTotalOneCallAtATime) {
    const unit::small_mesh mesh = unit::make_mesh(3, static_cast<int>(unit::cases(3000)), extent);
    const vp::grid grid = unit::unit_grid(extent);
    for (const unsigned threads : {1u, 4u})
        for (const bool lists : {false, true}) {
            vp::cpu_backend backend{threads};
            std::atomic<int> inside{0};
            std::vector<std::uint64_t> seen;
            std::uint64_t total = 0;
            backend.progress = [&](std::uint64_t done, std::uint64_t all) {
                EXPECT_EQ(++inside, 1) << "two calls at once";
                seen.push_back(done);
                total = all;
                --inside;
            };
            if (lists) {
                vp::abuffer<vp::cpu_backend> out{backend};
                vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(), out).or_throw();
            } else {
                vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, blend::add>> out{backend, extent};
                vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(1u), out).or_throw();
            }
            ASSERT_FALSE(seen.empty());
            EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
            EXPECT_EQ(seen.back(), total);
            EXPECT_LE(seen.size(), 101u);
        }
}

TEST(StageTimes, AreAddedUp) {
    const unit::small_mesh mesh = unit::make_mesh(4, 2000, extent);
    vp::cpu_backend backend{2};
    vp::stage_times times{};
    backend.times = &times;
    vp::framebuffer<vp::cpu_backend, vp::target<float, blend::add>> fb{backend, extent};
    vp::abuffer<vp::cpu_backend> lists{backend};
    const vp::grid grid = unit::unit_grid(extent);
    vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(1.0f), fb).or_throw();
    EXPECT_GT(times.clear, 0.0);
    EXPECT_GT(times.fine_raster, 0.0);
    EXPECT_EQ(times.abuffer_emit, 0.0);
    const double coarse = times.coarse_raster;
    EXPECT_GT(coarse, 0.0);
    vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(), lists).or_throw();
    EXPECT_GT(times.abuffer_emit, 0.0);
    EXPECT_GT(times.coarse_raster, coarse);
}

struct throwing {
    bool now;
    VOXELPIPE_HD auto operator()(const vp::fragment<>&) const {
        if (now) throw std::domain_error("from the shader");
        return vp::outputs(1u);
    }
};

TEST(Exceptions, OfAShaderOrProgressFunctionPassThrough) {
    const unit::small_mesh mesh = unit::make_mesh(5, 500, extent);
    const vp::grid grid = unit::unit_grid(extent);
    for (const unsigned threads : {1u, 4u}) {
        vp::cpu_backend backend{threads};
        vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, blend::add>> fb{backend, extent};
        EXPECT_THROW((void)vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, throwing{true}, fb),
                     std::domain_error);
        vp::abuffer<vp::cpu_backend> lists{backend};
        EXPECT_THROW((void)vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, throwing{true}, lists),
                     std::domain_error);
        EXPECT_EQ(lists.num_fragments(), 0u);
        backend.progress = [](std::uint64_t, std::uint64_t) { throw std::range_error("from progress"); };
        EXPECT_THROW((void)vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, throwing{false}, fb),
                     std::range_error);
        backend.progress = nullptr;
        EXPECT_TRUE(
            vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, throwing{false}, fb).ok()); // still usable
    }
}

TEST(Status, EveryCodeAndStageHasItsOwnText) {
    std::set<std::string> texts;
    int codes = 0;
    for (int c = 0; c <= static_cast<int>(vp::status_code::device_error); ++c, ++codes)
        texts.insert(vp::to_string(static_cast<vp::status_code>(c)));
    EXPECT_EQ(texts.size(), static_cast<std::size_t>(codes));
    EXPECT_EQ(texts.count("unknown status"), 0u);
    std::set<std::string> stages;
    int all = 0;
    for (int s = 0; s <= static_cast<int>(vp::stage::abuffer_emit); ++s, ++all)
        stages.insert(vp::to_string(static_cast<vp::stage>(s)));
    EXPECT_EQ(stages.size(), static_cast<std::size_t>(all));
    EXPECT_EQ(stages.count("unknown stage"), 0u);
}

TEST(Status, MessageNamesStageAndReasonAndOrThrowThrowsIt) {
    vp::status ok;
    EXPECT_TRUE(ok);
    EXPECT_EQ(ok.message(), "ok");
    ok.counts.voxels = 42;
    const auto& passed = vp::status(ok).or_throw(); // a copy: the temporary is gone
    EXPECT_EQ(passed.counts.voxels, 42u);
    EXPECT_FALSE((std::is_reference_v<decltype(ok.or_throw())>));
    vp::status bad;
    bad.code = vp::status_code::index_out_of_range;
    bad.where = vp::stage::coarse_raster;
    EXPECT_FALSE(bad);
    EXPECT_EQ(bad.message(), std::string("coarse raster: ") + vp::to_string(vp::status_code::index_out_of_range));
    bad.draw = 2;
    bad.triangle = 7;
    EXPECT_NE(bad.message().find("(triangle 7 of draw 2)"), std::string::npos);
    bad.device_error = 700;
    EXPECT_NE(bad.message().find("CUDA error 700"), std::string::npos);
    try {
        bad.or_throw();
        FAIL() << "or_throw() returned";
    } catch (const std::runtime_error& e) {
        EXPECT_EQ(std::string(e.what()), "voxelpipe: " + bad.message());
    }
}

} // namespace
