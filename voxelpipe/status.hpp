// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The result of a voxelize call: success, or which check failed at which stage, with counts. Calls do not throw on bad
// input; or_throw() turns a status into an exception. Constructors return no status, so they throw: std::bad_alloc or
// the backend's error, and std::length_error for a framebuffer too large to address.

#include <cstdint>
#include <stdexcept>
#include <string>

namespace voxelpipe {

// Why a call did nothing. A call that fails has written no target.
enum class status_code : std::uint8_t {
    ok,                   // success
    null_view,            // a view with elements but without memory, or a target that is on but has none
    index_out_of_range,   // a triangle names a vertex that the mesh does not have
    attribute_mismatch,   // a vertex attribute array is not as long as the positions
    not_affine,           // vp::transform with a matrix whose last row is not 0 0 0 1
    bad_extent,           // an extent that is zero or negative
    bad_crop,             // a crop that is not within the whole grid
    extent_too_large,     // an extent above grid::max_extent
    bad_origin,           // NaN or infinite
    bad_voxel_size,       // zero, negative, NaN, infinite, or so small or large that the snapping scale is no number
    extent_mismatch,      // framebuffer and grid differ in extent
    size_overflow,        // a buffer would have more bytes than this machine can address
    too_many_triangles,   // more than 2^32 - 1 in all draws together
    out_of_memory,        // of the host or the device
    capacity_exceeded,    // the caller's workspace is too small; `required` says what is needed
    strategy_unavailable, // the forced strategy cannot serve the call
    bad_solid_options,    // an option of voxelize_solid is out of its range, or has no meaning with the repair
    bad_distance_options, // an option of voxelize_distance is out of its range, or options contradict each other
    bad_surface_options,  // an option of extract or remesh is out of its range, or has no meaning with another
    too_many_vertices,    // a surface of more than 2^32 - 1; surface_counters::vertices says how many, or at least
    bad_level,            // a tessellation program gave a level below 1 or above its max_level
    bad_count,            // a geometry program emitted more triangles than its type holds
    bad_subset,           // mesh_view::part: not one number a triangle, or not ascending below `whole`
    other_rank_failed,    // slabs/: this part of the work has not failed, that of another rank or GPU has
    bad_cell_options,     // an option of voxelize_cells is out of its range, or a repair other than close_holes
    winding_too_large,    // voxelize_cells: the covers of a row's pixels may sum to more than 2^18 pixels
    crop_without_whole,   // repair::exterior of a crop: what lies outside follows from the whole grid
    bad_label_options,    // label: a connectivity other than 6, 18 and 26
    too_many_voxels,      // label: a grid with more voxels than labels of that type can number
    no_device,            // cuda_backend without a usable device
    device_error,         // `device_error` holds the CUDA error
};

// Stages of the pipeline, in their order; where a call failed: validate, vertex_shade, coarse_raster, tile_sort,
// tile_split, fine_raster, tile_resolve or abuffer_emit.
enum class stage : std::uint8_t {
    validate,
    vertex_shade,
    coarse_raster,
    tile_sort,
    tile_split,
    fine_raster,
    tile_resolve,
    abuffer_emit,
};

// Counts of one call. A triangle is in exactly one of the fields from triangles_nonfinite to triangles_drawn, a
// fragment in exactly one of fragments and fragments_discarded.
struct counters {
    std::uint64_t triangles_in = 0;        // of all draws and instances
    std::uint64_t triangles_nonfinite = 0; // dropped: a position that is NaN or infinite
    std::uint64_t triangles_too_far = 0;   // dropped: a position beyond 2^40 sub-voxel units
    std::uint64_t triangles_zero_area =
        0;                               // not with conservative coverage: zero area after snapping, gives no fragments
    std::uint64_t triangles_outside = 0; // bounding box misses the grid
    std::uint64_t triangles_drawn = 0;   // the others
    std::uint64_t fragments = 0;         // shaded and blended (or kept, in an A-buffer)
    std::uint64_t fragments_discarded = 0; // by the fragment shader
    std::uint64_t voxels = 0;              // with at least one fragment; 0 if counting was switched off

    // Number of triangles dropped for either reason.
    [[nodiscard]] std::uint64_t triangles_dropped() const { return triangles_nonfinite + triangles_too_far; }
    friend bool operator==(const counters&, const counters&) = default;
};

// What the flood of repair::exterior did, as diagnose_repair (diagnose_repair.hpp) finds it; zeros from other calls.
struct flood_counters {
    // Voxels that the closed rows along x, y and z have inside (repair::vote) and the flood took. Those no further from
    // a hole's lid (repair::close_holes) than the closing, or than 1, do not count. 0: nothing is amiss.
    std::uint64_t lost_voxels = 0;
    std::uint64_t enclosed_voxels = 0; // those that the flood left and no triangle touches
    // Number of lost voxels that closed rows and the holes' lids have inside, and a flood around mesh and lids took all
    // the same: it came in where the mesh leaves the grid, and would not take them in a grid that holds the mesh.
    std::uint64_t face_voxels = 0;
    // Number of the holes of the mesh, components of the edges that no opposite edge cancels, by which the flood came
    // in: it took voxels between their edges.
    std::uint64_t entered_holes = 0;
    std::uint32_t hole_width = 0; // of the widest of them, in voxels, rounded up; of a slit its narrow side
    // The least solid_options::closing, of those that were tried, whose flood keeps what the holes' lids enclose; 0:
    // none did.
    std::int32_t closing = 0;
    std::uint32_t close_holes = 0; // 1: repair::close_holes was tried, leaves no row open and keeps these voxels

    friend bool operator==(const flood_counters&, const flood_counters&) = default;
};

// What voxelize_solid counts besides `counters`; zeros from other calls. Of a crop these are numbers of the crop's
// rows, along x through the whole grid. Numbers of slabs along y and z add up to those of the whole; of slabs along x
// each has the same rows, and open_rows and crossings are the same numbers.
struct solid_counters {
    // Rows whose crossings, in, before and behind the grid, are odd in number (fill_rule::even_odd) or do not sum to 0
    // (other rules); with bodies::draw each draw counts for itself. More than 0 proves that the mesh is not closed; 0
    // proves only that these rows balance. repair::vote counts as even_odd does; repair::exterior looks at no rows.
    std::uint64_t open_rows = 0;
    std::uint64_t crossings = 0;   // of triangles with rows, in, before and behind the grid
    std::uint64_t max_winding = 0; // greatest |winding number| of a voxel's centre; 0 for fill_rule::even_odd
    // repair::close_holes and repair::winding only:
    std::uint64_t hole_edges = 0; // edges that no opposite edge cancels
    std::uint64_t holes = 0;      // their connected components
    std::uint64_t cones = 0;      // holes that were closed

    flood_counters flood{}; // of diagnose_repair only

    friend bool operator==(const solid_counters&, const solid_counters&) = default;
};

// What voxelize_distance and distance_at count besides `counters`; zeros from other calls.
struct distance_counters {
    std::uint64_t band_samples = 0; // samples that hold their distance; the others hold the band's
    std::uint64_t bad_points = 0;   // distance_at: points that are not finite or beyond 2^40 sub-voxel units
    friend bool operator==(const distance_counters&, const distance_counters&) = default;
};

// What extract and remesh count besides `counters`; zeros from other calls.
struct surface_counters {
    std::uint64_t vertices = 0;            // of the surface
    std::uint64_t faces = 0;               // triangles, or quads
    std::uint64_t components = 0;          // connected ones, of those that the surface has
    std::uint64_t components_left_out = 0; // by extract_options::min_component
    std::uint64_t cone_crossings = 0;      // edges that the surface crosses on a cone of close_holes
    std::uint64_t made_crossings = 0;      // edges without a crossing of mesh or field, crossed in their middle
    std::uint64_t nan_samples = 0;         // of a field, which are outside
    std::uint64_t nearest_values = 0;      // vertices with the values of the nearest triangle, for want of a crossing's
    std::uint64_t embed_rounds = 0;        // of extract_options::embedded that moved vertices
    std::uint64_t moved_vertices = 0;      // by these rounds, to the mean of their crossings
    std::uint64_t intersecting_pairs = 0;  // of triangles that these rounds leave; 0 if none were looked for

    friend bool operator==(const surface_counters&, const surface_counters&) = default;
};

// What voxelize_cells counts besides `counters`; zeros from other calls. Volumes are multiples of 2^-44 of a voxel.
struct cell_counters {
    // The sum of the fractions of the call's voxels, of all bodies, is a signed number of 128 bits.
    std::uint64_t volume_low = 0;     // its lower 64 bits
    std::int64_t volume_high = 0;     // its upper 64 bits
    std::uint64_t cut_voxels = 0;     // voxels that a triangle's inside reaches; with bodies::draw once a draw
    std::uint64_t below_zero = 0;     // fractions below -2^-24
    std::uint64_t above_one = 0;      // fractions above 1 + 2^-24
    std::uint64_t open_rows = 0;      // rows along the axis whose covers do not sum to 0
    std::uint64_t open_edges = 0;     // snapped edges that no opposite edge cancels; 0 if they were not counted
    std::uint64_t cell_records = 0;   // parts of triangles in voxels, before and behind the grid
    std::uint64_t lost_centroids = 0; // with cell_value::centroid: fragments that have the voxel's centre instead
    // repair::close_holes only; the cones' edges count for open_edges:
    std::uint64_t hole_edges = 0; // edges that no opposite edge cancels
    std::uint64_t holes = 0;      // their connected components
    std::uint64_t cones = 0;      // holes that were closed

    // The volume in voxels, rounded to double.
    [[nodiscard]] double volume() const {
        return static_cast<double>(volume_high) * 0x1p20 + static_cast<double>(volume_low) * 0x1p-44;
    }
    friend bool operator==(const cell_counters&, const cell_counters&) = default;
};

// What label counts; zeros from other calls.
struct label_counters {
    std::uint64_t components = 0; // connected components of the voxels that are set
    friend bool operator==(const label_counters&, const label_counters&) = default;
};

// Sizes that a caller's workspace or limits must have; set if `code` is capacity_exceeded.
struct required_sizes {
    std::uint64_t tile_pairs = 0;         // as workspace_limits
    std::uint64_t fragments = 0;          // as workspace_limits
    std::uint64_t bytes = 0;              // of the workspace
    std::uint64_t bricks = 0, voxels = 0; // of a sparse framebuffer with limits
};

// A description in English, without a final stop. Static memory.
[[nodiscard]] inline const char* to_string(status_code code) {
    switch (code) {
    case status_code::ok:
        return "ok";
    case status_code::null_view:
        return "null view: a non-empty array or an enabled target has no memory";
    case status_code::index_out_of_range:
        return "index out of range: a triangle names a vertex that does not exist";
    case status_code::attribute_mismatch:
        return "attribute mismatch: an attribute array is not as long as the positions";
    case status_code::not_affine:
        return "not affine: the last row of a vp::transform's matrix is not 0 0 0 1";
    case status_code::bad_extent:
        return "bad extent: zero or negative";
    case status_code::bad_crop:
        return "bad crop: not within the whole grid";
    case status_code::extent_too_large:
        return "extent too large";
    case status_code::bad_origin:
        return "bad origin: NaN or infinite";
    case status_code::bad_voxel_size:
        return "bad voxel size: not a positive finite number of usable magnitude";
    case status_code::extent_mismatch:
        return "extent mismatch: framebuffer and grid differ";
    case status_code::size_overflow:
        return "size overflow: more bytes than can be addressed";
    case status_code::too_many_triangles:
        return "too many triangles: more than 2^32 - 1 in all draws";
    case status_code::out_of_memory:
        return "out of memory";
    case status_code::capacity_exceeded:
        return "capacity exceeded: see the required sizes";
    case status_code::strategy_unavailable:
        return "strategy unavailable: the forced strategy cannot serve this call";
    case status_code::bad_solid_options:
        return "bad solid options: a value out of its range, or a rule or an extent with a repair that has its own";
    case status_code::bad_distance_options:
        return "bad distance options: a band that is not above 0, a value out of its range, or a rule or a repair "
               "where no sign is wanted";
    case status_code::bad_surface_options:
        return "bad surface options: a value out of its range, or a level or a repair that does not go with the rest";
    case status_code::too_many_vertices:
        return "too many vertices: a surface of more than 2^32 - 1";
    case status_code::bad_level:
        return "bad level: a tessellation program's edge_level must be 1 to its max_level";
    case status_code::bad_count:
        return "bad count: a geometry program emitted more triangles than vp::triangles<N> holds";
    case status_code::bad_subset:
        return "bad subset: a mesh's part needs one number a triangle, ascending and below the whole";
    case status_code::other_rank_failed:
        return "another rank or GPU failed: this one's part is not to be used";
    case status_code::bad_cell_options:
        return "bad cell options: a value out of its range, or a repair other than close_holes";
    case status_code::winding_too_large:
        return "winding too large: the covers of a row sum to more than 2^18 pixels";
    case status_code::crop_without_whole:
        return "crop without whole: the exterior of a part of a mesh follows from all of it, draw a grid that holds "
               "that";
    case status_code::bad_label_options:
        return "bad label options: the connectivity must be 6, 18 or 26";
    case status_code::too_many_voxels:
        return "too many voxels: more than labels of this type can number; take std::int64_t";
    case status_code::no_device:
        return "no usable device";
    case status_code::device_error:
        return "device error";
    }
    return "unknown status";
}

[[nodiscard]] inline const char* to_string(stage where) {
    switch (where) {
    case stage::validate:
        return "validate";
    case stage::vertex_shade:
        return "vertex shade";
    case stage::coarse_raster:
        return "coarse raster";
    case stage::tile_sort:
        return "tile sort";
    case stage::tile_split:
        return "tile split";
    case stage::fine_raster:
        return "fine raster";
    case stage::tile_resolve:
        return "tile resolve";
    case stage::abuffer_emit:
        return "A-buffer emit";
    }
    return "unknown stage";
}

struct checked_status;

// What a call returns: success, or what failed, and counts. Must not be ignored; see or_throw().
struct [[nodiscard]] status {
    status_code code = status_code::ok;                         // why it failed
    stage where = stage::validate;                              // the stage that failed; meaningless when ok
    int device_error = 0;                                       // cudaError_t, 0 on the CPU
    counters counts{};                                          // of this call
    solid_counters solid{};                                     // of voxelize_solid, and of a distance's sign
    distance_counters distance{};                               // of voxelize_distance and distance_at
    surface_counters surface{};                                 // of extract and remesh
    cell_counters cells{};                                      // of voxelize_cells
    label_counters label{};                                     // of label
    required_sizes required{};                                  // if the capacity did not suffice
    static constexpr std::uint32_t unknown = ~std::uint32_t{0}; // no draw or triangle is named
    std::uint32_t draw = unknown; // of index_out_of_range: the first such triangle and its draw, if voxelize returns
    std::uint32_t triangle = unknown; // it; voxelize_async does not look for them

    [[nodiscard]] bool ok() const { return code == status_code::ok; } // True for success.
    // A success that drew no triangle: there was none, all were outside the grid, or all were dropped (NaN).
    [[nodiscard]] bool nothing_drawn() const { return ok() && counts.triangles_drawn == 0; }
    explicit operator bool() const { return ok(); } // As ok().

    // One line: what failed and where.
    [[nodiscard]] std::string message() const {
        if (ok()) return to_string(code);
        std::string text = std::string(to_string(where)) + ": " + to_string(code);
        if (triangle != unknown)
            text += " (triangle " + std::to_string(triangle) + " of draw " + std::to_string(draw) + ")";
        if (device_error != 0) text += " (CUDA error " + std::to_string(device_error) + ")";
        return text;
    }

    // Returns a copy of *this when ok; throws std::runtime_error with message() otherwise.
    checked_status or_throw() const; // NOLINT(*-nodiscard)
};

// A status that is ok. Unlike other statuses it may be ignored.
struct checked_status : status {};

inline checked_status status::or_throw() const {
    if (!ok()) throw std::runtime_error("voxelpipe: " + message());
    return {*this};
}

} // namespace voxelpipe
