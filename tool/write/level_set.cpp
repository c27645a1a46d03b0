// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "level_set.hpp"

#include "formats/formats.hpp"
#include "model/parallel.hpp"

#include <voxelpipe/core/brick_tile.hpp>
#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

namespace voxelize {
namespace {

float value_at(const channel& c, std::int64_t i) {
    float value = 0;
    std::memcpy(&value, c.data.data() + static_cast<std::size_t>(i) * sizeof(value), sizeof(value));
    return value;
}

struct found_brick {
    std::uint64_t key = 0;
    voxelpipe::brick_mask band, inside;
    std::uint32_t samples = 0; // in the grid
};

// The samples of a brick.
found_brick look_at(const volume& v, const channel& c, float band, const glm::ivec3& brick) {
    found_brick found;
    found.key = voxelpipe::core::morton_key(brick.x, brick.y, brick.z);
    const auto end = [&](int axis) {
        const std::int64_t left = v.extent[static_cast<std::size_t>(axis)] - std::int64_t{8} * brick[axis];
        return static_cast<int>(std::min<std::int64_t>(8, left));
    };
    for (int z = 0; z < end(2); ++z)
        for (int y = 0; y < end(1); ++y)
            for (int x = 0; x < end(0); ++x) {
                const float d = value_at(c, v.index(8 * brick.x + x, 8 * brick.y + y, 8 * brick.z + z));
                const auto bit = static_cast<unsigned>(voxelpipe::core::morton_key(x, y, z));
                const std::uint64_t one = std::uint64_t{1} << (bit % 64);
                if (std::abs(d) < band)
                    found.band.words[bit / 64] |= one;
                else if (d < 0)
                    found.inside.words[bit / 64] |= one;
                ++found.samples;
            }
    return found;
}

// Cubes of consecutive keys, as large as they can be.
std::vector<voxelpipe::brick_tile> tiles_of(const std::vector<std::uint64_t>& keys) {
    std::vector<voxelpipe::brick_tile> tiles;
    for (std::size_t i = 0; i < keys.size();) {
        std::size_t end = i + 1;
        while (end < keys.size() && keys[end] == keys[end - 1] + 1) ++end;
        for (std::uint64_t key = keys[i]; key < keys[end - 1] + 1;) {
            tiles.push_back(voxelpipe::brick_tile::of(key, voxelpipe::core::level_of_tile(key, keys[end - 1] + 1)));
            key = tiles.back().end();
        }
        i = end;
    }
    return tiles;
}

float greatest_of(const channel& c) {
    float greatest = 0;
    for (std::size_t i = 0; i < c.data.size() / sizeof(float); ++i) {
        const float d = std::abs(value_at(c, static_cast<std::int64_t>(i)));
        if (d < std::numeric_limits<float>::infinity()) greatest = std::max(greatest, d);
    }
    return greatest;
}

} // namespace

band_bricks find_band(const volume& v, int threads) {
    threads = thread_count(threads);
    const channel& distances = *v.find("distance");
    const distance_field& field = *v.distances;
    const bool is_whole = !std::isfinite(field.band);
    band_bricks result;
    result.is_level_set = !is_whole && field.is_signed && are_cubic(v.voxel_size);
    result.background = is_whole ? greatest_of(distances) : field.band;

    const glm::ivec3 bricks((v.extent[0] + 7) / 8, (v.extent[1] + 7) / 8, (v.extent[2] + 7) / 8);
    std::vector<std::vector<found_brick>> layers(static_cast<std::size_t>(bricks.z));
    std::vector<std::vector<std::uint64_t>> inner(layers.size());
    parallel_for(layers.size(), threads, [&](std::size_t z) {
        for (int y = 0; y < bricks.y; ++y)
            for (int x = 0; x < bricks.x; ++x) {
                const found_brick b = look_at(v, distances, field.band, {x, y, static_cast<int>(z)});
                const std::uint32_t in_band = b.band.count(), inside = b.inside.count();
                if (in_band != 0 || (result.is_level_set && inside != 0 && inside != 512))
                    layers[z].push_back(b);
                else if (result.is_level_set && inside == 512)
                    inner[z].push_back(b.key);
            }
    });
    std::vector<const found_brick*> sorted;
    for (const auto& layer : layers)
        for (const found_brick& b : layer) sorted.push_back(&b);
    std::sort(sorted.begin(), sorted.end(), [](const found_brick* a, const found_brick* b) { return a->key < b->key; });
    sparse_volume& band = result.band;
    band.shape.extent = v.extent;
    band.shape.origin = v.origin;
    band.shape.voxel_size = v.voxel_size;
    std::uint64_t rank = 0;
    for (const found_brick* b : sorted) {
        band.keys.push_back(b->key);
        band.masks.push_back(b->band);
        band.offsets.push_back(rank);
        if (result.is_level_set) result.inside.push_back(b->inside);
        rank += b->band.count();
    }
    if (!sorted.empty()) band.offsets.push_back(rank);
    std::vector<std::uint64_t> keys;
    for (const auto& layer : inner) keys.insert(keys.end(), layer.begin(), layer.end());
    std::sort(keys.begin(), keys.end());
    result.in_inside = tiles_of(keys);

    const voxelpipe::brick_table table = band.table();
    for (const channel& from : v.channels) {
        channel to{from.name, from.type, from.components, {}};
        const std::size_t size = size_of(from.type) * static_cast<std::size_t>(from.components);
        to.data.resize(static_cast<std::size_t>(rank) * size);
        constexpr std::uint64_t block = 256;
        parallel_for(static_cast<std::size_t>((table.count + block - 1) / block), threads, [&](std::size_t n) {
            for (std::uint64_t b = n * block; b < std::min(table.count, (n + 1) * block); ++b)
                voxelpipe::for_each_voxel_in(table, b, [&](const glm::ivec3& p, std::uint64_t r) {
                    std::memcpy(to.data.data() + static_cast<std::size_t>(r) * size,
                                from.data.data() + static_cast<std::size_t>(v.index(p.x, p.y, p.z)) * size, size);
                });
        });
        band.channels.push_back(std::move(to));
    }
    return result;
}

bool shows_level(const std::filesystem::path& output) {
    const format* const f = find_format(output);
    return f != nullptr && f->needs_occupancy && !f->only_sparse;
}

void add_level(volume& v, double level) {
    v.add("occupancy", scalar::bit);
    const channel& distances = *v.find("distance");
    channel& bits = v.channels.back();
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i)
                if (static_cast<double>(value_at(distances, v.index(i, j, k))) <= level) v.set_bit(bits, i, j, k);
}

std::string cut_band_warning(const volume& v) {
    if (!v.distances || !v.distances->is_signed || !std::isfinite(v.distances->band)) return "";
    const channel& c = *v.find("distance");
    const auto is_cut = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        return value_at(c, v.index(x, y, z)) < v.distances->band;
    };
    const auto& [nx, ny, nz] = v.extent;
    bool cut = false;
    for (std::int64_t z = 0; z < nz && !cut; ++z)
        for (std::int64_t y = 0; y < ny && !cut; ++y) {
            const std::int64_t step =
                z == 0 || z == nz - 1 || y == 0 || y == ny - 1 ? 1 : std::max<std::int64_t>(nx - 1, 1);
            for (std::int64_t x = 0; x < nx && !cut; x += step) cut = is_cut(x, y, z);
        }
    return cut ? "the band is cut off at the grid's sides, where the level set is not closed: --padding of one voxel "
                 "more than the band keeps it whole"
               : "";
}

} // namespace voxelize
