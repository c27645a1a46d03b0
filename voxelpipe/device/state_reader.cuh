// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What passes between host and device in a call, beside its memory: the state on its way back, and where lists are to
// go.

#include <voxelpipe/device/abuffer_emit.cuh>
#include <voxelpipe/device/launch.cuh>
#include <voxelpipe/device/scene.cuh>

#include <cstddef>
#include <cstring>
#include <new>
#include <utility>

namespace voxelpipe::device {

// Brings the state of a call to the host. Into ordinary memory the driver copies it; from the second call on a page of
// host memory is locked, which a kernel writes in less time: 10 us of a call that takes 60. Unlocking waits for the
// whole device, so what is used once locks nothing. The page also says where the call's lists are to go.
class state_reader {
public:
    state_reader() = default;
    state_reader(state_reader&& other) noexcept { swap(other); }
    state_reader& operator=(state_reader&& other) noexcept {
        state_reader(std::move(other)).swap(*this);
        return *this;
    }
    ~state_reader() {
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
    // Before the launches of a call: where its lists are to go.
    [[nodiscard]] asked_places ask(const list_places& places) const {
        if (on_device_ == nullptr) return {places, nullptr};
        std::memcpy(&page_->places, &places, sizeof(places));
        return {places, &on_device_->places};
    }
    // The last that a call puts on its stream. With a page, the state is zeroed then.
    void send(pipeline_state* state, cudaStream_t stream) const {
        if (on_device_ == nullptr) return;
        launch_behind(move_state_kernel<pipeline_state>, 1, 32, stream, stage::validate, state, &on_device_->state);
    }
    // What was sent. Waits for the stream.
    [[nodiscard]] pipeline_state receive(const pipeline_state* state, cudaStream_t stream) const {
        pipeline_state copy{};
        if (on_device_ == nullptr) check(cudaMemcpyAsync(&copy, state, sizeof(copy), cudaMemcpyDeviceToHost, stream));
        check(cudaStreamSynchronize(stream));
        if (on_device_ != nullptr) std::memcpy(&copy, &page_->state, sizeof(copy));
        return copy;
    }

private:
    static constexpr std::align_val_t page_bytes{4096};
    struct contents {
        pipeline_state state;
        list_places places;
    };
    static_assert(sizeof(contents) <= static_cast<std::size_t>(page_bytes));

    // Once: where that cannot be had, copies do.
    void lock() {
        constexpr auto bytes = static_cast<std::size_t>(page_bytes);
        page_ = new (::operator new(bytes, page_bytes)) contents{};
        if (cudaHostRegister(page_, bytes, cudaHostRegisterMapped | cudaHostRegisterPortable) == cudaSuccess) {
            void* on_device = nullptr;
            if (cudaHostGetDevicePointer(&on_device, page_, 0) == cudaSuccess) {
                on_device_ = static_cast<contents*>(on_device);
                return;
            }
            cudaHostUnregister(page_);
        }
        cudaGetLastError();
    }
    void swap(state_reader& other) noexcept {
        std::swap(page_, other.page_);
        std::swap(on_device_, other.on_device_);
        std::swap(was_used_, other.was_used_);
    }
    contents* page_ = nullptr;
    contents* on_device_ = nullptr; // the page, where it is locked
    bool was_used_ = false;
};

} // namespace voxelpipe::device
