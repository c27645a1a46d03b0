// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace tool_test {

// True in a build with sanitizers, which asks for less of what goes through the same code again.
[[nodiscard]] inline bool is_slow_build() {
    const char* const scale = std::getenv("VOXELPIPE_TEST_SCALE");
    return scale != nullptr && std::strtod(scale, nullptr) < 1;
}

} // namespace tool_test
