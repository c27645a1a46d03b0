// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Lists as the source of a sparse framebuffer (cpu_ref/sparse/sparse_pass.hpp): their payloads are all outputs of a
// shader.

#include <cpu_ref/sparse/sparse_pass.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace voxelpipe::cpu {

template <class Payload>
class list_source {
public:
    template <class Backend>
    list_source(const execution& how, const grid& g, const abuffer<Backend, Payload>& lists)
        : offsets_(lists.offsets.data()), payloads_(lists.payloads.data()), voxels_(lists.voxels.data()),
          extent_(g.extent), lead_(g.offset - tile_aligned(g).offset), pairs_(lists.num_voxels()) {
        const glm::ivec3 corner = tile_aligned(g).offset / tile_size;
        constexpr std::size_t block = 65536;
        parallel_for(how.threads, (pairs_.size() + block - 1) / block, [&](unsigned, std::size_t b) {
            const std::size_t last = std::min(pairs_.size(), (b + 1) * block);
            for (std::size_t i = b * block; i < last; ++i)
                pairs_[i] = {core::morton_key(corner + position(i) / tile_size), static_cast<std::uint32_t>(i)};
        });
        if (pairs_.size() == 0) return;
        const glm::ivec3 last = corner + (lead_ + extent_ - 1) / tile_size;
        ranges_ = tile_sort(how, pairs_, core::morton_key(last) + 1);
    }

    [[nodiscard]] std::size_t num_tiles() const { return ranges_.size(); }
    [[nodiscard]] std::uint64_t key(std::size_t i) const { return ranges_[i].tile; }

    struct no_scratch {};
    [[nodiscard]] std::unique_ptr<no_scratch> make_scratch() const { return nullptr; }
    template <class... Targets>
    void draw(std::size_t i, const core::voxel_box& box, bool, const no_scratch*,
              sparse_scratch<Targets...>& scratch) const {
        for (std::size_t p = ranges_[i].first; p < ranges_[i].last; ++p) {
            const std::size_t voxel = pairs_[p].primitive;
            const glm::ivec3 at = position(voxel) - lowest(box);
            for (std::uint64_t f = offsets_[voxel]; f < offsets_[voxel + 1]; ++f)
                blend_in_tile<true>(scratch.view, scratch.shaded, at.z * tile_size + at.y, at.x, at.x, at.y, at.z,
                                    payloads_[f]);
        }
        scratch.end_shaded();
    }

private:
    // The position of a listed voxel, in the grid from the corner of its first tile.
    [[nodiscard]] glm::ivec3 position(std::size_t i) const {
        const auto nx = static_cast<std::uint64_t>(extent_.x), ny = static_cast<std::uint64_t>(extent_.y);
        const std::uint64_t v = voxels_[i];
        return lead_ +
               glm::ivec3(static_cast<int>(v % nx), static_cast<int>(v / nx % ny), static_cast<int>(v / (nx * ny)));
    }
    const std::uint64_t* offsets_;
    const Payload* payloads_;
    const std::uint64_t* voxels_;
    glm::ivec3 extent_, lead_;
    raw_array<tile_pair<std::uint64_t>> pairs_; // tile, and number of a listed voxel
    std::vector<tile_range> ranges_;
};

} // namespace voxelpipe::cpu
