// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Threads of the host: a parallel loop over items that any thread may take, and an array that threads fill.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace voxelpipe::core {

// Implements parallel_for, for work(context, worker, item).
inline void parallel_items(unsigned num_threads, std::size_t num_items,
                           void (*work)(const void*, unsigned, std::size_t), const void* context) {
    const auto workers = static_cast<unsigned>(std::min<std::size_t>(num_threads, num_items));
    if (workers <= 1) {
        for (std::size_t i = 0; i < num_items; ++i) work(context, 0u, i);
        return;
    }
    std::atomic<std::size_t> next{0};
    std::exception_ptr error;
    std::mutex error_mutex;
    const auto loop = [&](unsigned worker) {
        try {
            for (std::size_t i = next.fetch_add(1); i < num_items; i = next.fetch_add(1)) work(context, worker, i);
        } catch (...) {
            next.store(num_items);
            const std::lock_guard lock(error_mutex);
            if (!error) error = std::current_exception();
        }
    };
    // If the machine grants no more threads, or no memory for one, the existing ones do the work: a loop whose items
    // need no memory cannot fail for lack of it.
    std::vector<std::thread> threads;
    try {
        threads.reserve(workers - 1);
        for (unsigned w = 1; w < workers; ++w) threads.emplace_back(loop, w);
    } catch (const std::system_error&) {
    } catch (const std::bad_alloc&) {
    }
    loop(0);
    for (std::thread& t : threads) t.join();
    if (error) std::rethrow_exception(error);
}

// Calls work(worker, item) for item = 0 .. num_items - 1, each once, on up to num_threads threads; worker <
// num_threads. Rethrows the first exception after all threads have stopped. A call through a pointer is cheap compared
// with an item, so the threads' code is compiled once instead of once per loop.
template <class Work>
void parallel_for(unsigned num_threads, std::size_t num_items, const Work& work) {
    const auto call = [](const void* w, unsigned worker, std::size_t item) {
        (*static_cast<const Work*>(w))(worker, item);
    };
    parallel_items(num_threads, num_items, call, &work);
}

// A number of elements as memory counts them. Throws std::bad_alloc where that is too many for an address: a
// std::size_t may have 32 bits.
[[nodiscard]] inline std::size_t length_of(std::uint64_t count) {
    if (count > std::numeric_limits<std::size_t>::max()) throw std::bad_alloc();
    return static_cast<std::size_t>(count);
}

// A fixed number of uninitialised values. Several threads write all of them before they are read.
template <class T>
class raw_array {
public:
    raw_array() = default;
    explicit raw_array(std::uint64_t size)
        : data_(std::make_unique_for_overwrite<T[]>(length_of(size))), size_(length_of(size)) {}

    [[nodiscard]] T* data() { return data_.get(); }
    [[nodiscard]] const T* data() const { return data_.get(); }
    [[nodiscard]] T* begin() { return data_.get(); }
    [[nodiscard]] T* end() { return data_.get() + size_; }
    [[nodiscard]] const T* begin() const { return data_.get(); }
    [[nodiscard]] const T* end() const { return data_.get() + size_; }
    [[nodiscard]] T& operator[](std::size_t i) { return data_[i]; }
    [[nodiscard]] const T& operator[](std::size_t i) const { return data_[i]; }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    std::unique_ptr<T[]> data_;
    std::size_t size_ = 0;
};

} // namespace voxelpipe::core
