// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A picture of voxels for the samples: parallel rays from the front, the left and above, a face of a voxel lit by its
// direction. Writes a .ppm file.

#include <glm/glm.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

namespace picture {

// color(x, y, z) is a voxel's colour, 0 to 1; negative if it is empty. y points up.
template <class Color>
void write(const std::string& path, const glm::ivec3& extent, const Color& color) {
    constexpr int width = 640, height = 560;
    const glm::vec3 e(extent), center = 0.5f * e;
    const glm::vec3 along = glm::normalize(glm::vec3(-0.55f, -0.5f, -1.0f));
    const glm::vec3 right = glm::normalize(glm::cross(along, glm::vec3(0, 1, 0))), up = glm::cross(right, along);
    const float size = 0.62f * glm::length(e) / static_cast<float>(height);
    std::vector<char> pixels;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float sx = (static_cast<float>(x) - 0.5f * width) * size,
                        sy = (0.5f * height - static_cast<float>(y)) * size;
            const glm::vec3 start = center + sx * right + sy * up - glm::length(e) * along;
            // The part of the ray in the grid, then from face to face.
            const glm::vec3 t0 = (glm::vec3(0.0f) - start) / along, t1 = (e - start) / along;
            const glm::vec3 enter = glm::min(t0, t1), leave = glm::max(t0, t1);
            float t = std::max({enter.x, enter.y, enter.z});
            int axis = enter.x == t ? 0 : enter.y == t ? 1 : 2;
            glm::vec3 seen =
                glm::mix(glm::vec3(0.55f, 0.62f, 0.70f), glm::vec3(0.9f, 0.92f, 0.95f), static_cast<float>(y) / height);
            glm::ivec3 at = glm::clamp(glm::ivec3(glm::floor(start + (t + 1e-3f) * along)), glm::ivec3(0), extent - 1);
            if (t < std::min({leave.x, leave.y, leave.z}))
                while (at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < extent.x && at.y < extent.y && at.z < extent.z) {
                    const glm::vec3 c = color(at.x, at.y, at.z);
                    if (c.x >= 0.0f) {
                        seen = c * (axis == 1 ? 1.0f : axis == 2 ? 0.8f : 0.62f);
                        break;
                    }
                    glm::vec3 next;
                    for (int a = 0; a < 3; ++a)
                        next[a] = (static_cast<float>(along[a] > 0 ? at[a] + 1 : at[a]) - start[a]) / along[a];
                    axis = next.x <= next.y && next.x <= next.z ? 0 : next.y <= next.z ? 1 : 2;
                    at[axis] += along[axis] > 0 ? 1 : -1;
                }
            for (int c = 0; c < 3; ++c)
                pixels.push_back(static_cast<char>(std::lround(255.0f * std::clamp(seen[c], 0.0f, 1.0f))));
        }
    std::ofstream out(path, std::ios::binary);
    out << "P6\n" << width << ' ' << height << "\n255\n";
    out.write(pixels.data(), static_cast<std::streamsize>(pixels.size()));
}

} // namespace picture
