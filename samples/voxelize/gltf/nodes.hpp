// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The node hierarchy -> the meshes that the scene shows, each with its world transform.

#include "../affine.hpp"

#include <tiny_gltf.h>

#include <cstddef>
#include <string>
#include <vector>

namespace voxelize::gltf {

struct shown_mesh {
    std::size_t mesh = 0;
    affine to_world;
};

// Of the default scene, else of scene 0, else of every node without a parent; in document order of a depth-first walk.
// A file with meshes and neither scenes nor nodes, a library of parts, gives each mesh once.
// Throws gltf_error where the nodes are no forest (a cycle, two parents) or a transform is not affine.
[[nodiscard]] std::vector<shown_mesh> shown_meshes(const tinygltf::Model& model, std::vector<std::string>& warnings);

} // namespace voxelize::gltf
