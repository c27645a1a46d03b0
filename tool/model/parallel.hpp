// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Runs work(0) .. work(count - 1), each once, on several threads that take the next number when they are free.

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <new>
#include <optional>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>
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

// Calls use(n, make(n)) for n = 0 .. count - 1: make on all threads, use on the calling thread, in order. At most four
// results a thread wait to be used. The first exception of either stops the work and is thrown here.
template <class Make, class Use>
void ordered_for(std::size_t count, int threads, const Make& make, const Use& use) {
    using result = std::invoke_result_t<const Make&, std::size_t>;
    if (threads <= 1 || count <= 1) {
        for (std::size_t n = 0; n < count; ++n) use(n, make(n));
        return;
    }
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<std::optional<result>> waiting(4 * static_cast<std::size_t>(threads)); // result n at n modulo the size
    std::size_t next = 0, used = 0;
    std::exception_ptr failure;
    const auto may_take = [&] { return next < count && next < used + waiting.size(); };
    // Makes one result; the lock is held before and after.
    const auto make_one = [&](std::unique_lock<std::mutex>& lock) {
        const std::size_t n = next++;
        lock.unlock();
        std::optional<result> made;
        std::exception_ptr problem;
        try {
            made.emplace(make(n));
        } catch (...) {
            problem = std::current_exception();
        }
        lock.lock();
        if (problem && !failure) failure = problem;
        waiting[n % waiting.size()] = std::move(made);
        changed.notify_all();
    };
    std::vector<std::jthread> helpers;
    const auto help = [&] {
        std::unique_lock lock(mutex);
        while (true) {
            changed.wait(lock, [&] { return failure || next == count || may_take(); });
            if (failure || next == count) return;
            make_one(lock);
        }
    };
    try {
        for (std::size_t n = 1; n < std::min(count, static_cast<std::size_t>(threads)); ++n) helpers.emplace_back(help);
    } catch (const std::system_error&) { // as in parallel_for
    } catch (const std::bad_alloc&) {
    }
    {
        std::unique_lock lock(mutex);
        while (used < count && !failure) {
            std::optional<result>& ready = waiting[used % waiting.size()];
            if (ready) {
                const result taken = std::move(*ready);
                ready.reset();
                lock.unlock();
                try {
                    use(used, taken);
                } catch (...) {
                    lock.lock();
                    if (!failure) failure = std::current_exception();
                    break;
                }
                lock.lock();
                ++used;
                changed.notify_all();
            } else if (may_take()) {
                make_one(lock);
            } else {
                changed.wait(lock);
            }
        }
        changed.notify_all();
    }
    helpers.clear(); // joins
    if (failure) std::rethrow_exception(failure);
}

} // namespace voxelize
