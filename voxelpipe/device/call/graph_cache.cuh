// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Keeps a repeated call as one CUDA graph: launching six kernels takes the host 25 us, during which the device waits;
// as a graph, 10 us. A call's launches depend on the bytes of its arguments only (call_bytes). Meshes and targets are
// pointers among these: their contents may change from call to call.

#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::device {

// The arguments of a call, as bytes: equal bytes mean equal launches. Padding counts, so equal arguments may compare
// unequal; then the call is launched without a graph.
class call_bytes {
public:
    template <class T>
    void add(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        const std::size_t at = bytes_.size();
        bytes_.resize(at + sizeof(T));
        std::memcpy(bytes_.data() + at, &value, sizeof(T));
    }
    friend bool operator==(const call_bytes&, const call_bytes&) = default;

private:
    std::vector<std::byte> bytes_;
};

// A distinct address for each list of types.
template <class... Types>
[[nodiscard]] const void* tag_of_call() {
    static constexpr char tag = 0;
    return &tag;
}

// Begins the bytes of a call: its type, the device, and the memory that it works in.
template <class... Types>
[[nodiscard]] call_bytes bytes_of_call(const void* workspace, const void* page) {
    int device = 0;
    check(cudaGetDevice(&device));
    call_bytes b;
    b.add(tag_of_call<Types...>());
    b.add(device);
    b.add(workspace);
    b.add(page);
    return b;
}

// The last call, and its graph once it has been repeated often enough. Belongs to one device. Movable, not copyable.
class call_graph {
public:
    call_graph() = default;
    call_graph(call_graph&& other) noexcept { swap(other); }
    call_graph& operator=(call_graph&& other) noexcept {
        call_graph(std::move(other)).swap(*this);
        return *this;
    }
    ~call_graph() {
        if (graph_ != nullptr) cudaGraphExecDestroy(graph_); // a running graph finishes first; this does not wait
    }

    // Launches what launch_all(stream) launches, which must depend on the arguments alone.
    template <class F>
    void launch(const call_bytes& arguments, cudaStream_t stream, const F& launch_all) {
        if (arguments == arguments_) {
            if (times_ < tuning::worth_a_graph && ++times_ == tuning::worth_a_graph) graph_ = record(launch_all);
        } else {
            *this = {};
            arguments_ = arguments;
            times_ = 1;
        }
        if (graph_ != nullptr)
            check(cudaGraphLaunch(graph_, stream));
        else
            launch_all(stream);
    }

private:
    // Captures on a separate stream: the caller's may not allow capture. Returns null if there is no graph.
    template <class F>
    [[nodiscard]] static cudaGraphExec_t record(const F& launch_all) {
        cudaStream_t stream = nullptr;
        cudaGraph_t graph = nullptr;
        cudaGraphExec_t made = nullptr;
        if (cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking) == cudaSuccess) {
            if (cudaStreamBeginCapture(stream, cudaStreamCaptureModeRelaxed) == cudaSuccess) {
                bool launched = true;
                try {
                    launch_all(stream);
                } catch (const cuda_failure&) { // the ordinary launches will report it
                    launched = false;
                }
                if (cudaStreamEndCapture(stream, &graph) != cudaSuccess) graph = nullptr;
                if (launched && graph != nullptr && cudaGraphInstantiate(&made, graph, 0) != cudaSuccess)
                    made = nullptr;
            }
            if (graph != nullptr) cudaGraphDestroy(graph);
            cudaStreamDestroy(stream);
        }
        cudaGetLastError();
        return made;
    }
    void swap(call_graph& other) noexcept {
        std::swap(arguments_, other.arguments_);
        std::swap(times_, other.times_);
        std::swap(graph_, other.graph_);
    }
    call_bytes arguments_;
    int times_ = 0; // number of equal calls, up to worth_a_graph
    cudaGraphExec_t graph_ = nullptr;
};

} // namespace voxelpipe::device
