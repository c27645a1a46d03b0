// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

namespace cub {

enum BlockScanAlgorithm { BLOCK_SCAN_RAKING, BLOCK_SCAN_RAKING_MEMOIZE, BLOCK_SCAN_WARP_SCANS };

template <class T, int Threads, BlockScanAlgorithm = BLOCK_SCAN_RAKING>
class BlockScan {
public:
    struct TempStorage {
        T sums[Threads];
    };
    explicit BlockScan(TempStorage& storage) : storage_(storage) {}
    template <int Items>
    void ExclusiveSum(T (&in)[Items], T (&out)[Items]) {
        T sum{};
        for (const T& v : in) sum += v;
        storage_.sums[threadIdx.x] = sum;
        __syncthreads();
        T before{};
        for (unsigned i = 0; i < threadIdx.x; ++i) before += storage_.sums[i];
        for (int i = 0; i < Items; ++i) {
            const T here = in[i];
            out[i] = before;
            before += here;
        }
    }
    void ExclusiveSum(T in, T& out) {
        T one[1] = {in}, sums[1];
        ExclusiveSum(one, sums);
        out = sums[0];
    }

private:
    TempStorage& storage_;
};

} // namespace cub
