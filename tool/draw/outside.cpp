// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "outside.hpp"

#include "model/parallel.hpp"
#include "sparse/sparse_outside.hpp"

#include <voxelpipe/sparse/host_sparse.hpp>

#include <bit>
#include <cstring>

namespace voxelize {

namespace {

// Walks the columns of words of one layer along an axis, from either end, and marks the first voxel of every column.
// WORD(n, w): word w of row n of the layer; MARK(n, i): voxel i of row n is the first.
template <class Word, class Mark>
void mark_first(std::int64_t rows, std::int64_t words, bool from_high, const Word& word, const Mark& mark) {
    for (std::int64_t w = 0; w < words; ++w) {
        std::uint32_t seen = 0;
        for (std::int64_t step = 0; step < rows && seen != UINT32_MAX; ++step) {
            const std::int64_t n = from_high ? rows - 1 - step : step;
            const std::uint32_t here = word(n, w);
            for (std::uint32_t first = here & ~seen; first != 0; first &= first - 1)
                mark(n, 32 * w + std::countr_zero(first));
            seen |= here;
        }
    }
}

} // namespace

column_table columns_of(const volume& v, const channel& bits, const glm::ivec3& low, int threads) {
    column_table table;
    table.low = low;
    for (int a = 0; a < 3; ++a) table.extent[a] = static_cast<int>(v.extent[static_cast<std::size_t>(a)]);
    for (std::size_t a = 0; a < 3; ++a)
        table.along[a].resize(static_cast<std::size_t>(v.extent[a == 0 ? 1 : 0]) *
                              static_cast<std::size_t>(v.extent[a == 2 ? 1 : 2]));
    const column_view place = table.view();
    const auto mark = [&](std::int64_t i, std::int64_t j, std::int64_t k, int axis) {
        const glm::ivec3 voxel = low + glm::ivec3(static_cast<int>(i), static_cast<int>(j), static_cast<int>(k));
        table.along[static_cast<std::size_t>(axis)][place.column(axis, voxel)].add(voxel[axis]);
    };
    const std::int64_t words = v.words_per_row();
    // Layers of constant z: along x and along y.
    parallel_for(static_cast<std::size_t>(v.extent[2]), thread_count(threads), [&](std::size_t layer) {
        const auto k = static_cast<std::int64_t>(layer);
        for (std::int64_t j = 0; j < v.extent[1]; ++j) {
            std::int64_t first = 0, last = words - 1;
            while (first < words && v.word(bits, first, j, k) == 0) ++first;
            if (first == words) continue;
            while (v.word(bits, last, j, k) == 0) --last;
            mark(32 * first + std::countr_zero(v.word(bits, first, j, k)), j, k, 0);
            mark(32 * last + 31 - std::countl_zero(v.word(bits, last, j, k)), j, k, 0);
        }
        for (const bool high : {false, true})
            mark_first(
                v.extent[1], words, high, [&](std::int64_t j, std::int64_t w) { return v.word(bits, w, j, k); },
                [&](std::int64_t j, std::int64_t i) { mark(i, j, k, 1); });
    });
    // Layers of constant y: along z.
    parallel_for(static_cast<std::size_t>(v.extent[1]), thread_count(threads), [&](std::size_t layer) {
        const auto j = static_cast<std::int64_t>(layer);
        for (const bool high : {false, true})
            mark_first(
                v.extent[2], words, high, [&](std::int64_t k, std::int64_t w) { return v.word(bits, w, j, k); },
                [&](std::int64_t k, std::int64_t i) { mark(i, j, k, 2); });
    });
    return table;
}

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
