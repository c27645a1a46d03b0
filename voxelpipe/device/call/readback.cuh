// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Data that host and device exchange in a call: the state, on its way back, and the output pointers of lists.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <utility>

namespace voxelpipe::device {

// A state on its way to the host. Each word carries a flag that it has arrived: a reader that finds all flags has the
// state, in whatever order the words came, and sees all earlier work of the stream. No store waits for another.
template <class State>
struct sent_state {
    static_assert(sizeof(State) % sizeof(std::uint32_t) == 0);
    static constexpr unsigned count = sizeof(State) / sizeof(std::uint32_t);
    static constexpr std::uint64_t arrived = std::uint64_t{1} << 32; // above 32 bits of the state
    std::uint64_t words[count];
};

// Writes the state to memory that the host can read, and zeros it for the next call.
VOXELPIPE_DECLARES_KERNELS void send_state(pipeline_state* state, sent_state<pipeline_state>* to, cudaStream_t stream);

// Brings the state of a call to the host. The first call copies it by the driver. From the second call on, a kernel
// writes it to a page of locked host memory, which saves 10 us of a call that takes 60; the host polls the page,
// because waiting for the stream takes 2 us more. Unlocking waits for the whole device, so a backend that is used once
// locks nothing. The page also holds the call's output pointers.
class readback {
public:
    readback() = default;
    readback(readback&& other) noexcept { swap(other); }
    readback& operator=(readback&& other) noexcept {
        readback(std::move(other)).swap(*this);
        return *this;
    }
    ~readback() {
        if (on_device_ != nullptr) cudaHostUnregister(page_);
        ::operator delete(page_, page_bytes);
    }

    // Call before each voxelize call.
    void prepare(bool may_lock) {
        if (may_lock && was_used_ && page_ == nullptr) lock();
        was_used_ = true;
    }
    // The page's address on the device; null without a page.
    [[nodiscard]] void* page() const { return on_device_; }
    // Call before the launches of a call that ends with `send`.
    void expect() {
        if (page_ != nullptr) page_->state = {};
    }
    // Sets the output pointers; call before the launches.
    [[nodiscard]] output_pointers set_outputs(const csr_pointers& pointers) const {
        if (on_device_ == nullptr) return {pointers, nullptr};
        std::memcpy(&page_->pointers, &pointers, sizeof(pointers));
        return {pointers, &on_device_->pointers};
    }
    // The last work that a call puts on its stream. With a page, it zeros the state.
    void send(pipeline_state* state, cudaStream_t stream) const {
        if (on_device_ == nullptr) return;
        send_state(state, &on_device_->state, stream);
    }
    // Waits for the stream and returns the state.
    [[nodiscard]] pipeline_state receive(const pipeline_state* state, cudaStream_t stream) const {
        pipeline_state copy{};
        if (on_device_ == nullptr) {
            check(cudaMemcpyAsync(&copy, state, sizeof(copy), cudaMemcpyDeviceToHost, stream));
            check(cudaStreamSynchronize(stream));
            return copy;
        }
        // A failed call never arrives, so the stream is queried now and then; first at once, because some drivers hold
        // launches back until queried. Calls of milliseconds block.
        if (may_spin_)
            for (unsigned i = 0; i < tuning::max_looks; ++i) {
                if (arrives(copy)) return copy;
                if (i % tuning::looks_between == 0)
                    if (const cudaError_t error = cudaStreamQuery(stream); error != cudaErrorNotReady) break;
            }
        check(cudaStreamSynchronize(stream));
        if (!arrives(copy)) check(cudaErrorUnknown);
        return copy;
    }

private:
    static constexpr std::align_val_t page_bytes{4096};
    using sent = sent_state<pipeline_state>;
    struct contents {
        sent state;
        csr_pointers pointers;
    };
    static_assert(sizeof(contents) <= static_cast<std::size_t>(page_bytes));

    // True if all of the state has arrived.
    [[nodiscard]] bool arrives(pipeline_state& state) const {
        std::uint32_t words[sent::count];
        for (unsigned i = sent::count; i-- > 0;) {
            const std::uint64_t word = std::atomic_ref(page_->state.words[i]).load(std::memory_order_acquire);
            if ((word & sent::arrived) == 0) return false;
            words[i] = static_cast<std::uint32_t>(word);
        }
        std::memcpy(&state, words, sizeof(state));
        return true;
    }

    // Tries once; if it fails, the driver keeps copying.
    void lock() {
        constexpr auto bytes = static_cast<std::size_t>(page_bytes);
        page_ = new (::operator new(bytes, page_bytes)) contents{};
        if (cudaHostRegister(page_, bytes, cudaHostRegisterMapped | cudaHostRegisterPortable) == cudaSuccess) {
            void* on_device = nullptr;
            if (cudaHostGetDevicePointer(&on_device, page_, 0) == cudaSuccess) {
                on_device_ = static_cast<contents*>(on_device);
                // The program may set_outputs for threads that sleep or yield instead of spinning.
                unsigned flags = 0;
                may_spin_ = cudaGetDeviceFlags(&flags) == cudaSuccess &&
                            (flags & (cudaDeviceScheduleYield | cudaDeviceScheduleBlockingSync)) == 0;
                return;
            }
            cudaHostUnregister(page_);
        }
        cudaGetLastError();
    }
    void swap(readback& other) noexcept {
        std::swap(page_, other.page_);
        std::swap(on_device_, other.on_device_);
        std::swap(was_used_, other.was_used_);
        std::swap(may_spin_, other.may_spin_);
    }
    contents* page_ = nullptr;
    contents* on_device_ = nullptr; // the page, if it is locked
    bool was_used_ = false;
    bool may_spin_ = false;
};

} // namespace voxelpipe::device
