// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The cells that a surface passes between samples of sparse framebuffers, in bricks of 8^3 cells (docs/design.md,
// "Surfaces"). Cells are numbered in the whole grid by their upper samples, so that brick b of cells has the samples of
// brick b and the next ones below. Functors for a backend's for_each.

#include <voxelpipe/surfaces/passes/cells.hpp>
#include <voxelpipe/surfaces/passes/sample_bricks.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Place of a brick in one number, ordered by z, then y, then x: 18 bits an axis.
struct cell_brick_key {
    static constexpr int axis_bits = 18;
    [[nodiscard]] VOXELPIPE_HD static std::uint64_t of(int x, int y, int z) {
        return static_cast<std::uint64_t>(x) | static_cast<std::uint64_t>(y) << axis_bits |
               static_cast<std::uint64_t>(z) << (2 * axis_bits);
    }
    [[nodiscard]] VOXELPIPE_HD static glm::ivec3 place(std::uint64_t key) {
        constexpr std::uint64_t mask = (std::uint64_t{1} << axis_bits) - 1;
        return glm::ivec3(static_cast<int>(key & mask), static_cast<int>(key >> axis_bits & mask),
                          static_cast<int>(key >> (2 * axis_bits)));
    }
};

// The 9^3 samples of a brick of cells.
class brick_corners {
public:
    VOXELPIPE_HD brick_corners(const sample_bricks& samples, const glm::ivec3& brick) {
        for (int half = 0; half < 4; ++half) { // rows of the lower or of the brick's own layers, and rows within them
            const bool own_y = (half & 1) != 0, own_z = (half & 2) != 0;
            const int y = brick.y - (own_y ? 0 : 1), z = brick.z - (own_z ? 0 : 1);
            const std::uint64_t low = samples.find(brick.x - 1, y, z), high = samples.find(brick.x, y, z);
            for (int j = own_z ? 1 : 0; j < (own_z ? 9 : 1); ++j) {
                const int layer = own_z ? j - 1 : 7;
                const std::uint64_t below = samples.layer(low, layer), here = samples.layer(high, layer);
                for (int i = own_y ? 1 : 0; i < (own_y ? 9 : 1); ++i) {
                    const int shift = 8 * (own_y ? i - 1 : 7);
                    rows_[j][i] = static_cast<std::uint16_t>((below >> (shift + 7) & 1u) | (here >> shift & 255u) << 1);
                }
            }
        }
    }
    // The cells of a row, or of a layer, whose samples differ.
    [[nodiscard]] VOXELPIPE_HD unsigned active(int y, int z) const {
        const unsigned a = rows_[z][y], b = rows_[z][y + 1], c = rows_[z + 1][y], d = rows_[z + 1][y + 1];
        const unsigned any = a | b | c | d, all = a & b & c & d;
        return (any | any >> 1) & ~(all & all >> 1) & 255u;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t active(int z) const {
        std::uint64_t layer = 0;
        for (int y = 0; y < 8; ++y) layer |= static_cast<std::uint64_t>(active(y, z)) << (8 * y);
        return layer;
    }
    [[nodiscard]] VOXELPIPE_HD bool has_active() const {
        for (int z = 0; z < 8; ++z)
            if (active(z) != 0) return true;
        return false;
    }
    // Corners of a cell.
    [[nodiscard]] VOXELPIPE_HD int corners(int x, int y, int z) const {
        int c = 0;
        for (int i = 0; i < 4; ++i) c |= (rows_[z + (i >> 1)][y + (i & 1)] >> x & 3) << (2 * i);
        return c;
    }

private:
    std::uint16_t rows_[9][9]; // bit 0 is the sample below the brick
};

// Bricks of cells that may have one with an inside sample: of a brick of samples it and the seven next ones above; of a
// tile those that have samples of its own and others. Each is listed by every brick that it has samples of, and belongs
// to the first of these; without any, to the first tile.
struct brick_candidates {
    sample_bricks samples;
    const std::uint64_t* first_of_tile; // candidate of each tile, from 0

    struct candidate {
        glm::ivec3 place;    // in the whole grid, counted in bricks
        std::uint64_t owner; // as sample_bricks numbers it
    };
    [[nodiscard]] VOXELPIPE_HD candidate at(std::uint64_t i) const {
        const std::uint64_t bricks = samples.num_bricks();
        if (i < 8 * bricks) {
            const std::uint64_t brick = i >> 3, of_field = samples.field.table.count;
            const glm::ivec3 p = morton_position(brick < of_field ? samples.field.table.keys[brick]
                                                                  : samples.bits.table.keys[brick - of_field]);
            const int d = static_cast<int>(i & 7);
            return {glm::ivec3(p.x + (d & 1), p.y + (d >> 1 & 1), p.z + (d >> 2)), brick};
        }
        const std::uint64_t of_tiles = i - 8 * bricks;
        const std::uint32_t tile =
            find_owner(first_of_tile, static_cast<std::uint32_t>(samples.bits.table.num_tiles), of_tiles);
        const brick_tile t = samples.bits.table.tiles[tile];
        const glm::ivec3 p = morton_position(t.first()),
                         s = shell(static_cast<std::int64_t>(of_tiles - first_of_tile[tile]), 1 << t.level());
        return {glm::ivec3(p.x + s.x, p.y + s.y, p.z + s.z), bricks + tile};
    }
    [[nodiscard]] VOXELPIPE_HD bool belongs(const candidate& c) const {
        std::uint64_t first_tile = sample_bricks::none;
        for (int i = 0; i < 8; ++i) {
            const std::uint64_t found =
                samples.find(c.place.x - 1 + (i & 1), c.place.y - 1 + (i >> 1 & 1), c.place.z - 1 + (i >> 2));
            if (found < samples.num_bricks()) return found == c.owner;
            if (first_tile == sample_bricks::none) first_tile = found;
        }
        return first_tile == c.owner;
    }
    // Candidates of a tile of n bricks a side: the outermost ones of (n + 1)^3.
    [[nodiscard]] VOXELPIPE_HD static std::uint64_t shell_size(std::uint64_t n) { return 6 * n * n + 2; }

private:
    [[nodiscard]] VOXELPIPE_HD static glm::ivec3 shell(std::int64_t i, int n) {
        const std::int64_t side = n + 1, plane = side * side;
        const auto narrow = [](std::int64_t v) { return static_cast<int>(v); };
        if (i < plane) return glm::ivec3(narrow(i % side), narrow(i / side), 0);
        i -= plane;
        if (i < plane) return glm::ivec3(narrow(i % side), narrow(i / side), n);
        i -= plane;
        const std::int64_t around = std::int64_t{4} * n;
        const int z = 1 + narrow(i / around);
        i %= around;
        if (i < side) return glm::ivec3(narrow(i), 0, z);
        i -= side;
        if (i < side) return glm::ivec3(narrow(i), n, z);
        i -= side;
        return glm::ivec3((i & 1) != 0 ? n : 0, 1 + narrow(i / 2), z);
    }
};

// Candidates of tile i; the last is 0. Those of a tile too large for 32 bits are 2^32 - 1.
struct count_tile_candidates {
    const brick_tile* tiles;
    std::uint64_t count;
    std::uint32_t* counts;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        constexpr std::uint64_t most = ~std::uint32_t{0};
        const std::uint64_t n = i < count ? brick_candidates::shell_size(std::uint64_t{1} << tiles[i].level()) : 0;
        counts[i] = static_cast<std::uint32_t>(n < most ? n : most);
    }
};
// Whether the surface passes candidate i, which belongs to it; the last is 0.
struct choose_candidates {
    brick_candidates candidates;
    std::uint64_t count;
    std::uint32_t* chosen;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        chosen[i] = 0;
        if (i == count) return;
        const brick_candidates::candidate c = candidates.at(i);
        if (candidates.belongs(c) && brick_corners(candidates.samples, c.place).has_active()) chosen[i] = 1;
    }
};
struct list_cell_bricks {
    brick_candidates candidates;
    const std::uint32_t* chosen;
    const std::uint64_t* places;
    std::uint64_t* keys;
    std::uint32_t* numbers; // go with the keys
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (chosen[i] == 0) return;
        const glm::ivec3 p = candidates.at(i).place;
        keys[places[i]] = cell_brick_key::of(p.x, p.y, p.z);
        numbers[places[i]] = 0;
    }
};

// A brick of cells. Rows of all bricks are numbered as cells are: by z, then y, then x.
struct cell_brick {
    brick_layers active;
    std::uint64_t first_row;
    std::uint32_t y_step, z_step;
    [[nodiscard]] VOXELPIPE_HD std::uint64_t row(int y, int z) const {
        return first_row + static_cast<std::uint64_t>(y) * y_step + static_cast<std::uint64_t>(z) * z_step;
    }
};
// Makes brick i, and counts the cells of its rows; the last count is 0.
struct make_cell_bricks {
    sample_bricks samples;
    const std::uint64_t* keys; // ascending
    std::uint64_t count;
    cell_brick* bricks;
    std::uint32_t* counts; // by row

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count) {
            counts[64 * count] = 0;
            return;
        }
        const glm::ivec3 p = cell_brick_key::place(keys[i]);
        const auto below = [&](int y, int z) { return count_below(keys, count, cell_brick_key::of(0, y, z)); };
        // Before a brick: layers below its own, then eight rows of each brick of its layer that begins below it.
        const std::uint64_t layer = below(0, p.z), row = below(p.y, p.z);
        cell_brick b{};
        b.first_row = 64 * layer + 8 * (row - layer) + (i - row);
        b.y_step = static_cast<std::uint32_t>(below(p.y + 1, p.z) - row);
        b.z_step = static_cast<std::uint32_t>(8 * (below(0, p.z + 1) - layer));
        const brick_corners corners(samples, p);
        for (int z = 0; z < 8; ++z) {
            b.active.layers[z] = corners.active(z);
            for (int y = 0; y < 8; ++y)
                counts[b.row(y, z)] = static_cast<std::uint32_t>(
                    exact::count_ones(static_cast<std::uint32_t>(b.active.layers[z] >> (8 * y) & 255u)));
        }
        bricks[i] = b;
    }
};
// Lists the cells of brick i.
struct list_brick_cells {
    sample_bricks samples;
    const std::uint64_t* brick_keys;
    const cell_brick* bricks;
    const std::uint64_t* first_of_row;
    std::uint64_t* keys;
    std::uint16_t* states; // corners

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::ivec3 p = cell_brick_key::place(brick_keys[i]), o = samples.offset();
        const brick_corners corners(samples, p);
        for (int z = 0; z < 8; ++z)
            for (int y = 0; y < 8; ++y) {
                std::uint64_t at = first_of_row[bricks[i].row(y, z)];
                for (auto left = static_cast<std::uint32_t>(bricks[i].active.layers[z] >> (8 * y) & 255u); left != 0;
                     left &= left - 1) {
                    const int x = exact::lowest_one(left);
                    keys[at] = cell_key::of(8 * p.x + x - o.x, 8 * p.y + y - o.y, 8 * p.z + z - o.z).key;
                    states[at++] = static_cast<std::uint16_t>(corners.corners(x, y, z));
                }
            }
    }
};

// Finds cells by their brick.
struct brick_index {
    const std::uint64_t* keys;
    std::uint64_t count;
    brick_lookup lookup;
    const cell_brick* bricks;
    const std::uint64_t* first_of_row;
    glm::ivec3 offset; // of the part in the whole grid

    // Number of a cell of the part; it is active.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t find(int x, int y, int z) const {
        const int wx = x + offset.x, wy = y + offset.y, wz = z + offset.z;
        brick_table table;
        table.keys = keys;
        table.count = count;
        const cell_brick& b = bricks[lookup.find_brick(table, cell_brick_key::of(wx >> 3, wy >> 3, wz >> 3))];
        const auto row = static_cast<std::uint32_t>(b.active.layers[wz & 7] >> (8 * (wy & 7)) & 255u);
        return static_cast<std::uint32_t>(first_of_row[b.row(wy & 7, wz & 7)]) +
               static_cast<std::uint32_t>(exact::count_ones(row & ((1u << (wx & 7)) - 1)));
    }
};

} // namespace voxelpipe::core::passes
