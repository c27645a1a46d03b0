// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Many models in one run. Each is the work of a process of its own, so that whatever a model does ends that process
// alone. A manifest beside the outputs has a JSON object a line for each model that came to an end, and tells a later
// run what is finished.

#include "command_line.hpp"

#include <filesystem>
#include <istream>
#include <string>
#include <vector>

namespace voxelize {

// A model of a list and its name in outputs.
struct listed_model {
    std::filesystem::path input;
    std::string name;
};

// The models of a list, one a line, in UTF-8. A byte order mark, blanks around paths, blank lines and lines that begin
// with '#' are passed over. A name is the file's without its extension. Where it was taken before, it gets -2, -3, ...,
// the first that no model of the list has. Throws model_error with the bare reason for text in UTF-16.
[[nodiscard]] std::vector<listed_model> read_list(std::istream& list);

// A name that two runs share if they do the same work on a model: it stands for every option that can change a byte,
// and for the sizes and times of the file and of those that it names.
[[nodiscard]] std::string work_of(const command_line& options, const std::filesystem::path& model);

// PATH with NAME for every {name}.
[[nodiscard]] std::filesystem::path with_name(const std::filesystem::path& path, const std::string& name);

// The folder of the manifest: that of the first output, without what {name} has a part in.
[[nodiscard]] std::filesystem::path manifest_folder(const std::filesystem::path& output);

// Runs all models of this rank that are not finished. Returns the exit code: that of all, or exit_input if a model
// failed. Throws std::runtime_error where list or manifest cannot be used.
[[nodiscard]] int run_batch(const command_line& options);

} // namespace voxelize
