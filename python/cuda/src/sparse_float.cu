// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bake.cuh"

namespace voxelpipe::python {

sparse_result<float> bake_sparse(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                                 const device_values<float>& values) {
    return bake_sparse_columns<float, 3>(on, mesh, g, rule, values);
}

} // namespace voxelpipe::python
