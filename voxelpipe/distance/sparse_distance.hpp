// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distances into sparse framebuffers: the samples of the band are the voxels that exist, so memory follows the surface.
// Absent voxels read as the target's clear value, which is plus the band's distance if the caller sets it so; a file of
// a level set finds their sign by flooding from the band.

#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelpipe {

namespace core {

// Names the call of a backend: draws, sample grid, sparse framebuffer, options, number of triangles.
struct sparse_distance_tag {};

} // namespace core

// As voxelize_distance into a framebuffer, but samples beyond the band have no fragment: their voxels do not exist. The
// sparse framebuffer has the extent of core::sample_grid. With band::whole every voxel exists.
template <class Backend, class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] status
voxelize_distance(Backend& backend, std::span<const draw<Mesh, VertexShader, DistanceShader>> draws, const grid& g,
                  sparse_framebuffer<Backend, Targets...>& fb, const distance_options& options = {}) {
    if constexpr (core::distance_fits_targets<Mesh, VertexShader, DistanceShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g); !s.ok()) return s;
        const grid samples = core::sample_grid(g, options.sample);
        if (const status s = core::validate_sparse(fb, samples); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return run_module(core::clear_sparse_tag{}, backend, samples, fb);
        return core::name_bad_triangle(
            backend, draws,
            run_module(core::sparse_distance_tag{}, backend, draws, samples, fb, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

} // namespace voxelpipe
