// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "all_scenes.hpp"

constexpr bool scenes::all_scenes = true;
