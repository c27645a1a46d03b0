// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The model that the tool voxelizes: triangles, lines and points with the base colour of their materials, in plain
// vectors, each mesh once, and the transforms of its instances. Nothing here knows of the file format that it came
// from. Everything is valid as it stands: every index points into its list, every optional list is empty or has one
// entry a vertex.

#include "affine.hpp"

#include <glm/glm.hpp>
#include <glm/gtc/type_precision.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace voxelize {

// The texel of a texture coordinate outside [0, 1].
enum class wrap_mode : std::uint8_t { repeat, clamp_to_edge, mirrored_repeat };

// The nearest texel, or the bilinear mean of the four around the sample.
enum class filter_mode : std::uint8_t { nearest, linear };

// opaque ignores alpha, mask discards where alpha < cutoff, blend keeps every fragment (a voxel is there or not).
enum class alpha_mode : std::uint8_t { opaque, mask, blend };

// A decoded picture: RGBA, 8 bits a channel, the top row first. R, G and B hold sRGB-encoded values as the file has
// them (they become linear when they are sampled), A is linear.
struct picture {
    std::string name;
    std::uint32_t width = 0; // texels, as in the file
    std::uint32_t height = 0;
    std::vector<std::uint8_t> rgba; // width * height * 4 bytes; empty if the levels below take its place
    // Mip levels from first_level on (mip_levels.hpp): [0] colours alone, [1] colours by their alpha. None where
    // no material needs them; shared by scenes that show the picture.
    int first_level = 0;
    std::array<std::shared_ptr<const std::vector<glm::u8vec4>>, 2> levels;
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
    // For programs that light the model: read with gltf_options::shading alone. All textures of a material are reached
    // by the same coordinates.
    glm::vec3 emission{0.0F};
    float roughness = 0.6F;
    float metallic = 0.0F;
    std::int32_t roughness_texture = no_texture; // G, linear, multiplies the roughness, B the metallic factor
    std::int32_t emission_texture = no_texture;  // multiplies the emission
    // As the file says; nothing here asks for it. A voxelization has no viewer: both sides of every face count,
    // double-sided or not. Normals are the front's, the side from which the corners run counter-clockwise.
    bool double_sided = false;
};

// One list of triangles, or one of lines, with one material, in the coordinates of its mesh. It is shown only where an
// instance says so.
struct primitive {
    std::string name;                  // the mesh's name, or where it stands in the file; for messages
    std::vector<glm::vec3> positions;  // the mesh's own coordinates, as the file has them
    std::vector<glm::uvec3> triangles; // indices into positions, counter-clockwise seen from the front
    std::vector<glm::uvec2> lines;     // indices into positions; a point is a line from a vertex to itself
    std::vector<glm::vec2> texcoords;  // of the base-colour texture, its transform applied; empty: no texture
    std::vector<glm::vec4> colors;     // linear vertex colours and alpha; empty: white
    std::uint32_t material = 0;        // index into scene::materials
    // For triangles that are some of a larger mesh's: their numbers in it, ascending, and the number of all.
    std::vector<std::uint32_t> numbers;
    std::uint64_t whole = 0;
};

// A primitive with one transform to the world. Nothing is copied for it. A transform that mirrors exchanges the last
// two corners of every triangle, so that fronts stay fronts.
struct instance {
    std::uint32_t primitive = 0; // index into scene::primitives
    affine to_world;             // to the file's units and axes; finite
};

struct scene {
    std::vector<primitive> primitives;
    // Drawn in this order, triangles before lines; later ones win where only one can.
    std::vector<instance> instances;
    std::vector<material> materials; // the file's, in its order; then, where one is needed, the default material
    std::vector<texture> textures;
    std::vector<picture> images;
    std::vector<std::string> warnings; // what was left out or put right; one line each

    // Sums over all instances: a primitive that is shown twice counts twice.
    [[nodiscard]] std::uint64_t vertex_count() const {
        std::uint64_t count = 0;
        for (const instance& shown : instances) count += primitives[shown.primitive].positions.size();
        return count;
    }
    [[nodiscard]] std::uint64_t triangle_count() const {
        std::uint64_t count = 0;
        for (const instance& shown : instances) count += primitives[shown.primitive].triangles.size();
        return count;
    }
    // Points count as lines.
    [[nodiscard]] std::uint64_t line_count() const {
        std::uint64_t count = 0;
        for (const instance& shown : instances) count += primitives[shown.primitive].lines.size();
        return count;
    }
};

// Calls that a loader makes while it loads, so that no more than one picture is held whole. Either may be empty.
struct load_hooks {
    // Called once, when all but the pictures is there. May change the scene.
    std::function<void(scene&)> geometry;
    // Called with each picture as it is decoded, and the numbers of the materials that may show it. May replace its
    // texels by levels.
    std::function<void(const scene&, picture&, const std::vector<std::uint32_t>& materials)> picture;
};

} // namespace voxelize
