// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "vtk_xml.hpp"

#include <array>
#include <span>

namespace voxelize {

std::string_view vtk_type(scalar type) {
    constexpr std::array<std::string_view, 10> names{"UInt8", "UInt8", "UInt16",  "UInt32",  "UInt64",
                                                     "Int32", "Int64", "Float32", "Float32", "Float64"};
    return names[static_cast<std::size_t>(type)];
}

vtk_block_array::vtk_block_array(output_file& out, std::uint64_t bytes)
    : out_(out), table_(static_cast<std::size_t>(3 + (bytes + vtk_block_bytes - 1) / vtk_block_bytes)),
      table_at_(out.tell()) {
    table_[0] = table_.size() - 3;
    table_[1] = vtk_block_bytes;
    table_[2] = bytes % vtk_block_bytes;
    out_.write(std::as_bytes(std::span{table_}));
}

void vtk_block_array::add(const compressed_piece& block) {
    out_.write(block.bytes);
    table_.at(next_++) = block.bytes.size();
}

void vtk_block_array::finish() {
    const std::uint64_t end = out_.tell();
    out_.seek(table_at_);
    out_.write(std::as_bytes(std::span{table_}));
    out_.seek(end);
}

} // namespace voxelize
