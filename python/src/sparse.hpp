// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Lists of values as Python gets them.

#include "values.hpp"

namespace voxelpipe::python {

// (values, voxels or None, counters).
template <class T>
[[nodiscard]] nb::tuple give(sparse_values<T>&& drawn, std::initializer_list<std::size_t> shape, bool with_voxels) {
    nb::dict counts = report(drawn.result);
    nb::object voxels = with_voxels ? to_numpy(std::move(drawn.coordinates), {drawn.num_voxels, 3}) : nb::none();
    return nb::make_tuple(to_numpy(std::move(drawn.values), shape), voxels, counts);
}

} // namespace voxelpipe::python
