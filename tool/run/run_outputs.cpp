// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "run_outputs.hpp"

#include "model/volume.hpp"
#include "read/assimp/file_name.hpp"
#include "read/named_files.hpp"

#include <cstddef>
#include <string>

namespace voxelize {

namespace fs = std::filesystem;

written_names names_of_output(const command_line& options, const voxelize_request& request, const fs::path& output,
                              held_as held) {
    const format* const found = find_format(output);
    // As write_output() of run_model.cpp has it.
    const bool leaves_implied = found != nullptr && found->all_channels && !found->needs_occupancy;
    const std::size_t count = request.targets.size() - (leaves_implied ? options.implied.size() : 0);
    volume shape;
    for (std::size_t a = 0; a < 3; ++a) shape.extent[a] = request.grid.extent[static_cast<int>(a)];
    for (std::size_t t = 0; t < count; ++t) {
        const target_info& info = info_of(request.targets[t]);
        volume* holder = &shape;
        if (const int axis = axis_of_faces(info.id); axis >= 0) {
            holder = &shape.faces.emplace_back();
            holder->extent = shape.extent;
            ++holder->extent[static_cast<std::size_t>(axis)];
        }
        holder->channels.push_back({std::string(info.name), info.type, info.components, {}});
    }
    return names_of(shape, output, options.write, held);
}

void check_outputs(const command_line& options, const voxelize_request& request, const std::set<fs::path>& named,
                   held_as held, output_check* known) {
    output_check own(options.outputs);
    output_check& check = known != nullptr ? *known : own;
    const fs::path folder = options.input.parent_path();
    check.add_input(options.input, "the model '" + options.input.string() + '\'');
    for (const fs::path& file : named) {
        check.add_named(folder / file, options.input);
        if (assimp::lower_extension(file) != ".mtl") continue;
        for (const fs::path& picture : named_pictures(folder / file, folder)) check.add_named(picture, options.input);
    }
    if (!options.block_file.empty())
        check.add_input(options.block_file, "the list of blocks '" + options.block_file.string() + '\'');
    for (const fs::path& output : options.outputs) {
        if (!request.remesh)
            check_extent(output, {request.grid.extent.x, request.grid.extent.y, request.grid.extent.z});
        if (is_standard_output(output)) {
            if (names_of_output(options, request, output, held).files.size() > 1)
                throw output_conflict("output '" + output.string() +
                                      "' is standard output, which holds one file: name one --target");
            written_names names; // which may be the file of another output
            names.files.emplace_back("/dev/stdout");
            check.add_output(output, names, known != nullptr);
            continue;
        }
        check.add_output(output, names_of_output(options, request, output, held), known != nullptr);
        check_replaceable(output);
    }
}

} // namespace voxelize
