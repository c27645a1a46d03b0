// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "outside.hpp"

#include "model/parallel.hpp"

#include <bit>

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

} // namespace voxelize
