// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every test of the voxelize program uses: the program, models for it, readers of its files.

#include "tool_runner.hpp"
#include "tool_scenes.hpp"

#include <gtest/gtest.h>

namespace tool_test {

using gltf_test::builder;
using gltf_test::json;

} // namespace tool_test
