// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sets of cells by the numbers of their materials, and the sides at which such sets end, for .inp and .msh.

#include "hexahedra.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
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
    // The cells of a set. Refers to this.
    [[nodiscard]] cell_choice cells_of(std::size_t set) const;
    // The parts of the mesh that have cells of the set, ascending.
    [[nodiscard]] std::vector<std::size_t> parts_of(std::size_t set) const;
    [[nodiscard]] const hexahedra& mesh() const { return mesh_; }

private:
    const hexahedra& mesh_;
    std::vector<cell_set> sets_;
    std::vector<std::int64_t> numbers_;              // of the sets with materials, NO_MATERIAL as the largest
    std::vector<std::vector<std::int64_t>> of_part_; // numbers in each part, ascending
};

// The sides at which sets of cells end, by what is on both sides of them. Those of the cells of a set that have no
// neighbour are one side set, the outer one; those that have a neighbour of another set are one for each other set. So
// the sides between two sets are there twice: as those of either's cells. Side sets come by the number of their cells'
// set, the outer one first. None is empty. Refers to the sets of cells.
class side_sets {
public:
    side_sets(const cell_sets& sets, int threads);

    struct of_part {
        std::size_t part;
        std::uint64_t first; // number of the set's sides in the parts before
    };
    struct side_set {
        std::string name;                  // of the set of its cells, then of the set beside them
        std::size_t of;                    // the set of its cells
        std::optional<std::size_t> beside; // the set beside them; none: the outer sides
        std::uint64_t sides = 0;
        std::vector<of_part> parts; // that have any, ascending

        // True for one of the two that have the sides between two sets, and for the outer ones.
        [[nodiscard]] bool is_first() const { return !beside || of < *beside; }
    };
    [[nodiscard]] const std::vector<side_set>& all() const { return all_; }
    // What hexahedra::sides_of_cells and nodes_of_sides take.
    [[nodiscard]] side_choice choice_of(const side_set& sides) const;
    // The parts of the mesh that have nodes of the sides, ascending.
    [[nodiscard]] std::vector<std::size_t> parts_of_nodes(const side_set& sides) const;

private:
    const cell_sets& sets_;
    std::vector<side_set> all_;
};

} // namespace voxelize
