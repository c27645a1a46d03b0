// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Takes the place of the CUDA toolkit's header where device code is compiled for the CPU (../README.md): the part of
// the runtime and of the device's intrinsics that VoxelPipe and its tests use. Streams are in order and done at once;
// memory comes filled with 0xcd; a captured stream keeps what it is given for a graph.

#include <emulation/block.hpp>
#include <emulation/intrinsics.hpp>
#include <emulation/runtime.hpp>
