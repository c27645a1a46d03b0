// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// label: the connected components of bits, on any backend, with the same bytes (docs/design.md, "Labels").

#include <voxelpipe/core/layout.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/label/voxel_component.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <type_traits>

namespace voxelpipe {

// Written {.connectivity = 26}.
struct label_options {
    // Voxels are neighbours if they share a face (6), a face or an edge (18), or a face, an edge or a corner (26).
    int connectivity = 6;
};

// The label of voxels that are not set.
inline constexpr int no_label = -1;

namespace core {

// Names the call of this module. A backend implements label as run_module(label_tag, backend, bits in linear layout,
// extent, connectivity, labels, buffer of components or null).
struct label_tag {};

[[nodiscard]] inline status validate(const label_options& o) {
    const bool known = o.connectivity == 6 || o.connectivity == 18 || o.connectivity == 26;
    return known ? status{} : failure(status_code::bad_label_options);
}

// Labels of this type number the voxels of a grid.
template <class Label>
[[nodiscard]] status validate_labels(const glm::ivec3& extent) {
    for (int a = 0; a < 3; ++a) {
        if (extent[a] <= 0) return failure(status_code::bad_extent);
        if (extent[a] > grid::max_extent) return failure(status_code::extent_too_large);
    }
    const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
    const std::uint64_t last = wide(extent.x) * wide(extent.y) * wide(extent.z) - 1;
    return last <= static_cast<std::uint64_t>(std::numeric_limits<Label>::max())
               ? status{}
               : failure(status_code::too_many_voxels);
}

namespace passes {

// Word i of the bits of a target, in linear layout.
template <class View>
struct read_bits {
    View from;
    std::uint32_t* words;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto row_words = static_cast<std::uint64_t>((from.extent.x + 31) / 32);
        const std::uint64_t row = i / row_words;
        const int first = static_cast<int>(i % row_words) * 32;
        const int y = static_cast<int>(row % static_cast<std::uint64_t>(from.extent.y)),
                  z = static_cast<int>(row / static_cast<std::uint64_t>(from.extent.y));
        std::uint32_t word = 0;
        for (int bit = 0; bit < 32 && first + bit < from.extent.x; ++bit)
            word |= from(first + bit, y, z) ? std::uint32_t{1} << bit : 0;
        words[i] = word;
    }
};

} // namespace passes

// components: null, or where the table goes.
template <class Backend, class Blend, class Layout, class Label, class LabelBlend>
[[nodiscard]] status find_components(Backend& backend, const target_view<target<bit, Blend, Layout>>& bits,
                                     const target_view<target<Label, LabelBlend>>& labels,
                                     typename Backend::template buffer<voxel_component>* components,
                                     const label_options& options) {
    static_assert(std::is_same_v<Label, std::int32_t> || std::is_same_v<Label, std::int64_t>,
                  "voxelpipe: labels are a target of std::int32_t or std::int64_t");
    if (const status s = validate(options); !s.ok()) return s;
    if (const status s = validate_labels<Label>(bits.extent); !s.ok()) return s;
    if (bits.extent != labels.extent) return failure(status_code::extent_mismatch);
    if (bits.elements == nullptr || labels.elements == nullptr) return failure(status_code::null_view);
    return backend.guard([&]() -> status {
        constexpr bool is_plain = std::is_same_v<Layout, layout::linear>;
        const std::uint64_t words = is_plain ? 0 : storage_map<bit, layout::linear>::cells(bits.extent);
        typename Backend::template buffer<std::uint32_t> made(backend, words);
        if constexpr (!is_plain)
            backend.for_each(words, passes::read_bits<target_view<target<bit, Blend, Layout>>>{bits, made.data()});
        return run_module(label_tag{}, backend, is_plain ? bits.elements : made.data(), bits.extent,
                          options.connectivity, labels.elements, components);
    });
}

} // namespace core

// Labels the set bits by their connected components: each gets the lowest number of the voxels in its component, and
// voxels that are not set get no_label, which is -1. Voxel (i, j, k) has the number i + nx * (j + ny * k). The result
// depends neither on threads nor on the backend. `bits` has any layout; bits of padding are not looked at. `labels` is
// a linear target of std::int32_t, for grids of 2^31 voxels at most, or of std::int64_t, in memory of the backend. The
// call overwrites it; the target's blend and load operation do not matter. A framebuffer that tracks changes does not
// see this write: call its forget_changes afterwards. Fills status::label. Fails with bad_label_options for another
// connectivity, too_many_voxels for a grid whose voxels the labels cannot number, extent_mismatch, bad_extent,
// extent_too_large and null_view, and writes nothing then; labels mean nothing where memory runs out or the device
// fails. Returns after the work is done.
template <class Backend, class Blend, class Layout, class Label, class LabelBlend>
[[nodiscard]] status label(Backend& backend, const target_view<target<bit, Blend, Layout>>& bits,
                           const target_view<target<Label, LabelBlend>>& labels, const label_options& options = {}) {
    typename Backend::template buffer<voxel_component>* const no_list = nullptr; // nvcc deduces nothing from a nullptr
    return core::find_components(backend, bits, labels, no_list, options);
}

// Lists the components too, by ascending names, each with its number of voxels and its bounding box. The list replaces
// what `components` holds; a call that fails leaves that as it is. On a GPU it is of device memory.
template <class Backend, class Blend, class Layout, class Label, class LabelBlend>
[[nodiscard]] status label(Backend& backend, const target_view<target<bit, Blend, Layout>>& bits,
                           const target_view<target<Label, LabelBlend>>& labels,
                           typename Backend::template buffer<voxel_component>& components,
                           const label_options& options = {}) {
    return core::find_components(backend, bits, labels, &components, options);
}

} // namespace voxelpipe
