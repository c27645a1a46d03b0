// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Memory of stb_image, which does not say of every failure that there was too little.

namespace voxelize::gltf {

// True once a block was refused to stb_image in this thread. For the caller to reset.
inline thread_local bool stb_ran_out_of_memory = false;

} // namespace voxelize::gltf
