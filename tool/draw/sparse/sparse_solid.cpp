// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_solid.hpp"

#include <voxelpipe/sparse/host_sparse.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>

namespace voxelize {

namespace {

using rgba8 = color_mean::rgba8;

rgba8 mean_of(const channel& colors, const solid_request& request) {
    if (request.means != nullptr) return (*request.means)[static_cast<std::size_t>(*target_named(colors.name))];
    const color_mean mean;
    color_mean::sums sums{};
    add_colors(sums, mean, colors);
    return mean.mean_of(sums);
}

} // namespace

void add_colors(color_mean::sums& to, const color_mean& mean, const channel& colors) {
    for (std::size_t at = 0; at < colors.data.size(); at += 4) {
        rgba8 color;
        std::memcpy(color.data(), colors.data.data() + at, 4);
        mean.add(to, color);
    }
}

void keep_part(sparse_volume& v, const glm::ivec3& offset, const glm::ivec3& extent) {
    if (!v.tiles.empty()) v = open_tiles(v); // some may reach out of the box
    const voxelpipe::brick_table table = v.table();
    std::size_t kept = 0;
    std::uint64_t rank = 0;
    for (std::uint64_t b = 0; b < table.count; ++b) {
        voxelpipe::brick_mask mask;
        const glm::ivec3 origin = table.brick_origin(b);
        for (unsigned w = 0; w < 8; ++w)
            for (std::uint64_t word = v.masks[b].words[w]; word != 0; word &= word - 1) {
                const unsigned bit = 64 * w + static_cast<unsigned>(std::countr_zero(word));
                const glm::ivec3 at = origin + voxelpipe::core::morton_position(bit) - offset;
                const bool is_in =
                    at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < extent.x && at.y < extent.y && at.z < extent.z;
                if (is_in) mask.words[w] |= word & (~word + 1);
            }
        if (mask.count() == 0) continue;
        v.keys[kept] = v.keys[b];
        v.masks[kept] = mask;
        v.offsets[kept++] = rank;
        rank += mask.count();
    }
    v.keys.resize(kept);
    v.masks.resize(kept);
    v.offsets.resize(kept == 0 ? 0 : kept + 1);
    if (kept != 0) v.offsets[kept] = rank;
}

fill_values fill_of(const sparse_volume& surface, target id, const solid_request& request, const body_map* bodies) {
    return {id, request, bodies, [&] { return mean_of(*surface.find(info_of(id).name), request); }};
}

void add_filled(sparse_volume& solid, sparse_volume& surface, std::string_view name, const fill_values& inside) {
    channel from;
    for (channel& c : surface.channels)
        if (c.name == name) from = std::move(c);
    const std::size_t bytes = size_of(from.type) * static_cast<std::size_t>(from.components);
    channel to{from.name, from.type, from.components, {}};
    to.data.resize(static_cast<std::size_t>(solid.num_values()) * bytes);
    std::byte* at = to.data.data();
    std::size_t s = 0; // bricks of the surface, in step with those of the solid
    body_map::labels each;
    for (std::size_t b = 0; b < solid.keys.size(); ++b) {
        while (s < surface.keys.size() && surface.keys[s] < solid.keys[b]) ++s;
        const bool both = s < surface.keys.size() && surface.keys[s] == solid.keys[b];
        std::uint64_t rank = both ? surface.offsets[s] : 0;
        std::optional<std::uint32_t> one = body_map::none;
        if (!inside.is_one()) one = inside.bodies()->of_brick(solid.keys[b], each);
        for (unsigned w = 0; w < 8; ++w) {
            const std::uint64_t touched = both ? surface.masks[s].words[w] : 0;
            for (std::uint64_t all = solid.masks[b].words[w]; all != 0; all &= all - 1, at += bytes) {
                const std::uint64_t bit = all & (~all + 1);
                const auto before = static_cast<unsigned>(std::popcount(touched & (bit - 1)));
                const bool is_touched = (touched & bit) != 0;
                const auto number = 64 * w + static_cast<unsigned>(std::countr_zero(all));
                const std::byte* const value = is_touched ? from.data.data() + (rank + before) * bytes
                                                          : inside.of(one ? *one : each[number]).data();
                std::memcpy(at, value, bytes);
            }
            rank += static_cast<unsigned>(std::popcount(touched));
        }
    }
    for (std::size_t t = 0; t < solid.tiles.size(); ++t, at += bytes) {
        std::optional<std::uint32_t> one = body_map::none;
        if (!inside.is_one()) one = inside.bodies()->of_brick(solid.tiles[t].first(), each);
        std::memcpy(at, inside.of(*one).data(), bytes);
    }
    solid.channels.push_back(std::move(to));
}

} // namespace voxelize
