// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "draw/distance/distance_voxelizer.hpp"
#include "model/system.hpp"
#include "raw_options.hpp"
#include "values.hpp"
#include "write/formats/blocks.hpp"
#include "write/surface_files.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

glm::dvec3 parse_point(const std::string& option, const std::string& text, std::size_t least) {
    const std::vector<double> n = parse_list<double>(option, text, least);
    return n.size() == 3 ? glm::dvec3(n[0], n[1], n[2]) : glm::dvec3(n[0]);
}

// A number that a launcher puts into the environment, under one of these names.
std::optional<int> from_environment(std::initializer_list<const char*> names) {
    for (const char* const name : names) {
        const char* const text = std::getenv(name);
        if (text == nullptr) continue;
        int number = 0;
        const char* const end = text + std::strlen(text);
        if (std::from_chars(text, end, number).ptr == end && number >= 0) return number;
    }
    return std::nullopt;
}

} // namespace

void understand_batch(command_line& options, bool has_world, bool has_rank) {
    batch_request& batch = options.batch;
    if (batch.list.empty() && options.input.empty()) throw usage_error("INPUT is required: voxelize INPUT -o FILE");
    if (options.outputs.empty()) throw usage_error("--output is required: voxelize INPUT -o FILE");
    if (batch.world_size > 1 && !has_rank)
        throw usage_error("--world-size needs --rank: which of the " + std::to_string(batch.world_size) +
                          " processes this one is");
    const auto check_rank = [&] {
        if (batch.rank >= batch.world_size)
            throw usage_error("--rank must be below --world-size: it is " + std::to_string(batch.rank) + " of " +
                              std::to_string(batch.world_size));
    };
    if (batch.list.empty()) {
        if (!has_world) { // srun starts one process for a model, too, and says so in the same way
            batch.world_size = from_environment({"PMI_SIZE", "OMPI_COMM_WORLD_SIZE"}).value_or(1);
            batch.rank = from_environment({"PMI_RANK", "OMPI_COMM_WORLD_RANK"}).value_or(0);
        }
        check_rank();
        options.by_slabs = options.by_slabs || batch.world_size > 1;
        return;
    }
    if (!options.input.empty()) throw usage_error("INPUT and --list do not go together");
    if (options.by_slabs) throw usage_error("--resume is for one model; --list goes on by its manifest");
    for (const std::filesystem::path& output : options.outputs)
        if (output.string().find("{name}") == std::string::npos)
            throw usage_error("with --list every -o needs {name}, so that each model has files of its own: \"" +
                              output.string() + '"');
    if (options.stats != stats_format::none) throw usage_error("--stats does not go with --list: see the manifest");
    if (!has_world) {
        batch.world_size = from_environment({"PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_NTASKS"}).value_or(1);
        batch.rank = from_environment({"PMI_RANK", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID"}).value_or(0);
    }
    check_rank();
}

namespace {

// --fill, which is --fill-color too.
void understand_fill(command_line& options, const std::string& text) {
    solid_request& solid = *options.voxelize.solid;
    const std::string word = lower(text);
    if (text.empty() || word == "body") return;
    if (word == "mean") {
        solid.fill = solid_fill::mean;
    } else if (word == "nearest") {
        solid.fill = solid_fill::nearest;
        if (options.storage == storage_choice::sparse)
            throw usage_error(
                "--fill nearest does not go with --sparse: the nearest triangle is found in a dense grid");
        if (options.by_slabs)
            throw usage_error("--fill nearest is one piece of work: no --resume, and no processes that share a model");
    } else if (const auto color = parse_color(text); color) {
        solid.fill = solid_fill::color;
        solid.fill_color = *color;
    } else {
        throw usage_error("--fill takes body, nearest, mean or #rrggbb, not \"" + text + '"');
    }
}

// The greatest number of edges of holes that --close-holes closes.
std::uint64_t edges_of_holes(const raw_options& raw) {
    std::uint64_t edges = UINT64_MAX;
    if (raw.close_holes == "all") return edges;
    const char* const end = raw.close_holes.data() + raw.close_holes.size();
    const auto [last, error] = std::from_chars(raw.close_holes.data(), end, edges);
    if (error != std::errc{} || last != end || edges == 0)
        throw usage_error("--close-holes takes the number of edges of the largest hole to close, 1 or more, not \"" +
                          raw.close_holes + '"');
    return edges;
}

} // namespace

void understand_solid(command_line& options, const raw_options& raw) {
    if (raw.coverage) options.voxelize.coverage = *raw.coverage;
    if (!raw.solid && !raw.distance && !raw.remesh) {
        const std::pair<const char*, bool> given[]{{"--solid-extent", raw.extent_of_solid.has_value()},
                                                   {"--vote", raw.vote},
                                                   {"--winding", raw.winding},
                                                   {"--closing", raw.closing.has_value()},
                                                   {"--fill", !raw.fill.empty()}};
        const auto measures = [](const std::string& name) {
            const std::optional<target> id = target_named(lower(name));
            return id && is_of_cells(*id);
        };
        const auto measured = std::find_if(raw.targets.begin(), raw.targets.end(), measures);
        if (measured != raw.targets.end() && (raw.vote || raw.winding))
            throw usage_error(std::string(raw.vote ? "--vote" : "--winding") + " and --target " + lower(*measured) +
                              " do not go together: a voxel is measured by whole winding numbers");
        for (const auto& [name, is_given] : given)
            if (is_given) throw usage_error(std::string(name) + " goes with --solid");
        return;
    }
    if (raw.coverage && raw.solid)
        throw usage_error("--solid and --coverage do not go together: a solid's surface is conservative, see "
                          "--solid-extent");
    solid_request& solid = options.voxelize.solid.emplace();
    solid.rule = raw.solid.value_or(solid_rule::nonzero);
    solid.extent = raw.extent_of_solid.value_or(solid_extent::outer);
    solid.vote = raw.vote;
    solid.closing = raw.closing.value_or(0);
    const bool is_flood = solid.rule == solid_rule::exterior;
    if (raw.closing && !is_flood) throw usage_error("--closing goes with --solid exterior");
    if (raw.vote && (is_flood || solid.rule == solid_rule::each_draw || solid.rule == solid_rule::positive))
        throw usage_error(std::string("--vote does not go with --solid ") + to_string(solid.rule));
    if ((is_flood || raw.vote) && solid.extent != solid_extent::outer)
        throw usage_error(std::string(is_flood ? "--solid exterior" : "--vote") + " always has --solid-extent outer");
    if (raw.winding) {
        if (solid.rule == solid_rule::even_odd || solid.rule == solid_rule::each_draw)
            throw usage_error(std::string("--winding does not go with --solid ") + to_string(solid.rule) +
                              ": a winding number of 1/2 is neither even nor odd");
        if (is_flood || raw.vote || !raw.close_holes.empty())
            throw usage_error(std::string("--winding does not go with ") +
                              (is_flood   ? "--solid exterior"
                               : raw.vote ? "--vote"
                                          : "--close-holes, whose lids it takes the angles of"));
        solid.winding = true;
        solid.close_holes = UINT64_MAX;
    }
    if (!raw.close_holes.empty()) {
        if (is_flood || raw.vote)
            throw usage_error(std::string("--close-holes does not go with ") +
                              (is_flood ? "--solid exterior" : "--vote"));
        solid.close_holes = edges_of_holes(raw);
    }
    understand_fill(options, raw.fill);
}

void understand_distance(command_line& options, const raw_options& raw) {
    const std::pair<const char*, bool> given[]{{"--band", !raw.band.empty()},
                                               {"--unsigned", raw.is_unsigned},
                                               {"--corners", raw.corners},
                                               {"--half", raw.half},
                                               {"--iso", raw.iso.has_value()}};
    if (!raw.distance) {
        for (const auto& [name, is_given] : given) {
            const bool has_level = raw.remesh && std::string_view(name) == "--iso";
            if (is_given && !has_level)
                throw usage_error(std::string(name) + (std::string_view(name) == "--iso"
                                                           ? " goes with --distance or --remesh"
                                                           : " goes with --distance"));
        }
        return;
    }
    distance_request& distance = options.voxelize.distance.emplace();
    distance.sign = *std::exchange(options.voxelize.solid, std::nullopt);
    distance.is_signed = !raw.is_unsigned;
    distance.at_corners = raw.corners;
    distance.iso = raw.iso;
    if (raw.is_unsigned && (raw.solid || raw.vote || raw.winding || raw.closing || !raw.close_holes.empty()))
        throw usage_error("--unsigned has no sign that --solid or a repair could decide: leave out one of them");
    if (raw.coverage) throw usage_error("--distance and --coverage do not go together: distances cover every sample");
    if (raw.extent_of_solid) throw usage_error("--solid-extent does not go with --distance: a sample is inside or not");
    if (!raw.fill.empty())
        throw usage_error("--fill does not go with --distance: colours are those of the nearest triangle");
    if (raw.iso && !std::isfinite(*raw.iso)) throw usage_error("--iso takes a finite distance");
    if (!raw.band.empty()) {
        distance.is_whole = lower(raw.band) == "whole";
        const char* const end = raw.band.data() + raw.band.size();
        const auto [last, error] = std::from_chars(raw.band.data(), end, distance.band);
        if (!distance.is_whole &&
            (error != std::errc{} || last != end || !std::isfinite(distance.band) || !(distance.band > 0)))
            throw usage_error("--band takes a number of voxels above 0, or whole, not \"" + raw.band + '"');
        if (distance.is_whole) distance.band = distance_request{}.band;
    }
    if (options.storage == storage_choice::sparse)
        throw usage_error("--sparse does not go with --distance: .nvdb and .vdb hold the band alone");
    if (options.by_slabs)
        throw usage_error("--distance is one piece of work: no --resume, and no processes that share a model");
    if (options.write.levels) throw usage_error("--levels does not go with --distance: distances have no mip levels");
    if (options.write.pieces != 0)
        for (const std::filesystem::path& output : options.outputs)
            if (lower_extension(output) == ".nvdb")
                throw usage_error("--pieces does not go with --distance and .nvdb: a level set is one grid");
}

void understand_remesh(command_line& options, const raw_options& raw) {
    const std::pair<const char*, bool> given[]{{"--place", raw.place.has_value()},
                                               {"--quads", raw.quads},
                                               {"--embedded", raw.embedded},
                                               {"--report", raw.report}};
    if (!raw.remesh) {
        for (const auto& [name, is_given] : given)
            if (is_given) throw usage_error(std::string(name) + " goes with --remesh");
        return;
    }
    const auto refuse = [](const char* what, const char* why) {
        throw usage_error(std::string(what) + " does not go with --remesh: " + why);
    };
    if (raw.report && !options.batch.list.empty())
        throw usage_error("--report does not go with --list: see the manifest");
    if (raw.distance) refuse("--distance", "one makes a field, the other a mesh");
    if (raw.coverage) refuse("--coverage", "what lies inside is decided at the voxels' centres");
    if (raw.extent_of_solid) refuse("--solid-extent", "a sample is inside or not");
    if (!raw.fill.empty()) refuse("--fill", "the mesh is a surface");
    if (!raw.targets.empty()) refuse("--target", "there are no voxels that would hold values");
    if (options.write.merge_faces) refuse("--merge", "it joins sides of voxels");
    if (options.write.points) refuse("--points", "they are centres of voxels");
    if (options.storage != storage_choice::automatic)
        refuse(options.storage == storage_choice::sparse ? "--sparse" : "--dense", "no voxels are kept");
    if (options.by_slabs)
        throw usage_error("--remesh is one piece of work: no --resume, and no processes that share a model");
    for (const std::filesystem::path& output : options.outputs)
        if (output.filename().string().find(layer_place) != std::string::npos)
            throw usage_error("\"" + output.string() + "\": {z} is the number of a layer, and a mesh is one file");
        else if (!writes_surface(output))
            throw usage_error("--remesh makes a mesh: \"" + output.string() +
                              "\" is none; there are .glb, .ply, .stl, .obj, .3mf and .npz");
    if (raw.iso && !std::isfinite(*raw.iso)) throw usage_error("--iso takes a finite distance");
    remesh_request& remesh = options.voxelize.remesh.emplace();
    remesh.sign = *std::exchange(options.voxelize.solid, std::nullopt);
    remesh.place = raw.place.value_or(voxelpipe::place::sharp);
    remesh.level = raw.iso.value_or(0);
    remesh.quads = raw.quads;
    remesh.embedded = raw.embedded;
    remesh.reports = raw.report;
}

void understand_grid(command_line& options, const raw_options& raw) {
    if (!raw.resolution.empty()) {
        const std::vector<int> n = parse_list<int>("--resolution", raw.resolution, 1);
        if (n.size() == 1)
            options.grid.resolution = n[0];
        else
            options.grid.box = glm::ivec3(n[0], n[1], n[2]);
    }
    if (!raw.voxel_size.empty()) options.grid.voxel_size = parse_point("--voxel-size", raw.voxel_size, 1);
    if (!raw.origin.empty()) options.grid.origin = parse_point("--origin", raw.origin, 3);
    if (!raw.extent.empty()) {
        const std::vector<int> n = parse_list<int>("--extent", raw.extent, 3);
        options.grid.extent = glm::ivec3(n[0], n[1], n[2]);
    }
    // Errors of the grid that need no model to be seen.
    bounding_box unit;
    unit.high = glm::dvec3(1);
    try {
        grid_request probe = options.grid;
        options.grid.coverage = options.voxelize.coverage;
        if (probe.voxel_size && !probe.origin && !probe.extent) unit.high = *probe.voxel_size;
        (void)place_grid(probe, unit);
    } catch (const grid_error& error) {
        throw usage_error(error.what());
    }
}

void understand_outputs(command_line& options, const raw_options& raw) {
    bool shows_colors = false;
    bool needs_occupancy = false;
    for (const std::filesystem::path& output : options.outputs) {
        if (output == "-") throw usage_error("-o -: standard output needs its format before a colon, as in -o npy:-");
        const format* found = find_format(output);
        if (found == nullptr && lower_extension(output).starts_with(layer_place))
            throw usage_error("\"" + output.string() +
                              "\": {z} is the number of a layer, and only .png is a file for each layer");
        if (found == nullptr && lower_extension(output) == ".vdb")
            throw usage_error("\"" + output.string() +
                              "\": this program was built without OpenVDB (libopenvdb-dev); .nvdb needs no library");
        if (found == nullptr) {
            throw usage_error("\"" + output.string() + "\": the extension of an output must be one of " +
                              names(formats(), &format::extension));
        }
        if (is_standard_output(output)) {
            if (std::count_if(options.outputs.begin(), options.outputs.end(), is_standard_output) > 1)
                throw usage_error("\"" + output.string() + "\": standard output takes one output");
            if (const std::string_view why = why_no_stream(*found); !why.empty())
                throw usage_error("\"" + output.string() + "\": " + std::string(found->extension) +
                                  " cannot go to standard output: " + std::string(why));
            if (os::is_terminal(1))
                throw usage_error("\"" + output.string() + "\": standard output is a terminal; redirect it");
        }
        if (std::count(options.outputs.begin(), options.outputs.end(), output) > 1)
            throw usage_error("\"" + output.string() + "\" is given twice");
        // Now, not when all is computed.
        if (const auto& size = options.grid.voxel_size;
            size && found->needs_cubes && !are_cubic({size->x, size->y, size->z}))
            throw usage_error("\"" + output.string() + "\": " + std::string(found->extension) +
                              " has one voxel size for all axes, --voxel-size has several");
        const bool is_chosen = found->has_threshold && raw.threshold; // by the fractions
        needs_occupancy = needs_occupancy || (found->needs_occupancy && !is_chosen);
        shows_colors = shows_colors || found->shows_colors;
    }
    const auto require = [&](bool given, const char* option, const char* what, const char* who, bool format::*has) {
        if (given && std::none_of(options.outputs.begin(), options.outputs.end(),
                                  [&](const auto& output) { return find_format(output)->*has; }))
            throw usage_error(std::string(option) + ": " + lower_extension(options.outputs.front()) + " has no " +
                              what + "; " + who);
    };
    require(options.write.levels, "--levels", "levels", ".zarr has", &format::has_levels);
    require(options.write.pieces != 0, "--pieces", "pieces", ".pvti and .nvdb have", &format::has_pieces);
    require(options.write.slice_bits != 0, "--slice-bits", "slices", "{z}.png has", &format::has_layers);
    require(raw.half, "--half", "numbers of 16 bits", ".npy, .npz and .zarr have", &format::has_halves);
    require(raw.space.has_value(), "--space", "axes of patients", ".nrrd, .nii and .nii.gz have", &format::has_space);
    options.write.half_distances = raw.half;
    options.write.space = raw.space.value_or(patient_axes::lps);
    require(!options.block_file.empty(), "--blocks", "blocks", ".schem and .litematic have", &format::has_blocks);
    require(raw.threshold.has_value(), "--threshold", "hexahedra", ".vtu, .inp and .msh have", &format::has_threshold);
    if (raw.threshold && !(*raw.threshold > 0 && *raw.threshold <= 1))
        throw usage_error("--threshold takes a fraction above 0 and up to 1");
    options.write.threshold = raw.threshold.value_or(0);
    if (!options.block_file.empty()) {
        try {
            options.blocks = std::make_shared<block_list>(read_block_list(options.block_file));
        } catch (const block_list_error& error) {
            throw usage_error(std::string("--blocks ") + error.what());
        }
    }
    if (options.max_memory != 0)
        options.write.piece_bytes = std::min(options.write.piece_bytes, options.max_memory / 4);
    std::vector<target>& targets = options.voxelize.targets;
    targets.clear();
    for (const std::string& name : raw.targets) {
        const std::optional<target> id = target_named(lower(name));
        if (!id) throw usage_error("--target \"" + name + "\" is not one of " + names(all_targets, &target_info::name));
        if (!options.voxelize.distance && (*id == target::distance || *id == target::nearest))
            throw usage_error("--target " + lower(name) + " goes with --distance");
        if (options.voxelize.distance && !is_of_nearest(*id))
            throw usage_error("--target " + lower(name) +
                              " does not go with --distance; beside it there are color, normal, material, triangle, "
                              "depth and nearest, those of the nearest triangle");
        if (std::find(targets.begin(), targets.end(), *id) == targets.end()) targets.push_back(*id);
    }
    // What a picture shows (find_shown() of preview.hpp): colours, or else the first of the other values.
    const auto has_values = [](target id) { return id != target::occupancy && id != target::distance; };
    const auto pictured = std::find_if(targets.begin(), targets.end(), has_values);
    const bool shows_values = !raw.no_color && std::none_of(targets.begin(), targets.end(), is_color);
    for (const target id : targets) {
        const std::string_view name = info_of(id).name;
        const bool held = std::any_of(options.outputs.begin(), options.outputs.end(), [&](const auto& output) {
            const format* const found = find_format(output);
            return id == target::occupancy || id == target::distance || found->all_channels ||
                   (found->shows_colors && is_color(id)) || (found->has_materials && id == target::material) ||
                   (found->has_threshold && raw.threshold && id == target::fraction) ||
                   (found->extension == ".png" && shows_values && id == *pictured);
        });
        if (!held)
            options.warnings.push_back("--target " + std::string(name) +
                                       " is in none of the outputs: their formats hold no such values");
    }
    if (options.voxelize.distance) {
        std::erase(targets, target::distance);
        targets.insert(targets.begin(), target::distance);
        needs_occupancy = false; // the level stands for it
    }
    if (options.voxelize.remesh) needs_occupancy = false;
    if (targets.empty()) {
        targets.push_back(target::occupancy);
        if (options.voxelize.remesh) // a mesh has colours unless all of them are .stl
            shows_colors = std::any_of(options.outputs.begin(), options.outputs.end(),
                                       [](const auto& output) { return lower_extension(output) != ".stl"; });
        if (shows_colors && !raw.no_color) options.implied.push_back(target::color);
    }
    for (const std::filesystem::path& output : options.outputs)
        if (find_format(output)->has_layers &&
            (targets.size() != 1 || (targets[0] != target::occupancy && targets[0] != target::fraction)))
            throw usage_error("\"" + output.string() +
                              "\": slices hold one target, which is occupancy or fraction: name it by --target");
    if (options.blocks && !options.blocks->materials.empty() &&
        std::find(targets.begin(), targets.end(), target::material) == targets.end())
        options.implied.push_back(target::material);
    if (needs_occupancy && std::find(targets.begin(), targets.end(), target::occupancy) == targets.end())
        options.implied.push_back(target::occupancy);
    targets.insert(targets.end(), options.implied.begin(), options.implied.end());
    options.load.gltf.colors = options.voxelize.wants_colors();
    options.load.gltf.blend_cuts = options.voxelize.alpha == blend_alpha::cutoff;
}

namespace {

// Links are lists of their own.
void understand_links(command_line& options, const raw_options& raw) {
    voxelize_request& request = options.voxelize;
    if (const int links = raw.neighbours.value_or(18); links != 18 && links != 26)
        throw usage_error("--neighbours is 18 or 26, not " + std::to_string(links));
    request.neighbours = raw.neighbours.value_or(18);
    for (const std::filesystem::path& output : options.outputs)
        if (const std::string_view of = find_format(output)->extension; of != ".npy" && of != ".npz")
            throw usage_error('"' + output.string() +
                              "\": it holds voxels; .npz and .npy take the lists of --target links");
    for (const target id : request.targets)
        if (!is_of_links(id))
            throw usage_error("--target links lists the ends of links: link_triangle and link_material go with it, " +
                              std::string(info_of(id).name) + " does not");
    if (!request.wants(target::links))
        throw usage_error("--target " + name_of_cells(request) + " goes with --target links");
    if (request.solid) throw usage_error("--solid and --target links do not go together: the surface is crossed");
    if (!raw.close_holes.empty())
        throw usage_error("--close-holes and --target links do not go together: the model is crossed as it is");
    if (options.storage == storage_choice::dense)
        throw usage_error("--dense and --target links do not go together: links are lists");
    options.storage = storage_choice::sparse;
}

} // namespace

namespace {

// Fractions of the outside, where there are fractions or apertures and every voxel is kept.
void check_outside(const command_line& options) {
    const voxelize_request& request = options.voxelize;
    if (std::none_of(request.targets.begin(), request.targets.end(),
                     [](target id) { return id == target::fraction || axis_of_faces(id) >= 0; }))
        throw usage_error("--outside goes with --target fraction, aperture_x, aperture_y and aperture_z");
    if (request.wants(target::centroid))
        throw usage_error("--outside and --target centroid do not go together: it is that of the part inside, from "
                          "which docs/solvers.md has that of the other part");
    if (options.storage == storage_choice::sparse)
        throw usage_error("--outside and --sparse do not go together: sparse grids leave out what is outside");
    for (const std::filesystem::path& output : options.outputs)
        if (find_format(output)->only_sparse)
            throw usage_error('"' + output.string() +
                              "\": it holds occupied voxels alone, and --outside is about all others");
}

} // namespace

void understand_fractions(command_line& options, const raw_options& raw) {
    const voxelize_request& request = options.voxelize;
    if (request.outside) check_outside(options);
    if (!raw.close_holes.empty() && !request.solid && !request.distance && !request.remesh && !request.wants_cells())
        throw usage_error("--close-holes goes with --solid, or with --target fraction and its like");
    if (raw.neighbours && !request.wants_links()) throw usage_error("--neighbours goes with --target links");
    if (!request.wants(target::fraction)) {
        if (request.clamp) throw usage_error("--clamp goes with --target fraction");
        if (raw.threshold) throw usage_error("--threshold goes with --target fraction");
        if (!request.wants_cells()) return;
    }
    const std::string name = "--target " + name_of_cells(request), together = " and " + name + " do not go together: ";
    if (raw.coverage)
        throw usage_error(
            "--coverage" + together +
            (request.wants_links() ? "links lead from each voxel's centre" : "a voxel's whole volume is measured"));
    if (request.solid) {
        if (request.solid->rule != solid_rule::nonzero)
            throw usage_error(std::string("--solid ") + to_string(request.solid->rule) + together +
                              "a voxel is measured by winding numbers, as they are. --solid nonzero beside it "
                              "decides on the other targets");
        if (request.solid->vote) throw usage_error("--vote" + together + "a voxel is measured by winding numbers");
        if (request.solid->winding)
            throw usage_error("--winding" + together + "a voxel is measured by whole winding numbers");
    }
    if (!raw.close_holes.empty()) options.voxelize.close_holes = edges_of_holes(raw);
    if (request.alpha == blend_alpha::cutoff)
        throw usage_error("--alpha cutoff" + together + "what is inside follows from whole triangles");
    if (request.wants_links()) {
        understand_links(options, raw);
    } else if (options.storage == storage_choice::sparse) {
        // What .nvdb and .vdb ask for is what their grid of fractions has.
        if (std::find(options.implied.begin(), options.implied.end(), target::occupancy) != options.implied.end() &&
            std::all_of(options.outputs.begin(), options.outputs.end(), [](const auto& output) {
                return find_format(output)->only_sparse || !find_format(output)->needs_occupancy;
            })) {
            std::erase(options.voxelize.targets, target::occupancy);
            std::erase(options.implied, target::occupancy);
        }
        for (const std::filesystem::path& output : options.outputs)
            if (find_format(output)->needs_occupancy && !find_format(output)->only_sparse &&
                std::find(options.implied.begin(), options.implied.end(), target::occupancy) != options.implied.end())
                throw usage_error(
                    '"' + output.string() +
                    "\": it shows occupied voxels, which --sparse with cut cells does not hold: leave out "
                    "--sparse");
        for (const target id : request.targets)
            if (id != target::fraction && id != target::area && id != target::centroid)
                throw usage_error("--sparse with cut cells takes the targets fraction, area and centroid alone, not " +
                                  std::string(info_of(id).name));
        if (request.solid)
            throw usage_error("--sparse, --solid and " + name +
                              " do not go together: sparse fractions are lists of their own");
        if (raw.threshold)
            throw usage_error("--sparse and --threshold do not go together: hexahedra take a dense grid");
    }
    if (options.by_slabs)
        throw usage_error(name + " is one piece of work: no --resume, and no processes that share a model");
    if (options.write.levels) throw usage_error("--levels" + together + "cut cells have no mip levels");
    for (const target id : request.targets) {
        if (axis_of_faces(id) < 0) continue;
        for (const std::filesystem::path& output : options.outputs)
            if (!find_format(output)->has_faces) {
                std::string others;
                for (const format& each : formats())
                    if (each.has_faces) others += (others.empty() ? "" : ", ") + std::string(each.extension);
                throw usage_error('"' + output.string() + "\": it holds voxels; the faces of --target " +
                                  std::string(info_of(id).name) + " go into " + others);
            }
    }
    for (const std::filesystem::path& output : options.outputs) {
        const format& f = *find_format(output);
        const bool is_chosen = (f.has_threshold && raw.threshold) || // by the fractions
                               (f.only_sparse && options.storage == storage_choice::sparse);
        if ((f.only_sparse || f.has_threshold) && !is_chosen && !request.solid)
            throw usage_error('"' + output.string() +
                              "\": it holds occupied voxels alone, which are those of the surface; --solid nonzero "
                              "beside " +
                              name + " adds the inside" +
                              (f.has_threshold && request.wants(target::fraction)
                                   ? ", --threshold takes voxels by their fractions"
                               : f.only_sparse ? ", --sparse takes what is cut or inside"
                                               : ""));
    }
}

void understand_picture(command_line& options, const raw_options& raw) {
    preview_options& picture = options.write.preview;
    if (!raw.image_size.empty()) {
        const char* const end = raw.image_size.data() + raw.image_size.size();
        const auto [middle, first] = std::from_chars(raw.image_size.data(), end, picture.width);
        const bool cross = first == std::errc{} && middle != end && *middle == 'x';
        const auto [last, second] = cross ? std::from_chars(middle + 1, end, picture.height)
                                          : std::from_chars_result{middle, std::errc::invalid_argument};
        if (second != std::errc{} || last != end || picture.width < 1 || picture.width > 16384 || picture.height < 1 ||
            picture.height > 16384)
            throw usage_error("--image-size takes WIDTHxHEIGHT from 1x1 to 16384x16384, not \"" + raw.image_size + '"');
    }
    if (!raw.background.empty()) {
        const std::optional<background> chosen = parse_background(raw.background);
        if (!chosen)
            throw usage_error("--background takes sky, white, dark, transparent, #rrggbb, or #rrggbb,#rrggbb from top "
                              "to bottom, not \"" +
                              raw.background + '"');
        picture.backdrop = *chosen;
    }
    picture.use_color = !raw.no_color;
    picture.edges = !raw.no_edges;
    picture.ground = !raw.no_ground;
    picture.up = options.write.up;
    picture.threads = options.voxelize.threads;
    options.write.threads = options.voxelize.threads;
    options.load.gltf.threads = options.voxelize.threads;
}

} // namespace voxelize
