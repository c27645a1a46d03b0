// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "litematic.hpp"

#include "block_file.hpp"
#include "output_file.hpp"

#include <algorithm>
#include <bit>
#include <string>
#include <string_view>

namespace voxelize {
namespace {

// Bits of a block's number.
unsigned bits_of_block(const block_list& list) {
    constexpr unsigned least = 2; // of the format
    return std::max(least, static_cast<unsigned>(std::bit_width(list.names.size())));
}

void add_place(nbt& tree, std::string_view name, const std::array<std::int64_t, 3>& place) {
    tree.begin(nbt::compound, name);
    constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
    for (std::size_t a = 0; a < 3; ++a) tree.named(axes[a], place[a]);
    tree.finish();
}

// An element of the palette: "minecraft:oak_log[axis=y]" as its name and its states.
void add_block(nbt& tree, std::string_view block) {
    const std::size_t bracket = block.find('[');
    tree.named("Name", block.substr(0, bracket));
    if (bracket != std::string_view::npos) {
        tree.begin(nbt::compound, "Properties");
        std::string_view states = block.substr(bracket + 1, block.size() - bracket - 2);
        while (!states.empty()) {
            const std::string_view state = states.substr(0, states.find(','));
            tree.named(state.substr(0, state.find('=')), state.substr(state.find('=') + 1));
            states.remove_prefix(std::min(states.size(), state.size() + 1));
        }
        tree.finish();
    }
    tree.finish();
}

// All up to the blocks themselves.
nbt litematic_head(const block_grid& grid, std::int64_t occupied) {
    nbt head;
    head.begin(nbt::compound, "");
    constexpr int minecraft_1_13 = 1519; // as in .schem
    head.named("MinecraftDataVersion", minecraft_1_13);
    head.named("Version", 5);
    head.begin(nbt::compound, "Metadata");
    add_place(head, "EnclosingSize", grid.size());
    head.named("Name", "voxels");
    for (const char* name : {"Author", "Description"}) head.named(name, "");
    for (const char* name : {"TimeCreated", "TimeModified"}) head.named(name, 0, nbt::int64);
    head.named("RegionCount", 1);
    head.named("TotalBlocks", occupied);
    head.named("TotalVolume", grid.volume());
    head.finish();
    head.begin(nbt::compound, "Regions");
    head.begin(nbt::compound, "voxels");
    add_place(head, "Position", {0, 0, 0});
    add_place(head, "Size", grid.size());
    const std::vector<std::string>& names = grid.list().names;
    head.begin_list("BlockStatePalette", nbt::compound, static_cast<std::int64_t>(names.size()) + 1);
    add_block(head, "minecraft:air");
    for (const std::string& name : names) add_block(head, name);
    for (const char* name : {"Entities", "TileEntities", "PendingBlockTicks", "PendingFluidTicks"})
        head.begin_list(name, nbt::compound, 0);
    head.begin(nbt::long_array, "BlockStates");
    constexpr std::int64_t long_bits = 64;
    head.number((grid.volume() * bits_of_block(grid.list()) + long_bits - 1) / long_bits, 4);
    return head;
}

nbt litematic_tail() {
    nbt after;
    for (int open = 0; open < 3; ++open) after.finish(); // the region, the regions and the whole
    return after;
}

// Numbers of `bits` bits each, the first in the lowest bits, as whole 64-bit integers.
std::vector<std::byte> packed_longs(std::span<const std::uint16_t> numbers, unsigned bits) {
    constexpr std::size_t long_bits = 64;
    std::vector<std::byte> bytes;
    bytes.reserve((numbers.size() * bits + long_bits - 1) / long_bits * 8);
    std::uint64_t word = 0;
    unsigned used = 0;
    const auto flush = [&] {
        for (int byte = 7; byte >= 0; --byte) bytes.push_back(static_cast<std::byte>(word >> 8 * byte));
    };
    for (const std::uint16_t number : numbers) {
        word |= std::uint64_t{number} << used;
        used += bits;
        if (used < long_bits) continue;
        flush();
        used -= static_cast<unsigned>(long_bits);
        word = used == 0 ? 0 : std::uint64_t{number} >> (bits - used);
    }
    if (used != 0) flush();
    return bytes;
}

} // namespace

std::vector<std::filesystem::path> write_litematic(const voxel_shape& v, const std::filesystem::path& path,
                                                   const write_options& options) {
    check_extent(path, v.extent);
    const block_grid grid(v, options);
    const unsigned bits = bits_of_block(grid.list());
    return write_block_file(
        grid, litematic_head(grid, static_cast<std::int64_t>(v.num_voxels())), litematic_tail(),
        [bits](std::span<const std::uint16_t> numbers) { return packed_longs(numbers, bits); }, path, options);
}

} // namespace voxelize
