// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "surfaces.hpp"

#include <cpu_ref/backend.hpp>

template void golden::add_surfaces(golden::case_table<voxelpipe::cpu_backend>& cases);
