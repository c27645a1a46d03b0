// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// CUDA errors and numbers that run out, as a status: addresses that the device may not touch give device_error with a
// stage and CUDA's number, no exception and no abort. Each in a process of its own, because such an error stays with
// the context.

#include "cells.hpp"

#include <voxelpipe/device/abuffer_async.cuh>

#include <sys/mman.h>

#include <cstdio>
#include <cstdlib>
#include <span>
#include <type_traits>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using bits = target_list<vp::target<vp::bit, blend::bit_or>>;

const vp::grid g = box_grid({40, 30, 50});

// Memory that neither host nor device may touch, as large as any array here.
template <class T>
T* forbidden() {
    void* const p = mmap(nullptr, std::size_t{1} << 24, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return p == MAP_FAILED ? nullptr : static_cast<T*>(p);
}

enum class broken { positions, triangles, target };

// A mesh on the device, part of which is said to lie where nothing may.
struct broken_mesh {
    vp::cuda_backend be;
    mesh_data data = mixed_triangles(500, 40.0f, 140);
    vp::mesh<vp::cuda_backend> good{be, data.positions, data.triangles};

    [[nodiscard]] vp::mesh_view<> view(broken what) const {
        vp::mesh_view<> v = good.view();
        if (what == broken::positions) v.positions = {forbidden<glm::vec3>(), v.positions.size()};
        if (what == broken::triangles) v.triangles = {forbidden<glm::uvec3>(), v.triangles.size()};
        return v;
    }
};

// 1 for a status other than that of a bad address; says on stderr what it was.
int is_wrong(const vp::status& s, bool names_stage) {
    std::fprintf(stderr, "%s\n", s.message().c_str());
    const bool right = s.code == vp::status_code::device_error && s.device_error == cudaErrorIllegalAddress &&
                       (!names_stage || s.where != vp::stage::validate);
    return right ? 0 : 1;
}

// The call that meets the error, and one after it, which can do no better.
template <class Call>
int count_wrong(const Call& call) {
    const int first = is_wrong(call(), true);
    return first + is_wrong(call(), false);
}

template <class Targets, class FragmentShader>
int draw_broken(broken what, const FragmentShader& fs, bool lists = false) {
    broken_mesh m;
    if (!lists && !vp::core::is_constant<FragmentShader>) m.be.strategy = vp::strategy::tiled;
    typename Targets::template framebuffer<vp::cuda_backend> fb{m.be, g.extent};
    auto view = fb.view();
    auto& target = vp::get<0>(view.targets);
    if (what == broken::target) target.elements = forbidden<std::remove_cvref_t<decltype(*target.elements)>>();
    return count_wrong([&] { return vp::voxelize(m.be, m.view(what), g, vp::passthrough{}, fs, view); });
}

template <class Payload, class FragmentShader>
int list_broken(broken what, const FragmentShader& fs) {
    broken_mesh m;
    vp::abuffer<vp::cuda_backend, Payload> lists{m.be};
    return count_wrong([&] { return vp::voxelize(m.be, m.view(what), g, vp::passthrough{}, fs, lists); });
}

int draw_without_a_wait(broken what) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, tile_values>;
    broken_mesh m;
    const draw_type d{m.view(what), {}, {}};
    const std::span<const draw_type> draws(&d, 1);
    tile_targets::framebuffer<vp::cuda_backend> fb{m.be, g.extent};
    const auto limits = vp::workspace_limits::for_triangles(m.data.triangles.size());
    const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
    vp::cuda_backend::buffer<std::byte> memory(m.be, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};
    const vp::status launched = vp::voxelize_async(m.be, draws, g, fb.view(), {}, workspace);
    const int wrong = launched.ok() ? 0 : is_wrong(launched, true); // it may show early
    return wrong + is_wrong(vp::read_status(m.be, workspace), false);
}

class BadAddressDeathTest : public ::testing::Test {
protected:
    void SetUp() override { testing::GTEST_FLAG(death_test_style) = "threadsafe"; }
};

// f gives the number of wrong statuses, in a process that ends with it.
template <class F>
void expect_none_wrong(const F& f, const char* message = "CUDA error 700") {
    EXPECT_EXIT(std::exit(f()), testing::ExitedWithCode(0), message);
}

TEST_F(BadAddressDeathTest, OfAMeshThatIsDrawnInTiles) {
    for (const broken what : {broken::positions, broken::triangles})
        expect_none_wrong([&] { return draw_broken<tile_targets>(what, tile_values{}); });
}
TEST_F(BadAddressDeathTest, OfAMeshWhoseFragmentsAreListed) {
    for (const broken what : {broken::positions, broken::triangles, broken::target})
        expect_none_wrong([&] { return draw_broken<tile_targets>(what, tile_values{}, true); });
}
// An error that shows only at the end names the last stage; without tiles that is the raster.
TEST_F(BadAddressDeathTest, OfAMeshThatIsDrawnWithoutTiles) {
    expect_none_wrong([] { return draw_broken<bits>(broken::positions, vp::constant(true)); },
                      "fine raster: device error \\(CUDA error 700\\)");
    expect_none_wrong([] { return draw_broken<bits>(broken::triangles, vp::constant(true)); });
}
TEST_F(BadAddressDeathTest, OfATarget) {
    expect_none_wrong([] { return draw_broken<tile_targets>(broken::target, tile_values{}); });
    expect_none_wrong([] { return draw_broken<bits>(broken::target, vp::constant(true)); });
}
TEST_F(BadAddressDeathTest, OfAMeshThatIsListed) {
    expect_none_wrong([] { return list_broken<double>(broken::positions, any_double{}); });
    expect_none_wrong([] { return list_broken<void>(broken::triangles, vp::constant(true)); });
}
TEST_F(BadAddressDeathTest, OfACallWithoutAWait) {
    expect_none_wrong([] { return draw_without_a_wait(broken::positions); });
}

// 9,000 times half a slice of 1020^2 voxels are more than 2^32 fragments. They are counted, not written.
TEST(Errors, MoreFragmentsThanNumbersAreOutOfMemoryForLists) {
    mesh_data m;
    add_triangle(m, {1.0f, 1.0f, 512.5f}, {1021.0f, 1.0f, 512.5f}, {1.0f, 1021.0f, 512.5f});
    m.triangles.resize(9000, m.triangles[0]);
    vp::cuda_backend be;
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    vp::abuffer<vp::cuda_backend> lists{be};
    const vp::status s = vp::voxelize(be, mesh, box_grid({1024, 1024, 1024}), vp::passthrough{}, vp::constant(true),
                                      lists, vp::coverage::thin);
    EXPECT_EQ(s.code, vp::status_code::out_of_memory);
    EXPECT_EQ(s.where, vp::stage::abuffer_emit);
    EXPECT_GT(s.required.fragments, std::uint64_t{1} << 32);
    EXPECT_EQ(lists.num_fragments(), 0u);
}

// 600 times half a slice are more than 2^28: what need not be listed is drawn in tiles then, and at once the next time.
TEST(Errors, TooManyFragmentsToListAreDrawnInTiles) {
    mesh_data m;
    add_triangle(m, {1.0f, 1.0f, 0.5f}, {1021.0f, 1.0f, 0.5f}, {1.0f, 1021.0f, 0.5f});
    m.triangles.resize(600, m.triangles[0]);
    const vp::grid slice = box_grid({1024, 1024, 1});
    vp::cuda_backend be;
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    tile_targets::framebuffer<vp::cuda_backend> fb{be, slice.extent};
    for (int call = 0; call < 2; ++call) {
        const vp::status s = vp::voxelize(be, mesh, slice, vp::passthrough{}, tile_values{}, fb, vp::coverage::thin);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_GT(s.counts.fragments, std::uint64_t{1} << 28);
        EXPECT_EQ(s.counts.fragments, s.counts.voxels * 600);
        const auto counts = vp::get<2>(fb).to_host(be);
        EXPECT_EQ(counts[1024 * 5 + 5], 600u);
    }
}

} // namespace
