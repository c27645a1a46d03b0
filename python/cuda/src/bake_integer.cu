// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bake.cuh"

namespace voxelpipe::python {

status bake(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
            const device_values<std::int64_t>& values, std::int64_t fill, std::int64_t* out) {
    return bake_columns<std::int64_t, 1>(on, mesh, g, rule, values, fill, out);
}

} // namespace voxelpipe::python
