// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Failures of stb_image, which does not say of every one that there was too little memory, nor gives every one a
// reason.

namespace voxelize::gltf {

// True once a block was refused to stb_image in this thread. For the caller to reset.
inline thread_local bool stb_ran_out_of_memory = false;

// Clears the reason that stbi_failure_reason() gives in this thread: stb_image keeps that of an earlier picture where
// it sets none.
void forget_stb_failure();

} // namespace voxelize::gltf
