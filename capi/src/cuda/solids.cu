// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "../solid_calls.hpp"
#include "session.cuh"

namespace voxelpipe::capi {

std::unique_ptr<const solid_calls> cuda_solids() {
    return std::make_unique<solid_calls_on<cuda_session>>(cuda_session{});
}

} // namespace voxelpipe::capi
