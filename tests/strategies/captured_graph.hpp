// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Streams and captured calls of the GPU tests.

#include <voxelpipe/device/backend.cuh>

#include <gtest/gtest.h>

#include <cstddef>
#include <functional>

namespace device_test {

namespace vp = voxelpipe;

// A stream that outlives the backends made after it, which free their memory on it.
class owned_stream {
public:
    owned_stream() { EXPECT_EQ(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), cudaSuccess); }
    owned_stream(const owned_stream&) = delete;
    owned_stream& operator=(const owned_stream&) = delete;
    ~owned_stream() { EXPECT_EQ(cudaStreamDestroy(stream_), cudaSuccess); }
    [[nodiscard]] cudaStream_t get() const { return stream_; }

private:
    cudaStream_t stream_ = nullptr;
};

// A captured call that can be launched again.
class captured_graph {
public:
    captured_graph(cudaStream_t stream, const std::function<vp::status()>& call) {
        EXPECT_EQ(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal), cudaSuccess);
        const vp::status s = call();
        EXPECT_EQ(cudaStreamEndCapture(stream, &graph_), cudaSuccess);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(cudaGraphGetNodes(graph_, nullptr, &num_nodes_), cudaSuccess);
        EXPECT_EQ(cudaGraphInstantiate(&instance_, graph_, 0), cudaSuccess);
    }
    captured_graph(const captured_graph&) = delete;
    captured_graph& operator=(const captured_graph&) = delete;
    ~captured_graph() {
        cudaGraphExecDestroy(instance_);
        cudaGraphDestroy(graph_);
    }
    [[nodiscard]] std::size_t num_nodes() const { return num_nodes_; }
    void launch(cudaStream_t stream) const { ASSERT_EQ(cudaGraphLaunch(instance_, stream), cudaSuccess); }

private:
    cudaGraph_t graph_ = nullptr;
    cudaGraphExec_t instance_ = nullptr;
    std::size_t num_nodes_ = 0; // kernels and other nodes
};

} // namespace device_test
