// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of all languages: bits of voxels as bytes.

#include <cpu_ref/parallel.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace voxelpipe::bindings {

// Threads that run: `threads`, or all cores for 0.
[[nodiscard]] inline unsigned workers_of(unsigned threads) {
    return threads != 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
}

// Words of 32 voxels in a row along x.
[[nodiscard]] inline std::size_t words_per_row(const glm::ivec3& extent) {
    return (static_cast<std::size_t>(extent.x) + 31) / 32;
}

// A byte for each bit of rows of words: 0 or 1.
inline void expand(const std::uint32_t* words, std::uint8_t* out, const glm::ivec3& extent, unsigned threads) {
    const auto nx = static_cast<std::size_t>(extent.x), words_each = words_per_row(extent);
    const std::size_t rows = static_cast<std::size_t>(extent.y) * static_cast<std::size_t>(extent.z);
    constexpr std::size_t block = 64;
    cpu::parallel_for(workers_of(threads), (rows + block - 1) / block, [&](unsigned, std::size_t b) {
        for (std::size_t row = b * block; row < std::min(rows, (b + 1) * block); ++row)
            for (std::size_t w = 0; w < words_each; ++w) {
                const std::uint32_t word = words[row * words_each + w];
                std::uint8_t* const to = out + row * nx + 32 * w;
                const auto n = static_cast<unsigned>(std::min<std::size_t>(32, nx - 32 * w));
                for (unsigned i = 0; i < n; ++i) to[i] = static_cast<std::uint8_t>(word >> i & 1U);
            }
    });
}

} // namespace voxelpipe::bindings
