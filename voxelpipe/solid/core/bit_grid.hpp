// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A dense grid of bits in rows along x, for the repairs of solids: dilation by a box, and a flood. On the host.

#include <voxelpipe/core/threads.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelpipe::core {

class bit_grid {
public:
    explicit bit_grid(glm::ivec3 extent)
        : extent_(extent), words_((static_cast<std::size_t>(extent.x) + 63) / 64),
          bits_(words_ * static_cast<std::size_t>(extent.y) * static_cast<std::size_t>(extent.z)) {}

    [[nodiscard]] glm::ivec3 extent() const { return extent_; }
    [[nodiscard]] std::size_t words() const { return words_; } // of 64 bits, in a row
    [[nodiscard]] std::uint64_t* row(int y, int z) { return bits_.data() + first(y, z); }
    [[nodiscard]] const std::uint64_t* row(int y, int z) const { return bits_.data() + first(y, z); }
    void set(int x, int y, int z) { row(y, z)[x / 64] |= std::uint64_t{1} << (x % 64); }
    void flip(int x, int y, int z) { row(y, z)[x / 64] ^= std::uint64_t{1} << (x % 64); }

    // Sets the 32 bits from x on, a multiple of 32 plus `shift`; those beyond the extent must be 0.
    void set_bits(int x, int y, int z, std::uint32_t bits) {
        std::uint64_t* const r = row(y, z);
        const int at = x % 64;
        r[x / 64] |= std::uint64_t{bits} << at;
        if (at > 32 && bits >> (64 - at) != 0) r[x / 64 + 1] |= std::uint64_t{bits} >> (64 - at);
    }
    // Flips the 32 bits from x on, a multiple of 32; those beyond the extent must be 0.
    void flip_bits(int x, int y, int z, std::uint32_t bits) { row(y, z)[x / 64] ^= std::uint64_t{bits} << (x % 64); }
    // The 32 bits from x on; 0 beyond the row.
    [[nodiscard]] std::uint32_t get_bits(int x, int y, int z) const {
        const std::uint64_t* const r = row(y, z);
        const auto i = static_cast<std::size_t>(x) / 64;
        const int at = x % 64;
        std::uint64_t w = r[i] >> at;
        if (at > 32 && i + 1 < words_) w |= r[i + 1] << (64 - at);
        return static_cast<std::uint32_t>(w);
    }
    // All rows, by y, then z.
    [[nodiscard]] const std::uint64_t* data() const { return bits_.data(); }
    // Keeps the layers [first, first + count) along z.
    void keep_layers(int first_layer, int count) {
        const std::size_t layer = words_ * static_cast<std::size_t>(extent_.y);
        const auto begin = bits_.begin() + static_cast<std::ptrdiff_t>(layer * static_cast<std::size_t>(first_layer));
        const std::size_t kept = layer * static_cast<std::size_t>(count);
        std::copy(begin, begin + static_cast<std::ptrdiff_t>(kept), bits_.begin());
        bits_.resize(kept);
        extent_.z = count;
    }
    // Bits of the last word that belong to the row.
    [[nodiscard]] std::uint64_t last_word() const {
        return extent_.x % 64 == 0 ? ~std::uint64_t{0} : (std::uint64_t{1} << (extent_.x % 64)) - 1;
    }

private:
    [[nodiscard]] std::size_t first(int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(extent_.y) + static_cast<std::size_t>(y)) *
               words_;
    }
    glm::ivec3 extent_;
    std::size_t words_;
    std::vector<std::uint64_t> bits_;
};

namespace detail {

// a |= a moved down by `by` bits (towards lower x).
inline void or_shifted_down(std::uint64_t* a, std::size_t n, int by) {
    const auto words = static_cast<std::size_t>(by) / 64;
    const int bits = by % 64;
    for (std::size_t i = 0; i + words < n; ++i) {
        std::uint64_t w = a[i + words] >> bits;
        if (bits != 0 && i + words + 1 < n) w |= a[i + words + 1] << (64 - bits);
        a[i] |= w;
    }
}
inline void or_shifted_up(std::uint64_t* a, std::size_t n, int by) {
    const auto words = static_cast<std::size_t>(by) / 64;
    const int bits = by % 64;
    for (std::size_t i = n; i-- > words;) {
        std::uint64_t w = a[i - words] << bits;
        if (bits != 0 && i > words) w |= a[i - words - 1] >> (64 - bits);
        a[i] |= w;
    }
}

// Calls step(k) so that steps of a |= a moved by k reach all distances up to r.
template <class Step>
void by_doubling(int r, const Step& step) {
    int reached = 0;
    while (reached < r) {
        const int k = std::min(reached + 1, r - reached);
        step(k);
        reached += k;
    }
}

} // namespace detail

// Sets every bit within r of a bit that is set, in the max norm. What lies beyond the grid is not set.
inline void dilate(bit_grid& g, int r, unsigned threads) {
    if (r == 0) return;
    const glm::ivec3 e = g.extent();
    const std::size_t n = g.words();
    const auto or_row = [&](std::uint64_t* to, const std::uint64_t* from) {
        for (std::size_t i = 0; i < n; ++i) to[i] |= from[i];
    };
    parallel_for(threads, static_cast<std::size_t>(e.z), [&](unsigned, std::size_t slice) {
        const auto z = static_cast<int>(slice);
        for (int y = 0; y < e.y; ++y) {
            std::uint64_t* const row = g.row(y, z);
            // Up and down one after the other cover all distances from -r to r.
            detail::by_doubling(r, [&](int k) { detail::or_shifted_up(row, n, k); });
            row[n - 1] &= g.last_word();
            detail::by_doubling(r, [&](int k) { detail::or_shifted_down(row, n, k); });
        }
    });
    // Ascending, row i takes row i + k before that is changed; descending, row i takes row i - k.
    const auto along = [&](int count, const auto& row_at) {
        detail::by_doubling(r, [&](int k) {
            for (int i = 0; i + k < count; ++i) or_row(row_at(i), row_at(i + k));
        });
        detail::by_doubling(r, [&](int k) {
            for (int i = count - 1; i >= k; --i) or_row(row_at(i), row_at(i - k));
        });
    };
    parallel_for(threads, static_cast<std::size_t>(e.z),
                 [&](unsigned, std::size_t z) { along(e.y, [&](int i) { return g.row(i, static_cast<int>(z)); }); });
    parallel_for(threads, static_cast<std::size_t>(e.y),
                 [&](unsigned, std::size_t y) { along(e.z, [&](int i) { return g.row(static_cast<int>(y), i); }); });
}

// ---- flood ----------------------------------------------------------------------------------------------------------

// The bits of `open` that rows of `from` reach along x: `from` is a part of `open`.
inline void spread_in_row(std::uint64_t* from, const std::uint64_t* open, std::size_t n) {
    // Upwards: adding the seeds to the open bits carries through each run from its lowest seed; what changes is
    // covered.
    unsigned carry = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint64_t seeds = from[i] | (carry & open[i]);
        const std::uint64_t sum = open[i] + seeds;
        from[i] = seeds | (open[i] & ~sum);
        carry = sum < open[i] ? 1u : 0u;
    }
    // Downwards: bits below a seed within its run.
    std::uint64_t above = 0;
    for (std::size_t i = n; i-- > 0;) {
        std::uint64_t f = from[i] | ((above << 63) & open[i]), run = open[i];
        for (int k = 1; k < 64; k *= 2) {
            f |= (f >> k) & run;
            run &= run >> k;
        }
        from[i] = f;
        above = f & 1;
    }
}

// Adds the bits of ~walls that a 6-connected walk through them reaches from those that are reached, none of which is a
// wall.
inline void spread(const bit_grid& walls, bit_grid& reached) {
    const glm::ivec3 e = walls.extent();
    const std::size_t n = walls.words();
    struct place {
        int y, z;
    };
    std::vector<place> queue;
    std::vector<bool> queued(static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z), true);
    const auto index = [&](int y, int z) {
        return static_cast<std::size_t>(z) * static_cast<std::size_t>(e.y) + static_cast<std::size_t>(y);
    };
    std::vector<std::uint64_t> open(n);
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y) queue.push_back({y, z});
    while (!queue.empty()) {
        const auto [y, z] = queue.back();
        queue.pop_back();
        queued[index(y, z)] = false;
        std::uint64_t* const r = reached.row(y, z);
        const std::uint64_t* const w = walls.row(y, z);
        for (std::size_t i = 0; i < n; ++i) open[i] = ~w[i];
        open[n - 1] &= walls.last_word();
        spread_in_row(r, open.data(), n);
        const auto pass_on = [&](int to_y, int to_z) {
            if (to_y < 0 || to_z < 0 || to_y >= e.y || to_z >= e.z) return;
            std::uint64_t* const to = reached.row(to_y, to_z);
            const std::uint64_t* const wall = walls.row(to_y, to_z);
            std::uint64_t changed = 0;
            for (std::size_t i = 0; i < n; ++i) {
                const std::uint64_t fresh = r[i] & ~wall[i] & ~to[i];
                to[i] |= fresh;
                changed |= fresh;
            }
            if (changed == 0 || queued[index(to_y, to_z)]) return;
            queued[index(to_y, to_z)] = true;
            queue.push_back({to_y, to_z});
        };
        pass_on(y - 1, z);
        pass_on(y + 1, z);
        pass_on(y, z - 1);
        pass_on(y, z + 1);
    }
}

// Sets the bits of the grid's faces: of all but the lowest and the highest along z, or of these too.
inline void set_faces(bit_grid& g, bool lowest, bool highest) {
    const glm::ivec3 e = g.extent();
    const std::size_t n = g.words();
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y) {
            std::uint64_t* const r = g.row(y, z);
            if (y == 0 || y == e.y - 1 || (lowest && z == 0) || (highest && z == e.z - 1)) {
                std::fill(r, r + n, ~std::uint64_t{0});
                r[n - 1] &= g.last_word();
            } else {
                g.set(0, y, z);
                g.set(e.x - 1, y, z);
            }
        }
}

// The bits of ~walls that a 6-connected walk through them reaches from the faces of the grid, which hold no walls.
[[nodiscard]] inline bit_grid flood(const bit_grid& walls) {
    bit_grid reached(walls.extent());
    set_faces(reached, true, true);
    spread(walls, reached);
    return reached;
}

} // namespace voxelpipe::core
