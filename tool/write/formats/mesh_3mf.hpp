// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The package of a .3mf around the text of its objects.

#include "output_file.hpp"
#include "zip.hpp"

#include <cstdint>
#include <functional>
#include <string>

namespace voxelize {

// Appends a colour of a colour group; rgb: sRGB bytes, red lowest.
void add_3mf_color(std::string& text, std::uint32_t rgb);

// `objects` hands over the text of object 1, or is not called where the model is empty. `is_large`: that may have 4 GiB
// or more. The caller commits the file. Throws write_error.
void write_3mf_package(output_file& out, int compression, bool is_large, bool is_empty,
                       const std::function<void(const entry_sink&)>& objects);

} // namespace voxelize
