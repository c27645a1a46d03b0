// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The tool's pipeline on GPUs: their memory, and the layers of each. cuda_pipeline.cuh names the files of its parts.
#include "cuda_device.hpp"

#include "cuda_pipeline.cuh"

#include <voxelpipe/slabs/device_set.cuh>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <vector>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

VOXELIZE_CUDA_BITS(extern)
VOXELIZE_CUDA_SURFACE(extern)
VOXELIZE_CUDA_OUTER(extern)
VOXELIZE_CUDA_SOLID(extern)
VOXELIZE_CUDA_BRICK_BITS(extern)
VOXELIZE_CUDA_BRICK_SURFACE(extern)
VOXELIZE_CUDA_BRICK_OUTER(extern)
VOXELIZE_CUDA_BRICK_SOLID(extern)
VOXELIZE_CUDA_DISTANCE(extern)
VOXELIZE_CUDA_REMESH(extern)

namespace {

// The device's pool of memory up to a limit, as a resource of cuda_backend. Knows how much was held at most, and
// whether a request was refused: the pipeline reports that and the host's lack of memory alike.
class limited_memory {
public:
    explicit limited_memory(std::uint64_t limit) : limit_{limit} {}

    void* allocate_async(std::size_t bytes, std::size_t, cudaStream_t stream) {
        void* memory = nullptr;
        cudaError_t error = cudaErrorMemoryAllocation;
        if (bytes <= limit_ - held_) error = cudaMallocAsync(&memory, bytes, stream);
        if (error == cudaErrorMemoryAllocation) {
            (void)cudaGetLastError();
            refused_ = held_ + bytes;
            throw std::bad_alloc{};
        }
        gpu::check(error);
        held_ += bytes;
        most_ = std::max(most_, held_);
        return memory;
    }
    void deallocate_async(void* memory, std::size_t bytes, std::size_t, cudaStream_t stream) {
        (void)cudaFreeAsync(memory, stream); // fails only where the context is gone, and the memory with it
        held_ -= bytes;
    }

    [[nodiscard]] std::uint64_t most() const { return most_; }
    [[nodiscard]] std::uint64_t refused() const { return refused_; } // bytes that were wanted in all; 0: none were

private:
    std::uint64_t limit_;
    std::uint64_t held_ = 0;
    std::uint64_t most_ = 0;
    std::uint64_t refused_ = 0;
};

// Adds what another device has drawn of the same grid.
void add_layers(voxelize_stats& all, const voxelize_stats& one) {
    all.slabs += one.slabs;
    all.triangles_drawn += one.triangles_drawn;
    all.triangles_flat += one.triangles_flat;
    all.fragments += one.fragments;
    all.fragments_discarded += one.fragments_discarded;
    all.voxels += one.voxels;
}

// A pipeline a GPU, with some of the surface's layers each; the first one does the rest.
volume draw_on_devices(const slabs::devices& gpus, scene& model, const voxelize_request& request,
                       voxelize_stats& stats) {
    const std::size_t n = gpus.size();
    const std::vector<int> cuts = cut_layers(model, request, static_cast<int>(n));
    std::vector<voxelize_request> requests(n, request);
    std::vector<voxelize_stats> of(n);
    std::vector<std::unique_ptr<pipeline<vp::cuda_backend>>> pipelines(n);
    for (std::size_t i = 1; i < n; ++i) requests[i].progress = nullptr;
    const auto stats_of = [&](std::size_t i) -> voxelize_stats& { return i == 0 ? stats : of[i]; };
    gpus.for_each(n, [&](std::size_t i, vp::cuda_backend& backend) {
        pipelines[i] = std::make_unique<pipeline<vp::cuda_backend>>(backend, model, requests[i], stats_of(i));
    });
    volume result = pipelines[0]->unset_volume();
    gpus.for_each(n, [&](std::size_t i, vp::cuda_backend&) {
        if (cuts[i] < cuts[i + 1]) pipelines[i]->draw_layers(result, cuts[i], cuts[i + 1]);
    });
    for (std::size_t i = 1; i < n; ++i) add_layers(stats, of[i]);
    gpus.for_each(1, [&](std::size_t, vp::cuda_backend&) { result = pipelines[0]->finish(std::move(result)); });
    gpus.for_each(n, [&](std::size_t i, vp::cuda_backend&) { pipelines[i].reset(); });
    return result;
}

// The GPU has refused that many bytes.
device_memory_error too_little_memory(const cuda_facts& facts, const voxelize_request& request, std::uint64_t refused) {
    return device_memory_error(
        "the GPU has too little memory: at least " + std::to_string(refused >> 20) + " MiB are needed, and of the " +
        std::to_string(facts.total_memory >> 20) + " MiB of the " + facts.name + ' ' +
        std::to_string(facts.free_memory >> 20) + " MiB were free" +
        (request.device_memory != 0
             ? ", " + std::to_string(request.device_memory >> 20) + " MiB of them for this program"
             : std::string()));
}

limited_memory memory_of(const voxelize_request& request) {
    return limited_memory{request.device_memory != 0 ? request.device_memory : UINT64_MAX};
}

// The first GPU, which works for one request.
class one_gpu {
public:
    one_gpu(const cuda_facts& facts, const voxelize_request& request, voxelize_stats& stats)
        : facts_(facts), request_{request}, stats_{stats}, memory_(memory_of(request)), gpus_({0}) {
        backend().resource = memory_;
        backend().strategy = request.strategy;
        stats.backend = "cuda";
        stats.device = facts.name;
        stats.devices = 1;
        stats.threads = thread_count(request.threads);
    }
    [[nodiscard]] vp::cuda_backend& backend() { return gpus_.backend(0); }

    // work() with the GPU as the thread's. Throws device_memory_error.
    template <class Work>
    void run(const Work& work) {
        try {
            gpus_.for_each(1, [&](std::size_t, vp::cuda_backend&) { work(); });
        } catch (const std::bad_alloc&) {
            if (memory_.refused() == 0) throw;
            throw too_little_memory(facts_, request_, memory_.refused());
        }
        stats_.device_memory = std::max(stats_.device_memory, memory_.most());
        stats_.strategy = backend().last_strategy();
    }

private:
    cuda_facts facts_;
    const voxelize_request& request_;
    voxelize_stats& stats_;
    limited_memory memory_;
    slabs::devices gpus_;
};

// Bricks on the first GPU.
class cuda_bricks : public brick_drawer {
public:
    cuda_bricks(const cuda_facts& facts, scene& model, const voxelize_request& request, voxelize_stats& stats,
                vp::stage_times& times)
        : gpu_(facts, request, stats) {
        gpu_.backend().times = &times;
        gpu_.run([&] {
            pipeline_ = std::make_unique<sparse_pipeline<vp::cuda_backend>>(gpu_.backend(), model, request, stats);
        });
    }
    ~cuda_bricks() override {
        gpu_.run([&] { pipeline_.reset(); });
    }

    sparse_volume run(const voxelpipe::grid& whole) override {
        return drawn([&] { return pipeline_->run(whole); });
    }
    sparse_volume surface(const voxelpipe::grid& whole) override {
        return drawn([&] { return pipeline_->surface(whole); });
    }
    sparse_volume occupied(const voxelpipe::grid& whole) override {
        return drawn([&] { return pipeline_->occupied(whole); });
    }
    sparse_volume walls(const voxelpipe::grid& whole) override {
        return drawn([&] { return pipeline_->walls(whole); });
    }

private:
    template <class Work>
    sparse_volume drawn(const Work& work) {
        sparse_volume bricks;
        gpu_.run([&] { bricks = work(); });
        return bricks;
    }

    one_gpu gpu_;
    std::unique_ptr<sparse_pipeline<vp::cuda_backend>> pipeline_;
};

} // namespace

std::unique_ptr<brick_drawer> bricks_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request,
                                             voxelize_stats& stats, vp::stage_times& times) {
    return std::make_unique<cuda_bricks>(facts, model, request, stats, times);
}

volume distances_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request,
                         voxelize_stats& stats) {
    one_gpu gpu(facts, request, stats);
    volume result;
    gpu.run([&] { result = draw_distances(gpu.backend(), model, request, stats); });
    return result;
}

surface_mesh remeshed_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request,
                              voxelize_stats& stats) {
    one_gpu gpu(facts, request, stats);
    surface_mesh result;
    gpu.run([&] { result = remesh_scene(gpu.backend(), model, request, stats); });
    return result;
}

volume run_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request, voxelize_stats& stats) {
    std::vector<int> ordinals;
    for (int i = 0; i < (request.devices != 0 ? request.devices : facts.devices); ++i) ordinals.push_back(i);
    std::vector<limited_memory> memory(ordinals.size(), memory_of(request));
    slabs::devices gpus(ordinals);
    for (std::size_t i = 0; i < gpus.size(); ++i) gpus.backend(i).resource = memory[i];
    vp::cuda_backend& first = gpus.backend(0);
    stats.backend = "cuda";
    stats.device = facts.name;
    stats.devices = static_cast<int>(gpus.size());
    stats.threads = thread_count(request.threads);
    const auto refused = [&] {
        return std::max_element(memory.begin(), memory.end(),
                                [](const auto& a, const auto& b) { return a.refused() < b.refused(); })
            ->refused();
    };
    try {
        vp::stage_times times;
        first.times = &times;
        for (std::size_t i = 0; i < gpus.size(); ++i) gpus.backend(i).strategy = request.strategy;
        volume result = draw_on_devices(gpus, model, request, stats);
        constexpr std::string_view absent[] = {"abuffer_emit"};
        show_stages(stats, times, absent, "cuda_calls"); // launches, memory, the waits for the counters
        for (const limited_memory& m : memory) stats.device_memory = std::max(stats.device_memory, m.most());
        stats.strategy = first.last_strategy();
        return result;
    } catch (const std::bad_alloc&) {
        if (refused() == 0) throw;
        throw too_little_memory(facts, request, refused());
    }
}

} // namespace voxelize
