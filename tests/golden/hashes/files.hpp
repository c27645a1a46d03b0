// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The models that the tool's cases read, and hashes of the files that it writes.

#include <string>

namespace golden {

// Writes model.glb, model.obj with model.mtl, model.stl and model.ply, and open.stl, which has holes: the same bytes on
// every machine. Returns the exit code, 1 with a message where a file cannot be written.
int write_models(const std::string& folder);

// Prints `name hash` of a file, or of all files below a folder with their names, in the order of these. The content of
// .png, of gzip and of the data in .html is hashed as it is after inflating, for compressors differ; of .html nothing
// but its data and their description. Other files count byte for byte. Returns the exit code, 1 with a message where
// a file cannot be read or has no such form.
int print_file(const std::string& name, const std::string& path);

} // namespace golden
