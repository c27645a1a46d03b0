// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// voxelize_solid gives cpu_backend's bytes and counters: rules, bodies and extents, every kind of target, layout, blend
// and load, crops, A-buffers, ties, large triangles, many draws, and calls that run again or fail.
#include "device_test.hpp"

#include <voxelpipe/device/optional/solid_async.cuh>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <string>
#include <vector>

// Tells the order of fragments.
struct solids_in_order {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint32_t identity() const { return 7; }
    VOXELPIPE_HD std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return a * 31u + b; }
};

namespace {

using namespace device_test;

// ---- meshes ---------------------------------------------------------------------------------------------------------

void add_quad(mesh_data& m, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d, bool is_inverted) {
    add_triangle(m, a, is_inverted ? c : b, is_inverted ? b : c);
    add_triangle(m, a, is_inverted ? d : c, is_inverted ? c : d);
}
// A box, its fronts outside.
void add_box(mesh_data& m, glm::vec3 lo, glm::vec3 hi, bool is_inverted = false) {
    const auto corner = [&](int i) {
        return glm::vec3((i & 1) != 0 ? hi.x : lo.x, (i & 2) != 0 ? hi.y : lo.y, (i & 4) != 0 ? hi.z : lo.z);
    };
    const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& f : faces) add_quad(m, corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]), is_inverted);
}
void add_octahedron(mesh_data& m, glm::vec3 centre, float radius, bool is_inverted = false) {
    for (int i = 0; i < 8; ++i) {
        const glm::vec3 s((i & 1) != 0 ? -1.0f : 1.0f, (i & 2) != 0 ? -1.0f : 1.0f, (i & 4) != 0 ? -1.0f : 1.0f);
        const glm::vec3 x = centre + glm::vec3(s.x * radius, 0, 0), y = centre + glm::vec3(0, s.y * radius, 0),
                        z = centre + glm::vec3(0, 0, s.z * radius);
        const bool swap = (s.x * s.y * s.z < 0) != is_inverted;
        add_triangle(m, x, swap ? z : y, swap ? y : z);
    }
}
// Boxes and octahedra with corners on multiples of half a voxel, so that faces, edges and corners meet centres; some
// are inside out, some stand twice, some overlap, some reach out of the grid.
mesh_data tied_bodies(float size, int count, std::uint32_t seed) {
    std::mt19937 random(seed);
    mesh_data m;
    const auto half_voxels = [&](float low, float high) {
        return std::round(std::uniform_real_distribution<float>(2 * low, 2 * high)(random)) / 2;
    };
    for (int i = 0; i < count; ++i) {
        const glm::vec3 at(half_voxels(-0.2f * size, size), half_voxels(-0.2f * size, size),
                           half_voxels(-0.2f * size, size));
        const bool is_inverted = i % 4 == 3;
        for (int twice = 0; twice < (i % 11 == 10 ? 2 : 1); ++twice) {
            if (i % 2 == 0)
                add_box(m, at,
                        at + glm::vec3(half_voxels(0.5f, 0.4f * size), half_voxels(0.5f, 0.4f * size),
                                       half_voxels(0.5f, 0.4f * size)),
                        is_inverted);
            else
                add_octahedron(m, at, half_voxels(0.5f, 0.4f * size), is_inverted);
        }
    }
    return m;
}
// A closed ball of many triangles.
mesh_data ball(glm::vec3 centre, float radius, int rings) {
    mesh_data m;
    const int sides = 2 * rings;
    const auto point = [&](int ring, int side) {
        if (ring == 0) return centre + glm::vec3(0, 0, radius);
        if (ring == rings) return centre - glm::vec3(0, 0, radius);
        const float a = 3.14159265f * static_cast<float>(ring) / static_cast<float>(rings),
                    b = 6.2831853f * static_cast<float>(side % sides) / static_cast<float>(sides);
        return centre + radius * glm::vec3(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    };
    for (int r = 0; r < rings; ++r)
        for (int s = 0; s < sides; ++s) {
            if (r != 0) add_triangle(m, point(r, s), point(r + 1, s), point(r, s + 1));
            if (r + 1 != rings) add_triangle(m, point(r, s + 1), point(r + 1, s), point(r + 1, s + 1));
        }
    return m;
}

// ---- what is drawn --------------------------------------------------------------------------------------------------

// All that a solid's fragment has, and a discard.
struct everything {
    std::uint32_t id;
    float scale;
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto hash =
            static_cast<std::uint32_t>(f.voxel.x * 73 + f.voxel.y * 179 + f.voxel.z * 283) + 1000u * f.draw + id;
        return vp::outputs(scale * static_cast<float>(f.voxel.x - f.voxel.z), f.winding, hash, (hash & 3u) != 0,
                           glm::vec3(static_cast<float>(f.winding), static_cast<float>(f.draw), scale), hash, hash,
                           static_cast<std::int32_t>(f.winding))
            .discard_if(hash % 13 == 5);
    }
};
template <class Backend>
using everything_targets =
    vp::framebuffer<Backend, vp::target<float, vp::blend::add>, vp::target<std::int64_t, vp::blend::replace>,
                    vp::target<std::uint32_t, vp::blend::min, vp::layout::tiled>,
                    vp::target<vp::bit, vp::blend::bit_xor, vp::layout::tiled>,
                    vp::target<glm::vec3, vp::blend::add, vp::layout::planar>,
                    vp::target<std::uint32_t, solids_in_order>, vp::target<std::uint16_t, vp::blend::count>,
                    vp::target<std::int32_t, vp::blend::max>>;
template <class Backend>
using bit_target = vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::bit_or>>;

enum class loading { clear, load, some_off };

template <template <class> class Framebuffer, class VertexShader, class SolidShader>
struct drawing {
    std::vector<mesh_data> meshes;
    std::vector<VertexShader> vertex_shaders;
    std::vector<SolidShader> shaders;

    template <class Backend>
    vp::status draw(Backend& be, Framebuffer<Backend>& fb, const vp::grid& g, const vp::solid_options& options,
                    loading how) const {
        std::vector<vp::mesh<Backend>> on_backend;
        for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
        using draw_type = vp::draw<vp::mesh_view<>, VertexShader, SolidShader>;
        std::vector<draw_type> draws;
        for (std::size_t i = 0; i < meshes.size(); ++i)
            draws.push_back(
                {on_backend[i].view(), vertex_shaders[i % vertex_shaders.size()], shaders[i % shaders.size()]});
        vp::status s = vp::voxelize_solid(be, draws, g, fb, options);
        if (!s.ok() || how == loading::clear) return s;
        vp::core::for_each_index<Framebuffer<Backend>::view_type::num_targets>([&]<std::size_t I>() {
            if (how == loading::some_off && I % 2 == 1)
                vp::get<I>(fb).off();
            else
                vp::get<I>(fb).load();
        });
        if (draws.size() > 1) draws.pop_back(); // other values than those that are there
        return vp::voxelize_solid(be, draws, g, fb, options);
    }
    void expect_same(const vp::grid& g, const vp::solid_options& options, loading how = loading::clear) const {
        vp::cpu_backend cpu;
        vp::cuda_backend gpu;
        Framebuffer<vp::cpu_backend> a{cpu, g.extent};
        Framebuffer<vp::cuda_backend> b{gpu, g.extent};
        const vp::status sa = draw(cpu, a, g, options, how), sb = draw(gpu, b, g, options, how);
        ASSERT_TRUE(sa.ok()) << sa.message();
        ASSERT_TRUE(sb.ok()) << sb.message();
        EXPECT_NE(sa.solid.crossings + sa.counts.fragments, 0u); // not of nothing
        expect_same_counts(sa.counts, sb.counts);
        EXPECT_EQ(sa.solid, sb.solid) << "open rows " << sa.solid.open_rows << " " << sb.solid.open_rows
                                      << ", crossings " << sa.solid.crossings << " " << sb.solid.crossings
                                      << ", winding " << sa.solid.max_winding << " " << sb.solid.max_winding;
        vp::core::for_each_index<Framebuffer<vp::cpu_backend>::view_type::num_targets>([&]<std::size_t I>() {
            const std::string what = "target " + std::to_string(I);
            expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), what.c_str());
        });
    }
};
using drawing_of_everything = drawing<everything_targets, shift, everything>;
using drawing_of_bits = drawing<bit_target, vp::passthrough, vp::constant_output<bool>>;

constexpr vp::fill_rule all_rules[] = {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive};
constexpr vp::bodies all_bodies[] = {vp::bodies::call, vp::bodies::draw};
constexpr vp::solid_extent all_extents[] = {vp::solid_extent::centre, vp::solid_extent::outer, vp::solid_extent::inner};

template <class F>
void for_all_options(F&& f) {
    for (const auto rule : all_rules)
        for (const auto of : all_bodies)
            for (const auto extent : all_extents) {
                SCOPED_TRACE("rule " + std::to_string(static_cast<int>(rule)) + ", bodies " +
                             std::to_string(static_cast<int>(of)) + ", extent " +
                             std::to_string(static_cast<int>(extent)));
                f(vp::solid_options{.rule = rule, .bodies = of, .extent = extent});
            }
}

// Three draws that overlap: bodies with ties, a ball, and triangles that close nothing, NaN and far ones among them.
std::vector<mesh_data> three_meshes() {
    return {tied_bodies(24.0f, 12, 5), ball({14.3f, 11.2f, 12.7f}, 9.4f, 7), mixed_triangles(300, 24.0f, 3)};
}

struct id_of_fragment {
    std::uint32_t id;
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto hash = static_cast<std::uint32_t>(f.voxel.x * 3 + f.voxel.y * 5 + f.voxel.z * 7 + f.winding) + id;
        return vp::outputs(hash * 16 + f.draw).discard_if(hash % 7 == 3);
    }
};

template <class Payload, class SolidShader>
void expect_same_lists(const std::vector<mesh_data>& meshes, const SolidShader& shader, const vp::grid& g,
                       const vp::solid_options& options) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::abuffer<vp::cpu_backend, Payload> a{cpu};
    vp::abuffer<vp::cuda_backend, Payload> b{gpu};
    const auto draw = [&](auto& be, auto& lists) {
        using backend = std::remove_cvref_t<decltype(be)>;
        std::vector<vp::mesh<backend>> on_backend;
        for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
        std::vector<vp::draw<vp::mesh_view<>, shift, SolidShader>> draws;
        for (const auto& m : on_backend) draws.push_back({m.view(), {0.125f}, shader});
        return vp::voxelize_solid(be, draws, g, lists, options);
    };
    const vp::status sa = draw(cpu, a), sb = draw(gpu, b);
    ASSERT_TRUE(sa.ok()) << sa.message();
    ASSERT_TRUE(sb.ok()) << sb.message();
    expect_same_counts(sa.counts, sb.counts);
    EXPECT_EQ(sa.solid, sb.solid);
    expect_same_on_host(a.to_host(cpu), b.to_host(gpu));
}

// Without every n-th triangle.
mesh_data with_holes(mesh_data m, std::size_t n) {
    std::vector<glm::uvec3> kept;
    for (std::size_t i = 0; i < m.triangles.size(); ++i)
        if (i % n != n - 1) kept.push_back(m.triangles[i]);
    m.triangles = kept;
    return m;
}
// The same with vertices that neighbours share.
mesh_data welded(const mesh_data& m) {
    mesh_data w;
    for (const glm::uvec3& t : m.triangles) {
        glm::uvec3 to;
        for (int k = 0; k < 3; ++k) {
            const auto at = std::find(w.positions.begin(), w.positions.end(), m.positions[t[k]]);
            to[k] = static_cast<std::uint32_t>(at - w.positions.begin());
            if (at == w.positions.end()) w.positions.push_back(m.positions[t[k]]);
        }
        w.triangles.push_back(to);
    }
    return w;
}
// Two broken balls and broken boxes; the first one's vertices are shared.
std::vector<mesh_data> broken_meshes() {
    return {welded(with_holes(ball({14.3f, 11.2f, 12.7f}, 9.4f, 7), 9)),
            with_holes(ball({20.0f, 13.5f, 10.0f}, 6.1f, 5), 11), with_holes(tied_bodies(24.0f, 7, 5), 13)};
}

} // namespace

TEST(Solids, EveryRuleBodyAndExtentIntoEveryKindOfTarget) {
    const drawing_of_everything drawing{three_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    int i = 0;
    for_all_options([&](const vp::solid_options& options) {
        drawing.expect_same(box_grid({37, 26, 25}), options,
                            std::array{loading::clear, loading::load, loading::some_off}[i++ % 3]);
    });
}

TEST(Solids, EveryRuleBodyAndExtentIntoBits) {
    const drawing_of_bits drawing{three_meshes(), {{}}, {{true}}}, one{{tied_bodies(24.0f, 12, 5)}, {{}}, {{true}}};
    for_all_options([&](const vp::solid_options& options) {
        drawing.expect_same(box_grid({70, 26, 25}), options, loading::load);
        one.expect_same(box_grid({64, 26, 25}), options);
    });
}

// Rows from less than a word to more than a warp takes at once.
TEST(Solids, RowsOfEveryLength) {
    for (const int nx : {1, 31, 32, 33, 64, 96, 200, 512, 1030, 2100}) {
        SCOPED_TRACE(nx);
        mesh_data m = tied_bodies(20.0f, 9, 7);
        for (glm::vec3& p : m.positions) p.x *= static_cast<float>(nx) / 20.0f;
        const drawing_of_bits drawing{{m}, {{}}, {{true}}};
        drawing.expect_same(box_grid({nx, 9, 14}), {.rule = vp::fill_rule::even_odd});
        drawing.expect_same(box_grid({nx, 9, 14}), {.rule = vp::fill_rule::nonzero});
        drawing.expect_same(box_grid({nx, 9, 14}), {.rule = vp::fill_rule::even_odd, .extent = vp::solid_extent::outer},
                            loading::load);
    }
}

// ---- lists ----------------------------------------------------------------------------------------------------------

TEST(Solids, EveryRuleBodyAndExtentIntoLists) {
    for_all_options([&](const vp::solid_options& options) {
        expect_same_lists<std::uint32_t>(three_meshes(), id_of_fragment{5}, box_grid({37, 21, 23}), options);
    });
}

// Rows of more entries than a warp sorts, and shorter ones beside them.
TEST(Solids, RowsOfManyCrossings) {
    mesh_data m;
    for (int i = 0; i < 90; ++i)
        add_box(m, {12.5f * static_cast<float>(i), 0.5f, 0.25f * static_cast<float>(i % 7)},
                {12.5f * static_cast<float>(i) + 14.0f, 2.5f, 3.0f}, i % 5 == 4);
    const drawing_of_bits one{{m}, {{}}, {{true}}}, two{{m, tied_bodies(9.0f, 4, 2)}, {{}}, {{true}}};
    for (const auto rule : all_rules) {
        one.expect_same(box_grid({1130, 4, 5}), {.rule = rule}, loading::load);
        two.expect_same(box_grid({1130, 4, 5}), {.rule = rule, .bodies = vp::bodies::draw});
        expect_same_lists<std::uint32_t>({m}, id_of_fragment{2}, box_grid({1130, 4, 5}), {.rule = rule});
    }
}

// ---- grids ----------------------------------------------------------------------------------------------------------

// Parts of a grid, and voxels that are no cubes.
TEST(Solids, Crops) {
    vp::grid g = box_grid({40, 30, 28});
    g.voxel_size = {0.5, 1.0, 0.75};
    const drawing_of_everything everything_drawn{three_meshes(), {{0.0f}}, {{1, 0.5f}}};
    const drawing_of_bits bits{three_meshes(), {{}}, {{true}}};
    for (const auto& [begin, size] :
         {std::pair{glm::ivec3(0, 0, 0), glm::ivec3(9, 30, 28)}, std::pair{glm::ivec3(9, 4, 7), glm::ivec3(31, 17, 13)},
          std::pair{glm::ivec3(5, 11, 12), glm::ivec3(1, 1, 1)}}) {
        SCOPED_TRACE(begin.x);
        for (const auto extent : all_extents)
            for (const auto rule : all_rules) {
                everything_drawn.expect_same(g.crop(begin, size), {.rule = rule, .extent = extent});
                bits.expect_same(g.crop(begin, size), {.rule = rule, .extent = extent});
            }
    }
}

// Extents that the 32-bit raster of the cover does not serve.
TEST(Solids, LongGrids) {
    mesh_data m = tied_bodies(12.0f, 9, 3);
    for (glm::vec3& p : m.positions) p.x *= 700.0f;
    add_box(m, {-2e6f, 1.5f, 2.5f}, {4000.5f, 5.5f, 7.5f}); // in 128 bits
    const drawing_of_bits drawing{{m, tied_bodies(9.0f, 3, 8)}, {{}}, {{true}}};
    for (const auto extent : all_extents)
        for (const auto of : all_bodies) drawing.expect_same(box_grid({9000, 9, 11}), {.bodies = of, .extent = extent});
}

// More rows than 32 bits number, in lists.
TEST(Solids, MoreRowsThan32BitsNumber) {
    mesh_data m = tied_bodies(5.0f, 5, 3);
    append(m, translated(tied_bodies(5.0f, 5, 4), {0.0f, 65990.0f, 65990.0f}));
    expect_same_lists<std::uint32_t>({m, m}, id_of_fragment{1}, box_grid({6, 66000, 66000}),
                                     {.rule = vp::fill_rule::even_odd, .bodies = vp::bodies::draw});
}

// ---- triangles ------------------------------------------------------------------------------------------------------

// Triangles that are cut into work items, along both axes; some in 128 bits, and so many crossings that the call runs
// again.
TEST(Solids, LargeTriangles) {
    mesh_data m;
    add_octahedron(m, {150.0f, 170.5f, 20.0f}, 130.0f);
    add_octahedron(m, {-9000.0f, 20.0f, 10.0f}, 9500.0f, true);
    add_box(m, {10.5f, 3.0f, -1e6f}, {60.0f, 290.5f, 35.5f});
    append(m, long_triangles({90, 300, 70}, 40, 3));
    const drawing_of_bits drawing{{m}, {{}}, {{true}}};
    const vp::grid g = box_grid({90, 300, 70});
    drawing.expect_same(g, {.rule = vp::fill_rule::even_odd});
    drawing.expect_same(g, {.rule = vp::fill_rule::nonzero, .extent = vp::solid_extent::outer});
    const drawing_of_bits two{{m, tied_bodies(90.0f, 3, 3)}, {{}}, {{true}}};
    two.expect_same(g, {.rule = vp::fill_rule::positive, .bodies = vp::bodies::draw});
    two.expect_same(g, {.rule = vp::fill_rule::even_odd});
}

TEST(Solids, ManyDraws) {
    std::vector<mesh_data> meshes;
    for (std::uint32_t i = 0; i < 45; ++i)
        meshes.push_back(i == 7 ? mesh_data{} : tied_bodies(20.0f, 1 + static_cast<int>(i % 2), i));
    const drawing_of_everything drawing{meshes, {{0.0f}, {0.5f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}, {4, 1e6f}}};
    for (const auto of : all_bodies)
        for (const auto extent : all_extents)
            drawing.expect_same(box_grid({33, 18, 19}),
                                {.rule = vp::fill_rule::even_odd, .bodies = of, .extent = extent});
    expect_same_lists<std::uint32_t>(meshes, id_of_fragment{9}, box_grid({33, 18, 19}), vp::each_draw);
}

// ---- calls ----------------------------------------------------------------------------------------------------------

// The third call like those before it is a graph; vertices may change meanwhile, and other calls come in between.
TEST(Solids, RepeatedCalls) {
    const vp::grid g = box_grid({40, 24, 22});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    bit_target<vp::cpu_backend> a{cpu, g.extent};
    bit_target<vp::cuda_backend> b{gpu, g.extent};
    mesh_data m = tied_bodies(22.0f, 6, 2);
    vp::mesh<vp::cuda_backend> on_device(gpu, m.positions, m.triangles);
    for (int i = 0; i < 12; ++i) {
        SCOPED_TRACE(i);
        const vp::solid_options options{.rule = i / 6 == 0 ? vp::fill_rule::even_odd : vp::fill_rule::nonzero};
        if (i % 6 == 3) {
            for (glm::vec3& p : m.positions) p += glm::vec3(0.5f, 1.0f, 0.25f);
            ASSERT_EQ(cudaMemcpy(const_cast<glm::vec3*>(on_device.view().positions.data()), m.positions.data(),
                                 m.positions.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice),
                      cudaSuccess);
        }
        const vp::mesh<vp::cpu_backend> on_host(cpu, m.positions, m.triangles);
        const auto shader = vp::constant(true);
        const vp::status sa = vp::voxelize_solid(cpu, on_host, g, vp::passthrough{}, shader, a, options);
        const vp::status sb = vp::voxelize_solid(gpu, on_device, g, vp::passthrough{}, shader, b, options);
        ASSERT_TRUE(sa.ok() && sb.ok());
        expect_same_counts(sa.counts, sb.counts);
        EXPECT_EQ(sa.solid, sb.solid);
        expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits");
    }
}

// A bad index: the same status on both backends, and targets keep what they held.
TEST(Solids, ABadIndexWritesNothing) {
    const vp::grid g = box_grid({40, 24, 22});
    vp::cuda_backend gpu;
    bit_target<vp::cuda_backend> fb{gpu, g.extent};
    mesh_data m = tied_bodies(22.0f, 6, 2);
    {
        const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
        ASSERT_TRUE(vp::voxelize_solid(gpu, mesh, g, vp::passthrough{}, vp::constant(true), fb).ok());
    }
    const std::vector<std::uint32_t> before = vp::get<0>(fb).to_host(gpu);
    m.triangles[17].y = static_cast<std::uint32_t>(m.positions.size());
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    std::vector<vp::solid_options> options;
    for (const auto rule : all_rules) options.push_back({.rule = rule});
    for (const auto repair : {vp::repair::close_holes, vp::repair::exterior, vp::repair::vote})
        options.push_back({.repair = repair});
    for (const vp::solid_options& o : options) {
        SCOPED_TRACE(static_cast<int>(o.rule) + 10 * static_cast<int>(o.repair));
        const vp::status s =
            vp::voxelize_solid(gpu, view_of(mesh, indices::unknown), g, vp::passthrough{}, vp::constant(true), fb, o);
        EXPECT_EQ(s.code, vp::status_code::index_out_of_range) << s.message();
        EXPECT_EQ(s.triangle, 17u);
        EXPECT_EQ(before, vp::get<0>(fb).to_host(gpu));
    }
}

// Without memory the call says so, and targets keep what they held.
TEST(Solids, NoMemoryWritesNothing) {
    const vp::grid g = box_grid({40, 24, 22});
    counting_resource memory;
    vp::cuda_backend gpu(nullptr, memory);
    bit_target<vp::cuda_backend> fb{gpu, g.extent};
    const mesh_data m = tied_bodies(22.0f, 6, 2);
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    ASSERT_TRUE(vp::voxelize_solid(gpu, mesh, g, vp::passthrough{}, vp::constant(true), fb).ok());
    const std::vector<std::uint32_t> before = vp::get<0>(fb).to_host(gpu);
    gpu.release();
    memory.limit = memory.live + 1000;
    const vp::status s =
        vp::voxelize_solid(gpu, mesh, g, vp::passthrough{}, vp::constant(true), fb, {.rule = vp::fill_rule::positive});
    EXPECT_EQ(s.code, vp::status_code::out_of_memory) << s.message();
    EXPECT_EQ(before, vp::get<0>(fb).to_host(gpu));
}

// In the caller's memory: capacities that are too small are told and nothing is written; a captured call is replayed
// with other vertices.
TEST(Solids, Async) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    const vp::grid g = box_grid({40, 24, 22});
    const stream_owner stream;
    vp::cpu_backend cpu;
    vp::cuda_backend gpu(stream.stream);
    mesh_data m = tied_bodies(22.0f, 6, 2);
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    const draw_type draw{mesh.view(), {}, {true}};
    const std::span<const draw_type> draws(&draw, 1);
    bit_target<vp::cpu_backend> a{cpu, g.extent};
    bit_target<vp::cuda_backend> b{gpu, g.extent};
    const auto expect_same = [&](const vp::solid_options& options, const vp::status& sb) {
        const vp::mesh<vp::cpu_backend> on_host(cpu, m.positions, m.triangles);
        const vp::status sa = vp::voxelize_solid(cpu, on_host, g, vp::passthrough{}, vp::constant(true), a, options);
        ASSERT_TRUE(sb.ok()) << sb.message();
        expect_same_counts(sa.counts, sb.counts);
        EXPECT_EQ(sa.solid, sb.solid);
        expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits");
    };
    for (const auto rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero}) {
        SCOPED_TRACE(static_cast<int>(rule));
        const bool needs_room = rule == vp::fill_rule::nonzero;
        const vp::solid_options options{.rule = rule};
        vp::workspace_limits limits;
        limits.expects_deferred = needs_room; // is not asked
        limits.fragments = needs_room ? 10 : 0;
        std::size_t bytes = vp::solid_workspace_bytes(draws, g, b.view(), options, limits);
        ASSERT_NE(bytes, 0u);
        vp::cuda_backend::buffer<std::byte> memory(gpu, std::size_t{1} << 22);
        const vp::status small =
            vp::voxelize_solid_async(gpu, draws, g, b.view(), options, {memory.data(), bytes - 1, limits});
        EXPECT_EQ(small.code, vp::status_code::capacity_exceeded);
        EXPECT_EQ(small.required.bytes, bytes);
        if (needs_room) {
            const auto before = vp::get<0>(b).to_host(gpu);
            const vp::workspace_view workspace{memory.data(), memory.size(), limits};
            ASSERT_TRUE(vp::voxelize_solid_async(gpu, draws, g, b.view(), options, workspace).ok());
            EXPECT_EQ(vp::read_status(gpu, workspace, &limits).code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(before, vp::get<0>(b).to_host(gpu));
            EXPECT_GT(limits.fragments, 10u);
            limits.fragments += limits.fragments / 2; // the vertices will move
        }
        bytes = vp::solid_workspace_bytes(draws, g, b.view(), options, limits);
        ASSERT_LE(bytes, memory.size());
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        cudaGraph_t graph = nullptr;
        cudaGraphExec_t replay = nullptr;
        ASSERT_EQ(cudaStreamBeginCapture(stream.stream, cudaStreamCaptureModeRelaxed), cudaSuccess);
        ASSERT_TRUE(vp::voxelize_solid_async(gpu, draws, g, b.view(), options, workspace).ok());
        ASSERT_EQ(cudaStreamEndCapture(stream.stream, &graph), cudaSuccess);
        ASSERT_EQ(cudaGraphInstantiate(&replay, graph, 0), cudaSuccess);
        for (int i = 0; i < 3; ++i) {
            ASSERT_EQ(cudaGraphLaunch(replay, stream.stream), cudaSuccess);
            expect_same(options, vp::read_status(gpu, workspace));
            for (glm::vec3& p : m.positions) p += glm::vec3(-0.5f, 0.0f, 0.25f);
            ASSERT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(mesh.view().positions.data()), m.positions.data(),
                                      m.positions.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice, stream.stream),
                      cudaSuccess);
            ASSERT_EQ(cudaStreamSynchronize(stream.stream), cudaSuccess);
        }
        cudaGraphExecDestroy(replay);
        cudaGraphDestroy(graph);
    }
}

// Two instances that lie in the same place, each with vertices of its own.
TEST(Solids, InstancesAreTheCpus) {
    const mesh_data m = tied_bodies(22.0f, 8, 9);
    const vp::grid g = box_grid({40, 24, 22});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const vp::mesh<vp::cpu_backend> here(cpu, m.positions, m.triangles);
    const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
    bit_target<vp::cpu_backend> a{cpu, g.extent};
    bit_target<vp::cuda_backend> b{gpu, g.extent};
    for (const auto extent : {vp::solid_extent::centre, vp::solid_extent::outer})
        for (const auto repair : {vp::repair::none, vp::repair::close_holes}) {
            const vp::solid_options options{.rule = vp::fill_rule::nonzero, .extent = extent, .repair = repair};
            const vp::status sa = vp::voxelize_solid(cpu, here.view(vp::instances{2}), g, vp::passthrough{},
                                                     vp::constant(true), a, options);
            const vp::status sb = vp::voxelize_solid(gpu, there.view(vp::instances{2}), g, vp::passthrough{},
                                                     vp::constant(true), b, options);
            ASSERT_TRUE(sa.ok() && sb.ok()) << sa.message() << sb.message();
            EXPECT_EQ(sa.counts.triangles_in, 2 * m.triangles.size());
            expect_same_counts(sa.counts, sb.counts);
            EXPECT_EQ(sa.solid, sb.solid);
            expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits");
        }
}

// ---- repairs --------------------------------------------------------------------------------------------------------

TEST(Solids, ClosedHoles) {
    const drawing_of_everything all{broken_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    const drawing_of_bits bits{broken_meshes(), {{}}, {{true}}}, one{{broken_meshes()[0]}, {{}}, {{true}}};
    const vp::grid g = box_grid({37, 26, 25});
    for (const std::uint64_t max_edges : {std::uint64_t{3}, ~std::uint64_t{0}})
        for (const auto of : all_bodies) {
            vp::solid_options options{.rule = vp::fill_rule::even_odd,
                                      .bodies = of,
                                      .repair = vp::repair::close_holes,
                                      .max_hole_edges = max_edges};
            bits.expect_same(g, options);
            one.expect_same(g.crop({5, 6, 7}, {20, 9, 11}), options);
            options.rule = vp::fill_rule::nonzero;
            options.extent = vp::solid_extent::outer;
            all.expect_same(g, options);
            expect_same_lists<std::uint32_t>(broken_meshes(), id_of_fragment{5}, g, options);
        }
}

TEST(Solids, ExteriorAndVote) {
    const drawing_of_everything all{broken_meshes(), {{0.0f}, {0.25f}}, {{1, 0.1f}, {2, 3.0f}, {3, -1.0f}}};
    const drawing_of_bits bits{broken_meshes(), {{}}, {{true}}};
    for (const auto of : all_bodies) {
        for (const int closing : {0, 1, 3}) {
            SCOPED_TRACE(closing);
            const vp::solid_options options{.bodies = of, .repair = vp::repair::exterior, .closing = closing};
            bits.expect_same(box_grid({37, 26, 25}), options);
            all.expect_same(box_grid({37, 26, 25}), options, loading::load);
        }
        const vp::solid_options options{.bodies = of, .repair = vp::repair::vote};
        bits.expect_same(box_grid({37, 26, 25}), options);
        all.expect_same(box_grid({64, 26, 25}).crop({3, 5, 2}, {40, 17, 20}), options);
        expect_same_lists<std::uint32_t>(broken_meshes(), id_of_fragment{5}, box_grid({37, 26, 25}), options);
    }
    const drawing_of_bits one{{broken_meshes()[1]}, {{}}, {{true}}};
    one.expect_same(box_grid({130, 41, 43}), {.repair = vp::repair::exterior, .closing = 35});
}

// The whole of a maze is reached, whatever the number of turns.
TEST(Solids, ExteriorOfAMaze) {
    mesh_data m;
    for (int i = 0; i < 6; ++i) { // walls one after the other, each with a gap at another end
        const float x = 4.5f + 5.0f * static_cast<float>(i), low = i % 2 == 0 ? 0.0f : 3.0f, high = low + 20.5f;
        add_quad(m, {x, low, 0.0f}, {x, high, 0.0f}, {x, high, 24.0f}, {x, low, 24.0f}, false);
    }
    for (const float y : {0.0f, 24.0f})
        add_quad(m, {4.5f, y, 0.0f}, {29.5f, y, 0.0f}, {29.5f, y, 24.0f}, {4.5f, y, 24.0f}, false);
    for (const float z : {0.5f, 23.5f})
        add_quad(m, {4.5f, 0.0f, z}, {29.5f, 0.0f, z}, {29.5f, 24.0f, z}, {4.5f, 24.0f, z}, false);
    const drawing_of_bits maze{{m}, {{}}, {{true}}};
    maze.expect_same(box_grid({34, 24, 24}), {.repair = vp::repair::exterior});
    for (const bool is_low_open : {true, false}) { // a long tube, whose one end is the only way in
        mesh_data box;
        add_box(box, {10.5f, 2.5f, 2.5f}, {100.5f, 9.5f, 8.5f});
        const auto first = box.triangles.begin() + (is_low_open ? 0 : 2); // of the face at that end
        box.triangles.erase(first, first + 2);
        const drawing_of_bits tube{{box}, {{}}, {{true}}};
        tube.expect_same(box_grid({110, 12, 12}), {.repair = vp::repair::exterior});
    }
}
