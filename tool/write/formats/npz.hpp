// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// NumPy's .npz: a zip archive with one CHANNEL.npy for each channel, as numpy.savez or, with compression,
// numpy.savez_compressed writes it. Zip64 throughout, so an array may pass 4 GiB. Time stamps are fixed: the same
// volume gives the same bytes.

#include "formats.hpp"

#include <filesystem>
#include <vector>

namespace voxelize {

std::vector<std::filesystem::path> write_npz(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
