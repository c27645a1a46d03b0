// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Solids: what --solid asks for, what it counts, and the values of the voxels inside, which no triangle touches.

#include "model/targets.hpp"
#include "model/volume.hpp"

#include <voxelpipe/status.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace voxelpipe {
struct solid_slab;
namespace core {
struct hole_cones;
}
} // namespace voxelpipe

namespace voxelize {

struct known_bodies; // body_fill.hpp
class body_map;

// The rule for what is inside; the first three are the library's fill rules for the model as one body.
enum class solid_rule : std::uint8_t {
    nonzero,
    even_odd,
    positive,
    each_draw, // even_odd of every draw by itself
    exterior,  // what a flood from outside does not reach; the extent is outer
};

// The voxels that are part of the solid.
enum class solid_extent : std::uint8_t {
    centre, // those whose centre is inside
    outer,  // these and those that a triangle touches
    inner,  // those whose centre is inside and that no triangle touches
};

// As the command line spells them.
[[nodiscard]] const char* to_string(solid_rule rule);
[[nodiscard]] const char* to_string(solid_extent extent);

// What the voxels inside get that no triangle touches: the option --fill.
enum class solid_fill : std::uint8_t {
    body,    // colour and material of the body that they lie in (body_fill.hpp)
    nearest, // those of the nearest triangle (nearest_fill.hpp)
    mean,    // the mean of the model's covered voxels, in linear light, by alpha; no material
    color,   // solid_request::fill_color; no material
};

// The colour of the voxels inside, of each target that is a colour.
using fill_means = std::array<std::array<std::uint8_t, 4>, target_count>;

struct solid_request {
    solid_rule rule = solid_rule::nonzero;
    solid_extent extent = solid_extent::outer;
    // The most edges of a hole that gets a lid; 0: no hole gets one. Not with exterior and vote.
    std::uint64_t close_holes = 0;
    bool vote = false;    // most of the parities along x, y and z, whatever the rule; the extent is outer
    bool winding = false; // by generalized winding numbers: lids on all holes, less their solid angles
    int closing = 0;      // exterior: gaps of about twice as many voxels are closed
    // close_holes of a part of the model: the lids of each body (voxelpipe::solid_options::cones), not owned.
    const voxelpipe::core::hole_cones* cones = nullptr;
    // exterior and vote of a slab along z: what the other slabs decide (voxelpipe::solid_options::slab), not owned.
    const voxelpipe::solid_slab* slab = nullptr;
    bool is_whole = false; // the whole model is drawn in the whole grid at once, so that it can be examined
    solid_fill fill = solid_fill::body;
    std::array<std::uint8_t, 3> fill_color{}; // sRGB, for solid_fill::color
    // For a slab, the means of the whole grid, not owned. Null: the slab is the whole grid.
    const fill_means* means = nullptr;
    // For a part of the model, the bodies that its draws belong to, not owned. Null: the bodies of what is drawn.
    const known_bodies* bodies = nullptr;

    // True if a repair decides what is inside, so that it may be no body's.
    [[nodiscard]] bool is_repaired() const { return vote || close_holes != 0 || rule == solid_rule::exterior; }
};

// As vp::solid_counters has them, of all slabs.
struct solid_counts {
    std::uint64_t rows = 0; // of voxels along x
    std::uint64_t open_rows = 0;
    std::uint64_t crossings = 0;
    std::uint64_t max_winding = 0;
    std::uint64_t hole_edges = 0, holes = 0, closed_holes = 0; // of the whole model, with close_holes
    std::uint64_t touched = 0; // voxels that a triangle touches, where the surface is drawn
    // An open model, or one that is flooded, has been examined (examine_solid of pipeline_solid.hpp).
    bool is_examined = false;
    voxelpipe::flood_counters flood{}; // what the flood of --solid exterior did, or would do
    bool lids_balance = false;         // lids on all holes have been tried, and leave no row open
};

// One line where open rows prove that what was filled is not closed: how many, and what has been tried and helps; empty
// where there are none, or the rule does without closed models.
[[nodiscard]] std::string open_warning(const solid_request& request, const solid_counts& counts);

// One line if a flood leaves nothing but the surface, whose number of voxels is `voxels`, or has taken voxels of the
// inside; otherwise empty.
[[nodiscard]] std::string flood_warning(const solid_request& request, const solid_counts& counts, std::uint64_t voxels);

// The mean of colours, in linear light, weighted by alpha, opaque; clay where none of them shows. Sums of integers, so
// that the order in which colours are added does not show.
class color_mean {
public:
    using rgba8 = std::array<std::uint8_t, 4>;
    using sums = std::array<std::uint64_t, 4>;
    color_mean();
    void add(sums& to, const rgba8& color) const {
        for (std::size_t a = 0; a < 3; ++a) to[a] += linear_[color[a]] * color[3];
        to[3] += color[3];
    }
    [[nodiscard]] rgba8 mean_of(const sums& s) const;

private:
    std::array<std::uint64_t, 256> linear_{};
};

// Gives every channel but those of bits and the count its values where the solid and the surface differ. Voxels of
// SOLID without a bit in SURFACE get the values of their body, where BODIES has one; otherwise the colour of the fill,
// opaque, or the target's empty value. Voxels with a bit in SURFACE alone are emptied. Both are bit channels of V,
// whose first voxel is OFFSET in the whole grid. BODIES may be null.
void fill_inside(volume& v, const channel& solid, const channel& surface, const solid_request& request,
                 const body_map* bodies, const std::array<int, 3>& offset, int threads);

// VISIT(number of a voxel) for the voxels of layers [begin, end) that are of SOLID and not of SURFACE, bit channels.
template <class Visit>
void for_each_voxel_in(const volume& v, std::int64_t begin, std::int64_t end, const channel& solid,
                       const channel& surface, const Visit& visit) {
    for (std::int64_t k = begin; k < end; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t w = 0; w < v.words_per_row(); ++w)
                for (std::uint32_t bits = v.word(solid, w, j, k) & ~v.word(surface, w, j, k); bits != 0;
                     bits &= bits - 1)
                    visit(static_cast<std::size_t>(v.index(32 * w + std::countr_zero(bits), j, k)));
}

// Copies the part at OFFSET of a grid of EXTENT, rows of packed bits, to the channel.
void copy_part(volume& v, channel& to, const std::vector<std::uint32_t>& bits, const std::array<int, 3>& extent,
               const std::array<int, 3>& offset);

// The channel "count" from the bits of one body: 1 inside.
void count_bits(volume& v, const channel& solid, int threads);

} // namespace voxelize
