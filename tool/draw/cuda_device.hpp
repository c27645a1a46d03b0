// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The GPU, seen from plain C++: what a look at the machine finds, why it cannot be used in words for a person, and the
// pipeline on it. Defined in cuda_device.cu and cuda_look.cu where the program is built with CUDA, in no_cuda.cpp where
// it is not.

#include "voxelizer.hpp"

#include <chrono>
#include <cstdint>
#include <future>
#include <string>
#include <thread>
#include <vector>

namespace voxelize {

// CUDA versions as CUDA writes them: 13000 is 13.0.
struct cuda_facts {
    bool built_in = false;          // this program has CUDA code
    int runtime = 0;                // the CUDA version that it was built with
    int driver = 0;                 // the newest that the driver serves; 0: there is no driver
    bool driver_too_old = false;    // for this program
    int devices = 0;                // that the driver shows
    std::string name;               // of the first, the one that is used
    int capability = 0;             // its compute capability, 90 for 9.0
    bool has_kernel = false;        // this program has code for it
    std::uint64_t free_memory = 0;  // bytes
    std::uint64_t total_memory = 0; // bytes
    std::string architectures;      // that this program has code for, "8.0, 9.0"
    std::string error;              // what CUDA said where something else went wrong; empty: nothing did
};

// Looks for a device and tries it with an empty kernel. Never throws, prints nothing; the first call takes the time
// that CUDA takes to start.
[[nodiscard]] cuda_facts look_for_cuda();

// look_for_cuda() on a thread of its own, while the program does something else. The destructor waits for the thread: a
// process that ends while CUDA starts may crash.
class cuda_start {
public:
    cuda_start();
    cuda_start(const cuda_start&) = delete;
    cuda_start& operator=(const cuda_start&) = delete;

    // Waits for it.
    [[nodiscard]] cuda_facts facts() { return facts_.get(); }
    [[nodiscard]] double milliseconds_ago() const;
    [[nodiscard]] bool ready() const { return facts_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }

private:
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
    std::shared_future<cuda_facts> facts_;
    std::jthread thread_;
};

// True if this program has CUDA code at all.
[[nodiscard]] bool built_with_cuda();

// The reason why the pipeline cannot run there: the rest of a sentence, without a full stop. Empty where it can.
[[nodiscard]] std::string why_not(const cuda_facts& facts);

// Bytes of working memory where the user leaves the choice: larger slabs, because each costs a pass over all triangles.
[[nodiscard]] std::uint64_t default_work_memory(const cuda_facts& facts);

// Bytes of a scene's vertices, indices and texels.
[[nodiscard]] std::uint64_t input_bytes(const scene& model);

// The reason why a scene cannot fit into that device's memory, as far as it is known before. Empty where it may fit.
[[nodiscard]] std::string why_too_large(const cuda_facts& facts, const scene& model, const voxelize_request& request);

// The first layers of NUM parts of the grid, and its end: parts of about equal work, as a sample of the triangles has
// it.
[[nodiscard]] std::vector<int> cut_layers(const scene& model, const voxelize_request& request, int num);

// The device's memory did not suffice for the scene, the working memory and the lists of the pipeline.
struct device_memory_error : memory_error {
    using memory_error::memory_error;
};

// On the first request.devices devices, of which look_for_cuda found the first usable. Leaves the scene whole, so that
// the CPU can take over where this throws device_memory_error.
[[nodiscard]] volume run_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request,
                                 voxelize_stats& stats);

} // namespace voxelize
