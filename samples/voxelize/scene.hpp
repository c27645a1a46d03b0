// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tool voxelizes: triangles in world space with the base colour of their materials, in plain vectors.
// Nothing here knows of the file format that it came from. Everything is valid as it stands: every index points into
// its list, every optional list is empty or has one entry a vertex.

#include <glm/glm.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace voxelize {

// How a texture coordinate outside [0, 1] finds its texel.
enum class wrap_mode : std::uint8_t { repeat, clamp_to_edge, mirrored_repeat };

// The nearest texel, or the bilinear mean of the four around the sample. There are no mip levels.
enum class filter_mode : std::uint8_t { nearest, linear };

// opaque ignores alpha, mask discards where alpha < cutoff, blend keeps every fragment (a voxel is there or not).
enum class alpha_mode : std::uint8_t { opaque, mask, blend };

// A decoded picture: RGBA, 8 bits a channel, the top row first. R, G and B hold sRGB-encoded values as the file has
// them (they become linear when they are sampled), A is linear.
struct picture {
    std::string name;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint8_t> rgba; // width * height * 4 bytes
};

// A picture and the way it is sampled. Coordinates: (0, 0) is the top left corner of the picture, (1, 1) the bottom
// right, so v runs downwards.
struct texture {
    std::uint32_t image = 0; // index into scene::images
    wrap_mode wrap_s = wrap_mode::repeat;
    wrap_mode wrap_t = wrap_mode::repeat;
    filter_mode filter = filter_mode::linear;
};

struct material {
    static constexpr std::int32_t no_texture = -1;

    std::string name;
    glm::vec4 base_color{1.0F};        // linear RGB and alpha, multiplies the texture and the vertex colour
    std::int32_t texture = no_texture; // index into scene::textures
    alpha_mode alpha = alpha_mode::opaque;
    float alpha_cutoff = 0.5F;
    // As the file says; nothing here asks for it. A voxelization has no viewer: both sides of every face count,
    // double-sided or not. Normals are the front's, the side from which the corners run counter-clockwise.
    bool double_sided = false;
};

// One list of triangles with one material. A mesh that several nodes show gives one primitive for each of them.
struct primitive {
    std::string name;                  // the mesh's name, or where it stands in the file; for messages
    std::vector<glm::vec3> positions;  // world space, the file's units and axes
    std::vector<glm::uvec3> triangles; // indices into positions, counter-clockwise seen from the front
    std::vector<glm::vec2> texcoords;  // of the base-colour texture, its transform applied; empty: no texture
    std::vector<glm::vec4> colors;     // linear vertex colours and alpha; empty: white
    std::uint32_t material = 0;        // index into scene::materials
};

struct scene {
    std::vector<primitive> primitives;
    std::vector<material> materials; // the file's, in its order; then, where one is needed, the default material
    std::vector<texture> textures;
    std::vector<picture> images;
    std::vector<std::string> warnings; // what was left out or put right; one line each

    [[nodiscard]] std::uint64_t vertex_count() const {
        std::uint64_t count = 0;
        for (const primitive& part : primitives) count += part.positions.size();
        return count;
    }
    [[nodiscard]] std::uint64_t triangle_count() const {
        std::uint64_t count = 0;
        for (const primitive& part : primitives) count += part.triangles.size();
        return count;
    }
};

} // namespace voxelize
