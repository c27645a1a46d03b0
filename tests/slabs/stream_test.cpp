// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A stream's slabs together are one call with the whole mesh: framebuffers, A-buffers, sparse framebuffers and solids,
// with the same counts, however the grid is cut and however little memory there is.

#include "slab_scene.hpp"

#include <numeric>

namespace {

using namespace slab_scene;

using stream_type = slabs::stream<backend_type, moved, vp::mesh_view<glm::vec3>>;

// One call.
struct whole_call {
    colored_mesh mesh = make_scene();
    backend_type backend = unit::make_backend(2);
    vp::grid grid = unit::unit_grid(extent);
    vp::coverage rule;

    explicit whole_call(vp::coverage rule_) : rule(rule_) {}
    template <class Shader, class Output>
    vp::counters draw(const Shader& shader, Output& out) {
        const vp::status s = vp::voxelize(backend, mesh.with_colors(), grid, moved{}, shader, out, rule);
        EXPECT_TRUE(s.ok()) << s.message();
        return s.counts;
    }
    // The mesh in chunks of 50 triangles.
    void feed(stream_type& stream) {
        const auto& all = mesh.triangles;
        for (std::size_t first = 0; first < all.size(); first += 50) {
            vp::mesh_view<glm::vec3> chunk = mesh.with_colors();
            chunk.triangles =
                vp::array_view<const glm::uvec3>(all.data() + first, std::min<std::size_t>(50, all.size() - first));
            stream.add(chunk).or_throw();
        }
    }
    [[nodiscard]] slabs::stream_options options(int num_slabs, std::uint64_t memory = std::uint64_t{1} << 30) const {
        slabs::stream_options o;
        o.voxelize.rule = rule;
        o.num_slabs = num_slabs;
        o.memory = memory;
        o.folder = ::testing::TempDir();
        return o;
    }
};

class Stream : public ::testing::TestWithParam<vp::coverage> {};
INSTANTIATE_TEST_SUITE_P(Coverages, Stream,
                         ::testing::Values(vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair,
                                           vp::coverage::diagonal));

// Every way to cut: 1, 2, 3 and 7 slabs along z; along the other axes; by triangles; with so little memory that bins go
// to disk and slabs are cut again and again.
template <class F>
void for_each_way(whole_call& whole, bool only_z, F&& f) {
    for (const int n : {1, 2, 3, 7}) f("slabs along z", whole.options(n), nullptr);
    slabs::histogram counts(extent);
    const auto snap = vp::core::make_snap_transform(whole.grid);
    for (const glm::uvec3& t : whole.mesh.triangles) {
        const auto at = [&](std::uint32_t i) { return whole.mesh.positions[i] + moved{}.by; };
        const auto c = slabs::classify(snap, extent, whole.rule, at(t.x), at(t.y), at(t.z));
        if (c.kind == vp::core::triangle_class::drawn) counts.add(c.reach);
    }
    for (int axis = 2; axis >= (only_z ? 2 : 0); --axis) {
        const slabs::plan p = slabs::detail::split_along(counts, axis, 3, {});
        f("a plan", whole.options(1), &p);
    }
    f("little memory", whole.options(2, 100'000), nullptr);
    slabs::stream_options aligned = whole.options(3, 60'000);
    aligned.align = 8;
    f("least memory, aligned", aligned, nullptr);
}

// Draws a stream in every way. begin(options of the stream) comes before each and gives the sink of its slabs, end()
// after it; the counts are the whole's.
template <class Shader, class Make, class Begin, class End>
void draw_every_way(whole_call& whole, bool only_z, const vp::counters& counts, const Shader& shader, const Make& make,
                    const Begin& begin, const End& end) {
    for_each_way(whole, only_z, [&](const char* what, const slabs::stream_options& how, const slabs::plan* plan) {
        SCOPED_TRACE(what);
        stream_type stream(whole.backend, whole.grid, moved{}, how);
        if (plan != nullptr) stream.cut_into(*plan);
        whole.feed(stream);
        const vp::status s = stream.draw(shader, make, begin(how));
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts, counts);
        end();
    });
}

TEST_P(Stream, SlabsOfFramebuffersAreTheWhole) {
    whole_call whole(GetParam());
    dense expected{whole.backend, extent};
    const vp::counters counts = whole.draw(all_kinds{}, expected);
    std::int64_t voxels = 0;
    int parts = 0, least_parts = 0;
    std::uint64_t before = 0;
    draw_every_way(
        whole, false, counts, all_kinds{},
        [&](glm::ivec3 size) {
            return dense{whole.backend, size};
        },
        [&](const slabs::stream_options& how) {
            voxels = parts = 0;
            before = 0;
            least_parts = how.memory > 1'000'000 ? 1 : 5;
            return [&, align = how.align](const slabs::slab& slab, const dense& fb) {
                expect_crop(whole.backend, expected, whole.grid, slab.where, fb);
                const glm::ivec3 e = slab.where.extent, o = slab.where.offset;
                voxels += std::int64_t{e.x} * e.y * e.z;
                EXPECT_EQ(slab.voxels_before, before);
                before += slab.drawn.counts.voxels;
                for (int a = 0; a < 3; ++a) EXPECT_TRUE(align == 1 || o[a] % align == 0);
                ++parts;
            };
        },
        [&] {
            EXPECT_EQ(voxels, std::int64_t{extent.x} * extent.y * extent.z);
            EXPECT_GE(parts, least_parts);
        });
}

template <class Payload, class Shader>
void check_lists(vp::coverage rule, const Shader& shader) {
    whole_call whole(rule);
    vp::abuffer<backend_type, Payload> lists{whole.backend};
    const vp::counters counts = whole.draw(shader, lists);
    const auto expected = lists.to_host(whole.backend);
    vp::host_abuffer<Payload> all;
    draw_every_way(
        whole, true, counts, shader, [&](glm::ivec3) { return vp::abuffer<backend_type, Payload>{whole.backend}; },
        [&](const slabs::stream_options&) {
            all = {};
            return [&](const slabs::slab& slab, const auto& part) {
                EXPECT_EQ(slab.voxels_before, all.voxels.size());
                EXPECT_EQ(slab.fragments_before, all.primitives.size());
                slabs::append(all, whole.grid, slab, part.to_host(whole.backend));
            };
        },
        [&] { expect_equal(all, expected); });
}
TEST_P(Stream, SlabsOfListsFollowEachOther) { check_lists<std::uint64_t>(GetParam(), payload{}); }
TEST_P(Stream, SlabsOfTriangleListsFollowEachOther) { check_lists<void>(GetParam(), vp::constant(true)); }

TEST_P(Stream, SlabsOfSparseFramebuffersMerge) {
    whole_call whole(GetParam());
    sparse expected{whole.backend, extent};
    const vp::counters counts = whole.draw(all_kinds{}, expected);
    std::vector<host_sparse> parts;
    draw_every_way(
        whole, false, counts, all_kinds{},
        [&](glm::ivec3 size) {
            return sparse{whole.backend, size};
        },
        [&](const slabs::stream_options&) {
            parts.clear();
            return [&](const slabs::slab&, const sparse& part) { parts.push_back(part.to_host(whole.backend)); };
        },
        [&] {
            EXPECT_TRUE(
                vp::same_contents(vp::merge(std::span<const host_sparse>(parts)), expected.to_host(whole.backend)));
        });
}

TEST(Stream, SolidsAreTheWhole) {
    whole_call whole(vp::coverage::conservative);
    // A box that reaches out of the grid along x: rows enter it before their first voxel.
    whole.mesh = {};
    const auto corner = [](int i) {
        return glm::vec3((i & 1) != 0 ? 20.3f : -6.0f, (i & 2) != 0 ? 30.2f : 2.5f, (i & 4) != 0 ? 39.7f : 1.5f);
    };
    for (int i = 0; i < 8; ++i) whole.mesh.positions.push_back(corner(i));
    whole.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    whole.mesh.colors.resize(8);
    struct winding {
        auto operator()(const vp::solid_fragment& f) const { return vp::outputs(static_cast<std::int32_t>(f.winding)); }
    };
    using targets = vp::framebuffer<backend_type, vp::target<std::int32_t, vp::blend::add>>;
    for (const auto inside : {vp::solid_extent::centre, vp::solid_extent::outer, vp::solid_extent::inner}) {
        vp::solid_options solid;
        solid.extent = inside;
        targets expected{whole.backend, extent};
        const vp::status one = vp::voxelize_solid(whole.backend, whole.mesh.with_colors(), whole.grid, moved{},
                                                  winding{}, expected, solid);
        ASSERT_TRUE(one.ok()) << one.message();
        EXPECT_GT(one.counts.voxels, 10000u);
        for (const int n : {1, 2, 3, 7}) {
            slabs::stream_options how = whole.options(n, n == 7 ? 200'000 : 1u << 30);
            how.is_solid = true;
            stream_type stream(whole.backend, whole.grid, moved{}, how);
            whole.feed(stream);
            const auto all = vp::get<0>(expected).to_host_target(whole.backend);
            int wrong = 0;
            const vp::status s = stream.draw_solid(
                winding{},
                [&](glm::ivec3 size) {
                    return targets{whole.backend, size};
                },
                [&](const slabs::slab& slab, const targets& fb) {
                    const auto part = vp::get<0>(fb).to_host_target(whole.backend);
                    const glm::ivec3 o = slab.where.offset;
                    unit::for_each_voxel(slab.where.extent, [&](int x, int y, int z) {
                        wrong += part(x, y, z) != all(o.x + x, o.y + y, o.z + z);
                    });
                },
                solid);
            EXPECT_TRUE(s.ok()) << s.message();
            EXPECT_EQ(wrong, 0);
            EXPECT_EQ(s.counts, one.counts);
            EXPECT_EQ(s.solid, one.solid);
        }
    }
    slabs::stream_options how = whole.options(2);
    stream_type surfaces(whole.backend, whole.grid, moved{}, how);
    const auto make = [&](glm::ivec3 size) { return targets{whole.backend, size}; };
    const auto none = [](const slabs::slab&, const targets&) { FAIL(); };
    EXPECT_EQ(surfaces.draw_solid(winding{}, make, none).code, vp::status_code::bad_solid_options);
    how.is_solid = true;
    stream_type solids(whole.backend, whole.grid, moved{}, how); // which count other triangles as drawn
    EXPECT_EQ(solids.draw(vp::constant(1), make, none).code, vp::status_code::bad_solid_options);
    stream_type repaired(whole.backend, whole.grid, moved{}, how);
    vp::solid_options solid;
    solid.repair = vp::repair::close_holes;
    EXPECT_EQ(repaired.draw_solid(winding{}, make, none, solid).code, vp::status_code::bad_solid_options);
}

TEST(Stream, ASlabThatRunsOutOfMemoryIsCutAgain) {
    whole_call whole(vp::coverage::conservative);
    dense expected{whole.backend, extent};
    const vp::counters counts = whole.draw(all_kinds{}, expected);
    stream_type stream(whole.backend, whole.grid, moved{}, whole.options(2));
    whole.feed(stream);
    int refused = 0, parts = 0;
    const vp::status s = stream.draw(
        all_kinds{},
        [&](glm::ivec3 size) {
            if (size.x * size.y * size.z > 4000) {
                ++refused;
                throw std::bad_alloc();
            }
            return dense{whole.backend, size};
        },
        [&](const slabs::slab& slab, const dense& fb) {
            ++parts;
            expect_crop(whole.backend, expected, whole.grid, slab.where, fb);
        });
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, counts);
    EXPECT_GT(refused, 0);
    EXPECT_GT(parts, 12);

    // One that nothing helps fails.
    stream_type hopeless(whole.backend, whole.grid, moved{}, whole.options(40));
    whole.feed(hopeless);
    const vp::status failed = hopeless.draw(
        all_kinds{},
        [&](glm::ivec3 size) -> dense {
            if (size.x > 0) throw std::bad_alloc();
            return dense{whole.backend, size};
        },
        [](const slabs::slab&, const dense&) { FAIL(); });
    EXPECT_EQ(failed.code, vp::status_code::out_of_memory);
}

// A sink that runs out of memory has had the slab: it is not drawn again in parts.
TEST(Stream, AShortageOfTheSinkIsThrown) {
    whole_call whole(vp::coverage::conservative);
    using bits = vp::framebuffer<backend_type, vp::target<vp::bit, vp::blend::bit_or>>;
    const auto make = [&](glm::ivec3 size) { return bits{whole.backend, size}; };
    int slabs = 0;
    const auto sink = [&](const slabs::slab&, const bits&) {
        if (++slabs == 2) throw std::bad_alloc();
    };
    stream_type surface(whole.backend, whole.grid, moved{}, whole.options(3));
    whole.feed(surface);
    EXPECT_THROW((void)surface.draw(vp::constant(true), make, sink), std::bad_alloc);
    EXPECT_EQ(slabs, 2);
    for (const auto repair : {vp::repair::none, vp::repair::exterior}) {
        slabs::stream_options how = whole.options(3);
        how.is_solid = true;
        how.repair = repair;
        stream_type solid(whole.backend, whole.grid, moved{}, how);
        whole.feed(solid);
        slabs = 0;
        EXPECT_THROW((void)solid.draw_solid(vp::constant(true), make, sink, {.repair = repair}), std::bad_alloc);
        EXPECT_EQ(slabs, 2);
    }
}

TEST(Stream, OfACropIsTheCrop) {
    whole_call whole(vp::coverage::thin);
    whole.grid = whole.grid.crop({3, 5, 9}, {30, 21, 22});
    dense expected{whole.backend, whole.grid.extent};
    const vp::counters counts = whole.draw(all_kinds{}, expected);
    stream_type stream(whole.backend, whole.grid, moved{}, whole.options(3, 60'000));
    whole.feed(stream);
    const vp::status s = stream.draw(
        all_kinds{},
        [&](glm::ivec3 size) {
            return dense{whole.backend, size};
        },
        [&](const slabs::slab& slab, const dense& fb) {
            expect_crop(whole.backend, expected, whole.grid, slab.where, fb);
        });
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, counts);
}

TEST(Stream, WithoutTrianglesGivesClearedSlabs) {
    backend_type backend;
    slabs::stream<backend_type, vp::passthrough> stream(backend, unit::unit_grid(extent), {}, {});
    int parts = 0;
    const vp::status s = stream.draw(
        vp::constant(true),
        [&](glm::ivec3 size) {
            return vp::framebuffer<backend_type, vp::target<vp::bit, vp::blend::bit_or>>{backend, size};
        },
        [&](const slabs::slab& slab, const auto& fb) {
            ++parts;
            EXPECT_EQ(slab.where.extent, extent);
            const std::vector<std::uint32_t> words = vp::get<0>(fb).to_host(backend);
            EXPECT_EQ(std::accumulate(words.begin(), words.end(), 0u), 0u);
        });
    EXPECT_TRUE(s.nothing_drawn());
    EXPECT_EQ(parts, 1);
}

TEST(Stream, SaysWhatIsWrong) {
    backend_type backend;
    vp::grid bad = unit::unit_grid(extent);
    bad.voxel_size.y = -1;
    EXPECT_THROW((slabs::stream<backend_type, vp::passthrough>(backend, bad, {}, {})), std::invalid_argument);

    slabs::stream<backend_type, vp::passthrough> stream(backend, unit::unit_grid(extent), {}, {});
    unit::small_mesh m = unit::make_mesh(1, 4, extent);
    vp::mesh_view<> twice = m.view();
    twice.copies.count = 2;
    EXPECT_EQ(stream.add(twice).code, vp::status_code::bad_subset);
    m.triangles[2].y = 12;
    const vp::status s = stream.add(m.view());
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(s.triangle, 2u);

    slabs::stream_options nowhere;
    nowhere.memory = 1000;
    nowhere.folder = "/nonexistent";
    slabs::stream<backend_type, vp::passthrough> spills(backend, unit::unit_grid(extent), {}, nowhere);
    EXPECT_THROW((void)spills.add(unit::make_mesh(1, 400, extent).view()), std::system_error);
}

} // namespace
