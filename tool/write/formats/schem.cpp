// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "schem.hpp"

#include "block_file.hpp"
#include "model/parallel.hpp"
#include "output_file.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

namespace voxelize {
namespace {

constexpr unsigned one_byte =
    128; // numbers below it take a byte, those from it on two: seven bits each, low ones first

// All up to the blocks themselves.
nbt schem_head(const block_grid& grid, std::int64_t bytes) {
    nbt head;
    head.begin(nbt::compound, "Schematic");
    head.named("Version", 2);
    constexpr int minecraft_1_13 = 1519; // the first that has these names; later ones load what earlier ones saved
    head.named("DataVersion", minecraft_1_13);
    head.named("Width", grid.size()[0], nbt::short_int);
    head.named("Height", grid.size()[1], nbt::short_int);
    head.named("Length", grid.size()[2], nbt::short_int);
    head.begin(nbt::int_array, "Offset");
    head.number(3, 4);
    for (int axis = 0; axis < 3; ++axis) head.number(0, 4);
    head.begin(nbt::compound, "Metadata");
    for (const char* name : {"WEOffsetX", "WEOffsetY", "WEOffsetZ"}) head.named(name, 0);
    head.finish();
    const std::vector<std::string>& names = grid.list().names;
    head.named("PaletteMax", static_cast<std::int64_t>(names.size()) + 1);
    head.begin(nbt::compound, "Palette");
    head.named("minecraft:air", 0);
    for (std::size_t n = 0; n < names.size(); ++n) head.named(names[n], static_cast<std::int64_t>(n) + 1);
    head.finish();
    head.begin(nbt::byte_array, "BlockData");
    head.number(bytes, 4);
    return head;
}

nbt schem_tail() {
    nbt after;
    after.begin_list("BlockEntities", nbt::compound, 0);
    after.finish();
    return after;
}

std::vector<std::byte> schem_bytes(std::span<const std::uint16_t> numbers) {
    std::vector<std::byte> bytes;
    bytes.reserve(numbers.size());
    for (const std::uint16_t number : numbers) {
        if (number >= one_byte) bytes.push_back(static_cast<std::byte>(number % one_byte + one_byte));
        bytes.push_back(static_cast<std::byte>(number >= one_byte ? number / one_byte : number));
    }
    return bytes;
}

// Bytes of all blocks. The file has them before the blocks: where some may take two, the blocks are made twice.
std::int64_t num_bytes(const block_grid& grid, int threads) {
    if (grid.list().names.size() < one_byte) return grid.volume();
    std::vector<std::int64_t> longer(grid.num_pieces());
    parallel_for(longer.size(), thread_count(threads), [&](std::size_t n) {
        const std::vector<std::uint16_t> numbers = grid.piece(n);
        longer[n] =
            std::count_if(numbers.begin(), numbers.end(), [](std::uint16_t number) { return number >= one_byte; });
    });
    return std::accumulate(longer.begin(), longer.end(), grid.volume());
}

} // namespace

std::vector<std::filesystem::path> write_schem(const voxel_shape& v, const std::filesystem::path& path,
                                               const write_options& options) {
    check_extent(path, v.extent);
    const block_grid grid(v, options);
    const std::int64_t bytes = num_bytes(grid, options.threads);
    if (bytes > std::numeric_limits<std::int32_t>::max())
        throw write_error(path, "too large for .schem, whose blocks have 2^31 bytes at most; use .npz, .zarr or .nrrd");
    return write_block_file(grid, schem_head(grid, bytes), schem_tail(), schem_bytes, path, options);
}

} // namespace voxelize
