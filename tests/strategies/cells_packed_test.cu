// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cells of packed formats: every blend, in tiles and by lists, cleared and loaded, and means of floats.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

// Eight targets a call, because each set of targets compiles its own kernels.
using vp::layout::tiled;
TEST(Cells, OfUnorm8x4AreTheCpus) {
    using T = vp::unorm8x4;
    using H = vp::bfloat16;
    compare_cells<vp::target<T, blend::replace>, vp::target<T, blend::add>, vp::target<T, blend::mean>,
                  vp::target<T, blend::min>, vp::target<T, blend::max, tiled>, vp::target<H, blend::add>,
                  vp::target<H, blend::min, tiled>, vp::target<H, blend::max>>();
}
TEST(Cells, OfUnorm1010102AndSnorm8x2AreTheCpus) {
    using T = vp::unorm10_10_10_2;
    using S = vp::snorm8x2;
    compare_cells<vp::target<T, blend::add, tiled>, vp::target<T, blend::mean>, vp::target<T, blend::min>,
                  vp::target<S, blend::replace>, vp::target<S, blend::add>, vp::target<S, blend::mean>,
                  vp::target<S, blend::min>, vp::target<S, blend::max>>();
}
TEST(Cells, OfFloat111110AreTheCpus) {
    using T = vp::float11_11_10;
    using H = vp::bfloat16;
    compare_cells<vp::target<T, blend::replace>, vp::target<T, blend::add>, vp::target<T, blend::mean>,
                  vp::target<T, blend::min>, vp::target<T, blend::max>, vp::target<H, blend::replace>,
                  vp::target<H, blend::mean>, vp::target<vp::unorm10_10_10_2, blend::max>>();
}
TEST(Cells, OfRgb9e5AndSnorm16x4AreTheCpus) {
    using T = vp::rgb9e5;
    using S = vp::snorm16x4;
    compare_cells<vp::target<T, blend::replace>, vp::target<T, blend::add>, vp::target<T, blend::mean>,
                  vp::target<T, blend::min>, vp::target<T, blend::max>, vp::target<S, blend::add>,
                  vp::target<S, blend::min>, vp::target<S, blend::mean>>();
}
TEST(Cells, OfBfloat16VectorsAreTheCpus) {
    compare_cells<vp::target<glm::vec<3, vp::bfloat16>, blend::add, vp::layout::planar>,
                  vp::target<glm::vec<2, vp::bfloat16>, blend::max>, vp::target<vp::half, blend::mean>,
                  vp::target<float, blend::mean>>();
}

// Floats that the target packs once.
struct floats_to_mean {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = mix_bits(f.primitive * 31u + static_cast<std::uint32_t>(f.voxel.x + 64 * f.voxel.y));
        const auto v = any_value<glm::vec4>::make(h, f.barycentric.x);
        return vp::outputs(v, v, glm::vec3(v), glm::vec3(v), v.x).discard_if(h % 5 == 4);
    }
};
template <class Shader>
void compare_means(const Shader& shader) {
    for (const vp::coverage rule : both_rules)
        for (const start how : {start::clear, start::load})
            expect_same<vp::target<vp::unorm8x4, blend::mean>, vp::target<vp::snorm16x4, blend::mean>,
                        vp::target<vp::rgb9e5, blend::mean>, vp::target<vp::float11_11_10, blend::mean>,
                        vp::target<vp::bfloat16, blend::mean>>(mixed_triangles(1500, 40.0f, 8), box_grid({40, 33, 47}),
                                                               vp::passthrough{}, shader, rule, how);
}
TEST(Cells, MeansOfFloatsAreTheCpus) { compare_means(floats_to_mean{}); }
TEST(Cells, MeansOfConstantFloatsAreTheCpus) {
    const glm::vec4 v(0.3f, -0.2f, 1.7f, 0.999f);
    compare_means(vp::constant(v, v, glm::vec3(v), glm::vec3(v), v.x));
}

// Constants that are blended by other passes than fragments of a shader.
TEST(Cells, ConstantsOfPackedFormatsAreTheCpus) {
    const vp::unorm8x4 small(glm::vec4(0.07f, 0.002f, 0.5f, 0.0f));
    const vp::rgb9e5 light(glm::vec3(0.3f, 3.0f, 1000.0f));
    const vp::snorm8x2 signed_pair(glm::vec2(-0.11f, 0.02f));
    for (const start how : {start::clear, start::load}) {
        expect_same<vp::target<vp::unorm8x4, blend::add>, vp::target<vp::unorm8x4, blend::max>,
                    vp::target<vp::rgb9e5, blend::add>, vp::target<vp::snorm8x2, blend::add>,
                    vp::target<vp::bfloat16, blend::add>>(
            mixed_triangles(1500, 40.0f, 9), box_grid({40, 33, 47}), vp::passthrough{},
            vp::constant(small, small, light, signed_pair, vp::bfloat16(0.3f)), vp::coverage::conservative, how);
        expect_same<vp::target<vp::rgb9e5, blend::max>, vp::target<vp::float11_11_10, blend::min>,
                    vp::target<vp::unorm8x4, blend::replace>>(
            mixed_triangles(1500, 40.0f, 9), box_grid({40, 33, 47}), vp::passthrough{},
            vp::constant(light, vp::float11_11_10(glm::vec3(2, 3, 4)), small), vp::coverage::thin, how);
    }
}

// Into bricks: the bytes of the dense target in each voxel that exists.
struct packed_values {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = mix_bits(f.primitive * 31u + static_cast<std::uint32_t>(f.voxel.x + 64 * f.voxel.z));
        const auto v = any_value<glm::vec4>::make(h, f.barycentric.y);
        return vp::outputs(vp::unorm8x4(v), v, vp::rgb9e5(glm::vec3(v)), vp::snorm16x4(v)).discard_if(h % 5 == 4);
    }
};
TEST(Cells, PackedFormatsInBricksAreTheCpus) {
    using u = vp::target<vp::unorm8x4, blend::add>;
    using m = vp::target<vp::unorm8x4, blend::mean>;
    using r = vp::target<vp::rgb9e5, blend::max>;
    using s = vp::target<vp::snorm16x4, blend::add>;
    const vp::grid g = box_grid({40, 33, 47});
    mesh_data drawn = mixed_triangles(1500, 40.0f, 10);
    append(drawn, translated(mixed_triangles(6000, 3.0f, 4), glm::vec3(20.0f))); // voxels of very many fragments
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, u, m, r, s> dense{cpu, g.extent};
    vp::sparse_framebuffer<vp::cpu_backend, u, m, r, s> a{cpu, g.extent};
    vp::sparse_framebuffer<vp::cuda_backend, u, m, r, s> b{gpu, g.extent};
    const vp::mesh<vp::cpu_backend> ma(cpu, drawn.positions, drawn.triangles);
    const vp::mesh<vp::cuda_backend> mb(gpu, drawn.positions, drawn.triangles);
    for (const bool loads : {false, true}) {
        const auto draw = [&](auto& backend, const auto& mesh, auto& fb) {
            if (loads) vp::core::for_each_index<4>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
            vp::voxelize(backend, mesh, g, vp::passthrough{}, packed_values{}, fb).or_throw();
        };
        draw(cpu, ma, dense);
        draw(cpu, ma, a);
        draw(gpu, mb, b);
        const auto ha = a.to_host(cpu), hb = b.to_host(gpu);
        vp::core::for_each_index<4>([&]<std::size_t I>() {
            const auto whole = vp::get<I>(dense).to_host_target(cpu);
            expect_same_bytes(vp::get<I>(ha.values), vp::get<I>(hb.values), "values");
            std::size_t wrong = 0;
            vp::for_each_voxel(whole, [&](const glm::ivec3& p, const auto& v) {
                if (!(vp::get<I>(ha)(p.x, p.y, p.z) == v)) ++wrong;
            });
            EXPECT_EQ(wrong, 0u) << "target " << I;
        });
    }
}

} // namespace
