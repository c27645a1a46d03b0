// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Targets of packed formats: colours in four bytes a voxel, their mean packed once. Exits with 0 when each is the
// nearest to the mean of the same floats.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <vector>

namespace vp = voxelpipe;

namespace {

// Fractions are moved into the range before they are added up.
struct one_mean {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(glm::clamp(f.barycentric.x, 0.0f, 1.0f));
    }
};

// The target of the guide, and the mean of one component in floats.
int run() {
    vp::cpu_backend backend;
    const std::vector<glm::vec3> positions{{0, 0, 0}, {6, 0, 1}, {0, 6, 2}, {6, 6, 0}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}, {1, 3, 2}, {0, 3, 2}};
    const vp::mesh mesh{backend, positions, triangles};
    const vp::grid grid{{0, 0, 0}, {1, 1, 1}, {6, 6, 2}};

    // snippet: packed
    using colors = vp::target<vp::unorm8x4, vp::blend::mean>; // four bytes a voxel
    vp::framebuffer<vp::cpu_backend, colors> grid_of_colors{backend, grid.extent};
    const auto shader = [](const vp::fragment<>& f) {
        return vp::outputs(glm::vec4(f.barycentric, 1.0f)); // or vp::unorm8x4 of it: then each fragment is rounded
    };
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, shader, grid_of_colors).or_throw();
    const auto host = vp::get<0>(grid_of_colors).to_host_target(backend);
    const glm::vec4 color = host(1, 1, 1).unpack(); // 0 to 1, each code the nearest float
    // end snippet

    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::mean>> floats{backend, grid.extent};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, one_mean{}, floats).or_throw();
    const auto means = vp::get<0>(floats).to_host_target(backend);
    int wrong = 0, drawn = 0;
    for (int z = 0; z < grid.extent.z; ++z)
        for (int y = 0; y < grid.extent.y; ++y)
            for (int x = 0; x < grid.extent.x; ++x) {
                if (host(x, y, z).code(3) == 0) continue; // empty
                ++drawn;
                const float code = static_cast<float>(host(x, y, z).code(0));
                if (!(std::abs(code - 255.0f * means(x, y, z)) <= 0.501f)) ++wrong;
            }
    std::printf("%d voxels, %d of them off; colour %.3f %.3f %.3f\n", drawn, wrong, static_cast<double>(color.x),
                static_cast<double>(color.y), static_cast<double>(color.z));
    return drawn != 0 && wrong == 0 ? 0 : 1;
}

} // namespace

int main() {
    try {
        return run();
    } catch (const std::exception& e) {
        std::fprintf(stderr, "packed_formats: %s\n", e.what());
        return 1;
    }
}
