// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The log of changes of a framebuffer (framebuffer::track_changes): which of its targets hold their clear value
// wherever nothing has been drawn, and where something may have been drawn. It lies in memory next to the targets.

#include <voxelpipe/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <glm/vec3.hpp>

namespace voxelpipe::core {

// A chunk is a box of voxels: a few cache lines in each row of a target. Each has a bit, 32 along x to a word; each row
// of chunks along x begins a new word.
inline constexpr int log2_chunk_x = 5, log2_chunk_yz = 3;
inline constexpr int chunk_x = 1 << log2_chunk_x, chunk_yz = 1 << log2_chunk_yz;

struct chunk_rows {
    int words = 0;    // per row
    int y = 0, z = 0; // rows along these axes

    chunk_rows() = default;
    VOXELPIPE_HD constexpr explicit chunk_rows(const glm::ivec3& extent)
        : words(parts(extent.x, 32 * chunk_x)), y(parts(extent.y, chunk_yz)), z(parts(extent.z, chunk_yz)) {}
    [[nodiscard]] VOXELPIPE_HD constexpr std::size_t count() const {
        return static_cast<std::size_t>(y) * static_cast<unsigned>(z);
    }
    [[nodiscard]] VOXELPIPE_HD constexpr std::size_t num_words() const {
        return count() * static_cast<unsigned>(words);
    }

private:
    [[nodiscard]] VOXELPIPE_HD static constexpr int parts(int length, int size) {
        return length <= 0 ? 0 : (length - 1) / size + 1;
    }
};

// The words of a log: for each target its clear value, if known, then one bit for each chunk that may have been drawn
// into since. A target that is known holds its clear value in all chunks without a bit. All zeros: nothing is known.
struct change_log {
    static constexpr std::size_t max_targets = 8, max_bytes = 32; // max_bytes: of a value
    static constexpr std::size_t known_words = 1 + max_bytes / sizeof(std::uint32_t);
    static constexpr std::size_t header_words = max_targets * known_words;

    // A target's clear value: 1 and the bytes of the value; zeros if unknown.
    struct known {
        std::uint32_t words[known_words] = {};

        known() = default;
        template <class T>
        explicit known(const T& value) {
            static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= max_bytes);
            words[0] = 1;
            const auto* const bytes = reinterpret_cast<const unsigned char*>(&value);
            std::copy(bytes, bytes + sizeof(T), reinterpret_cast<unsigned char*>(words + 1));
        }
    };
    [[nodiscard]] static std::size_t num_words(const glm::ivec3& extent) {
        return header_words + chunk_rows(extent).num_words();
    }
    // Resets a log in memory that the host can write.
    static void forget(std::uint32_t* words) { std::fill_n(words, header_words, 0u); }
};

} // namespace voxelpipe::core
