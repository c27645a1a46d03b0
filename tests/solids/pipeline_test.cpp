// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Solids as part of the pipeline: shaders, blends, layouts, load operations, lists, crops, threads, status, bad input.
// A model in the test lists the fragments of each voxel from the oracle's winding numbers.

#include "solid_support.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace solids {
namespace {

using rule = vp::fill_rule;
using extent_of = vp::solid_extent;

// A blend that depends on the order.
struct chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::int64_t identity() const { return 1; }
    VOXELPIPE_HD std::int64_t combine(std::int64_t a, std::int64_t b) const { return (a * 31 + b) % 1000003; }
};

using bits = vp::target<vp::bit, vp::blend::bit_xor, vp::layout::tiled>;
using last = vp::target<std::uint32_t, vp::blend::replace>;
using sum = vp::target<float, vp::blend::add>; // accumulates in its own format
using most = vp::target<glm::vec3, vp::blend::max, vp::layout::planar>;
using number = vp::target<std::uint16_t, vp::blend::count, vp::layout::tiled>;
using ordered = vp::target<std::int64_t, chain>;
using image = vp::framebuffer<vp::cpu_backend, bits, last, sum, most, number, ordered>;
using values = vp::output<bool, std::uint32_t, float, glm::vec3, std::uint16_t, std::int64_t>;

struct shade {
    std::uint32_t seed = 0;
    values operator()(const vp::solid_fragment& f) const {
        const auto w = static_cast<std::int32_t>(f.winding);
        const auto hash = static_cast<std::uint32_t>(f.voxel.x * 73 + f.voxel.y * 151 + f.voxel.z * 283 + w * 17) +
                          f.draw * 7919 + seed * 104729;
        const float value = static_cast<float>(hash % 1000) / 7.0f;
        return values{vp::core::make_pack(hash % 3 != 0, hash, value, glm::vec3(value, -value, f.voxel.x),
                                          std::uint16_t{9}, static_cast<std::int64_t>(hash))}
            .discard_if(hash % 11 == 5);
    }
};
using draw = vp::draw<vp::mesh_view<>, vp::passthrough, shade>;

struct model_fragment {
    std::uint32_t draw;
    std::int64_t winding;
};
// The fragments of every voxel, in order.
std::vector<std::vector<model_fragment>> model(const std::vector<mesh>& meshes, const vp::grid& g,
                                               const vp::solid_options& o) {
    std::vector<std::vector<model_fragment>> all(index(g.extent, 0, 0, g.extent.z));
    std::vector<mesh> parts = meshes;
    if (o.bodies == vp::bodies::call) {
        for (std::size_t i = 1; i < meshes.size(); ++i) parts[0].add(meshes[i]);
        parts.resize(1);
    }
    for (std::size_t d = 0; d < parts.size(); ++d) {
        const auto windings = oracle_windings(parts[d], g, along_rows);
        voxel_set in = accepted(windings, o.rule);
        if (o.extent == extent_of::outer) in = united(in, library_cover(parts[d], g));
        if (o.extent == extent_of::inner) in = without(in, library_cover(parts[d], g));
        for (std::size_t i = 0; i < in.size(); ++i)
            if (in[i] != 0) all[i].push_back({static_cast<std::uint32_t>(d), windings[i]});
    }
    return all;
}

std::vector<mesh> overlapping(splitmix64& random) {
    std::vector<mesh> all;
    for (int i = 0; i < 4; ++i) all.push_back(random_bodies(random, 9, 2));
    all[2].triangles.pop_back(); // open
    return all;
}
std::vector<draw> draws_of(const std::vector<mesh>& meshes) {
    std::vector<draw> draws;
    for (const mesh& m : meshes) draws.push_back({m.view(), {}, {static_cast<std::uint32_t>(draws.size())}});
    return draws;
}

// All that a framebuffer holds.
struct contents {
    std::vector<std::uint32_t> bits, last;
    std::vector<std::uint32_t> sums, most; // patterns
    std::vector<std::uint16_t> numbers;
    std::vector<std::int64_t> ordered;
    friend bool operator==(const contents&, const contents&) = default;
};
contents read(vp::cpu_backend& be, const image& fb) {
    contents c{vp::get<0>(fb).to_host(be), vp::get<1>(fb).to_host(be), {}, {},
               vp::get<4>(fb).to_host(be), vp::get<5>(fb).to_host(be)};
    for (const float f : vp::get<2>(fb).to_host(be)) c.sums.push_back(std::bit_cast<std::uint32_t>(f));
    for (const float f : vp::get<3>(fb).to_host(be)) c.most.push_back(std::bit_cast<std::uint32_t>(f));
    return c;
}

template <std::size_t I, class Target>
void expect_target(vp::cpu_backend& be, const image& fb, const std::vector<std::vector<model_fragment>>& fragments,
                   const vp::grid& g, const std::vector<draw>& draws, const typename Target::value_type& start) {
    const auto host = vp::get<I>(fb).to_host_target(be);
    for (int z = 0; z < g.extent.z; ++z)
        for (int y = 0; y < g.extent.y; ++y)
            for (int x = 0; x < g.extent.x; ++x) {
                auto a = Target::traits::begin(start);
                for (const model_fragment& f : fragments[index(g.extent, x, y, z)]) {
                    const auto out = draws[f.draw].fragment_shader({{x, y, z}, f.draw, f.winding});
                    if (out.keep) Target::traits::apply(a, vp::get<I>(out.values));
                }
                const typename Target::value_type expected = Target::traits::end(a);
                ASSERT_EQ(expected, host(x, y, z)) << "target " << I << " at " << x << ' ' << y << ' ' << z;
            }
}

TEST(SolidPipeline, EveryBlendFoldsItsBodiesInTheOrderOfTheDraws) {
    splitmix64 random(21);
    vp::cpu_backend be{2};
    const vp::grid g = unit_grid({40, 9, 8});
    for (int round = 0; round < 12; ++round) {
        const std::vector<mesh> meshes = overlapping(random);
        const std::vector<draw> draws = draws_of(meshes);
        vp::solid_options o;
        o.rule = static_cast<rule>(round % 3);
        o.bodies = round % 4 == 3 ? vp::bodies::call : vp::bodies::draw;
        o.extent = static_cast<extent_of>(round / 2 % 3);
        const auto fragments = model(meshes, g, o);
        image fb{be, g.extent};
        vp::get<2>(fb).clear(0.25f);
        vp::get<5>(fb).clear(77);
        const vp::status s = vp::voxelize_solid(be, draws, g, fb, o);
        ASSERT_TRUE(s.ok()) << s.message();
        SCOPED_TRACE("round " + std::to_string(round));
        expect_target<0, bits>(be, fb, fragments, g, draws, false);
        expect_target<1, last>(be, fb, fragments, g, draws, 0);
        expect_target<2, sum>(be, fb, fragments, g, draws, 0.25f);
        expect_target<3, most>(be, fb, fragments, g, draws, most::traits::identity());
        expect_target<4, number>(be, fb, fragments, g, draws, 0);
        expect_target<5, ordered>(be, fb, fragments, g, draws, 77);
        vp::counters counts{};
        for (std::size_t i = 0; i < fragments.size(); ++i) {
            bool kept = false;
            for (const model_fragment& f : fragments[i]) {
                const auto x = static_cast<int>(i) % 40, y = static_cast<int>(i) / 40 % 9,
                           z = static_cast<int>(i) / 360;
                const bool keep = draws[f.draw].fragment_shader({{x, y, z}, f.draw, f.winding}).keep;
                ++(keep ? counts.fragments : counts.fragments_discarded);
                kept = kept || keep;
            }
            counts.voxels += kept ? 1 : 0;
        }
        EXPECT_EQ(s.counts.fragments, counts.fragments);
        EXPECT_EQ(s.counts.fragments_discarded, counts.fragments_discarded);
        EXPECT_EQ(s.counts.voxels, counts.voxels);
        if (HasFailure()) return;
    }
}

TEST(SolidPipeline, LoadBlendsOntoWhatIsThereAndOffTargetsAreLeftAlone) {
    splitmix64 random(22);
    vp::cpu_backend be{2};
    const vp::grid g = unit_grid({33, 8, 7});
    const std::vector<mesh> meshes = overlapping(random), others = overlapping(random);
    const vp::solid_options o{.bodies = vp::bodies::draw};
    image fb{be, g.extent};
    ASSERT_TRUE(vp::voxelize_solid(be, draws_of(others), g, fb, o).ok());
    const auto before = vp::get<2>(fb).to_host(be);
    const auto first = model(others, g, o);
    auto second = model(meshes, g, o);
    // As one call with both lists of draws, but for the draws' numbers.
    vp::get<0>(fb).load();
    vp::get<1>(fb).load();
    vp::get<2>(fb).off();
    vp::get<5>(fb).load();
    const std::vector<draw> draws = draws_of(meshes), old_draws = draws_of(others);
    ASSERT_TRUE(vp::voxelize_solid(be, draws, g, fb, o).ok());
    EXPECT_EQ(before, vp::get<2>(fb).to_host(be));
    expect_target<3, most>(be, fb, second, g, draws, most::traits::identity()); // cleared
    const auto host = vp::get<5>(fb).to_host_target(be);
    const auto bit = vp::get<0>(fb).to_host_target(be);
    for (int z = 0; z < g.extent.z; ++z)
        for (int y = 0; y < g.extent.y; ++y)
            for (int x = 0; x < g.extent.x; ++x) {
                std::int64_t a = chain{}.identity();
                bool b = false;
                const auto fold = [&](const auto& list, const std::vector<draw>& from) {
                    for (const model_fragment& f : list[index(g.extent, x, y, z)]) {
                        const auto out = from[f.draw].fragment_shader({{x, y, z}, f.draw, f.winding});
                        if (!out.keep) continue;
                        a = chain{}.combine(a, vp::get<5>(out.values));
                        b = b != vp::get<0>(out.values);
                    }
                };
                fold(first, old_draws);
                fold(second, draws);
                ASSERT_EQ(a, host(x, y, z));
                ASSERT_EQ(b, bit(x, y, z));
            }
}

TEST(SolidPipeline, ConstantShadersFoldAsShadersThatReturnTheSame) {
    splitmix64 random(23);
    vp::cpu_backend be{2};
    const vp::grid g = unit_grid({70, 8, 7});
    using total = vp::target<std::uint32_t, vp::blend::add>;
    using flag = vp::target<vp::bit, vp::blend::bit_or>;
    using parity = vp::target<vp::bit, vp::blend::bit_xor>;
    using real = vp::target<float, vp::blend::add>;
    using frame = vp::framebuffer<vp::cpu_backend, total, flag, parity, real, number>;
    using constants = vp::constant_output<std::uint32_t, bool, bool, float, std::uint16_t>;
    struct the_same {
        constants of;
        auto operator()(const vp::solid_fragment& f) const { return of(f); }
    };
    std::uint64_t total_fragments = 0;
    for (const bool differ : {false, true})
        for (const vp::bodies body : {vp::bodies::call, vp::bodies::draw})
            for (const extent_of extent : {extent_of::centre, extent_of::outer, extent_of::inner}) {
                const std::vector<mesh> meshes = overlapping(random);
                std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, constants>> fixed;
                std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, the_same>> computed;
                for (std::size_t d = 0; d < meshes.size(); ++d) {
                    const auto n = differ ? static_cast<std::uint32_t>(d) : 3u;
                    const auto c = vp::constant(n, true, n % 2 != 0, static_cast<float>(n) / 3.0f, std::uint16_t{1});
                    fixed.push_back({meshes[d].view(), {}, c});
                    computed.push_back({meshes[d].view(), {}, {c}});
                }
                const vp::solid_options o{.rule = rule::nonzero, .bodies = body, .extent = extent};
                frame a{be, g.extent}, b{be, g.extent};
                for (frame* f : {&a, &b}) {
                    vp::get<0>(*f).clear(1000);
                    vp::get<3>(*f).clear(0.1f);
                }
                const vp::status s = vp::voxelize_solid(be, fixed, g, a, o),
                                 t = vp::voxelize_solid(be, computed, g, b, o);
                ASSERT_TRUE(s.ok() && t.ok());
                EXPECT_EQ(s.counts, t.counts);
                EXPECT_EQ(s.solid, t.solid);
                total_fragments += s.counts.fragments;
                EXPECT_EQ(vp::get<0>(a).to_host(be), vp::get<0>(b).to_host(be));
                EXPECT_EQ(vp::get<1>(a).to_host(be), vp::get<1>(b).to_host(be));
                EXPECT_EQ(vp::get<2>(a).to_host(be), vp::get<2>(b).to_host(be));
                EXPECT_EQ(vp::get<3>(a).to_host(be), vp::get<3>(b).to_host(be));
                EXPECT_EQ(vp::get<4>(a).to_host(be), vp::get<4>(b).to_host(be));
            }
    EXPECT_GT(total_fragments, 1000u);
}

// ---- lists ----------------------------------------------------------------------------------------------------------

struct winding_of {
    vp::output<std::int64_t> operator()(const vp::solid_fragment& f) const {
        return vp::outputs(f.winding * 100 + f.draw).discard_if(f.voxel.x == 3);
    }
};
using list_draw = vp::draw<vp::mesh_view<>, vp::passthrough, winding_of>;
std::vector<list_draw> list_draws(const std::vector<mesh>& meshes) {
    std::vector<list_draw> draws;
    for (const mesh& m : meshes) draws.push_back({m.view(), {}, {}});
    return draws;
}

TEST(SolidPipeline, ListsHoldEveryBodyByItsDraw) {
    splitmix64 random(24);
    vp::cpu_backend be{2};
    const vp::grid g = unit_grid({40, 9, 8});
    for (const vp::bodies body : {vp::bodies::draw, vp::bodies::call})
        for (const extent_of extent : {extent_of::centre, extent_of::outer, extent_of::inner}) {
            const std::vector<mesh> meshes = overlapping(random);
            const vp::solid_options o{.rule = rule::even_odd, .bodies = body, .extent = extent};
            vp::abuffer<vp::cpu_backend, std::int64_t> lists{be};
            const vp::status s = vp::voxelize_solid(be, list_draws(meshes), g, lists, o);
            ASSERT_TRUE(s.ok()) << s.message();
            const auto host = lists.to_host(be);
            EXPECT_EQ(host.extent, g.extent);
            const auto fragments = model(meshes, g, o);
            std::size_t at = 0;
            for (std::size_t i = 0; i < fragments.size(); ++i) {
                if (fragments[i].empty() || i % 40 == 3) continue;
                ASSERT_LT(at, host.size());
                ASSERT_EQ(host.voxels[at], i);
                const auto got = host[at].fragments;
                ASSERT_EQ(got.size(), fragments[i].size());
                for (std::size_t k = 0; k < got.size(); ++k) {
                    EXPECT_EQ(got[k].primitive, fragments[i][k].draw);
                    EXPECT_EQ(got[k].value, fragments[i][k].winding * 100 + fragments[i][k].draw);
                }
                ++at;
            }
            EXPECT_EQ(at, host.size());
            EXPECT_EQ(s.counts.voxels, host.size());
            EXPECT_EQ(s.counts.fragments, host.primitives.size());
        }
}

TEST(SolidPipeline, ListsSpanGridsOfAMillionVoxelsAnAxis) {
    vp::cpu_backend be{2};
    vp::grid g = unit_grid(glm::ivec3(vp::grid::max_extent));
    const auto far = static_cast<float>(vp::grid::max_extent);
    std::vector<mesh> meshes{box(glm::vec3(far - 6), glm::vec3(far - 2)), box({1, 2, 3}, {4, 4, 4})};
    vp::abuffer<vp::cpu_backend, void> lists{be};
    for (const extent_of extent : {extent_of::centre, extent_of::inner, extent_of::outer}) {
        const vp::status s =
            vp::voxelize_solid(be, list_draws(meshes), g, lists, {.bodies = vp::bodies::draw, .extent = extent});
        ASSERT_TRUE(s.ok()) << s.message();
        const std::size_t expected = extent == extent_of::centre  ? 4 * 4 * 4 + 2 * 2 * 1 // and x = 3 is discarded
                                     : extent == extent_of::inner ? 2 * 2 * 2
                                                                  : 6 * 6 * 6 + 4 * 4 * 3;
        EXPECT_EQ(lists.to_host(be).size(), expected);
    }
    // One voxel of two that the box reaches is at x = 2^20 - 1: the last bit of the widest key.
    const vp::status s = vp::voxelize_solid(be, box(glm::vec3(far - 1), glm::vec3(far)).view(), g, vp::passthrough{},
                                            winding_of{}, lists);
    ASSERT_TRUE(s.ok());
    const auto host = lists.to_host(be);
    ASSERT_EQ(host.size(), 1u);
    EXPECT_EQ(host[0].voxel, glm::ivec3(vp::grid::max_extent - 1));
}

// ---- crops ----------------------------------------------------------------------------------------------------------

TEST(SolidPipeline, ACropIsTheCropOfTheWhole) {
    splitmix64 random(25);
    vp::cpu_backend be{2};
    const glm::ivec3 e(45, 12, 11);
    const vp::grid g = unit_grid(e);
    for (int round = 0; round < 30; ++round) {
        const std::vector<mesh> meshes = overlapping(random);
        const std::vector<draw> draws = draws_of(meshes);
        vp::solid_options o;
        o.rule = static_cast<rule>(round % 3);
        o.bodies = round % 2 == 0 ? vp::bodies::draw : vp::bodies::call;
        o.extent = static_cast<extent_of>(round / 3 % 3);
        glm::ivec3 begin(0), size = e;
        for (int a = 0; a < 3; ++a) {
            if (round % 4 == 3 && a != 0) continue; // x alone
            begin[a] = static_cast<int>(random.below(static_cast<std::uint64_t>(e[a])));
            size[a] = 1 + static_cast<int>(random.below(static_cast<std::uint64_t>(e[a] - begin[a])));
        }
        image whole{be, e}, part{be, size};
        ASSERT_TRUE(vp::voxelize_solid(be, draws, g, whole, o).ok());
        ASSERT_TRUE(vp::voxelize_solid(be, draws, g.crop(begin, size), part, o).ok());
        const auto last_of_whole = vp::get<1>(whole).to_host_target(be),
                   last_of_part = vp::get<1>(part).to_host_target(be);
        const auto all = vp::get<5>(whole).to_host_target(be), cut = vp::get<5>(part).to_host_target(be);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x) {
                    const glm::ivec3 p = begin + glm::ivec3(x, y, z);
                    ASSERT_EQ(cut(x, y, z), all(p.x, p.y, p.z)) << "round " << round;
                    ASSERT_EQ(last_of_part(x, y, z), last_of_whole(p.x, p.y, p.z)) << "round " << round;
                }
    }
}

TEST(SolidPipeline, OpenRowsAndCrossingsOfSlabsAddUpAlongYAndZAndAreTheSameAlongX) {
    splitmix64 random(26);
    const vp::grid g = unit_grid({20, 12, 10});
    std::uint64_t open = 0;
    for (int round = 0; round < 10; ++round) {
        mesh m;
        for (const mesh& part : overlapping(random)) m.add(part);
        const vp::solid_counters whole = library_solid(m, g).status.solid;
        vp::solid_counters by_y{}, by_z{};
        for (int i = 0; i < 4; ++i) {
            const auto y = library_solid(m, g.crop({0, 3 * i, 0}, {20, 3, 10})).status.solid;
            by_y.open_rows += y.open_rows;
            by_y.crossings += y.crossings;
            by_y.max_winding = std::max(by_y.max_winding, y.max_winding);
            const auto x = library_solid(m, g.crop({5 * i, 0, 0}, {5, 12, 10})).status.solid;
            EXPECT_EQ(x.open_rows, whole.open_rows);
            EXPECT_EQ(x.crossings, whole.crossings);
        }
        for (int i = 0; i < 5; ++i) {
            const auto z = library_solid(m, g.crop({0, 0, 2 * i}, {20, 12, 2})).status.solid;
            by_z.open_rows += z.open_rows;
            by_z.crossings += z.crossings;
            by_z.max_winding = std::max(by_z.max_winding, z.max_winding);
        }
        EXPECT_EQ(by_y, whole);
        EXPECT_EQ(by_z, whole);
        open += whole.open_rows;
    }
    EXPECT_GT(open, 10u);
}

TEST(SolidPipeline, TrianglesAreOutsideIffTheyMissTheIntervalsOfYAndZ) {
    mesh m = box({20, 1, 1}, {30, 5, 5}); // beyond the grid along x: no voxels, but in the rows
    m.add(box({1, 9, 1}, {5, 12, 5}));    // beyond along y
    m.add(box({1, 1, -4}, {5, 5, 0}));    // below, and it touches the lowest face
    const vp::grid g = unit_grid(glm::ivec3(8));
    const solid s = library_solid(m, g);
    EXPECT_EQ(s.status.counts.triangles_in, 36u);
    EXPECT_EQ(s.status.counts.triangles_outside, 12u + 2);
    EXPECT_EQ(s.status.counts.triangles_drawn, 12u + 10);
    EXPECT_EQ(s.status.solid.crossings, 32u);
    EXPECT_EQ(count(s.voxels), 0u);
    EXPECT_EQ(s.status.solid.max_winding, 0u);
    const solid before = library_solid(box({-9, 1, 1}, {-3, 5, 5}), g);
    EXPECT_EQ(count(before.voxels), 0u);
    EXPECT_EQ(before.status.solid.open_rows, 0u);
    mesh shadow = box({-9, 1, 1}, {-3, 5, 5});
    shadow.triangles.erase(shadow.triangles.begin() + 10, shadow.triangles.end()); // without the face at x = -3
    EXPECT_EQ(count(library_solid(shadow, g).voxels), 8u * 16) << "a hole before the grid casts its shadow through it";
    EXPECT_EQ(library_solid(shadow, g).status.solid.open_rows, 16u);
}

// ---- threads, bad input ---------------------------------------------------------------------------------------------

TEST(SolidPipeline, AnyNumberOfThreadsGivesTheSameBytesAndStatus) {
    splitmix64 random(27);
    const vp::grid g = unit_grid({70, 67, 66});
    std::vector<mesh> meshes = overlapping(random);
    meshes.push_back(sphere({33, 32, 31}, 29.3f, 5));
    meshes.push_back(sphere({36, 32, 31}, 25.3f, 5));
    const std::vector<draw> draws = draws_of(meshes);
    for (const vp::solid_options o : {vp::solid_options{.bodies = vp::bodies::draw, .extent = extent_of::outer},
                                      vp::solid_options{.rule = rule::positive}}) {
        contents first;
        vp::status status;
        for (const unsigned threads : {1u, 2u, 3u, 7u}) {
            vp::cpu_backend be{threads};
            image fb{be, g.extent};
            const vp::status s = vp::voxelize_solid(be, draws, g, fb, o);
            ASSERT_TRUE(s.ok());
            if (threads == 1) {
                first = read(be, fb);
                status = s;
                continue;
            }
            EXPECT_EQ(read(be, fb), first) << threads;
            EXPECT_EQ(s.counts, status.counts);
            EXPECT_EQ(s.solid, status.solid);
        }
    }
}

TEST(SolidPipeline, DroppedTrianglesOpenRowsAndAreCounted) {
    mesh m = box({1, 1, 1}, {6, 6, 6});
    m.positions.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
    m.positions.push_back({1e30f, 0, 0});
    m.triangles[8] = {0, 4, 8};
    m.triangles[10] = {1, 3, 9};
    const solid s = library_solid(m, unit_grid(glm::ivec3(8)));
    EXPECT_EQ(s.status.counts.triangles_nonfinite, 1u);
    EXPECT_EQ(s.status.counts.triangles_too_far, 1u);
    EXPECT_EQ(s.status.counts.triangles_drawn, 10u);
    EXPECT_GT(s.status.solid.open_rows, 0u);
}

struct broken_call {
    vp::cpu_backend be{1};
    mesh m = box({1, 1, 1}, {6, 6, 6});
    vp::grid g = unit_grid(glm::ivec3(8));
    std::vector<std::uint32_t> words = std::vector<std::uint32_t>(64, 0x5a5a5a5au);
    vp::framebuffer_view<vp::target<vp::bit, vp::blend::bit_or>> view =
        vp::framebuffer_view<vp::target<vp::bit, vp::blend::bit_or>>::on(glm::ivec3(8), words.data());
    vp::solid_options options;

    vp::status run() {
        return vp::voxelize_solid(be, m.view(), g, vp::passthrough{}, vp::constant(true), view, options);
    }
    [[nodiscard]] bool untouched() const {
        return std::all_of(words.begin(), words.end(), [](std::uint32_t w) { return w == 0x5a5a5a5au; });
    }
};
template <class Break>
void expect_refused(vp::status_code code, const Break& spoil) {
    broken_call c;
    spoil(c);
    const vp::status s = c.run();
    EXPECT_EQ(s.code, code) << s.message();
    EXPECT_TRUE(c.untouched()) << s.message();
    EXPECT_FALSE(s.message().empty());
}

TEST(SolidPipeline, BadInputGivesItsStatusAndWritesNothing) {
    using code = vp::status_code;
    broken_call well;
    ASSERT_TRUE(well.run().ok());
    EXPECT_FALSE(well.untouched());
    expect_refused(code::bad_extent, [](broken_call& c) { c.g.extent.y = 0; });
    expect_refused(code::bad_voxel_size, [](broken_call& c) { c.g.voxel_size.x = -1; });
    expect_refused(code::extent_mismatch, [](broken_call& c) { c.g.extent.y = 9; });
    expect_refused(code::null_view, [](broken_call& c) {
        c.view.targets = {};
        vp::get<0>(c.view.targets).extent = glm::ivec3(8);
    });
    expect_refused(code::bad_solid_options, [](broken_call& c) { c.options.closing = -1; });
    expect_refused(code::bad_solid_options,
                   [](broken_call& c) { c.options.closing = vp::solid_options::max_closing + 1; });
    expect_refused(code::bad_solid_options, [](broken_call& c) { c.options.rule = static_cast<rule>(3); });
    expect_refused(code::bad_solid_options, [](broken_call& c) { c.options.extent = static_cast<extent_of>(9); });
    expect_refused(code::bad_solid_options, [](broken_call& c) { c.options.bodies = static_cast<vp::bodies>(2); });
    expect_refused(code::bad_solid_options, [](broken_call& c) { c.options.repair = static_cast<vp::repair>(5); });
    expect_refused(code::crop_without_whole, [](broken_call& c) {
        c.g = unit_grid(glm::ivec3(16)).crop(glm::ivec3(4), glm::ivec3(8));
        c.options.repair = vp::repair::exterior;
    });
    for (const extent_of extent : {extent_of::centre, extent_of::outer}) {
        broken_call c;
        c.m.triangles[7].z = 8;
        c.options.extent = extent;
        const vp::status s = c.run();
        EXPECT_EQ(s.code, code::index_out_of_range);
        EXPECT_EQ(s.draw, 0u);
        EXPECT_EQ(s.triangle, 7u);
        EXPECT_EQ(s.counts.triangles_in, 12u);
        EXPECT_TRUE(c.untouched());
    }
    const glm::mat4 projective(1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
    broken_call c;
    EXPECT_EQ(vp::voxelize_solid(c.be, c.m.view(), c.g, vp::transform{projective}, vp::constant(true), c.view).code,
              code::not_affine);
    EXPECT_TRUE(c.untouched());
}

TEST(SolidPipeline, WithoutTrianglesItClears) {
    broken_call c;
    c.m.triangles.clear();
    EXPECT_TRUE(c.run().ok());
    EXPECT_TRUE(std::all_of(c.words.begin(), c.words.end(), [](std::uint32_t w) { return w == 0; }));
    vp::abuffer<vp::cpu_backend, void> lists{c.be};
    EXPECT_TRUE(vp::voxelize_solid(c.be, c.m.view(), c.g, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_EQ(lists.num_voxels(), 0u);
    EXPECT_EQ(lists.extent, c.g.extent);
}

} // namespace
} // namespace solids
