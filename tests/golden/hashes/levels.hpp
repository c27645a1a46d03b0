// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Levels of dense grids, light along six directions, bits that rays meet, and loads onto a framebuffer that holds
// something.

#include "cases.hpp"

#include <voxelpipe/levels/brick_bits.hpp>
#include <voxelpipe/levels/dense_bits.hpp>
#include <voxelpipe/levels/dense_levels.hpp>

#include <glm/vec4.hpp>

namespace golden {

struct level_values {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.normal, true, 1u); }
};
template <class Backend>
using level_targets =
    vp::framebuffer<Backend, vp::target<glm::vec3, vp::blend::add>, vp::target<vp::bit, vp::blend::bit_or>,
                    vp::target<std::uint32_t, vp::blend::count>>;

template <class Backend, class Reducer>
void add_dense_levels(case_table<Backend>& cases, const std::string& name, const Reducer& reducer) {
    for (const char* const mesh : {"torus", "soup"})
        cases.push_back(
            {"levels." + name + '.' + mesh, [mesh, reducer](Backend& backend, digest& d) {
                 level_targets<Backend> fb{backend, odd_grid().extent};
                 const auto drawn = upload(backend, hashed_mesh(mesh));
                 add_counts(d, vp::voxelize(backend, drawn, odd_grid(), vp::passthrough{}, level_values{}, fb));
                 const vp::target_voxels voxels{vp::get<0>(fb).view(), vp::get<1>(fb).view(), vp::get<2>(fb).view()};
                 const auto levels = vp::reduce_levels(backend, odd_grid().extent, voxels, reducer);
                 for (std::size_t l = 0; l < levels.values.size(); ++l) {
                     d.add(levels.values[l].to_host(backend));
                     d.add(levels.exists[l].to_host(backend));
                 }
             }});
}

// ---- light ----------------------------------------------------------------------------------------------------------

[[nodiscard]] VOXELPIPE_HD inline float part_of_one(std::uint32_t h) {
    return vp::exact::mul(static_cast<float>(h >> 8), 0x1p-24f);
}
struct set_finest {
    vp::packed_light* finest;
    std::uint32_t* facings; // or null
    VOXELPIPE_HD void operator()(std::uint64_t n) const {
        const auto i = static_cast<std::uint32_t>(n);
        const float opacity = mixed(i, 1u) % 4u == 0 ? part_of_one(mixed(i, 2u)) : 0.0f;
        finest[n] = vp::pack_light({vp::exact::mul(opacity, part_of_one(mixed(i, 3u))),
                                    vp::exact::mul(opacity, part_of_one(mixed(i, 4u))), vp::exact::mul(opacity, 0.5f),
                                    opacity});
        if (facings == nullptr) return;
        glm::vec3 normal(0.0f);
        normal[static_cast<int>(i % 3u)] = i % 2u == 0 ? 0.6f : -0.6f;
        normal[static_cast<int>((i + 1u) % 3u)] = 0.8f;
        facings[n] = i % 5u == 0 ? 0u : vp::pack_facing(normal);
    }
};
struct sample_finest {
    vp::direction_mips_view mips;
    glm::vec4* out;
    VOXELPIPE_HD void operator()(std::uint64_t n) const {
        const auto i = static_cast<std::uint32_t>(n);
        glm::vec3 at(0.0f), along(0.0f);
        for (int a = 0; a < 3; ++a)
            at[a] = vp::exact::fma(part_of_one(mixed(i, 5u + static_cast<std::uint32_t>(a))),
                                   static_cast<float>(mips.extent[a] + 6), -3.0f);
        along[static_cast<int>(i % 3u)] = 0.6f;
        along[static_cast<int>((i + 1u) % 3u)] = i % 2u == 0 ? 0.8f : -0.8f;
        out[n] = mips.sample(vp::exact::fma(part_of_one(mixed(i, 9u)), 8.0f, -1.0f), at, along);
    }
};

// ---- bits -----------------------------------------------------------------------------------------------------------

struct cast_bit_ray {
    vp::dense_bits bits;
    vp::brick_bits_view bricks;
    glm::ivec4* hits;      // the voxel, and the side; -1 where there is none
    double* distances;     // 0 where there is none
    std::uint8_t* blocked; // in float: 1 by bits, 2 by bricks
    VOXELPIPE_HD void operator()(std::uint64_t n) const {
        const auto i = static_cast<std::uint32_t>(n);
        glm::dvec3 origin(0.0), direction(0.0);
        for (int a = 0; a < 3; ++a) {
            origin[a] = static_cast<double>(mixed(i, static_cast<std::uint32_t>(a)) % 65536u) * 0x1p-10 - 6.0;
            direction[a] = static_cast<double>(mixed(i, static_cast<std::uint32_t>(a) + 3u) % 2049u) * 0x1p-10 - 1.0;
        }
        const vp::voxel_hit hit = bits.first_hit(origin, direction, 100.0);
        hits[n] = hit.found ? glm::ivec4(hit.voxel, hit.axis + (hit.from_above ? 8 : 0)) : glm::ivec4(-1);
        distances[n] = hit.found ? hit.distance : 0;
        const glm::vec3 of(vp::exact::to_float(origin.x), vp::exact::to_float(origin.y), vp::exact::to_float(origin.z)),
            df(vp::exact::to_float(direction.x), vp::exact::to_float(direction.y), vp::exact::to_float(direction.z));
        blocked[n] =
            static_cast<std::uint8_t>((bits.blocks(of, df, 100.0f) ? 1 : 0) + (bricks.blocks(of, df, 100.0f) ? 2 : 0));
    }
};

template <class Backend>
void add_levels(case_table<Backend>& cases) {
    add_dense_levels(cases, "sum", vp::reduce::sum{});
    add_dense_levels(cases, "mean", vp::reduce::mean<0>{});
    add_dense_levels(cases, "mean_of_voxels", vp::reduce::mean_of_voxels{});
    add_dense_levels(cases, "mean_of_volume", vp::reduce::mean_of_volume{});
    add_dense_levels(cases, "min", vp::reduce::min{});
    add_dense_levels(cases, "max", vp::reduce::max{});
    add_dense_levels(cases, "majority", vp::reduce::majority{});
    for (const bool faces : {false, true})
        cases.push_back({std::string("light") + (faces ? ".facings" : ""), [faces](Backend& backend, digest& d) {
                             constexpr std::size_t n = 1500;
                             vp::direction_mips<Backend> mips(backend, {29, 17, 22}, faces);
                             backend.for_each(mips.view().num_voxels(0), set_finest{mips.finest(), mips.facings()});
                             mips.build(backend);
                             for (const vp::packed_light& light : mips.coarse_to_host(backend))
                                 d.add(std::uint64_t{light.xy} << 32 | light.zw);
                             typename Backend::template buffer<glm::vec4> out(backend, n);
                             backend.for_each(n, sample_finest{mips.view(), out.data()});
                             d.add(out.to_host(backend));
                         }});
    for (const char* const mesh : {"open", "soup"})
        cases.push_back(
            {std::string("bits.rays.") + mesh, [mesh](Backend& backend, digest& d) {
                 constexpr std::size_t n = 1500;
                 const glm::ivec3 extent = odd_grid().extent;
                 vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::bit_or>> fb{backend, extent};
                 const auto drawn = upload(backend, hashed_mesh(mesh));
                 add_counts(d, vp::voxelize(backend, drawn, odd_grid(), vp::passthrough{}, vp::constant(true), fb,
                                            vp::coverage::thin));
                 const vp::dense_bits bits(vp::get<0>(fb).view().elements, extent);
                 vp::brick_bits<Backend> bricks(backend, extent);
                 bricks.build(backend, vp::bit_rows{bits});
                 typename Backend::template buffer<glm::ivec4> hits(backend, n);
                 typename Backend::template buffer<double> distances(backend, n);
                 typename Backend::template buffer<std::uint8_t> blocked(backend, n);
                 backend.for_each(n, cast_bit_ray{bits, bricks.view(), hits.data(), distances.data(), blocked.data()});
                 d.add(hits.to_host(backend));
                 d.add(distances.to_host(backend));
                 d.add(blocked.to_host(backend));
             }});
    cases.push_back({"load.targets", [](Backend& backend, digest& d) {
                         level_targets<Backend> fb{backend, odd_grid().extent};
                         vp::get<0>(fb).clear(glm::vec3(0.5f, -2.0f, 0.25f));
                         for (const char* const mesh : {"torus", "soup"}) {
                             const auto drawn = upload(backend, hashed_mesh(mesh));
                             add_counts(d, vp::voxelize(backend, drawn, odd_grid(), vp::passthrough{}, level_values{},
                                                        fb, vp::coverage::thin));
                             vp::get<0>(fb).load();
                             vp::get<2>(fb).load();
                         }
                         d.add(vp::get<0>(fb).to_host(backend));
                         d.add(vp::get<1>(fb).to_host(backend));
                         d.add(vp::get<2>(fb).to_host(backend));
                     }});
}

} // namespace golden
