// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A grey picture of each layer of voxels along z, for printers and for what reads stacks of pictures: "FOLDER/{z}.png"
// is FOLDER/0000.png and so on, the layer's number with four digits or more. A pixel is a voxel, linear (gAMA 1); x
// runs to the right and y upwards, as a layer is seen from above.
//
// Occupied voxels are white. Floats are the share of white: what is below 0 is black and what is above 1 is white; NaN
// is black. Bytes and 16-bit integers are what the pixels hold.

#include "formats.hpp"

namespace voxelize {

// A volume of one channel of one component. 8 or 16 bits a pixel as write_options::slice_bits says, without it 16 for
// floats and 8 for bits. Files get their names 256 at a time: where the disk refuses one, those of earlier 256 stay.
// Throws write_error.
std::vector<std::filesystem::path> write_slices(const volume& v, const std::filesystem::path& path,
                                                const write_options& options);

// The name of every slice; of the first alone where the extent is not known.
[[nodiscard]] written_names slice_names(const volume& shape, const std::filesystem::path& path,
                                        const write_options& options, held_as held);

} // namespace voxelize
