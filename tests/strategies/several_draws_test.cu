// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Several draws with attributes and varyings, crops, and subsets of a mesh.

#include "cells.hpp"
#include "subset_meshes.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using sum = vp::target<float, blend::add>;

// glm arithmetic on the device, which some versions lose without --expt-relaxed-constexpr.
struct varyings {
    glm::vec3 colour;
    std::array<float, 2> uv;
    vp::flat<std::uint32_t> id;
};
struct moved {
    glm::vec3 offset;
    VOXELPIPE_HD vp::vertex_output<varyings> operator()(const vp::vertex<glm::vec3, std::uint32_t>& v) const {
        const glm::vec3 p = v.position + offset;
        return {p, {vp::get<0>(v), {p.x, p.y}, {vp::get<1>(v) + v.draw}}};
    }
};
struct coloured {
    float scale;
    VOXELPIPE_HD auto operator()(const vp::fragment<varyings>& f) const {
        const varyings c = f.clamped_varyings();
        return vp::outputs(f.varyings.colour, vp::exact::mul(c.uv[1], scale), f.varyings.id.value + f.triangle,
                           f.primitive)
            .discard_if(f.varyings.id.value % 13 == 5);
    }
};

template <class Backend>
struct two_draws {
    using mesh_type = vp::mesh<Backend, glm::vec3, std::uint32_t>;
    using draw_type = vp::draw<vp::mesh_view<glm::vec3, std::uint32_t>, moved, coloured>;
    using framebuffer =
        vp::framebuffer<Backend, vp::target<glm::vec3, blend::add>, vp::target<float, blend::max>,
                        vp::target<std::uint32_t, blend::min>, vp::target<std::uint32_t, blend::replace>>;

    std::vector<mesh_type> meshes;
    std::vector<some_triangles<Backend>> parts;
    std::vector<draw_type> draws;

    explicit two_draws(Backend& be) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            mesh_data m = mixed_triangles(k == 1 ? 0 : 700, 40.0f, 20 + k);
            std::vector<glm::vec3> colours(m.positions.size());
            std::vector<std::uint32_t> ids(m.positions.size());
            for (std::size_t i = 0; i < colours.size(); ++i) {
                colours[i] = glm::vec3(static_cast<float>(i % 17), -static_cast<float>(i % 5), 0.1f);
                ids[i] = static_cast<std::uint32_t>(i / 3);
            }
            meshes.emplace_back(be, m.positions, m.triangles, colours, ids);
            parts.emplace_back(be, m.triangles);
        }
        for (std::size_t k = 0; k < 3; ++k)
            draws.push_back(
                {meshes[k].view(), {glm::vec3(static_cast<float>(k) * 1.25f)}, {0.5f + static_cast<float>(k)}});
    }
};

template <class Backend>
struct outcome {
    vp::status s;
    std::tuple<std::vector<glm::vec3>, std::vector<float>, std::vector<std::uint32_t>, std::vector<std::uint32_t>> data;
};
// How draws are changed: not; the first is a subset of two instances; the last is a subset, and alone.
enum class parts { none, first, last_alone };
template <class Backend>
outcome<Backend> run_draws(const vp::grid& g, vp::coverage rule, parts which = parts::none,
                           vp::strategy strategy = vp::strategy::automatic) {
    Backend be;
    if constexpr (std::is_same_v<Backend, vp::cuda_backend>) be.strategy = strategy;
    two_draws<Backend> scene(be);
    if (which == parts::first) scene.draws[0].mesh = scene.parts[0].of(scene.draws[0].mesh, 2);
    if (which == parts::last_alone) {
        scene.draws[2].mesh = scene.parts[2].of(scene.draws[2].mesh);
        scene.draws.erase(scene.draws.begin(), scene.draws.begin() + 2);
    }
    typename two_draws<Backend>::framebuffer fb{be, g.extent};
    using draw_type = typename two_draws<Backend>::draw_type;
    outcome<Backend> o;
    o.s = vp::voxelize(be, std::span<const draw_type>(scene.draws), g, fb, rule);
    o.data = {vp::get<0>(fb).to_host(be), vp::get<1>(fb).to_host(be), vp::get<2>(fb).to_host(be),
              vp::get<3>(fb).to_host(be)};
    return o;
}

void expect_same_outcome(const outcome<vp::cpu_backend>& a, const outcome<vp::cuda_backend>& b) {
    ASSERT_TRUE(a.s.ok() && b.s.ok()) << b.s.message();
    expect_same_counts(a.s.counts, b.s.counts);
    expect_same_bytes(std::get<0>(a.data), std::get<0>(b.data), "add");
    expect_same_bytes(std::get<1>(a.data), std::get<1>(b.data), "max");
    expect_same_bytes(std::get<2>(a.data), std::get<2>(b.data), "min");
    expect_same_bytes(std::get<3>(a.data), std::get<3>(b.data), "replace");
}

TEST(Pipeline, SeveralDrawsWithVaryingsGiveTheCpusBytes) {
    const vp::grid whole = box_grid({40, 33, 47});
    for (const vp::coverage rule : both_rules)
        for (const vp::grid& g : {whole, whole.crop({7, 3, 11}, {20, 30, 17})})
            expect_same_outcome(run_draws<vp::cpu_backend>(g, rule), run_draws<vp::cuda_backend>(g, rule));
}

// mesh_view::part, listed and in tiles.
TEST(Pipeline, SubsetsGiveTheCpusBytes) {
    const vp::grid g = box_grid({40, 33, 47}).crop({7, 3, 11}, {20, 30, 17});
    for (const parts which : {parts::first, parts::last_alone})
        for (const vp::strategy strategy : {vp::strategy::automatic, vp::strategy::tiled}) {
            SCOPED_TRACE(std::to_string(static_cast<int>(which)) + " " + std::to_string(static_cast<int>(strategy)));
            expect_same_outcome(run_draws<vp::cpu_backend>(g, vp::coverage::thin, which),
                                run_draws<vp::cuda_backend>(g, vp::coverage::thin, which, strategy));
        }
}

TEST(Pipeline, NumbersOfSubsetsThatCannotBeWriteNothing) {
    const mesh_data m = mixed_triangles(50, 20.0f, 31);
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    const vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    vp::framebuffer<vp::cuda_backend, sum> other{be, g.extent};
    vp::abuffer<vp::cuda_backend> lists{be};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok());
    const std::vector<float> before = vp::get<0>(fb).to_host(be);
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<float>>;
    const vp::workspace_limits limits{};
    const auto expect_refused = [&](const std::vector<std::uint32_t>& numbers) {
        const some_triangles some(be, m.triangles, numbers);
        vp::mesh_view<> view = some.of(mesh.view());
        EXPECT_EQ(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(2.0f), fb).code,
                  vp::status_code::bad_subset);
        EXPECT_EQ(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(true), lists).code,
                  vp::status_code::bad_subset);
        view.checked = vp::check_indices(be, view.triangles);
        const draw d{view, {}, vp::constant(2.0f)};
        const std::span<const draw> draws(&d, 1);
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
        EXPECT_EQ(vp::read_status(be, workspace).code, vp::status_code::bad_subset);
        view.part.checked = 1; // the caller's word, and constants need no numbers
        EXPECT_TRUE(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(2.0f), other).ok());
    };
    expect_refused({3, 4, 50}); // beyond the whole
    expect_refused({3, 3, 9});  // twice
    expect_refused({4, 3});     // not ascending
    expect_same_bytes(before, vp::get<0>(fb).to_host(be), "sums");
    EXPECT_EQ(lists.num_voxels(), 0u);
}

} // namespace
