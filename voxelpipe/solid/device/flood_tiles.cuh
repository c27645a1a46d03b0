// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The flood of repair::exterior, from around the grid, through tiles of 32 x 32 x 16 voxels. A warp has a tile in
// registers, a row a lane, and spreads what is reached until nothing changes; then it wakes the neighbours across whose
// face something new is reached. A tile without walls is reached as a whole. Bits are only ever added, so the set
// depends neither on the order nor on how often a tile is looked at, and warps need not wait for each other.

#include <voxelpipe/solid/device/bit_sweeps.cuh>
#include <voxelpipe/tuning/tuning_solid.hpp>

#include <cstdint>

namespace voxelpipe::device {

enum class tile_reach : std::uint8_t { none, some, all };

// The flood's grid in tiles. Words of a tile: y of the tile, then z. Voxels of a tile beyond the box count as walls.
struct flood_tiles {
    static constexpr int depth = tuning::flood_tile_z;
    static constexpr std::uint64_t words = std::uint64_t{32} * depth; // of a tile
    bit_box box;
    glm::ivec3 count;
    word *walls, *reached;           // of tiles with walls; reached: of tile_reach::some
    std::uint8_t *has_walls, *reach; // reach: a tile_reach
    unsigned* is_awake;              // tiles that have work
    unsigned* changed;               // by launch, whether it changed a tile

    [[nodiscard]] static flood_tiles take(arena& memory, const bit_box& box) {
        flood_tiles t{};
        t.box = box;
        t.count = {(box.extent.x + 31) / 32, (box.extent.y + 31) / 32, (box.extent.z + depth - 1) / depth};
        t.walls = memory.take<word>(t.size() * words);
        t.reached = memory.take<word>(t.size() * words);
        t.has_walls = memory.take<std::uint8_t>(t.size());
        t.reach = memory.take<std::uint8_t>(t.size());
        t.is_awake = memory.take<unsigned>(t.size());
        t.changed = memory.take<unsigned>(tuning::flood_launches);
        return t;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t size() const {
        return static_cast<std::uint64_t>(count.x) * static_cast<std::uint64_t>(count.y) *
               static_cast<std::uint64_t>(count.z);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t number(const glm::ivec3& at) const {
        return (static_cast<std::uint64_t>(at.z) * static_cast<std::uint64_t>(count.y) +
                static_cast<std::uint64_t>(at.y)) *
                   static_cast<std::uint64_t>(count.x) +
               static_cast<std::uint64_t>(at.x);
    }
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 position(std::uint64_t tile) const {
        const auto nx = static_cast<std::uint64_t>(count.x), ny = static_cast<std::uint64_t>(count.y);
        return {static_cast<int>(tile % nx), static_cast<int>(tile / nx % ny), static_cast<int>(tile / nx / ny)};
    }
    [[nodiscard]] VOXELPIPE_HD static std::uint64_t word_of(std::uint64_t tile, int y, int z) {
        return tile * words + static_cast<std::uint64_t>(z * 32 + y);
    }
    // These read what other warps may be writing.
    [[nodiscard]] __device__ VOXELPIPE_INLINE tile_reach reach_now(std::uint64_t tile) const {
        return static_cast<tile_reach>(*const_cast<const volatile std::uint8_t*>(reach + tile));
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool wakes(std::uint64_t tile) const {
        return tile < size() && *const_cast<const volatile unsigned*>(is_awake + tile) != 0;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word reached_now(std::uint64_t tile, int y, int z) const {
        return *const_cast<const volatile word*>(reached + word_of(tile, y, z));
    }
};

// The mask's bits with a ring of untouched voxels around.
template <class Word>
__global__ void place_walls_kernel(const Word* mask, const __grid_constant__ bit_box grid, int ring, Word* walls,
                                   const __grid_constant__ bit_box box) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word_at_box at(box, i);
        walls[i] = grid.bits_from(mask, static_cast<int>(at.word_x) * 32 - ring, at.y - ring, at.z - ring);
    });
}

// Tells which tiles have walls, and copies these. The flood begins in the tiles at the box's faces. A warp a tile.
template <class Word>
__global__ __launch_bounds__(threads_per_block) void start_flood_kernel(const Word* walls,
                                                                        const __grid_constant__ flood_tiles tiles) {
    constexpr int depth = flood_tiles::depth;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const std::uint64_t warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    for (std::uint64_t tile = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block();
         tile < tiles.size(); tile += warps) {
        const glm::ivec3 at = tiles.position(tile);
        const int y = at.y * 32 + lane;
        const auto x = static_cast<std::uint32_t>(at.x);
        const word valid = y < tiles.box.extent.y ? tiles.box.valid_bits(x) : 0;
        word w[depth], any = 0;
        for (int k = 0; k < depth; ++k) {
            const int z = at.z * depth + k;
            const bool is_in = valid != 0 && z < tiles.box.extent.z;
            w[k] = is_in ? walls[tiles.box.first_word(y, z) + x] | ~valid : ~0u;
            any |= w[k];
        }
        const bool has_walls = __any_sync(0xffffffffu, static_cast<int>(any != 0)) != 0;
        if (has_walls)
            for (int k = 0; k < depth; ++k) tiles.walls[flood_tiles::word_of(tile, lane, k)] = w[k];
        if (lane != 0) continue;
        tiles.has_walls[tile] = has_walls ? 1 : 0;
        tiles.reach[tile] = static_cast<std::uint8_t>(tile_reach::none);
        const bool is_outermost = at.x == 0 || at.y == 0 || at.z == 0 || at.x + 1 == tiles.count.x ||
                                  at.y + 1 == tiles.count.y || at.z + 1 == tiles.count.z;
        tiles.is_awake[tile] = is_outermost ? 1 : 0;
    }
}

// The bits of `open` that a run of open bits joins to one of `seeds`, which are open, in a row or in 32 rows at once.
[[nodiscard]] __device__ VOXELPIPE_INLINE word spread_up_along_x(word open, word seeds) {
    // The sum carries through each run from its lowest seed on; what changes by it is reached.
    return seeds | (open & ~(open + seeds));
}
[[nodiscard]] __device__ VOXELPIPE_INLINE word spread_along_x(word open, word seeds) {
    const word up = spread_up_along_x(open, seeds);
    return __brev(spread_up_along_x(__brev(open), __brev(up)));
}
// Along y, from lane to lane. All lanes take part.
[[nodiscard]] __device__ VOXELPIPE_INLINE word spread_along_y(word open, word seeds) {
    const int lane = static_cast<int>(threadIdx.x % 32);
    word up = seeds, down = seeds, run_up = open, run_down = open;
    for (int step = 1; step < 32; step *= 2) {
        const word from_below = __shfl_up_sync(0xffffffffu, up, step),
                   from_above = __shfl_down_sync(0xffffffffu, down, step);
        const word below = __shfl_up_sync(0xffffffffu, run_up, step),
                   above = __shfl_down_sync(0xffffffffu, run_down, step);
        if (lane >= step) up |= from_below & run_up;
        if (lane + step < 32) down |= from_above & run_down;
        run_up &= lane >= step ? below : 0u;
        run_down &= lane + step < 32 ? above : 0u;
    }
    return up | down;
}

// One tile, by a warp; all lanes take part.
class tile_flood {
    static constexpr int depth = flood_tiles::depth;

public:
    __device__ VOXELPIPE_INLINE tile_flood(const flood_tiles& tiles, std::uint64_t tile)
        : tiles_(tiles), tile_(tile), at_(tiles.position(tile)) {}

    // Spreads what the tile and its neighbours have. Returns whether the tile has changed.
    __device__ VOXELPIPE_INLINE bool spread() const {
        const tile_reach before = tiles_.reach_now(tile_);
        if (before == tile_reach::all) return false;
        const bool has_walls = tiles_.has_walls[tile_] != 0;
        word open[depth], now[depth], old[depth];
#pragma unroll
        for (int k = 0; k < depth; ++k) {
            open[k] = has_walls ? ~tiles_.walls[flood_tiles::word_of(tile_, lane_, k)] : ~0u;
            old[k] = before == tile_reach::some ? tiles_.reached[flood_tiles::word_of(tile_, lane_, k)] : 0u;
            now[k] = old[k];
        }
        add_neighbours(now);
        word added = 0;
#pragma unroll
        for (int k = 0; k < depth; ++k) {
            now[k] &= open[k];
            added |= now[k] & ~old[k];
        }
        if (__any_sync(all_lanes, static_cast<int>(added != 0)) == 0) return false;
        if (!has_walls) {
            wake_neighbours(~0u, ~0u, ~0u, ~0u, ~0u, [&] { set(tile_reach::all); });
            return true;
        }
        flood(open, now, old);
        word any = 0;
#pragma unroll
        for (int k = 0; k < depth; ++k) {
            const word news = now[k] & ~old[k];
            if (news != 0 || before == tile_reach::none) tiles_.reached[flood_tiles::word_of(tile_, lane_, k)] = now[k];
            any |= news;
        }
        wake_neighbours(any & 1u, any >> 31, any, now[0] & ~old[0], now[depth - 1] & ~old[depth - 1],
                        [&] { set(tile_reach::some); });
        return true;
    }

private:
    static constexpr unsigned all_lanes = 0xffffffffu;

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool has(const glm::ivec3& at) const {
        return at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < tiles_.count.x && at.y < tiles_.count.y &&
               at.z < tiles_.count.z;
    }
    // Adds the voxels behind which reached ones of the neighbours lie. What is outside of the box is reached.
    __device__ VOXELPIPE_INLINE void add_neighbours(word (&now)[depth]) const {
        const glm::ivec3& extent = tiles_.box.extent;
        const int last_x = at_.x + 1 == tiles_.count.x ? (extent.x - 1) % 32 : 31,
                  last_y = at_.y + 1 == tiles_.count.y ? (extent.y - 1) % 32 : 31,
                  last_z = at_.z + 1 == tiles_.count.z ? (extent.z - 1) % depth : depth - 1;
        for (const int side : {-1, 1}) {
            const face x = face_of({at_.x + side, at_.y, at_.z});
            const int bit = side < 0 ? 0 : last_x, of_other = side < 0 ? 31 : 0;
            if (x.is_any)
#pragma unroll
                for (int k = 0; k < depth; ++k) now[k] |= (word_of(x, lane_, k) >> of_other & 1u) << bit;
            const face y = face_of({at_.x, at_.y + side, at_.z});
            if (y.is_any && lane_ == (side < 0 ? 0 : last_y))
#pragma unroll
                for (int k = 0; k < depth; ++k) now[k] |= word_of(y, side < 0 ? 31 : 0, k);
            const face z = face_of({at_.x, at_.y, at_.z + side});
            if (z.is_any) {
                const word w = word_of(z, lane_, side < 0 ? depth - 1 : 0);
#pragma unroll
                for (int k = 0; k < depth; ++k)
                    if (k == (side < 0 ? 0 : last_z)) now[k] |= w;
            }
        }
    }
    // A neighbour: whether anything of it is reached, and what.
    struct face {
        bool is_any, is_all;
        std::uint64_t tile;
    };
    [[nodiscard]] __device__ VOXELPIPE_INLINE face face_of(const glm::ivec3& at) const {
        if (!has(at)) return {true, true, 0};
        const std::uint64_t tile = tiles_.number(at);
        const tile_reach r = tiles_.reach_now(tile);
        return {r != tile_reach::none, r == tile_reach::all, tile};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word word_of(const face& f, int y, int z) const {
        return f.is_all ? ~0u : tiles_.reached_now(f.tile, y, z);
    }
    // Spreads `now` through `open`. old: what has been spread already.
    __device__ VOXELPIPE_INLINE void flood(const word (&open)[depth], word (&now)[depth],
                                           const word (&old)[depth]) const {
        word done[depth];
#pragma unroll
        for (int k = 0; k < depth; ++k) done[k] = old[k];
        for (bool goes_on = true; goes_on;) {
#pragma unroll
            for (int k = 0; k < depth; ++k) {
                if (__any_sync(all_lanes, static_cast<int>(now[k] != done[k])) == 0) continue;
                for (;;) {
                    const word before = now[k];
                    now[k] = spread_along_y(open[k], spread_along_x(open[k], now[k]));
                    if (__any_sync(all_lanes, static_cast<int>(now[k] != before)) == 0) break;
                }
                done[k] = now[k];
            }
#pragma unroll
            for (int k = 1; k < depth; ++k) now[k] |= now[k - 1] & open[k];
#pragma unroll
            for (int k = depth - 1; k > 0; --k) now[k - 1] |= now[k] & open[k - 1];
            bool is_new = false;
#pragma unroll
            for (int k = 0; k < depth; ++k) is_new = is_new || now[k] != done[k];
            goes_on = __any_sync(all_lanes, static_cast<int>(is_new)) != 0;
        }
    }
    __device__ VOXELPIPE_INLINE void set(tile_reach r) const {
        if (lane_ == 0) *const_cast<volatile std::uint8_t*>(tiles_.reach + tile_) = static_cast<std::uint8_t>(r);
    }
    // Publishes the tile, then wakes those neighbours whose faces have news: at low and high x, in rows y, at low and
    // high z.
    template <class Publish>
    __device__ VOXELPIPE_INLINE void wake_neighbours(word west, word east, word rows, word below, word above,
                                                     Publish&& publish) const {
        __threadfence(); // the words, before the tile's reach
        __syncwarp();
        publish();
        __threadfence(); // both, before the neighbours wake up
        __syncwarp();
        const auto wake = [&](bool is_news, const glm::ivec3& at) {
            if (__any_sync(all_lanes, static_cast<int>(is_news)) == 0 || !has(at)) return;
            const std::uint64_t other = tiles_.number(at);
            if (lane_ == 0 && tiles_.reach_now(other) != tile_reach::all) atomicExch(tiles_.is_awake + other, 1u);
        };
        wake(west != 0, {at_.x - 1, at_.y, at_.z});
        wake(east != 0, {at_.x + 1, at_.y, at_.z});
        wake(lane_ == 0 && rows != 0, {at_.x, at_.y - 1, at_.z});
        wake(lane_ == 31 && rows != 0, {at_.x, at_.y + 1, at_.z});
        wake(below != 0, {at_.x, at_.y, at_.z - 1});
        wake(above != 0, {at_.x, at_.y, at_.z + 1});
    }

    const flood_tiles& tiles_;
    const std::uint64_t tile_;
    const glm::ivec3 at_;
    const int lane_ = static_cast<int>(threadIdx.x % 32);
};

// A warp looks at 32 tiles that lie far apart, and floods those that are awake, several times. launch: ends at once if
// the one before has changed nothing.
template <class Word>
__global__ __launch_bounds__(threads_per_block,
                             tuning::flood_blocks) void flood_tiles_kernel(const __grid_constant__ flood_tiles tiles,
                                                                           int launch, Word* changed) {
    await_stream();
    if (launch > 0 && changed[launch - 1] == 0) return;
    const unsigned lane = threadIdx.x % 32;
    const std::uint64_t warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    bool has_changed = false;
    for (std::uint64_t first = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block();
         first < tiles.size(); first += 32 * warps) {
        const std::uint64_t mine = first + lane * warps;
        for (int pass = 0; pass < tuning::flood_passes; ++pass) {
            // Taken before it is seen what its neighbours have: one that has news after that wakes it again.
            const bool is_awake = tiles.wakes(mine) && atomicExch(tiles.is_awake + mine, 0u) != 0;
            unsigned awake = __ballot_sync(0xffffffffu, static_cast<int>(is_awake));
            if (awake == 0) break;
            __threadfence();
            __syncwarp();
            for (; awake != 0; awake &= awake - 1) {
                const auto k = static_cast<std::uint64_t>(__ffs(static_cast<int>(awake)) - 1);
                has_changed = tile_flood(tiles, first + k * warps).spread() || has_changed;
            }
        }
        // Tiles that are still awake have work for the next launch.
        has_changed = has_changed || tiles.wakes(mine);
    }
    if (has_changed) *const_cast<volatile Word*>(changed + launch) = 1;
}

// Calls f(number, word of the row, y, z) for all words of a box, neighbours by neighbouring lanes; the loads of several
// rows go out together.
template <class F>
__device__ VOXELPIPE_INLINE void for_each_word(const bit_box& box, F&& f) {
    constexpr int batch = 4; // rows
    const auto ny = static_cast<std::uint32_t>(box.extent.y), words_x = box.words_x();
    const std::uint64_t rows = std::uint64_t{ny} * static_cast<std::uint32_t>(box.extent.z),
                        warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    for (std::uint64_t first = (std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block()) * batch;
         first < rows; first += warps * batch) {
        const auto y0 = static_cast<int>(first % ny), z0 = static_cast<int>(first / ny);
        for (std::uint32_t x = threadIdx.x % 32; x < words_x; x += 32)
#pragma unroll
            for (int k = 0; k < batch; ++k) {
                const bool is_next = y0 + k >= box.extent.y; // a later z
                if (first + static_cast<unsigned>(k) >= rows) continue;
                f((first + static_cast<unsigned>(k)) * words_x + x, x, is_next ? (y0 + k) % box.extent.y : y0 + k,
                  is_next ? z0 + (y0 + k) / box.extent.y : z0);
            }
    }
}

// Row-major words of what is reached; is_inverse: of what is not.
template <class Word>
__global__ __launch_bounds__(threads_per_block) void take_reached_kernel(const __grid_constant__ flood_tiles tiles,
                                                                         bool is_inverse, Word* to) {
    for_each_word(tiles.box, [&](std::uint64_t i, std::uint32_t x, int y, int z) {
        constexpr int depth = flood_tiles::depth;
        const std::uint64_t tile = tiles.number({static_cast<int>(x), y / 32, z / depth});
        const auto r = static_cast<tile_reach>(tiles.reach[tile]);
        const word w = r == tile_reach::none  ? 0u
                       : r == tile_reach::all ? ~0u
                                              : tiles.reached[flood_tiles::word_of(tile, y % 32, z % depth)];
        to[i] = (is_inverse ? ~w : w) & tiles.box.valid_bits(x);
    });
}
// Writes the voxels that are not reached, without the ring.
template <class Word>
__global__ void take_interior_kernel(const Word* reached, const __grid_constant__ bit_box box, int ring, Word* mask,
                                     const __grid_constant__ bit_box grid) {
    for_each_number(grid.num_words(), [&](std::uint64_t i) {
        const word_at_box at(grid, i);
        mask[i] = ~box.bits_from(reached, static_cast<int>(at.word_x) * 32 + ring, at.y + ring, at.z + ring) &
                  grid.valid_bits(at.word_x);
    });
}

} // namespace voxelpipe::device
