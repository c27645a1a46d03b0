// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Decides where kernels that depend on no type of the program are compiled. A header x.cuh declares host functions that
// launch them; x_kernels.cuh defines both. By default every .cu compiles its own: device/call/kernels.cuh includes all
// x_kernels.cuh, and the functions are templates, so a program gets only the kernels that it calls. A program that
// links voxelpipe::cuda_kernels has VOXELPIPE_LINKS_CUDA_KERNELS defined by that target: the functions are then
// ordinary ones of the library, and the program compiles none of their kernels.

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
#define VOXELPIPE_DECLARES_KERNELS
#define VOXELPIPE_DEFINES_KERNELS
#else
#define VOXELPIPE_DECLARES_KERNELS template <int = 0>
#define VOXELPIPE_DEFINES_KERNELS template <int>
#endif
