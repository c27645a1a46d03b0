// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Draws of some triangles of larger meshes (mesh_view::part): the check of their numbers, and the numbers of finished
// lists. Stages number triangles as they are drawn; only shaders and finished lists see the numbers of the whole.

#include <voxelpipe/core/numbering.hpp>
#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/voxelize.hpp>

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <vector>

namespace voxelpipe::device {

// Sets `bad_numbers` in *error unless the numbers ascend and are below `whole`.
VOXELPIPE_DECLARES_KERNELS void check_numbers(const std::uint32_t* numbers, std::uint64_t count, std::uint64_t whole,
                                              unsigned int* error, cudaStream_t stream);

template <class Draw>
void check_subsets(std::span<const Draw> draws, unsigned int* error, cudaStream_t stream) {
    for (const Draw& d : draws)
        if (const auto& part = d.mesh.part; part.whole != 0 && part.checked == 0 && part.numbers.size() != 0)
            check_numbers(part.numbers.data(), part.numbers.size(), part.whole, error, stream);
}
// The same at once, with a wait: bad_subset, or a failure of the device.
template <class Draw>
[[nodiscard]] status check_subsets(std::span<const Draw> draws, const stream_memory& memory) {
    if (!core::has_unchecked_subset(draws)) return {};
    try {
        const device_block flag(sizeof(unsigned int), memory.resource, memory.stream);
        auto* const error = static_cast<unsigned int*>(flag.data());
        unsigned int found = 0;
        check(cudaMemsetAsync(error, 0, sizeof(found), memory.stream));
        check_subsets(draws, error, memory.stream);
        check(cudaMemcpyAsync(&found, error, sizeof(found), cudaMemcpyDeviceToHost, memory.stream));
        check(cudaStreamSynchronize(memory.stream));
        return found == 0 ? status{} : core::failure(status_code::bad_subset);
    } catch (const cuda_failure& e) {
        return to_status(e);
    } catch (const std::bad_alloc&) {
        return core::failure(status_code::out_of_memory);
    }
}

// A draw, as finished lists are renumbered.
struct listed_draw {
    core::numbering numbers;
    std::uint32_t first, each; // primitive of its first triangle, as drawn; triangles of one instance
};
template <class Draw>
[[nodiscard]] std::vector<listed_draw> listed_draws(std::span<const Draw> draws) {
    std::vector<listed_draw> listed;
    std::uint32_t first = 0;
    for (const core::numbering& n : core::make_numberings(draws)) {
        const auto& mesh = draws[listed.size()].mesh;
        listed.push_back({n, first, static_cast<std::uint32_t>(mesh.triangles.size())});
        first += static_cast<std::uint32_t>(mesh.num_triangles());
    }
    return listed;
}

// Replaces the primitives of lists, as drawn, by those of the whole meshes. Lists stay sorted. draws: in device memory.
// count: how many there are, in device memory, at most `most`; null: `most`.
VOXELPIPE_DECLARES_KERNELS void renumber_lists(const listed_draw* draws, std::size_t num_draws,
                                               std::uint32_t* primitives, const std::uint64_t* count,
                                               std::uint64_t most, cudaStream_t stream);

} // namespace voxelpipe::device
