// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// An animation at one moment -> the transforms and morph weights of the nodes that it moves.

#include "accessor.hpp"

#include <tiny_gltf.h>

#include <string>
#include <vector>

namespace voxelize::gltf {

// Sets translation, rotation, scale and weights of the nodes of MODEL as its first animation has them at SECONDS;
// before its first key and behind its last one those hold. STEP, LINEAR (rotations on the shorter arc) and CUBICSPLINE.
// ACCESSORS read from MODEL. Throws gltf_error where keys do not fit.
void apply_animation(tinygltf::Model& model, const accessor_reader& accessors, double seconds,
                     std::vector<std::string>& warnings);

} // namespace voxelize::gltf
