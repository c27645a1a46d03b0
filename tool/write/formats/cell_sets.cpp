// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_sets.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <limits>
#include <map>

namespace voxelize {
namespace {

// What stands for negative numbers, so that they come last.
constexpr std::int64_t no_material = std::numeric_limits<std::int64_t>::max();

std::int64_t sorted_number(std::int32_t material) { return material < 0 ? no_material : material; }

} // namespace

cell_sets::cell_sets(const hexahedra& mesh, int threads) : mesh_(mesh) {
    if (mesh.num_cells() == 0) return;
    const voxel_shape& shape = mesh.shape();
    if (!shape.has_materials()) {
        sets_.push_back({"VOXELS", 0, mesh.num_cells()});
        return;
    }
    using counts = std::map<std::int64_t, std::uint64_t>;
    std::vector<counts> found(mesh.num_parts());
    parallel_for(mesh.num_parts(), thread_count(threads), [&](std::size_t part) {
        std::int64_t last = -1;
        std::uint64_t* count = nullptr;
        mesh.for_each_voxel(part, [&](std::uint64_t, std::size_t brick, const glm::ivec3& voxel) {
            const std::int64_t number = sorted_number(shape.material(brick, voxel));
            if (number != last) count = &found[part][last = number];
            ++*count;
        });
    });
    counts sum;
    for (const counts& part : found) {
        std::vector<std::int64_t>& numbers = of_part_.emplace_back();
        for (const auto& [number, count] : part) {
            numbers.push_back(number);
            sum[number] += count;
        }
    }
    for (const auto& [number, count] : sum) {
        const bool is_none = number == no_material;
        const std::int64_t above = numbers_.empty() ? 0 : numbers_.back() + 1;
        sets_.push_back(
            {is_none ? "NO_MATERIAL" : "MATERIAL_" + std::to_string(number), is_none ? above : number, count});
        numbers_.push_back(number);
    }
}

bool cell_sets::is_in(std::size_t part, std::size_t set) const {
    return numbers_.empty() || std::binary_search(of_part_[part].begin(), of_part_[part].end(), numbers_[set]);
}

std::size_t cell_sets::set_of(std::size_t brick, const glm::ivec3& voxel) const {
    if (numbers_.empty()) return 0;
    const std::int64_t number = sorted_number(mesh_.shape().material(brick, voxel));
    return static_cast<std::size_t>(std::lower_bound(numbers_.begin(), numbers_.end(), number) - numbers_.begin());
}

} // namespace voxelize
