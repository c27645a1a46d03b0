// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Runs work(0) .. work(count - 1), each once, on several threads that take the next number when they are free.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace voxelize {

// threads <= 0 takes one for each core.
[[nodiscard]] inline int thread_count(int threads) {
    return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Returns when all work is done; the calling thread works too, and alone calls done(finished) after each piece of its
// own. The first exception stops the taking of further numbers and is thrown here.
template <class Work, class Done>
void parallel_for(std::size_t count, int threads, Work work, Done done) {
    std::atomic<std::size_t> next{0};
    std::atomic<std::size_t> finished{0};
    std::exception_ptr failure;
    std::mutex failing;
    const auto run = [&](bool caller) {
        try {
            for (std::size_t n = next++; n < count; n = next++) {
                work(n);
                const std::size_t so_far = ++finished;
                if (caller) done(so_far);
            }
        } catch (...) {
            const std::lock_guard lock(failing);
            if (!failure) failure = std::current_exception();
            next = count;
        }
    };
    std::vector<std::jthread> helpers;
    const std::size_t wanted = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
    try {
        for (std::size_t n = 1; n < wanted; ++n) helpers.emplace_back(run, false);
    } catch (const std::system_error&) { // the machine gives no more threads: those that are there do the work
    } catch (const std::bad_alloc&) {
    }
    run(true);
    helpers.clear(); // joins
    if (failure) std::rethrow_exception(failure);
}

template <class Work>
void parallel_for(std::size_t count, int threads, Work work) {
    parallel_for(count, threads, work, [](std::size_t) {});
}

} // namespace voxelize
