// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The demo model: a lighthouse on a rock in the sea, with a keeper's house, trees, a jetty and a boat. About 22 m wide
// and as high, y up, standing around the origin; textured and coloured, some parts cut out by alpha.

#include "glb.hpp"

namespace demo_model {

[[nodiscard]] scene make_lighthouse();

} // namespace demo_model
