// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of what the tool measures of cut cells: models of boxes, and runs in a grid of 16 voxels a side.
#include "tool_test.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace fraction_test {

namespace vp = voxelpipe;
using namespace tool_test;

struct shape {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
};

// The box from LOW to HIGH, its faces outward; its corners are moved along x by SHEAR times their y.
inline shape box(const glm::vec3& low, const glm::vec3& high, float shear = 0) {
    shape made;
    for (int corner = 0; corner < 8; ++corner) {
        glm::vec3 p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = (corner >> axis & 1) != 0 ? high[axis] : low[axis];
        p.x += shear * p.y;
        made.positions.push_back(p);
    }
    made.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return made;
}

// Returns the glTF primitive.
inline json& add(builder& file, const shape& s) {
    std::vector<float> positions;
    for (const glm::vec3& p : s.positions) positions.insert(positions.end(), {p.x, p.y, p.z});
    std::vector<std::uint8_t> indices;
    for (const glm::uvec3& t : s.triangles)
        for (int i = 0; i < 3; ++i) indices.push_back(static_cast<std::uint8_t>(t[i]));
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    return primitive;
}

inline vp::grid grid_of_16() {
    vp::grid grid;
    grid.origin = glm::dvec3(-4);
    grid.voxel_size = glm::dvec3(0.5);
    grid.extent = glm::ivec3(16);
    return grid;
}

// Runs `voxelize m.glb -o OUTPUT` with ARGUMENTS in that grid.
inline outcome draw(const scratch_folder& folder, const builder& file, const std::string& output,
                    const std::vector<std::string>& arguments) {
    file.write_glb(folder / "m.glb");
    std::vector<std::string> all{folder / "m.glb", "-o",      folder / output, "--origin", "-4,-4,-4", "-s", "0.5",
                                 "--extent",       "16,16,16"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run(folder, all);
}

inline const shape tilted = box({-2.1F, -1.3F, -1.7F}, {1.2F, 2.3F, 1.1F}, 0.37F);

} // namespace fraction_test
