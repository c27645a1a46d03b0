// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The colour of a body, which fills it: the mean of its triangles by their area in the mesh's own coordinates, in
// linear light and by alpha. It follows from the model alone, so it is the same in every grid. A triangle counts with
// the mean of its vertices' colours, and with its texture around its centre, over as many texels as its longest edge
// has. Sums are in the order of the triangles, so a stream gives the bits of a loaded model.

#include "model/scene.hpp"
#include "read/triangle_stream.hpp"
#include "surface.hpp"
#include "voxelizer.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace voxelize {

using body_color = std::array<std::uint8_t, 4>;

// Pictures and colours of materials on the host.
class material_colors {
public:
    // Refers to the lists. Makes the levels of pictures that have none.
    material_colors(const std::vector<material>& materials, const std::vector<texture>& textures,
                    const std::vector<picture>& images, const voxelize_request& request);

    // The sum over triangles of one material.
    class sum {
    public:
        sum(const material_colors& of, std::uint32_t material, bool has_texcoords);
        // Three corners each. texcoords, colors: three corners each, or empty.
        void add(std::span<const glm::vec3> corners, std::span<const glm::vec2> texcoords,
                 std::span<const glm::vec4> colors);
        // True if any two points of the triangles may differ in colour.
        [[nodiscard]] bool varies() const { return varies_; }
        // The colour of triangles without texture and vertex colours.
        [[nodiscard]] body_color plain() const;
        // Opaque; clay where nothing is seen.
        [[nodiscard]] body_color color() const;

    private:
        void add(const glm::vec3* corners, const glm::vec2* texcoords, const glm::vec4* colors);

        const material_colors& of_;
        const material& material_;
        sampled_texture texture_;
        alpha_mode alpha_;
        std::array<double, 4> sums_{}; // of linear colours by weight, and of the weights
        glm::vec4 first_color_{1.0F};  // of a vertex
        bool has_first_ = false, varies_ = false;
    };

private:
    const std::vector<material>& materials_;
    const voxelize_request& request_;
    std::vector<sampled_texture> textures_; // by material
    std::vector<std::vector<glm::u8vec4>> made_;
    color_tables tables_ = make_color_tables();
};

// The colour of each of these primitives, which have the materials, textures and pictures of a scene.
[[nodiscard]] std::vector<body_color> colors_of(std::span<const primitive> primitives, const scene& model,
                                                const voxelize_request& request);
// The colour of each primitive of a scene.
[[nodiscard]] std::vector<body_color> colors_of(const scene& model, const voxelize_request& request);

// The triangles of a primitive that are connected by the places of their vertices, as primitives of their own, in the
// order of their least vertices. Triangles without a finite corner are left out.
[[nodiscard]] std::vector<primitive> connected_parts(const primitive& whole);

// The colour of each part of a stream, once its textures are read. varies: whether two points of any part may differ.
struct stream_colors {
    std::vector<body_color> of_parts;
    bool varies = false;
};
[[nodiscard]] stream_colors colors_of(triangle_stream& model, const voxelize_request& request);

} // namespace voxelize
