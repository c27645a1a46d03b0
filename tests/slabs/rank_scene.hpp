// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of slabs over MPI ranks.

#include "slab_scene.hpp"

#include <voxelpipe/slabs/mpi.hpp>

#include <cstdint>

namespace slab_scene {

inline int my_rank() {
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}
inline int num_ranks() {
    int n = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &n);
    return n;
}
inline std::uint64_t sum_of_ranks(std::uint64_t n) {
    MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    return n;
}
// The triangles that this rank would read.
inline vp::mesh_view<> share_of(const unit::small_mesh& mesh) {
    const auto [first, last] = slabs::share_of(mesh.triangles.size(), my_rank(), num_ranks());
    return {mesh.positions, vp::array_view<const glm::uvec3>(mesh.triangles.data() + first, last - first)};
}

} // namespace slab_scene
