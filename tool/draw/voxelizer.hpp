// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// scene + options -> volume: all targets in one pass of the pipeline, on the backend of the user's choice. The result
// is the same bytes for every backend, number of threads and amount of working memory.

#include "distance/distance_request.hpp"
#include "model/memory.hpp"
#include "model/scene.hpp"
#include "model/targets.hpp"
#include "model/volume.hpp"
#include "remesh/remesh_request.hpp"
#include "solid.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/device/call/strategy.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/status.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

enum class backend_choice : std::uint8_t { automatic, cpu, cuda };

// Meaning of a BLEND material's alpha: the weight of its colour, a cut at one half as by MASK, or nothing.
enum class blend_alpha : std::uint8_t { weight, cutoff, ignore };

// A material's alpha mode by that choice.
[[nodiscard]] inline alpha_mode alpha_of(const material& m, blend_alpha choice) {
    if (m.alpha != alpha_mode::blend || choice == blend_alpha::weight) return m.alpha;
    return choice == blend_alpha::cutoff ? alpha_mode::mask : alpha_mode::opaque;
}

class cuda_start;   // cuda_device.hpp
struct column_ends; // outside.hpp

struct voxelize_request {
    voxelpipe::grid grid;
    int padding = 0; // voxels of it on every side in which nothing is drawn
    voxelpipe::coverage coverage = voxelpipe::coverage::conservative;
    std::optional<solid_request> solid;             // instead of the surface, whose coverage is conservative then
    std::optional<distance_request> distance;       // instead of both; the grid is that of the samples then
    std::optional<remesh_request> remesh;           // instead of all three: no volume is drawn
    std::vector<target> targets{target::occupancy}; // channels of the volume, in this order, none twice
    int depth_axis = 2;                             // 0 x, 1 y, 2 z
    bool clamp = false;                             // fractions to 0..1
    int slab_layers = 0;  // cut cells: outputs take slabs of a multiple of this number of layers; 0: they do not
    bool outside = false; // fractions and apertures are those of what is not inside
    int neighbours = 18;  // links of a voxel: 18 or 26
    std::uint64_t close_holes = 0; // before cells are measured, holes of up to this number of edges; 0: no holes
    blend_alpha alpha = blend_alpha::weight;
    backend_choice backend = backend_choice::automatic;
    voxelpipe::strategy strategy = voxelpipe::strategy::automatic; // on a GPU
    int devices = 1;                                               // GPUs that share the surface's layers; 0: all
    int threads = 0;                                               // 0: all cores
    // Bytes for what exists only while the pipeline runs. A grid that needs more is computed in slabs along z. 0: what
    // suits the backend and the run's memory.
    std::uint64_t work_memory = 0;
    std::uint64_t device_memory = 0;      // most bytes to take of a GPU's memory; 0: all that is free
    std::shared_ptr<cuda_start> cuda;     // if CUDA is starting already; otherwise it starts when it is wanted
    std::function<void(double)> progress; // called with 0..1, one call at a time; may be empty
    // Returns the most bytes that writing takes beside the result, from its numbers of bricks, voxels and voxels in
    // tiles; empty where nothing is written.
    std::function<double(double bricks, double voxels, double in_tiles)> write_bytes;
    // color-outer of a slab along z: the ends of the columns along z in the whole grid, by x and y within the slab. Not
    // owned. Null: the slab is all there is.
    const column_ends* columns = nullptr;

    [[nodiscard]] bool wants(target id) const { return std::find(targets.begin(), targets.end(), id) != targets.end(); }
    [[nodiscard]] bool wants_colors() const { return std::any_of(targets.begin(), targets.end(), is_color); }
    [[nodiscard]] bool wants_cells() const { return std::any_of(targets.begin(), targets.end(), is_of_cells); }
    [[nodiscard]] bool wants_links() const { return std::any_of(targets.begin(), targets.end(), is_of_links); }
};

// The name of the first target of cut cells, for messages.
[[nodiscard]] inline std::string name_of_cells(const voxelize_request& request) {
    const auto found = std::find_if(request.targets.begin(), request.targets.end(), is_of_cells);
    return std::string(info_of(found == request.targets.end() ? target::fraction : *found).name);
}

// A volume of the grid's extent and place, without channels.
[[nodiscard]] inline volume volume_of(const voxelpipe::grid& grid) {
    volume made;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<glm::length_t>(axis);
        made.extent[axis] = grid.extent[a];
        made.origin[axis] = grid.part_origin()[a];
        made.voxel_size[axis] = grid.voxel_size[a];
    }
    return made;
}

// Puts a volume of the grid's faces across the axis into their place: the middle of its first voxel is that of the
// first face.
inline void center_on_faces(volume& faces, const voxelpipe::grid& grid, int axis) {
    faces.origin[static_cast<std::size_t>(axis)] = grid.part_origin()[axis] - grid.voxel_size[axis] / 2;
}

// What was found when fractions were drawn.
struct fraction_counts {
    // The sum of the fractions of all voxels, before they are clamped, as voxelpipe::cell_counters has it.
    std::uint64_t volume_low = 0;
    std::int64_t volume_high = 0;
    std::uint64_t cut_voxels = 0; // that a triangle's inside reaches
    std::uint64_t below_zero = 0; // voxels with a fraction below -2^-24
    std::uint64_t above_one = 0;  // above 1 + 2^-24
    std::uint64_t rows = 0;       // rows of voxels along x, and for area vectors along y and z too
    std::uint64_t open_rows = 0;  // rows whose triangles do not balance
    std::uint64_t open_edges = 0; // edges of the snapped model, lids included, that no opposite edge cancels
    std::uint64_t hole_edges = 0, holes = 0, closed_holes = 0; // with close_holes

    // The sum in voxels.
    [[nodiscard]] double volume() const {
        voxelpipe::cell_counters sum;
        sum.volume_low = volume_low;
        sum.volume_high = volume_high;
        return sum.volume();
    }
};

struct voxelize_stats {
    std::string backend;                 // "cpu" or "cuda"
    std::string device;                  // the GPU's name
    int devices = 0;                     // GPUs that worked
    voxelpipe::strategy_choice strategy; // of the last call on a GPU
    std::string no_cuda;                 // why the choice between the two fell on the CPU
    std::string estimate;                // what the choice between the two went by; empty where there was none
    std::uint64_t device_memory = 0;     // the most that was held there, in bytes
    int threads = 0;                     // on the CPU
    int slabs = 0;
    // Slabs drawn for passes over all of them, where processes and later runs share these; none: they share none.
    std::optional<std::uint64_t> pass_slabs;
    std::uint64_t triangles = 0;
    std::uint64_t lines = 0;               // and points
    std::uint64_t triangles_dropped = 0;   // a position that is not finite, or too far from the grid to be snapped
    std::uint64_t lines_dropped = 0;       // for the same reasons
    std::uint64_t triangles_drawn = 0;     // that reach into the grid, summed over slabs; lines too
    std::uint64_t triangles_flat = 0;      // without area, which conservative coverage alone draws; summed over slabs
    std::uint64_t fragments = 0;           // kept, over all voxels; of a solid's surface where that is drawn
    std::uint64_t fragments_discarded = 0; // by an alpha mask
    std::uint64_t voxels = 0;              // with at least one fragment; of a solid where that is asked for
    std::optional<solid_counts> solid;     // where that is asked for
    std::optional<fraction_counts> fractions; // with --target fraction
    std::uint64_t normals_cancelled = 0; // voxels whose normals cancel out, or that have none; with --target normal
    std::vector<std::pair<std::string, double>> milliseconds; // stage -> time, in pipeline order
    std::vector<std::string> warnings;                        // one line each
};

// The backend was not built, there is no device for it, or it cannot draw in the way that was asked for.
struct backend_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// For work that no GPU does, `why` says which: throws backend_error where the request asks for a GPU, for a strategy of
// one or for several; says in `stats` why the choice falls on the CPU where there is one.
void require_cpu(const voxelize_request& request, const std::string& why, voxelize_stats& stats);

// Consumes the scene: its arrays move to the backend. The backend `automatic` is the first GPU where that can be used
// and the work takes longer on the CPU, by backend_estimate.hpp; a warning where only the GPU's memory was too small.
// Throws memory_error, backend_error, and std::runtime_error for what the library refuses.
[[nodiscard]] volume run_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats);

// Makes those of the outside of the fractions and apertures of a result.
void take_outside(volume& result, int threads);

// Cut cells in slabs, where the whole result does not fit, outputs take slabs, and each layer has its values by itself
// (fraction, area, centroid): then the channels have no data, but draw slabs as they are read and keep two. `stats` has
// to outlive the volume, and its counts are whole once all of it has been read; add_fraction_warnings is left to do
// then. No volume where all is drawn at once; the scene is as it was. Throws memory_error where slabs do not fit
// either.
[[nodiscard]] std::optional<volume> cells_in_slabs(scene& model, const voxelize_request& request,
                                                   voxelize_stats& stats);

// The reason why no voxel is covered, one line; for stats that count none. low, high: the model's bounds.
[[nodiscard]] std::string why_empty(const voxelize_stats& stats, const voxelize_request& request, const glm::dvec3& low,
                                    const glm::dvec3& high);

// Lines on fractions that are no volume inside: of an open model, and of parts that overlap or are inside out.
[[nodiscard]] std::vector<std::string> fraction_warnings(const fraction_counts& counts, bool clamp);

// Adds these lines of what was drawn.
void add_fraction_warnings(const voxelize_request& request, voxelize_stats& stats);

// One line on normals that cancel; empty where none do.
[[nodiscard]] std::string cancelled_warning(const voxelize_stats& stats);

// Bytes of the volume that a request gives.
[[nodiscard]] double volume_bytes(const voxelize_request& request);
// Bytes that a dense run of this model on the CPU comes to, beyond those that are held before it, about.
[[nodiscard]] double dense_need(const scene& model, const voxelize_request& request);
// The same without what the model's vertices and triangles take, which bricks do not spare.
[[nodiscard]] double dense_need(const voxelize_request& request);
// Throws memory_error where the vertices of all instances, which are snapped before anything is drawn, do not fit
// beside `result` bytes.
void require_vertices(const scene& model, const voxelize_request& request, double result);

} // namespace voxelize
