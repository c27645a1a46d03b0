// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The shaded picture of preview.hpp as a PNG file: 8 bits a channel, RGB, or RGBA where the background is transparent.

#include "formats.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_png(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

// The picture that RENDER draws with the picture's options.
std::vector<std::filesystem::path> write_picture(const std::filesystem::path& path, const write_options& options,
                                                 const std::function<image(const preview_options&)>& render);

} // namespace voxelize
