// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The cells of a dense grid that a ray meets, in order. Continuous coordinates: cell (i, j, k) is the box from
// (i, j, k) to (i + 1, j + 1, k + 1). Every distance comes from a cell's side itself, so no error adds up along the
// ray.

#include <voxelpipe/core/exact.hpp>

#include <glm/vec3.hpp>

namespace voxelpipe {

// One cell of a walk. Distances are in lengths of the ray's direction.
template <class S>
struct walked_cell {
    glm::ivec3 cell; // its index
    S enter, leave;  // enter <= leave, both within the ray's limits
    int axis;        // of the side through which the ray enters; the longest axis of the direction if it starts inside
    bool from_above; // through the upper side
};

// Calls visit(walked_cell<S>) for every cell that origin + t * direction, 0 <= t <= limit, meets, until one call
// returns true. S is float or double; numbers are finite and the direction is not zero. Returns true if a call did.
VOXELPIPE_ANY_CALLABLE
template <class S, class Visit>
VOXELPIPE_HD bool walk_cells(const glm::ivec3& extent, const glm::vec<3, S>& origin, const glm::vec<3, S>& direction,
                             S limit, const Visit& visit) {
    constexpr S never = static_cast<S>(1e30); // later than the end of any ray
    S t = 0, t_end = limit;
    int axis = 0;
    S inverse[3];
    for (int a = 0; a < 3; ++a) {
        inverse[a] = never;
        const auto size = static_cast<S>(extent[a]);
        if (direction[a] == 0) {
            if (!(origin[a] >= 0 && origin[a] < size)) return false;
            continue;
        }
        inverse[a] = exact::div(S{1}, direction[a]);
        const S near = ((direction[a] > 0 ? S{0} : size) - origin[a]) * inverse[a];
        const S far = ((direction[a] > 0 ? size : S{0}) - origin[a]) * inverse[a];
        if (near > t) {
            t = near;
            axis = a;
        }
        if (far < t_end) t_end = far;
    }
    if (!(t <= t_end)) return false;
    const auto length = [&](int a) { return direction[a] < 0 ? -direction[a] : direction[a]; };
    if (t == 0)
        for (int a = 1; a < 3; ++a)
            if (length(a) > length(axis)) axis = a;
    walked_cell<S> at{glm::ivec3(0), t, t, axis, direction[axis] < 0};
    S side[3]; // where the ray leaves the cell along each axis
    const auto side_of = [&](int a) {
        return (static_cast<S>(at.cell[a] + (direction[a] > 0 ? 1 : 0)) - origin[a]) * inverse[a];
    };
    for (int a = 0; a < 3; ++a) {
        const S p = exact::fma(t, direction[a], origin[a]);
        at.cell[a] = p <= 0 ? 0 : p >= static_cast<S>(extent[a]) ? extent[a] - 1 : static_cast<int>(p);
        side[a] = direction[a] == 0 ? never : side_of(a);
    }
    while (true) {
        axis = side[1] < side[0] ? 1 : 0;
        if (side[2] < side[axis]) axis = 2;
        const S next = side[axis] > at.enter ? side[axis] : at.enter;
        at.leave = next < t_end ? next : t_end;
        if (visit(static_cast<const walked_cell<S>&>(at))) return true;
        if (!(next < t_end)) return false;
        at.cell[axis] += direction[axis] > 0 ? 1 : -1;
        if (at.cell[axis] < 0 || at.cell[axis] >= extent[axis]) return false;
        side[axis] = side_of(axis);
        at.enter = next;
        at.axis = axis;
        at.from_above = direction[axis] < 0;
    }
}

} // namespace voxelpipe
