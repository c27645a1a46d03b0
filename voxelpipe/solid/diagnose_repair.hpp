// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What repair::exterior does to a mesh with holes: the voxels that its flood took from the inside, the holes that it
// came in by, and the repairs that were tried and keep these voxels. voxelize_solid itself does none of this, because
// it costs several calls and copies to the host.

#include <voxelpipe/solid/core/bit_grid.hpp>
#include <voxelpipe/solid/core/hole_sizes.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace core {

// The walls' complement that a flood from around the grid reaches, as repair::exterior has it: walls grown by
// `closing`, and the flood grown back.
[[nodiscard]] inline bit_grid flood_around(const bit_grid& walls, int closing, unsigned threads) {
    const glm::ivec3 e = walls.extent();
    const int ring = closing + 1;
    bit_grid ringed(e + 2 * ring), reached(e);
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y)
            for (int x = 0; x < e.x; x += 32) ringed.set_bits(x + ring, y + ring, z + ring, walls.get_bits(x, y, z));
    dilate(ringed, closing, threads);
    ringed = flood(ringed);
    dilate(ringed, closing, threads);
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y)
            for (int x = 0; x < e.x; x += 32) {
                const std::uint32_t valid = e.x - x < 32 ? (1u << (e.x - x)) - 1 : ~0u;
                reached.set_bits(x, y, z, ringed.get_bits(x + ring, y + ring, z + ring) & valid);
            }
    return reached;
}

// a(i) = f(a(i), b(i)) for all words; the grids are of the same extent.
template <class F>
void combine(bit_grid& a, const bit_grid& b, const F& f) {
    const glm::ivec3 e = a.extent();
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y) std::transform(a.row(y, z), a.row(y, z) + a.words(), b.row(y, z), a.row(y, z), f);
}
inline void subtract(bit_grid& a, const bit_grid& b) {
    combine(a, b, [](std::uint64_t x, std::uint64_t y) { return x & ~y; });
}
inline void intersect(bit_grid& a, const bit_grid& b) {
    combine(a, b, [](std::uint64_t x, std::uint64_t y) { return x & y; });
}
[[nodiscard]] inline std::uint64_t count_bits(const bit_grid& g) {
    const std::uint64_t* const all = g.data();
    const std::size_t words =
        g.words() * static_cast<std::size_t>(g.extent().y) * static_cast<std::size_t>(g.extent().z);
    std::uint64_t n = 0;
    for (std::size_t i = 0; i < words; ++i) n += static_cast<std::uint64_t>(std::popcount(all[i]));
    return n;
}

// The calls of one diagnosis, and what they gave.
template <class Backend, class Draw, class Framebuffer>
class repair_diagnosis {
public:
    repair_diagnosis(Backend& backend, std::span<const Draw> draws, const grid& g, const solid_options& options,
                     Framebuffer& bits)
        : backend_(backend), draws_(draws), g_(g), asked_(options), bits_(bits) {}

    [[nodiscard]] status run() {
        bit_grid lost(g_.extent), taken_from(g_.extent);
        if (!draw_bits(flood_options(asked_.closing), taken_from)) return failed_;
        status result = last_;
        std::uint64_t touched = 0;
        if (!count_touched(touched)) return failed_;
        result.solid.flood.enclosed_voxels = count_bits(taken_from) - touched;
        solid_options rows;
        rows.repair = repair::vote;
        if (!draw_bits(rows, lost)) return failed_;
        bit_grid by_rows = lost;
        subtract(lost, taken_from);
        if (count_bits(lost) == 0) return result;

        // Lids on all holes: their voxels, and what they enclose.
        bit_grid with_lids(g_.extent), lids(g_.extent), enclosed(g_.extent);
        if (!draw_bits(closed_options(solid_extent::outer), with_lids)) return failed_;
        const bool closes = last_.solid.open_rows == 0;
        if (!draw_bits(closed_options(solid_extent::inner), enclosed)) return failed_;
        lids = with_lids;
        subtract(lids, enclosed); // with the mesh
        {
            // Mesh and lids are closed: what a flood around them takes of what they enclose, it takes from the grid's
            // faces on, and the flood of the whole mesh does not take it.
            bit_grid from_faces = flood_around(lids, asked_.closing, 1);
            intersect(from_faces, enclosed);
            intersect(from_faces, by_rows);
            result.solid.flood.face_voxels = count_bits(from_faces);
            if (touched == 0 && result.solid.flood.face_voxels != 0) {
                status refused = failure(status_code::crop_without_whole);
                refused.counts = result.counts;
                return refused;
            }
            subtract(by_rows, from_faces);
        }
        if (!take_cover(lids)) return failed_;

        // Next to a lid it and a flood that stops in the hole differ, by up to the closing in the mesh's own flood.
        dilate(lids, 1, 1);
        subtract(by_rows, lids);
        dilate(lids, std::max(0, asked_.closing - 1), 1);
        subtract(lost, lids);
        result.solid.flood.lost_voxels = count_bits(lost);
        if (result.solid.flood.lost_voxels == 0) {
            result.solid.flood.face_voxels = 0;
            return result;
        }
        measure_holes(taken_from, result.solid.flood);
        result.solid.flood.close_holes = closes && keeps(lost, with_lids) ? 1 : 0;
        intersect(by_rows, enclosed);
        if (!find_closing(by_rows, result.solid.flood)) return failed_;
        return result;
    }

private:
    [[nodiscard]] solid_options flood_options(int closing) const {
        solid_options o;
        o.repair = repair::exterior;
        o.closing = closing;
        return o;
    }
    [[nodiscard]] solid_options closed_options(solid_extent extent) const {
        solid_options o;
        o.repair = repair::close_holes;
        o.extent = extent;
        return o;
    }

    // Draws the solid, and copies its bits. False if the call fails.
    [[nodiscard]] bool draw_bits(const solid_options& options, bit_grid& to) {
        return draw_bits(options, asked_.bodies, to);
    }
    [[nodiscard]] bool draw_bits(solid_options options, bodies each, bit_grid& to) {
        options.bodies = each;
        options.count_voxels = false;
        last_ = voxelize_solid(backend_, draws_, g_, bits_, options);
        if (!last_.ok()) {
            failed_ = last_;
            return false;
        }
        const std::vector<std::uint32_t> words = voxelpipe::get<0>(bits_).to_host(backend_);
        const glm::ivec3 e = g_.extent;
        const auto in_row = static_cast<std::size_t>((e.x + 31) / 32);
        for (int z = 0; z < e.z; ++z)
            for (int y = 0; y < e.y; ++y) {
                const std::uint32_t* const from =
                    words.data() +
                    (static_cast<std::size_t>(z) * static_cast<std::size_t>(e.y) + static_cast<std::size_t>(y)) *
                        in_row;
                std::uint64_t* const row = to.row(y, z);
                for (std::size_t i = 0; i < to.words(); ++i)
                    row[i] = from[2 * i] | (2 * i + 1 < in_row ? std::uint64_t{from[2 * i + 1]} << 32 : 0);
            }
        return true;
    }
    // Voxels that triangles touch: outer without inner. One body has them all.
    [[nodiscard]] bool count_touched(std::uint64_t& touched) {
        solid_options o;
        o.extent = solid_extent::outer;
        const auto call = [&] {
            last_ = voxelize_solid(backend_, draws_, g_, bits_, o);
            if (!last_.ok()) failed_ = last_;
            return last_.ok();
        };
        if (!call()) return false;
        touched = last_.counts.voxels;
        o.extent = solid_extent::inner;
        if (!call()) return false;
        touched -= last_.counts.voxels;
        return true;
    }
    // Takes them from `from`. False if a call fails.
    [[nodiscard]] bool take_cover(bit_grid& from) {
        bit_grid outer(g_.extent), inner(g_.extent);
        solid_options o;
        o.extent = solid_extent::outer;
        if (!draw_bits(o, bodies::call, outer)) return false;
        o.extent = solid_extent::inner;
        if (!draw_bits(o, bodies::call, inner)) return false;
        subtract(outer, inner);
        subtract(from, outer);
        return true;
    }
    [[nodiscard]] static bool keeps(bit_grid inside, const bit_grid& by) {
        subtract(inside, by);
        return count_bits(inside) == 0;
    }
    void measure_holes(const bit_grid& kept, flood_counters& counts) {
        const snap_transform snap = make_snap_transform(g_);
        const std::vector<hole_cones> bodies = run_module(find_holes_tag{}, backend_, draws_, g_, asked_.bodies);
        for (const hole_cones& body : bodies)
            for_each_hole(body, snap.fraction, [&](const hole& h) {
                if (!h.is_entered(body, snap.fraction, kept)) return;
                ++counts.entered_holes;
                counts.hole_width = std::max(counts.hole_width, h.width);
            });
    }
    // The least closing from the holes' width on, or below it, that keeps the voxels. False if a call fails.
    [[nodiscard]] bool find_closing(const bit_grid& inside, flood_counters& counts) {
        constexpr int most = solid_options::max_closing, tries = 8;
        if (counts.entered_holes == 0 || count_bits(inside) == 0 || asked_.closing >= most) return true;
        bit_grid drawn(g_.extent);
        const auto shuts = [&](int closing, bool& is_shut) {
            if (!draw_bits(flood_options(closing), drawn)) return false;
            is_shut = keeps(inside, drawn);
            return true;
        };
        const int least = asked_.closing + 1;
        int closing = static_cast<int>(std::clamp<std::uint64_t>((counts.hole_width + 1) / 2, 1, most));
        closing = std::max(closing, least);
        bool is_shut = false;
        if (!shuts(closing, is_shut)) return false;
        const bool goes_down = is_shut;
        if (is_shut) counts.closing = closing;
        for (int i = 0; i < tries && is_shut == goes_down; ++i) {
            closing += goes_down ? -1 : 1;
            if (closing < least || closing > most) break;
            if (!shuts(closing, is_shut)) return false;
            if (is_shut) counts.closing = closing;
        }
        return true;
    }

    Backend& backend_;
    std::span<const Draw> draws_;
    grid g_;
    solid_options asked_;
    Framebuffer& bits_;
    status last_, failed_;
};

} // namespace core

// As the other diagnose_repair, with a framebuffer of the caller's, of the grid's extent, whose first target is of bits
// in linear layout and on; the fragment shaders give true for it. A program that draws such solids anyway compiles
// nothing new. The targets hold anything afterwards.
template <class Backend, class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status diagnose_repair(Backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                     const grid& g, const solid_options& options,
                                     framebuffer<Backend, Targets...>& bits) {
    using first = typename core::pack_element<0, Targets...>::type;
    static_assert(first::map::is_bit && std::is_same_v<typename first::layout_type, layout::linear>,
                  "voxelpipe: the first target of the framebuffer must be of bits, in linear layout");
    solid_options asked;
    asked.bodies = options.bodies;
    asked.repair = repair::exterior;
    asked.closing = options.closing;
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate(asked, g); !s.ok()) return s;
    const status s = core::validate_draws(draws);
    if (!s.ok() || s.counts.triangles_in == 0) return s;
    try {
        using draw_type = draw<Mesh, VertexShader, SolidShader>;
        return core::repair_diagnosis<Backend, draw_type, framebuffer<Backend, Targets...>>(backend, draws, g, asked,
                                                                                            bits)
            .run();
    } catch (const std::bad_alloc&) {
        return core::failure(status_code::out_of_memory);
    } catch (const std::length_error&) {
        return core::failure(status_code::size_overflow);
    } catch (const std::runtime_error&) { // of a device's memory
        return core::failure(status_code::device_error);
    }
}

// Examines what repair::exterior with options.closing and options.bodies makes of the draws, and draws nothing; all
// other options are ignored, and so are the draws' fragment shaders. Returns the status of that call of voxelize_solid,
// with status::solid.flood filled. If the flood took no voxel that the closed rows have inside, that is all there is to
// say, at the price of four calls. Otherwise lids are put on the holes, which are measured, and closings are tried, in
// up to fifteen calls. Every recommendation has been tried on this mesh and grid.
//
// Fails with status_code::crop_without_whole if no triangle touches a voxel of the grid and the grid lies in the mesh:
// then the flood's set is not the crop of the whole mesh's. Fails as voxelize_solid otherwise, and with
// out_of_memory. Takes a bit for each voxel in the backend's memory and some twenty in host memory. Waits. Both
// backends return the same.
template <class Backend, class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] status diagnose_repair(Backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                     const grid& g, const solid_options& options = {}) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate_draws(draws); !s.ok()) return s;
    try {
        using draw_type = draw<Mesh, VertexShader, constant_output<bool>>;
        std::vector<draw_type> plain;
        plain.reserve(draws.size());
        for (const auto& d : draws) plain.push_back({d.mesh, d.vertex_shader, constant(true)});
        framebuffer<Backend, target<bit, blend::bit_or>> bits(backend, g.extent);
        return diagnose_repair(backend, std::span<const draw_type>(plain), g, options, bits);
    } catch (const std::bad_alloc&) {
        return core::failure(status_code::out_of_memory);
    } catch (const std::length_error&) {
        return core::failure(status_code::size_overflow);
    } catch (const std::runtime_error&) { // of a device's memory
        return core::failure(status_code::device_error);
    }
}

// One mesh.
template <class Backend, class... Attributes, class VertexShader>
[[nodiscard]] status diagnose_repair(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                                     const VertexShader& vertex_shader, const solid_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, constant_output<bool>>;
    const draw_type d{mesh, vertex_shader, constant(true)};
    return diagnose_repair(backend, std::span<const draw_type>(&d, 1), g, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws>
[[nodiscard]] status diagnose_repair(Backend& backend, const Draws& draws, const grid& g,
                                     const solid_options& options = {}) {
    return diagnose_repair(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g,
                           options);
}

} // namespace voxelpipe
