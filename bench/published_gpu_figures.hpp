// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Figures of other GPU voxelizers, to stand beside ours. Measured once on one NVIDIA H200 (CUDA 13.0, sm_90,
// 2026-11-21): milliseconds, median of 20 runs after 3 warm-ups, events around the whole call, mesh on the device.
// They are quoted, not measured by this program, and hold for the five scenes by these names only.
//
// - 2011: the original VoxelPipe source brought to CUDA 13 (the faster of two tunings), grid fitted to the mesh, plus
//   the clear of the framebuffer, which the original leaves out. Its A-buffer is thin only and holds no payload.
// - peer: the fastest public one of its cell: Forceflow/cuda_voxelizer (surface kernel and clear, 2026-06), Kaolin
//   mesh_to_spc (2026-08), o-voxel-gpu (2026-06). Conservative bits only.
// - floor: the bytes that must move: each triangle read once and the grid written once, or 8 bytes a fragment.
// - target: the fastest anchor / 3 (float: the part without the clear / 3, plus the clear).
// - paper: HPG 2011, NVIDIA GTX 480 (177 GB/s): context, never an anchor.
// blade and asiandragon are split decimations, hairball a procedural stand-in, as in the scene files.

#include <array>
#include <string_view>

namespace bench {

struct published_gpu_scene {
    std::string_view scene;
    int resolution;
    // bit conservative, bit thin, float add conservative with its clear, A-buffer thin
    double original_bit, original_bit_thin, original_float, original_abuffer;
    double peer_bit;
    std::string_view peer;
    double floor_bit, floor_float, floor_abuffer;
    double target_bit, target_bit_thin, target_float, target_abuffer;
    double paper_one_thread_a_triangle, paper_bit, paper_float, paper_abuffer;
};

inline constexpr std::string_view original_name = "2011 VoxelPipe brought to CUDA 13";
inline constexpr std::string_view forceflow = "Forceflow/cuda_voxelizer 2026-06";
inline constexpr std::string_view ovoxel = "o-voxel-gpu 2026-06";

// clang-format off
inline constexpr std::array<published_gpu_scene, 15> published_gpu_scenes{{
    //                     2011 bit  thin  float  A-buffer   peer                floors                target bit thin float A-buffer  paper
    {"conference", 128,   0.292, 0.215, 0.364, 0.308,  1.292, forceflow,  0.011, 0.013, 0.008,  0.097, 0.072, 0.126, 0.103,    3.9,  3.3,   3.4,   3.8},
    {"conference", 512,   0.703, 0.316, 0.719, 1.544,  2.870, ovoxel,     0.015, 0.140, 0.010,  0.234, 0.105, 0.329, 0.515,   59.3,  4.3,   8.3,   5.3},
    {"conference", 1024,  1.222, 0.478, 2.255, 4.614,  4.376, ovoxel,     0.043, 0.943, 0.016,  0.407, 0.160, 1.376, 1.538,  237.6,  8.5,  24.0,  10.1},
    {"dragon", 128,       0.272, 0.242, 0.312, 0.307,  0.058, forceflow,  0.015, 0.017, 0.014,  0.019, 0.081, 0.108, 0.102,    3.5,  4.8,   5.0,   6.7},
    {"dragon", 512,       0.347, 0.267, 0.549, 0.497,  0.110, forceflow,  0.019, 0.144, 0.017,  0.037, 0.089, 0.272, 0.166,    4.8,  5.0,   7.5,   8.7},
    {"dragon", 1024,      0.499, 0.335, 1.591, 0.838,  0.375, forceflow,  0.047, 0.947, 0.022,  0.125, 0.112, 1.154, 0.279,   13.6,  5.9,  13.2,  11.6},
    {"blade", 128,        0.392, 0.311, 0.453, 0.481,  0.187, forceflow,  0.022, 0.024, 0.024,  0.062, 0.104, 0.155, 0.160,    3.6,  7.3,   7.9,  10.3},
    {"blade", 512,        0.433, 0.320, 0.671, 0.689,  0.169, forceflow,  0.026, 0.151, 0.028,  0.056, 0.107, 0.313, 0.230,    7.6,  6.9,  10.1,  11.6},
    {"blade", 1024,       0.556, 0.420, 1.650, 0.953,  0.300, forceflow,  0.054, 0.954, 0.034,  0.100, 0.140, 1.174, 0.318,   16.6,  8.4,  14.9,  12.7},
    {"hairball", 128,     0.690, 0.498, 0.796, 1.087,  0.169, forceflow,  0.024, 0.025, 0.039,  0.056, 0.166, 0.270, 0.362,   22.8, 12.8,  15.3,  23.8},
    {"hairball", 512,     1.111, 0.630, 1.863, 3.108,  0.756, forceflow,  0.027, 0.152, 0.076,  0.252, 0.210, 0.710, 1.036,   95.0, 18.3,  38.9,  50.0},
    {"hairball", 1024,    2.259, 1.085, 6.979, 7.329,  2.826, forceflow,  0.055, 0.955, 0.141,  0.753, 0.361, 2.950, 2.443,  266.8, 33.7, 192.8, 102.0},
    {"asiandragon", 128,  1.117, 0.936, 1.380, 1.552,  0.472, forceflow,  0.048, 0.049, 0.068,  0.157, 0.312, 0.464, 0.517,   11.4, 21.2,  26.0,  34.8},
    {"asiandragon", 512,  1.156, 0.932, 1.578, 2.048,  0.329, forceflow,  0.051, 0.176, 0.074,  0.110, 0.311, 0.615, 0.683,   16.7, 22.0,  29.4,  39.9},
    {"asiandragon", 1024, 1.325, 1.054, 2.552, 2.354,  0.389, forceflow,  0.079, 0.979, 0.082,  0.130, 0.351, 1.475, 0.785,   18.2, 23.6,  31.4,  43.0},
}};
// clang-format on

} // namespace bench
