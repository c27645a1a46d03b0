// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Calls on several GPUs: their time, and the memory that their pools keep.

#include "session.hpp"
#include "statistics.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bench::gpu {

[[nodiscard]] inline double now_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The median by the host's clock of a call that returns when all GPUs have ended.
template <class Call>
[[nodiscard]] double median_ms(const repetition& how, const Call& call) {
    for (int i = 0; i < how.warmups; ++i) call();
    std::vector<double> times;
    const double start = now_ms();
    while (static_cast<int>(times.size()) < how.runs &&
           (static_cast<int>(times.size()) < how.least_runs || now_ms() - start < 1000 * how.seconds)) {
        const double begin = now_ms();
        call();
        times.push_back(now_ms() - begin);
    }
    return summarize(times).median;
}

// Memory that is freed stays with each GPU's pool, as in a program that calls often.
inline void keep_memory(const std::vector<int>& ordinals) {
    for (const int ordinal : ordinals) {
        cudaMemPool_t pool = nullptr;
        std::uint64_t all = ~std::uint64_t{0};
        check(cudaDeviceGetDefaultMemPool(&pool, ordinal), "pool");
        check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &all), "pool");
    }
}

// Gives the pools' free memory back.
inline void trim_pools(const voxelpipe::slabs::devices& gpus) {
    gpus.for_each(gpus.size(), [&](std::size_t i, voxelpipe::cuda_backend& backend) {
        cudaMemPool_t pool = nullptr;
        check(cudaStreamSynchronize(backend.stream), "wait");
        check(cudaDeviceGetDefaultMemPool(&pool, gpus.ordinal(i)), "pool");
        check(cudaMemPoolTrimTo(pool, 0), "pool");
    });
}

} // namespace bench::gpu
