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

// A walk, cell by cell. S is float or double; numbers are finite and the direction is not zero.
template <class S>
class cell_walk {
public:
    walked_cell<S> at; // `leave` is set by look()

    // At the first cell that origin + t * direction, 0 <= t <= limit, meets; see good().
    VOXELPIPE_HD cell_walk(const glm::ivec3& size, const glm::vec<3, S>& from, const glm::vec<3, S>& towards, S limit)
        : at{glm::ivec3(0), S{0}, S{0}, 0, false}, extent_(size), origin_(from), direction_(towards), end_(limit),
          good_(start()) {}

    // False if the ray misses the grid.
    [[nodiscard]] VOXELPIPE_HD bool good() const { return good_; }
    // Sets at.leave.
    VOXELPIPE_HD void look() {
        const S next = leaves_at(axis_of(side_));
        at.leave = next < end_ ? next : end_;
    }
    // To the next cell. False at the end of the ray.
    [[nodiscard]] VOXELPIPE_HD bool step() { return cross(axis_of(side_), side_) && (set_side(at.axis), true); }
    // To the first cell behind the box of cells from `low` to `high - 1`, in which the current one lies: the cell that
    // steps would lead to. False at the end of the ray.
    [[nodiscard]] VOXELPIPE_HD bool leave_box(const glm::ivec3& low, const glm::ivec3& high) {
        S out[3];
        for (int a = 0; a < 3; ++a)
            out[a] = direction_[a] == 0 ? never : side_of(a, direction_[a] > 0 ? high[a] - 1 : low[a]);
        const int axis = axis_of(out);
        const glm::ivec3 before = at.cell;
        at.cell[axis] = direction_[axis] > 0 ? high[axis] - 1 : low[axis];
        if (!cross(axis, out)) return false;
        for (int a = 0; a < 3; ++a) {
            if (a != axis && direction_[a] != 0) {
                // Those sides are behind the ray that steps would have crossed before this one.
                const auto is_crossed = [&](int cell) {
                    const S side = side_of(a, cell);
                    return side < out[axis] || (side == out[axis] && a < axis);
                };
                const int forward = direction_[a] > 0 ? 1 : -1;
                const S p = exact::fma(at.enter, direction_[a], origin_[a]);
                int cell = p <= static_cast<S>(low[a])    ? low[a]
                           : p >= static_cast<S>(high[a]) ? high[a] - 1
                                                          : static_cast<int>(p);
                if ((cell - before[a]) * forward < 0) cell = before[a];
                while (cell != before[a] && !is_crossed(cell - forward)) cell -= forward;
                while (is_crossed(cell)) cell += forward;
                at.cell[a] = cell;
            }
            set_side(a);
        }
        return true;
    }

private:
    static constexpr S never = static_cast<S>(1e30); // later than the end of any ray

    VOXELPIPE_HD bool start() {
        S t = 0;
        int axis = 0;
        for (int a = 0; a < 3; ++a) {
            inverse_[a] = never;
            const auto size = static_cast<S>(extent_[a]);
            if (direction_[a] == 0) {
                if (!(origin_[a] >= 0 && origin_[a] < size)) return false;
                continue;
            }
            inverse_[a] = exact::div(S{1}, direction_[a]);
            const S near = ((direction_[a] > 0 ? S{0} : size) - origin_[a]) * inverse_[a];
            const S far = ((direction_[a] > 0 ? size : S{0}) - origin_[a]) * inverse_[a];
            if (near > t) {
                t = near;
                axis = a;
            }
            if (far < end_) end_ = far;
        }
        if (!(t <= end_)) return false;
        const auto length = [&](int a) { return direction_[a] < 0 ? -direction_[a] : direction_[a]; };
        if (t == 0)
            for (int a = 1; a < 3; ++a)
                if (length(a) > length(axis)) axis = a;
        at = {glm::ivec3(0), t, t, axis, direction_[axis] < 0};
        for (int a = 0; a < 3; ++a) {
            const S p = exact::fma(t, direction_[a], origin_[a]);
            at.cell[a] = p <= 0 ? 0 : p >= static_cast<S>(extent_[a]) ? extent_[a] - 1 : static_cast<int>(p);
            set_side(a);
        }
        return true;
    }
    // The ray parameter at which it leaves a cell along an axis that it moves along.
    [[nodiscard]] VOXELPIPE_HD S side_of(int a, int cell) const {
        return (static_cast<S>(cell + (direction_[a] > 0 ? 1 : 0)) - origin_[a]) * inverse_[a];
    }
    VOXELPIPE_HD void set_side(int a) { side_[a] = direction_[a] == 0 ? never : side_of(a, at.cell[a]); }
    // Which of three sides comes first.
    [[nodiscard]] VOXELPIPE_HD static int axis_of(const S (&side)[3]) {
        const int axis = side[1] < side[0] ? 1 : 0;
        return side[2] < side[axis] ? 2 : axis;
    }
    [[nodiscard]] VOXELPIPE_HD S leaves_at(int axis) const { return side_[axis] > at.enter ? side_[axis] : at.enter; }
    // Through that of these sides.
    VOXELPIPE_HD bool cross(int axis, const S (&side)[3]) {
        const S next = side[axis] > at.enter ? side[axis] : at.enter;
        if (!(next < end_)) return false;
        at.cell[axis] += direction_[axis] > 0 ? 1 : -1;
        if (at.cell[axis] < 0 || at.cell[axis] >= extent_[axis]) return false;
        at.enter = next;
        at.axis = axis;
        at.from_above = direction_[axis] < 0;
        return true;
    }

    glm::ivec3 extent_;
    glm::vec<3, S> origin_, direction_;
    S end_;
    S inverse_[3] = {};
    S side_[3] = {}; // where the ray leaves the cell along each axis
    bool good_;
};

// Calls visit(walked_cell<S>) for every cell that origin + t * direction, 0 <= t <= limit, meets, until one call
// returns true. S is float or double; numbers are finite and the direction is not zero. Returns true if a call did.
VOXELPIPE_ANY_CALLABLE
template <class S, class Visit>
VOXELPIPE_HD bool walk_cells(const glm::ivec3& extent, const glm::vec<3, S>& origin, const glm::vec<3, S>& direction,
                             S limit, const Visit& visit) {
    cell_walk<S> walk(extent, origin, direction, limit);
    if (!walk.good()) return false;
    do {
        walk.look();
        if (visit(static_cast<const walked_cell<S>&>(walk.at))) return true;
    } while (walk.step());
    return false;
}

} // namespace voxelpipe
