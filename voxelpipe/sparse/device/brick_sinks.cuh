// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sinks of the raster for bricks. Voxels come as rows and small cubes; each sink takes them as bits of blocks of 4^3,
// in Morton order: a word of the index, a word of a brick's mask.
//   marking_sink   sets bits of an index, for each brick or node that a voxel lies in
//   masking_sink   sets bits of the bricks' masks
//   counting_sink  counts the fragments of each voxel, by its rank

#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/sparse/device/brick_index.cuh>

#include <cstdint>

namespace voxelpipe::device {

// The bit of a voxel in its block.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned bit_in_block(int x, int y, int z) {
    const auto spread = [](int n) VOXELPIPE_INLINE_LAMBDA {
        return (static_cast<unsigned>(n) & 1u) | (static_cast<unsigned>(n) & 2u) << 2;
    };
    return spread(x) | spread(y) << 1 | spread(z) << 2;
}

// Makes blocks of fragments. Derived has block(x, y, z, bits): of the block that has voxel 4 (x, y, z).
template <class Derived, class Call>
struct block_sink : sink_base<Call> {
    static constexpr bool stages_in_shared = false;
    static constexpr bool merges_equal_voxels = false;
    static constexpr bool splits_long_rows = false;
    struct memory {};
    struct totals {
        unsigned fragments = 0;
    };
    totals mine;

    __device__ VOXELPIPE_INLINE block_sink(const Call& call, unsigned* dropped, memory&)
        : sink_base<Call>{call, dropped} {}
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        return this->call.out.checked || this->call.out.check(index);
    }
    __device__ VOXELPIPE_INLINE static void begin(std::uint32_t) {}
    [[nodiscard]] __device__ VOXELPIPE_INLINE static glm::ivec3 position(int x, int y, int z) {
        return glm::ivec3(x, y, z);
    }
    __device__ VOXELPIPE_INLINE void emit(const glm::ivec3& at, bool wanted) {
        if (wanted) row(at.x, at.y, at.z, 1u);
    }
    template <class Position>
    __device__ VOXELPIPE_INLINE void voxels(word bits, const Position& position_of) {
        for (; bits != 0; bits &= bits - 1) {
            const glm::ivec3 at = position_of(__ffs(static_cast<int>(bits)) - 1);
            row(at.x, at.y, at.z, 1u);
        }
    }
    __device__ VOXELPIPE_INLINE void row(int x0, int y, int z, word mask) {
        if (mask == 0) return;
        mine.fragments += static_cast<unsigned>(__popc(mask));
        const glm::ivec3 from = glm::ivec3(x0, y, z) + this->call.out.lead;
        static_cast<Derived*>(this)->whole_row(from.x, from.y, from.z, mask);
    }
    __device__ VOXELPIPE_INLINE void slim(int x, int y, int z, const core::slim_rows& rows) {
        for (int i = 0; i < core::slim_rows::count; ++i)
            row(x, y + (rows.along_y ? i >> 1 : i & 1), z + (rows.along_y ? i & 1 : i >> 1),
                rows.bits >> (4 * i) & 15u);
    }
    // 2 x 2 x 2 voxels, x first.
    __device__ VOXELPIPE_INLINE void cube(int x, int y, int z, word voxels) {
        if (voxels == 0) return;
        mine.fragments += static_cast<unsigned>(__popc(voxels));
        const glm::ivec3 from = glm::ivec3(x, y, z) + this->call.out.lead;
        static_cast<Derived*>(this)->whole_cube(from.x, from.y, from.z, voxels);
    }

    [[nodiscard]] __device__ VOXELPIPE_INLINE totals end() const { return mine; }
    __device__ VOXELPIPE_INLINE void take_over(const totals& other) { mine.fragments += other.fragments; }
    // Adds the block's counts to the state. All threads of the block call it.
    __device__ void finish(pipeline_state* state) const {
        const unsigned long long sum = block_sum(mine.fragments);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->fragments, sum);
    }

    // The blocks of a row from x0 on, in the numbers of the whole grid.
    __device__ VOXELPIPE_INLINE void blocks_of_row(int x0, int y, int z, word mask) {
        const unsigned across = bit_in_block(0, y, z);
        std::uint64_t left = std::uint64_t{mask} << (x0 & 3);
        for (int x = x0 >> 2; left != 0; ++x, left >>= 4) {
            const auto four = static_cast<unsigned>(left) & 15u;
            if (four == 0) continue;
            const unsigned spread = (four & 3u) | (four & 12u) << 6; // bits 0, 1, 8 and 9
            static_cast<Derived*>(this)->block(x, y >> 2, z >> 2, static_cast<unsigned long long>(spread) << across);
        }
    }
    __device__ VOXELPIPE_INLINE void blocks_of_cube(int x, int y, int z, word voxels) {
        // Which of the two voxels along an axis lie in the first block, as masks of the eight.
        const auto in_first = [](int at, word low) VOXELPIPE_INLINE_LAMBDA { return (at & 3) == 3 ? low : 0xffu; };
        const word first_x = in_first(x, 0x55u), first_y = in_first(y, 0x33u), first_z = in_first(z, 0x0fu);
        for (int i = 0; i < 8; ++i) {
            const word part = voxels & ((i & 1) != 0 ? ~first_x : first_x) & ((i & 2) != 0 ? ~first_y : first_y) &
                              ((i & 4) != 0 ? ~first_z : first_z);
            if (part == 0) continue;
            unsigned long long bits = 0;
#pragma unroll
            for (int k = 0; k < 8; ++k)
                bits |= static_cast<unsigned long long>(part >> k & 1u)
                        << bit_in_block(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
            static_cast<Derived*>(this)->block((x >> 2) + (i & 1), (y >> 2) + (i >> 1 & 1), (z >> 2) + (i >> 2), bits);
        }
    }
};

struct output_base {
    static constexpr bool defers = true;
    static constexpr bool may_draw_few = true;
    static constexpr bool only_blends = false, only_sets = false;
    static constexpr bool finds_oversized_again = true;

    glm::ivec3 lead; // from voxels of the raster to those of the whole grid
    std::uint32_t num_vertices;
    pipeline_state* state;
    bool checked; // the indices

    __device__ VOXELPIPE_INLINE static void prepare(std::uint64_t, std::uint64_t) {}
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_checked() const { return checked; }
    // True if all three indices name vertices; otherwise notes the error.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        const bool ok = index.x < num_vertices && index.y < num_vertices && index.z < num_vertices;
        if (!ok) atomicOr(&state->index_error, bad_index);
        return ok;
    }
};

// ---- the index ------------------------------------------------------------------------------------------------------

template <class Call>
struct marking_sink : block_sink<marking_sink<Call>, Call> {
    using block_sink<marking_sink<Call>, Call>::block_sink;

    // With `shift`, cells of 2^shift voxels a side are marked, otherwise each voxel of the raster is a cell.
    __device__ VOXELPIPE_INLINE void whole_row(int x0, int y, int z, word mask) {
        const int shift = this->call.out.shift;
        if (shift == 0) {
            this->blocks_of_row(x0, y, z, mask);
            return;
        }
        word cells = 0;
        const int first = x0 >> shift;
        while (mask != 0) {
            const int cell = (x0 + __ffs(static_cast<int>(mask)) - 1) >> shift;
            cells |= 1u << (cell - first);
            const int end = ((cell + 1) << shift) - x0;
            mask = end >= 32 ? 0 : mask & (~0u << end);
        }
        this->blocks_of_row(first, y >> shift, z >> shift, cells);
    }
    __device__ VOXELPIPE_INLINE void whole_cube(int x, int y, int z, word voxels) {
        if (this->call.out.shift == 0) {
            this->blocks_of_cube(x, y, z, voxels);
            return;
        }
        for (int i = 0; i < 4; ++i)
            if (const word two = voxels >> (2 * i) & 3u; two != 0) whole_row(x, y + (i & 1), z + (i >> 1), two);
    }
    __device__ VOXELPIPE_INLINE void block(int x, int y, int z, unsigned long long bits) {
        this->call.out.level.set(short_morton_key(x, y, z) << 6, bits);
    }
};
struct marking_output : output_base {
    template <class Call>
    using sink = marking_sink<Call>;
    template <class Call>
    using deferred_sink = sink<Call>;
    index_level level;
    int shift;
};

// ---- masks ----------------------------------------------------------------------------------------------------------

// The brick that a thread has written to last.
struct last_brick {
    std::uint64_t place = ~std::uint64_t{0}; // 21 bits an axis
    std::uint32_t number = 0;

    __device__ VOXELPIPE_INLINE void find(const index_level& bricks, int x, int y, int z) {
        const std::uint64_t wanted = static_cast<std::uint32_t>(x) |
                                     std::uint64_t{static_cast<std::uint32_t>(y)} << 21 |
                                     std::uint64_t{static_cast<std::uint32_t>(z)} << 42;
        if (wanted == place) return;
        place = wanted;
        number = bricks.number_of(short_morton_key(x, y, z));
    }
};
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned word_in_brick(int x, int y, int z) {
    return (static_cast<unsigned>(x) & 1u) | (static_cast<unsigned>(y) & 1u) << 1 |
           (static_cast<unsigned>(z) & 1u) << 2;
}

template <class Call>
struct masking_sink : block_sink<masking_sink<Call>, Call> {
    using block_sink<masking_sink<Call>, Call>::block_sink;
    last_brick last;

    __device__ VOXELPIPE_INLINE void whole_row(int x0, int y, int z, word mask) { this->blocks_of_row(x0, y, z, mask); }
    __device__ VOXELPIPE_INLINE void whole_cube(int x, int y, int z, word voxels) {
        this->blocks_of_cube(x, y, z, voxels);
    }
    __device__ VOXELPIPE_INLINE void block(int x, int y, int z, unsigned long long bits) {
        const auto& out = this->call.out;
        last.find(out.level, x >> 1, y >> 1, z >> 1);
        unsigned long long* const w = out.masks + (std::uint64_t{last.number} * 8 + word_in_brick(x, y, z));
        if ((bits & ~__ldca(w)) != 0) atomicOr(w, bits); // possibly stale: bits are never cleared
    }
};
struct masking_output : output_base {
    template <class Call>
    using sink = masking_sink<Call>;
    template <class Call>
    using deferred_sink = sink<Call>;
    index_level level;
    unsigned long long* masks; // 8 words a brick
};

template <class Call>
struct counting_sink : block_sink<counting_sink<Call>, Call> {
    using block_sink<counting_sink<Call>, Call>::block_sink;
    last_brick last;

    __device__ VOXELPIPE_INLINE void whole_row(int x0, int y, int z, word mask) { this->blocks_of_row(x0, y, z, mask); }
    __device__ VOXELPIPE_INLINE void whole_cube(int x, int y, int z, word voxels) {
        this->blocks_of_cube(x, y, z, voxels);
    }
    __device__ VOXELPIPE_INLINE void block(int x, int y, int z, unsigned long long bits) {
        const auto& out = this->call.out;
        last.find(out.level, x >> 1, y >> 1, z >> 1);
        const brick_mask& mask = out.masks[last.number];
        const unsigned w = word_in_brick(x, y, z);
        std::uint64_t rank = out.offsets[last.number];
        for (unsigned before = 0; before < w; ++before) rank += core::count_ones(mask.words[before]);
        for (const std::uint64_t word = mask.words[w]; bits != 0; bits &= bits - 1) {
            const unsigned long long below = (bits & (~bits + 1)) - 1;
            atomicAdd(out.counts + rank + core::count_ones(word & below), 1u);
        }
    }
};
struct counting_output : output_base {
    template <class Call>
    using sink = counting_sink<Call>;
    template <class Call>
    using deferred_sink = sink<Call>;
    index_level level;
    const brick_mask* masks;
    const unsigned long long* offsets; // ranks of the bricks' first voxels
    std::uint32_t* counts;             // by rank
};

} // namespace voxelpipe::device
