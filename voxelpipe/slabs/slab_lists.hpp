// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A slab of a stream as its sink sees it, and how lists of slabs are joined.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/status.hpp>

#include <cstdint>

namespace voxelpipe::slabs {

// What a sink gets beside a slab's framebuffer or lists.
struct slab {
    grid where;   // a crop of the stream's grid
    status drawn; // of the slab's call: its fragments and voxels
    // Voxels and fragments in the slabs before this one. A-buffers of slabs along z follow each other: these are the
    // offsets at which this one's lists begin.
    std::uint64_t voxels_before = 0, fragments_before = 0;
};

// Appends the lists of a slab along z to those of the slabs before it, as one call with the whole grid orders them.
template <class Payload>
void append(host_abuffer<Payload>& whole, const grid& whole_grid, const slab& s, const host_abuffer<Payload>& part) {
    const glm::ivec3 e = whole_grid.extent, from = s.where.offset - whole_grid.offset;
    whole.extent = e;
    const auto area = static_cast<std::uint64_t>(e.x) * static_cast<std::uint64_t>(e.y);
    for (const std::uint64_t v : part.voxels) whole.voxels.push_back(v + area * static_cast<std::uint64_t>(from.z));
    if (!part.voxels.empty() && !whole.offsets.empty()) whole.offsets.pop_back();
    const std::uint64_t before = whole.primitives.size();
    for (const std::uint64_t o : part.offsets) whole.offsets.push_back(o + before);
    whole.primitives.insert(whole.primitives.end(), part.primitives.begin(), part.primitives.end());
    whole.payloads.insert(whole.payloads.end(), part.payloads.begin(), part.payloads.end());
}

} // namespace voxelpipe::slabs
