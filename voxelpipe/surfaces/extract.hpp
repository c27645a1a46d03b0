// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract: the surface of bits, or of a field at a level, as a closed manifold mesh, by dual marching cubes with faces
// flipped (docs/design.md, "Surfaces"). On any backend, with the same bytes.

#include <voxelpipe/surfaces/passes/build.hpp>
#include <voxelpipe/surfaces/passes/samples.hpp>

#include <cstdint>
#include <type_traits>
#include <vector>

namespace voxelpipe {

namespace core {

// The cells that the surface passes and the crossings of a field, null for bits; then finish(cells, crossings, status
// with counts, of which those of samples and crossings are those of the layers `counted`). Options have been checked.
template <class Backend, class T, class Blend, class Layout, class Finish>
[[nodiscard]] status extract_cells(Backend& backend, const target_view<target<T, Blend, Layout>>& from,
                                   const extract_options& options, const Finish& finish,
                                   const passes::counted_layers& counted = {}) {
    constexpr bool is_bit = std::is_same_v<T, bit>;
    static_assert(is_bit || std::is_same_v<T, float>, "voxelpipe: a surface is made of a target of bit or float");
    if (is_bit && options.level != 0.0) return failure(status_code::bad_surface_options);
    if (from.elements == nullptr) return failure(status_code::null_view);
    return backend.guard([&]() -> status {
        using words = typename Backend::template buffer<std::uint32_t>;
        using numbers = typename Backend::template buffer<std::uint64_t>;
        constexpr bool is_plain = is_bit && std::is_same_v<Layout, layout::linear>;
        const glm::ivec3 extent = from.extent;
        words bits(backend, is_plain ? 0 : storage_map<bit, layout::linear>::cells(extent));
        numbers counts(backend, 2);
        backend.for_each(2, passes::clear_counts{counts.data()});
        const std::uint32_t* inside = bits.data();
        if constexpr (is_plain)
            inside = from.elements;
        else
            backend.for_each(bits.size(), passes::read_samples<target_view<target<T, Blend, Layout>>>{
                                              from, options.level, bits.data(), counts.data(), counted});
        const surface_cells<Backend> cells(backend, inside, extent);
        if (cells.are_too_many()) return too_many_vertices(cells.num_vertices());
        status result;
        if constexpr (is_bit) {
            return finish(cells, nullptr, result);
        } else {
            typename Backend::template buffer<edge_crossing> crossings(backend, cells.num_edges());
            for_each_edge<passes::all_axes>(
                backend, cells,
                passes::cross_field<target_view<target<T, Blend, Layout>>>{from, options.level, crossings.data(),
                                                                           counts.data() + 1, counted.cells()});
            const std::vector<std::uint64_t> host = counts.to_host(backend);
            result.surface.nan_samples = host[0];
            result.surface.made_crossings = host[1];
            return finish(cells, crossings.data(), result);
        }
    });
}

} // namespace core

// Makes the surface around the samples that are inside: of bits those that are set, of floats those below
// options.level; NaN is outside, and counted. `from` is a target that has been drawn, of the extent of `samples`, the
// grid whose voxels' centres the samples are (grid::at_corners() where they are corners). The surface replaces what
// `out` holds. Fills status::surface; `from` without anything inside gives an empty surface, which is ok. Bits take no
// level. Returns after the work is done. A call that fails leaves `out` as it is.
template <class Backend, class T, class Blend, class Layout, class... Values>
[[nodiscard]] status extract(Backend& backend, const target_view<target<T, Blend, Layout>>& from, const grid& samples,
                             surface<Backend, Values...>& out, const extract_options& options = {}) {
    static_assert(sizeof...(Values) == 0, "voxelpipe: a surface that extract makes has no values");
    if (const status s = validate(samples); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    if (std::is_same_v<T, bit> && options.level != 0.0) return core::failure(status_code::bad_surface_options);
    if (from.extent != samples.extent) return core::failure(status_code::extent_mismatch);
    const auto finish = [&](const core::surface_cells<Backend>& cells, const core::edge_crossing* crossings,
                            const status& counted) {
        return core::finish_surface(backend, cells, samples, crossings, nullptr, options, out, counted);
    };
    return core::extract_cells(backend, from, options, finish);
}

// The first target of a framebuffer.
template <class Backend, class Target, class... Others, class... Values>
[[nodiscard]] status extract(Backend& backend, const framebuffer<Backend, Target, Others...>& from, const grid& samples,
                             surface<Backend, Values...>& out, const extract_options& options = {}) {
    return extract(backend, get<0>(from.view().targets), samples, out, options);
}

} // namespace voxelpipe
