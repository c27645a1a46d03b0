// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where the kernels are compiled that depend on no type of the program. A header x.cuh declares host functions that
// launch them; x_kernels.cuh defines these, with the kernels. By default every .cu compiles its own (device/kernels.cuh
// includes all x_kernels.cuh): the functions are templates, so that a program has the kernels that it calls, and no
// others. A program that links voxelpipe::cuda_kernels defines VOXELPIPE_LINKS_CUDA_KERNELS, as that target does for
// it: then the functions are ordinary ones of that library, and the program compiles none of their kernels.

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
#define VOXELPIPE_DECLARES_KERNELS
#define VOXELPIPE_DEFINES_KERNELS
#else
#define VOXELPIPE_DECLARES_KERNELS template <int = 0>
#define VOXELPIPE_DEFINES_KERNELS template <int>
#endif
