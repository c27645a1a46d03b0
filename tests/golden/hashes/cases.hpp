// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The table of the golden hashes. A case has a name and adds what a backend computes to a digest. The functions that
// fill the table are templates of the backend, so that every backend has the same cases with the same names and has to
// give the same hashes.

#include "../digest.hpp"
#include "meshes.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace golden {

namespace vp = voxelpipe;

template <class Backend>
struct hashed_case {
    std::string name;
    std::function<void(Backend&, digest&)> run;
};
template <class Backend>
using case_table = std::vector<hashed_case<Backend>>;

// Each in a file of its name.
template <class Backend>
void add_coverages(case_table<Backend>& cases);
template <class Backend>
void add_solids(case_table<Backend>& cases);
template <class Backend>
void add_cells(case_table<Backend>& cases);
template <class Backend>
void add_distances(case_table<Backend>& cases);
template <class Backend>
void add_surfaces(case_table<Backend>& cases);
template <class Backend>
void add_labels(case_table<Backend>& cases);
template <class Backend>
void add_targets(case_table<Backend>& cases);
template <class Backend>
void add_integer_targets(case_table<Backend>& cases);
template <class Backend>
void add_lists(case_table<Backend>& cases);
template <class Backend>
void add_sparse(case_table<Backend>& cases);
template <class Backend>
void add_programs(case_table<Backend>& cases);
template <class Backend>
void add_levels(case_table<Backend>& cases);
template <class Backend>
void add_slabs(case_table<Backend>& cases);

template <class Backend>
case_table<Backend> all_cases() {
    case_table<Backend> cases;
    add_coverages(cases);
    add_solids(cases);
    add_cells(cases);
    add_distances(cases);
    add_surfaces(cases);
    add_labels(cases);
    add_targets(cases);
    add_integer_targets(cases);
    add_lists(cases);
    add_sparse(cases);
    add_programs(cases);
    add_levels(cases);
    add_slabs(cases);
    return cases;
}

struct named_coverage {
    const char* name;
    vp::coverage rule;
};
inline constexpr std::array<named_coverage, 4> coverages{{{"conservative", vp::coverage::conservative},
                                                          {"thin", vp::coverage::thin},
                                                          {"crosshair", vp::coverage::crosshair},
                                                          {"diagonal", vp::coverage::diagonal}}};

// A grid of that extent around the meshes, with cubic voxels only where the extent is a cube's.
inline vp::grid grid_of(glm::ivec3 extent) {
    vp::grid g;
    g.extent = extent;
    g.origin = glm::dvec3(-8.25);
    for (int a = 0; a < 3; ++a) g.voxel_size[a] = 16.5 / extent[a];
    return g;
}
inline vp::grid odd_grid() { return grid_of({45, 33, 52}); }
inline vp::grid crop_of_odd_grid() { return odd_grid().crop({7, 3, 11}, {29, 25, 34}); }

template <class Backend>
vp::mesh<Backend> upload(Backend& backend, const mesh_data& m) {
    return vp::mesh<Backend>(backend, m.positions, m.triangles);
}

// What a call has counted. A call that fails throws.
inline void add_counts(digest& d, const vp::status& s) {
    s.or_throw();
    const vp::counters& c = s.counts;
    d.add(std::vector<std::uint64_t>{c.triangles_in, c.triangles_nonfinite, c.triangles_too_far, c.triangles_zero_area,
                                     c.triangles_outside, c.triangles_drawn, c.fragments, c.fragments_discarded,
                                     c.voxels});
}
inline void add_solid_counts(digest& d, const vp::status& s) {
    add_counts(d, s);
    const vp::solid_counters& c = s.solid;
    d.add(std::vector<std::uint64_t>{c.open_rows, c.crossings, c.max_winding, c.hole_edges, c.holes, c.cones});
}

template <class Payload>
void add_list(digest& d, const vp::host_abuffer<Payload>& lists) {
    d.add(lists.voxels);
    d.add(lists.offsets);
    d.add(lists.primitives);
    if constexpr (!std::is_void_v<Payload>) d.add(lists.payloads);
}

// A sum in the format in which its blend adds, component by component.
template <class Sum>
void add_sum(digest& d, const Sum& sum) {
    if constexpr (requires { sum.c; }) {
        for (const auto& part : sum.c) add_sum(d, part);
    } else if constexpr (requires { sum.limb; }) {
        for (const std::uint64_t limb : sum.limb) d.add(limb);
        d.add(static_cast<std::uint64_t>(std::int64_t{sum.top}));
        d.add(std::uint64_t{sum.marks});
    }
}

template <class... Targets>
void add_sparse_contents(digest& d, const vp::host_sparse<Targets...>& h) {
    d.add(h.keys);
    for (const vp::brick_mask& mask : h.masks) d.add(std::span<const std::uint64_t>(mask.words));
    d.add(h.offsets);
    for (const vp::brick_tile& tile : h.tiles) d.add(tile.bits);
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        d.add(vp::get<I>(h.values));
        for (const auto& sum : vp::get<I>(h.sums)) add_sum(d, sum);
    });
}

// A number of 32 bits that depends on every bit of its arguments.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t mixed(std::uint32_t a, std::uint32_t b) {
    std::uint64_t z = (std::uint64_t{a} << 32 | b) + 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return static_cast<std::uint32_t>(z >> 32);
}

} // namespace golden
