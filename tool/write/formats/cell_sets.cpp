// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_sets.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <map>
#include <utility>

namespace voxelize {
namespace {

// What stands for negative numbers, so that they come last.
constexpr std::int64_t no_material = std::numeric_limits<std::int64_t>::max();

std::int64_t sorted_number(std::int32_t material) { return material < 0 ? no_material : material; }

// The set of a side's cell, and 1 + the set beside it or, on the outside, 0.
using both_sides = std::pair<std::size_t, std::size_t>;
using side_counts = std::map<both_sides, std::uint64_t>;

// The sets of the voxels of some rows of a plane.
class sets_of_rows {
public:
    sets_of_rows(const cell_sets& sets, int plane, int row, int end)
        : voxels_(sets.mesh().voxel_rows(plane, row, end)), first_(hexahedra::ranks(voxels_, 0)) {
        sets.mesh().for_each_voxel_of_rows(plane, row, end, [&](std::size_t brick, const glm::ivec3& voxel) {
            sets_.push_back(static_cast<std::uint32_t>(sets.set_of(brick, voxel)));
        });
    }
    [[nodiscard]] const bit_rows& voxels() const { return voxels_; }
    // 1 + the set of the voxel at a bit of a word; 0 without a voxel there.
    [[nodiscard]] std::size_t at(std::size_t word, std::uint64_t bit) const {
        if ((voxels_.data[word] & bit) == 0) return 0;
        return 1 + sets_[first_[word] + static_cast<std::uint64_t>(std::popcount(voxels_.data[word] & (bit - 1)))];
    }

private:
    bit_rows voxels_;
    std::vector<std::uint64_t> first_;
    std::vector<std::uint32_t> sets_;
};

// Counts the sides of a part's cells that lie between sets or on the outside.
side_counts sides_by_sets(const cell_sets& sets, std::size_t part) {
    side_counts counts;
    sets.mesh().with_rows(part, [&](int plane, int row, int end) {
        const std::array<sets_of_rows, 3> planes{sets_of_rows(sets, plane - 1, row - 1, end + 1),
                                                 sets_of_rows(sets, plane, row - 1, end + 1),
                                                 sets_of_rows(sets, plane + 1, row - 1, end + 1)};
        const sets_of_rows& here = planes[1];
        const std::size_t words = here.voxels().words, last = here.voxels().data.size() - words;
        for (std::size_t w = words; w < last; ++w)
            for (std::uint64_t bits = here.voxels().data[w]; bits != 0; bits &= bits - 1) {
                const std::uint64_t bit = bits & (~bits + 1);
                const std::size_t set = here.at(w, bit);
                // The last bit of a row has no voxel, so that a row may look into the one before it.
                const std::array<std::size_t, 6> beside{bit == 1 ? here.at(w - 1, 1ULL << 63U) : here.at(w, bit >> 1U),
                                                        bit >> 63U != 0 ? here.at(w + 1, 1) : here.at(w, bit << 1U),
                                                        here.at(w - words, bit),
                                                        here.at(w + words, bit),
                                                        planes[0].at(w, bit),
                                                        planes[2].at(w, bit)};
                for (const std::size_t other : beside)
                    if (other != set) ++counts[{set - 1, other}];
            }
    });
    return counts;
}

// Counts the sides on the outside of a part whose cells are all of one set.
side_counts outer_sides(const hexahedra& mesh, std::size_t part) {
    std::uint64_t count = 0;
    for (const std::uint8_t sides : mesh.sides_of_cells(part, {})) count += static_cast<unsigned>(std::popcount(sides));
    return count == 0 ? side_counts{} : side_counts{{{0, 0}, count}};
}

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

cell_choice cell_sets::cells_of(std::size_t set) const {
    return [this, set](int plane, int row, int end) {
        if (numbers_.empty()) return mesh_.voxel_rows(plane, row, end);
        bit_rows rows(static_cast<std::size_t>(end - row), mesh_.words_of_row());
        mesh_.for_each_voxel_of_rows(plane, row, end, [&](std::size_t brick, const glm::ivec3& voxel) {
            if (sorted_number(mesh_.shape().material(brick, voxel)) != numbers_[set]) return;
            const auto x = static_cast<std::size_t>(voxel.x);
            rows.row(static_cast<std::size_t>(voxel.y - row))[x / 64] |= std::uint64_t{1} << x % 64;
        });
        return rows;
    };
}

std::vector<std::size_t> cell_sets::parts_of(std::size_t set) const {
    std::vector<std::size_t> parts;
    for (std::size_t part = 0; part < mesh_.num_parts(); ++part)
        if (mesh_.cells_of(part) != 0 && is_in(part, set)) parts.push_back(part);
    return parts;
}

side_sets::side_sets(const cell_sets& sets, int threads) : sets_(sets) {
    const hexahedra& mesh = sets.mesh();
    std::vector<std::vector<std::pair<both_sides, std::uint64_t>>> found(mesh.num_parts());
    parallel_for(mesh.num_parts(), thread_count(threads), [&](std::size_t part) {
        if (mesh.cells_of(part) == 0) return;
        const side_counts counts = sets.all().size() == 1 ? outer_sides(mesh, part) : sides_by_sets(sets, part);
        found[part].assign(counts.begin(), counts.end());
    });
    std::map<both_sides, std::size_t> num_parts;
    for (const auto& counts : found)
        for (const auto& [both, count] : counts) ++num_parts[both];
    std::map<both_sides, side_set> in_order;
    for (const auto& [both, parts] : num_parts) in_order[both].parts.reserve(parts);
    for (std::size_t part = 0; part < found.size(); ++part)
        for (const auto& [both, count] : found[part]) {
            side_set& set = in_order[both];
            set.parts.push_back({part, set.sides});
            set.sides += count;
        }
    for (auto& [both, set] : in_order) {
        set.of = both.first;
        set.name = sets.all()[set.of].name;
        if (both.second != 0) {
            set.beside = both.second - 1;
            set.name += "_" + sets.all()[*set.beside].name;
        }
        all_.push_back(std::move(set));
    }
}

side_choice side_sets::choice_of(const side_set& sides) const {
    side_choice choice{sets_.cells_of(sides.of), {}};
    if (sides.beside) choice.beside = sets_.cells_of(*sides.beside);
    return choice;
}

std::vector<std::size_t> side_sets::parts_of_nodes(const side_set& sides) const {
    std::vector<std::size_t> parts;
    for (const of_part& each : sides.parts) parts.push_back(each.part);
    return sets_.mesh().parts_of_nodes(parts);
}

} // namespace voxelize
