// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A program that writes files and voxelizes nothing, so links voxelpipe::io alone: one brick of three voxels, made by
// hand, as a NanoVDB file. io_alone FILE
#include <voxelpipe/sparse/io/nanovdb.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace vp = voxelpipe;

int main(int argc, char** argv) {
    if (argc != 2) return 1;
    const std::uint64_t key = 0, offsets[] = {0, 3};
    vp::brick_mask mask;
    mask.words[0] = 0b111;
    vp::grid grid;
    grid.extent = {8, 8, 8};
    const vp::brick_table table{&key, &mask, offsets, 1, grid.extent, {}};

    vp::io::nanovdb_file file;
    file.add<vp::io::nanovdb::mask_value>({"mask", table, grid, false, {}});
    std::ofstream out(argv[1], std::ios::binary);
    file.write(out);
    out.close();
    const std::uintmax_t bytes = std::filesystem::file_size(argv[1]);
    std::printf("%ju bytes\n", bytes);
    return bytes == file.size() && bytes > sizeof(vp::io::nanovdb::file_header) ? 0 : 1;
}
