// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Formats many small items of a file on all threads.

#include "model/parallel.hpp"
#include "output_file.hpp"
#include "progress.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace voxelize {

// Appends the bytes of a value.
template <class T>
void put(std::string& out, T value) {
    const std::size_t at = out.size();
    out.resize(at + sizeof(T));
    std::memcpy(out.data() + at, &value, sizeof(T));
}

// Formats COUNT items in blocks on all threads and writes the blocks in order, a few at a time. Items of equal
// size say their bytes, so that blocks need not grow.
template <class Format> // void(std::string& out, std::size_t item)
void write_items(output_file& out, std::size_t count, int threads, progress_meter& meter, const Format& format,
                 std::size_t item_bytes = 0) {
    constexpr std::size_t block_items = std::size_t{1} << 13; // formatted at once by one thread
    const int workers = thread_count(threads);
    const std::size_t at_once = block_items * static_cast<std::size_t>(4 * workers);
    for (std::size_t begin = 0; begin < count; begin += at_once) {
        const std::size_t end = std::min(count, begin + at_once);
        std::vector<std::string> blocks((end - begin + block_items - 1) / block_items);
        parallel_for(blocks.size(), workers, [&](std::size_t b) {
            const std::size_t first = begin + b * block_items;
            const std::size_t last = std::min(end, first + block_items);
            blocks[b].reserve(item_bytes * (last - first));
            for (std::size_t n = first; n < last; ++n) format(blocks[b], n);
        });
        for (const std::string& block : blocks) out.write(block);
        meter.advance(end - begin);
    }
}

} // namespace voxelize
