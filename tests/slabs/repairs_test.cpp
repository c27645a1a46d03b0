// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Solids of meshes with holes in a stream: with every repair all slabs together are one call with the whole mesh, with
// the same counts, into every kind of output.

#include "broken_scene.hpp"

namespace {

using namespace slab_scene;

using stream_type = slabs::stream<backend_type, vp::passthrough>;

// In chunks of 7 triangles.
void feed(stream_type& stream, const unit::small_mesh& mesh) {
    const auto& all = mesh.triangles;
    for (std::size_t first = 0; first < all.size(); first += 7)
        stream
            .add({mesh.positions,
                  vp::array_view<const glm::uvec3>(all.data() + first, std::min<std::size_t>(7, all.size() - first))})
            .or_throw();
}

// Compares a stream with one call. Returns the number of slabs.
int expect_stream(whole_solid& whole, const slabs::stream_options& how, const slabs::plan* plan = nullptr) {
    stream_type stream(whole.backend, whole.grid, {}, how);
    if (plan != nullptr) stream.cut_into(*plan);
    feed(stream, whole.mesh);
    const auto [slabs, voxels] = whole.expect_slabs(stream, whole.make());
    EXPECT_EQ(voxels, whole.num_voxels());
    return slabs;
}

// Every repair, with what goes with it.
std::vector<vp::solid_options> all_repairs() {
    std::vector<vp::solid_options> all;
    for (const auto of : {vp::bodies::call, vp::bodies::draw}) {
        for (const auto rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive})
            for (const auto inside : {vp::solid_extent::centre, vp::solid_extent::outer, vp::solid_extent::inner})
                all.push_back({.rule = rule, .bodies = of, .extent = inside, .repair = vp::repair::close_holes});
        all.push_back({.bodies = of, .repair = vp::repair::close_holes, .max_hole_edges = 3});
        all.push_back({.bodies = of, .extent = vp::solid_extent::outer, .repair = vp::repair::winding});
        all.push_back({.bodies = of, .repair = vp::repair::vote});
        for (const int closing : {0, 1, 4})
            all.push_back({.bodies = of, .repair = vp::repair::exterior, .closing = closing});
    }
    return all;
}
template <class F>
void for_all_repairs(F&& f) {
    for (const vp::solid_options& o : all_repairs()) {
        SCOPED_TRACE("repair " + std::to_string(static_cast<int>(o.repair)) + ", rule " +
                     std::to_string(static_cast<int>(o.rule)) + ", extent " +
                     std::to_string(static_cast<int>(o.extent)) + ", bodies " +
                     std::to_string(static_cast<int>(o.bodies)) + ", closing " + std::to_string(o.closing));
        f(o);
    }
}

TEST(RepairedStream, SlabsAreTheWhole) {
    std::uint64_t voxels = 0;
    for (const glm::ivec3& size : {glm::ivec3(37, 33, 42), glm::ivec3(65, 7, 11), glm::ivec3(5, 6, 7)})
        for_all_repairs([&](const vp::solid_options& o) {
            whole_solid whole{broken_scene(size), unit::unit_grid(size), o};
            voxels += whole.one.counts.voxels;
            for (int n = 1; n <= 7; ++n) {
                SCOPED_TRACE(n);
                EXPECT_EQ(expect_stream(whole, options_for(o, n)), n);
            }
        });
    EXPECT_GT(voxels, 100'000u);
}

// So little memory that bins, edges and walls go to disk, and slabs are cut again: those of a vote and of an exterior
// along z alone, others along y too.
TEST(RepairedStream, SlabsOfLittleMemoryAreTheWhole) {
    for_all_repairs([&](const vp::solid_options& o) {
        whole_solid whole{broken_scene(extent), unit::unit_grid(extent), o};
        EXPECT_GT(expect_stream(whole, options_for(o, 2, 60'000)), 4);
        slabs::stream_options aligned = options_for(o, 0, 90'000);
        aligned.align = 8;
        EXPECT_GT(expect_stream(whole, aligned), 3);
    });
}

TEST(RepairedStream, SlabsAlongY) {
    for_all_repairs([&](const vp::solid_options& o) {
        if (o.repair != vp::repair::close_holes) return;
        whole_solid whole{broken_scene(extent), unit::unit_grid(extent), o};
        const slabs::plan along_y = slabs::equal_layers(whole.grid, 1, 5);
        EXPECT_EQ(expect_stream(whole, options_for(o, 1), &along_y), 5);
    });
}

TEST(RepairedStream, OfACropIsTheCrop) {
    for_all_repairs([&](const vp::solid_options& o) {
        if (o.repair == vp::repair::exterior) return;
        whole_solid whole{broken_scene(extent), unit::unit_grid(extent).crop({3, 5, 9}, {30, 21, 22}), o};
        for (const int n : {1, 3, 5}) EXPECT_EQ(expect_stream(whole, options_for(o, n)), n);
        EXPECT_GT(expect_stream(whole, options_for(o, 1, 60'000)), 2);
    });
}

TEST(RepairedStream, OfPlatesThatColumnsDecide) {
    for (const auto kind : {vp::repair::vote, vp::repair::exterior, vp::repair::close_holes}) {
        whole_solid whole{plates(extent), unit::unit_grid(extent), {.repair = kind}};
        for (int n = 1; n <= 42; n += n < 7 ? 1 : 7) (void)expect_stream(whole, options_for(whole.how, n));
    }
}

TEST(RepairedStream, SlabsOfListsFollowEachOther) {
    struct payload {
        auto operator()(const vp::solid_fragment& f) const {
            return vp::outputs(static_cast<std::uint32_t>(f.voxel.x + 64 * f.voxel.y + 4096 * f.voxel.z))
                .discard_if((f.voxel.x + f.voxel.z) % 5 == 0);
        }
    };
    using lists = vp::abuffer<backend_type, std::uint32_t>;
    const unit::small_mesh mesh = broken_scene(extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend(2);
    for_all_repairs([&](const vp::solid_options& o) {
        lists whole{backend};
        const vp::status one = vp::voxelize_solid(backend, mesh.view(), grid, vp::passthrough{}, payload{}, whole, o);
        ASSERT_TRUE(one.ok()) << one.message();
        stream_type stream(backend, grid, {}, options_for(o, 3, 120'000));
        feed(stream, mesh);
        vp::host_abuffer<std::uint32_t> all;
        const vp::status s = stream.draw_solid(
            payload{}, [&](glm::ivec3) { return lists{backend}; },
            [&](const slabs::slab& slab, const lists& part) {
                EXPECT_EQ(slab.voxels_before, all.voxels.size());
                slabs::append(all, grid, slab, part.to_host(backend));
            },
            o);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts, one.counts);
        EXPECT_EQ(s.solid, one.solid);
        expect_equal(all, whole.to_host(backend));
    });
}

// A constant gives bricks and tiles, which merge() joins over the borders of slabs.
TEST(RepairedStream, SlabsOfSparseFramebuffersMerge) {
    using bits = vp::sparse_framebuffer<backend_type, vp::target<vp::bit, vp::blend::bit_or>>;
    using host_bits = typename host_of<bits>::type;
    const unit::small_mesh mesh = broken_scene(extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend(2);
    for_all_repairs([&](const vp::solid_options& o) {
        bits whole{backend, extent};
        const vp::status one =
            vp::voxelize_solid(backend, mesh.view(), grid, vp::passthrough{}, vp::constant(true), whole, o);
        ASSERT_TRUE(one.ok()) << one.message();
        for (const int n : {1, 5}) {
            stream_type stream(backend, grid, {}, options_for(o, n));
            feed(stream, mesh);
            std::vector<host_bits> parts;
            const vp::status s = stream.draw_solid(
                vp::constant(true),
                [&](glm::ivec3 size) {
                    return bits{backend, size};
                },
                [&](const slabs::slab&, const bits& part) { parts.push_back(part.to_host(backend)); }, o);
            EXPECT_TRUE(s.ok()) << s.message();
            EXPECT_EQ(s.counts, one.counts);
            EXPECT_EQ(s.solid, one.solid);
            EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const host_bits>(parts)), whole.to_host(backend)));
        }
    });
}

TEST(RepairedStream, ASlabThatRunsOutOfMemoryIsCutAgain) {
    for (const auto kind : {vp::repair::close_holes, vp::repair::vote, vp::repair::exterior, vp::repair::winding}) {
        whole_solid whole{broken_scene(extent), unit::unit_grid(extent), {.repair = kind}};
        stream_type stream(whole.backend, whole.grid, {}, options_for(whole.how, 2));
        feed(stream, whole.mesh);
        int refused = 0;
        const auto [slabs, voxels] = whole.expect_slabs(stream, [&](const glm::ivec3& size) {
            if (size.z > 6 && ++refused != 0) throw std::bad_alloc();
            return solid_targets{whole.backend, size};
        });
        EXPECT_GT(refused, 2);
        EXPECT_GT(slabs, 6);
        EXPECT_EQ(voxels, whole.num_voxels());
    }
}

// Voxels may be inside where no triangle is: between walls that `closing` joins, and at lids, where slabs are cut along
// z and then along y.
TEST(RepairedStream, SlabsThatNoTriangleReachesAreFilled) {
    const auto add_tube = [](unit::small_mesh& m, float low, float high) {
        for (const float x : {4.5f, 30.5f}) add_quad(m, {x, 4, low}, {x, 28, low}, {x, 28, high}, {x, 4, high});
        for (const float y : {4.5f, 27.5f}) add_quad(m, {4, y, low}, {31, y, low}, {31, y, high}, {4, y, high});
    };
    unit::small_mesh gap;
    add_tube(gap, 3, 19.5f);
    add_tube(gap, 21.5f, 38);
    for (const float z : {3.5f, 37.5f}) add_quad(gap, {4, 4, z}, {31, 4, z}, {31, 28, z}, {4, 28, z});
    whole_solid flooded{gap, unit::unit_grid(extent), {.repair = vp::repair::exterior, .closing = 2}};
    EXPECT_NE(flooded.expected(17, 16, 20), 0);
    EXPECT_EQ(expect_stream(flooded, options_for(flooded.how, 42)), 42);

    unit::small_mesh tube; // along x
    for (const float y : {4.5f, 27.5f}) add_quad(tube, {4, y, 3}, {31, y, 3}, {31, y, 38}, {4, y, 38});
    for (const float z : {3.0f, 38.0f}) add_quad(tube, {4, 4.5f, z}, {31, 4.5f, z}, {31, 27.5f, z}, {4, 27.5f, z});
    whole_solid lids{
        tube, unit::unit_grid(extent), {.rule = vp::fill_rule::even_odd, .repair = vp::repair::close_holes}};
    EXPECT_EQ(lids.one.solid.open_rows, 0u);
    EXPECT_GT(lids.one.counts.voxels, 10'000u);
    stream_type stream(lids.backend, lids.grid, {}, options_for(lids.how, 3));
    feed(stream, tube);
    std::uint64_t without = 0;
    const vp::status s = stream.draw_solid(
        winding{},
        [&](glm::ivec3 size) {
            if (size.z > 1 || size.y > 5) throw std::bad_alloc();
            return solid_targets{lids.backend, size};
        },
        [&](const slabs::slab& slab, const solid_targets&) {
            const glm::ivec3 o = slab.where.offset;
            if (o.y > 6 && o.y < 20 && o.z > 6 && o.z < 30) without += slab.drawn.counts.voxels;
        },
        lids.how);
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, lids.one.counts);
    EXPECT_EQ(s.solid, lids.one.solid);
    EXPECT_GT(without, 1000u);
}

TEST(RepairedStream, WithoutTrianglesGivesClearedSlabs) {
    for (const auto kind : {vp::repair::close_holes, vp::repair::vote, vp::repair::exterior}) {
        whole_solid whole{{}, unit::unit_grid(extent), {.repair = kind}};
        EXPECT_EQ(expect_stream(whole, options_for(whole.how, 3)), 3);
    }
}

// A bad index ends a chunk; what came before it stays, for the repair too.
TEST(RepairedStream, ABadIndexLeavesWhatCameBefore) {
    for (const auto kind : {vp::repair::close_holes, vp::repair::vote, vp::repair::exterior}) {
        unit::small_mesh bad = broken_scene(extent);
        const std::size_t good = bad.triangles.size() / 2;
        whole_solid whole{bad, unit::unit_grid(extent), {.repair = kind}};
        whole.mesh.triangles.resize(good);
        whole.one = vp::voxelize_solid(whole.backend, whole.mesh.view(), whole.grid, vp::passthrough{}, winding{},
                                       whole.whole, whole.how);
        bad.triangles[good].y = 1'000'000;
        stream_type stream(whole.backend, whole.grid, {}, options_for(whole.how, 3));
        const vp::status failed = stream.add(bad.view());
        EXPECT_EQ(failed.code, vp::status_code::index_out_of_range);
        EXPECT_EQ(failed.triangle, good);
        std::uint64_t sum = 0, expected = 0;
        const auto add = [&](std::uint64_t& to, const solid_targets& fb) {
            for (const std::int32_t v : vp::get<0>(fb).to_host(whole.backend)) to += static_cast<std::uint32_t>(v);
        };
        const vp::status s = stream.draw_solid(
            winding{},
            [&](glm::ivec3 size) {
                return solid_targets{whole.backend, size};
            },
            [&](const slabs::slab&, const solid_targets& fb) { add(sum, fb); }, whole.how);
        add(expected, whole.whole);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(sum, expected);
        EXPECT_EQ(s.counts.voxels, whole.one.counts.voxels);
        EXPECT_EQ(s.solid, whole.one.solid);
    }
}

TEST(RepairedStream, SaysWhatIsWrong) {
    backend_type backend;
    const vp::grid grid = unit::unit_grid(extent);
    const auto code = [&](const vp::grid& g, const slabs::stream_options& how, const vp::solid_options& o,
                          int axis = 2) {
        stream_type stream(backend, g, {}, how);
        stream.cut_into(slabs::equal_layers(g, axis, 3));
        return stream
            .draw_solid(
                winding{},
                [&](glm::ivec3 size) {
                    return solid_targets{backend, size};
                },
                [](const slabs::slab&, const solid_targets&) {}, o)
            .code;
    };
    using vp::status_code;
    const vp::solid_options vote{.repair = vp::repair::vote}, flood{.repair = vp::repair::exterior},
        close{.repair = vp::repair::close_holes};
    EXPECT_EQ(code(grid, options_for(vote, 1), vote), status_code::ok);
    EXPECT_EQ(code(grid, options_for({}, 1), vote), status_code::bad_solid_options) << "the stream was told of none";
    EXPECT_EQ(code(grid, options_for(vote, 1), {}), status_code::bad_solid_options);
    EXPECT_EQ(code(grid, options_for(vote, 1), flood), status_code::bad_solid_options);
    EXPECT_EQ(code(grid, options_for(vote, 1), vote, 1), status_code::bad_solid_options) << "along y";
    EXPECT_EQ(code(grid, options_for(flood, 1), flood, 1), status_code::bad_solid_options);
    EXPECT_EQ(code(grid, options_for(close, 1), close, 1), status_code::ok);
    EXPECT_EQ(code(grid, options_for(close, 1), close, 0), status_code::bad_solid_options) << "along x";
    EXPECT_EQ(code(grid.crop({0, 0, 1}, {9, 9, 9}), options_for(flood, 1), flood), status_code::crop_without_whole);
    const std::uint64_t word = 0;
    vp::solid_slab bits;
    bits.inside = &word;
    vp::solid_options given = flood;
    given.slab = &bits;
    EXPECT_EQ(code(grid, options_for(flood, 1), given), status_code::bad_solid_options);
    const vp::core::hole_cones cones;
    given = close;
    given.cones = &cones;
    EXPECT_EQ(code(grid, options_for(close, 1), given), status_code::bad_solid_options);
    given = flood;
    given.closing = 65;
    EXPECT_EQ(code(grid, options_for(flood, 1), given), status_code::bad_solid_options);
    // A repair makes the stream one of solids.
    slabs::stream_options how = options_for(vote, 1);
    how.is_solid = false;
    EXPECT_EQ(code(grid, how, vote), status_code::ok);
}

} // namespace
