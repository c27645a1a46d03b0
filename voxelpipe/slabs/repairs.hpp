// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the slabs of a solid need of each other for its repair: found from all triangles, or from the cover of all
// slabs, and given to the call of each slab (solid_options::cones and ::slab). Plain C++; a backend draws the cover.
// Needs POSIX files.
//
//   close_holes, and winding as well: add() all triangles, begin();              of() each slab
//   vote          add() all triangles, begin();              enter() each slab with its triangles, of(), leave()
//   exterior      begin(), add_walls() of all slabs, flood(); of() each slab

#include <voxelpipe/grid.hpp>
#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/exterior.hpp>
#include <voxelpipe/slabs/holes.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/solid/core/bit_grid.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

namespace detail {

// Calls visit(a, b, c) for the corners of all triangles, snapped in a grid.
template <class Varyings, class Visit>
void for_each_snapped(const bin<record<Varyings>>& triangles, const grid& g, const Visit& visit) {
    const core::snap_transform snap = core::make_snap_transform(g);
    triangles.for_each_block([&](std::span<const record<Varyings>> block) {
        for (const record<Varyings>& r : block) {
            const auto at = [&](int k) {
                const glm::vec3& p = r.positions[k];
                return core::snap(snap, p.x, p.y, p.z);
            };
            visit(at(0), at(1), at(2));
        }
    });
}

} // namespace detail

// The repair of one body. Members throw std::bad_alloc, and std::system_error of files.
class solid_repairs {
public:
    // g: that all slabs together are, a crop or not; for exterior layers of a grid, see exterior(). budget: bytes for
    // the search, about; folder: for temporary files.
    solid_repairs(const grid& g, repair kind, std::uint64_t budget, std::string folder, unsigned threads)
        : grid_(g), kind_(kind), budget_(budget), folder_(std::move(folder)), threads_(threads) {
        if (core::has_cones(kind)) holes_.emplace(0, budget, folder_);
        if (kind == repair::vote) columns_.emplace(g);
    }

    // True if all triangles are to be added.
    [[nodiscard]] bool needs_triangles() const { return holes_.has_value() || columns_.has_value(); }
    // True if the cover of all slabs is to be added.
    [[nodiscard]] bool needs_walls() const { return kind_ == repair::exterior; }
    // True if slabs have to follow each other along z, from low to high.
    [[nodiscard]] bool is_along_z() const { return kind_ == repair::vote || kind_ == repair::exterior; }
    // Bytes that a slab's call and its bits take for a voxel, about.
    [[nodiscard]] double voxel_bytes() const { return is_along_z() ? 1 : 0; }

    // A triangle, snapped in the grid, corners as they are drawn; each of the mesh once, wherever it lies.
    void add(const core::snapped_position& a, const core::snapped_position& b, const core::snapped_position& c) {
        if (holes_) holes_->add(a, b, c);
        if (columns_) columns_->add(a, b, c);
    }
    // All triangles have come. how: of the slabs' calls. Fails if the holes have too many vertices.
    [[nodiscard]] status begin(const solid_options& how) {
        if (holes_) {
            try {
                take(holes_->finish(how.max_hole_edges), grid_);
            } catch (const std::length_error&) {
                return core::failure(status_code::too_many_triangles, stage::coarse_raster);
            }
        }
        if (needs_walls())
            exterior_.emplace(grid_.whole_extent(), how.closing, budget_, folder_, threads_,
                              layer_range{grid_.offset.z, grid_.offset.z + grid_.extent.z});
        return {};
    }
    // The conservative cover of a slab; see slab_exterior.
    void add_walls(const brick_table& cover) { exterior_->add_walls(cover); }
    // All walls are there.
    void flood() { exterior_->flood(); }

    // The next slab of a vote, with all triangles that reach it. One that begins where the last one did takes its
    // place, unless leave() came in between.
    template <class Varyings>
    void enter(const grid& slab, const bin<record<Varyings>>& triangles) {
        if (!columns_) return;
        const int first = slab.offset.z - grid_.offset.z;
        columns_->begin({first, first + slab.extent.z});
        detail::for_each_snapped(triangles, grid_,
                                 [&](const auto& a, const auto& b, const auto& c) { columns_->pass(a, b, c); });
    }
    // The slab has been drawn.
    void leave() {
        if (columns_) columns_->end();
    }
    // The options of a slab's call, valid until those of the next one are asked for, or leave().
    [[nodiscard]] solid_options of(const grid& slab, solid_options how) {
        if (core::has_cones(kind_)) how.cones = &cones_;
        if (!is_along_z()) return how;
        if (columns_) bits_ = columns_->bits();
        if (exterior_) {
            inside_.reset();
            inside_ = exterior_->inside(slab.offset, slab.extent);
            bits_.inside = inside_->data();
        }
        how.slab = &bits_;
        how.bodies = bodies::call;
        return how;
    }
    // True if voxels of a slab may be inside although no triangle reaches it. Its call needs one that is dropped then.
    [[nodiscard]] bool fills_without_triangles() const { return needs_walls() || !cones_.triangles.empty(); }

    // Counts of the holes, which are those of the whole mesh for every slab.
    void count(solid_counters& counts) const {
        counts.hole_edges = cones_.edges;
        counts.holes = cones_.holes;
        counts.cones = cones_.cones;
    }

    // ---- for several machines, each of which has some of the triangles ----

    // The search for holes; none once it has ended.
    [[nodiscard]] std::optional<hole_finder>& holes() { return holes_; }
    // The cones of the whole mesh, whose triangles were snapped in `where`: this grid, or one that it is a crop of.
    void take(core::hole_cones&& cones, const grid& where) {
        holes_.reset();
        const core::snap_transform snap = core::make_snap_transform(where);
        cones_ = core::moved(std::move(cones), {-snap.offset[0], -snap.offset[1], -snap.offset[2]});
    }
    // The columns of a vote; of this grid from its lowest layer on, until enter().
    [[nodiscard]] std::optional<column_sweep>& columns() { return columns_; }
    // The flood, from begin() on; with all layers of this grid's walls it still lacks those of other parts.
    [[nodiscard]] std::optional<slab_exterior>& exterior() { return exterior_; }

private:
    grid grid_;
    repair kind_;
    std::uint64_t budget_;
    std::string folder_;
    unsigned threads_;
    std::optional<hole_finder> holes_; // until they are found
    core::hole_cones cones_;           // in the whole grid
    std::optional<column_sweep> columns_;
    std::optional<slab_exterior> exterior_;
    std::optional<core::bit_grid> inside_; // of the slab that was asked for
    solid_slab bits_;
};

} // namespace voxelpipe::slabs
