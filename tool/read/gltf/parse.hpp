// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A checked document -> tinygltf's model, without any bytes.

#include "check.hpp"

#include <tiny_gltf.h>

namespace voxelize::gltf {

// Throws gltf_error.
[[nodiscard]] tinygltf::Model parse(const checked_document& document);

} // namespace voxelize::gltf
