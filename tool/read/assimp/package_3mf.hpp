// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// 3MF files whose parts lie in several files of the archive (the production extension: p:path, as Bambu Studio and
// OrcaSlicer write it), which assimp does not read. Runs where assimp does: in a process of its own.

#include "wire.hpp"

#include <cstddef>
#include <optional>
#include <span>

namespace voxelize::assimp {

// The model in the archive BYTES; nothing where all of it is in one file of the archive, or it is none: that is for
// assimp. Meshes, components, their transforms and the colours of base materials are read. Throws model_error.
[[nodiscard]] std::optional<model> read_package_3mf(std::span<const std::byte> bytes);

} // namespace voxelize::assimp
