// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_voxelizer.hpp"

#include "loaded_slabs.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "slab_joiner.hpp"
#include "sparse_pipeline.hpp"
#include "streamed_model.hpp"
#include "write/formats/output_file.hpp"
#include "write/sparse_formats.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <new>
#include <numeric>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

storage_decision choose_storage(storage_choice choice, const voxelize_request& request,
                                std::span<const std::filesystem::path> outputs, const dense_needs& dense) {
    if (choice == storage_choice::dense || (request.wants_cells() && choice != storage_choice::sparse)) return {};
    if (request.solid && request.solid->fill == solid_fill::nearest) return {}; // --sparse is refused before
    const auto bricks_alone = std::find_if(outputs.begin(), outputs.end(), is_sparse_format);
    const bool needs_bricks = bricks_alone != outputs.end();
    const auto room = static_cast<double>(memory::room());
    const bool insists = choice == storage_choice::sparse;
    if (!insists && !needs_bricks && dense.all <= room) return {};
    const char* refused = nullptr;
    if (request.backend == backend_choice::cuda)
        refused = "the tool draws sparse grids on the CPU, not with --backend cuda";
    if (refused != nullptr) {
        if (insists) throw backend_error(std::string("a sparse grid: ") + refused);
        return {};
    }
    if (choice == storage_choice::sparse) return {true, true, ""};
    return {true, dense.alone > room,
            needs_bricks ? std::string(find_format(*bricks_alone)->extension) + " holds occupied voxels alone"
                         : "a dense one would take " + memory::mebibytes(dense.all)};
}

// The pipeline reads the request and writes the counts where they lie.
struct sparse_drawer::state {
    state(scene& model, const voxelize_request& of_model)
        : request(of_model),
          whole(of_model.grid.uncropped()), backend{static_cast<unsigned>(thread_count(of_model.threads))} {
        backend.times = &times;
        stats.backend = "cpu";
        stats.threads = thread_count(of_model.threads);
        require_vertices(model, of_model, 0);
        pipeline.emplace(backend, model, request, stats);
        of_all = stats;
    }

    voxelize_request request;
    voxelpipe::grid whole;
    voxelize_stats stats, of_all; // of_all: before anything is drawn
    vp::stage_times times;
    vp::cpu_backend backend;
    std::optional<sparse_pipeline<vp::cpu_backend>> pipeline;
};

sparse_drawer::sparse_drawer(scene&& model, const voxelize_request& request)
    : state_(std::make_unique<state>(model, request)) {}
sparse_drawer::~sparse_drawer() = default;

const std::vector<std::string>& sparse_drawer::warnings() const { return state_->of_all.warnings; }

sparse_volume sparse_drawer::draw(const voxelize_request& part, voxelize_stats& stats) {
    state_->request = part;
    state_->times = {};
    std::vector<std::pair<std::string, double>> times = std::move(stats.milliseconds);
    state_->stats = state_->of_all;
    state_->of_all.milliseconds.clear(); // the model is uploaded once
    sparse_volume result = state_->pipeline->run(state_->whole);
    constexpr std::string_view absent[] = {"tile_split", "abuffer_emit", "clear"};
    show_stages(state_->stats, state_->times, absent, "");
    stats = std::move(state_->stats);
    stats.milliseconds.insert(stats.milliseconds.begin(), times.begin(), times.end());
    return result;
}
sparse_volume sparse_drawer::surface(const voxelize_request& part) {
    state_->request = part;
    return state_->pipeline->surface(state_->whole);
}
sparse_volume sparse_drawer::occupied(const voxelize_request& part) {
    state_->request = part;
    return state_->pipeline->occupied(state_->whole);
}
sparse_volume sparse_drawer::walls(const voxelize_request& part) {
    state_->request = part;
    return state_->pipeline->walls(state_->whole);
}

sparse_volume empty_bricks(const voxelize_request& request) {
    voxelize_request inside = request;
    inside.grid = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
    voxelize_stats none;
    return sparse_drawer(scene{}, request).draw(inside, none);
}

sparse_volume draw_walls(scene&& model, const voxelize_request& request, const slabs::layer_range& layers) {
    scene plain;
    plain.materials.emplace_back();
    plain.instances = std::move(model.instances);
    plain.primitives = std::move(model.primitives);
    for (primitive& p : plain.primitives) {
        p.material = 0;
        p.colors = {};
        p.texcoords = {};
        p.lines = {};
    }
    voxelize_request how = request;
    how.targets = {target::occupancy};
    const glm::ivec3 extent = request.grid.extent;
    how.grid = request.grid.crop({0, 0, layers.begin}, {extent.x, extent.y, layers.size()});
    return sparse_drawer(std::move(plain), request).walls(how);
}

double decided_layer_bytes(const voxelize_request& request) {
    const bool decides = request.solid && (request.solid->vote || request.solid->rule == solid_rule::exterior);
    return decides ? static_cast<double>(request.grid.extent.x) * request.grid.extent.y : 0;
}

namespace {

// A flood or a vote in as many slabs as their bits need.
sparse_volume draw_in_slabs(scene&& model, const voxelize_request& request, const std::filesystem::path& folder,
                            voxelize_stats& stats) {
    constexpr int brick = 8;
    const int layers = request.grid.extent.z;
    const double fits = static_cast<double>(memory::room()) / 4 / decided_layer_bytes(request);
    const int depth = std::max(1, static_cast<int>(fits) / brick) * brick;
    std::vector<slabs::layer_range> all;
    for (int begin = 0; begin < layers; begin += depth) all.push_back({begin, std::min(layers, begin + depth)});
    std::vector<std::size_t> numbers(all.size());
    std::iota(numbers.begin(), numbers.end(), std::size_t{0});
    slab_joiner joined(all.size(), folder);
    {
        loaded_slabs of_model(std::move(model), request, all, numbers, folder, nullptr, stats);
        for (const slabs::layer_range& part : all) joined.add(of_model.draw(part, stats));
    }
    warn_of_parts(stats, request);
    if (std::string text = flood_warning(*request.solid, *stats.solid, stats.voxels); !text.empty())
        stats.warnings.push_back(std::move(text));
    return joined.finish();
}

} // namespace

sparse_volume run_sparse_voxelizer(scene&& model, const voxelize_request& request, const std::filesystem::path& folder,
                                   voxelize_stats& stats) {
    voxelize_request inside = request;
    inside.grid = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
    if (inside.solid) inside.solid->is_whole = true;
    const bool bits_fit = decided_layer_bytes(request) * request.grid.extent.z <= static_cast<double>(memory::room());
    try {
        if (!bits_fit && model.triangle_count() != 0) return draw_in_slabs(std::move(model), request, folder, stats);
        return sparse_drawer(std::move(model), request).draw(inside, stats);
    } catch (const std::system_error& error) {
        throw write_error(folder, "temporary files for a flood: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint));
    }
}

} // namespace voxelize
