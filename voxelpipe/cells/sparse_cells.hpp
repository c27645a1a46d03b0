// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cut cells into sparse framebuffers: voxels that are cut or inside exist, and what lies untouched inside is tiles
// where the shader allows it, so that memory follows the surface.

#include <voxelpipe/cells/cells.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelpipe {

namespace core {

// Names the call of a backend: draws, grid, sparse framebuffer, options, number of triangles.
struct sparse_cells_tag {};

// True of values that are equal iff their bits are.
template <class T>
inline constexpr bool is_its_bits = is_scalar<T> || vector_traits<T>::components != 1 || is_packed<T>;

// True if cells of such a shader may make tiles.
template <class CellShader, class... Targets>
inline constexpr bool may_make_cell_tiles = ignores_voxel<CellShader> &&
                                            (is_its_bits<typename Targets::value_type> && ...);

// True if a call makes tiles: its shader ignores the voxel, all targets start anew, and none keeps sums.
template <class CellShader, class Backend, class... Targets>
[[nodiscard]] bool makes_cell_tiles(const sparse_framebuffer<Backend, Targets...>& fb) {
    bool keeps_sums = false;
    for_each_index<sizeof...(Targets)>(
        [&]<std::size_t I>() { keeps_sums = keeps_sums || voxelpipe::get<I>(fb.targets()).keeps_sums; });
    return may_make_cell_tiles<CellShader, Targets...> && !keeps_sums && !keeps_voxels(fb);
}

} // namespace core

// As voxelize_cells into a framebuffer: made dense, the result equals that bit for bit, with the same status. A shader
// with `static constexpr bool ignores_voxel = true`, such as vp::fraction, promises that what it returns does not
// depend on cell_fragment::voxel. Where it keeps that promise, all targets are cleared, none keeps sums and their
// values are numbers, bricks whose voxels all exist and have one value are tiles, the largest cubes of them that are
// aligned with the whole grid; it is called once for the voxels of a row between two that are cut, and memory and time
// follow the surface. Otherwise every voxel with a fragment is listed with its outputs before it gets its place: in
// proportion to the volume, at most 2^32 - 2 voxels. A crop has the bricks of the whole, and merge() joins crops to the
// bytes of the whole. Rows are those that triangles reach: grids of up to 2^20 voxels an axis.
template <class Backend, class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status voxelize_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                    const grid& g, sparse_framebuffer<Backend, Targets...>& fb,
                                    const cell_options& options = {}) {
    if constexpr (core::cell_fits_targets<Mesh, VertexShader, CellShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options); !s.ok()) return s;
        if (const status s = core::validate_sparse(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return run_module(core::clear_sparse_tag{}, backend, g, fb);
        return core::name_bad_triangle(
            backend, draws,
            run_module(core::sparse_cells_tag{}, backend, draws, g, fb, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

} // namespace voxelpipe
