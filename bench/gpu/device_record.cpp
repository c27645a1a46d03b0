// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "device_record.hpp"

#include "session.hpp"

#include <algorithm>
#include <array>

#include <dlfcn.h>

namespace bench::gpu {

namespace {

std::string version(int number) { return std::to_string(number / 1000) + "." + std::to_string(number % 1000 / 10); }

std::string both(unsigned low, unsigned high) {
    if (high == 0) return "unknown";
    return std::to_string(low) + (low == high ? "" : "–" + std::to_string(high)) + " MHz";
}

} // namespace

// The four functions of NVML that are needed, by its stable C interface; its header is not always there.
struct clock_watch::library {
    using device = void*;
    void* handle = nullptr;
    int (*shutdown)() = nullptr;
    int (*clock_info)(device, unsigned type, unsigned* mhz) = nullptr;
    int (*driver_version)(char* text, unsigned length) = nullptr;
    device gpu = nullptr;

    template <class Function>
    bool find(Function& f, const char* name) const {
        f = reinterpret_cast<Function>(dlsym(handle, name));
        return f != nullptr;
    }
    bool open() {
        handle = dlopen("libnvidia-ml.so.1", RTLD_NOW | RTLD_LOCAL);
        if (handle == nullptr) return false;
        int (*init)() = nullptr;
        int (*by_bus)(const char*, device*) = nullptr;
        if (!find(init, "nvmlInit_v2") || !find(shutdown, "nvmlShutdown") ||
            !find(by_bus, "nvmlDeviceGetHandleByPciBusId_v2") || !find(clock_info, "nvmlDeviceGetClockInfo") ||
            !find(driver_version, "nvmlSystemGetDriverVersion") || init() != 0)
            return false;
        int number = 0;
        std::array<char, 32> bus{};
        return cudaGetDevice(&number) == cudaSuccess &&
               cudaDeviceGetPCIBusId(bus.data(), static_cast<int>(bus.size()), number) == cudaSuccess &&
               by_bus(bus.data(), &gpu) == 0;
    }
};

clock_watch::clock_watch() : nvml_(new library) {
    if (nvml_->open()) return;
    delete nvml_;
    nvml_ = nullptr;
}
clock_watch::~clock_watch() {
    if (nvml_ != nullptr) nvml_->shutdown();
    delete nvml_;
}

clocks clock_watch::read() {
    if (nvml_ == nullptr) return {};
    constexpr unsigned sm = 1, memory = 2; // nvmlClockType_t
    clocks now;
    if (nvml_->clock_info(nvml_->gpu, sm, &now.sm) != 0 || nvml_->clock_info(nvml_->gpu, memory, &now.memory) != 0)
        return {};
    if (high_.sm == 0) low_ = now;
    low_ = {std::min(low_.sm, now.sm), std::min(low_.memory, now.memory)};
    high_ = {std::max(high_.sm, now.sm), std::max(high_.memory, now.memory)};
    return now;
}

std::string clock_watch::driver() const {
    std::array<char, 96> text{};
    if (nvml_ == nullptr || nvml_->driver_version(text.data(), static_cast<unsigned>(text.size())) != 0)
        return "unknown";
    return text.data();
}

std::string clock_watch::range() const {
    return "SM " + both(low_.sm, high_.sm) + ", memory " + both(low_.memory, high_.memory);
}

std::string describe_device(const clock_watch& watch) {
    int device = 0, runtime = 0, driver = 0;
    check(cudaGetDevice(&device), "device");
    check(cudaRuntimeGetVersion(&runtime), "CUDA runtime");
    check(cudaDriverGetVersion(&driver), "CUDA driver");
    cudaDeviceProp p{};
    check(cudaGetDeviceProperties(&p, device), "device");
    return std::string("- device: ") + p.name + ", sm_" + std::to_string(p.major) + std::to_string(p.minor) + ", " +
           std::to_string(p.multiProcessorCount) + " multiprocessors, " + std::to_string(p.totalGlobalMem >> 20) +
           " MiB, L2 " + std::to_string(p.l2CacheSize >> 20) + " MiB\n- driver: " + watch.driver() + " (CUDA " +
           version(driver) + "), CUDA runtime " + version(runtime) +
           ", compiled by nvcc " VOXELPIPE_NVCC_VERSION " " VOXELPIPE_NVCC_OPTIONS
           " for architectures " VOXELPIPE_CUDA_ARCHITECTURES "\n";
}

} // namespace bench::gpu
