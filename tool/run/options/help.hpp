// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The text of --help beside the options.

#include <cstddef>
#include <string>

namespace voxelize {

// Before the options: what the program does, and examples that work as they are printed if there is a model.glb.
extern const char* const help_introduction;

// After the options: targets, outputs, grid, solids, exit codes.
[[nodiscard]] std::string help_footer();

// TEXT in lines of at most WIDTH characters, broken at spaces.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width);

} // namespace voxelize
