// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The arrays of a channel's mip levels, filled block by block: what zarr_levels.hpp makes of a whole grid or of slabs.

#include "formats.hpp"
#include "zarr_array.hpp"

#include "model/volume.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace voxelize {

inline constexpr int level_block_side = 128; // of level 0; half of it is a chunk
inline constexpr int most_levels = 7;        // so that a block is a voxel of the last one
static_assert(level_block_side == 2 * chunk_side && level_block_side >> most_levels == 1);

// Blocks of the grid along z, y, x.
[[nodiscard]] zyx num_level_blocks_along(const volume& v);

// Blocks by their numbers along z, y, x, those of 8, 64, ... one after the other: a chunk and a shard of each level is
// filled before the next. Those of the layers of blocks [first, last).
[[nodiscard]] std::vector<zyx> level_blocks(const volume& v, std::int64_t first, std::int64_t last);

// The content of a block in the levels: of the first one a packed chunk, then parts of chunks. Nothing if it is empty.
using block_levels = std::vector<std::vector<std::byte>>;

class level_writer;

class level_arrays {
public:
    // Folders of the levels' numbers in `folder`, which exist once add() is called.
    level_arrays(const volume& v, const channel& c, const std::filesystem::path& folder, const write_options& options);
    level_arrays(const level_arrays&) = delete;
    level_arrays& operator=(const level_arrays&) = delete;
    ~level_arrays();

    [[nodiscard]] std::size_t size() const { return writers_.size(); }
    // The levels of a block of the channel, which the volume holds. Any thread may call it. Throws write_error for a
    // channel whose name is no target.
    [[nodiscard]] block_levels make(const volume& v, const channel& c, const zyx& block) const;
    // In the order of level_blocks().
    void add(const zyx& block, const block_levels& made);
    void finish();

private:
    std::vector<std::unique_ptr<level_writer>> writers_;
};

} // namespace voxelize
