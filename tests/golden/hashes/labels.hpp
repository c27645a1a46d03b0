// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Labels and lists of components of random bits: by each connectivity, and of 64 bits, of tiled bits.

#include "cases.hpp"

#include <utility>

namespace golden {

// Labels of type Label, components and their number.
template <class Label, class Backend, class Target>
void add_labels_of(Backend& backend, digest& d, const vp::target_view<Target>& bits, int connectivity) {
    vp::framebuffer<Backend, vp::target<Label, vp::blend::replace>> labels{backend, bits.extent};
    typename Backend::template buffer<vp::voxel_component> components(backend, 0);
    const vp::status s =
        vp::label(backend, bits, vp::get<0>(labels).view(), components, {.connectivity = connectivity});
    s.or_throw();
    d.add(s.label.components);
    d.add(vp::get<0>(labels).to_host(backend));
    std::vector<std::int64_t> numbers;
    for (const vp::voxel_component& c : components.to_host(backend))
        for (const std::int64_t n :
             {c.name, static_cast<std::int64_t>(c.voxels), std::int64_t{c.min.x}, std::int64_t{c.min.y},
              std::int64_t{c.min.z}, std::int64_t{c.max.x}, std::int64_t{c.max.y}, std::int64_t{c.max.z}})
            numbers.push_back(n);
    d.add(numbers);
}

// percent: the share of the bits that are set.
template <class Layout, class Label, class Backend>
void random_labels(Backend& backend, digest& d, const glm::ivec3& extent, std::uint32_t percent, int connectivity) {
    using bits = vp::target<vp::bit, vp::blend::bit_or, Layout>;
    std::vector<std::uint32_t> words(bits::map::elements(extent));
    std::uint32_t n = 0;
    for (int z = 0; z < extent.z; ++z)
        for (int y = 0; y < extent.y; ++y)
            for (int x = 0; x < extent.x; ++x)
                bits::map::store(words.data(), extent, x, y, z, mixed(n++, 60) % 100 < percent);
    typename Backend::template buffer<std::uint32_t> memory(backend, vp::array_view<const std::uint32_t>(words));
    add_labels_of<Label>(backend, d, vp::target_view<bits>{memory.data(), extent}, connectivity);
}

template <class Backend>
void add_labels(case_table<Backend>& cases) {
    // Near the share at which a component reaches through the grid.
    for (const auto& [connectivity, percent] : {std::pair{6, 31u}, std::pair{18, 14u}, std::pair{26, 10u}})
        cases.push_back(
            {"label." + std::to_string(connectivity) + ".random",
             [connectivity = connectivity, percent = percent](Backend& backend, digest& d) {
                 random_labels<vp::layout::linear, std::int32_t>(backend, d, {97, 45, 38}, percent, connectivity);
             }});
    cases.push_back({"label.6.tiled", [](Backend& backend, digest& d) {
                         random_labels<vp::layout::tiled, std::int64_t>(backend, d, {65, 31, 20}, 45, 6);
                     }});
}

} // namespace golden
