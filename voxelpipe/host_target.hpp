// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Targets on the host: host_target is a copy of a whole target, host_region of a box of it. Both are addressed by
// voxel, whatever the layout. for_each_voxel and for_each_occupied visit either.

#include <voxelpipe/core/layout.hpp>
#include <voxelpipe/core/same_bits.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace voxelpipe {

namespace core {

// A box in an array of rows and slices: its first element, the elements of a row of it, its rows and slices, and the
// distances between these in the array. All in elements.
struct element_box {
    std::size_t first = 0, row = 0, rows = 0, slices = 0;
    std::size_t row_pitch = 0, slice_pitch = 0;

    [[nodiscard]] std::size_t count() const { return row * rows * slices; }
};

// The smallest box of voxels that a copy of elements can select: bits come in words of 32, tiles in bricks.
template <class Map>
[[nodiscard]] constexpr glm::ivec3 copied_unit() {
    if constexpr (Map::bricks) return {Map::brick_x, 8, 8};
    return {Map::is_bit ? 32 : 1, 1, 1};
}

} // namespace core

// A copy of a target in host memory. `elements` has the target's layout.
template <class Target>
struct host_target {
    using target_type = Target; // the target's type
    using value_type = typename Target::value_type;
    using map = typename Target::map;                    // where a voxel lies in `elements`
    std::vector<typename Target::element_type> elements; // empty if the target was off
    glm::ivec3 extent{0};                                // voxels

    // (x, y, z) must be in the extent, and the target must not have been off.
    [[nodiscard]] value_type operator()(int x, int y, int z) const {
        VOXELPIPE_EXPECTS(x >= 0 && y >= 0 && z >= 0 && x < extent.x && y < extent.y && z < extent.z);
        VOXELPIPE_EXPECTS(elements.size() == map::elements(extent));
        return map::load(elements.data(), extent, x, y, z);
    }
    // The voxels [first(), last()).
    [[nodiscard]] glm::ivec3 first() const { return glm::ivec3(0); }
    // The upper end of the box; 0 if the target was off.
    [[nodiscard]] glm::ivec3 last() const { return elements.empty() ? glm::ivec3(0) : extent; }
};

// A host copy of the box [first(), last()). Voxels keep the indices that they have in the framebuffer.
template <class Target>
class host_region {
public:
    using target_type = Target; // the target's type
    using value_type = typename Target::value_type;
    using map = typename Target::map; // where a voxel lies in memory

    // Elements are zero until fill(). The box must lie in `extent`. For a target that is off, use the default
    // constructor.
    host_region(glm::ivec3 extent, glm::ivec3 begin, glm::ivec3 size) : first_(begin), last_(begin + size) {
        const glm::ivec3 unit = core::copied_unit<map>();
        for (int a = 0; a < 3; ++a) {
            copied_first_[a] = begin[a] / unit[a] * unit[a];
            copied_extent_[a] =
                std::min(extent[a], (begin[a] + size[a] + unit[a] - 1) / unit[a] * unit[a]) - copied_first_[a];
        }
        elements_.resize(map::elements(copied_extent_));
    }
    host_region() = default;

    // (x, y, z) must be in the box.
    [[nodiscard]] value_type operator()(int x, int y, int z) const {
        VOXELPIPE_EXPECTS(x >= first_.x && y >= first_.y && z >= first_.z && x < last_.x && y < last_.y && z < last_.z);
        return map::load(elements_.data(), copied_extent_, x - copied_first_.x, y - copied_first_.y,
                         z - copied_first_.z);
    }
    [[nodiscard]] glm::ivec3 first() const { return first_; } // The lower corner of the box.
    [[nodiscard]] glm::ivec3 last() const { return last_; }   // One above the upper corner.

    // (x, y, z) is in the box.
    void store(int x, int y, int z, const value_type& v) {
        VOXELPIPE_EXPECTS(x >= first_.x && y >= first_.y && z >= first_.z && x < last_.x && y < last_.y && z < last_.z);
        map::store(elements_.data(), copied_extent_, x - copied_first_.x, y - copied_first_.y, z - copied_first_.z, v);
    }

    // Calls copy(box, to) for each box of a target's elements, which belongs at `to`.
    template <class Copy>
    void fill(glm::ivec3 extent, Copy&& copy) {
        if (elements_.empty()) return;
        const glm::ivec3 unit = core::copied_unit<map>();
        constexpr std::size_t per_unit = map::bricks ? (map::is_bit ? 64 : 512) : 1;
        const auto units = [](int voxels, int size) { return static_cast<std::size_t>((voxels + size - 1) / size); };
        core::element_box box;
        box.row_pitch = units(extent.x, unit.x) * per_unit;
        box.slice_pitch = box.row_pitch * units(extent.y, unit.y);
        box.first = units(copied_first_.x, unit.x) * per_unit + units(copied_first_.y, unit.y) * box.row_pitch +
                    units(copied_first_.z, unit.z) * box.slice_pitch;
        box.row = units(copied_extent_.x, unit.x) * per_unit;
        box.rows = units(copied_extent_.y, unit.y);
        box.slices = units(copied_extent_.z, unit.z);
        const int planes = map::planes ? map::components : 1;
        for (int c = 0; c < planes; ++c) {
            copy(box, elements_.data() + static_cast<std::size_t>(c) * box.count());
            box.first += map::cells(extent);
        }
    }

private:
    std::vector<typename Target::element_type> elements_; // of copied_extent_ voxels from copied_first_ on
    glm::ivec3 first_{0}, last_{0}, copied_first_{0}, copied_extent_{0};
};

namespace core {

// True if two values have the same bits. Structs are compared by their operator==, because of padding.
template <class T>
[[nodiscard]] bool is_same_value(const T& a, const T& b) {
    if constexpr (is_scalar<T> || vector_traits<T>::components > 1 || std::is_same_v<T, bool>)
        return has_same_bits(a, b);
    else {
        static_assert(std::equality_comparable<T>,
                      "for_each_occupied compares a target's values with the empty one: a struct needs an operator==");
        if constexpr (std::equality_comparable<T>) return a == b;
        return false;
    }
}

} // namespace core

// Calls f(glm::ivec3 voxel, value) for every voxel of a host_target or host_region: x fastest, then y, then z.
template <class Host, class F>
void for_each_voxel(const Host& host, F&& f) {
    const glm::ivec3 first = host.first(), last = host.last();
    for (int z = first.z; z < last.z; ++z)
        for (int y = first.y; y < last.y; ++y)
            for (int x = first.x; x < last.x; ++x) f(glm::ivec3(x, y, z), host(x, y, z));
}

// Calls f(glm::ivec3 voxel, value) for the voxels that do not hold `empty`, the value that the target was cleared to:
// by default its blend's identity, as framebuffers clear. A voxel whose fragments blend to that very value counts as
// empty. Structs need an operator==.
template <class Host, class F>
void for_each_occupied(const Host& host, F&& f,
                       const typename Host::value_type& empty = Host::target_type::traits::identity()) {
    for_each_voxel(host, [&](const glm::ivec3& voxel, const typename Host::value_type& value) {
        if (!core::is_same_value(value, empty)) f(voxel, value);
    });
}

} // namespace voxelpipe
