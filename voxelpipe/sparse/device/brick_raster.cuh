// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rasters of a sparse call whose shader is constant: the one that marks cells in the index, at the size of cells
// for conservative coverage, the one that sets bits of masks, and the one that counts fragments by rank.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/raster/raster_draws.cuh>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/sparse/device/brick_sinks.cuh>
#include <voxelpipe/sparse/device/mask_pass.cuh>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe::device {

// True if the cells of all levels of every grid's index fit the raster's edges.
[[nodiscard]] constexpr bool has_edge_bits() {
    for (int l = 0; l <= core::max_log2_extent; ++l) {
        const index_size size = index_size_of(glm::ivec3(1 << l));
        for (int level = 0; level < size.levels; ++level)
            if (core::fraction_bits(1 << l) + brick_index<>::log2_cell_of(level) >= core::small_edge_bits) return false;
    }
    return true;
}

template <class Draw>
class brick_raster;
template <class Mesh, class VertexShader, class FragmentShader>
class brick_raster<draw<Mesh, VertexShader, FragmentShader>> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    static constexpr bool shades_in_raster = is_cheap<VertexShader>;

public:
    // Takes its memory, all but the lists. With an arena that only adds up bytes, nothing but that is done.
    brick_raster(std::span<const draw_type> draws, const grid& g, cudaStream_t stream, stage_clock* clock,
                 arena& memory)
        : draws_(draws), g_(g), snap_(core::make_snap_transform(g)), stream_(stream), clock_(clock),
          coarse_state_(memory.take<pipeline_state>(1)) {
        std::size_t vertices = 0;
        for (const draw_type& d : draws) {
            triangles_ = std::max<std::size_t>(triangles_, d.mesh.num_triangles());
            vertices = std::max<std::size_t>(vertices, d.mesh.num_vertices());
        }
        positions_ = vertex_positions::take(memory, shades_in_raster ? 0 : vertices);
    }
    // Takes the lists of deferred triangles of the rasters that follow. has_setups: where those read them.
    void take_lists(arena& memory, bool has_setups) {
        deferred_ = has_setups ? deferred_triangles::take(memory, triangles_)
                               : deferred_triangles::take_lists(memory, triangles_);
    }
    // True if mark and set_masks may read setups of large triangles: where they draw voxel by voxel in the deferred
    // pass, or have enough bricks for their work items to pay.
    template <coverage Rule>
    [[nodiscard]] bool reads_setups() const {
        const glm::ivec3 whole = g_.whole_extent();
        return !has_coarse<Rule> || std::max({whole.x, whole.y, whole.z}) > tuning::max_extent_without_setups ||
               !begins_on_brick();
    }

    // True if bricks and nodes have a raster of their own: conservative coverage of larger voxels, with more fraction
    // bits.
    template <coverage Rule>
    static constexpr bool has_coarse = Rule == coverage::conservative;
    static_assert(has_edge_bits(), "the edges of coarse voxels must fit the raster");

    // Marks the cells of 2^log2_cell voxels a side that triangles may touch. coarse, which needs has_coarse: by a
    // raster of cells, of all in which the grid's part has a voxel. Those that the part's border cuts may be marked
    // because of what lies beyond it. Otherwise voxel by voxel, which thin fragments need: they may lie beyond their
    // triangle.
    template <coverage Rule>
    void mark(const index_level& level, int log2_cell, bool coarse) {
        check(cudaMemsetAsync(coarse_state_, 0, sizeof(pipeline_state), stream_));
        const int shift = coarse ? log2_cell : 0;
        const glm::ivec3 first = g_.offset >> shift, last = (g_.offset + g_.extent - 1) >> shift;
        grid cells = g_;
        cells.offset = first << shift;
        raster<Rule>({core::make_snap_transform(cells), shift, last - first + 1}, coarse_state_, stage::coarse_raster,
                     [&](const output_base& base) {
                         marking_output out{base, level, log2_cell - shift};
                         out.lead = first;
                         return out;
                     });
        end_stage(clock_, &stage_times::coarse_raster);
    }
    // Sets the bits of all fragments, and counts triangles and fragments in *state, which is zero before.
    template <coverage Rule>
    void set_masks(const index_level& bricks, brick_mask* masks, pipeline_state* state) {
        raster<Rule>({snap_, 0, g_.extent}, state, stage::fine_raster, [&](const output_base& base) {
            masking_output out{base, bricks, reinterpret_cast<unsigned long long*>(masks)};
            out.lead = g_.offset;
            return out;
        });
    }
    // Adds the fragments of each voxel to its count, by rank.
    template <coverage Rule>
    void count_fragments(const index_level& bricks, const brick_mask* masks, const std::uint64_t* offsets,
                         std::uint32_t* counts) {
        check(cudaMemsetAsync(coarse_state_, 0, sizeof(pipeline_state), stream_));
        raster<Rule>({snap_, 0, g_.extent}, coarse_state_, stage::fine_raster, [&](const output_base& base) {
            counting_output out{base, bricks, masks, reinterpret_cast<const unsigned long long*>(offsets), counts};
            out.lead = g_.offset;
            return out;
        });
    }

private:
    // Where a raster's voxels or cells are: of 2^log2_cell voxels a side, from the snapped positions' first voxel on.
    struct raster_space {
        core::snap_transform snap;
        int log2_cell;
        glm::ivec3 extent;
    };
    [[nodiscard]] bool begins_on_brick() const { return g_.offset % core::sparse_brick_size == glm::ivec3(0); }
    // The raster into the output that output(base) makes.
    template <coverage Rule, class Output>
    void raster(const raster_space& space, pipeline_state* state, stage where, const Output& output) {
        raster_each_draw<shades_in_raster>(
            draws_, space.snap, positions_, state, clock_, stream_,
            [&](const draw_type& d, const auto& source, bool is_first) {
                using source_type = std::remove_cvref_t<decltype(source)>;
                const auto vertices =
                    static_cast<std::uint32_t>(shades_in_raster ? d.mesh.positions.size() : d.mesh.num_vertices());
                const auto triangles = static_cast<std::uint32_t>(d.mesh.num_triangles());
                const output_base base{glm::ivec3(0), vertices, state, d.mesh.has_checked_indices()};
                const auto out = output(base);
                const raster_call<Rule, source_type, std::remove_cvref_t<decltype(out)>> call{
                    {source, triangles, space.snap.fraction + space.log2_cell, space.extent},
                    out,
                    deferred_.with(state)};
                const bool starts = is_first && is_first_pass_;
                is_first_pass_ = false;
                if constexpr (Rule == coverage::conservative &&
                              std::is_same_v<std::remove_cvref_t<decltype(out)>, masking_output>)
                    if (begins_on_brick()) {
                        launch_first_pass(call, state, where, stream_, starts);
                        launch_mask_pass(call, state, where, stream_);
                        return;
                    }
                launch_raster(call, state, where, stream_, starts);
            });
    }

    std::span<const draw_type> draws_;
    const grid& g_;
    core::snap_transform snap_;
    cudaStream_t stream_;
    stage_clock* clock_;
    pipeline_state* coarse_state_;
    vertex_positions positions_{};
    deferred_triangles deferred_{};
    std::size_t triangles_ = 0; // of the largest draw
    bool is_first_pass_ = true;
};

} // namespace voxelpipe::device
