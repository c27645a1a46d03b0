// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "labels.hpp"

#include <cpu_ref/backend.hpp>

template void golden::add_labels(golden::case_table<voxelpipe::cpu_backend>& cases);
