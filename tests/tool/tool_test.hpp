// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Common to all tests of the voxelize program: the program, models for it, readers of its files.

#include "sanitized.hpp"
#include "tool_runner.hpp"
#include "tool_scenes.hpp"

#include <gtest/gtest.h>

namespace tool_test {

using gltf_test::builder;
using gltf_test::json;

} // namespace tool_test
