// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle mesh in plain vectors: what benchmarks and tests read or generate, and hand to the library.

#include <glm/vec3.hpp>

#include <string>
#include <vector>

namespace bench {

struct mesh_data {
    std::string name;
    std::string note; // where it comes from, for the tables
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
};

} // namespace bench
