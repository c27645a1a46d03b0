// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a program of scenes_test.cpp has: every scene and large grids, or small grids only. Known before anything is
// initialized at run time, as the list of tests is.

namespace scenes {

extern const bool all_scenes;

} // namespace scenes
