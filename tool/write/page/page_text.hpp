// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace voxelize {

// page.html, with the comments /*shape*/ and /*data*/ where the volume goes.
extern const std::string_view page_text;

} // namespace voxelize
