// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "level_set.hpp"

#include "formats/dense_stream.hpp"
#include "model/parallel.hpp"

#include <voxelpipe/core/brick_tile.hpp>
#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>

#include <algorithm>
#include <atomic>
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

// A brick of samples; of those of a field that is read piece by piece, where the values of its band begin among those
// of its layer.
struct found_brick {
    std::uint64_t key = 0;
    voxelpipe::brick_mask band, inside;
    std::size_t first_value = 0;
};
// The bricks of a layer of bricks, and of the samples in it the greatest finite distance and whether one within the
// band or inside lies at the grid's sides.
struct found_layer {
    std::vector<found_brick> bricks;            // with a part of the band, or of a level set with both sides
    std::vector<std::uint64_t> inner;           // of a level set: keys of those that lie inside
    std::vector<std::vector<std::byte>> values; // by channel, of the band, in the order of the bricks and their voxels
    float greatest = 0;
    bool is_cut = false;
};

// A field's shape, and what tells its samples apart.
struct field_shape {
    const volume& v;
    float band;
    bool is_level_set;
};

// Looks at a brick. distances: those of its layer of bricks.
void look_at(const field_shape& f, const std::byte* distances, const glm::ivec3& brick, found_layer& to) {
    const volume& v = f.v;
    found_brick found;
    found.key = voxelpipe::core::morton_key(brick.x, brick.y, brick.z);
    const auto end = [&](int axis) {
        const std::int64_t left = v.extent[static_cast<std::size_t>(axis)] - std::int64_t{8} * brick[axis];
        return static_cast<int>(std::min<std::int64_t>(8, left));
    };
    const auto is_side = [&](const glm::ivec3& p) {
        for (int a = 0; a < 3; ++a)
            if (p[a] == 0 || p[a] + 1 == v.extent[static_cast<std::size_t>(a)]) return true;
        return false;
    };
    for (int z = 0; z < end(2); ++z)
        for (int y = 0; y < end(1); ++y)
            for (int x = 0; x < end(0); ++x) {
                const glm::ivec3 p = 8 * brick + glm::ivec3(x, y, z);
                float d = 0;
                std::memcpy(&d, distances + static_cast<std::size_t>(v.index(p.x, p.y, z)) * sizeof(d), sizeof(d));
                const auto bit = static_cast<unsigned>(voxelpipe::core::morton_key(x, y, z));
                const std::uint64_t one = std::uint64_t{1} << (bit % 64);
                if (std::abs(d) < f.band)
                    found.band.words[bit / 64] |= one;
                else if (d < 0)
                    found.inside.words[bit / 64] |= one;
                if (std::abs(d) < std::numeric_limits<float>::infinity())
                    to.greatest = std::max(to.greatest, std::abs(d));
                if (d < f.band && is_side(p)) to.is_cut = true;
            }
    const std::uint32_t inside = found.inside.count();
    if (found.band.count() != 0 || (f.is_level_set && inside != 0 && inside != 512))
        to.bricks.push_back(found);
    else if (f.is_level_set && inside == 512)
        to.inner.push_back(found.key);
}

// Calls visit(place in the layer of bricks, number of the voxel) for the band's voxels of a brick, in Morton order.
template <class Visit>
void for_each_in_band(const volume& v, const found_brick& b, const Visit& visit) {
    const glm::ivec3 origin = voxelpipe::core::morton_position(b.key) * 8;
    std::size_t n = 0;
    for (unsigned bit = 0; bit < 512; ++bit) {
        if (!b.band.has(bit)) continue;
        const glm::ivec3 p = voxelpipe::core::morton_position(bit);
        visit(static_cast<std::size_t>(v.index(origin.x + p.x, origin.y + p.y, p.z)), b.first_value + n++);
    }
}

std::size_t value_size(const channel& c) { return size_of(c.type) * static_cast<std::size_t>(c.components); }

// Bytes of a layer of bricks before it, in a channel of the volume's own memory.
std::size_t bytes_before(const volume& v, const channel& c, int brick_layer) {
    return static_cast<std::size_t>(v.index(0, 0, 8 * static_cast<std::int64_t>(brick_layer))) * value_size(c);
}

// Reads a layer of bricks at a time, and keeps the values of the band.
void read_layers(const field_shape& f, const channel& distances, int threads, const glm::ivec3& bricks,
                 std::vector<found_layer>& layers) {
    const volume& v = f.v;
    std::vector<std::byte> read;
    const auto read_layer = [&](const channel& c, int z) {
        const std::int64_t end = std::min<std::int64_t>(v.extent[2], 8 * (static_cast<std::int64_t>(z) + 1));
        const std::size_t first = bytes_before(v, c, z);
        read.resize(static_cast<std::size_t>(v.index(0, 0, end)) * value_size(c) - first);
        c.read(first / value_size(c), read);
    };
    for (int z = 0; z < bricks.z; ++z) {
        found_layer& layer = layers[static_cast<std::size_t>(z)];
        read_layer(distances, z);
        std::vector<found_layer> rows(static_cast<std::size_t>(bricks.y));
        parallel_for(rows.size(), threads, [&](std::size_t y) {
            for (int x = 0; x < bricks.x; ++x) look_at(f, read.data(), {x, static_cast<int>(y), z}, rows[y]);
        });
        std::size_t kept = 0;
        for (const found_layer& row : rows) {
            layer.greatest = std::max(layer.greatest, row.greatest);
            layer.is_cut = layer.is_cut || row.is_cut;
            layer.inner.insert(layer.inner.end(), row.inner.begin(), row.inner.end());
            for (found_brick b : row.bricks) {
                b.first_value = kept;
                kept += b.band.count();
                layer.bricks.push_back(b);
            }
        }
        const channel* held = &distances; // the channel whose values are in `read`
        for (const channel& c : v.channels) {
            if (held != &c) read_layer(c, z);
            held = &c;
            const std::size_t size = value_size(c);
            std::vector<std::byte>& to = layer.values.emplace_back(kept * size);
            for (const found_brick& b : layer.bricks)
                for_each_in_band(v, b, [&](std::size_t from, std::size_t at) {
                    std::memcpy(to.data() + at * size, read.data() + from * size, size);
                });
        }
    }
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

} // namespace

band_bricks find_band(const volume& v, int threads) {
    threads = thread_count(threads);
    const channel& distances = *v.find("distance");
    const distance_field& field = *v.distances;
    const bool is_whole = !std::isfinite(field.band);
    band_bricks result;
    result.is_level_set = !is_whole && field.is_signed && are_cubic(v.voxel_size);
    const field_shape shape{v, field.band, result.is_level_set};

    const glm::ivec3 bricks((v.extent[0] + 7) / 8, (v.extent[1] + 7) / 8, (v.extent[2] + 7) / 8);
    std::vector<found_layer> layers(static_cast<std::size_t>(bricks.z));
    const bool is_read = distances.read != nullptr;
    if (is_read)
        read_layers(shape, distances, threads, bricks, layers);
    else
        parallel_for(layers.size(), threads, [&](std::size_t z) {
            const std::byte* const there = distances.data.data() + bytes_before(v, distances, static_cast<int>(z));
            for (int y = 0; y < bricks.y; ++y)
                for (int x = 0; x < bricks.x; ++x) look_at(shape, there, {x, y, static_cast<int>(z)}, layers[z]);
        });
    struct place {
        const found_brick* brick;
        std::size_t layer;
    };
    std::vector<place> sorted;
    float greatest = 0;
    for (std::size_t z = 0; z < layers.size(); ++z) {
        for (const found_brick& b : layers[z].bricks) sorted.push_back({&b, z});
        greatest = std::max(greatest, layers[z].greatest);
        result.is_cut = result.is_cut || (!is_whole && field.is_signed && layers[z].is_cut);
    }
    result.background = is_whole ? greatest : field.band;
    std::sort(sorted.begin(), sorted.end(), [](const place& a, const place& b) { return a.brick->key < b.brick->key; });
    sparse_volume& band = result.band;
    band.shape.extent = v.extent;
    band.shape.origin = v.origin;
    band.shape.voxel_size = v.voxel_size;
    std::uint64_t rank = 0;
    for (const place& p : sorted) {
        band.keys.push_back(p.brick->key);
        band.masks.push_back(p.brick->band);
        band.offsets.push_back(rank);
        if (result.is_level_set) result.inside.push_back(p.brick->inside);
        rank += p.brick->band.count();
    }
    if (!sorted.empty()) band.offsets.push_back(rank);
    std::vector<std::uint64_t> keys;
    for (const found_layer& layer : layers) keys.insert(keys.end(), layer.inner.begin(), layer.inner.end());
    std::sort(keys.begin(), keys.end());
    result.in_inside = tiles_of(keys);

    for (std::size_t c = 0; c < v.channels.size(); ++c) {
        const channel& from = v.channels[c];
        channel to{from.name, from.type, from.components, {}};
        const std::size_t size = value_size(from);
        to.data.resize(static_cast<std::size_t>(rank) * size);
        constexpr std::size_t block = 256;
        parallel_for((sorted.size() + block - 1) / block, threads, [&](std::size_t n) {
            for (std::size_t b = n * block; b < std::min(sorted.size(), (n + 1) * block); ++b) {
                const auto& [brick, layer] = sorted[b];
                std::byte* const values = to.data.data() + static_cast<std::size_t>(band.offsets[b]) * size;
                if (is_read) {
                    std::memcpy(values, layers[layer].values[c].data() + brick->first_value * size,
                                brick->band.count() * size);
                    continue;
                }
                const std::byte* const there = from.data.data() + bytes_before(v, from, static_cast<int>(layer));
                for_each_in_band(v, *brick, [&](std::size_t at, std::size_t number) {
                    std::memcpy(values + number * size, there + at * size, size);
                });
            }
        });
        for (found_layer& layer : layers)
            if (is_read) layer.values[c] = {};
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

std::vector<std::filesystem::path> write_distances(volume& v, const std::filesystem::path& output,
                                                   const write_options& options) {
    const format* const f = find_format(output);
    channel* const distances = v.find("distance");
    if (!options.half_distances || f == nullptr || !f->has_halves || distances == nullptr)
        return write(v, output, options);
    std::atomic<bool> overflows = false;
    channel floats = std::move(*distances);
    *distances = halved(floats, overflows);
    std::vector<std::filesystem::path> files = write(v, output, options);
    *distances = std::move(floats);
    if (overflows && options.warn)
        options.warn('"' + output.string() +
                     "\": distances beyond 65504 are infinite in numbers of 16 bits; leave out --half");
    return files;
}

std::string cut_band_warning(const band_bricks& field) {
    return field.is_cut
               ? "the band is cut off at the grid's sides, where the level set is not closed: --padding of one voxel "
                 "more than the band keeps it whole"
               : "";
}

} // namespace voxelize
