// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The names of the files that a run writes, compared with those of the files that it reads (output_check.hpp).

#include "command_line.hpp"
#include "output_check.hpp"

#include <filesystem>
#include <set>

namespace voxelize {

// The files that the options' output becomes; request: with the targets, and with the grid or an extent of 0, which is
// not known yet.
[[nodiscard]] written_names names_of_output(const command_line& options, const voxelize_request& request,
                                            const std::filesystem::path& output, held_as held);

// Refuses outputs of one model that would replace a file of the model or each other, and a .zarr that this tool did not
// write. named: the files that the model names, relative to its folder. known: what else the run reads and writes,
// these outputs among it, to which the model's files are added; may be null. Throws output_conflict and write_error.
void check_outputs(const command_line& options, const voxelize_request& request,
                   const std::set<std::filesystem::path>& named, held_as held, output_check* known);

} // namespace voxelize
