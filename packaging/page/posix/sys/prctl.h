// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Nothing ends this process but itself.
#define PR_SET_PDEATHSIG 1

#ifdef __cplusplus
extern "C"
#endif
    int
    prctl(int option, ...);
