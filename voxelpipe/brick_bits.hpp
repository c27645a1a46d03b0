// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <voxelpipe/levels/brick_bits.hpp> // forwarding header, for one release
