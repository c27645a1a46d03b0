// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "run_model.hpp"

#include "draw/backend_estimate.hpp"
#include "draw/cuda_device.hpp"
#include "draw/distance/distance_voxelizer.hpp"
#include "draw/picture_levels.hpp"
#include "draw/remesh/remesher.hpp"
#include "draw/sparse/sparse_voxelizer.hpp"
#include "draw/sparse/streamed_model.hpp"
#include "model/memory.hpp"
#include "read/model_file.hpp"
#include "run_outputs.hpp"
#include "slab_run.hpp"
#include "write/formats/blocks.hpp"
#include "write/formats/zarr.hpp"
#include "write/level_set.hpp"
#include "write/sparse_formats.hpp"
#include "write/surface_files.hpp"
#include "write_bytes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <system_error>
#include <type_traits>
#include <utility>

namespace voxelize {
namespace {

using clock = std::chrono::steady_clock;

double milliseconds_since(clock::time_point start) {
    return std::chrono::duration<double, std::milli>(clock::now() - start).count();
}

// CUDA, starting already where it will be used or may be.
std::shared_ptr<cuda_start> start_cuda(const command_line& options) {
    if (!built_with_cuda() || options.voxelize.backend == backend_choice::cpu || options.voxelize.wants_cells())
        return nullptr;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(options.input, error);
    if (error) return nullptr; // the model cannot be read either
    if (options.voxelize.backend == backend_choice::automatic &&
        !cuda_may_pay(options.grid, options.voxelize, static_cast<double>(bytes)))
        return nullptr;
    return std::make_shared<cuda_start>();
}

std::vector<std::filesystem::path> write_to(volume& voxels, const std::filesystem::path& output,
                                            const write_options& how) {
    return voxels.distances ? write_distances(voxels, output, how) : write(voxels, output, how);
}
std::vector<std::filesystem::path> write_to(const sparse_volume& voxels, const std::filesystem::path& output,
                                            const write_options& how) {
    return write_sparse(voxels, output, how);
}

// Writes one output of a dense or sparse volume. Formats that hold every channel get those that were asked for, which
// come first in the volume; those that need the occupancy take it in any case, and the colours that --help promises.
template <class Volume>
std::vector<std::filesystem::path> write_output(Volume& voxels, const command_line& options,
                                                const std::filesystem::path& output, const write_options& how) {
    const format& f = *find_format(output);
    std::vector<channel> aside;
    if constexpr (std::is_same_v<Volume, volume>)
        if (options.voxelize.distance && shows_level(output)) {
            add_level(voxels, options.voxelize.distance->iso.value_or(0));
            std::vector<std::filesystem::path> files = write_to(voxels, output, how);
            voxels.channels.pop_back();
            return files;
        }
    if (f.all_channels && !f.needs_occupancy)
        while (aside.size() < options.implied.size()) {
            aside.push_back(std::move(voxels.channels.back()));
            voxels.channels.pop_back();
        }
    // What only other outputs ask for: materials for blocks; colours, and occupied voxels where cells are chosen by
    // their fractions, beside hexahedra.
    const auto is_left_out = [&](const channel& c) {
        const auto is_implied = [&](target id) {
            return c.name == info_of(id).name &&
                   std::find(options.implied.begin(), options.implied.end(), id) != options.implied.end();
        };
        return (!f.has_blocks && is_implied(target::material)) || (f.has_threshold && is_implied(target::color)) ||
               (f.has_threshold && how.threshold > 0 && is_implied(target::occupancy));
    };
    std::vector<std::pair<std::ptrdiff_t, channel>> left_out; // with their places, from the last one
    for (auto n = static_cast<std::ptrdiff_t>(voxels.channels.size()); n-- > 0;)
        if (is_left_out(voxels.channels[static_cast<std::size_t>(n)])) {
            left_out.emplace_back(n, std::move(voxels.channels[static_cast<std::size_t>(n)]));
            voxels.channels.erase(voxels.channels.begin() + n);
        }
    std::vector<std::filesystem::path> files = write_to(voxels, output, how);
    for (; !left_out.empty(); left_out.pop_back())
        voxels.channels.insert(voxels.channels.begin() + left_out.back().first, std::move(left_out.back().second));
    for (; !aside.empty(); aside.pop_back()) voxels.channels.push_back(std::move(aside.back()));
    return files;
}

// Layers of whose multiple the outputs take a field of distances, or cut cells, in slabs; 0: one of them needs it
// whole.
int slab_layers_of(const command_line& options) {
    constexpr int brick = 8; // what holds the band reads a layer of bricks at a time
    int layers = 1;
    for (const std::filesystem::path& output : options.outputs) {
        const std::string extension = lower_extension(zarr_target(output));
        const bool holds_band = options.voxelize.distance && (extension == ".nvdb" || extension == ".vdb");
        if ((!is_streamed(extension) && !holds_band) || shows_level(output)) return 0;
        if (holds_band) layers = std::max(layers, brick);
        if (extension == ".zarr") layers = static_cast<int>(zarr_slab_layers); // shards are written one by one
    }
    return layers;
}

// The folder of a file.
std::filesystem::path folder_of(const std::filesystem::path& file) {
    return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

// The corners of each part's box in place of its triangles, for messages about the model.
scene outline_of(const triangle_stream& stream, const triangle_stream::boxes& boxes) {
    scene model;
    model.materials = stream.materials();
    model.warnings = stream.warnings();
    for (std::size_t i = 0; i < stream.parts().size(); ++i) {
        model.instances.push_back({static_cast<std::uint32_t>(i), stream.parts()[i].to_world});
        primitive& part = model.primitives.emplace_back();
        part.name = stream.parts()[i].name;
        part.material = stream.parts()[i].material;
        if (!boxes.own[i].empty) part.positions = {glm::vec3(boxes.own[i].low), glm::vec3(boxes.own[i].high)};
    }
    return model;
}

// The model, which is no stream. One that is refused as such and does not fit says so with its need.
scene load_whole(const std::filesystem::path& file, const load_options& options, const opened_stream& opened) {
    try {
        return load_model(file, options);
    } catch (const std::bad_alloc&) {
        if (opened.refusal.empty()) throw;
        memory::require(static_cast<double>(memory::room()) + 1, "the model", opened.refusal, opened.need);
        throw;
    }
}

// A flood that has not been examined, in a grid that the model leaves.
void warn_of_part(const bounding_box& bounds, run_report& report) {
    const voxelize_request& request = report.request;
    const bool is_flooded = request.solid      ? request.solid->rule == solid_rule::exterior
                            : request.distance ? request.distance->sign.rule == solid_rule::exterior
                            : request.remesh   ? request.remesh->sign.rule == solid_rule::exterior
                                               : false;
    if (!is_flooded || (report.stats.solid && report.stats.solid->is_examined)) return;
    const glm::dvec3 first = request.grid.part_origin(),
                     last = first + glm::dvec3(request.grid.extent) * request.grid.voxel_size;
    if (!bounding_box{first, last, false}.holds(bounds))
        report.warnings.push_back(
            "the model leaves the grid, and the flood of --solid exterior comes in there: what it "
            "takes is not what it would take of the whole model");
}

// The grid around the model; with --remesh --iso D around the model and what grows on it, and an empty voxel beyond.
voxelpipe::grid grid_of(const command_line& options, const bounding_box& bounds, run_report& report) {
    const double level = report.request.remesh ? report.request.remesh->level : 0;
    if (!(level > 0)) return place_grid(options.grid, bounds);
    bounding_box grown = bounds;
    grown.low -= level;
    grown.high += level;
    grid_request around = options.grid;
    if (!around.origin) {
        around.padding = std::max(around.padding, 1);
        return place_grid(around, grown);
    }
    const voxelpipe::grid grid = place_grid(around, bounds);
    const glm::dvec3 first = grid.part_origin(), last = first + glm::dvec3(grid.extent) * grid.voxel_size;
    if (!bounding_box{first, last, false}.holds(grown))
        report.warnings.push_back("the surface of --iso leaves the grid, at whose sides the mesh ends");
    return grid;
}

// The level that pictures show of distances lies within their band, because what is further away is not told apart.
void check_level(const command_line& options, const voxelize_request& request) {
    if (!request.distance || !request.distance->iso || request.distance->is_whole ||
        std::none_of(options.outputs.begin(), options.outputs.end(), shows_level))
        return;
    const glm::dvec3 side = request.grid.voxel_size;
    const double largest = std::max({side.x, side.y, side.z}), level = *request.distance->iso,
                 band = request.distance->band * largest;
    if (level < band && level >= -band) return;
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "--iso %g lies beyond the band of %g voxels, which is %g wide: --band %g or --band whole holds it",
                  level, request.distance->band, band, std::floor(std::abs(level) / largest) + 1);
    throw grid_error(text.data());
}

void warn_of_dropped(run_report& report) {
    if (report.stats.triangles_dropped != 0)
        report.warnings.push_back(std::to_string(report.stats.triangles_dropped) +
                                  (report.stats.triangles_dropped == 1 ? " triangle is" : " triangles are") +
                                  " dropped: a position is not finite, or too far from the grid");
}

// Draws and writes the slabs of this process.
void run_slabs(const command_line& options, slab_source&& source, const bounding_box& bounds, run_report& report) {
    report.is_sparse = true;
    const slab_outcome outcome = run_by_slabs(options, std::move(source), report);
    report.warnings.insert(report.warnings.end(), report.stats.warnings.begin(), report.stats.warnings.end());
    warn_of_dropped(report);
    warn_of_part(bounds, report);
    if (outcome.finished && report.stats.voxels == 0)
        report.warnings.push_back(why_empty(report.stats, report.request, bounds.low, bounds.high));
    if (options.quiet) return;
    std::cerr << "voxelize: drew " << outcome.drawn << " of " << outcome.slabs << " slabs";
    if (options.batch.world_size > 1)
        std::cerr << " as process " << options.batch.rank << " of " << options.batch.world_size;
    if (outcome.left != 0) std::cerr << "; " << outcome.left << " are not there yet";
    std::cerr << '\n';
}

// Makes the mesh of --remesh, and writes it.
void run_remesh(const command_line& options, scene&& model, const bounding_box& bounds, progress_bar& bar,
                run_report& report) {
    bar.start("remeshing");
    const surface_mesh mesh =
        run_remesher(std::move(model), report.request, folder_of(options.outputs.front()), report.stats);
    report.surface = surface_result{mesh.counts, mesh.euler()};
    report.warnings.insert(report.warnings.end(), report.stats.warnings.begin(), report.stats.warnings.end());
    warn_of_dropped(report);
    warn_of_part(bounds, report);
    const auto start = clock::now();
    for (const std::filesystem::path& output : options.outputs) {
        write_options how = options.write;
        bar.start("writing " + output.filename().string());
        how.progress = [&bar](double done) { bar.show(done); };
        how.warn = [&report](const std::string& warning) { report.warnings.push_back(warning); };
        for (std::filesystem::path& file : write_surface(mesh, output, how)) report.files.push_back(std::move(file));
    }
    bar.clear();
    report.stats.milliseconds.emplace_back("write", milliseconds_since(start));
}

// True if a model takes an eighth of the run's memory, so that its stream may fit where it does not. Copies are not
// counted: a stream goes through all of them, however many.
bool is_large(const scene& model) {
    double bytes = 0;
    for (const primitive& part : model.primitives) // as they are stored, snapped and paired with tiles
        bytes += 36 * (static_cast<double>(part.positions.size()) + static_cast<double>(part.triangles.size()));
    for (const picture& image : model.images) {
        bytes += static_cast<double>(image.rgba.size());
        for (const auto& levels : image.levels)
            if (levels) bytes += static_cast<double>(levels->size() * sizeof((*levels)[0]));
    }
    return 8 * bytes > static_cast<double>(memory::limit());
}

// What else a run reads and writes.
struct other_files {
    std::set<std::filesystem::path> named; // by the model, relative to its folder
    output_check* known = nullptr;         // of a list
};

// Does the work, with the model as OPENED has it. helps_to_stream: true as long as a shortage of memory may be one that
// a loaded model makes and a streamed one does not.
void run(const command_line& options, clock::time_point begin, const opened_stream& opened, const other_files& others,
         run_report& report, bool& helps_to_stream) {
    report.input = options.input;
    report.request = options.voxelize;
    progress_bar bar{!options.quiet};

    auto start = clock::now();
    report.request.cuda = start_cuda(options);
    load_options load = options.load;
    load.picture_hook = picture_reducer{options.grid, options.voxelize};
    triangle_stream* const stream = opened.stream.get();
    helps_to_stream = !stream;
    triangle_stream::boxes boxes;
    if (stream) boxes = stream->bounds();
    scene model = stream ? outline_of(*stream, boxes) : load_whole(options.input, load, opened);
    helps_to_stream = !stream && is_large(model);
    report.warnings = options.warnings;
    report.warnings.insert(report.warnings.end(), model.warnings.begin(), model.warnings.end());
    report.vertices = stream ? stream->num_vertices() : model.vertex_count();
    for (const material& m : model.materials) report.materials.push_back(m.name);
    report.stats.milliseconds.emplace_back("read", milliseconds_since(start));
    start = clock::now();
    const auto refuse = [&report](const std::string& why) {
        model_error error(why);
        error.warnings = report.warnings;
        throw error;
    };
    const std::uint64_t elements = stream ? stream->num_triangles() : model.triangle_count() + model.line_count();
    const bool may_be_empty = options.voxelize.distance && options.grid.origin; // a grid that needs no model
    if (elements == 0 && !may_be_empty) refuse("there are no triangles, lines or points to voxelize");
    if (!stream && model.triangle_count() == 0 && (options.voxelize.solid || options.voxelize.remesh))
        refuse(std::string("there are only lines and points, which enclose nothing: ") +
               (options.voxelize.solid ? "--solid" : "--remesh") + " needs triangles");
    if (!stream && model.triangle_count() == 0 && options.voxelize.wants_cells())
        refuse("there are only lines and points, which enclose nothing: --target " + name_of_cells(options.voxelize) +
               " needs triangles");
    if (elements > UINT32_MAX)
        refuse("there are " + std::to_string(elements) + " triangles, lines and points, more than the " +
               std::to_string(UINT32_MAX) + " that can be numbered");
    const bounding_box bounds = stream ? boxes.placed : bounds_of(model, options.voxelize.threads);
    if (bounds.empty && !may_be_empty) refuse("nothing to voxelize has a corner at a finite position");
    report.request.grid = grid_of(options, bounds, report);
    if (report.request.distance && report.request.distance->at_corners)
        report.request.grid = report.request.grid.at_corners();
    report.request.padding = options.grid.padding;
    check_level(options, report.request);
    if (stream) {
        const std::size_t known = stream->warnings().size();
        read_textures(*stream, report.request.grid, report.request);
        const std::vector<std::string>& warnings = stream->warnings();
        report.warnings.insert(report.warnings.end(), warnings.begin() + static_cast<std::ptrdiff_t>(known),
                               warnings.end());
    }
    if (std::string warning = precision_warning(model, report.request.grid); !warning.empty())
        report.warnings.push_back(std::move(warning));
    report.stats.milliseconds.emplace_back("place", milliseconds_since(start));

    const stream_place place{folder_of(options.outputs.front()), [&](const std::string& how) {
                                 if (!options.quiet) std::cerr << "voxelize: " << how << '\n';
                             }};
    if (options.by_slabs) {
        check_outputs(options, report.request, others.named, held_as::grid, others.known);
        bar.start("voxelizing slab by slab");
        report.request.progress = [&bar](double done) { bar.show(done); };
        run_slabs(options, {std::move(model), stream, place}, bounds, report);
        bar.clear();
        report.peak_memory = memory::peak();
        add_rest(report, milliseconds_since(begin));
        return;
    }
    storage_decision storage{true, true, ""};
    // Outputs are written one after the other.
    report.request.write_bytes = [&](double bricks, double voxels, double in_tiles) {
        double bytes = 0;
        for (const std::filesystem::path& output : options.outputs)
            bytes = std::max(
                bytes, bytes_to_write(output,
                                      {report.request.grid.extent, report.request.targets, storage.sparse, bricks,
                                       voxels, in_tiles, report.request.coverage != voxelpipe::coverage::conservative},
                                      options.write));
        return bytes;
    };
    if (report.request.distance) report.request.distance->slab_layers = slab_layers_of(options);
    if (report.request.wants_cells() && options.storage != storage_choice::dense)
        report.request.slab_layers = slab_layers_of(options);
    if (report.request.distance || report.request.remesh) {
        storage = {false, false, ""};
    } else if (!stream) {
        storage.sparse = false;
        // As it is without the other outputs and what they ask for.
        voxelize_request alone = report.request;
        alone.targets.resize(alone.targets.size() - options.implied.size());
        storage = choose_storage(options.storage, report.request, options.outputs,
                                 {dense_need(report.request), dense_need(alone)});
    }
    check_outputs(options, report.request, others.named, storage.lists ? held_as::list : held_as::grid, others.known);
    const glm::ivec3 extent = report.request.grid.extent;
    if (!options.quiet && !storage.reason.empty())
        std::cerr << "voxelize: a sparse grid of " << extent.x << " x " << extent.y << " x " << extent.z
                  << " voxels: " << storage.reason << '\n';
    if (report.request.remesh) {
        run_remesh(options, std::move(model), bounds, bar, report);
        helps_to_stream = false;
        report.peak_memory = memory::peak();
        add_rest(report, milliseconds_since(begin));
        return;
    }
    bar.start(report.request.distance ? "measuring" : storage.sparse ? "voxelizing into bricks" : "voxelizing");
    report.request.progress = [&bar](double done) { bar.show(done); };
    volume voxels;
    sparse_volume bricks;
    if (stream && report.request.distance)
        voxels = run_streamed_distances(*stream, place, report.request, report.stats);
    else if (stream)
        bricks = run_streamed_voxelizer(*stream, place, report.request, report.stats);
    else if (storage.sparse)
        bricks = run_sparse_voxelizer(std::move(model), report.request, place.folder, report.stats);
    else if (report.request.distance)
        voxels = run_distance_voxelizer(std::move(model), report.request, report.stats);
    else
        voxels = run_voxelizer(std::move(model), report.request, report.stats);
    helps_to_stream = false;
    const std::uint64_t num_bricks = bricks.keys.size(), brick_bytes = bricks.num_bytes();
    const bool is_late = is_drawn_late(voxels);
    const auto tell = [&] {
        for (const std::string& warning : report.stats.warnings) report.warnings.push_back(warning);
        warn_of_dropped(report);
        warn_of_part(bounds, report);
        if (report.stats.voxels == 0 && !report.request.distance)
            report.warnings.push_back(why_empty(report.stats, report.request, bounds.low, bounds.high));
        else if (report.stats.voxels == 0 && report.stats.triangles > report.stats.triangles_dropped)
            report.warnings.push_back("no sample of the grid lies within the band of --distance around the model");
    };
    if (!is_late) tell();

    start = clock::now();
    const std::shared_ptr<const block_list> blocks =
        options.blocks ? with_materials(*options.blocks, options.block_file, report.materials, report.warnings)
                       : nullptr;
    for (const std::filesystem::path& output : options.outputs) {
        write_options how = options.write;
        how.blocks = blocks;
        how.lists = storage.lists;
        bar.start("writing " + output.filename().string());
        how.progress = [&bar](double done) { bar.show(done); };
        how.warn = [&report](const std::string& warning) { report.warnings.push_back(warning); };
        for (std::filesystem::path& file :
             storage.sparse ? write_output(bricks, options, output, how) : write_output(voxels, options, output, how))
            report.files.push_back(std::move(file));
    }
    bar.clear();
    if (is_late) {
        if (report.request.distance)
            add_distance_warnings(report.request, report.stats);
        else
            add_fraction_warnings(report.request, report.stats);
        tell();
    }
    report.stats.milliseconds.emplace_back("write", milliseconds_since(start));
    start = clock::now();
    model = {};
    voxels = {};
    bricks = {};
    report.request.cuda.reset();
    report.stats.milliseconds.emplace_back("release", milliseconds_since(start));
    report.peak_memory = memory::peak();

    report.bricks = num_bricks;
    report.brick_bytes = brick_bytes;
    report.is_sparse = storage.sparse;
    add_rest(report, milliseconds_since(begin));
}

// The command's input as a stream, where it has to be one: a file that open_stream() knows and that takes more bytes
// than LOADED_ROOM when it is loaded, on the CPU. folder: for temporary files. Throws as open_stream() does.
opened_stream streamed_input(const command_line& options, const std::filesystem::path& folder, double loaded_room) {
    const voxelize_request& request = options.voxelize;
    const bool needs_dense = request.wants_cells() || (request.solid && request.solid->fill == solid_fill::nearest);
    const bool is_drawn_here = (!request.distance || streams_distances(request)) && !request.remesh && !needs_dense &&
                               request.backend != backend_choice::cuda &&
                               request.strategy == voxelpipe::strategy::automatic &&
                               options.storage != storage_choice::dense;
    if (!is_drawn_here) return {};
    return open_stream(options.input, {memory::room() / 8, loaded_room}, folder, options.load);
}

// Every failure is an exception. Streams a model that does not fit otherwise. How much its pictures take is known only
// once they are held, and how much drawing takes only by an estimate: one that may fit is loaded first.
void run_either_way(const command_line& given, clock::time_point begin, output_check* known, run_report& report) {
    other_files others{{}, known};
    command_line options = given;
    options.load.gltf.names_file = [&others](const std::filesystem::path& file) { others.named.insert(file); };
    const std::filesystem::path folder = folder_of(options.outputs.front());
    const double options_ms = milliseconds_since(begin);
    report.stats.milliseconds.emplace_back("options", options_ms);
    opened_stream opened = streamed_input(options, folder, static_cast<double>(memory::room()));
    bool helps_to_stream = true;
    // The model, which is large, is no stream for a reason that is told with its need.
    const auto tell_refusal = [&] {
        if (!opened.refusal.empty())
            memory::require(static_cast<double>(memory::room()) + 1, "the model", opened.refusal, opened.need);
    };
    const auto keep_for_later = [&]() -> std::exception_ptr { // within a handler
        if (!helps_to_stream) throw;
        tell_refusal();
        return std::current_exception();
    };
    std::exception_ptr shortage;
    try {
        run(options, begin, opened, others, report, helps_to_stream);
    } catch (const memory_error&) {
        shortage = keep_for_later();
    } catch (const std::bad_alloc&) {
        shortage = keep_for_later();
    }
    if (!shortage) return;
    opened = streamed_input(options, folder, 0);
    if (!opened.stream) {
        tell_refusal();
        std::rethrow_exception(shortage);
    }
    report = {};
    report.stats.milliseconds.emplace_back("options", options_ms);
    run(options, begin, opened, others, report, helps_to_stream);
}

} // namespace

run_outcome run_model(const command_line& options, clock::time_point begin, output_check* known) {
    run_outcome result;
    const auto fail = [&result](exit_code code, const std::string& why) {
        result.code = code;
        result.error = why;
    };
    try {
        run_either_way(options, begin, known, result.report);
    } catch (const model_error& error) {
        result.report.warnings = error.warnings;
        fail(exit_input, options.input.string() + ": " + error.what() +
                             (error.lenient_helps ? " (--lenient goes on all the same)" : ""));
    } catch (const output_conflict& error) {
        result.is_conflict = true;
        fail(exit_usage, error.what());
    } catch (const grid_error& error) {
        fail(exit_usage, error.what());
    } catch (const memory_error& error) {
        fail(exit_too_large, error.what());
    } catch (const picture_memory_error& error) {
        fail(exit_too_large, memory::shortage(error.what()));
    } catch (const std::bad_alloc&) {
        fail(exit_too_large, memory::shortage());
    } catch (const write_error& error) {
        fail(exit_output, error.what());
    } catch (const backend_error& error) {
        fail(exit_backend, error.what());
    } catch (const std::exception& error) {
        fail(exit_internal, std::string("unexpected error, please report it: ") + error.what());
    }
    return result;
}

} // namespace voxelize
