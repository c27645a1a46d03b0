// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_voxelizer.hpp"

#include "../formats/output_file.hpp"
#include "../memory.hpp"
#include "../parallel.hpp"
#include "sparse_formats.hpp"
#include "sparse_pipeline.hpp"
#include "streamed_model.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/slabs/exterior.hpp>

#include <algorithm>
#include <new>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

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
    if (request.wants(target::color_outer)) refused = "--target color-outer needs a dense grid";
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
    how.solid.reset();
    how.targets = {target::occupancy};
    how.coverage = voxelpipe::coverage::conservative;
    const glm::ivec3 extent = request.grid.extent;
    how.grid = request.grid.crop({0, 0, layers.begin}, {extent.x, extent.y, layers.size()});
    voxelize_stats none;
    return draw_sparse(plain, how, request.grid, none);
}

namespace {

// Bytes of a layer of a flood or a vote, about: dense bits several times, and once more as words with their places.
double layer_bytes(const voxelize_request& request) {
    return static_cast<double>(request.grid.extent.x) * request.grid.extent.y;
}

// A flood or a vote in as many slabs as their bits need.
sparse_volume draw_in_slabs(const scene& model, const voxelize_request& request, const std::filesystem::path& folder,
                            voxelize_stats& stats) {
    constexpr int brick = 8;
    const voxelpipe::grid& whole = request.grid;
    const int padding = request.padding;
    const auto room = static_cast<double>(memory::room());
    const int depth = std::max(1, static_cast<int>(room / 4 / layer_bytes(request)) / brick) * brick;
    const bool floods = request.solid->rule == solid_rule::exterior;
    const int first_layer = padding, last_layer = whole.extent.z - padding;
    std::optional<vp::slabs::slab_exterior> exterior;
    double done = 0;
    const double share_of_walls = floods ? 0.3 : 0;
    const auto report = [&](voxelize_request& part, double share) {
        if (request.progress) part.progress = [&request, done, share](double d) { request.progress(done + d * share); };
        done += share;
    };
    if (floods) {
        memory::require(vp::slabs::slab_exterior::least_bytes(whole.extent, request.solid->closing),
                        "the flood of --solid exterior");
        exterior.emplace(whole.extent, request.solid->closing, static_cast<std::uint64_t>(room / 8), folder.string(),
                         static_cast<unsigned>(thread_count(request.threads)));
        voxelize_request walls = request;
        report(walls, share_of_walls);
        exterior->add_walls(draw_walls(scene(model), walls, {0, whole.extent.z}).table());
        exterior->flood();
    }
    std::vector<sparse_volume> parts;
    for (int begin = first_layer; begin < last_layer;) {
        const int end = std::min(last_layer, (begin / brick) * brick + depth);
        voxelize_request part = request;
        part.grid = whole.crop({padding, padding, begin},
                               {whole.extent.x - 2 * padding, whole.extent.y - 2 * padding, end - begin});
        report(part, (1 - share_of_walls) * (end - begin) / (last_layer - first_layer));
        std::optional<vp::core::bit_grid> inside;
        vp::solid_slab decided;
        if (floods) {
            inside = exterior->inside(part.grid.offset, part.grid.extent);
            decided.inside = inside->data();
            part.solid->slab = &decided;
        }
        scene copy = model; // drawing takes its arrays
        voxelize_stats of_part;
        parts.push_back(draw_sparse(copy, part, whole, of_part));
        // The first line is about the model's lines, if there is one; others are about the part alone.
        if (parts.size() == 1 && model.line_count() != 0 && !of_part.warnings.empty())
            stats.warnings.push_back(of_part.warnings.front());
        add_part(stats, of_part);
        stats.backend = of_part.backend;
        stats.threads = of_part.threads;
        stats.triangles = of_part.triangles;
        stats.triangles_dropped = of_part.triangles_dropped;
        ++stats.slabs;
        begin = end;
    }
    warn_of_parts(stats, request);
    if (std::string text = flood_warning(*request.solid, *stats.solid, stats.voxels); !text.empty())
        stats.warnings.push_back(std::move(text));
    return join_slabs(std::move(parts));
}

} // namespace

sparse_volume run_sparse_voxelizer(scene&& model, const voxelize_request& request, const std::filesystem::path& folder,
                                   voxelize_stats& stats) {
    voxelize_request inside = request;
    inside.grid = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
    const bool needs_bits = request.solid && (request.solid->vote || request.solid->rule == solid_rule::exterior);
    const bool bits_fit = layer_bytes(request) * request.grid.extent.z <= static_cast<double>(memory::room());
    try {
        if (needs_bits && !bits_fit && model.triangle_count() != 0) return draw_in_slabs(model, request, folder, stats);
        return draw_sparse(model, inside, request.grid, stats);
    } catch (const std::system_error& error) {
        throw write_error(folder, "temporary files for a flood: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint));
    }
}

} // namespace voxelize
