// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Packed formats as the value types of targets: vectors in one word of 16, 32 or 64 bits, and bfloat16. A fragment
// shader packs its value, vp::outputs(vp::unorm8x4(color)), or gives the floats themselves to a target of blend::mean.
//
//   unorm8x4, unorm10_10_10_2, snorm8x2, snorm8x4, snorm16x2, snorm16x4   formats/normalized.hpp
//   float11_11_10, rgb9e5                                                  formats/packed_floats.hpp
//   bfloat16                                                               core/bfloat16.hpp
//
// Every conversion rounds the exact value once, to nearest, ties to even.

#include <voxelpipe/core/bfloat16.hpp>
#include <voxelpipe/formats/normalized.hpp>
#include <voxelpipe/formats/packed_blend.hpp>
#include <voxelpipe/formats/packed_floats.hpp>
