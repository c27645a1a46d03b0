// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The node hierarchy -> the meshes that the scene shows, each with its world transform.

#include "accessor.hpp"
#include "leniency.hpp"
#include "model/affine.hpp"

#include <tiny_gltf.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelize::gltf {

struct shown_mesh {
    std::size_t mesh = 0;
    affine to_world;
    std::int32_t node = -1; // that shows it; -1: the file has no nodes
    std::int32_t skin = -1; // index into the model's skins, which then decide in place of to_world
};

struct shown_scene {
    std::vector<shown_mesh> meshes;
    std::vector<affine> node_to_world; // every node of the file, in the scene or not
};

// The meshes that the default scene shows, else scene 0, else every node without a parent; in document order of a
// depth-first walk, the instances of EXT_mesh_gpu_instancing in theirs. Not shown: nodes that KHR_node_visibility
// hides, with all below them, and meshes scaled to nothing. A file with meshes and neither scenes nor nodes, a library
// of parts, gives each mesh once. Throws gltf_error where the nodes are no forest (a cycle, two parents) or a transform
// is not affine.
[[nodiscard]] shown_scene shown_meshes(const tinygltf::Model& model, const accessor_reader& accessors,
                                       leniency& tolerance);

} // namespace voxelize::gltf
