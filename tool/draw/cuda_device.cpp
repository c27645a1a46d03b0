// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The part of cuda_device.hpp that needs no CUDA: what the facts mean.
#include "cuda_device.hpp"

#include "backend_estimate.hpp"
#include "model/parallel.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace voxelize {

namespace {

std::string version(int number) { return std::to_string(number / 1000) + '.' + std::to_string(number % 1000 / 10); }

std::string mebibytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

// Never less than there is.
std::string at_least_mebibytes(std::uint64_t bytes) { return mebibytes(bytes + (1 << 20) - 1); }

template <class T>
std::uint64_t bytes_of(const std::vector<T>& list) {
    return list.size() * sizeof(T);
}

std::uint64_t bytes_of(const scene& model) {
    std::uint64_t bytes = 0;
    for (const primitive& part : model.primitives)
        bytes += bytes_of(part.positions) + bytes_of(part.triangles) + bytes_of(part.lines) + bytes_of(part.texcoords) +
                 bytes_of(part.colors);
    for (const picture& image : model.images) {
        bytes += bytes_of(image.rgba);
        for (const auto& levels : image.levels) bytes += levels ? bytes_of(*levels) : 0;
    }
    return bytes;
}

} // namespace

std::vector<int> cut_layers(const scene& model, const voxelize_request& request, int num) {
    namespace slabs = voxelpipe::slabs;
    const voxelpipe::grid& grid = request.grid;
    const double low = grid.part_origin().z, size = grid.voxel_size.z;
    slabs::histogram layers(glm::ivec3(1, 1, grid.extent.z));
    constexpr std::uint64_t most = 1 << 18; // triangles of the sample
    const std::uint64_t step = model.triangle_count() / most + 1;
    for (const instance& shown : model.instances) {
        const primitive& part = model.primitives[shown.primitive];
        for (std::size_t i = 0; i < part.triangles.size(); i += step) {
            const double at = (shown.to_world(glm::dvec3(part.positions[part.triangles[i].x])).z - low) / size;
            if (!(at >= 0) || at >= grid.extent.z) continue; // nor a number
            const auto layer = static_cast<std::int64_t>(at);
            layers.add({{{0, 0, layer}}, {{0, 0, layer}}});
        }
    }
    // A triangle counts as much as the clear and the copy of some kilobytes.
    slabs::plan_options how;
    how.triangle_cost = 512 * step;
    how.layer_cost = static_cast<std::uint64_t>(volume_bytes(request) / grid.extent.z);
    how.may_turn = false;
    std::vector<int> cuts;
    for (const slabs::layer_range& r : slabs::split(layers, num, how).slabs) cuts.push_back(r.begin);
    cuts.push_back(grid.extent.z);
    return cuts;
}

cuda_start::cuda_start() {
    std::promise<cuda_facts> found;
    facts_ = found.get_future().share();
    thread_ = std::jthread([found = std::move(found)]() mutable { found.set_value(look_for_cuda()); });
}

double cuda_start::milliseconds_ago() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count();
}

std::uint64_t input_bytes(const scene& model) { return bytes_of(model); }

std::string why_not(const cuda_facts& facts) {
    if (!facts.built_in) return "this program was built without CUDA";
    if (facts.driver == 0) return "there is no NVIDIA driver";
    if (facts.driver_too_old)
        return "the NVIDIA driver serves CUDA " + version(facts.driver) + " and this program needs CUDA " +
               version(facts.runtime) + ", so the driver is too old";
    if (!facts.error.empty()) return "CUDA says: " + facts.error;
    if (facts.devices == 0) return "the NVIDIA driver finds no GPU";
    if (!facts.has_kernel)
        return "this program has no code for the " + facts.name + " (compute capability " +
               std::to_string(facts.capability / 10) + '.' + std::to_string(facts.capability % 10) + "), only for " +
               facts.architectures;
    return {};
}

std::uint64_t default_work_memory(const cuda_facts& facts) {
    return std::clamp<std::uint64_t>(facts.free_memory / 4, std::uint64_t{16} << 20, std::uint64_t{1} << 30);
}

std::string why_too_large(const cuda_facts& facts, const scene& model, const voxelize_request& request) {
    std::uint64_t room = facts.free_memory;
    if (request.device_memory != 0) room = std::min(room, request.device_memory);
    // The pipeline's own memory comes on top; it is known once the pipeline runs.
    const std::uint64_t needed = bytes_of(model);
    if (needed <= room) return {};
    return "the model needs " + at_least_mebibytes(needed) + " of GPU memory, and of the " +
           mebibytes(facts.total_memory) + " of the " + facts.name + ' ' + mebibytes(room) + " may be used";
}

namespace {

// The user has chosen how a GPU draws, or how many draw.
bool is_forced(const voxelize_request& request) {
    return request.strategy != voxelpipe::strategy::automatic || request.devices != 1;
}

} // namespace

std::optional<cuda_facts> usable_cuda(const scene& model, const voxelize_request& request, bool in_bricks,
                                      voxelize_stats& stats) {
    const auto start = std::chrono::steady_clock::now();
    if (request.backend == backend_choice::automatic && !is_forced(request) && built_with_cuda()) {
        const work_size work = work_of(request, static_cast<double>(model.triangle_count() + model.line_count()),
                                       static_cast<double>(input_bytes(model)), in_bricks);
        const double on_cpu = cpu_milliseconds(work, thread_count(request.threads));
        const double on_cuda = cuda_milliseconds(work, request.cuda ? request.cuda->milliseconds_ago() : 0);
        stats.estimate = in_words(on_cpu, on_cuda);
        if (on_cpu <= on_cuda) {
            stats.no_cuda = "the CPU is quicker here: " + stats.estimate;
            return std::nullopt;
        }
    }
    const cuda_facts facts = request.cuda ? request.cuda->facts() : look_for_cuda();
    stats.no_cuda = why_not(facts);
    if (!stats.no_cuda.empty()) {
        if (is_forced(request))
            throw backend_error((request.devices != 1 ? std::string("--devices")
                                                      : std::string("--strategy ") + to_string(request.strategy)) +
                                " needs a GPU: " + stats.no_cuda);
        if (request.backend == backend_choice::cuda)
            throw backend_error("--backend cuda: " + stats.no_cuda + "; use --backend cpu");
        return std::nullopt;
    }
    if (request.devices > facts.devices)
        throw backend_error("--devices " + std::to_string(request.devices) + ": the NVIDIA driver shows " +
                            std::to_string(facts.devices));
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    stats.milliseconds.emplace_back("cuda_start", time.count());
    return facts;
}

void fall_back_on_cpu(const device_memory_error& error, const voxelize_request& request, voxelize_stats& stats) {
    if (request.backend == backend_choice::cuda || is_forced(request))
        throw memory_error(std::string("--backend cuda: ") + error.what() + "; use --backend cpu");
    stats.no_cuda = error.what();
    stats.warnings.push_back(stats.no_cuda + "; the CPU does the work");
}

} // namespace voxelize
