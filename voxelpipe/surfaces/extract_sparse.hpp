// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract of sparse framebuffers: the surface of bits, or of a field in a band, with the bytes of the dense one. Only
// bricks with a crossed edge are visited, so that memory and time follow the surface. On any backend.

#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/passes/sparse_cells.hpp>

#include <cstdint>
#include <type_traits>
#include <vector>

namespace voxelpipe {

namespace core {

// The first target is there, and has the extent; voxels that do not exist are outside.
template <class Backend, class... Bits>
[[nodiscard]] status validate_sparse_bits(const sparse_framebuffer<Backend, Bits...>& bits, const grid& samples) {
    using target_type = typename pack_element<0, Bits...>::type;
    static_assert(std::is_same_v<typename target_type::value_type, bool>,
                  "voxelpipe: what is inside is said by a first target of bits");
    if (bits.extent() != samples.extent) return failure(status_code::extent_mismatch);
    if (bits.num_values() != 0 && get<0>(bits.contents().values).size() == 0) return failure(status_code::null_view);
    if (get<0>(bits.view().clear_values)) return failure(status_code::bad_surface_options);
    return {};
}

} // namespace core

// As extract, of the first target of a sparse framebuffer: bits; voxels that do not exist are outside. The arrays are
// those of the same bits made dense. bad_surface_options: a clear value that is inside. size_overflow: bricks, and the
// faces of tiles in bricks, beyond what 32 bits number.
template <class Backend, class... Bits, class... Values>
[[nodiscard]] status extract(Backend& backend, const sparse_framebuffer<Backend, Bits...>& from, const grid& samples,
                             surface<Backend, Values...>& out, const extract_options& options = {}) {
    static_assert(sizeof...(Values) == 0, "voxelpipe: a surface that extract makes has no values");
    if (const status s = validate(samples); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    if (options.level != 0.0) return core::failure(status_code::bad_surface_options);
    if (const status s = core::validate_sparse_bits(from, samples); !s.ok()) return s;
    return backend.guard([&]() -> status {
        const core::sparse_samples<Backend> read(backend, from);
        const core::sparse_cells<Backend> cells(backend, read.view());
        if (cells.are_too_many()) return core::too_many_vertices(cells.num_vertices());
        return core::finish_surface(backend, cells, samples, nullptr, nullptr, options, out, status{});
    });
}

// Takes a field in a band, as voxelize_distance makes it of a sparse framebuffer: floats of the first target of `from`,
// whose clear value is the band's distance (core::band_distance). Where it has no sample, the first target of `inside`
// says which are, bits of the same grid, as voxelize_solid makes them by the same rule and repair: these are minus the
// band's distance, and the others plus that. The arrays are those of the dense field of a band that reaches two voxels
// beyond options.level.
template <class Backend, class... Field, class... Bits>
[[nodiscard]] status extract(Backend& backend, const sparse_framebuffer<Backend, Field...>& from,
                             const sparse_framebuffer<Backend, Bits...>& inside, const grid& samples,
                             surface<Backend>& out, const extract_options& options = {}) {
    using field = typename core::pack_element<0, Field...>::type;
    static_assert(std::is_same_v<typename field::value_type, float>, "voxelpipe: a field is a first target of float");
    if (const status s = validate(samples); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    if (const status s = core::validate_sparse_bits(inside, samples); !s.ok()) return s;
    if (from.extent() != samples.extent) return core::failure(status_code::extent_mismatch);
    if (from.num_voxels() != 0 && from.where().offset != inside.where().offset)
        return core::failure(status_code::extent_mismatch);
    if (from.num_values() != 0 && get<0>(from.contents().values).size() == 0)
        return core::failure(status_code::null_view);
    return backend.guard([&]() -> status {
        typename Backend::template buffer<std::uint64_t> counts(backend, 2);
        backend.for_each(2, core::passes::clear_counts{counts.data()});
        const brick_slots<Backend> slots(backend, from);
        core::sparse_samples<Backend> read(backend, inside);
        read.add(backend, from, slots.lookup(), options.level, counts.data());
        const core::sparse_cells<Backend> cells(backend, read.view());
        if (cells.are_too_many()) return core::too_many_vertices(cells.num_vertices());
        typename Backend::template buffer<core::edge_crossing> crossings(backend, cells.num_edges());
        const auto view = from.view();
        const core::passes::sparse_field_view values{read.view(), get<0>(view.values), get<0>(view.clear_values)};
        core::for_each_edge<core::passes::all_axes>(backend, cells,
                                                    core::passes::cross_field<core::passes::sparse_field_view>{
                                                        values, options.level, crossings.data(), counts.data() + 1});
        const std::vector<std::uint64_t> host = counts.to_host(backend);
        status result;
        result.surface.nan_samples = host[0];
        result.surface.made_crossings = host[1];
        return core::finish_surface(backend, cells, samples, crossings.data(), nullptr, options, out, result);
    });
}

} // namespace voxelpipe
