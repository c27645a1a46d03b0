// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What VTK's XML files share (.vti, .vtu): names of types, and arrays in zlib blocks.

#include "deflate.hpp"
#include "model/volume.hpp"
#include "output_file.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace voxelize {

// Uncompressed bytes of one zlib block; VTK decodes a block at a time.
inline constexpr std::size_t vtk_block_bytes = std::size_t{1} << 20;

// The name of a type; bits are bytes and half floats are floats.
[[nodiscard]] std::string_view vtk_type(scalar type);

// Writes one array in zlib blocks: number of blocks, bytes of a block, bytes of the last one where it is shorter (else
// 0), the compressed bytes of each; then the blocks. The sizes are filled in at the end.
class vtk_block_array {
public:
    // `bytes`: those of the array without compression. `out` is used until finish().
    vtk_block_array(output_file& out, std::uint64_t bytes);
    // Writes the next block, of vtk_block_bytes where it is not the last one.
    void add(const compressed_piece& block);
    void finish();

private:
    output_file& out_;
    std::vector<std::uint64_t> table_;
    std::uint64_t table_at_;
    std::size_t next_ = 3;
};

} // namespace voxelize
