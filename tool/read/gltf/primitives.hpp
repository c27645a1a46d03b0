// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A glTF primitive -> triangles or lines with the attributes that the tool uses, once, and an instance for each node
// that shows it.

#include "accessor.hpp"
#include "materials.hpp"
#include "pose.hpp"

#include "model/affine.hpp"
#include "model/parallel.hpp"
#include "model/scene.hpp"

#include <tiny_gltf.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace voxelize::gltf {

// The number of triangles of MODE (a TINYGLTF_MODE_*) with COUNT indices; a rest too short for a triangle is dropped.
[[nodiscard]] std::uint64_t triangle_count(int mode, std::uint64_t count);

// The triangles themselves, indices given by INDICES or, where it is empty, counting up to COUNT. Strips and fans keep
// the winding of their first triangle; their degenerate triangles (two equal indices), which only stitch pieces
// together, are dropped.
[[nodiscard]] std::vector<glm::uvec3> unrolled(int mode, const std::vector<std::uint32_t>& indices,
                                               std::uint64_t count);

// The lines of MODE: POINTS, LINES, LINE_LOOP or LINE_STRIP. A last vertex of LINES without a partner is dropped; a
// loop or strip of one vertex has none.
[[nodiscard]] std::uint64_t line_count(int mode, std::uint64_t count);
[[nodiscard]] std::vector<glm::uvec2> unrolled_lines(int mode, const std::vector<std::uint32_t>& indices,
                                                     std::uint64_t count);

// The name of primitive PART of a mesh in messages: the mesh's name, or where it stands in the file.
[[nodiscard]] std::string name_of(const tinygltf::Model& model, std::size_t mesh, std::size_t part);

// Ends the warning about primitives with one or two corners more than their triangles take.
inline constexpr const char* with_rest = "primitive(s) have indices left over that make no triangle";

// Ends the warning about primitives whose material has a texture and that have no coordinates for it.
inline constexpr const char* without_texcoords =
    "primitive(s) without the texture coordinates of their base-colour texture are not textured";

// The material of primitives that name none.
[[nodiscard]] material default_material();

class primitive_reader {
public:
    primitive_reader(const tinygltf::Model& model, const accessor_reader& accessors, material_reader& materials,
                     const pose_reader& poses, budget& memory, scene& result, int threads)
        : model_{model}, accessors_{accessors},
          materials_{materials}, poses_{poses}, memory_{memory}, scene_{result}, threads_{thread_count(threads)} {}

    // Shows primitive PART of the mesh of SHOWN once more. The first call for it (where a node poses it: for it and the
    // node) appends it to the scene, or warns where it has no triangles and no lines.
    void show(const shown_mesh& shown, std::size_t part);

    // Appends the warnings that are counted over the whole file.
    void finish();

private:
    // A primitive that has been read: nothing if it has no triangles and no lines.
    struct read_part {
        std::optional<std::uint32_t> primitive;
        double unit = 1;                  // of its positions: those of normalised integers stay integers
        std::optional<glm::dvec3> origin; // of its positions in the world, where a skin has put them there
        bool mirrored = false;            // the skin exchanges front and back
    };
    [[nodiscard]] read_part read(const shown_mesh& shown, std::size_t part, bool posed);
    [[nodiscard]] read_part read_posed(primitive& result, const tinygltf::Primitive& source, const shown_mesh& shown,
                                       const std::string& where);
    [[nodiscard]] const tinygltf::Accessor* attribute(const tinygltf::Primitive& source, const std::string& name,
                                                      std::size_t vertices, const std::string& where) const;
    // Gives the unit.
    double read_positions(primitive& result, const tinygltf::Primitive& source, const std::string& where);
    // WORK(begin, end) for blocks of 0 .. COUNT, on all threads.
    template <class Work>
    void for_each_block(std::size_t count, const Work& work) const {
        constexpr std::size_t block = std::size_t{1} << 16;
        parallel_for((count + block - 1) / block, threads_,
                     [&](std::size_t b) { work(b * block, std::min(count, (b + 1) * block)); });
    }
    void read_triangles(primitive& result, const tinygltf::Primitive& source, std::size_t vertices,
                        const std::string& where) const;
    [[nodiscard]] std::vector<std::uint32_t> read_indices(const tinygltf::Primitive& source, std::size_t vertices,
                                                          const std::string& where) const;
    void read_texcoords(primitive& result, const tinygltf::Primitive& source, const std::string& where);
    void read_colors(primitive& result, const tinygltf::Primitive& source, const std::string& where) const;
    [[nodiscard]] std::uint32_t material_index(const tinygltf::Primitive& source);

    const tinygltf::Model& model_;
    const accessor_reader& accessors_;
    material_reader& materials_;
    const pose_reader& poses_;
    budget& memory_;
    scene& scene_;
    int threads_;
    // By mesh, part, and the node that poses it or -1.
    std::map<std::tuple<std::size_t, std::size_t, std::int32_t>, read_part> known_;
    std::map<std::string, std::uint64_t> counted_; // warning -> how often
};

} // namespace voxelize::gltf
