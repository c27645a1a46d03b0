// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_volume.hpp"

#include "parallel.hpp"
#include "targets.hpp"

#include <voxelpipe/sparse/brick_lookup.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>
#include <voxelpipe/sparse/sparse_merge.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <utility>

namespace voxelize {

std::vector<std::uint32_t> set_voxels(sparse_volume& v, std::span<const glm::ivec3> voxels) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted(voxels.size()); // key of the voxel, place
    for (std::size_t i = 0; i < voxels.size(); ++i)
        sorted[i] = {voxelpipe::core::morton_key(voxels[i]), static_cast<std::uint32_t>(i)};
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> places;
    places.reserve(voxels.size());
    for (const auto& [key, place] : sorted) {
        if (v.keys.empty() || v.keys.back() != key >> 9) {
            v.keys.push_back(key >> 9);
            v.masks.emplace_back();
            v.offsets.push_back(places.size());
        }
        v.masks.back().words[(key & 511U) >> 6] |= std::uint64_t{1} << (key & 63U);
        places.push_back(place);
    }
    if (!places.empty()) v.offsets.push_back(places.size());
    return places;
}

std::uint32_t empty_value(const channel& c) {
    const std::optional<target> id = target_named(c.name);
    return id ? info_of(*id).empty : 0;
}

namespace {

// Reads rows of voxels from bricks and tiles.
class brick_reader {
public:
    explicit brick_reader(const sparse_volume& v)
        : v_(v), log2_slots_(voxelpipe::brick_lookup::log2_slots_for(v.keys.size())) {
        slots_.assign(std::size_t{1} << log2_slots_, voxelpipe::brick_lookup::free_slot);
        for (std::size_t b = 0; b < v.keys.size(); ++b)
            voxelpipe::core::insert_brick(slots_.data(), log2_slots_, v.keys[b], static_cast<std::uint32_t>(b));
    }
    // visit(number from `first` on, rank) for the voxels that exist among `count` in storage order.
    template <class Visit>
    void for_each(std::uint64_t first, std::uint64_t count, const Visit& visit) const {
        const voxelpipe::brick_table table = v_.table();
        const voxelpipe::brick_lookup lookup{slots_.data(), log2_slots_};
        const auto nx = static_cast<std::uint64_t>(v_.shape.extent[0]),
                   ny = static_cast<std::uint64_t>(v_.shape.extent[1]);
        for (std::uint64_t at = first; at < first + count;) {
            const std::uint64_t x = at % nx, end = std::min({first + count - at + x, nx, (x / 8 + 1) * 8});
            const auto y = static_cast<int>(at / nx % ny), z = static_cast<int>(at / (nx * ny));
            const std::uint64_t key = voxelpipe::core::morton_key(static_cast<int>(x / 8), y / 8, z / 8);
            if (const std::uint64_t brick = lookup.find_brick(table, key); brick != voxelpipe::brick_table::none) {
                for (std::uint64_t i = x; i < end; ++i) {
                    const auto bit =
                        static_cast<unsigned>(voxelpipe::core::morton_key(static_cast<int>(i % 8), y % 8, z % 8));
                    if (table.masks[brick].has(bit))
                        visit(at + (i - x) - first, table.offsets[brick] + table.masks[brick].before(bit));
                }
            } else if (const std::uint64_t tile = voxelpipe::core::find_tile(table.tiles, table.num_tiles, key);
                       tile != table.num_tiles) {
                for (std::uint64_t i = x; i < end; ++i) visit(at + (i - x) - first, table.num_in_bricks() + tile);
            }
            at += end - x;
        }
    }

private:
    const sparse_volume& v_;
    int log2_slots_;
    std::vector<std::uint32_t> slots_;
};

// Bytes of a value; 0 of bits.
std::size_t value_bytes(const channel& c) { return size_of(c.type) * static_cast<std::size_t>(c.components); }

// Sets voxels of a brick along x, bit by bit.
void add_row(voxelpipe::brick_mask& mask, int y, int z, std::uint32_t bits) {
    const auto at = static_cast<unsigned>(voxelpipe::core::morton_key(0, y, z));
    const auto four = [](std::uint64_t n) { return (n & 3) | (n & 12) << 6; };
    mask.words[at / 64] |= four(bits & 15) << at % 64;
    mask.words[at / 64 + 1] |= four(bits >> 4) << at % 64;
}

} // namespace

volume as_dense(const sparse_volume& v, std::span<const channel> channels) {
    volume dense = v.shape;
    const auto reader = std::make_shared<brick_reader>(v);
    for (const channel& from : channels) {
        channel to{from.name, from.type, from.components, {}};
        if (from.type == scalar::bit) {
            to.read = [reader](std::uint64_t first, std::span<std::byte> bytes) {
                std::fill(bytes.begin(), bytes.end(), std::byte{0});
                reader->for_each(first, bytes.size(), [&](std::uint64_t i, std::uint64_t) {
                    bytes[static_cast<std::size_t>(i)] = std::byte{1};
                });
            };
        } else {
            const std::size_t size = size_of(from.type) * static_cast<std::size_t>(from.components);
            to.read = [reader, size, &from, empty = empty_value(from)](std::uint64_t first,
                                                                       std::span<std::byte> bytes) {
                std::fill(bytes.begin(), bytes.end(), std::byte{0});
                if (empty != 0) // of four bytes
                    for (std::size_t at = 0; at < bytes.size(); at += sizeof(empty))
                        std::memcpy(bytes.data() + at, &empty, sizeof(empty));
                reader->for_each(first, bytes.size() / size, [&](std::uint64_t i, std::uint64_t rank) {
                    std::memcpy(bytes.data() + i * size, from.data.data() + rank * size, size);
                });
            };
        }
        dense.channels.push_back(std::move(to));
    }
    return dense;
}

sparse_volume join_slabs(std::vector<sparse_volume>&& parts) {
    if (parts.size() == 1) return std::move(parts.front());
    const std::vector<sparse_volume>& from = parts;
    return join_slabs(std::move(parts),
                      [&](std::size_t part, std::size_t c, std::uint64_t first, std::uint64_t count, std::byte* to) {
                          const channel& values = from[part].channels[c];
                          const std::size_t size = value_bytes(values);
                          std::memcpy(to, values.data.data() + first * size, static_cast<std::size_t>(count) * size);
                      });
}

sparse_volume join_slabs(std::vector<sparse_volume>&& parts, const slab_reader& read) {
    struct place {
        std::uint64_t key;
        std::uint32_t part, brick;
    };
    std::vector<place> places;
    std::size_t num_bricks = 0;
    for (const sparse_volume& part : parts) num_bricks += part.keys.size();
    places.reserve(num_bricks); // lists that grow would be held twice
    for (std::size_t p = 0; p < parts.size(); ++p)
        for (std::size_t b = 0; b < parts[p].keys.size(); ++b)
            places.push_back({parts[p].keys[b], static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(b)});
    struct tile_place {
        voxelpipe::brick_tile tile;
        std::size_t part;
        std::uint64_t rank;
    };
    std::vector<tile_place> tiles;
    for (std::size_t p = 0; p < parts.size(); ++p)
        for (std::size_t t = 0; t < parts[p].tiles.size(); ++t)
            tiles.push_back({parts[p].tiles[t], p, parts[p].table().num_in_bricks() + t});
    std::sort(places.begin(), places.end(), [](const place& a, const place& b) { return a.key < b.key; });
    std::sort(tiles.begin(), tiles.end(),
              [](const tile_place& a, const tile_place& b) { return a.tile.bits < b.tile.bits; });
    tiles = voxelpipe::core::join_siblings(std::move(tiles), [&](const tile_place& a, const tile_place& b) {
        for (std::size_t c = 0; c < parts.front().channels.size(); ++c) {
            std::array<std::byte, 16> of_a{}, of_b{};
            if (value_bytes(parts.front().channels[c]) == 0) continue;
            read(a.part, c, a.rank, 1, of_a.data());
            read(b.part, c, b.rank, 1, of_b.data());
            if (of_a != of_b) return false;
        }
        return true;
    });
    sparse_volume result;
    result.shape = parts.front().shape;
    for (const tile_place& at : tiles) result.tiles.push_back(at.tile);
    result.keys.reserve(num_bricks);
    result.masks.reserve(num_bricks);
    result.offsets.reserve(num_bricks + 1);
    std::uint64_t rank = 0;
    for (const place& at : places) {
        result.keys.push_back(at.key);
        result.masks.push_back(parts[at.part].masks[at.brick]);
        result.offsets.push_back(rank);
        rank += result.masks.back().count();
    }
    if (!places.empty()) result.offsets.push_back(rank);
    for (sparse_volume& from : parts) {
        from.keys = decltype(from.keys)(); // = {} would keep the memory
        from.masks = decltype(from.masks)();
    }
    for (std::size_t c = 0; c < parts.front().channels.size(); ++c) {
        const channel& like = parts.front().channels[c];
        channel to{like.name, like.type, like.components, {}};
        const std::size_t size = value_bytes(to); // 0 of bits: every voxel here has them
        to.data.resize(static_cast<std::size_t>(rank + tiles.size()) * size);
        std::byte* out = to.data.data();
        const auto copy = [&](std::size_t part, std::uint64_t first, std::uint64_t count) {
            if (size != 0) read(part, c, first, count, out);
            out += count * size;
        };
        for (const place& at : places) {
            const std::vector<std::uint64_t>& offsets = parts[at.part].offsets;
            copy(at.part, offsets[at.brick], offsets[at.brick + 1] - offsets[at.brick]);
        }
        for (const tile_place& at : tiles) copy(at.part, at.rank, 1);
        for (sparse_volume& from : parts) from.channels[c].data = channel_bytes();
        result.channels.push_back(std::move(to));
    }
    return result;
}

sparse_volume open_tiles(const sparse_volume& v, const std::vector<std::uint64_t>* keys) {
    struct source {
        std::uint64_t rank, count;
        bool repeats; // one value for all
    };
    std::vector<source> from, from_tiles;
    sparse_volume result;
    result.shape = v.shape;
    std::uint64_t rank = 0;
    const voxelpipe::brick_table table = v.table();
    if (keys == nullptr) { // as many as are known; lists that grow would be held twice
        const std::uint64_t inside = table.num_voxels() - table.num_in_bricks();
        const std::uint64_t bricks = table.count + inside / voxelpipe::core::sparse_brick_voxels;
        from.reserve(static_cast<std::size_t>(bricks));
        result.keys.reserve(static_cast<std::size_t>(bricks));
        result.masks.reserve(static_cast<std::size_t>(bricks));
        result.offsets.reserve(static_cast<std::size_t>(bricks) + 1);
    }
    const auto add_brick = [&](std::uint64_t key, const voxelpipe::brick_mask& mask, const source& values) {
        result.keys.push_back(key);
        result.masks.push_back(mask);
        result.offsets.push_back(rank);
        rank += values.count;
        from.push_back(values);
    };
    voxelpipe::brick_mask full;
    std::fill(std::begin(full.words), std::end(full.words), ~std::uint64_t{0});
    voxelpipe::for_each_brick_and_tile(
        table,
        [&](std::uint64_t b) {
            const std::uint64_t first = table.offsets[b];
            add_brick(table.keys[b], table.masks[b], {first, table.offsets[b + 1] - first, false});
        },
        [&](std::uint64_t t) {
            const voxelpipe::brick_tile tile = table.tiles[t];
            const std::uint64_t value = table.num_in_bricks() + t;
            std::uint64_t key = tile.first();
            auto next = keys == nullptr ? std::vector<std::uint64_t>::const_iterator{}
                                        : std::lower_bound(keys->begin(), keys->end(), key);
            while (key < tile.end()) {
                std::uint64_t end = key; // what stays a tile, up to here
                if (keys != nullptr) end = next == keys->end() ? tile.end() : std::min(*next, tile.end());
                while (key < end) {
                    const int level = voxelpipe::core::level_of_tile(key, end);
                    result.tiles.push_back(voxelpipe::brick_tile::of(key, level));
                    from_tiles.push_back({value, 1, true});
                    key = result.tiles.back().end();
                }
                if (key == tile.end()) break;
                add_brick(key++, full, {value, voxelpipe::core::sparse_brick_voxels, true});
                if (keys != nullptr) ++next;
            }
        });
    if (!result.keys.empty()) result.offsets.push_back(rank);
    from.insert(from.end(), from_tiles.begin(), from_tiles.end());
    for (const channel& c : v.channels) {
        channel to{c.name, c.type, c.components, {}};
        const std::size_t size = c.type == scalar::bit ? 0 : size_of(c.type) * static_cast<std::size_t>(c.components);
        to.data.resize(static_cast<std::size_t>(result.num_values()) * size);
        std::byte* at = to.data.data();
        for (const source& s : from) {
            if (size == 0) break; // every voxel here has it
            const std::byte* const values = c.data.data() + s.rank * size;
            for (std::uint64_t i = 0; i < s.count; i += s.repeats ? 1 : s.count) {
                const std::size_t bytes = static_cast<std::size_t>(s.repeats ? 1 : s.count) * size;
                std::memcpy(at, values, bytes);
                at += bytes;
            }
        }
        result.channels.push_back(std::move(to));
    }
    return result;
}

sparse_volume find_bricks(const volume& v, int threads) {
    const channel& bits = *v.occupancy();
    const std::int64_t bricks_x = (v.extent[0] + 7) / 8, bricks_y = (v.extent[1] + 7) / 8;
    const auto layers = static_cast<std::size_t>((v.extent[2] + 7) / 8);
    // The bricks of each layer as they come in storage order, then all by their keys.
    using brick = std::pair<std::uint64_t, voxelpipe::brick_mask>;
    std::vector<std::vector<brick>> found(layers);
    parallel_for(layers, thread_count(threads), [&](std::size_t n) {
        const auto low = 8 * static_cast<std::int64_t>(n);
        std::vector<voxelpipe::brick_mask> masks(static_cast<std::size_t>(bricks_x * bricks_y));
        for (std::int64_t k = low; k < std::min(low + 8, v.extent[2]); ++k)
            for (std::int64_t j = 0; j < v.extent[1]; ++j)
                for (std::int64_t w = 0; w < v.words_per_row(); ++w) {
                    std::uint32_t word = v.word(bits, w, j, k);
                    for (std::int64_t x = 4 * w; word != 0; ++x, word >>= 8)
                        add_row(masks[static_cast<std::size_t>(j / 8 * bricks_x + x)], static_cast<int>(j % 8),
                                static_cast<int>(k % 8), word & 0xffU);
                }
        for (std::int64_t y = 0; y < bricks_y; ++y)
            for (std::int64_t x = 0; x < bricks_x; ++x)
                if (const voxelpipe::brick_mask& mask = masks[static_cast<std::size_t>(y * bricks_x + x)];
                    mask != voxelpipe::brick_mask{})
                    found[n].emplace_back(
                        voxelpipe::core::morton_key(static_cast<int>(x), static_cast<int>(y), static_cast<int>(n)),
                        mask);
    });
    std::vector<const brick*> bricks;
    for (const std::vector<brick>& layer : found)
        for (const brick& b : layer) bricks.push_back(&b);
    std::sort(bricks.begin(), bricks.end(), [](const brick* a, const brick* b) { return a->first < b->first; });
    sparse_volume result;
    result.shape.extent = v.extent;
    result.shape.origin = v.origin;
    result.shape.voxel_size = v.voxel_size;
    std::uint64_t rank = 0;
    for (const brick* b : bricks) {
        result.keys.push_back(b->first);
        result.masks.push_back(b->second);
        result.offsets.push_back(rank);
        rank += b->second.count();
    }
    if (!bricks.empty()) result.offsets.push_back(rank);
    return result;
}

sparse_volume make_sparse(const volume& v, int threads) {
    sparse_volume result = find_bricks(v, threads);
    const std::uint64_t rank = result.num_voxels();
    const voxelpipe::brick_table table = result.table();
    for (const channel& from : v.channels) {
        channel to{from.name, from.type, from.components, {}};
        if (&from != v.occupancy()) {
            const std::size_t size = size_of(from.type) * static_cast<std::size_t>(from.components);
            to.data.resize(static_cast<std::size_t>(rank) * size);
            for (std::uint64_t b = 0; b < table.count; ++b)
                voxelpipe::for_each_voxel_in(table, b, [&](const glm::ivec3& p, std::uint64_t r) {
                    std::memcpy(to.data.data() + static_cast<std::size_t>(r) * size,
                                from.data.data() + static_cast<std::size_t>(v.index(p.x, p.y, p.z)) * size, size);
                });
        }
        result.channels.push_back(std::move(to));
    }
    return result;
}

} // namespace voxelize
