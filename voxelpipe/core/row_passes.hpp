// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Passes over rows of a grid, for which a backend may have another way than a call a row.

#include <cstdint>

namespace voxelpipe::core::passes {

// Calls pass(i) for rows below a number. A backend's own way is an overload for it and the pass, found by its
// arguments.
template <class Backend, class Pass>
void for_each_row(const Backend& backend, std::uint64_t num_rows, const Pass& pass) {
    backend.for_each(num_rows, pass);
}

} // namespace voxelpipe::core::passes
