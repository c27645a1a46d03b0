// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "../backend_calls.hpp"

#include <cuda_runtime.h>

#include <string>

namespace voxelpipe::capi {

backend_calls cuda_calls(unsigned threads) {
    int count = 0;
    const cudaError_t error = cudaGetDeviceCount(&count);
    if (error != cudaSuccess || count == 0)
        throw failure{VP_ERROR_NO_BACKEND,
                      std::string("VP_BACKEND_CUDA: there is no device") +
                          (error == cudaSuccess ? "" : std::string(", ") + cudaGetErrorString(error))};
    return {cuda_surfaces(threads), cuda_solids(), cuda_fields()};
}

} // namespace voxelpipe::capi
