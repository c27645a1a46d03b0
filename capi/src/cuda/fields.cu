// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "../field_calls.hpp"
#include "session.cuh"

#include <voxelpipe/cells/device/cells.cuh>
#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/device/distance_at.cuh>

namespace voxelpipe::capi {

std::unique_ptr<const field_calls> cuda_fields() {
    return std::make_unique<field_calls_on<cuda_session>>(cuda_session{});
}

} // namespace voxelpipe::capi
