// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sets of cells by the numbers of their materials, for .inp and .msh.

#include "hexahedra.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace voxelize {

// Each cell is in one set: MATERIAL_n by ascending numbers, then NO_MATERIAL for negative ones. Without numbers of
// materials all cells are in the set VOXELS. No set is empty. Refers to the mesh.
class cell_sets {
public:
    cell_sets(const hexahedra& mesh, int threads);

    struct cell_set {
        std::string name;
        std::int64_t number; // of the material; that of NO_MATERIAL and of VOXELS is one above the others
        std::uint64_t cells;
    };
    [[nodiscard]] const std::vector<cell_set>& all() const { return sets_; }
    // True if a part of the mesh has cells of the set; without that nobody has to look for them.
    [[nodiscard]] bool is_in(std::size_t part, std::size_t set) const;
    // The set of the cell of an occupied voxel of a brick.
    [[nodiscard]] std::size_t set_of(std::size_t brick, const glm::ivec3& voxel) const;

private:
    const hexahedra& mesh_;
    std::vector<cell_set> sets_;
    std::vector<std::int64_t> numbers_;              // of the sets with materials, NO_MATERIAL as the largest
    std::vector<std::vector<std::int64_t>> of_part_; // numbers in each part, ascending
};

} // namespace voxelize
