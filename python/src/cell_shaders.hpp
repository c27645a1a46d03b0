// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the modules for CPU and GPU: the shaders of cut cells, which write what fractions() gives beside the
// fractions into arrays of the caller.

#include <voxelpipe/cells/cells.hpp>

#include <cstdint>
#include <optional>
#include <type_traits>

namespace voxelpipe::python {

// The options of a call by rows along an axis, 0 to 2. close_holes: repair::close_holes, of holes of at most
// max_hole_edges.
[[nodiscard]] inline cell_options cell_options_of(int axis, bool close_holes,
                                                  std::optional<std::uint64_t> max_hole_edges) {
    cell_options options;
    options.axis = axis;
    if (close_holes) options.repair = repair::close_holes;
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
    return options;
}

// Arrays of the voxels' faces beside the fractions, null where nobody asked: every element is that of one voxel, which
// writes it.
struct face_arrays {
    double* apertures = nullptr; // of the grid's extent, and one more along the axis
    double* areas = nullptr;     // three a voxel
    float* centroids = nullptr;  // three a face, in the order of the apertures
    double face = 1;             // the area of a voxel's face across the axis, in world units
    glm::ivec3 extent{};
    glm::ivec3 offset{}; // of the grid in the whole one
    int axis = 0;

    // The same arrays, for rows along an axis of a grid.
    [[nodiscard]] face_arrays of(const grid& g, int along) const {
        const glm::dvec3 s = g.voxel_size;
        face_arrays made = *this;
        made.face = along == 0 ? s.y * s.z : along == 1 ? s.z * s.x : s.x * s.y;
        made.extent = g.extent;
        made.offset = g.offset;
        made.axis = along;
        return made;
    }
};

VOXELPIPE_HD inline void write_vector(float* to, const glm::vec3& v) {
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}

// Cell shader that returns the fraction, and puts the voxel's faces along the axis into their arrays.
struct fraction_and_faces {
    face_arrays to;

    template <class Fragment>
    VOXELPIPE_HD output<float> operator()(const Fragment& f) const {
        constexpr double unit = 0x1p-44;
        const std::int64_t x = f.voxel.x - to.offset.x, y = f.voxel.y - to.offset.y, z = f.voxel.z - to.offset.z;
        // Components by name: the axis is known at run time alone.
        const bool along_x = to.axis == 0, along_y = to.axis == 1, along_z = to.axis == 2;
        const std::int64_t nx = to.extent.x + (along_x ? 1 : 0), ny = to.extent.y + (along_y ? 1 : 0);
        const std::int64_t lower = (z * ny + y) * nx + x, upper = lower + (along_x ? 1 : along_y ? nx : nx * ny);
        // The upper face is no other voxel's lower one.
        const bool is_last =
            (along_x && x + 1 == to.extent.x) || (along_y && y + 1 == to.extent.y) || (along_z && z + 1 == to.extent.z);
        if (to.apertures != nullptr) {
            to.apertures[lower] = static_cast<double>(f.aperture) * unit;
            if (is_last) to.apertures[upper] = static_cast<double>(f.next_aperture) * unit;
        }
        if constexpr (std::is_base_of_v<core::value_of_cell<cell_value::faces>, Fragment>)
            if (to.centroids != nullptr) {
                write_vector(to.centroids + 3 * lower, f.aperture_centroid);
                if (is_last) write_vector(to.centroids + 3 * upper, f.next_aperture_centroid);
            }
        // The units' difference is exact; in double, one rounding for the voxel's size.
        if (to.areas != nullptr)
            to.areas[3 * ((z * to.extent.y + y) * to.extent.x + x) + to.axis] =
                static_cast<double>(f.aperture - f.next_aperture) * unit * to.face;
        return outputs(f.fraction);
    }
};

// The same with the faces' centroids.
struct fraction_and_face_centroids : fraction_and_faces {
    using fragment = measured_cell<cell_value::faces>;
};

// Arrays of what is measured within a voxel, null where nobody asked.
struct inner_arrays {
    float* centroids = nullptr; // three a voxel
    double* areas = nullptr;
    float* area_centroids = nullptr; // three a voxel
    bool* multi_cuts = nullptr;

    [[nodiscard]] bool any() const {
        return centroids != nullptr || areas != nullptr || area_centroids != nullptr || multi_cuts != nullptr;
    }
};

// The same with what is measured within the voxel, too.
struct fraction_and_measures : fraction_and_faces {
    using fragment = measured_cell<cell_value::centroid, cell_value::area, cell_value::sheets, cell_value::faces>;
    inner_arrays inner;

    VOXELPIPE_HD output<float> operator()(const fragment& f) const {
        const std::int64_t x = f.voxel.x - to.offset.x, y = f.voxel.y - to.offset.y, z = f.voxel.z - to.offset.z;
        const std::int64_t voxel = (z * to.extent.y + y) * to.extent.x + x;
        if (inner.centroids != nullptr) write_vector(inner.centroids + 3 * voxel, f.centroid);
        if (inner.area_centroids != nullptr) write_vector(inner.area_centroids + 3 * voxel, f.area_centroid);
        if (inner.areas != nullptr) inner.areas[voxel] = f.area;
        if (inner.multi_cuts != nullptr) inner.multi_cuts[voxel] = f.is_multi_cut;
        return fraction_and_faces::operator()(f);
    }
};

} // namespace voxelpipe::python
