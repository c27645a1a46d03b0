// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bake.cuh"

namespace voxelpipe::python {

sparse_result<std::int64_t> bake_sparse(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                                        const device_values<std::int64_t>& values) {
    return bake_sparse_columns<std::int64_t, 1>(on, mesh, g, rule, values);
}

} // namespace voxelpipe::python
