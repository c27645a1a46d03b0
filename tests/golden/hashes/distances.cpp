// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "distances.hpp"

#include <cpu_ref/backend.hpp>

template void golden::add_distances(golden::case_table<voxelpipe::cpu_backend>& cases);
