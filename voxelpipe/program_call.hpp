// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <voxelpipe/programs/program_call.hpp> // forwarding header, for one release
