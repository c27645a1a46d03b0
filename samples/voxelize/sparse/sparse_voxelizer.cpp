// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_voxelizer.hpp"

#include "../memory.hpp"
#include "sparse_formats.hpp"
#include "sparse_pipeline.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <new>

namespace voxelize {

namespace {

bool wants(const voxelize_request& request, target id) {
    return std::find(request.targets.begin(), request.targets.end(), id) != request.targets.end();
}

} // namespace

storage_decision choose_storage(storage_choice choice, const voxelize_request& request,
                                std::span<const std::filesystem::path> outputs) {
    if (choice == storage_choice::dense) return {};
    const auto bricks_alone = std::find_if(outputs.begin(), outputs.end(), is_sparse_format);
    const bool needs_bricks = bricks_alone != outputs.end();
    const double dense = volume_bytes(request);
    const bool fits = dense <= static_cast<double>(memory::room());
    const bool insists = choice == storage_choice::sparse;
    if (!insists && !needs_bricks && fits) return {};
    const char* refused = nullptr;
    if (wants(request, target::color_outer)) refused = "--target color-outer needs a dense grid";
    if (request.backend == backend_choice::cuda)
        refused = "the tool draws sparse grids on the CPU, not with --backend cuda";
    if (refused != nullptr) {
        if (insists) throw backend_error(std::string("a sparse grid: ") + refused);
        return {};
    }
    if (choice == storage_choice::sparse) return {true, ""};
    return {true, needs_bricks ? std::string(find_format(*bricks_alone)->extension) + " holds occupied voxels alone"
                               : "a dense one would take " + memory::mebibytes(dense)};
}

sparse_volume draw_sparse(scene& model, const voxelize_request& inside, const voxelpipe::grid& whole,
                          voxelize_stats& stats) {
    vp::cpu_backend backend{static_cast<unsigned>(thread_count(inside.threads))};
    vp::stage_times times;
    backend.times = &times;
    stats.backend = "cpu";
    stats.threads = thread_count(inside.threads);
    sparse_volume result = sparse_pipeline<vp::cpu_backend>{backend, model, inside, stats}.run(whole);
    constexpr std::string_view absent[] = {"tile_split", "abuffer_emit", "clear"};
    show_stages(stats, times, absent, "");
    return result;
}

sparse_volume run_sparse_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    voxelize_request inside = request;
    inside.grid = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
    try {
        return draw_sparse(model, inside, request.grid, stats);
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint));
    }
}

} // namespace voxelize
