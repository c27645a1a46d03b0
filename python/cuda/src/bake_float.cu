// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bake.cuh"

namespace voxelpipe::python {

status bake(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
            const device_values<float>& values, float fill, float* out) {
    return bake_columns<float, 3>(on, mesh, g, rule, values, fill, out);
}

} // namespace voxelpipe::python
