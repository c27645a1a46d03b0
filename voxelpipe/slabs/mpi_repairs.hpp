// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::close_holes and repair::vote of a mesh whose triangles lie on the ranks of an MPI communicator: the edges and
// the columns that the ranks have found are joined. repair::exterior: slabs/mpi_exterior.hpp.

#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/holes.hpp>
#include <voxelpipe/slabs/mpi_ranks.hpp>
#include <voxelpipe/slabs/repairs.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

namespace voxelpipe::slabs::detail {

// The cones of the whole mesh, from the edges that are left on each rank; `finder` is empty afterwards. The cones are
// of no use if a rank has failed. Every rank calls it.
[[nodiscard]] inline core::hole_cones join_holes(const ranks& all, std::optional<hole_finder>& finder,
                                                 std::uint64_t max_hole_edges, shared_work& work) {
    using edge = hole_finder::edge;
    core::hole_cones cones;
    std::vector<edge> mine, edges;
    std::vector<int> counts, firsts;
    int size = 0;
    work([&] {
        mine = finder->take_edges();
        finder.reset();
        size = as_count(mine.size());
        counts.resize(all.size());
        firsts.resize(all.size());
    });
    if (!work.all_ok()) return cones;
    MPI_Allgather(&size, 1, MPI_INT, counts.data(), 1, MPI_INT, all.comm());
    work([&] {
        std::uint64_t sum = 0;
        for (std::size_t r = 0; r < all.size(); ++r) {
            firsts[r] = as_count(sum);
            sum += static_cast<std::uint64_t>(counts[r]);
        }
        edges.resize(static_cast<std::size_t>(as_count(sum)));
    });
    if (!work.all_ok()) return cones;
    MPI_Datatype type;
    MPI_Type_contiguous(static_cast<int>(sizeof(edge)), MPI_BYTE, &type);
    MPI_Type_commit(&type);
    MPI_Allgatherv(mine.data(), size, type, edges.data(), counts.data(), firsts.data(), type, all.comm());
    MPI_Type_free(&type);
    mine = {};
    work([&]() -> status {
        hole_finder::cancel(edges);
        try {
            cones = hole_finder::close(edges, max_hole_edges);
        } catch (const std::length_error&) {
            return core::failure(status_code::too_many_triangles, stage::coarse_raster);
        }
        return {};
    });
    return cones;
}

// `columns`: of all triangles that this rank has read, afterwards of all triangles of all ranks, less what crosses them
// in the slabs of the ranks below. received: the triangles that reach this rank's slab; g: the grid. The columns are of
// no use if a rank has failed. Every rank.
template <class Record>
void join_columns(const ranks& all, const grid& g, layer_range slab, const std::vector<bin<Record>>& received,
                  column_sweep& columns, shared_work& work) {
    std::optional<column_sweep> mine; // of the slab alone
    work([&] {
        mine.emplace(g);
        mine->begin(slab);
        for (const bin<Record>& from : received)
            for_each_snapped(from, g, [&](const auto& a, const auto& b, const auto& c) { mine->pass(a, b, c); });
        mine->end();
    });
    if (!work.all_ok()) return;
    const std::span<std::uint64_t> of_slab = mine->below(), below = columns.below();
    for (const std::span<std::uint64_t> words : {columns.open(), below})
        for_each_part(words, [&](std::uint64_t* first, int count) {
            MPI_Allreduce(MPI_IN_PLACE, first, count, MPI_UINT64_T, MPI_BXOR, all.comm());
        });
    for_each_part(of_slab, [&](std::uint64_t* first, int count) {
        MPI_Exscan(MPI_IN_PLACE, first, count, MPI_UINT64_T, MPI_BXOR, all.comm());
    });
    if (all.me() != 0) // where MPI leaves it undefined
        for (std::size_t i = 0; i < below.size(); ++i) below[i] ^= of_slab[i];
}

} // namespace voxelpipe::slabs::detail
