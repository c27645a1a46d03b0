// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Version and the few macros of the library. Everything else is C++.
// VOXELPIPE_HD marks a function that runs on the host and, when nvcc compiles, on the device.

#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) < 202002L
#error "VoxelPipe needs C++20: compile with -std=c++20, which nvcc wants too (the CMake targets voxelpipe::* bring it)"
#include <voxelpipe/needs_cxx_20> // does not exist: ends the compilation here, before errors that do not say why
#endif

#include <cassert>

#define VOXELPIPE_VERSION_MAJOR 0
#define VOXELPIPE_VERSION_MINOR 1
#define VOXELPIPE_VERSION_PATCH 0

#if defined(__FAST_MATH__)
#error "VoxelPipe promises exact bits: compile without -ffast-math (nvcc's -use_fast_math is fine)"
#endif

#if defined(__CUDACC__)
// Included before any other header includes GLM: versions before 1.0.0 put __host__ __device__ on defaulted functions,
// for which nvcc warns 84 times a file.
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#include <glm/fwd.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#pragma nv_diagnostic pop
#if !defined(__CUDACC_RELAXED_CONSTEXPR__)
#if GLM_VERSION_MAJOR > 1 || (GLM_VERSION_MAJOR == 1 && (GLM_VERSION_MINOR > 0 || GLM_VERSION_PATCH > 1))
// These silently lose vector arithmetic on the device without this flag.
#error                                                                                                                 \
    "VoxelPipe with GLM 1.0.2 or later needs nvcc's --expt-relaxed-constexpr (the CMake target voxelpipe::cuda has it)"
#endif
#endif
#define VOXELPIPE_HD __host__ __device__
// VOXELPIPE_ANY_CALLABLE goes before a __host__ __device__ function template that calls its argument, which may run on
// one side only; VOXELPIPE_CALLS_ANY and _END go around a lambda that does.
#define VOXELPIPE_ANY_CALLABLE _Pragma("nv_exec_check_disable")
#define VOXELPIPE_CALLS_ANY _Pragma("nv_diagnostic push") _Pragma("nv_diag_suppress 20013, 20014, 20015")
#define VOXELPIPE_CALLS_ANY_END _Pragma("nv_diagnostic pop")
#else
#define VOXELPIPE_HD
#define VOXELPIPE_ANY_CALLABLE
#define VOXELPIPE_CALLS_ANY
#define VOXELPIPE_CALLS_ANY_END
#endif

// Inlining is forced only if the compiler optimises, and always in device code: with sanitizer checks in every copy, a
// file would take nearly three times as long to compile. Both macros may be defined beforehand, as the presets `fuzz`
// and `tsan` do.
#if !defined(VOXELPIPE_INLINE)
#if (defined(__GNUC__) || defined(__clang__)) && (defined(__OPTIMIZE__) || defined(__CUDA_ARCH__))
#define VOXELPIPE_INLINE inline __attribute__((always_inline))
#define VOXELPIPE_INLINE_LAMBDA __attribute__((always_inline)) // between a lambda's parameters and its body
#else
#define VOXELPIPE_INLINE inline
#define VOXELPIPE_INLINE_LAMBDA
#endif
#endif

// Keeps a function of device code out of line: integers of 128 bits, whose divisions would fill its callers with code
// that hardly any triangle runs.
#if defined(__CUDA_ARCH__)
#define VOXELPIPE_DEVICE_NOINLINE __attribute__((noinline))
#else
#define VOXELPIPE_DEVICE_NOINLINE
#endif

// An internal error, not the caller's. Compiled out with NDEBUG.
#if !defined(VOXELPIPE_ASSERT)
#define VOXELPIPE_ASSERT(condition) assert(condition)
#endif

// A precondition of an accessor that returns no status. Checked on the host only, because it would slow kernels of
// every debug build; compiled out with NDEBUG.
#if !defined(VOXELPIPE_EXPECTS)
#if defined(__CUDA_ARCH__)
#define VOXELPIPE_EXPECTS(condition) static_cast<void>(0)
#else
#define VOXELPIPE_EXPECTS(condition) assert(condition)
#endif
#endif

#if !defined(__SIZEOF_INT128__) && !defined(_M_X64) && !defined(_M_ARM64)
#error "VoxelPipe needs a 64-bit target"
#endif
