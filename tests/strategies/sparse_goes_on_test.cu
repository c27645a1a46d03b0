// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Calls in memory of the caller that go on from what an earlier one left: the bytes that a sparse framebuffer has after
// the same calls, and what they go on from is only read.

#include "async_lists.hpp"
#include "device_test.hpp"
#include "sparse_pairs.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using namespace sparse_pairs;

// What a call does with target I, of a sparse framebuffer or of a sparse_result.
template <class Result, std::size_t I>
struct target_of_result {
    Result& result;
    void load() const { result.loads[I] = vp::load_operation::load; }
    void off() const { result.loads[I] = vp::load_operation::off; }
    using value_type = std::remove_cvref_t<decltype(vp::get<I>(std::declval<Result&>().clear_values))>;
    void clear(const value_type& value) const {
        result.loads[I] = vp::load_operation::clear;
        vp::get<I>(result.clear_values) = value;
    }
};
template <std::size_t I, class... Targets>
auto target(vp::sparse_result<Targets...>& result) {
    return target_of_result<vp::sparse_result<Targets...>, I>{result};
}
template <std::size_t I, class Backend, class... Targets>
auto target(vp::sparse_framebuffer<Backend, Targets...>& fb) {
    return vp::get<I>(fb);
}
template <std::size_t Targets>
constexpr auto load_all =
    [](auto& to) { vp::core::for_each_index<Targets>([&]<std::size_t I>() { target<I>(to).load(); }); };

// Calls one after another, each with memory of its own, and each at first with too little of it.
template <class Pair>
class sequence {
public:
    using result_type = typename result_of<std::remove_cvref_t<decltype(std::declval<Pair&>().on_device)>>::type;
    Pair p;
    result_type result;

    explicit sequence(const glm::ivec3& extent) : p(extent) {}

    template <class Prepare, class Shader>
    void draw(const std::vector<unit::small_mesh>& meshes, const vp::grid& g, vp::coverage rule, const char* what,
              const Prepare& prepare, const Shader& shade) {
        SCOPED_TRACE(what);
        step(
            meshes, shade, prepare,
            [&](const auto& draws, const vp::workspace_limits& limits) {
                return vp::workspace_bytes(draws, g, result, {rule}, limits);
            },
            [&](const auto& draws, const vp::workspace_view& workspace) {
                return vp::voxelize_async(p.device, draws, g, result, {rule}, workspace);
            },
            [&](const auto& draws) { return vp::voxelize(p.host, draws, g, p.on_host, {rule}); });
    }
    template <class Prepare, class Shader>
    void draw_solid(const std::vector<unit::small_mesh>& meshes, const vp::grid& g, const vp::solid_options& o,
                    const char* what, const Prepare& prepare, const Shader& shade) {
        SCOPED_TRACE(what);
        step(
            meshes, shade, prepare,
            [&](const auto& draws, const vp::workspace_limits& limits) {
                return vp::solid_workspace_bytes(draws, g, result, o, limits);
            },
            [&](const auto& draws, const vp::workspace_view& workspace) {
                return vp::voxelize_solid_async(p.device, draws, g, result, o, workspace);
            },
            [&](const auto& draws) { return vp::voxelize_solid(p.host, draws, g, p.on_host, o); });
    }
    // The next call goes on from this sparse framebuffer, whose contents p.on_host has.
    void start_with_framebuffer() { is_from_framebuffer_ = true; }

private:
    template <class Shader, class Prepare, class Bytes, class Call, class Expected>
    void step(const std::vector<unit::small_mesh>& meshes, const Shader& shade, const Prepare& prepare,
              const Bytes& bytes_of, const Call& call, const Expected& expected) {
        using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
        vp::cuda_backend& be = p.device;
        std::vector<vp::mesh<vp::cuda_backend>> owners;
        std::vector<draw_type> there, here;
        owners.reserve(meshes.size());
        for (const auto& m : meshes) {
            owners.emplace_back(be, m.positions, m.triangles);
            there.push_back({owners.back().view(), {}, shade});
            here.push_back({m.view(), {}, shade});
        }
        const std::span<const draw_type> draws(there);
        if (is_from_framebuffer_)
            result.load(p.on_device);
        else
            result.load(result_type(result));
        is_from_framebuffer_ = false;
        load_all<result_type::num_targets>(p.on_host);
        prepare(result);
        prepare(p.on_host);
        const result_type earlier = earlier_;
        const auto before = earlier.to_host(be);
        vp::workspace_limits limits{}, need{};
        limits.bricks = 1;
        for (int tries = 0;; ++tries) {
            ASSERT_LT(tries, 8);
            const std::size_t bytes = bytes_of(draws, limits);
            ASSERT_GT(bytes, 0u);
            auto memory = std::make_unique<device_test::guarded_memory>(be, bytes);
            ASSERT_EQ(cudaMemsetAsync(const_cast<unsigned char*>(memory->memory.data()), 0xa5, bytes, be.stream),
                      cudaSuccess);
            const vp::workspace_view workspace{const_cast<unsigned char*>(memory->memory.data()), bytes, limits};
            EXPECT_EQ(call(draws, {workspace.memory, bytes - 1, limits}).required.bytes, bytes);
            ASSERT_TRUE(call(draws, workspace).ok());
            const vp::status s = vp::read_status(be, workspace, &need);
            memory->expect_untouched_behind(be);
            EXPECT_TRUE(vp::same_contents(earlier.to_host(be), before));
            if (s.ok()) {
                const vp::status t = expected(std::span<const draw_type>(here));
                ASSERT_TRUE(t.ok()) << t.message();
                EXPECT_EQ(s.counts, t.counts);
                EXPECT_EQ(s.solid, t.solid);
                compare(limits);
                earlier_ = result;
                memories_.push_back(std::move(memory));
                return;
            }
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
            const auto nothing = result.to_host(be);
            EXPECT_EQ(nothing.num_bricks(), 0u);
            EXPECT_EQ(nothing.num_tiles(), 0u);
            EXPECT_EQ(nothing.num_voxels(), 0u);
            limits = need;
        }
    }
    void compare(const vp::workspace_limits& limits) {
        const auto a = result.to_host(p.device);
        const auto b = p.on_host.to_host(p.host);
        // Bricks and tiles may have been counted before all bricks had been taken out of tiles.
        EXPECT_GE(limits.bricks, p.on_host.num_bricks() + p.on_host.num_tiles());
        EXPECT_EQ(limits.voxels, p.on_host.num_values());
        EXPECT_EQ(a.keys, b.keys);
        EXPECT_TRUE(a.masks == b.masks);
        EXPECT_EQ(a.offsets, b.offsets);
        EXPECT_EQ(a.tiles, b.tiles);
        vp::core::for_each_index<result_type::num_targets>([&]<std::size_t I>() {
            EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.values), vp::get<I>(b.values))) << "target " << I;
            EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.sums), vp::get<I>(b.sums))) << "sums of " << I;
            EXPECT_TRUE(vp::get<I>(a.clear_values) == vp::get<I>(b.clear_values)) << "target " << I;
        });
    }

    result_type earlier_;
    bool is_from_framebuffer_ = false;
    std::vector<std::unique_ptr<device_test::guarded_memory>> memories_; // what results refer to
};

// All targets load.
const auto as_it_is = [](auto&) {};
const auto clear_all = [](auto& to) {
    target<0>(to).clear(false);
    target<1>(to).clear(9u);
    target<2>(to).clear(0.75f);
    target<3>(to).clear({-1.5, 2});
    target<4>(to).clear(3);
    target<5>(to).clear(vp::half(0.5f));
    target<6>(to).clear(1u << 20);
    target<7>(to).clear({});
};
const auto mix = [](auto& to) {
    target<2>(to).off();
    target<1>(to).clear(7u);
    target<0>(to).clear(true);
    target<3>(to).clear({2.5, -1.0});
};
const auto clear_constants = [](auto& to) {
    target<0>(to).clear(false);
    target<1>(to).clear(true);
    target<2>(to).clear(0.7f);
    target<3>(to).clear(4u);
    target<4>(to).off();
    target<5>(to).clear(-9);
    target<6>(to).clear(1u << 20);
};

} // namespace

TEST(DeviceSparseGoesOn, EveryBlendHasTheBytesOfTheCpu) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid whole = unit::unit_grid(extent);
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(1, 25, extent), unit::make_mesh(2, 15, extent)};
    const std::vector<unit::small_mesh> more{unit::make_mesh(3, 20, extent)};
    for (const vp::grid& g : {whole, whole.crop({13, 5, 3}, {31, 25, 32})}) {
        sequence<pair> c(g.extent);
        c.draw(meshes, g, vp::coverage::thin, "cleared", clear_all, shader{});
        EXPECT_GT(c.p.on_host.num_voxels(), 300u);
        c.draw(more, g, vp::coverage::conservative, "loaded", as_it_is, shader{});
        c.draw(meshes, g, vp::coverage::crosshair, "cleared, loaded, off", mix, shader{});
        c.draw(
            {}, g, vp::coverage::thin, "no draws", [](auto& to) { target<4>(to).clear(5); }, shader{});
        c.draw_solid(more, g, {.bodies = vp::bodies::draw}, "a solid", as_it_is, solid_shader{});
        c.draw({}, g, vp::coverage::thin, "nothing stays", clear_all, shader{});
        EXPECT_EQ(c.p.on_host.num_voxels(), 0u);
    }
}

TEST(DeviceSparseGoesOn, ConstantsHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{61, 50, 53};
    struct {
        vp::grid where;
        glm::vec3 by; // the meshes are moved
    } const grids[]{{unit::unit_grid(extent), glm::vec3(0)},
                    {unit::unit_grid(glm::ivec3(4096)), glm::vec3(3690, 1900, 250)},
                    {unit::unit_grid(glm::ivec3(1 << 17)), glm::vec3(130000, 1900, 65500)}};
    for (const auto& [g, by] : grids) {
        std::vector<unit::small_mesh> meshes{unit::make_mesh(11, 40, extent), unit::make_mesh(12, 25, extent)};
        for (unit::small_mesh& m : meshes)
            for (glm::vec3& q : m.positions) q += by;
        sequence<constant_pair> c(g.extent);
        c.draw({meshes[0]}, g, vp::coverage::conservative, "cleared", clear_constants, constant_shader);
        EXPECT_GT(c.p.on_host.num_voxels(), 300u);
        c.draw({meshes[1]}, g, vp::coverage::thin, "loaded", as_it_is, constant_shader);
    }
}

// Sums that are kept, from the first call on or from a later one, have the bytes of the CPU's, until they are kept no
// longer.
TEST(DeviceSparseGoesOn, KeptSumsHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid whole = unit::unit_grid(extent);
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(1, 25, extent), unit::make_mesh(2, 15, extent)};
    const std::vector<unit::small_mesh> more{unit::make_mesh(3, 20, extent)};
    const auto keep = [](bool keeps) {
        return [keeps](auto& to) {
            to.template keep_sums<2>(keeps);
            to.template keep_sums<3>(keeps);
            to.template keep_sums<4>(keeps);
        };
    };
    for (const vp::grid& g : {whole, whole.crop({13, 5, 3}, {31, 25, 32})}) {
        sequence<pair> c(g.extent);
        const auto num_sums = [&] { return vp::get<3>(c.result.to_host(c.p.device).sums).size(); };
        c.draw(
            meshes, g, vp::coverage::thin, "cleared, sums kept",
            [&](auto& to) {
                clear_all(to);
                keep(true)(to);
            },
            shader{});
        EXPECT_GT(num_sums(), 300u);
        c.draw(more, g, vp::coverage::conservative, "loaded, sums kept", as_it_is, shader{});
        c.draw(meshes, g, vp::coverage::crosshair, "cleared, loaded, off, sums kept", mix, shader{});
        c.draw({}, g, vp::coverage::thin, "no draws, sums kept", as_it_is, shader{});
        EXPECT_GT(num_sums(), 300u);
        c.draw_solid(more, g, {.bodies = vp::bodies::draw}, "a solid, sums kept", as_it_is, solid_shader{});
        c.draw(more, g, vp::coverage::thin, "loaded, no sums", keep(false), shader{});
        EXPECT_EQ(num_sums(), 0u);
        c.draw(more, g, vp::coverage::thin, "loaded, sums again", keep(true), shader{});
        EXPECT_GT(num_sums(), 300u);
    }
}

// A constant, whose values would follow from masks, or from the rows of a solid, if no sums were kept.
TEST(DeviceSparseGoesOn, KeptSumsOfConstantsHaveTheBytesOfTheCpu) {
    const glm::ivec3 extent{67, 40, 36};
    const vp::grid g = unit::unit_grid(extent);
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(11, 40, extent), unit::make_mesh(12, 25, extent)};
    unit::small_mesh box;
    add_box(box, {2.5f, 3, 0}, {66, 39, 34.7f});
    const auto keep = [](auto& to) { to.template keep_sums<2>(); };
    const auto clear_and_keep = [&](auto& to) {
        clear_constants(to);
        keep(to);
    };
    sequence<constant_pair> c(extent);
    c.draw({meshes[0]}, g, vp::coverage::conservative, "cleared, sums kept", clear_and_keep, constant_shader);
    c.draw({meshes[1]}, g, vp::coverage::thin, "loaded, sums kept", as_it_is, constant_shader);
    EXPECT_GT(vp::get<2>(c.result.to_host(c.p.device).sums).size(), 300u);
    sequence<constant_pair> d(extent);
    d.draw_solid({box}, g, {}, "a solid, sums kept", clear_and_keep, constant_shader);
    EXPECT_EQ(d.p.on_host.num_tiles(), 0u);
    // Tiles that a call goes on from have sums of their own.
    sequence<constant_pair> e(extent);
    e.draw_solid({box}, g, {}, "a solid in tiles", clear_constants, constant_shader);
    e.draw({meshes[1]}, g, vp::coverage::thin, "a surface on tiles, sums kept", keep, constant_shader);
    EXPECT_GT(e.p.on_host.num_tiles(), 0u);
    e.draw(
        {}, g, vp::coverage::thin, "no draws, sums kept", [](auto& to) { target<2>(to).clear(1.5f); }, constant_shader);
    EXPECT_GT(e.p.on_host.num_tiles(), 0u);
}

// A sparse framebuffer with tiles is what the first call goes on from.
TEST(DeviceSparseGoesOn, TilesStayAsTheCpus) {
    const glm::ivec3 extent{67, 40, 36};
    const vp::grid g = unit::unit_grid(extent);
    unit::small_mesh boxes, small;
    add_box(boxes, {2.5f, 3, 0}, {66, 39, 34.7f});
    add_box(boxes, {40, 20, 20}, {47, 27, 31});
    add_box(small, {30, 18, 20}, {39, 27, 24});
    sequence<constant_pair> c(extent);
    c.p.draw_solid({boxes}, g, {.rule = vp::fill_rule::even_odd}, "a solid", constant_shader);
    EXPECT_GT(c.p.on_host.num_tiles(), 5u);
    c.start_with_framebuffer();
    c.draw(
        {unit::make_mesh(13, 3, extent)}, g, vp::coverage::thin, "a surface on tiles",
        [](auto& to) {
            load_all<7>(to);
            target<2>(to).clear(1.5f);
            target<0>(to).off();
        },
        constant_shader);
    EXPECT_GT(c.p.on_host.num_tiles(), 0u);
    c.draw_solid({small}, g, {}, "a solid on tiles", as_it_is, constant_shader);
    EXPECT_GT(c.p.on_host.num_tiles(), 0u);
    c.draw(
        {}, g, vp::coverage::thin, "no draws", [](auto& to) { target<5>(to).clear(2); }, constant_shader);
    EXPECT_GT(c.p.on_host.num_tiles(), 0u);
}

// Tiles of calls in memory of the caller: closed boxes, an open mesh whose rows reach the end of the grid, several
// bodies, every extent, crops, small grids, grids with groups of nodes; and calls that go on from them.
TEST(DeviceSparseGoesOn, SolidsOfOneValueMakeTheTilesOfTheCpu) {
    const glm::ivec3 extent{67, 40, 36};
    const vp::grid g = unit::unit_grid(extent);
    std::vector<unit::small_mesh> meshes(2);
    add_box(meshes[0], {2.5f, 3, 0}, {66, 39, 34.7f});
    add_box(meshes[0], {40, 20, 20}, {47, 27, 31});
    add_box(meshes[1], {50.2f, -5, 9}, {140, 20, 90});
    meshes.push_back(unit::make_mesh(6, 4, extent));
    for (const vp::solid_options& o :
         {vp::solid_options{.rule = vp::fill_rule::even_odd}, vp::solid_options{.extent = vp::solid_extent::outer},
          vp::solid_options{.rule = vp::fill_rule::positive, .extent = vp::solid_extent::inner}}) {
        sequence<constant_pair> c(extent);
        c.draw_solid(meshes, g, o, "one body", clear_constants, constant_shader);
        EXPECT_GT(c.p.on_host.num_tiles(), 5u);
        c.draw({unit::make_mesh(13, 3, extent)}, g, vp::coverage::thin, "a surface on tiles", as_it_is,
               constant_shader);
        EXPECT_GT(c.p.on_host.num_tiles(), 0u);
    }
    sequence<constant_pair> d(extent);
    d.draw_solid({meshes[0]}, g, vp::each_draw, "a draw", clear_constants, constant_shader);
    EXPECT_GT(d.p.on_host.num_tiles(), 5u);
    sequence<constant_pair> e(extent);
    e.draw_solid(meshes, g, vp::each_draw, "counts of bodies", clear_constants, constant_shader);
    EXPECT_EQ(e.p.on_host.num_tiles(), 0u);

    const vp::grid part = g.crop({11, 5, 3}, {50, 34, 30});
    sequence<constant_pair> q(part.extent);
    q.draw_solid(meshes, part, {.extent = vp::solid_extent::outer}, "a crop", clear_constants, constant_shader);
    EXPECT_GT(q.p.on_host.num_tiles(), 0u);
    const vp::grid flat = unit::unit_grid({67, 40, 7});
    sequence<constant_pair> f(flat.extent);
    f.draw_solid(meshes, flat, {}, "lower than a brick", clear_constants, constant_shader);
    EXPECT_EQ(f.p.on_host.num_tiles(), 0u);
    for (unit::small_mesh& m : meshes)
        for (glm::vec3& v : m.positions) v += glm::vec3(1000000, 1900, 65500);
    const vp::grid far = unit::unit_grid(glm::ivec3(1 << 20)).crop({1000003, 1901, 65504}, {60, 36, 30});
    sequence<constant_pair> r(far.extent);
    r.draw_solid(meshes, far, {}, "far away", clear_constants, constant_shader);
    EXPECT_GT(r.p.on_host.num_tiles(), 0u);
    // More than two levels of tiles, if not a large one.
    const vp::grid longer = unit::unit_grid({140, 18, 17});
    unit::small_mesh box;
    add_box(box, {-3, -3, -3}, {139.5f, 17.5f, 40});
    sequence<constant_pair> l(longer.extent);
    l.draw_solid({box}, longer, {}, "a long box", clear_constants, constant_shader);
    EXPECT_GT(l.p.on_host.num_tiles(), 5u);
}

// A large tile, in a grid that has more than two levels of them.
TEST(DeviceSparseGoesOn, ALargeSolidMakesTheTilesOfTheCpu) {
    const vp::grid large = unit::unit_grid({140, 140, 140});
    unit::small_mesh box;
    add_box(box, {-3, -3, -3}, {139.5f, 139.5f, 139.5f});
    sequence<constant_pair> b(large.extent);
    b.draw_solid({box}, large, {}, "a large box", clear_constants, constant_shader);
    EXPECT_GT(b.p.on_host.num_voxels(), 2600000u);
    EXPECT_LT(b.p.on_host.num_values(), 300000u);
}

// Two calls in one graph, which is replayed with moved vertices: the second one goes on from the first. Both keep sums.
TEST(DeviceSparseGoesOn, AGraphHoldsCallsThatGoOn) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid g = unit::unit_grid(extent);
    const unit::small_mesh mesh = unit::make_mesh(1, 25, extent), more = unit::make_mesh(3, 20, extent);
    const device_test::stream_owner stream;
    vp::cuda_backend be{stream.stream};
    pair p(extent);
    const vp::mesh<vp::cuda_backend> a(be, mesh.positions, mesh.triangles), b(be, more.positions, more.triangles);
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, shader>;
    const draw_type first{a.view(), {}, shader{}}, second{b.view(), {}, shader{}};
    const std::span<const draw_type> firsts(&first, 1), seconds(&second, 1);
    const auto expect_same = [](const auto& a, const auto& b) {
        EXPECT_TRUE(vp::same_contents(a, b));
        EXPECT_TRUE(unit::same_bytes(vp::get<2>(a.sums), vp::get<2>(b.sums)));
        EXPECT_TRUE(unit::same_bytes(vp::get<3>(a.sums), vp::get<3>(b.sums)));
        EXPECT_GT(vp::get<2>(a.sums).size(), 300u);
    };
    vp::workspace_limits limits{};
    limits.bricks = 400;
    limits.voxels = 60000;
    limits.fragments = 120000;
    limits.fragment_records = 20000;
    result_of<framebuffer<vp::cuda_backend>>::type result, joined;
    clear_all(result);
    result.keep_sums<2>();
    joined.keep_sums<2>();
    joined.keep_sums<3>();
    const std::size_t bytes = vp::workspace_bytes(firsts, g, result, {}, limits);
    // The second call needs more, which follows from what it goes on from.
    const vp::cuda_backend::buffer<std::byte> memory(be, bytes), other(be, 2 * bytes);
    const vp::workspace_view w{const_cast<std::byte*>(memory.data()), bytes, limits},
        v{const_cast<std::byte*>(other.data()), 2 * bytes, limits};
    const device_test::captured_graph graph(be.stream, [&] {
        const vp::status s = vp::voxelize_async(be, firsts, g, result, {}, w);
        joined.load(result);
        return s.ok() ? vp::voxelize_async(be, seconds, g, joined, {}, v) : s;
    });
    for (const glm::vec3& by : {glm::vec3(3, -2, 1), glm::vec3(0)}) {
        const unit::small_mesh moved = sparse_pairs::move_mesh(be, a, mesh, by);
        graph.launch(be.stream);
        ASSERT_TRUE(vp::read_status(be, w).ok());
        ASSERT_TRUE(vp::read_status(be, v).ok());
        p.on_host = framebuffer<vp::cpu_backend>(p.host, extent);
        clear_all(p.on_host);
        p.on_host.keep_sums<2>();
        ASSERT_TRUE(vp::voxelize(p.host, moved.view(), g, vp::passthrough{}, shader{}, p.on_host).ok());
        expect_same(result.to_host(be), p.on_host.to_host(p.host));
        load_all<8>(p.on_host);
        p.on_host.keep_sums<3>();
        ASSERT_TRUE(vp::voxelize(p.host, more.view(), g, vp::passthrough{}, shader{}, p.on_host).ok());
        expect_same(joined.to_host(be), p.on_host.to_host(p.host));
    }
}

TEST(DeviceSparseGoesOn, AnotherGridOrNoValuesAreRefused) {
    const glm::ivec3 extent{40, 40, 40};
    const vp::grid g = unit::unit_grid(extent);
    pair p(extent);
    p.draw({unit::make_mesh(1, 9, extent)}, g, vp::coverage::thin, "drawn");
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, shader>;
    const std::span<const draw_type> none;
    result_of<framebuffer<vp::cuda_backend>>::type result;
    result.load(p.on_device);
    vp::workspace_limits limits{};
    limits.bricks = 200;
    limits.voxels = 20000;
    EXPECT_GT(vp::workspace_bytes(none, g, result, {}, limits), 0u);
    const vp::grid part = unit::unit_grid({48, 40, 40}).crop({8, 0, 0}, extent);
    EXPECT_EQ(vp::workspace_bytes(none, part, result, {}, limits), 0u);
    EXPECT_EQ(vp::voxelize_async(p.device, none, part, result, {}, {nullptr, 0, limits}).code,
              vp::status_code::extent_mismatch);
    vp::workspace_limits huge = limits;
    huge.voxels = std::uint64_t{1} << 33; // ranks of what stays have 32 bits
    EXPECT_EQ(vp::voxelize_async(p.device, none, g, result, {}, {nullptr, 0, huge}).code,
              vp::status_code::size_overflow);
    vp::get<3>(result.start.view.values) = nullptr;
    EXPECT_EQ(vp::voxelize_async(p.device, none, g, result, {}, {nullptr, 0, limits}).code, vp::status_code::null_view);
    result.loads[3] = vp::load_operation::clear;
    EXPECT_EQ(vp::voxelize_async(p.device, none, g, result, {}, {nullptr, 0, limits}).code,
              vp::status_code::capacity_exceeded);
}
