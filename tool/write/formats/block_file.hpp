// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What files of Minecraft's blocks share: a gzipped NBT tree with the number of each block in it, made and compressed
// piece by piece on all threads.

#include "blocks.hpp"
#include "formats.hpp"
#include "nbt.hpp"
#include "voxel_shape.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

namespace voxelize {

// The blocks of a shape in the order of such files: x fastest, then z, then y, which stands upright. With
// write_options::up == y voxel (i,j,k) stands at (i,j,k), with up == z at (i, k, ny-1-j).
class block_grid {
public:
    block_grid(const voxel_shape& v, const write_options& options);

    [[nodiscard]] const std::array<std::int64_t, 3>& size() const { return size_; } // x, y, z
    [[nodiscard]] std::int64_t volume() const { return size_[0] * size_[1] * size_[2]; }
    [[nodiscard]] const block_list& list() const { return *list_; }

    // Rows along x are handed out in pieces, each of a multiple of 64 blocks but for the last.
    [[nodiscard]] std::size_t num_pieces() const {
        return static_cast<std::size_t>((rows_ + piece_rows_ - 1) / piece_rows_);
    }
    // The numbers of a piece's blocks, 0 for air. Any thread may call it.
    [[nodiscard]] std::vector<std::uint16_t> piece(std::size_t n) const;

private:
    const voxel_shape& v_;
    brick_order order_;
    const block_list* list_;
    up_axis up_;
    std::array<std::int64_t, 3> size_;
    std::int64_t rows_, piece_rows_;
};

// Writes `head`, the blocks as `encode` makes bytes of their numbers, and `tail`.
std::vector<std::filesystem::path>
write_block_file(const block_grid& grid, const nbt& head, const nbt& tail,
                 const std::function<std::vector<std::byte>(std::span<const std::uint16_t>)>& encode,
                 const std::filesystem::path& path, const write_options& options);

} // namespace voxelize
