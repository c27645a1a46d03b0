// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// True if a program of scenes_test.cpp has every scene and large grids, false if small grids only. It is a constant,
// because the list of tests is made before anything is initialized at run time.

namespace scenes {

extern const bool all_scenes;

} // namespace scenes
