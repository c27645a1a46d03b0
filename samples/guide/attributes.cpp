// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Vertex attributes, varyings and a texture: a square with texture coordinates and a normal at each vertex, moved by
// its vertex shader, painted by its fragment shader. Exits with 0 when the voxels have the colours of the texture.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <glm/vec2.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

// snippet: vertex shader
struct varyings { // an aggregate; float members and vectors are interpolated, vp::flat is taken from the first vertex
    glm::vec2 uv;
    glm::vec3 normal;
    vp::flat<std::uint32_t> material;
};

struct place {
    glm::mat4 matrix{1.0f};
    std::uint32_t material = 0;

    template <class Vertex>
    VOXELPIPE_HD auto operator()(const Vertex& v) const {
        const glm::vec2 uv = vp::get<0>(v); // the mesh's first attribute
        const glm::vec3 normal = vp::get<1>(v);
        return vp::vertex_output{vp::transform_point(matrix, v.position), varyings{uv, normal, {material}}};
    }
};
// end snippet

// snippet: texture
struct image { // in the backend's memory; not owned
    const std::uint8_t* texels = nullptr;
    int width = 0, height = 0;

    VOXELPIPE_HD std::uint8_t at(glm::vec2 uv) const {
        const int x = static_cast<int>(uv.x * static_cast<float>(width)),
                  y = static_cast<int>(uv.y * static_cast<float>(height));
        return texels[(y < height ? y : height - 1) * width + (x < width ? x : width - 1)];
    }
};

struct paint {
    image texture;
    VOXELPIPE_HD auto operator()(const vp::fragment<varyings>& f) const {
        const varyings on_triangle = f.clamped_varyings(); // f.varyings may lie outside [0, 1]
        const std::uint8_t texel = texture.at(on_triangle.uv);
        return vp::outputs(texel, f.varyings.material.value).discard_if(texel == 0);
    }
};
// end snippet

int main() {
    const std::vector<glm::vec3> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 2, 3}};
    // snippet: attributes
    const std::vector<glm::vec2> uvs{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const std::vector<glm::vec3> normals(4, glm::vec3(0, 0, 1));

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles, uvs, normals}; // any number of arrays, one element a vertex
    // end snippet

    const std::vector<std::uint8_t> texels{10, 20, 0, 40}; // 2 x 2; 0 is a hole
    const vp::cpu_backend::buffer<std::uint8_t> memory{backend, vp::array_view<const std::uint8_t>(texels)};
    const paint shader{{memory.data(), 2, 2}};

    const vp::grid grid{{0, 0, -0.5}, {1.0 / 32, 1.0 / 32, 1}, {32, 32, 1}};
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint8_t, vp::blend::max>,
                    vp::target<std::uint32_t, vp::blend::replace>>
        picture{backend, grid.extent};
    vp::voxelize(backend, mesh, grid, place{glm::mat4(1.0f), 7}, shader, picture).or_throw();

    const auto colour = vp::get<0>(picture).to_host_target(backend);
    const auto material = vp::get<1>(picture).to_host_target(backend);
    const bool good = colour(8, 8, 0) == 10 && colour(24, 8, 0) == 20 && colour(8, 24, 0) == 0 &&
                      colour(24, 24, 0) == 40 && material(8, 8, 0) == 7 && material(8, 24, 0) == 0;
    std::puts(good ? "every quarter has its texel" : "wrong colours");
    return good ? 0 : 1;
}
