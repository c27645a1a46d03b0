// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "placement.hpp"

#include "finite.hpp"
#include "parallel.hpp"

#include <voxelpipe/core/fixed_point.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace voxelize {

namespace {

// A grid of --resolution is larger than the model by this part of its longest side, at either end: surfaces that lie
// in the faces of the bounding box stay off the grid's border.
constexpr double margin = 1e-4;

[[noreturn]] void too_many_voxels(double count, int axis) {
    throw grid_error("the grid would have " + std::to_string(static_cast<long long>(std::fmin(count, 9e18))) +
                     " voxels along " + "xyz"[axis] + ", the most is " + std::to_string(voxelpipe::grid::max_extent));
}

// Sub-voxel units: positions that can be snapped to, along one voxel.
double units(const glm::ivec3& extent) {
    return static_cast<double>(std::int64_t{1}
                               << voxelpipe::core::fraction_bits(std::max({extent.x, extent.y, extent.z})));
}

voxelpipe::grid fit_resolution(int resolution, int padding, const bounding_box& bounds) {
    const int inner = resolution - 2 * padding;
    if (inner < 1)
        throw grid_error("--padding " + std::to_string(padding) + " leaves nothing of --resolution " +
                         std::to_string(resolution));
    const glm::dvec3 size = bounds.high - bounds.low;
    const double longest = std::max({size.x, size.y, size.z});
    const double voxel = longest > 0 ? longest * (1 + 2 * margin) / inner : 1.0;
    // Along the other axes as few as leave room for rounding at both ends: a box of 2 : 1 : 1 gets half the voxels.
    const double room = 8 / units(glm::ivec3(resolution));
    voxelpipe::grid grid;
    grid.voxel_size = glm::dvec3(voxel);
    for (int axis = 0; axis < 3; ++axis) {
        const double wanted = std::ceil(size[axis] / voxel + room);
        grid.extent[axis] = static_cast<int>(std::clamp(wanted, 1.0, static_cast<double>(inner))) + 2 * padding;
        grid.origin[axis] = std::fma(-0.5 * grid.extent[axis], voxel, 0.5 * bounds.low[axis] + 0.5 * bounds.high[axis]);
    }
    return grid;
}

voxelpipe::grid fit_box(const glm::ivec3& box, int padding, const bounding_box& bounds) {
    const glm::dvec3 size = bounds.high - bounds.low;
    double voxel = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int inner = box[axis] - 2 * padding;
        if (inner < 1)
            throw grid_error("--padding " + std::to_string(padding) + " leaves nothing of --resolution " +
                             std::to_string(box.x) + "x" + std::to_string(box.y) + "x" + std::to_string(box.z));
        voxel = std::max(voxel, size[axis] * (1 + 2 * margin) / inner);
    }
    voxelpipe::grid grid;
    grid.voxel_size = glm::dvec3(voxel > 0 ? voxel : 1.0);
    grid.extent = box;
    for (int axis = 0; axis < 3; ++axis)
        grid.origin[axis] =
            std::fma(-0.5 * box[axis], grid.voxel_size.x, 0.5 * bounds.low[axis] + 0.5 * bounds.high[axis]);
    return grid;
}

// Voxels of the lattice, numbers along each axis; the last is not among them.
struct lattice_box {
    glm::dvec3 first{0.0};
    glm::dvec3 last{1.0};

    [[nodiscard]] voxelpipe::grid grid(const glm::dvec3& voxel, int padding) const {
        voxelpipe::grid result;
        result.voxel_size = voxel;
        for (int axis = 0; axis < 3; ++axis) {
            const double count = last[axis] - first[axis] + 2 * padding;
            if (!(count <= voxelpipe::grid::max_extent)) too_many_voxels(count, axis);
            result.extent[axis] = static_cast<int>(count);
            result.origin[axis] = (first[axis] - padding) * voxel[axis];
        }
        return result;
    }
};

// A position of the world as the library snaps it, in units from the grid's lowest corner.
voxelpipe::core::snapped_position snapped(voxelpipe::grid grid, const glm::dvec3& position) {
    const glm::dvec3 reference = reference_point(grid);
    grid.origin -= reference;
    const glm::vec3 p(position - reference);
    return voxelpipe::core::snap(voxelpipe::core::make_snap_transform(grid), p.x, p.y, p.z);
}

// The rule of --voxel-size, which --help states. The box is taken as the library snaps it, so that what is drawn and
// where the grid ends are decided by the same integers.
voxelpipe::grid fit_voxel_size(const grid_request& request, const bounding_box& bounds) {
    const glm::dvec3& voxel = *request.voxel_size;
    lattice_box box; // too small by a layer at most
    for (int axis = 0; axis < 3; ++axis) {
        constexpr double rounding = 1.0 / 16; // no unit of snapping is larger
        box.first[axis] = std::floor(bounds.low[axis] / voxel[axis] + rounding);
        box.last[axis] = std::max(std::ceil(bounds.high[axis] / voxel[axis] - rounding), box.first[axis] + 1);
    }
    voxelpipe::grid grid = box.grid(voxel, request.padding);
    for (bool grown = true; grown;) {
        grown = false;
        const voxelpipe::core::snapped_position low = snapped(grid, bounds.low), high = snapped(grid, bounds.high);
        if (!voxelpipe::core::is_drawable(low) || !voxelpipe::core::is_drawable(high)) break;
        const std::int64_t lowest[3] = {low.x, low.y, low.z}, highest[3] = {high.x, high.y, high.z};
        const auto unit = static_cast<std::int64_t>(units(grid.extent));
        // Thin fragments of a face in a plane between two voxels lie in the upper one: without it there is a hole.
        const std::int64_t in_plane = request.coverage == voxelpipe::coverage::thin ? 1 : 0;
        for (int axis = 0; axis < 3; ++axis) {
            const bool below = lowest[axis] < request.padding * unit;
            const bool above = highest[axis] + in_plane > (grid.extent[axis] - request.padding) * unit;
            if (below) --box.first[axis];
            if (above) ++box.last[axis];
            grown = grown || below || above;
        }
        grid = box.grid(voxel, request.padding);
    }
    return grid;
}

} // namespace

namespace {

// A box that holds everything in BOX under TO_WORLD. Exactly: a fused step rounds monotonically, so no point between
// the corners gets past what they get.
bounding_box box_around(const bounding_box& box, const affine& to_world) {
    bounding_box result;
    if (box.empty) return result;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 p =
            to_world({(corner & 1) != 0 ? box.high.x : box.low.x, (corner & 2) != 0 ? box.high.y : box.low.y,
                      (corner & 4) != 0 ? box.high.z : box.low.z});
        result.include({p, p, false});
    }
    return result;
}

} // namespace

bounding_box bounds_of(const scene& model, int threads) {
    std::vector<std::vector<bool>> corners(model.primitives.size()); // of each primitive: which vertices are any
    std::vector<bounding_box> own(model.primitives.size());          // around them, in its own coordinates
    parallel_for(model.primitives.size(), thread_count(threads), [&](std::size_t n) {
        const primitive& part = model.primitives[n];
        corners[n].resize(part.positions.size());
        for (const glm::uvec3& triangle : part.triangles)
            for (int i = 0; i < 3; ++i) corners[n][triangle[i]] = true;
        for (const glm::uvec2& line : part.lines)
            for (int i = 0; i < 2; ++i) corners[n][line[i]] = true;
        for (std::size_t i = 0; i < part.positions.size(); ++i)
            if (const glm::vec3& p = part.positions[i]; !is_finite(p))
                corners[n][i] = false;
            else if (corners[n][i])
                own[n].include({p, p, false});
    });

    // A box around each instance, by the corners of its primitive's own box: most instances of a forest lie inside of
    // what others reach, and need no look at their vertices.
    std::vector<bounding_box> around(model.instances.size());
    parallel_for(model.instances.size(), thread_count(threads), [&](std::size_t n) {
        const instance& shown = model.instances[n];
        around[n] = box_around(own[shown.primitive], shown.to_world);
    });
    bounding_box all;
    const auto look_at = [&](std::size_t n) {
        if (all.holds(around[n])) return;
        const instance& shown = model.instances[n];
        const std::vector<glm::vec3>& positions = model.primitives[shown.primitive].positions;
        constexpr std::size_t piece = 1 << 16;
        std::vector<bounding_box> boxes((positions.size() + piece - 1) / piece);
        parallel_for(boxes.size(), thread_count(threads), [&](std::size_t b) {
            for (std::size_t i = b * piece; i < std::min(positions.size(), (b + 1) * piece); ++i) {
                if (!corners[shown.primitive][i]) continue;
                const glm::dvec3 p = shown.to_world(positions[i]);
                // Positions that are no floats are not drawn.
                if (is_finite(glm::vec3(p))) boxes[b].include({p, p, false});
            }
        });
        for (const bounding_box& box : boxes) all.include(box);
    };
    for (int axis = 0; axis < 3; ++axis) { // those that reach furthest first
        std::size_t lowest = 0, highest = 0;
        for (std::size_t n = 0; n < around.size(); ++n) {
            if (around[n].low[axis] < around[lowest].low[axis]) lowest = n;
            if (around[n].high[axis] > around[highest].high[axis]) highest = n;
        }
        if (around.empty()) break;
        look_at(lowest);
        look_at(highest);
    }
    for (std::size_t n = 0; n < around.size(); ++n) look_at(n);
    return all;
}

glm::dvec3 reference_point(const voxelpipe::grid& grid) {
    const glm::ivec3 whole = grid.whole_extent();
    const int fraction = voxelpipe::core::fraction_bits(std::max({whole.x, whole.y, whole.z}));
    const double most = static_cast<double>(std::int64_t{1} << (24 - fraction)); // voxels from zero
    for (int axis = 0; axis < 3; ++axis) {
        const double size = grid.voxel_size[axis];
        const double low = grid.origin[axis];
        const double high = std::fma(whole[axis], size, low);
        if (std::max(std::abs(low), std::abs(high)) > most * size) return grid.origin;
    }
    return glm::dvec3(0);
}

std::string precision_warning(const scene& model, const voxelpipe::grid& grid) {
    std::vector<glm::vec3> greatest(model.primitives.size(), glm::vec3(0)); // coordinate of each primitive, by axis
    for (std::size_t n = 0; n < greatest.size(); ++n)
        for (const glm::vec3& p : model.primitives[n].positions)
            if (is_finite(p)) greatest[n] = glm::max(greatest[n], glm::abs(p));

    constexpr double harmless = 0.25; // of a voxel: rounding is off by half of that at most
    double worst = harmless;
    std::string text;
    for (const instance& shown : model.instances) {
        const glm::vec3& reach = greatest[shown.primitive];
        for (std::size_t row = 0; row < 3; ++row) {
            double step = 0; // between neighbouring positions, along this axis of the world
            for (std::size_t column = 0; column < 3; ++column) {
                const float at = reach[static_cast<glm::length_t>(column)];
                const float next = std::nextafter(at, std::numeric_limits<float>::infinity());
                step = std::fma(std::abs(shown.to_world.m[row][column]), double{next} - double{at}, step);
            }
            const double voxel = grid.voxel_size[static_cast<glm::length_t>(row)];
            if (!(step > worst * voxel)) continue;
            worst = step / voxel;
            std::ostringstream line;
            line << "the positions of \"" << model.primitives[shown.primitive].name << "\" are floats of up to "
                 << std::max({reach.x, reach.y, reach.z}) << ", which lie " << step
                 << " apart in the world, and voxels are " << voxel << " wide: the surface may be off by "
                 << step / voxel / 2 << " voxels. Small positions under a node's translation would keep their digits";
            text = line.str();
        }
    }
    return text;
}

namespace {

// Out of line, because g++ 11 (-O3) and g++ 12 (-O2) leave out the rounding where they vectorise two neighbours:
//     void f(const double* in, double* out) { float a = in[0], b = in[1]; out[0] = a; out[1] = b; }
// is compiled to a plain copy.
[[gnu::noinline]] double rounded_to_float(double x) { return static_cast<float>(x); }

voxelpipe::grid place(const grid_request& request, const bounding_box& bounds) {
    if (request.padding < 0) throw grid_error("--padding cannot be negative");
    voxelpipe::grid grid;
    if (request.origin || request.extent) {
        if (!request.origin || !request.extent || !request.voxel_size)
            throw grid_error("an exact grid needs all three of --origin, --voxel-size and --extent");
        if (request.resolution || request.box || request.padding != 0)
            throw grid_error("--resolution and --padding do not go with --origin and --extent");
        grid.origin = *request.origin;
        grid.voxel_size = *request.voxel_size;
        grid.extent = *request.extent;
    } else if ((request.resolution || request.box) && request.voxel_size) {
        throw grid_error("--resolution and --voxel-size do not go together");
    } else if (request.voxel_size) {
        for (int axis = 0; axis < 3; ++axis)
            if (!((*request.voxel_size)[axis] > 0)) throw grid_error("--voxel-size must be positive");
        grid = fit_voxel_size(request, bounds);
    } else if (request.box) {
        for (int axis = 0; axis < 3; ++axis) {
            if ((*request.box)[axis] < 1) throw grid_error("--resolution must be at least 1");
            if ((*request.box)[axis] > voxelpipe::grid::max_extent) too_many_voxels((*request.box)[axis], axis);
        }
        grid = fit_box(*request.box, request.padding, bounds);
    } else {
        const int resolution = request.resolution.value_or(128);
        if (resolution < 1) throw grid_error("--resolution must be at least 1");
        if (resolution > voxelpipe::grid::max_extent) too_many_voxels(resolution, 0);
        grid = fit_resolution(resolution, request.padding, bounds);
    }
    if (const voxelpipe::status status = voxelpipe::validate(grid); !status.ok())
        throw grid_error(std::string("the grid is not usable: ") + voxelpipe::to_string(status.code));
    return grid;
}

} // namespace

voxelpipe::grid place_grid(const grid_request& request, const bounding_box& bounds) {
    // The bounds of what is drawn: of positions as they are rounded.
    bounding_box rounded = bounds;
    for (int axis = 0; axis < 3; ++axis) {
        rounded.low[axis] = rounded_to_float(bounds.low[axis]);
        rounded.high[axis] = rounded_to_float(bounds.high[axis]);
    }
    const voxelpipe::grid grid = place(request, rounded);
    return reference_point(grid) == glm::dvec3(0) ? grid : place(request, bounds);
}

} // namespace voxelize
