// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_outside.hpp"

#include <voxelpipe/sparse/host_sparse.hpp>

#include <bit>
#include <cstring>

namespace voxelize {

void add_columns(const sparse_volume& v, column_table& to) {
    const column_view place = to.view();
    const voxelpipe::brick_table table = v.table();
    const int begin = to.low.z, end = to.low.z + to.extent.z;
    for (std::uint64_t b = 0; b < table.count; ++b) {
        const int z = table.brick_origin(b).z;
        if (z >= end || z + voxelpipe::core::sparse_brick_size <= begin) continue;
        voxelpipe::for_each_voxel_in(table, b, [&](const glm::ivec3& voxel, std::uint64_t) {
            if (voxel.z < begin || voxel.z >= end) return;
            for (int a = 0; a < 3; ++a)
                if (auto& columns = to.along[static_cast<std::size_t>(a)]; !columns.empty())
                    columns[place.column(a, voxel)].add(voxel[a]);
        });
    }
}

void put_values(const sparse_volume& part, const channel& from, const sparse_volume& v, channel& to) {
    const std::size_t bytes = size_of(to.type) * static_cast<std::size_t>(to.components);
    const std::byte* at = from.data.data();
    std::size_t s = 0; // bricks of V, in step with those of the part
    for (std::size_t b = 0; b < part.keys.size(); ++b) {
        while (v.keys[s] < part.keys[b]) ++s;
        std::uint64_t rank = v.offsets[s];
        for (unsigned w = 0; w < 8; ++w) {
            const std::uint64_t all = v.masks[s].words[w];
            for (std::uint64_t some = part.masks[b].words[w]; some != 0; some &= some - 1, at += bytes) {
                const std::uint64_t bit = some & (~some + 1);
                const auto before = static_cast<unsigned>(std::popcount(all & (bit - 1)));
                std::memcpy(to.data.data() + (rank + before) * bytes, at, bytes);
            }
            rank += static_cast<unsigned>(std::popcount(all));
        }
    }
}

} // namespace voxelize
