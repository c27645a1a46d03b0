// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The GPU, seen from plain C++: what a look at the machine finds, why it cannot be used in words for a person, and the
// pipeline on it. Defined in cuda_device.cu and cuda_look.cu where the program is built with CUDA, in no_cuda.cpp where
// it is not.

#include "model/surface_mesh.hpp"
#include "sparse/brick_drawer.hpp"
#include "voxelizer.hpp"

#include <voxelpipe/stage_times.hpp>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
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

// The scene in the first GPU's memory, to be drawn into bricks. All that is given is referred to; the scene stays
// whole. The drawer adds to the times and puts the GPU's memory and strategy into the counts; its members throw
// device_memory_error, too.
[[nodiscard]] std::unique_ptr<brick_drawer> bricks_on_cuda(const cuda_facts& facts, scene& model,
                                                           const voxelize_request& request, voxelize_stats& stats,
                                                           voxelpipe::stage_times& times);

// What --distance and --remesh ask for, on the first GPU. The scene stays whole; device_memory_error as above.
[[nodiscard]] volume distances_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request,
                                       voxelize_stats& stats);
[[nodiscard]] surface_mesh remeshed_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request,
                                            voxelize_stats& stats);

// The GPU, where it can be used and, for the backend `automatic`, is the quicker way; stats.no_cuda says why not. Adds
// the time that its start takes. Throws backend_error where the request insists on a GPU.
[[nodiscard]] std::optional<cuda_facts> usable_cuda(const scene& model, const voxelize_request& request, bool in_bricks,
                                                    voxelize_stats& stats);

// For a device's memory that does not suffice: throws memory_error where the request insists on a GPU, otherwise adds a
// warning that the CPU does the work.
void fall_back_on_cpu(const device_memory_error& error, const voxelize_request& request, voxelize_stats& stats);

// draw(facts, request) on the GPU, with the working memory that suits it. None where usable_cuda() gives none, and
// where its memory does not suffice: the scene has stayed whole, and the CPU is to draw it.
template <class Draw>
auto draw_on_cuda(const scene& model, voxelize_request request, bool in_bricks, voxelize_stats& stats, const Draw& draw)
    -> std::optional<std::invoke_result_t<const Draw&, const cuda_facts&, const voxelize_request&>> {
    const std::optional<cuda_facts> facts = usable_cuda(model, request, in_bricks, stats);
    if (!facts) return std::nullopt;
    const voxelize_stats before = stats;
    try {
        if (const std::string why = why_too_large(*facts, model, request); !why.empty()) throw device_memory_error(why);
        if (request.work_memory == 0) request.work_memory = default_work_memory(*facts);
        return draw(*facts, request);
    } catch (const device_memory_error& error) {
        stats = before;
        fall_back_on_cpu(error, request, stats);
        return std::nullopt;
    }
}

} // namespace voxelize
