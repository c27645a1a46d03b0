// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The GPUs of one host that work together: a cuda_backend, a stream and a thread each.

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

namespace detail {

// Makes a device the thread's current one until the end.
class current_device {
public:
    explicit current_device(int ordinal) {
        device::with_runtime_errors([&] {
            device::check(cudaGetDevice(&before_));
            device::check(cudaSetDevice(ordinal));
        });
    }
    current_device(const current_device&) = delete;
    current_device& operator=(const current_device&) = delete;
    ~current_device() { (void)cudaSetDevice(before_); }

private:
    int before_ = 0;
};

class owned_stream {
public:
    explicit owned_stream(int ordinal) {
        const current_device device(ordinal);
        device::with_runtime_errors([&] { device::check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); });
    }
    owned_stream(const owned_stream&) = delete;
    owned_stream& operator=(const owned_stream&) = delete;
    ~owned_stream() { (void)cudaStreamDestroy(stream_); }
    [[nodiscard]] cudaStream_t get() const { return stream_; }

private:
    cudaStream_t stream_ = nullptr;
};

// Waits for a signal. Waking a thread that sleeps takes a good part of the time of a short call, so a thread looks for
// the signal for a while before it sleeps.
inline void wait_for(std::binary_semaphore& signal) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(100);
    do {
        if (signal.try_acquire()) return;
    } while (std::chrono::steady_clock::now() < until);
    signal.acquire();
}

} // namespace detail

// Some GPUs of this host. They copy from each other directly where the hardware can. Used by one thread at a time.
class devices {
public:
    // ordinals: as CUDA numbers them; one may come more than once, and then works for several. is_parallel: false lets
    // one GPU work after the other, for debuggers. Throws std::runtime_error with CUDA's text, std::invalid_argument if
    // there is no GPU.
    explicit devices(const std::vector<int>& ordinals = all(), bool is_parallel = true) : is_parallel_(is_parallel) {
        if (ordinals.empty()) throw std::invalid_argument("voxelpipe::slabs: no GPU");
        for (const int a : ordinals) allow_copies(a, ordinals);
        for (const int a : ordinals) members_.push_back(std::make_unique<member>(a));
        if (!is_parallel_) return;
        for (std::size_t i = 1; i < size(); ++i) // the first one's work is done by the caller's thread
            members_[i]->thread = std::jthread([m = members_[i].get()] { serve(*m); });
    }
    devices(const devices&) = delete;
    devices& operator=(const devices&) = delete;
    ~devices() {
        for (const auto& m : members_) {
            m->work = nullptr;
            m->start.release();
        }
    }

    // All that the driver shows; none without a driver.
    [[nodiscard]] static std::vector<int> all() {
        int count = 0;
        if (cudaGetDeviceCount(&count) != cudaSuccess) (void)cudaGetLastError();
        std::vector<int> ordinals;
        for (int i = 0; i < count; ++i) ordinals.push_back(i);
        return ordinals;
    }

    // How many were named.
    [[nodiscard]] std::size_t size() const { return members_.size(); }
    // A GPU's number, as it was named.
    [[nodiscard]] int ordinal(std::size_t i) const { return members_[i]->ordinal; }
    // Its calls are made where its GPU is the current one: within for_each().
    [[nodiscard]] cuda_backend& backend(std::size_t i) const { return members_[i]->backend; }

    // Calls work(i, backend(i)) for the first `count` GPUs, each the current one of its thread, and waits. Rethrows
    // what the first of them threw.
    template <class Work>
    void for_each(std::size_t count, const Work& work) const {
        const auto run = [&](std::size_t i) {
            member& m = *members_[i];
            m.thrown = nullptr;
            try {
                const detail::current_device device(m.ordinal);
                work(i, m.backend);
            } catch (...) {
                m.thrown = std::current_exception();
            }
        };
        for (std::size_t i = 1; is_parallel_ && i < count; ++i) {
            members_[i]->work = [&run, i] { run(i); };
            members_[i]->start.release();
        }
        for (std::size_t i = 0; i < (is_parallel_ ? std::min<std::size_t>(1, count) : count); ++i) run(i);
        for (std::size_t i = 1; is_parallel_ && i < count; ++i) detail::wait_for(members_[i]->done);
        for (std::size_t i = 0; i < count; ++i)
            if (members_[i]->thrown) std::rethrow_exception(members_[i]->thrown);
    }

    // What GPU `later` is given from now on begins when what GPU `earlier` has been given has ended. Does not wait.
    void order(std::size_t earlier, std::size_t later) const {
        if (earlier == later) return;
        const detail::current_device device(ordinal(earlier));
        device::with_runtime_errors([&] {
            cudaEvent_t event = nullptr;
            device::check(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
            const cudaError_t recorded = cudaEventRecord(event, backend(earlier).stream);
            const cudaError_t waits =
                recorded == cudaSuccess ? cudaStreamWaitEvent(backend(later).stream, event, 0) : recorded;
            (void)cudaEventDestroy(event); // which the driver keeps as long as it is waited for
            device::check(waits);
        });
    }

private:
    struct member {
        int ordinal;
        detail::owned_stream stream;
        cuda_backend backend;
        std::function<void()> work; // empty: the thread ends
        std::exception_ptr thrown;
        std::binary_semaphore start{0}, done{0};
        std::jthread thread;
        explicit member(int ordinal_) : ordinal(ordinal_), stream(ordinal_), backend(stream.get()) {}
    };
    static void serve(member& m) {
        for (;;) {
            detail::wait_for(m.start);
            if (!m.work) return;
            m.work();
            m.done.release();
        }
    }
    // Others may copy from and to the memory pool of GPU a.
    static void allow_copies(int a, const std::vector<int>& others) {
        for (const int b : others) {
            int can = 0;
            if (a == b || cudaDeviceCanAccessPeer(&can, b, a) != cudaSuccess || can == 0) continue;
            cudaMemPool_t pool = nullptr;
            cudaMemAccessDesc access{};
            access.location.type = cudaMemLocationTypeDevice;
            access.location.id = b;
            access.flags = cudaMemAccessFlagsProtReadWrite;
            // Without it the driver copies through host memory.
            if (cudaDeviceGetDefaultMemPool(&pool, a) == cudaSuccess) (void)cudaMemPoolSetAccess(pool, &access, 1);
        }
        (void)cudaGetLastError();
    }

    bool is_parallel_;
    std::vector<std::unique_ptr<member>> members_;
};

} // namespace voxelpipe::slabs
