// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Finds the parts of a model that enclose something, so that their insides can be filled.

#include <glm/glm.hpp>

#include <vector>

namespace gi {

// For each triangle, true if the part that it belongs to is closed: in each direction of an edge of the part run as
// many triangles as in the other, and the part has a volume. Triangles whose corners stand at the same places are
// connected, whatever their indices. Indices are within `positions`.
[[nodiscard]] std::vector<bool> find_closed(const std::vector<glm::vec3>& positions,
                                            const std::vector<glm::uvec3>& triangles);

} // namespace gi
