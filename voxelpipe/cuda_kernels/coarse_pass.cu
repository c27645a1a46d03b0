// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// The coarse pass of the tiles.
#include <voxelpipe/device/tiles/tile_passes_kernels.cuh>
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe::device {

template tile_work coarse_pass<coverage::conservative>(const geometry&, const tile_memory&, pipeline_state*,
                                                       const capacities&, cudaStream_t, stage_clock*);
template tile_work coarse_pass<coverage::thin>(const geometry&, const tile_memory&, pipeline_state*, const capacities&,
                                               cudaStream_t, stage_clock*);

} // namespace voxelpipe::device
