// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_voxelizer.hpp"

#include "draw/cuda_device.hpp"
#include "loaded_slabs.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "slab_joiner.hpp"
#include "sparse_parts.hpp"
#include "streamed_model.hpp"
#include "write/formats/output_file.hpp"
#include "write/sparse_formats.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <memory>
#include <new>
#include <numeric>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

namespace {

// True if values of a large grid take longer to be held, most of them empty, than the bricks of a surface take. Files
// that hold the whole grid are written from bricks, too. Bricks of a grid that is full take more than the grid, so
// there has to be room for them.
bool is_quicker_in_bricks(const voxelize_request& request, double dense_need, double room) {
    constexpr double large = 256 << 20, most_in_bricks = 4; // bytes, times those of a dense grid
    const bool has_values = std::any_of(request.targets.begin(), request.targets.end(),
                                        [](target id) { return id != target::occupancy && id != target::count; });
    const bool is_free = request.devices == 1 && request.strategy == voxelpipe::strategy::automatic;
    return has_values && is_free && !request.solid && volume_bytes(request) >= large &&
           most_in_bricks * dense_need <= room;
}

} // namespace

storage_decision choose_storage(storage_choice choice, const voxelize_request& request,
                                std::span<const std::filesystem::path> outputs, const dense_needs& dense) {
    if (choice == storage_choice::dense || (request.wants_cells() && choice != storage_choice::sparse)) return {};
    if (request.solid && request.solid->fill == solid_fill::nearest) return {}; // --sparse is refused before
    const auto bricks_alone = std::find_if(outputs.begin(), outputs.end(), is_sparse_format);
    const bool needs_bricks = bricks_alone != outputs.end();
    const auto room = static_cast<double>(memory::room());
    const bool insists = choice == storage_choice::sparse;
    if (!insists && !needs_bricks && dense.all <= room)
        return {is_quicker_in_bricks(request, dense.all, room), false, ""};
    if (insists) return {true, true, ""};
    return {true, dense.alone > room,
            needs_bricks ? std::string(find_format(*bricks_alone)->extension) + " holds occupied voxels alone"
                         : "a dense one would take " + memory::mebibytes(dense.all)};
}

// The pipeline reads the request and writes the counts where they lie.
struct sparse_drawer::state {
    state(scene& model, const voxelize_request& of_model, const cuda_facts* facts)
        : request(of_model),
          whole(of_model.grid.uncropped()), backend{static_cast<unsigned>(thread_count(of_model.threads))} {
        backend.times = &times;
        stats.backend = "cpu";
        stats.threads = thread_count(of_model.threads);
        if (facts == nullptr) {
            require_vertices(model, of_model, 0);
            drawer = std::make_unique<sparse_pipeline<vp::cpu_backend>>(backend, model, request, stats);
        } else {
            drawer = bricks_on_cuda(*facts, model, request, stats, times);
        }
        of_all = stats;
    }

    voxelize_request request;
    voxelpipe::grid whole;
    voxelize_stats stats, of_all; // of_all: before anything is drawn
    vp::stage_times times;
    vp::cpu_backend backend;
    std::unique_ptr<brick_drawer> drawer;
};

sparse_drawer::sparse_drawer(scene&& model, const voxelize_request& request)
    : state_(std::make_unique<state>(model, request, nullptr)) {}
sparse_drawer::sparse_drawer(scene& model, const voxelize_request& request, const cuda_facts& facts)
    : state_(std::make_unique<state>(model, request, &facts)) {}
sparse_drawer::~sparse_drawer() = default;

const std::vector<std::string>& sparse_drawer::warnings() const { return state_->of_all.warnings; }

sparse_volume sparse_drawer::draw(const voxelize_request& part, voxelize_stats& stats) {
    state_->request = part;
    state_->times = {};
    std::vector<std::pair<std::string, double>> times = std::move(stats.milliseconds);
    state_->stats = state_->of_all;
    state_->of_all.milliseconds.clear(); // the model is uploaded once
    sparse_volume result = state_->drawer->run(state_->whole);
    constexpr std::string_view absent[] = {"tile_split", "abuffer_emit", "clear"}, absent_on_cuda[] = {"abuffer_emit"};
    if (state_->stats.backend == "cuda")
        show_stages(state_->stats, state_->times, absent_on_cuda, "cuda_calls");
    else
        show_stages(state_->stats, state_->times, absent, "");
    stats = std::move(state_->stats);
    stats.milliseconds.insert(stats.milliseconds.begin(), times.begin(), times.end());
    return result;
}
sparse_volume sparse_drawer::surface(const voxelize_request& part) {
    state_->request = part;
    return state_->drawer->surface(state_->whole);
}
sparse_volume sparse_drawer::occupied(const voxelize_request& part) {
    state_->request = part;
    return state_->drawer->occupied(state_->whole);
}
sparse_volume sparse_drawer::walls(const voxelize_request& part) {
    state_->request = part;
    return state_->drawer->walls(state_->whole);
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
        if (!bits_fit && model.triangle_count() != 0) {
            require_cpu(request, "a flood or a vote whose bits do not fit into the memory is drawn on the CPU alone",
                        stats);
            return draw_in_slabs(std::move(model), request, folder, stats);
        }
        if (request.wants_cells())
            require_cpu(request, "--target " + name_of_cells(request) + " is drawn on the CPU alone", stats);
        if (request.devices != 1) throw backend_error("--devices: one GPU draws a sparse grid");
        if (request.backend != backend_choice::cpu && !request.wants_cells())
            if (std::optional<sparse_volume> drawn =
                    draw_on_cuda(model, inside, true, stats, [&](const cuda_facts& facts, const voxelize_request& how) {
                        voxelize_stats of_drawing;
                        sparse_volume bricks = sparse_drawer(model, how, facts).draw(how, of_drawing);
                        of_drawing.estimate = stats.estimate;
                        of_drawing.milliseconds.insert(of_drawing.milliseconds.begin(), stats.milliseconds.begin(),
                                                       stats.milliseconds.end());
                        stats = std::move(of_drawing);
                        return bricks;
                    }))
                return std::move(*drawn);
        return sparse_drawer(std::move(model), request).draw(inside, stats);
    } catch (const std::system_error& error) {
        throw write_error(folder, "temporary files for a flood: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint));
    }
}

} // namespace voxelize
