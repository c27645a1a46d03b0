// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// voxelize INPUT.glb -o OUT... [options]: turns a glTF model into voxels. See --help.
#include "model/memory.hpp"
#include "model/model_error.hpp"
#include "model/system.hpp"
#include "run/batch.hpp"
#include "run/command_line.hpp"
#include "run/output_check.hpp"
#include "run/run_model.hpp"
#include "write/formats/output_file.hpp"

#include <algorithm>
#include <chrono>
#include <iostream>

namespace voxelize {
namespace {

int fail(exit_code code, const std::string& why) {
    std::cerr << "voxelize: " << why << '\n';
    return code;
}

void print_warnings(const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings) std::cerr << "voxelize: warning: " << warning << '\n';
}

bool writes_standard_output(const command_line& options) {
    return std::any_of(options.outputs.begin(), options.outputs.end(), is_standard_output);
}

void print(const command_line& options, const run_report& report) {
    // Where standard output is an output, everything else goes to standard error.
    std::ostream& out = writes_standard_output(options) ? std::cerr : std::cout;
    if (!options.quiet) {
        print_warnings(report.warnings);
        // Standard output belongs to the object where one is asked for.
        std::ostream& stream = options.stats == stats_format::json ? std::cerr : out;
        const glm::ivec3 extent = report.request.grid.extent;
        for (const std::filesystem::path& file : report.files) stream << "wrote " << file.string() << '\n';
        if (report.surface) {
            const voxelpipe::surface_counters& c = report.surface->counts;
            stream << c.vertices << " vertices and " << c.faces << " faces on a grid of " << extent.x << " x "
                   << extent.y << " x " << extent.z << '\n';
            if (report.request.remesh->reports)
                stream << c.components << (c.components == 1 ? " component" : " components")
                       << ", Euler characteristic " << report.surface->euler << ", " << c.made_crossings
                       << " made crossings, " << c.cone_crossings << " crossings on closed holes\n";
            if (report.request.remesh->reports && report.request.remesh->embedded)
                stream << c.intersecting_pairs << " pairs of triangles intersect; " << c.moved_vertices
                       << " vertices were moved in " << c.embed_rounds << " rounds\n";
        } else if (!report.files.empty())
            stream << report.stats.voxels << " of " << extent.x << " x " << extent.y << " x " << extent.z
                   << (report.request.distance ? " samples lie in the band\n" : " voxels are covered\n");
        if (report.is_sparse && report.bricks != 0)
            stream << "they lie in " << report.bricks << " bricks of 8 x 8 x 8, "
                   << memory::mebibytes(static_cast<double>(report.brick_bytes)) << " with their values\n";
    }
    if (options.stats == stats_format::text) print_text(out, report);
    if (options.stats == stats_format::json) print_json(out, report);
}

int run_main(int argc, char** argv) {
    const auto begin = std::chrono::steady_clock::now();
    command_line options;
    try {
        options = parse_command_line(argc, argv);
    } catch (const early_exit& text) {
        std::cout << text.text;
        return exit_ok;
    } catch (const usage_error& error) {
        return fail(exit_usage, std::string(error.what()) + "\nTry: voxelize --help");
    }
    if (!options.batch.list.empty()) {
        try {
            return run_batch(options);
        } catch (const output_conflict& error) {
            return fail(exit_usage, error.what());
        } catch (const model_error& error) {
            return fail(exit_input, error.what());
        } catch (const std::exception& error) {
            return fail(exit_output, error.what());
        }
    }
    if (writes_standard_output(options)) os::keep_running_without_reader();
    memory::set_limit(options.max_memory, options.max_memory != 0);
    const run_outcome result = run_model(options, begin);
    if (result.code == exit_ok) {
        print(options, result.report);
        return exit_ok;
    }
    if (!options.quiet && result.code == exit_input) print_warnings(result.report.warnings);
    return fail(result.code, result.error);
}

} // namespace
} // namespace voxelize

int main(int argc, char** argv) {
    voxelize::os::begin_program(argc, argv);
    return voxelize::run_main(argc, argv);
}
