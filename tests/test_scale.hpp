// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace tests {

// The environment variable VOXELPIPE_TEST_SCALE, which slow builds set below 1; 1 otherwise.
[[nodiscard]] inline double test_scale() {
    const char* const scale = std::getenv("VOXELPIPE_TEST_SCALE");
    return scale == nullptr ? 1.0 : std::strtod(scale, nullptr);
}

// True in a build with sanitizers, which asks for less of what goes through the same code again.
[[nodiscard]] inline bool is_slow_build() { return test_scale() < 1; }

} // namespace tests
