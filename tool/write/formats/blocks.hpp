// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Which of Minecraft's blocks a voxel becomes, by its material or its colour. A list of blocks is a text file, a block
// a line:
//
//   # an empty line, or one that begins with '#', says nothing
//   minecraft:oak_planks    #a2834f            voxels of this colour, or of a colour that is nearest to it
//   stone                   125,125,125        "minecraft:" may be left out
//   oak_log[axis=y]         material Bark      voxels of this material, whatever their colour
//   glass                   material 3         the same by number
//
// Where no line names a colour, the blocks of default_blocks() stand for those of other materials.

#include "palette.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace voxelize {

struct block_list {
    struct of_color {
        rgb8 color;
        std::uint16_t block;
    };
    struct of_material {
        std::string name;
        std::optional<std::int32_t> number; // where the name is one
        std::uint16_t block;
        int line; // of the file
    };

    // Names and states as Minecraft has them, "minecraft:oak_log[axis=y]", no two alike. Block n has the number n + 1
    // in a file, where air is 0.
    std::vector<std::string> names;
    std::vector<of_color>
        colors; // a voxel's is the nearest by squared distance in sRGB, the first of equals; not empty
    std::vector<of_material> materials;
    std::map<std::int32_t, std::uint16_t> of_number; // blocks of materials by their numbers in the model

    // Number in a file of the block of a colour, red in the low byte.
    [[nodiscard]] std::uint16_t nearest(std::uint32_t rgb) const;
};

// The most blocks of a list, as many as the files can number with two bytes.
inline constexpr std::size_t most_blocks_of_list = 16383;

// Concrete, wool and terracotta, each with the mean colour of its texture.
[[nodiscard]] const block_list& default_blocks();

// What is wrong with a list; one line, with the file and the line in it.
struct block_list_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Throws block_list_error.
[[nodiscard]] block_list read_block_list(const std::filesystem::path& path);

// The list with the numbers that its materials have in a model. `warnings` gets a line for each that the model has not.
[[nodiscard]] std::shared_ptr<const block_list> with_materials(const block_list& list,
                                                               const std::filesystem::path& path,
                                                               std::span<const std::string> materials,
                                                               std::vector<std::string>& warnings);

} // namespace voxelize
