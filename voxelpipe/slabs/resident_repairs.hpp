// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Repairs of a solid whose slabs are known beforehand, drawn at once, and as often as wanted, like those of several
// GPUs: what each slab's call takes of the others stays in host memory. slabs/repairs.hpp is for slabs that are drawn
// one after the other, once. Plain C++; a backend snaps the vertices and draws the cover. Needs POSIX files.
//
//   close_holes   add() all triangles; for each call find(), of() each slab
//   vote          the same
//   exterior      for each call find(), with the cover of all slabs if it needs_walls(), of() each slab

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/exterior.hpp>
#include <voxelpipe/slabs/holes.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid/core/bit_grid.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace voxelpipe::slabs::detail {

// The repair of one body. Members throw std::bad_alloc, and std::system_error of files.
class resident_repairs {
public:
    // g: that all slabs together are, a crop or not. slabs: in order; along z, but for close_holes. budget: bytes for
    // the search, about; folder: for temporary files.
    resident_repairs(const grid& g, std::vector<grid> slabs, repair kind, std::uint64_t budget, std::string folder)
        : grid_(g), slabs_(std::move(slabs)), kind_(kind), budget_(budget), folder_(std::move(folder)),
          bits_(slabs_.size()) {}

    // True if all triangles are to be added.
    [[nodiscard]] static bool needs_triangles(repair kind) { return core::has_cones(kind) || kind == repair::vote; }
    // True if the slabs have to be along z.
    [[nodiscard]] static bool is_along_z(repair kind) { return kind == repair::vote || kind == repair::exterior; }
    // True if voxels of a slab may be inside although no triangle reaches it. Its call needs one that is dropped then.
    [[nodiscard]] static bool fills_without_triangles(repair kind) {
        return core::has_cones(kind) || kind == repair::exterior;
    }

    // All triangles of the mesh, wherever they lie, corners as they are drawn; their vertices are snapped in the grid,
    // and there. Once.
    void add(std::span<const core::snapped_position> vertices, const array_view<const glm::uvec3>& triangles) {
        if (core::has_cones(kind_)) find_edges(vertices, triangles);
        if (kind_ == repair::vote) find_columns(vertices, triangles);
    }

    // True if find() takes the cover of all slabs: not if the last one had the same `closing`.
    [[nodiscard]] bool needs_walls(const solid_options& how) const {
        return kind_ == repair::exterior && flooded_ != how.closing;
    }
    // Finds what of() gives for these options, which are valid for the grid. covers: the conservative cover of each
    // slab, see slab_exterior; none unless needs_walls(). Fails if the holes have too many vertices.
    [[nodiscard]] status find(const solid_options& how, std::span<const brick_table> covers) {
        if (core::has_cones(kind_) && closed_ != how.max_hole_edges) {
            closed_.reset();
            try {
                const core::snap_transform snap = core::make_snap_transform(grid_);
                cones_ = core::moved(hole_finder::close(edges_, how.max_hole_edges),
                                     {-snap.offset[0], -snap.offset[1], -snap.offset[2]});
            } catch (const std::length_error&) {
                return core::failure(status_code::too_many_triangles, stage::coarse_raster);
            }
            closed_ = how.max_hole_edges;
        }
        if (needs_walls(how)) {
            drop_inside();
            slab_exterior outside(grid_.extent, how.closing, budget_, folder_,
                                  std::max(1u, std::thread::hardware_concurrency()));
            for (const brick_table& cover : covers) outside.add_walls(cover);
            outside.flood();
            for (const grid& s : slabs_) inside_.push_back(outside.inside(s.offset - grid_.offset, s.extent));
            for (std::size_t s = 0; s < slabs_.size(); ++s) bits_[s].inside = inside_[s].data();
            flooded_ = how.closing;
        }
        return {};
    }
    // In place of find() with covers: what is inside slab s with this `closing` was found elsewhere. It is not owned,
    // and read until drop_inside().
    void take_inside(int closing, std::size_t s, const std::uint64_t* inside) {
        bits_[s].inside = inside;
        flooded_ = closing;
    }
    void drop_inside() {
        flooded_.reset();
        inside_.clear();
    }
    // The options of a slab's call, valid until the next find(). Several threads may ask.
    [[nodiscard]] solid_options of(std::size_t slab, solid_options how) const {
        if (core::has_cones(kind_)) how.cones = &cones_;
        if (is_along_z(kind_)) {
            how.slab = &bits_[slab];
            how.bodies = bodies::call; // one draw is one body
        }
        return how;
    }

    // Counts of the holes, which are those of the whole mesh for every slab.
    void count(solid_counters& counts) const {
        counts.hole_edges = cones_.edges;
        counts.holes = cones_.holes;
        counts.cones = cones_.cones;
    }

private:
    void find_edges(std::span<const core::snapped_position> vertices, const array_view<const glm::uvec3>& triangles) {
        const auto count = static_cast<std::uint32_t>(triangles.size());
        const std::vector<core::hole_part> body{{vertices.data(),
                                                 vertices.size(),
                                                 {triangles.data(), count, static_cast<std::uint32_t>(vertices.size())},
                                                 count}};
        for (const core::edge_chain::edge& e : core::open_edges(body))
            if (const auto found = hole_finder::edge_between(vertices[e.from], vertices[e.to]))
                edges_.push_back(*found);
        hole_finder::cancel(edges_);
    }
    void find_columns(std::span<const core::snapped_position> vertices, const array_view<const glm::uvec3>& triangles) {
        std::vector<layer_range> layers;
        for (const grid& s : slabs_) {
            const int first = s.offset.z - grid_.offset.z;
            layers.push_back({first, first + s.extent.z});
        }
        // Each thread has its share of the triangles, and bits of its own.
        const double room = static_cast<double>(budget_) / column_parities::bytes(grid_, slabs_.size());
        const auto most = static_cast<unsigned>(std::clamp(room, 1.0, 256.0));
        const unsigned threads = std::clamp(std::thread::hardware_concurrency(), 1u, most);
        std::vector<column_parities> found(threads, column_parities(grid_, layers));
        constexpr std::size_t share = 4096;
        core::parallel_for(threads, (triangles.size() + share - 1) / share, [&](unsigned thread, std::size_t block) {
            const std::size_t end = std::min(triangles.size(), (block + 1) * share);
            for (std::size_t i = block * share; i < end; ++i) {
                const glm::uvec3 t = triangles[i];
                found[thread].add(vertices[t.x], vertices[t.y], vertices[t.z]);
            }
        });
        for (unsigned t = 1; t < threads; ++t) found[0].join(found[t]);
        const std::size_t words =
            (static_cast<std::size_t>(grid_.extent.x) + 63) / 64 * static_cast<std::size_t>(grid_.extent.y);
        for (std::size_t s = 0; s < slabs_.size(); ++s) {
            const solid_slab bits = found[0].of(s);
            below_.emplace_back(bits.below, bits.below + words);
            if (s == 0) open_.assign(bits.open, bits.open + words);
        }
        for (std::size_t s = 0; s < slabs_.size(); ++s) bits_[s].below = below_[s].data(), bits_[s].open = open_.data();
    }

    grid grid_;
    std::vector<grid> slabs_;
    repair kind_;
    std::uint64_t budget_;
    std::string folder_;
    std::vector<hole_finder::edge> edges_;          // of the holes' boundaries
    core::hole_cones cones_;                        // in the whole grid
    std::optional<std::uint64_t> closed_;           // max_hole_edges of the cones
    std::vector<std::uint64_t> open_;               // a bit a column along z
    std::vector<std::vector<std::uint64_t>> below_; // by slab
    std::vector<core::bit_grid> inside_;            // by slab
    std::optional<int> flooded_;                    // `closing` of these
    std::vector<solid_slab> bits_;                  // by slab, for its call
};

} // namespace voxelpipe::slabs::detail
