// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Messages about a run's counts.
#include "voxelizer.hpp"

#include <glm/vector_relational.hpp>

namespace voxelize {

std::string why_empty(const voxelize_stats& stats, const voxelize_request& request, const glm::dvec3& low,
                      const glm::dvec3& high) {
    const voxelpipe::coverage coverage = request.coverage;
    const std::string text = "no voxel is covered: ";
    if (stats.fragments_discarded != 0)
        return text + "alpha discards all " + std::to_string(stats.fragments_discarded) + " fragments";
    if (stats.solid && stats.solid->crossings != 0)
        return text + "no centre of a voxel is inside the model (--solid-extent outer also takes the voxels that its "
                      "surface touches, --solid nonzero also what is wound inside out)";
    if (stats.triangles_drawn != 0 && coverage == voxelpipe::coverage::crosshair)
        return text + "no triangle meets an axis through a voxel's centre (--coverage conservative draws all)";
    if (stats.triangles_drawn != 0 && coverage == voxelpipe::coverage::diagonal)
        return text + "no triangle meets a diagonal of a voxel (--coverage conservative draws all)";
    if (stats.triangles_drawn != 0) return text + "what the triangles cover lies outside the grid";
    if (stats.triangles_flat != 0)
        return text + "the triangles have no area, and only --coverage conservative draws such";
    if (stats.lines != 0 && stats.triangles_dropped + stats.lines_dropped == stats.triangles + stats.lines)
        return text + "no triangle, line or point has positions that can be drawn";
    if (stats.triangles != 0 && stats.triangles_dropped == stats.triangles)
        return text + "no triangle has three positions that can be drawn";
    const voxelpipe::grid& grid = request.grid;
    const glm::dvec3 first = grid.part_origin(), last = first + glm::dvec3(grid.extent) * grid.voxel_size;
    if (glm::any(glm::greaterThan(first, high)) || glm::any(glm::lessThan(last, low)))
        return text + "the model lies outside the grid";
    const bool is_within = glm::all(glm::greaterThanEqual(first, low)) && glm::all(glm::lessThanEqual(last, high));
    return text + "no triangle, line or point meets the grid, which lies " +
           (is_within ? "within the model's bounds" : "across the model's bounds, where nothing is") +
           ": move or enlarge it with --origin and --extent, or take what encloses it with --solid nonzero";
}

std::vector<std::string> fraction_warnings(const fraction_counts& counts, bool clamp) {
    std::vector<std::string> warnings;
    if (counts.open_rows != 0)
        warnings.push_back("the model is not closed: " + std::to_string(counts.open_rows) + " of " +
                           std::to_string(counts.rows) + " rows of voxels do not balance, and the fractions " +
                           "behind a hole are in doubt (" + std::to_string(counts.open_edges) + " open edges)");
    if (counts.below_zero + counts.above_one != 0 && !clamp)
        warnings.push_back("the fractions of " + std::to_string(counts.below_zero) +
                           " voxels are below 0 and those of " + std::to_string(counts.above_one) +
                           " above 1: parts overlap or are inside out; --clamp keeps 0 to 1");
    return warnings;
}

void add_fraction_warnings(const voxelize_request& request, voxelize_stats& stats) {
    if (!stats.fractions) return;
    for (std::string& warning : fraction_warnings(*stats.fractions, request.clamp || !request.wants(target::fraction)))
        stats.warnings.push_back(std::move(warning));
}

std::string cancelled_warning(const voxelize_stats& stats) {
    if (stats.normals_cancelled == 0) return "";
    return "the normals of " + std::to_string(stats.normals_cancelled) + " of " + std::to_string(stats.voxels) +
           " voxels cancel out (two sides of a thin wall in one voxel, or triangles without area, lines and points); "
           "--target normal is 0 there";
}

} // namespace voxelize
