// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rasters of a sparse call whose shader is constant: the one that marks cells in the index, at the size of cells
// where that is exact, the one that sets bits of masks, and the one that counts fragments by rank.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/raster/raster_draws.cuh>
#include <voxelpipe/device/sparse/brick_sinks.cuh>
#include <voxelpipe/device/sparse/mask_pass.cuh>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe::device {

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
    // pass, or so many bricks that their work items are worth it.
    template <coverage Rule>
    [[nodiscard]] bool reads_setups() const {
        if (Rule != coverage::conservative) return true;
        const glm::ivec3 whole = g_.whole_extent();
        bool reads = std::max({whole.x, whole.y, whole.z}) > tuning::max_extent_without_setups ||
                     g_.offset % core::sparse_brick_size != glm::ivec3(0);
        for (int l = 0; l < index_size_of(whole).levels; ++l)
            reads = reads || !is_coarse<Rule>(brick_index<>::log2_cell_of(l));
        return reads;
    }

    // True if bricks or nodes of 2^log2_cell voxels a side have a raster of their own: conservative coverage of larger
    // voxels, with more fraction bits.
    template <coverage Rule>
    [[nodiscard]] bool is_coarse(int log2_cell) const {
        const int cell = 1 << log2_cell;
        return Rule == coverage::conservative && g_.offset % cell == glm::ivec3(0) &&
               snap_.fraction + log2_cell < core::small_edge_bits;
    }
    // Marks the cells that triangles may touch. Other cells than those that are coarse, and thin fragments, which may
    // lie beyond their triangle, are marked voxel by voxel.
    template <coverage Rule>
    void mark(const index_level& level, int log2_cell, bool coarse) {
        check(cudaMemsetAsync(coarse_state_, 0, sizeof(pipeline_state), stream_));
        const int cell = 1 << log2_cell;
        const int fraction = snap_.fraction + (coarse ? log2_cell : 0);
        const glm::ivec3 extent = coarse ? (g_.extent + (cell - 1)) / cell : g_.extent;
        raster<Rule>(fraction, extent, coarse_state_, stage::coarse_raster, [&](const output_base& base) {
            marking_output out{base, level, coarse ? 0 : log2_cell};
            out.lead = coarse ? g_.offset / cell : g_.offset;
            return out;
        });
        end_stage(clock_, &stage_times::coarse_raster);
    }
    // Sets the bits of all fragments, and counts triangles and fragments in *state, which is zero before.
    template <coverage Rule>
    void set_masks(const index_level& bricks, brick_mask* masks, pipeline_state* state) {
        raster<Rule>(snap_.fraction, g_.extent, state, stage::fine_raster, [&](const output_base& base) {
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
        raster<Rule>(snap_.fraction, g_.extent, coarse_state_, stage::fine_raster, [&](const output_base& base) {
            counting_output out{base, bricks, masks, reinterpret_cast<const unsigned long long*>(offsets), counts};
            out.lead = g_.offset;
            return out;
        });
    }

private:
    // The raster into the output that output(base) makes.
    template <coverage Rule, class Output>
    void raster(int fraction, const glm::ivec3& extent, pipeline_state* state, stage where, const Output& output) {
        raster_each_draw<shades_in_raster>(
            draws_, snap_, positions_, state, clock_, stream_,
            [&](const draw_type& d, const auto& source, bool is_first) {
                using source_type = std::remove_cvref_t<decltype(source)>;
                const auto vertices =
                    static_cast<std::uint32_t>(shades_in_raster ? d.mesh.positions.size() : d.mesh.num_vertices());
                const auto triangles = static_cast<std::uint32_t>(d.mesh.num_triangles());
                const output_base base{glm::ivec3(0), vertices, state, d.mesh.has_checked_indices()};
                const auto out = output(base);
                const raster_call<Rule, source_type, std::remove_cvref_t<decltype(out)>> call{
                    {source, triangles, fraction, extent}, out, deferred_.with(state)};
                const bool starts = is_first && is_first_pass_;
                is_first_pass_ = false;
                if constexpr (Rule == coverage::conservative &&
                              std::is_same_v<std::remove_cvref_t<decltype(out)>, masking_output>)
                    if (g_.offset % core::sparse_brick_size == glm::ivec3(0)) {
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
