// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What passes between host and device in a call, beside its memory: the state on its way back, and where lists are to
// go.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <utility>

namespace voxelpipe::device {

// A state on its way to the host, in words of which each says that it has arrived: whoever finds `arrived` in all of
// them has the state, in whatever order they came, and sees all that the stream did before. No store waits for another.
template <class State>
struct sent_state {
    static_assert(sizeof(State) % sizeof(std::uint32_t) == 0);
    static constexpr unsigned count = sizeof(State) / sizeof(std::uint32_t);
    static constexpr std::uint64_t arrived = std::uint64_t{1} << 32; // beside 32 bits of the state
    std::uint64_t words[count];
};

// Sends the state to memory that the host sees, and leaves zeros for the next call.
VOXELPIPE_DECLARES_KERNELS void send_state(pipeline_state* state, sent_state<pipeline_state>* to, cudaStream_t stream);

// Brings the state of a call to the host. Into ordinary memory the driver copies it; from the second call on a page of
// host memory is locked, which a kernel writes in less time: 10 us of a call that takes 60. The host looks at the page
// then instead of waiting for the stream, which takes 2 us more. Unlocking waits for the whole device, so what is used
// once locks nothing. The page also says where the call's lists are to go.
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

    // Before each call.
    void prepare(bool may_lock) {
        if (may_lock && was_used_ && page_ == nullptr) lock();
        was_used_ = true;
    }
    // What the device knows the page by, null where there is none.
    [[nodiscard]] void* page() const { return on_device_; }
    // Before the launches of a call, if it ends with `send`.
    void expect() {
        if (page_ != nullptr) page_->state = {};
    }
    // Before the launches of a call: where its lists are to go.
    [[nodiscard]] output_pointers ask(const list_places& places) const {
        if (on_device_ == nullptr) return {places, nullptr};
        std::memcpy(&page_->places, &places, sizeof(places));
        return {places, &on_device_->places};
    }
    // The last that a call puts on its stream. With a page, the state is zeroed then.
    void send(pipeline_state* state, cudaStream_t stream) const {
        if (on_device_ == nullptr) return;
        send_state(state, &on_device_->state, stream);
    }
    // What was sent, once all that the stream had before is done.
    [[nodiscard]] pipeline_state receive(const pipeline_state* state, cudaStream_t stream) const {
        pipeline_state copy{};
        if (on_device_ == nullptr) {
            check(cudaMemcpyAsync(&copy, state, sizeof(copy), cudaMemcpyDeviceToHost, stream));
            check(cudaStreamSynchronize(stream));
            return copy;
        }
        // What has failed never arrives: the stream is asked now and then, and at once, for drivers that keep launches
        // back until they are asked. A call of milliseconds is waited for.
        if (may_spin_)
            for (unsigned i = 0; i < max_looks; ++i) {
                if (arrives(copy)) return copy;
                if (i % looks_between == 0)
                    if (const cudaError_t error = cudaStreamQuery(stream); error != cudaErrorNotReady) break;
            }
        check(cudaStreamSynchronize(stream));
        if (!arrives(copy)) check(cudaErrorUnknown);
        return copy;
    }

private:
    static constexpr std::align_val_t page_bytes{4096};
    static constexpr unsigned max_looks = 1u << 20, looks_between = 1u << 14; // a look takes a nanosecond or two
    using sent = sent_state<pipeline_state>;
    struct contents {
        sent state;
        list_places places;
    };
    static_assert(sizeof(contents) <= static_cast<std::size_t>(page_bytes));

    // Whether all of the state is there.
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

    // Once: where that cannot be had, copies do.
    void lock() {
        constexpr auto bytes = static_cast<std::size_t>(page_bytes);
        page_ = new (::operator new(bytes, page_bytes)) contents{};
        if (cudaHostRegister(page_, bytes, cudaHostRegisterMapped | cudaHostRegisterPortable) == cudaSuccess) {
            void* on_device = nullptr;
            if (cudaHostGetDevicePointer(&on_device, page_, 0) == cudaSuccess) {
                on_device_ = static_cast<contents*>(on_device);
                // A program that wants its threads to sleep or to yield meanwhile has said so.
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
    contents* on_device_ = nullptr; // the page, where it is locked
    bool was_used_ = false;
    bool may_spin_ = false;
};

} // namespace voxelpipe::device
