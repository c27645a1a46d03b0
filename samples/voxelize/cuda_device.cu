// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The tool's pipeline for cuda_backend, and the look at the machine before it.
#include "cuda_device.hpp"

#include "pipeline.hpp"

#include <voxelpipe/device/backend.cuh>

#include <algorithm>
#include <stdexcept>

namespace voxelize {

namespace {

// Any error as an exception; a lack of memory as the pipeline knows it.
void check(cudaError_t error) {
    if (error == cudaSuccess) return;
    (void)cudaGetLastError();
    if (error == cudaErrorMemoryAllocation) throw std::bad_alloc{};
    throw std::runtime_error(std::string("CUDA says: ") + cudaGetErrorString(error));
}

template <class T, class Value>
__global__ void work_out(T* out, std::size_t first, std::size_t count, const Value value) {
    const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i < count) out[i] = value(first + i);
}

} // namespace

// Values are worked out on the device, piece by piece, and each piece is copied to where it belongs.
template <>
struct memory_access<vp::cuda_backend> {
    static constexpr bool on_host = false;

    template <class T, class Value>
    static void read(vp::cuda_backend& backend, T* out, std::size_t count, const Value& value, int) {
        constexpr std::size_t piece = (std::size_t{32} << 20) / sizeof(T);
        vp::cuda_backend::buffer<T> buffer{backend, std::min(count, piece)};
        for (std::size_t first = 0; first < count; first += piece) {
            const std::size_t size = std::min(piece, count - first);
            constexpr unsigned threads = 256;
            work_out<<<static_cast<unsigned>((size + threads - 1) / threads), threads, 0, backend.stream>>>(
                buffer.data(), first, size, value);
            check(cudaGetLastError());
            check(
                cudaMemcpyAsync(out + first, buffer.data(), size * sizeof(T), cudaMemcpyDeviceToHost, backend.stream));
        }
        check(cudaStreamSynchronize(backend.stream));
    }
};

namespace {

__global__ void empty_kernel() {}

// "8.0, 9.0", from nvcc's list 800,900.
std::string architecture_list() {
    std::string text;
    for (const int number : {__CUDA_ARCH_LIST__}) {
        if (!text.empty()) text += ", ";
        text += std::to_string(number / 100) + '.' + std::to_string(number % 100 / 10);
    }
    return text;
}

// Fills in the device until a call fails, and returns that call's error.
cudaError_t look_at_device(cuda_facts& facts) {
    if (const cudaError_t error = cudaGetDeviceCount(&facts.devices); error != cudaSuccess) return error;
    if (facts.devices == 0) return cudaErrorNoDevice;
    cudaDeviceProp properties{};
    if (const cudaError_t error = cudaGetDeviceProperties(&properties, 0); error != cudaSuccess) return error;
    facts.name = properties.name;
    facts.capability = properties.major * 10 + properties.minor;
    if (const cudaError_t error = cudaSetDevice(0); error != cudaSuccess) return error;
    std::size_t free = 0, total = 0;
    if (const cudaError_t error = cudaMemGetInfo(&free, &total); error != cudaSuccess) return error;
    facts.free_memory = free;
    facts.total_memory = total;
    empty_kernel<<<1, 1>>>();
    if (const cudaError_t error = cudaGetLastError(); error != cudaSuccess) return error;
    facts.has_kernel = true;
    return cudaStreamSynchronize(nullptr);
}

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
        check(error);
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

} // namespace

bool built_with_cuda() { return true; }

cuda_facts look_for_cuda() {
    cuda_facts facts;
    facts.built_in = true;
    facts.architectures = architecture_list();
    (void)cudaRuntimeGetVersion(&facts.runtime);
    (void)cudaDriverGetVersion(&facts.driver);
    const cudaError_t error = look_at_device(facts);
    switch (error) {
    case cudaSuccess:
        break;
    case cudaErrorInsufficientDriver: // also where there is none
        facts.driver_too_old = facts.driver != 0;
        break;
    case cudaErrorNoDevice:
        facts.devices = 0;
        break;
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorInvalidDeviceFunction:
    case cudaErrorUnsupportedPtxVersion: // PTX for newer devices, but from a newer toolkit than the driver's
        facts.has_kernel = false;
        break;
    default:
        facts.error = cudaGetErrorString(error);
    }
    (void)cudaGetLastError();
    return facts;
}

volume run_on_cuda(const cuda_facts& facts, scene& model, const voxelize_request& request, voxelize_stats& stats) {
    limited_memory memory{request.device_memory != 0 ? request.device_memory : UINT64_MAX};
    vp::cuda_backend backend{nullptr, memory};
    stats.backend = "cuda";
    stats.device = facts.name;
    stats.threads = thread_count(request.threads);
    try {
        vp::stage_times times;
        backend.times = &times;
        backend.strategy = request.strategy;
        volume result = pipeline<vp::cuda_backend>{backend, model, request, stats}.run();
        constexpr std::string_view absent[] = {"abuffer_emit"};
        show_stages(stats, times, absent, "cuda_calls"); // launches, memory, the waits for the counters
        stats.device_memory = memory.most();
        stats.strategy = backend.last_strategy();
        return result;
    } catch (const std::bad_alloc&) {
        if (memory.refused() == 0) throw;
        throw device_memory_error(
            "the GPU has too little memory: at least " + std::to_string(memory.refused() >> 20) +
            " MiB are needed, and of the " + std::to_string(facts.total_memory >> 20) + " MiB of the " + facts.name +
            ' ' + std::to_string(facts.free_memory >> 20) + " MiB were free" +
            (request.device_memory != 0
                 ? ", " + std::to_string(request.device_memory >> 20) + " MiB of them for this program"
                 : std::string()));
    }
}

} // namespace voxelize
