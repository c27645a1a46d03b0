// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// main of the GPU tests: prints the device, and exits with 77, "not run", if there is none.

#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    int count = 0;
    if (!testing::GTEST_FLAG(list_tests)) {
        const cudaError_t error = cudaGetDeviceCount(&count);
        if (error != cudaSuccess || count == 0) {
            std::printf("not run: no CUDA device (%s)\n", cudaGetErrorString(error));
            return 77;
        }
        cudaDeviceProp device{};
        int driver = 0, runtime = 0;
        cudaGetDeviceProperties(&device, 0);
        cudaDriverGetVersion(&driver);
        cudaRuntimeGetVersion(&runtime);
        std::printf("device: %s, driver for CUDA %d.%d, CUDA runtime %d.%d\n", device.name, driver / 1000,
                    driver % 1000 / 10, runtime / 1000, runtime % 1000 / 10);
    }
    return RUN_ALL_TESTS();
}
