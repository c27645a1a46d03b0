// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Memory that a cuda_backend keeps between calls to run the next one quickly: device memory, a page of host memory for
// the counters, and the CUDA graph of the last call.

#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/call/graph_cache.cuh>
#include <voxelpipe/device/call/readback.cuh>

#include <algorithm>
#include <cstddef>
#include <optional>

namespace voxelpipe::device {

// Runs f, which launches stages. A failure that names no stage, from a query in between, is put down to `last`, the
// last of them: errors of kernels come late.
template <class F>
auto launch_until(stage last, F&& f) {
    try {
        return f();
    } catch (const cuda_failure& e) {
        throw cuda_failure{e.error, e.where == stage::validate ? last : e.where};
    }
}

// Moves, is never shared. Serves one call at a time.
class call_workspace {
public:
    // Device memory of at least `bytes`; a call's state lies at its start. may_lock, may_graph: whether the call may
    // use locked host memory and a graph.
    [[nodiscard]] void* prepare(std::size_t bytes, const stream_memory& from, bool may_lock, bool may_graph) {
        void* const memory = reserve(bytes, from);
        readback_.prepare(may_lock);
        may_graph_ = may_graph;
        return memory;
    }
    // A zeroed state at the start of the memory.
    [[nodiscard]] pipeline_state* zeroed_state(const stream_memory& from) {
        constexpr std::size_t bytes = sizeof(pipeline_state);
        auto* const state = static_cast<pipeline_state*>(reserve(bytes, from));
        if (zeroed_bytes_ < bytes) check(cudaMemsetAsync(state, 0, bytes, from.stream));
        zeroed_bytes_ = std::max(zeroed_bytes_, bytes);
        return state;
    }
    // After a failure: nothing is known of the memory's contents.
    void forget_contents() { zeroed_bytes_ = 0; }
    void release() {
        graph_ = {}; // first: it uses the memory and the page
        zeroed_bytes_ = 0;
        block_ = {};
        readback_ = {};
    }

    // The bytes of a call, make_bytes(workspace, page), if it may be kept as a graph. A timed call may not.
    template <class F>
    [[nodiscard]] std::optional<call_bytes> bytes_for_graph(const stage_clock* clock, const F& make_bytes) const {
        if (!may_graph_ || clock != nullptr || readback_.page() == nullptr) return std::nullopt;
        return make_bytes(block_.data(), readback_.page());
    }
    // Tells the device where the lists of the next call are to go.
    [[nodiscard]] output_pointers set_outputs(const csr_pointers& pointers) const {
        return readback_.set_outputs(pointers);
    }

    // Puts launch_all(stream), which works in the workspace, on the stream, waits, and returns the call's state. With
    // `bytes` the launches become a graph once equal bytes have come often enough. The first `zeroed_bytes` of the
    // workspace are zero when launch_all starts. A call leaves them zero again, its state only if there is a page.
    template <class F>
    [[nodiscard]] pipeline_state run(stage_clock* clock, const std::optional<call_bytes>& bytes,
                                     std::size_t zeroed_bytes, cudaStream_t stream, const F& launch_all) {
        auto* const d_state = static_cast<pipeline_state*>(block_.data());
        if (clock != nullptr) clock->start();
        if (zeroed_bytes_ < zeroed_bytes) check(cudaMemsetAsync(d_state, 0, zeroed_bytes, stream));
        zeroed_bytes_ = 0;
        readback_.expect();
        const auto launch_and_send = [&](cudaStream_t on) {
            launch_all(on);
            readback_.send(d_state, on);
        };
        if (bytes)
            graph_.launch(*bytes, stream, launch_and_send);
        else
            launch_and_send(stream);
        const pipeline_state state = readback_.receive(d_state, stream);
        if (readback_.page() != nullptr) zeroed_bytes_ = zeroed_bytes;
        return state;
    }

private:
    [[nodiscard]] void* reserve(std::size_t bytes, const stream_memory& from) {
        if (block_.size() < bytes) {
            zeroed_bytes_ = 0;
            block_ = {}; // freed first, so that memory need not hold both
            block_ = device_block(bytes, from.resource, from.stream);
        }
        return block_.data();
    }

    device_block block_;
    readback readback_;
    call_graph graph_;
    std::size_t zeroed_bytes_ = 0; // at the start of the block
    bool may_graph_ = false;
};

} // namespace voxelpipe::device
