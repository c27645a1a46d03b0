// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "../surface_calls.hpp"
#include "session.cuh"

namespace voxelpipe::capi {

std::unique_ptr<const surface_calls> cuda_surfaces(unsigned threads) {
    return std::make_unique<surface_calls_on<cuda_session>>(cuda_session{}, threads);
}

} // namespace voxelpipe::capi
