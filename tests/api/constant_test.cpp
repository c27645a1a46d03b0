// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Shaders that give every fragment the same values have code paths of their own (cpu_ref/constant_tile.hpp,
// device/raster/raster.cuh). Bytes and counters must equal those of a user's shader that returns the same values and is
// run for each fragment.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <type_traits>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;

const glm::ivec3 extent{45, 70, 37};

struct record {
    std::uint64_t chain;
    std::uint32_t fragments, unused;
};
struct chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD record identity() const { return {1, 0, 0}; }
    VOXELPIPE_HD record combine(record a, record b) const {
        return {a.chain * 0x100000001b3u + b.chain, a.fragments + b.fragments, b.unused};
    }
};

// On a GPU, a target that depends on the order is made from lists for every shader, which targets_test.cpp covers. Two
// more pipelines need not be compiled here.
#if defined(__CUDACC__)
using ordered = vp::target<double, blend::max>;
double ordered_value(record r) { return static_cast<double>(r.chain); }
#else
using ordered = vp::target<record, chain>;
record ordered_value(record r) { return r; }
#endif

// The values of vp::constant, from a shader that the library cannot know to be constant.
template <class... Ts>
struct opaque {
    vp::core::pack<Ts...> values;
    VOXELPIPE_HD vp::output<Ts...> operator()(const vp::fragment<>&) const { return {values}; }
};

// Shaders for several draws: those of odd draws differ in all values, or in none.
template <template <class...> class Shader, class... Ts>
std::vector<Shader<Ts...>> shaders(std::size_t count, const vp::core::pack<Ts...>& a, const vp::core::pack<Ts...>& b) {
    std::vector<Shader<Ts...>> out;
    for (std::size_t i = 0; i < count; ++i) out.push_back({i % 2 == 0 ? a : b});
    return out;
}

// Two passes: one clears the targets, one loads them. The last target is off in the second.
template <class Framebuffer, class Shader>
std::vector<vp::counters> draw_twice(backend_type& backend, Framebuffer& fb,
                                     const std::vector<unit::small_mesh>& meshes,
                                     const std::vector<Shader>& fragment_shaders, vp::voxelize_options options) {
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    std::vector<vp::mesh<backend_type>> on_backend;
    for (const unit::small_mesh& m : meshes) on_backend.push_back(m.on(backend));
    std::vector<draw> draws;
    for (std::size_t i = 0; i < meshes.size(); ++i)
        draws.push_back({on_backend[i].view(), vp::passthrough{}, fragment_shaders[i]});
    std::vector<vp::counters> counts;
    constexpr std::size_t num_targets = Framebuffer::view_type::num_targets;
    for (int pass = 0; pass < 2; ++pass) {
        if (pass == 1) {
            vp::core::for_each_index<num_targets>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
            vp::get<num_targets - 1>(fb).off();
        }
        const vp::status s = vp::voxelize(backend, std::span<const draw>(draws), unit::unit_grid(extent), fb, options);
        s.or_throw();
        counts.push_back(s.counts);
    }
    return counts;
}

template <class... Targets, class... Ts>
void expect_same(const vp::core::pack<typename Targets::value_type...>& clear, const vp::core::pack<Ts...>& a,
                 const vp::core::pack<Ts...>& b) {
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(5, 60, extent), unit::make_mesh(6, 1, extent),
                                               unit::make_mesh(7, 60, extent)};
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin})
        for (const bool several_values : {false, true})
            for (const unsigned threads : unit::thread_numbers) {
                SCOPED_TRACE(testing::Message()
                             << (rule == vp::coverage::thin ? "thin" : "conservative") << ", "
                             << (several_values ? "two values" : "one value") << ", " << threads << " threads");
                backend_type backend = unit::make_backend(threads);
                using framebuffer = vp::framebuffer<backend_type, Targets...>;
                framebuffer constant_output(backend, extent), shaded(backend, extent);
                vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                    vp::get<I>(constant_output).clear(vp::get<I>(clear));
                    vp::get<I>(shaded).clear(vp::get<I>(clear));
                });
                const vp::voxelize_options options{rule};
                const auto one = draw_twice(backend, constant_output, meshes,
                                            shaders<vp::constant_output>(3, a, several_values ? b : a), options);
                const auto two =
                    draw_twice(backend, shaded, meshes, shaders<opaque>(3, a, several_values ? b : a), options);
                for (std::size_t pass = 0; pass < 2; ++pass) {
                    EXPECT_GT(one[pass].fragments, 1000u);
                    EXPECT_EQ(one[pass].fragments, two[pass].fragments);
                    EXPECT_EQ(one[pass].fragments_discarded, 0u);
                    EXPECT_EQ(one[pass].voxels, two[pass].voxels);
                    EXPECT_EQ(one[pass].triangles_drawn, two[pass].triangles_drawn);
                }
                vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                    EXPECT_TRUE(unit::same_bytes(vp::get<I>(constant_output).to_host(backend),
                                                 vp::get<I>(shaded).to_host(backend)))
                        << "target " << I;
                });
            }
}

TEST(ConstantShader, BitsOfEveryBlendAreAsShaded) {
    using vp::bit;
    expect_same<vp::target<bit, blend::bit_or>, vp::target<bit, blend::bit_and>,
                vp::target<bit, blend::replace, vp::layout::tiled>, vp::target<bit, blend::bit_xor>,
                vp::target<bit, blend::add_saturate>, vp::target<bit, blend::count>,
                vp::target<bit, blend::max, vp::layout::tiled>, vp::target<bit, blend::min>>(
        vp::core::make_pack(false, true, true, true, false, false, false, true),
        vp::core::make_pack(true, false, false, true, true, false, true, false),
        vp::core::make_pack(false, true, true, false, false, true, true, true));
}

TEST(ConstantShader, NumbersOfEveryBlendAreAsShaded) {
    using u8 = std::uint8_t;
    using i16 = std::int16_t;
    using u32 = std::uint32_t;
    expect_same<vp::target<u32, blend::add>, vp::target<u8, blend::add_saturate>, vp::target<i16, blend::add_saturate>,
                vp::target<u32, blend::bit_xor, vp::layout::tiled>, vp::target<i16, blend::min>,
                vp::target<u8, blend::count>, vp::target<u32, blend::replace>,
                vp::target<glm::ivec3, blend::max, vp::layout::planar>>(
        vp::core::make_pack(u32{5}, u8{200}, i16{100}, u32{9}, i16{7}, u8{250}, u32{1}, glm::ivec3(-1, 0, 1)),
        vp::core::make_pack(u32{0x40000001}, u8{9}, i16{-3000}, u32{6}, i16{-2}, u8{0}, u32{2}, glm::ivec3(3, -4, 0)),
        vp::core::make_pack(u32{0xffffffff}, u8{1}, i16{2999}, u32{5}, i16{20}, u8{7}, u32{3}, glm::ivec3(0, 1, 2)));
}

// The first pass of these needs no tiles on a GPU.
TEST(ConstantShader, NumbersThatOneAtomicBlendsAreAsShaded) {
    using u32 = std::uint32_t;
    using i64 = std::int64_t;
    expect_same<vp::target<vp::bit, blend::bit_xor>, vp::target<u32, blend::count>,
                vp::target<u32, blend::add, vp::layout::tiled>, vp::target<i64, blend::min>>(
        vp::core::make_pack(true, u32{0}, u32{9}, i64{100}), vp::core::make_pack(true, u32{0}, u32{3}, i64{-4}),
        vp::core::make_pack(false, u32{8}, u32{0xfffffff1}, i64{7}));
}

TEST(ConstantShader, FloatsAndStructsAreAsShaded) {
    // A GPU adds unordered terms in any order, so there the terms are chosen such that every sum is exact.
    constexpr bool any_order = !std::is_same_v<backend_type, vp::cpu_backend>;
    constexpr float small = any_order ? 0.125f : 1e-3f, large = any_order ? -7.0f : -7.1f;
    expect_same<vp::target<float, blend::add>, vp::target<vp::half, blend::add>, vp::target<double, blend::add>,
                vp::target<float, blend::add_unordered>, vp::target<float, blend::min>,
                vp::target<glm::vec3, blend::add, vp::layout::planar>, vp::target<float, blend::add_quantum<-10>>,
                ordered>(vp::core::make_pack(0.1f, vp::half(1.0f), -1e9, 3.5f, 7.0f, glm::vec3(1, 2, 3), -0.0f,
                                             ordered_value({1, 0, 0})),
                         vp::core::make_pack(0.3f, vp::half(0.1f), 0.7, small, -0.0f, glm::vec3(0.1f, -0.2f, 1e20f),
                                             0.3f, ordered_value({77, 1, 0})),
                         vp::core::make_pack(-0.7f, vp::half(3.0f), 1e300, large, 0.0f, glm::vec3(1e-20f, 4, -1e20f),
                                             -5.0f, ordered_value({5, 1, 9})));
}

TEST(ConstantShader, AbufferIsAsShaded) {
    const unit::small_mesh mesh = unit::make_mesh(8, 200, extent);
    backend_type backend = unit::make_backend();
    const auto on_backend = mesh.on(backend);
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
        vp::abuffer<backend_type, float> constant_output{backend}, shaded{backend};
        const unit::float_shader shader{2.5f, false};
        const auto one = vp::voxelize(backend, on_backend, unit::unit_grid(extent), vp::passthrough{},
                                      vp::constant(2.5f), constant_output, rule);
        const auto two =
            vp::voxelize(backend, on_backend, unit::unit_grid(extent), vp::passthrough{}, shader, shaded, rule);
        ASSERT_TRUE(one.ok() && two.ok());
        EXPECT_GT(one.counts.fragments, 1000u);
        EXPECT_EQ(one.counts.fragments, two.counts.fragments);
        EXPECT_EQ(one.counts.voxels, two.counts.voxels);
        const auto a = constant_output.to_host(backend), b = shaded.to_host(backend);
        EXPECT_EQ(a.voxels, b.voxels);
        EXPECT_EQ(a.offsets, b.offsets);
        EXPECT_EQ(a.primitives, b.primitives);
        EXPECT_EQ(a.payloads, b.payloads);
    }
}

} // namespace
